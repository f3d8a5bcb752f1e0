//! The metadata of an episode in a data set: the rate, the number of frames, and the frames of its videos and pictures.

use super::super::{mp4, parquet};
use super::video::videos;
use super::{Dataset, is, lists_in, rows_of};
use crate::allowed_folders::AllowedFolders;
use crate::read::memory_table::Cells;
use crate::read::text;
use serde_json::Value;
use std::ops::Range;
use std::path::Path;
use teachtree_base::error::InputError;

/// The largest list of episodes of version 2 that is read, in bytes.
const MAX_LIST: u64 = 256 << 20;

/// Facts about an episode.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EpisodeFacts {
    /// Frames per second.
    pub fps: Option<f64>,
    /// The number of frames that the list of episodes gives.
    pub length: Option<usize>,
    /// For each video, by camera, the number of frames from the start of the episode to the end of the file.
    pub videos: Vec<(String, u64)>,
    /// For cameras, a number for each frame that only equal pictures share; of videos only where the picture seems not to change for long.
    pub pictures: Vec<(String, Vec<u64>)>,
}

/// The facts about an episode of a set whose files must be in `folders`.
///
/// # Errors
/// The set is invalid, or a file is damaged.
pub fn episode_facts(
    folder: &Path,
    episode: Option<&str>,
    folders: &AllowedFolders,
) -> Result<EpisodeFacts, InputError> {
    let set = Dataset::read(folder, folders)?;
    let number = set.meant(episode)?;
    let fps = set.info.get("fps").and_then(Value::as_f64).filter(|fps| *fps > 0.0);
    let mut facts = EpisodeFacts { fps, length: length(&set, number)?, ..EpisodeFacts::default() };
    for video in videos(folder, episode, folders)? {
        let place = video.file.display().to_string();
        let mut file = folders.open(&video.file)?;
        let found = mp4::video(&mut file).map_err(|error| InputError::unreadable(place, &error))?;
        let Some(found) = found else { continue };
        let first = (video.from_s * fps.unwrap_or(0.0)).round().max(0.0) as u64;
        let frames = found.frames.saturating_sub(first);
        let shown = facts.length.map_or(frames, |length| frames.min(length as u64));
        if !found.still.is_empty() {
            // The frames after the last still run need no number.
            let last = found.still.iter().map(|run| run.end).max().unwrap_or(0);
            let end = first.saturating_add(shown).min(last).min(first.saturating_add(MOST_PICTURES));
            let pictures = (first..end).map(|frame| picture(&found.still, frame)).collect();
            facts.pictures.push((video.camera.clone(), pictures));
        }
        facts.videos.push((video.camera, frames));
    }
    let path = set.data_file(number)?;
    let name = path.display().to_string();
    let numbers = parquet::read(folders.open(&path)?, &name, |column| column == "episode_index")?;
    let rows = rows_of(&numbers, number, &name)?.unwrap_or(0..usize::MAX);
    facts.pictures.extend(parquet::pictures::digests(folders.open(&path)?, &name, rows)?);
    Ok(facts)
}

/// A longer video is checked up to this number of frames.
const MOST_PICTURES: u64 = 10_000_000;

/// A number for the picture of a frame: one for each time in which the picture does not change, and one for each other frame.
fn picture(still: &[Range<u64>], frame: u64) -> u64 {
    still.iter().find(|range| range.contains(&frame)).map_or(frame, |range| range.start) + 1
}

/// The number of frames of an episode by the list of episodes; `None` where it does not say.
fn length(set: &Dataset, episode: usize) -> Result<Option<usize>, InputError> {
    let meta = set.folder.join("meta");
    if set.text("codebase_version")?.starts_with("v2") {
        let path = meta.join("episodes.jsonl");
        if !set.folders.has(&path) {
            return Ok(None);
        }
        let text = text::whole(&set.folders.open(&path)?, &path, MAX_LIST)?;
        let of_line = |line: &str| -> Option<usize> {
            let line: Value = serde_json::from_str(line).ok()?;
            let number = |key: &str| line.get(key)?.as_u64().and_then(|number| usize::try_from(number).ok());
            number("length").filter(|_| number("episode_index") == Some(episode))
        };
        return Ok(text.lines().find_map(of_line));
    }
    for path in lists_in(&meta.join("episodes"), &set.folders)? {
        let name = path.display().to_string();
        let wanted = ["episode_index", "length"];
        let list = parquet::read(set.folders.open(&path)?, &name, |column| wanted.contains(&column))?;
        let column = |name: &str| list.columns().get(name).and_then(Cells::numbers);
        let (Some(episodes), Some(lengths)) = (column("episode_index"), column("length")) else { continue };
        if let Some(row) = episodes.iter().position(|at| is(*at, episode)) {
            let length = lengths.get(row).filter(|length| (0.0..1e9).contains(*length));
            return Ok(length.map(|length| *length as usize));
        }
    }
    Ok(None)
}
