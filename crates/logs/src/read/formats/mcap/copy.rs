//! A file whose records are copied: what is known of it beforehand, and its records by time.

use super::super::rosbag2::Metadata;
use super::super::{folder, rosbag};
use super::write::{ATTACHMENT, HEADER};
use super::{CHANNEL, CHUNK, DATA_END, FOOTER, Fault, Fields, MAGIC, MESSAGE, SCHEMA, ZSTD, decompressed, record};
use crate::read::{file, text};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead, BufReader, Error, Read, Result};
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;
use teachtree_base::yaml;

/// How a bag in SQLite begins.
const SQLITE: &[u8] = b"SQLite format 3\0";

/// What a file has, found by reading it once.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct McapContents {
    profile: String,
    pub(super) schemas: BTreeSet<u16>,
    /// The topic of each channel.
    pub(super) channels: BTreeMap<u16, String>,
}

impl McapContents {
    /// Reads a file to its end, or to where it is cut off.
    ///
    /// # Errors
    /// When it is damaged.
    pub fn of(file: &Path) -> std::result::Result<Self, InputError> {
        let place = file.display().to_string();
        let damaged = |message: String| InputError::new(&place, format!("cannot be read as MCAP: {message}"));
        let mut bytes = opened(file)?;
        let mut survey = Self::default();
        match survey.records(&mut bytes) {
            Ok(()) | Err(Fault::Truncated) => Ok(survey),
            Err(Fault::Damaged(message)) => Err(damaged(message)),
            Err(Fault::Log(error)) => Err(error),
        }
    }

    fn records(&mut self, bytes: &mut impl Read) -> std::result::Result<(), Fault> {
        while let Some((kind, body)) = record(bytes)? {
            let mut fields = Fields(&body);
            match kind {
                HEADER => self.profile = fields.text()?,
                SCHEMA => {
                    self.schemas.insert(fields.u16()?);
                }
                CHANNEL => {
                    let (id, _schema, topic) = (fields.u16()?, fields.u16()?, fields.text()?);
                    self.channels.entry(id).or_insert(topic);
                }
                CHUNK => match self.records(&mut decompressed(&body)?.as_slice()) {
                    // The messages before count.
                    Ok(()) | Err(Fault::Truncated) => {}
                    Err(fault) => return Err(fault),
                },
                MESSAGE => {
                    fields.bytes(22)?;
                }
                ATTACHMENT => {
                    fields.bytes(16)?;
                }
                DATA_END | FOOTER => return Ok(()),
                _ => {}
            }
        }
        Ok(())
    }

    /// The profile of a file with these messages and those of ROS 2.
    pub(super) fn profile(&self) -> &str {
        // That of ROS 1 would say of all messages that they are its own.
        if self.profile == "ros1" { "" } else { &self.profile }
    }

    /// Whether a channel has this topic.
    pub fn has_topic(&self, topic: &str) -> bool {
        self.channels.values().any(|known| known == topic)
    }
}

/// The file of a log whose records can be copied: an MCAP file, or that of a bag of ROS 2 in a folder.
///
/// # Errors
/// When the log is no such file.
pub fn file_of(log: &Path) -> std::result::Result<PathBuf, InputError> {
    let place = log.display().to_string();
    if folder::is_bag(log) {
        let path = log.join("metadata.yaml");
        let text = text::read(&path, yaml::MAX_BYTES as u64)?;
        let metadata: Metadata = yaml::read(&text, &path.display().to_string())?;
        return match metadata.rosbag2_bagfile_information.relative_file_paths.as_slice() {
            [file] if log.join(file).is_file() => mcap_file(&log.join(file)),
            // What is missing is reported where it is opened.
            [file] => Ok(log.join(file)),
            files => {
                let message = format!("is a bag of {} files, expected one whose messages can be copied", files.len());
                Err(InputError::new(place, message).help("convert it to one file with `ros2 bag convert`"))
            }
        };
    }
    mcap_file(log)
}

/// A file whose records can be copied, by its first bytes.
fn mcap_file(log: &Path) -> std::result::Result<PathBuf, InputError> {
    let place = log.display().to_string();
    let expected = "expected an MCAP file, whose messages can be copied";
    let mut magic = vec![];
    if log.is_file() {
        file::open(log)?.take(16).read_to_end(&mut magic).map_err(|error| InputError::unreadable(&place, &error))?;
    }
    if magic.starts_with(&MAGIC) || magic.starts_with(&ZSTD) {
        return Ok(log.to_path_buf());
    }
    if magic.starts_with(rosbag::MAGIC) {
        let error = InputError::new(place, format!("is a bag of ROS 1, {expected}"));
        return Err(error.help("convert it first: `mcap convert log.bag log.mcap`"));
    }
    if magic.starts_with(SQLITE) {
        let error = InputError::new(place, format!("is a bag of ROS 2 in SQLite, {expected}"));
        return Err(error.help("convert it first with `ros2 bag convert`"));
    }
    Err(InputError::new(place, format!("is another kind of log, {expected}")))
}

/// A file, decompressed where all of it is compressed, behind its first bytes.
fn opened(path: &Path) -> std::result::Result<Box<dyn Read + Send>, InputError> {
    let mut bytes = BufReader::new(file::open(path)?);
    let begun = move || -> Result<Box<dyn Read + Send>> {
        let mut bytes: Box<dyn Read + Send> = if bytes.fill_buf()?.starts_with(&ZSTD) {
            Box::new(BufReader::new(::zstd::stream::read::Decoder::with_buffer(bytes)?))
        } else {
            Box::new(bytes)
        };
        let mut magic = [0; MAGIC.len()];
        bytes.read_exact(&mut magic)?;
        if magic == MAGIC { Ok(bytes) } else { Err(Error::other("it does not begin with the MCAP magic")) }
    };
    begun().map_err(|error| InputError::unreadable(path.display().to_string(), &error))
}

/// A record: its kind and its bytes.
pub(super) type Record = (u8, Vec<u8>);

/// The records of a file, in their order, as far as a time.
pub struct OriginalRecords {
    survey: McapContents,
    bytes: Box<dyn Read + Send>,
    /// The next record, and its time, ns: that of the first message of a chunk, 0 for what has none.
    next: Option<(u64, Record)>,
    ended: bool,
}

impl OriginalRecords {
    /// Opens a file of which this is known.
    ///
    /// # Errors
    /// When it cannot be opened.
    pub fn open(file: &Path, survey: McapContents) -> std::result::Result<Self, InputError> {
        Ok(Self { survey, bytes: opened(file)?, next: None, ended: false })
    }

    pub(super) const fn survey(&self) -> &McapContents {
        &self.survey
    }

    /// The next record, unless it is later than a time, ns.
    pub(super) fn next_until(&mut self, time: u64) -> Result<Option<Record>> {
        if self.next.is_none() && !self.ended {
            self.next = match record(&mut self.bytes) {
                Ok(Some((DATA_END | FOOTER, _)) | None) | Err(Fault::Truncated) => None,
                Ok(Some(record)) => Some((begins(&record)?, record)),
                Err(Fault::Damaged(message)) => return Err(Error::other(message)),
                Err(Fault::Log(error)) => return Err(Error::other(error.message)),
            };
            self.ended = self.next.is_none();
        }
        if self.next.as_ref().is_some_and(|(begins, _)| *begins <= time) {
            return Ok(self.next.take().map(|(_, record)| record));
        }
        Ok(None)
    }
}

/// When a record begins, ns.
fn begins((kind, body): &Record) -> Result<u64> {
    let mut fields = Fields(body);
    let time = match *kind {
        CHUNK => fields.u64(),
        MESSAGE => fields.bytes(6).and_then(|_| fields.u64()),
        _ => Ok(0),
    };
    time.map_err(|_| Error::other("a record that is copied is damaged"))
}
