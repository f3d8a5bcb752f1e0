//! The videos of an episode: a file for each camera, and where in it the episode begins.
//!
//! Version 2 has a file an episode and camera; in version 3 a file holds many episodes, and `meta/episodes` says from which time on each is.

use super::super::parquet;
use super::{Dataset, is, lists_in};
use crate::allowed_folders::AllowedFolders;
use crate::read::memory_table::Cells;
use serde_json::Value;
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;

/// A video of an episode.
#[derive(Clone, Debug, PartialEq)]
pub struct Video {
    /// The name of the camera, `observation.images.top`.
    pub camera: String,
    /// The file.
    pub file: PathBuf,
    /// The start of the episode in the file, s.
    pub from_s: f64,
}

/// The videos of an episode that are there, by the names of their cameras. The files that describe the set must be in `folders`.
///
/// # Errors
/// The set is invalid, or a file is outside of the folders.
pub fn videos(folder: &Path, episode: Option<&str>, folders: &AllowedFolders) -> Result<Vec<Video>, InputError> {
    let set = Dataset::read(folder, folders)?;
    let features = set.info.get("features").and_then(Value::as_object);
    let is_video = |feature: &Value| feature.get("dtype").and_then(Value::as_str) == Some("video");
    let cameras: Vec<&String> =
        features.into_iter().flatten().filter(|(_, feature)| is_video(feature)).map(|(name, _)| name).collect();
    let Some(template) = set.info.get("video_path").and_then(Value::as_str).filter(|_| !cameras.is_empty()) else {
        return Ok(Vec::new());
    };
    let episode = set.meant(episode)?;
    let is_v2 = set.text("codebase_version")?.starts_with("v2");
    let mut found = Vec::new();
    for camera in cameras {
        // A name with braces would be filled in once more.
        if camera.contains(['{', '}']) {
            continue;
        }
        let template = template.replace("{video_key}", camera);
        let (file, from_s) = if is_v2 {
            let chunk = episode / set.count("chunks_size")?.max(1);
            (set.path(&template, &[("episode_chunk", chunk), ("episode_index", episode)])?, 0.0)
        } else {
            let Some((chunk, file, from_s)) = listed(&set, camera, episode)? else { continue };
            (set.path(&template, &[("chunk_index", chunk), ("file_index", file)])?, from_s)
        };
        if set.folders.has(&file) {
            found.push(Video { camera: camera.clone(), file, from_s });
        }
    }
    Ok(found)
}

/// The chunk and file of a camera's video of an episode, and where in it the episode begins, s.
fn listed(set: &Dataset, camera: &str, episode: usize) -> Result<Option<(usize, usize, f64)>, InputError> {
    let key = |what: &str| format!("videos/{camera}/{what}");
    let wanted = ["episode_index".to_string(), key("chunk_index"), key("file_index"), key("from_timestamp")];
    for path in lists_in(&set.folder.join("meta").join("episodes"), &set.folders)? {
        let name = path.display().to_string();
        let list =
            parquet::read(set.folders.open(&path)?, &name, |column| wanted.iter().any(|wanted| wanted == column))?;
        let column = |name: &String| match list.columns().get(name) {
            Some(Cells::Numbers(values)) => Some(values),
            _ => None,
        };
        let [Some(episodes), Some(chunks), Some(files), Some(starts)] = wanted.each_ref().map(column) else { continue };
        let Some(row) = episodes.iter().position(|at| is(*at, episode)) else { continue };
        let whole = |values: &Vec<f64>| {
            values.get(row).filter(|value| (0.0..1e9).contains(*value)).map(|value| *value as usize)
        };
        let from_s = starts.get(row).copied().filter(|time| time.is_finite());
        if let (Some(chunk), Some(file), Some(from_s)) = (whole(chunks), whole(files), from_s) {
            return Ok(Some((chunk, file, from_s)));
        }
    }
    Ok(None)
}
