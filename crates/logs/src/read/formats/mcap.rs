//! MCAP: messages of ROS 2 (CDR with `ros2msg` definitions), of ROS 1, in JSON and protobuf; a sheet a topic.
//!
//! Chunks may be plain, zstd or lz4; messages or the whole file may be zstd too. A topic in another encoding cannot be read, the others can. What is read so
//! far counts when a file ends in the middle of a record.

pub mod copy;
mod renumber;
pub mod ros2_message;
pub mod write;

use super::topics::{MessageDecoder, MessageSink, Topics};
use crate::read::table::Source;
use std::collections::BTreeMap;
use std::io::{BufRead, Read};
use teachtree_base::error::InputError;

/// The longest record that is read, in bytes.
const MAX_RECORD: u64 = 256 << 20;

/// Reads a file.
///
/// # Errors
/// When it is damaged, or no topic can be read.
pub fn source(bytes: impl Read, file: String) -> Result<Source, InputError> {
    let mut topics = Topics::new(&file);
    let cut = read(bytes, &file, &mut topics)?;
    super::finish(topics, cut)
}

/// The magic bytes at the beginning and end of a file.
const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', b'0', b'\r', b'\n'];

/// The magic bytes of zstd data.
pub const ZSTD: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

/// Kinds of records.
const FOOTER: u8 = 2;
const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;
const DATA_END: u8 = 15;

/// Reads the messages of a file, which may be compressed as a whole; the message when it ends too early.
pub(super) fn read(bytes: impl Read, file: &str, topics: &mut Topics) -> Result<Option<String>, InputError> {
    let push = &mut |topic: &str, reading: &MessageDecoder, recorded: i64, message: &[u8]| {
        topics.push(topic, reading, recorded, message)
    };
    let is_cut = play(bytes, file, push)?;
    if is_cut && topics.is_empty() {
        return Err(InputError::new(file, "cannot be read as MCAP: it ends before its first message"));
    }
    Ok(is_cut.then(|| format!("{file} ends in the middle of a record; the records before it are read")))
}

/// Gives the messages of a file as they come, in the order of the file; whether it ends in the middle of a record.
///
/// # Errors
/// When it is damaged; the first one of `each`.
pub fn play(bytes: impl Read, file: &str, each: MessageSink) -> Result<bool, InputError> {
    let unreadable = |error: std::io::Error| InputError::unreadable(file, &error);
    let mut bytes = std::io::BufReader::new(bytes);
    if bytes.fill_buf().map_err(unreadable)?.starts_with(&ZSTD) {
        let decoder = ::zstd::stream::read::Decoder::with_buffer(bytes).map_err(unreadable)?;
        return plain(std::io::BufReader::new(decoder), file, each);
    }
    plain(bytes, file, each)
}

fn plain(mut bytes: impl Read, file: &str, each: MessageSink) -> Result<bool, InputError> {
    let mut magic = [0; MAGIC.len()];
    if bytes.read_exact(&mut magic).is_err() || magic != MAGIC {
        return Err(InputError::new(file, "cannot be read as MCAP: it does not begin as one"));
    }
    match ChannelRegistry::default().records(&mut bytes, true, each) {
        Ok(()) => Ok(false),
        Err(Fault::Truncated) => Ok(true),
        Err(Fault::Damaged(message)) => Err(InputError::new(file, format!("cannot be read as MCAP: {message}"))),
        Err(Fault::Log(error)) => Err(error),
    }
}

/// Why reading stopped.
enum Fault {
    /// The file ends in the middle of a record.
    Truncated,
    Damaged(String),
    Log(InputError),
}

/// The kind of the next record and its bytes; nothing at the end.
fn record(bytes: &mut impl Read) -> Result<Option<(u8, Vec<u8>)>, Fault> {
    let unreadable = |error: std::io::Error| Fault::Damaged(error.to_string());
    let mut head = vec![];
    bytes.by_ref().take(9).read_to_end(&mut head).map_err(unreadable)?;
    let (kind, length) = match head.as_slice() {
        [] => return Ok(None),
        [0, ..] => {
            // After a power failure, a file may end with blocks of zeros that were never written.
            let mut rest = std::io::BufReader::new(bytes);
            let is_unwritten = head.iter().all(|byte| *byte == 0) && has_only_zeros(&mut rest).map_err(unreadable)?;
            return Err(match is_unwritten {
                true => Fault::Truncated,
                false => Fault::Damaged("a record has the invalid opcode 0".into()),
            });
        }
        [kind, length @ ..] => (*kind, length.try_into().map(u64::from_le_bytes).map_err(|_| Fault::Truncated)?),
    };
    if length > MAX_RECORD {
        return Err(Fault::Damaged(format!("a record declares {length} bytes, at most {MAX_RECORD} are read")));
    }
    let mut body = vec![];
    bytes.take(length).read_to_end(&mut body).map_err(unreadable)?;
    if (body.len() as u64) < length { Err(Fault::Truncated) } else { Ok(Some((kind, body))) }
}

/// Whether zeros are all that follows.
fn has_only_zeros(bytes: &mut impl BufRead) -> std::io::Result<bool> {
    loop {
        let buffer = bytes.fill_buf()?;
        if buffer.is_empty() {
            return Ok(true);
        }
        if buffer.iter().any(|byte| *byte != 0) {
            return Ok(false);
        }
        let length = buffer.len();
        bytes.consume(length);
    }
}

/// The fields of a record, one after the other, little endian. A length counts only as far as the record goes: libraries take the memory
/// for it first.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn bytes(&mut self, count: usize) -> Result<&'a [u8], Fault> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or_else(|| {
            Fault::Damaged(format!("a record is damaged: it declares {count} more bytes, and has {}", self.0.len()))
        })?;
        self.0 = rest;
        Ok(taken)
    }

    fn number<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        self.bytes(N)?.try_into().map_err(|_| Fault::Truncated)
    }

    fn u16(&mut self) -> Result<u16, Fault> {
        Ok(u16::from_le_bytes(self.number()?))
    }

    fn u32(&mut self) -> Result<u32, Fault> {
        Ok(u32::from_le_bytes(self.number()?))
    }

    fn u64(&mut self) -> Result<u64, Fault> {
        Ok(u64::from_le_bytes(self.number()?))
    }

    /// A length of four bytes and as many bytes.
    fn sized(&mut self) -> Result<&'a [u8], Fault> {
        let length = self.u32()?;
        self.bytes(length as usize)
    }

    fn text(&mut self) -> Result<String, Fault> {
        Ok(String::from_utf8_lossy(self.sized()?).into_owned())
    }
}

/// The records in a chunk.
fn decompressed(chunk: &[u8]) -> Result<Vec<u8>, Fault> {
    let mut fields = Fields(chunk);
    let (_start, _end, _size, sum) = (fields.u64()?, fields.u64()?, fields.u64()?, fields.u32()?);
    let compression = fields.text()?;
    let length = fields.u64()?;
    let data = fields.bytes(usize::try_from(length).unwrap_or(usize::MAX))?;
    let plain = match compression.as_str() {
        "" => data.to_vec(),
        "zstd" => unpacked(::zstd::stream::read::Decoder::new(data).map_err(undone)?)?,
        "lz4" => unpacked(::lz4_flex::frame::FrameDecoder::new(data))?,
        other => return Err(Fault::Damaged(format!("a chunk is compressed as `{other}`, expected `zstd` or `lz4`"))),
    };
    // A missing sum is written as zero.
    if sum != 0 && sum != crc32fast::hash(&plain) {
        return Err(Fault::Damaged("a chunk is damaged: its checksum is wrong".into()));
    }
    Ok(plain)
}

fn unpacked(decoder: impl Read) -> Result<Vec<u8>, Fault> {
    let mut plain = vec![];
    decoder.take(MAX_RECORD).read_to_end(&mut plain).map_err(undone)?;
    Ok(plain)
}

/// A message that was compressed by itself.
///
/// # Errors
/// It is damaged.
#[cfg(feature = "db3")]
pub(super) fn unpacked_message(packed: &[u8]) -> Result<Vec<u8>, String> {
    let failed = |error: std::io::Error| format!("a message cannot be decompressed: {error}");
    let mut plain = vec![];
    let decoder = ::zstd::stream::read::Decoder::new(packed).map_err(failed)?;
    decoder.take(MAX_RECORD).read_to_end(&mut plain).map_err(failed)?;
    Ok(plain)
}

fn undone(error: std::io::Error) -> Fault {
    Fault::Damaged(format!("a chunk cannot be decompressed: {error}"))
}

/// Channels and schemas so far.
#[derive(Default)]
struct ChannelRegistry {
    /// Name, encoding and definition of each type.
    schemas: BTreeMap<u16, (String, String, Vec<u8>)>,
    /// Topic of each channel, and how its messages are read.
    channels: BTreeMap<u16, (String, MessageDecoder)>,
}

impl ChannelRegistry {
    /// Reads records to the end; `outer` ones may be chunks of others.
    fn records(&mut self, bytes: &mut impl Read, outer: bool, each: MessageSink) -> Result<(), Fault> {
        while let Some((kind, body)) = record(bytes)? {
            match kind {
                SCHEMA => self.schema(&mut Fields(&body))?,
                CHANNEL => self.channel(&mut Fields(&body))?,
                MESSAGE => self.message(&mut Fields(&body), each)?,
                CHUNK if outer => self.records(&mut decompressed(&body)?.as_slice(), false, each)?,
                // The index and the summary after it are not needed.
                DATA_END | FOOTER if outer => return Ok(()),
                _ => {}
            }
        }
        // A file ends with its footer, a chunk with its last record.
        if outer { Err(Fault::Truncated) } else { Ok(()) }
    }

    fn schema(&mut self, fields: &mut Fields) -> Result<(), Fault> {
        let id = fields.u16()?;
        self.schemas.insert(id, (fields.text()?, fields.text()?, fields.sized()?.to_vec()));
        Ok(())
    }

    fn channel(&mut self, fields: &mut Fields) -> Result<(), Fault> {
        let (id, schema, topic, encoding) = (fields.u16()?, fields.u16()?, fields.text()?, fields.text()?);
        let known = self.channels.contains_key(&id);
        if !known {
            let schema = self.schemas.get(&schema);
            let schema = schema.map(|(name, form, text)| (name.as_str(), form.as_str(), text.as_slice()));
            let reading = MessageDecoder::of(&encoding, schema);
            self.channels.insert(id, (topic, reading));
        }
        Ok(())
    }

    fn message(&mut self, fields: &mut Fields, each: MessageSink) -> Result<(), Fault> {
        let (id, _sequence, recorded, _published) = (fields.u16()?, fields.u32()?, fields.u64()?, fields.u64()?);
        let Some((topic, reading)) = self.channels.get(&id) else { return Ok(()) };
        let recorded = i64::try_from(recorded).unwrap_or(i64::MAX);
        // A recorder may compress each message by itself; none begins like this otherwise.
        if fields.0.starts_with(&ZSTD) {
            let plain = unpacked(::zstd::stream::read::Decoder::new(fields.0).map_err(undone)?)?;
            return each(topic, reading, recorded, &plain).map_err(Fault::Log);
        }
        each(topic, reading, recorded, fields.0).map_err(Fault::Log)
    }
}
