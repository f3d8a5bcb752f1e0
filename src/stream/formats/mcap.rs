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
use ::mcap::records::Record;
use ::mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path};

/// The longest record that is read, in bytes.
const MAX_RECORD: usize = 256 << 20;
/// How many bytes are read at once, at most.
const MAX_READ: usize = 1 << 20;

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
    let text =
        std::fs::read_to_string(&path).map_err(|error| InputError::new(&name, format!("cannot be opened: {error}")))?;
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
        let bytes = File::open(&path).map_err(|error| InputError::new(&place, format!("cannot be opened: {error}")))?;
        cut = read(bytes, &place, &mut topics)?.or(cut);
    }
    finish(topics, cut)
}

fn finish(topics: Topics, cut: Option<String>) -> Result<Source, InputError> {
    let mut source = topics.finish()?;
    source.issues.extend(cut.map(|message| truncated(0.0, message)));
    Ok(source)
}

/// Reads the messages of a file; what is to be told when it ends too early.
fn read(mut bytes: impl Read, file: &str, topics: &mut Topics) -> Result<Option<String>, InputError> {
    let options = LinearReaderOptions::default().with_record_length_limit(MAX_RECORD).with_validate_chunk_crcs(true);
    let mut reader = LinearReader::new_with_options(options);
    let mut known = Known::default();
    while let Some(event) = reader.next_event() {
        let damaged = |error: McapError| InputError::new(file, format!("cannot be read as MCAP: {}", told(&error)));
        match event {
            Ok(LinearReadEvent::ReadRequest(wanted)) => {
                let buffer = reader.insert(wanted.min(MAX_READ));
                let read =
                    bytes.read(buffer).map_err(|error| InputError::new(file, format!("cannot be read: {error}")))?;
                reader.notify_read(read);
            }
            Ok(LinearReadEvent::Record { opcode, data }) => {
                known.take(::mcap::parse_record(opcode, data).map_err(damaged)?, topics)?;
            }
            Err(McapError::UnexpectedEof | McapError::UnexpectedEoc) if !topics.is_empty() => {
                return Ok(Some(format!("{file} ends in the middle of a record; what is before counts")));
            }
            Err(error) => return Err(damaged(error)),
        }
    }
    Ok(None)
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
    fn take(&mut self, record: Record, topics: &mut Topics) -> Result<(), InputError> {
        match record {
            Record::Schema { header, data } => {
                self.schemas.insert(header.id, (header.name, header.encoding, data.into_owned()));
            }
            Record::Channel(channel) => {
                if !self.channels.contains_key(&channel.id) {
                    let reading = self.reading(&channel.message_encoding, channel.schema_id);
                    self.channels.insert(channel.id, (channel.topic, reading));
                }
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
