//! The videos of a recording: those of a LeRobot set, and a file of the recording's name beside it.

use super::labels::beside;
use std::fs::File;
use std::path::PathBuf;
use teachtree_base::error::InputError;
use teachtree_logs::allowed_folders::{AllowedFolders, LogFolders};
use teachtree_session::Log;
use teachtree_session::LogInternals;

/// Endings of files beside a recording, with their media types.
const KINDS: [(&str, &str); 3] = [("mp4", "video/mp4"), ("webm", "video/webm"), ("m4v", "video/mp4")];

/// A video of a recording.
pub struct Video {
    /// The name of the camera.
    pub camera: String,
    /// The file.
    pub file: PathBuf,
    /// What is added to a time of the recording for the time in the file, s.
    pub offset_s: f64,
    /// The folders that may contain the file.
    folders: AllowedFolders,
}

impl Video {
    /// Opens the file.
    ///
    /// # Errors
    /// The file cannot be opened, or is a link out of the recording's folder.
    pub fn open(&self) -> Result<File, InputError> {
        self.folders.open(&self.file)
    }

    /// The media type.
    pub fn kind(&self) -> &'static str {
        let is_of =
            |(ending, _): &&(&str, &str)| self.file.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending));
        KINDS.iter().find(is_of).map_or("video/mp4", |(_, kind)| kind)
    }
}

/// Returns the videos of a recording whose files must be in `folders`.
///
/// # Errors
/// The data set is invalid, or a file of it is outside of the folders.
pub fn videos(log: &Log, folders: &LogFolders) -> Result<Vec<Video>, InputError> {
    let mut found = of_set(log, &folders.log)?;
    let folders = &folders.beside;
    let own = KINDS.iter().map(|(ending, _)| beside(log.path(), ending));
    // A file that cannot be opened is rejected by name.
    let own = own.filter(|file| file.symlink_metadata().is_ok_and(|there| !there.is_dir()));
    found.extend(own.map(|file| Video { camera: "video".into(), file, offset_s: 0.0, folders: folders.clone() }));
    Ok(found)
}

fn of_set(log: &Log, folders: &AllowedFolders) -> Result<Vec<Video>, InputError> {
    use teachtree_logs::read::formats;
    use teachtree_logs::read::formats::lerobot::video::Video as Stored;
    let folder = formats::without_episode(log.path());
    if !formats::is_set(&folder) {
        return Ok(Vec::new());
    }
    let episode = formats::recording_of(log.path());
    let videos = formats::lerobot::video::videos(&folder, episode.as_deref(), folders)?;
    // Stamps of a set begin at 0 with each episode.
    let zero = log.opened().map_or(0.0, |opened| opened.zero_stamp_s);
    let shown =
        |it: Stored| Video { camera: it.camera, file: it.file, offset_s: it.from_s + zero, folders: folders.clone() };
    Ok(videos.into_iter().map(shown).collect())
}
