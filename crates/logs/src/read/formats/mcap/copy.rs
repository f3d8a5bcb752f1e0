//! Files whose records are copied: a survey of their contents, and their records by time.

use super::super::rosbag2::Metadata;
use super::super::{folder, rosbag};
use super::renumber::{Numbered, Record, Renumbering};
use super::write::{ATTACHMENT, HEADER};
use super::{CHANNEL, CHUNK, DATA_END, FOOTER, Fault, Fields, MAGIC, MESSAGE, SCHEMA, ZSTD, decompressed, record};
use crate::read::{file, text};
use std::collections::{BTreeSet, VecDeque};
use std::io::{BufRead, BufReader, Error, Read, Result};
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;
use teachtree_base::yaml;

/// The magic bytes of a bag in SQLite.
const SQLITE: &[u8] = b"SQLite format 3\0";

/// The contents of files, from one reading pass.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct McapContents {
    profile: String,
    pub(super) schemas: Numbered,
    pub(super) channels: Numbered,
    topics: BTreeSet<String>,
    files: Vec<(PathBuf, Renumbering)>,
}

impl McapContents {
    /// Reads files to their ends, or to where they are cut off.
    ///
    /// # Errors
    /// When one is damaged.
    pub fn of(files: &[PathBuf]) -> std::result::Result<Self, InputError> {
        let mut survey = Self::default();
        for file in files {
            let place = file.display().to_string();
            let damaged = |message: String| InputError::new(&place, format!("cannot be read as MCAP: {message}"));
            let mut numbers = Renumbering::default();
            match survey.records(&mut opened(file)?, &mut numbers) {
                Ok(()) | Err(Fault::Truncated) => survey.files.push((file.clone(), numbers)),
                Err(Fault::Damaged(message)) => return Err(damaged(message)),
                Err(Fault::Log(error)) => return Err(error),
            }
        }
        Ok(survey)
    }

    fn records(&mut self, bytes: &mut impl Read, numbers: &mut Renumbering) -> std::result::Result<(), Fault> {
        while let Some((kind, body)) = record(bytes)? {
            let mut fields = Fields(&body);
            match kind {
                HEADER => {
                    let profile = fields.text()?;
                    // Messages of two kinds have no common profile.
                    let is_other = !self.files.is_empty() && self.profile != profile;
                    self.profile = if is_other { String::new() } else { profile };
                }
                SCHEMA => {
                    let number = fields.u16()?;
                    numbers.schema(number, fields.0, &mut self.schemas).map_err(Fault::Damaged)?;
                }
                CHANNEL => {
                    let number = fields.u16()?;
                    numbers.channel(number, fields.0, &mut self.channels).map_err(Fault::Damaged)?;
                    fields.u16()?;
                    self.topics.insert(fields.text()?);
                }
                CHUNK => match self.records(&mut decompressed(&body)?.as_slice(), numbers) {
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
        self.topics.contains(topic)
    }
}

/// The files of a log whose records can be copied: an MCAP file, or those of a bag of ROS 2 in a folder.
///
/// # Errors
/// When the log is not such a file.
pub fn files_of(log: &Path) -> std::result::Result<Vec<PathBuf>, InputError> {
    if folder::is_bag(log) {
        let path = log.join("metadata.yaml");
        let text = text::read(&path, yaml::MAX_BYTES as u64)?;
        let metadata: Metadata = yaml::read(&text, &path.display().to_string())?;
        let files = metadata.rosbag2_bagfile_information.relative_file_paths;
        // A missing file is reported when it is opened.
        let known = |file: PathBuf| if file.is_file() { mcap_file(&file) } else { Ok(file) };
        return files.iter().map(|file| known(log.join(file))).collect();
    }
    Ok(vec![mcap_file(log)?])
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

/// A file, decompressed where all of it is compressed, after its first bytes.
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

/// The records of files, in their order, as far as a time.
pub struct OriginalRecords {
    survey: McapContents,
    /// The file that is read, among those of the survey.
    at: usize,
    bytes: Box<dyn Read + Send>,
    /// Records that were read already.
    queue: VecDeque<Record>,
    /// The next record, and its time, ns: that of the first message of a chunk, 0 for what has none.
    next: Option<(u64, Record)>,
    ended: bool,
}

impl OriginalRecords {
    /// Opens files with the results of the survey.
    ///
    /// # Errors
    /// When one cannot be opened.
    pub fn open(survey: McapContents) -> std::result::Result<Self, InputError> {
        let bytes = match survey.files.first() {
            Some((file, _)) => opened(file)?,
            None => Box::new(std::io::empty()),
        };
        Ok(Self { survey, at: 0, bytes, queue: VecDeque::new(), next: None, ended: false })
    }

    pub(super) const fn survey(&self) -> &McapContents {
        &self.survey
    }

    /// The next record, unless it is later than a time, ns.
    pub(super) fn next_until(&mut self, time: u64) -> Result<Option<Record>> {
        if self.next.is_none() && !self.ended {
            self.next = match self.read()? {
                Some(record) => Some((begins(&record)?, record)),
                None => None,
            };
            self.ended = self.next.is_none();
        }
        if self.next.as_ref().is_some_and(|(begins, _)| *begins <= time) {
            return Ok(self.next.take().map(|(_, record)| record));
        }
        Ok(None)
    }

    /// Reads the next record of the file, or of the next file after its end.
    fn read(&mut self) -> Result<Option<Record>> {
        let failed = |fault: Fault| match fault {
            Fault::Damaged(message) => Error::other(message),
            Fault::Log(error) => Error::other(error.message),
            Fault::Truncated => Error::other("a record that is copied is damaged"),
        };
        loop {
            if let Some(record) = self.queue.pop_front() {
                return Ok(Some(record));
            }
            let Some((_, numbers)) = self.survey.files.get(self.at) else { return Ok(None) };
            match record(&mut self.bytes) {
                Ok(Some((DATA_END | FOOTER, _)) | None) | Err(Fault::Truncated) => {
                    self.at += 1;
                    if let Some((file, _)) = self.survey.files.get(self.at) {
                        self.bytes = opened(file).map_err(|error| Error::other(error.to_string()))?;
                    }
                }
                Ok(Some(record)) if numbers.is_identity() => return Ok(Some(record)),
                Ok(Some(record)) => numbers.renumbered(record, &mut self.queue).map_err(failed)?,
                Err(fault) => return Err(failed(fault)),
            }
        }
    }
}

/// Returns the start of a record, ns.
fn begins((kind, body): &Record) -> Result<u64> {
    let mut fields = Fields(body);
    let time = match *kind {
        CHUNK => fields.u64(),
        MESSAGE => fields.bytes(6).and_then(|_| fields.u64()),
        _ => Ok(0),
    };
    time.map_err(|_| Error::other("a record that is copied is damaged"))
}
