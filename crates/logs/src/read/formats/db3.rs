//! Bags of ROS 2 in the storage `sqlite3` (`.db3`): a sheet a topic, as of MCAP.
//!
//! Recorders since ROS 2 Iron write the definitions of their types into the bag; for others the [common types](super::ros_types) are known. The file is opened
//! read only, without a journal or a write-ahead log beside it. A damaged file may have pages that lead to each other, which would never end:
//! rows must come in the order of their numbers, and have no more bytes than the file.

use super::ros_types;
use super::topics::{MessageDecoder, MessageSink, Topics};
use crate::read::table::Source;
use ::rusqlite::limits::Limit;
use ::rusqlite::{Connection, Error, OpenFlags, Row};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_base::guard::guarded;

/// The magic bytes of a file.
pub(super) const MAGIC: &[u8] = b"SQLite format 3\0";
/// The longest message, definition or name that is read, in bytes.
const MAX_VALUE: i32 = 256 << 20;
/// The most topics and types that a bag may have.
const MAX_TOPICS: usize = 10_000;
/// The magic bytes of a compressed message.
const ZSTD: [u8; 4] = super::mcap::ZSTD;

/// Reads a file.
///
/// # Errors
/// It is damaged, or no topic can be read.
pub(super) fn source(path: &Path) -> Result<Source, InputError> {
    let mut topics = Topics::new(path.display().to_string());
    let cut = read(path, &mut topics)?;
    super::finish(topics, cut)
}

/// Reads the messages of a file. Returns a description of the parts that are not read.
///
/// # Errors
/// It is damaged.
pub(super) fn read(path: &Path, topics: &mut Topics) -> Result<Option<String>, InputError> {
    play(path, &mut |topic, decoder, recorded, message| topics.push(topic, decoder, recorded, message))
}

/// Reads the messages of a file in its order. Returns a description of the parts that are not read.
///
/// # Errors
/// It is damaged; the first one of `each`.
pub(super) fn play(path: &Path, each: MessageSink) -> Result<Option<String>, InputError> {
    let place = path.display().to_string();
    guarded(&place, || {
        let bag = Bag::open(path, &place)?;
        bag.messages(&bag.decoders()?, each)?;
        Ok(bag.unmerged(path))
    })
}

struct Bag<'a> {
    place: &'a str,
    connection: Connection,
    /// The size of the file, in bytes.
    size: u64,
}

impl<'a> Bag<'a> {
    fn open(path: &Path, place: &'a str) -> Result<Self, InputError> {
        let failed = |error: Error| damaged(place, &error);
        let size = std::fs::metadata(path).map_err(|error| InputError::unreadable(place, &error))?.len();
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let connection = Connection::open_with_flags(uri(path), flags).map_err(failed)?;
        connection.set_limit(Limit::SQLITE_LIMIT_LENGTH, MAX_VALUE).map_err(failed)?;
        connection.pragma_update(None, "trusted_schema", false).map_err(failed)?;
        let bag = Self { place, connection, size };
        for table in ["topics", "messages"] {
            if !bag.has(table).map_err(failed)? {
                return Err(InputError::new(place, format!("is not a ROS 2 bag: it lacks the table `{table}`")));
            }
        }
        Ok(bag)
    }

    /// Whether the file has a table of this name that is stored, not computed.
    fn has(&self, table: &str) -> Result<bool, Error> {
        let stored =
            "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name = ?1 AND sql LIKE 'CREATE TABLE%'";
        let computed = "SELECT count(*) FROM pragma_table_xinfo(?1) WHERE hidden <> 0";
        let count = |query: &str| self.connection.query_row(query, [table], |row| row.get::<_, i64>(0));
        Ok(count(stored)? == 1 && count(computed)? == 0)
    }

    /// Calls `each` with the rows of a query whose first column numbers them.
    fn each(&self, query: &str, mut each: impl FnMut(&Row) -> Result<(), Fault>) -> Result<(), InputError> {
        let mut step = || -> Result<(), Fault> {
            let mut statement = self.connection.prepare(query)?;
            let mut rows = statement.query([])?;
            let mut last = None;
            while let Some(row) = rows.next()? {
                let number: i64 = row.get(0)?;
                if last.replace(number).is_some_and(|last| number <= last) {
                    return Err(Fault::Damaged("its rows are not in the order of their numbers".into()));
                }
                each(row)?;
            }
            Ok(())
        };
        step().map_err(|fault| match fault {
            Fault::Sqlite(error) => damaged(self.place, &error),
            Fault::Damaged(message) => InputError::new(self.place, format!("cannot be read as a bag: {message}")),
            Fault::Log(error) => error,
        })
    }

    /// The definitions of types: form and text by name.
    fn definitions(&self) -> Result<BTreeMap<String, (String, String)>, InputError> {
        let mut definitions = BTreeMap::new();
        if !self.has("message_definitions").map_err(|error| damaged(self.place, &error))? {
            return Ok(definitions);
        }
        let query = "SELECT id, topic_type, encoding, encoded_message_definition FROM message_definitions ORDER BY id";
        self.each(query, |row| {
            check_count(definitions.len())?;
            definitions.insert(row.get(1)?, (row.get(2)?, row.get(3)?));
            Ok(())
        })?;
        Ok(definitions)
    }

    /// The name of each topic, and how its messages are read.
    fn decoders(&self) -> Result<BTreeMap<i64, (String, MessageDecoder)>, InputError> {
        let definitions = self.definitions()?;
        let mut decoders = BTreeMap::new();
        self.each("SELECT id, name, type, serialization_format FROM topics ORDER BY id", |row| {
            check_count(decoders.len())?;
            let (name, kind, format): (String, String, String) = (row.get(1)?, row.get(2)?, row.get(3)?);
            decoders.insert(row.get(0)?, (name, decoder(&kind, &format, &definitions)));
            Ok(())
        })?;
        Ok(decoders)
    }

    fn messages(
        &self,
        decoders: &BTreeMap<i64, (String, MessageDecoder)>,
        message: MessageSink,
    ) -> Result<(), InputError> {
        let mut left = self.size;
        self.each("SELECT id, topic_id, timestamp, data FROM messages ORDER BY id", |row| {
            let data =
                row.get_ref(3)?.as_blob().map_err(|_| Fault::Damaged("the data of a message is not a blob".into()))?;
            left = left
                .checked_sub(data.len() as u64)
                .ok_or_else(|| Fault::Damaged("its messages have more bytes than the file".into()))?;
            let (topic, recorded): (i64, i64) = (row.get(1)?, row.get(2)?);
            let Some((topic, decoder)) = decoders.get(&topic) else { return Ok(()) };
            if data.starts_with(&ZSTD) {
                let plain = super::mcap::unpacked_message(data).map_err(Fault::Damaged)?;
                return message(topic, decoder, recorded, &plain).map_err(Fault::Log);
            }
            message(topic, decoder, recorded, data).map_err(Fault::Log)
        })
    }

    /// What is not read: messages in a write-ahead log that was not merged into the file.
    fn unmerged(&self, path: &Path) -> Option<String> {
        let mut beside = path.as_os_str().to_os_string();
        beside.push("-wal");
        let has_more = std::fs::metadata(&beside).is_ok_and(|log| log.len() > 0);
        has_more.then(|| {
            format!(
                "messages in {0}-wal are not read, since the recorder did not close the bag: `sqlite3 {0} 'PRAGMA wal_checkpoint(TRUNCATE)'` puts them into the bag",
                self.place
            )
        })
    }
}

/// Why reading stopped.
enum Fault {
    Sqlite(Error),
    Damaged(String),
    Log(InputError),
}

impl From<Error> for Fault {
    fn from(error: Error) -> Self {
        Self::Sqlite(error)
    }
}

fn check_count(count: usize) -> Result<(), Fault> {
    if count < MAX_TOPICS {
        return Ok(());
    }
    Err(Fault::Damaged(format!("it has more than {MAX_TOPICS} topics or types, the most that are read")))
}

fn damaged(place: &str, error: &Error) -> InputError {
    InputError::new(place, format!("cannot be read as a bag: {error}"))
}

/// How messages of a type are read.
fn decoder(kind: &str, format: &str, definitions: &BTreeMap<String, (String, String)>) -> MessageDecoder {
    if let Some((form, text)) = definitions.get(kind).filter(|(form, _)| form == "ros2msg") {
        return MessageDecoder::of(format, Some((kind, form, text.as_bytes())));
    }
    match ros_types::definition(kind) {
        Some(text) => MessageDecoder::of(format, Some((kind, "ros2msg", text.as_bytes()))),
        None => MessageDecoder::Refused(format!(
            "the bag has no definition of its type {kind}; bags that `ros2 bag record --storage mcap` writes have it"
        )),
    }
}

/// The address of a file that nothing else writes: SQLite neither locks it nor looks for logs beside it.
fn uri(path: &Path) -> String {
    let mut uri = String::from("file:");
    for byte in path.as_os_str().as_encoded_bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'-' | b'_' | b'.' | b'~' => uri.push(char::from(*byte)),
            other => {
                // A text takes it.
                let _ = write!(uri, "%{other:02X}");
            }
        }
    }
    uri + "?mode=ro&immutable=1"
}
