//! ROS 1 bags, version 2.0: a sheet a topic, messages by the definitions that the bag holds.
//!
//! Chunks may be plain, lz4 or bz2. The index is not needed: records are read in the order in which they are there. What is read so far counts
//! when a bag ends in the middle of a record.

use super::rosmsg::{Definition, WireFormat};
use super::topics::{MessageDecoder, MessageSink, Topics};
use super::truncated;
use crate::read::table::Source;
use std::collections::BTreeMap;
use std::io::{Cursor, Read};
use teachtree_base::error::InputError;

/// The magic bytes of a bag.
pub const MAGIC: &[u8] = b"#ROSBAG V2.0\n";
/// The longest record that is read, in bytes.
const MAX_RECORD: u32 = 256 << 20;

const MESSAGE: u8 = 2;
const CHUNK: u8 = 5;
const CONNECTION: u8 = 7;

/// Reads a bag.
///
/// # Errors
/// When it is damaged, or no topic can be read.
pub fn source(bytes: impl Read, file: String) -> Result<Source, InputError> {
    let mut topics = Topics::new(&file);
    let push = &mut |topic: &str, reading: &MessageDecoder, recorded: i64, message: &[u8]| {
        topics.push(topic, reading, recorded, message)
    };
    let is_cut = play(bytes, &file, push)?;
    if is_cut && topics.is_empty() {
        return Err(InputError::new(file, "the bag ends before its first message"));
    }
    let cut = is_cut.then(|| format!("{file} ends in the middle of a record; the records before it are read"));
    let mut source = topics.finish()?;
    source.issues.extend(cut.map(|message| truncated(0.0, message)));
    Ok(source)
}

/// Gives the messages of a bag as they come, in the order of the file; whether it ends in the middle of a record.
///
/// # Errors
/// When it is damaged; the first one of `each`.
pub(super) fn play(mut bytes: impl Read, file: &str, each: MessageSink) -> Result<bool, InputError> {
    let mut magic = [0; MAGIC.len()];
    let begins = bytes.read_exact(&mut magic).is_ok() && magic == MAGIC;
    if !begins {
        return Err(InputError::new(file, "found no bag of version 2.0").help("convert an older bag with `rosbag fix`"));
    }
    match (Bag { each, connections: BTreeMap::new() }).records(&mut bytes, true) {
        Ok(()) => Ok(false),
        Err(Fault::Truncated) => Ok(true),
        Err(Fault::Damaged(message)) => Err(InputError::new(file, format!("cannot be read as a bag: {message}"))),
        Err(Fault::Log(error)) => Err(error),
    }
}

/// Why reading stopped.
enum Fault {
    /// The bag ends in the middle of a record.
    Truncated,
    Damaged(String),
    Log(InputError),
}

/// The state of a bag's reader.
struct Bag<'a> {
    each: MessageSink<'a>,
    connections: BTreeMap<u32, (String, MessageDecoder)>,
}

impl Bag<'_> {
    /// Reads records to the end; `outer` ones may be chunks of others.
    fn records(&mut self, bytes: &mut impl Read, outer: bool) -> Result<(), Fault> {
        while let Some(header) = block(bytes, true)? {
            let data = block(bytes, false)?.ok_or(Fault::Truncated)?;
            let fields = fields(&header)?;
            match fields.get("op").map(Vec::as_slice) {
                Some([MESSAGE]) => self.message(&fields, &data)?,
                Some([CONNECTION]) => self.connection(&fields, &data)?,
                Some([CHUNK]) if outer => self.chunk(&fields, &data)?,
                Some([_]) => {}
                _ => return Err(Fault::Damaged("a record has no type".into())),
            }
        }
        Ok(())
    }

    fn message(&mut self, fields: &Fields, data: &[u8]) -> Result<(), Fault> {
        let Some((topic, reading)) = self.connections.get(&number(fields, "conn")?) else { return Ok(()) };
        let (seconds, nanos) = match fields.get("time").map(Vec::as_slice) {
            Some([a, b, c, d, e, f, g, h]) => {
                (u32::from_le_bytes([*a, *b, *c, *d]), u32::from_le_bytes([*e, *f, *g, *h]))
            }
            _ => return Err(Fault::Damaged("a message has no time".into())),
        };
        let recorded = i64::from(seconds) * 1_000_000_000 + i64::from(nanos);
        (self.each)(topic, reading, recorded, data).map_err(Fault::Log)
    }

    fn connection(&mut self, of_record: &Fields, data: &[u8]) -> Result<(), Fault> {
        let id = number(of_record, "conn")?;
        if self.connections.contains_key(&id) {
            return Ok(());
        }
        let of_connection = fields(data)?;
        let text = |fields: &Fields, key: &str| fields.get(key).map(|text| String::from_utf8_lossy(text).into_owned());
        let topic = text(of_record, "topic").or_else(|| text(&of_connection, "topic"));
        let topic = topic.ok_or_else(|| Fault::Damaged("a connection has no topic".into()))?;
        let name = text(&of_connection, "type").unwrap_or_default();
        let definition = text(&of_connection, "message_definition").unwrap_or_default();
        let reading = match Definition::parse(&name, &definition, WireFormat::Ros1) {
            Ok(definition) => MessageDecoder::Defined(definition),
            Err(why) => MessageDecoder::Refused(format!("its type {name}: {why}")),
        };
        self.connections.insert(id, (topic, reading));
        Ok(())
    }

    /// Reads the records of a compressed chunk.
    #[cfg(feature = "mcap")]
    fn packed(&mut self, decoder: impl Read) -> Result<(), Fault> {
        let mut plain = vec![];
        decoder.take(u64::from(MAX_RECORD)).read_to_end(&mut plain).map_err(undone)?;
        self.records(&mut Cursor::new(plain), false)
    }

    fn chunk(&mut self, fields: &Fields, data: &[u8]) -> Result<(), Fault> {
        match fields.get("compression").map(Vec::as_slice) {
            None | Some(b"none") => self.records(&mut Cursor::new(data), false),
            #[cfg(feature = "mcap")]
            Some(b"lz4") => self.packed(::lz4_flex::frame::FrameDecoder::new(data)),
            #[cfg(feature = "mcap")]
            Some(b"bz2") => self.packed(::bzip2::read::BzDecoder::new(data)),
            Some(other) => {
                let other = String::from_utf8_lossy(other);
                Err(Fault::Damaged(format!(
                    "its chunks are compressed as `{other}`, expected `none`, `lz4` or `bz2`; decompress it with `rosbag decompress`"
                )))
            }
        }
    }
}

/// The reason why a chunk cannot be decompressed.
#[cfg(feature = "mcap")]
fn undone(error: std::io::Error) -> Fault {
    Fault::Damaged(format!("a chunk cannot be decompressed: {error}"))
}

/// A length and as many bytes; nothing at the end, where a record `may_end`.
fn block(bytes: &mut impl Read, may_end: bool) -> Result<Option<Vec<u8>>, Fault> {
    let mut length = vec![];
    bytes.by_ref().take(4).read_to_end(&mut length).map_err(|error| Fault::Damaged(error.to_string()))?;
    let length = match <[u8; 4]>::try_from(length) {
        Ok(length) => u32::from_le_bytes(length),
        Err(none) if none.is_empty() && may_end => return Ok(None),
        Err(_) => return Err(Fault::Truncated),
    };
    if length > MAX_RECORD {
        return Err(Fault::Damaged(format!("a record declares {length} bytes, at most {MAX_RECORD} are read")));
    }
    let mut block = vec![];
    bytes.take(u64::from(length)).read_to_end(&mut block).map_err(|error| Fault::Damaged(error.to_string()))?;
    if block.len() < length as usize { Err(Fault::Truncated) } else { Ok(Some(block)) }
}

type Fields = BTreeMap<String, Vec<u8>>;

/// The fields `name=value` of a header.
fn fields(header: &[u8]) -> Result<Fields, Fault> {
    let mut fields = Fields::new();
    let mut rest = Cursor::new(header);
    while let Some(field) = block(&mut rest, true)? {
        let at = field.iter().position(|byte| *byte == b'=');
        let (name, value) =
            at.and_then(|at| field.split_at_checked(at)).ok_or_else(|| Fault::Damaged("a field has no `=`".into()))?;
        fields.insert(String::from_utf8_lossy(name).into_owned(), value.get(1..).unwrap_or_default().to_vec());
    }
    Ok(fields)
}

fn number(fields: &Fields, key: &str) -> Result<u32, Fault> {
    match fields.get(key).map(|value| <[u8; 4]>::try_from(value.as_slice())) {
        Some(Ok(value)) => Ok(u32::from_le_bytes(value)),
        _ => Err(Fault::Damaged(format!("a record has no number `{key}`"))),
    }
}
