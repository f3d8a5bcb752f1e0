//! MCAP: messages of ROS 2 (CDR with `ros2msg` definitions), of ROS 1, and JSON; a sheet a topic.
//!
//! Chunks may be plain, zstd or lz4. A topic in another encoding cannot be read, the others can. What is read so far counts when a file
//! ends in the middle of a record.

use super::super::table::Source;
use super::rosmsg::{Definition, Wire};
use super::topics::{Reading, Topics};
use super::truncated;
use crate::base::error::InputError;
use crate::base::yaml;
use ::mcap::McapError;
use ::mcap::records::{ChunkHeader, Record};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path};

/// The longest record that is read, in bytes.
const MAX_RECORD: u64 = 256 << 20;

/// Reads a file.
///
/// # Errors
/// When it is damaged, or no topic can be read.
pub fn source(bytes: impl Read, file: String) -> Result<Source, InputError> {
    let mut topics = Topics::new(&file);
    let cut = read(bytes, &file, &mut topics)?;
    finish(topics, cut)
}

/// What a recorder of ROS 2 writes beside its files.
#[derive(Deserialize)]
struct Metadata {
    rosbag2_bagfile_information: Information,
}

#[derive(Deserialize)]
struct Information {
    relative_file_paths: Vec<String>,
    storage_identifier: String,
}

/// Reads a folder with `metadata.yaml`, whose files are one log.
///
/// # Errors
/// As for a file.
pub fn folder(folder: &Path) -> Result<Source, InputError> {
    let path = folder.join("metadata.yaml");
    let name = path.display().to_string();
    let text = std::fs::read_to_string(&path).map_err(|error| InputError::unreadable(&name, &error))?;
    let Metadata { rosbag2_bagfile_information: information } = yaml::read(&text, &name)?;
    if information.storage_identifier != "mcap" {
        let found = information.storage_identifier;
        return Err(InputError::new(name, format!("found a bag stored as `{found}`, wanted `mcap`"))
            .help("convert the bag with `ros2 bag convert` to MCAP"));
    }
    let mut topics = Topics::new(folder.display().to_string());
    let mut cut = None;
    for file in information.relative_file_paths {
        if !Path::new(&file).components().all(|part| matches!(part, Component::Normal(_))) {
            return Err(InputError::new(name, format!("`{file}` leads out of the folder")));
        }
        let path = folder.join(file);
        let place = path.display().to_string();
        let bytes = File::open(&path).map_err(|error| InputError::unreadable(&place, &error))?;
        cut = read(bytes, &place, &mut topics)?.or(cut);
    }
    finish(topics, cut)
}

fn finish(topics: Topics, cut: Option<String>) -> Result<Source, InputError> {
    let mut source = topics.finish()?;
    source.issues.extend(cut.map(|message| truncated(0.0, message)));
    Ok(source)
}

/// How a file begins and ends.
const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', b'0', b'\r', b'\n'];

/// Reads the messages of a file; what is to be told when it ends too early.
fn read(bytes: impl Read, file: &str, topics: &mut Topics) -> Result<Option<String>, InputError> {
    let mut bytes = std::io::BufReader::new(bytes);
    let mut magic = [0; MAGIC.len()];
    if bytes.read_exact(&mut magic).is_err() || magic != MAGIC {
        return Err(InputError::new(file, "cannot be read as MCAP: it does not begin as one"));
    }
    match Known::default().records(&mut bytes, true, topics) {
        Ok(()) => Ok(None),
        Err(Fault::Cut) if !topics.is_empty() => {
            Ok(Some(format!("{file} ends in the middle of a record; what is before counts")))
        }
        Err(Fault::Cut) => Err(InputError::new(file, "cannot be read as MCAP: it ends before its first message")),
        Err(Fault::Damaged(message)) => Err(InputError::new(file, format!("cannot be read as MCAP: {message}"))),
        Err(Fault::Log(error)) => Err(error),
    }
}

/// Why reading stopped.
enum Fault {
    /// The file ends in the middle of a record.
    Cut,
    Damaged(String),
    Log(InputError),
}

impl From<McapError> for Fault {
    fn from(error: McapError) -> Self {
        Self::Damaged(told(&error))
    }
}

/// The kind of the next record and its bytes; nothing at the end.
fn record(bytes: &mut impl Read) -> Result<Option<(u8, Vec<u8>)>, Fault> {
    let unreadable = |error: std::io::Error| Fault::Damaged(error.to_string());
    let mut head = vec![];
    bytes.by_ref().take(9).read_to_end(&mut head).map_err(unreadable)?;
    let (kind, length) = match head.as_slice() {
        [] => return Ok(None),
        [kind, length @ ..] => (*kind, length.try_into().map(u64::from_le_bytes).map_err(|_| Fault::Cut)?),
    };
    if length > MAX_RECORD {
        return Err(Fault::Damaged(format!("a record says that it has {length} bytes, at most {MAX_RECORD} are read")));
    }
    let mut body = vec![];
    bytes.take(length).read_to_end(&mut body).map_err(unreadable)?;
    if (body.len() as u64) < length { Err(Fault::Cut) } else { Ok(Some((kind, body))) }
}

/// The records in a chunk.
fn decompressed(header: &ChunkHeader, data: &[u8]) -> Result<Vec<u8>, Fault> {
    let wrong = |error: std::io::Error| Fault::Damaged(format!("a chunk cannot be decompressed: {error}"));
    let mut plain = vec![];
    match header.compression.as_str() {
        "" => plain.extend_from_slice(data),
        "zstd" => {
            let decoder = ::zstd::stream::read::Decoder::new(data).map_err(wrong)?;
            decoder.take(MAX_RECORD).read_to_end(&mut plain).map_err(wrong)?;
        }
        "lz4" => {
            let decoder = ::lz4::Decoder::new(data).map_err(wrong)?;
            decoder.take(MAX_RECORD).read_to_end(&mut plain).map_err(wrong)?;
        }
        other => return Err(Fault::Damaged(format!("a chunk is compressed as `{other}`, wanted `zstd` or `lz4`"))),
    }
    // No sum at all is written as zero.
    if header.uncompressed_crc != 0 && header.uncompressed_crc != crc32fast::hash(&plain) {
        return Err(Fault::Damaged("a chunk is damaged: its check sum is another one".into()));
    }
    Ok(plain)
}

/// What went wrong, in one line: the library's own words, with those of what it wraps.
fn told(error: &McapError) -> String {
    let text = match error {
        McapError::Parse(inner) => format!("a record is damaged: {inner}"),
        McapError::Io(inner) => inner.to_string(),
        error => error.to_string(),
    };
    text.split_whitespace().collect::<Vec<_>>().join(" ").chars().take(200).collect()
}

/// Channels and schemas so far.
#[derive(Default)]
struct Known {
    schemas: BTreeMap<u16, (String, String, Vec<u8>)>,
    channels: BTreeMap<u16, (String, Reading)>,
}

impl Known {
    /// Reads records to the end; `outer` ones may be chunks of others.
    fn records(&mut self, bytes: &mut impl Read, outer: bool, topics: &mut Topics) -> Result<(), Fault> {
        while let Some((kind, body)) = record(bytes)? {
            match ::mcap::parse_record(kind, &body)? {
                Record::Chunk { header, data } if outer => {
                    self.records(&mut decompressed(&header, &data)?.as_slice(), false, topics)?;
                }
                // What follows is an index and a summary, which are not needed.
                Record::DataEnd(_) | Record::Footer(_) if outer => return Ok(()),
                record => self.take(record, topics).map_err(Fault::Log)?,
            }
        }
        // A file ends with its footer, a chunk with its last record.
        if outer { Err(Fault::Cut) } else { Ok(()) }
    }

    fn take(&mut self, record: Record, topics: &mut Topics) -> Result<(), InputError> {
        match record {
            Record::Schema { header, data } => {
                self.schemas.insert(header.id, (header.name, header.encoding, data.into_owned()));
            }
            Record::Channel(channel) if !self.channels.contains_key(&channel.id) => {
                let reading = self.reading(&channel.message_encoding, channel.schema_id);
                self.channels.insert(channel.id, (channel.topic, reading));
            }
            Record::Message { header, data } => {
                if let Some((topic, reading)) = self.channels.get(&header.channel_id) {
                    topics.push(topic, reading, i64::try_from(header.log_time).unwrap_or(i64::MAX), &data)?;
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// How the messages of a channel are read.
    fn reading(&self, encoding: &str, schema: u16) -> Reading {
        let wire = match encoding {
            "json" => return Reading::Json,
            "cdr" => Wire::Cdr,
            "ros1" => Wire::Ros1,
            other => {
                return Reading::Refused(format!(
                    "its messages are encoded as `{other}`, wanted `cdr`, `ros1` or `json`"
                ));
            }
        };
        let Some((name, form, data)) = self.schemas.get(&schema) else {
            return Reading::Refused("it has no message definition".into());
        };
        if !matches!(form.as_str(), "ros2msg" | "ros1msg") {
            return Reading::Refused(format!("its type {name} is defined as `{form}`, wanted `ros2msg`"));
        }
        match Definition::parse(name, &String::from_utf8_lossy(data), wire) {
            Ok(definition) => Reading::Defined(definition),
            Err(why) => Reading::Refused(format!("its type {name}: {why}")),
        }
    }
}
