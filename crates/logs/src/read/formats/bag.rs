//! The messages of a bag of any kind, one by one in the order of its files.

use super::topics::MessageSink;
use super::{folder, rosbag};
use crate::allowed_folders::AllowedFolders;
use crate::read::file;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;
use teachtree_base::error::InputError;

/// Number of bytes that determine the format of a file.
const MAGIC: u64 = 16;

/// Whether a path is a bag: a file of MCAP, of ROS 1 or of SQLite, or a folder of ROS 2.
///
/// # Errors
/// The file cannot be read.
pub fn is_bag(path: &Path) -> Result<bool, InputError> {
    if path.is_dir() {
        return Ok(folder::is_bag(path));
    }
    if !path.is_file() {
        return Ok(false);
    }
    let mut magic = Vec::new();
    let read = file::open(path)?.take(MAGIC).read_to_end(&mut magic);
    read.map_err(|error| InputError::unreadable(path.display().to_string(), &error))?;
    Ok(storage(&magic).is_some())
}

/// The storage format of a bag.
#[derive(Clone, Copy)]
enum Storage {
    #[cfg(feature = "mcap")]
    Mcap,
    #[cfg(feature = "db3")]
    Sqlite,
    Ros1,
}

fn storage(magic: &[u8]) -> Option<Storage> {
    match magic {
        #[cfg(feature = "mcap")]
        [0x89, b'M', b'C', b'A', b'P', ..] => Some(Storage::Mcap),
        #[cfg(feature = "mcap")]
        magic if magic.starts_with(&super::mcap::ZSTD) => Some(Storage::Mcap),
        #[cfg(feature = "db3")]
        magic if magic.starts_with(super::db3::MAGIC) => Some(Storage::Sqlite),
        [b'#', b'R', b'O', b'S', b'B', b'A', b'G', ..] => Some(Storage::Ros1),
        _ => None,
    }
}

/// Reads the messages of a bag whose files must be in `folders`. Returns a description of its missing parts.
///
/// # Errors
/// The path is not a bag, or a file is damaged; the first error of `each`.
pub fn play(path: &Path, folders: &AllowedFolders, each: MessageSink) -> Result<Option<String>, InputError> {
    let place = path.display().to_string();
    if path.is_dir() {
        return play_folder(path, folders, each);
    }
    let mut bytes = folders.open(path)?;
    let failed = |error: std::io::Error| InputError::unreadable(&place, &error);
    let mut magic = Vec::new();
    bytes.by_ref().take(MAGIC).read_to_end(&mut magic).map_err(failed)?;
    bytes.seek(SeekFrom::Start(0)).map_err(failed)?;
    let is_cut = match storage(&magic) {
        #[cfg(feature = "mcap")]
        Some(Storage::Mcap) => super::mcap::play(bytes, &place, each)?,
        #[cfg(feature = "db3")]
        Some(Storage::Sqlite) => return super::db3::play(path, each),
        Some(Storage::Ros1) => rosbag::play(BufReader::new(bytes), &place, each)?,
        None => {
            let message = "is not a bag, expected an MCAP file or a bag of ROS 1 or ROS 2";
            return Err(InputError::new(place, message));
        }
    };
    Ok(is_cut.then(|| cut(&place)))
}

/// The message about a file that ends too early.
fn cut(place: &str) -> String {
    format!("{place} ends in the middle of a record; the records before it are read")
}

#[cfg(feature = "mcap")]
fn play_folder(path: &Path, folders: &AllowedFolders, each: MessageSink) -> Result<Option<String>, InputError> {
    use super::rosbag2::{Part, parts};
    if !folder::is_bag(path) {
        let message = "is not a bag, expected a folder with `metadata.yaml`";
        return Err(InputError::new(path.display().to_string(), message));
    }
    let mut missing = None;
    for part in parts(path, folders)? {
        missing = match part {
            #[cfg(feature = "db3")]
            Part::Sqlite(path) => super::db3::play(&path, each)?,
            Part::Mcap(path) => {
                let place = path.display().to_string();
                super::mcap::play(folders.open(&path)?, &place, each)?.then(|| cut(&place))
            }
        }
        .or(missing);
    }
    Ok(missing)
}

#[cfg(not(feature = "mcap"))]
fn play_folder(path: &Path, _: &AllowedFolders, _: MessageSink) -> Result<Option<String>, InputError> {
    Err(InputError::new(path.display().to_string(), "this build cannot read bags, its feature `mcap` is off"))
}
