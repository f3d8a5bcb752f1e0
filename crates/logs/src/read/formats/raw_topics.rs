//! The topics of a bag as its recorder wrote them: messages in the order of the file, stamps that are neither sorted nor checked, and pictures.
//!
//! [`topics`](super::topics) makes a log of the same messages; here no message is dropped, so that faults of a recording can be found.

use super::bag;
use super::picture::Picture;
use super::rosmsg::Failure;
use super::topics::MessageDecoder;
use crate::allowed_folders::AllowedFolders;
use crate::read::element_names::ElementNames;
use crate::read::memory_table::InMemoryTable;
use indexmap::IndexMap;
use std::collections::BTreeMap;
use std::path::Path;
use teachtree_base::error::InputError;

/// The most topics that a bag may have.
const MAX_TOPICS: usize = 10_000;

/// The topics of a bag.
pub struct RawBag<P> {
    /// The topics by name, in the order of their first messages.
    pub topics: IndexMap<String, RawTopic<P>>,
    /// A description of the missing parts of the bag.
    pub missing: Option<String>,
}

/// The messages of a topic, in the order of the file.
pub struct RawTopic<P> {
    /// Their fields.
    pub rows: InMemoryTable,
    /// The stamp of each in its header, or when it was recorded where it has none, ns.
    pub stamps_ns: Vec<i64>,
    /// The sender of each message, counted from 0: messages with the same fields have the same sender.
    pub writers: Vec<usize>,
    /// The picture of each, or why it cannot be read; none in topics of other messages.
    pub pictures: Vec<Result<P, String>>,
    /// Why the messages cannot be read.
    pub refused: Option<String>,
    names: ElementNames,
    known_writers: BTreeMap<Vec<usize>, usize>,
}

impl<P> RawTopic<P> {
    fn new(place: String) -> Self {
        Self {
            rows: InMemoryTable::new(place),
            stamps_ns: Vec::new(),
            writers: Vec::new(),
            pictures: Vec::new(),
            refused: None,
            names: ElementNames::default(),
            known_writers: BTreeMap::new(),
        }
    }
}

/// Takes the pictures of topics; returns the kept part of a picture, or the reason why it cannot be used.
pub type PictureSink<'a, P> = &'a mut dyn FnMut(&str, &Picture) -> Result<Result<P, String>, InputError>;

impl<P> RawBag<P> {
    /// Reads a bag whose files must be in `folders`, and gives its pictures to `keep`.
    ///
    /// # Errors
    /// The path is not a bag, a file is damaged, or the bag is too large; the first error of `keep`.
    pub fn read(path: &Path, folders: &AllowedFolders, keep: PictureSink<P>) -> Result<Self, InputError> {
        let place = path.display().to_string();
        let mut topics: IndexMap<String, RawTopic<P>> = IndexMap::new();
        let missing = bag::play(path, folders, &mut |name, decoder, recorded, message| {
            if topics.len() >= MAX_TOPICS && !topics.contains_key(name) {
                let message = format!("found more than {MAX_TOPICS} topics, the most that are read");
                return Err(InputError::new(&place, message));
            }
            let new = || RawTopic::new(format!("{place} topic {name}"));
            topics.entry(name.to_string()).or_insert_with(new).push(name, decoder, recorded, message, &mut *keep)
        })?;
        Ok(Self { topics, missing })
    }
}

impl<P> RawTopic<P> {
    fn push(
        &mut self,
        name: &str,
        decoder: &MessageDecoder,
        recorded: i64,
        message: &[u8],
        keep: PictureSink<P>,
    ) -> Result<(), InputError> {
        if self.refused.is_some() {
            return Ok(());
        }
        if let MessageDecoder::Refused(why) = decoder {
            self.refused = Some(why.clone());
            return Ok(());
        }
        self.rows.begin_row()?;
        let (stamp, bytes) = match decoder.decode_with_bytes(message, &mut self.rows) {
            Ok(decoded) => decoded,
            Err(Failure::Log(error)) => return Err(error),
            Err(Failure::Message(why)) => {
                self.refused = Some(format!("message {}: {why}", self.stamps_ns.len() + 1));
                return Ok(());
            }
        };
        self.names.put(&mut self.rows, |_| true)?;
        self.stamps_ns.push(stamp.unwrap_or(recorded));
        let next = self.known_writers.len();
        self.writers.push(*self.known_writers.entry(self.rows.filled()).or_insert(next));
        if let Some(picture) = bytes.and_then(|bytes| Picture::of(&self.rows, bytes)) {
            // A message without a picture among those with one.
            let missing = self.stamps_ns.len().saturating_sub(1).saturating_sub(self.pictures.len());
            self.pictures.extend((0..missing).map(|_| Err("a message has no picture".into())));
            self.pictures.push(keep(name, &picture)?);
        }
        Ok(())
    }
}
