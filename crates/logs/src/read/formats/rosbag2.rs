//! Bags of ROS 2 as their recorder leaves them: a folder with `metadata.yaml` and files of one storage, `mcap` or `sqlite3`.

use super::mcap;
use super::topics::Topics;
use crate::allowed_folders::AllowedFolders;
use crate::read::table::Source;
use crate::read::text;
use serde::Deserialize;
use std::path::{Component, Path, PathBuf};
use teachtree_base::error::InputError;
use teachtree_base::yaml;

/// The metadata file of a recorder.
#[derive(Deserialize)]
pub(super) struct Metadata {
    pub(super) rosbag2_bagfile_information: Information,
}

#[derive(Deserialize)]
pub(super) struct Information {
    pub(super) relative_file_paths: Vec<String>,
    storage_identifier: String,
}

/// Reads a folder with `metadata.yaml`, whose files are one log and must be in `folders`.
///
/// # Errors
/// A file is missing or damaged, or no topic can be read.
pub(super) fn folder(folder: &Path, folders: &AllowedFolders) -> Result<Source, InputError> {
    let mut topics = Topics::new(folder.display().to_string());
    let mut cut = None;
    for part in parts(folder, folders)? {
        cut = match part {
            #[cfg(feature = "db3")]
            Part::Sqlite(path) => super::db3::read(&path, &mut topics)?,
            Part::Mcap(path) => mcap::read(folders.open(&path)?, &path.display().to_string(), &mut topics)?,
        }
        .or(cut);
    }
    super::finish(topics, cut)
}

/// A file of a bag.
pub(super) enum Part {
    Mcap(PathBuf),
    #[cfg(feature = "db3")]
    Sqlite(PathBuf),
}

/// The files of a folder with `metadata.yaml`, in their order; they must be in `folders`.
///
/// # Errors
/// The list cannot be read, or names another storage or a file elsewhere.
pub(super) fn parts(folder: &Path, folders: &AllowedFolders) -> Result<Vec<Part>, InputError> {
    let path = folder.join("metadata.yaml");
    let name = path.display().to_string();
    let text = text::whole(&folders.open(&path)?, &path, yaml::MAX_BYTES as u64)?;
    let Metadata { rosbag2_bagfile_information: information } = yaml::read(&text, &name)?;
    let storage = information.storage_identifier.as_str();
    if storage == "sqlite3" && cfg!(not(feature = "db3")) {
        let message = "found a bag stored as `sqlite3`, and this build cannot read it: its feature `db3` is off";
        return Err(InputError::new(name, message));
    }
    if !matches!(storage, "mcap" | "sqlite3") {
        return Err(InputError::new(name, format!("found a bag stored as `{storage}`, expected `mcap` or `sqlite3`"))
            .help("convert the bag with `ros2 bag convert` to MCAP"));
    }
    let part = |file: &String| {
        if !Path::new(file).components().all(|part| matches!(part, Component::Normal(_))) {
            return Err(InputError::new(&name, format!("`{file}` leads out of the folder")));
        }
        let path = folder.join(file);
        // Links that lead out are refused for files of both storages.
        folders.open(&path)?;
        if storage == "sqlite3" && path.extension().is_some_and(|ending| ending == "zstd") {
            let name = path.display().to_string();
            let help = format!("unpack it with `zstd -d {name}`, and name the file without `.zstd`");
            return Err(
                InputError::new(name, "found a bag that is compressed as a whole, expected a `.db3`").help(help)
            );
        }
        Ok(match storage {
            #[cfg(feature = "db3")]
            "sqlite3" => Part::Sqlite(path),
            _ => Part::Mcap(path),
        })
    };
    information.relative_file_paths.iter().map(part).collect()
}
