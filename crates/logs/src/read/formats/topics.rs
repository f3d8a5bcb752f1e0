//! Topics of a bag: messages one by one in, a sheet a topic out.
//!
//! The stamp of a message is the one in its header, the time at which it was recorded where it has none: bags are written in batches. Times count from the
//! earliest stamp of the bag, and the rows of a topic are in the order of their stamps. A topic may have several writers, each with its own order. A topic
//! whose clock was set back is refused, since its two stretches overlap.

#[cfg(feature = "mcap")]
use super::rosmsg::WireFormat;
use super::rosmsg::{Definition, Failure};
use crate::issue::{Issue, IssueKind};
use crate::read::element_names::ElementNames;
use crate::read::memory_table::{Cells, InMemoryTable};
use crate::read::stamp_order::{Order, SET_BACK, StampOrder, Writers};
use crate::read::table::{BagClock, Sheet, Source};
use indexmap::IndexMap;
use std::borrow::Cow;
use teachtree_base::error::InputError;
use teachtree_base::short_number::ShortNumber;

/// The most topics that a bag may have.
const MAX_TOPICS: usize = 10_000;

/// Decodes the messages of a topic.
pub enum MessageDecoder {
    /// A message definition.
    Defined(Definition),
    /// As JSON objects.
    #[cfg(feature = "mcap")]
    Json,
    /// Descriptors of protobuf.
    #[cfg(feature = "protobuf")]
    Protobuf(Box<super::protobuf::MessageType>),
    /// Not at all, and why.
    Refused(String),
}

impl MessageDecoder {
    /// Returns the decoder of messages in this encoding, from the name, the form and the bytes of their type's definition.
    #[cfg(feature = "mcap")]
    pub fn of(encoding: &str, schema: Option<(&str, &str, &[u8])>) -> Self {
        let wire = match encoding {
            "json" => return Self::Json,
            "cdr" => WireFormat::Cdr,
            "ros1" => WireFormat::Ros1,
            "protobuf" => return Self::of_protobuf(schema),
            other => {
                return Self::Refused(format!(
                    "its messages are encoded as `{other}`, expected `cdr`, `ros1`, `json` or `protobuf`"
                ));
            }
        };
        let Some((name, form, definition)) = schema else {
            return Self::Refused("it has no message definition".into());
        };
        let text = match form {
            "ros2msg" | "ros1msg" => Some(String::from_utf8_lossy(definition).into_owned()),
            // Recorders that find no definition write none, or one in another language.
            _ => super::ros_types::definition(name),
        };
        let Some(text) = text else {
            let form = if form.is_empty() { "not defined in the bag".into() } else { format!("defined as `{form}`") };
            return Self::Refused(format!(
                "its type {name} is {form}, expected `ros2msg`, or a type of the common packages (docs/logs.md)"
            ));
        };
        match Definition::parse(name, &text, wire) {
            Ok(definition) => Self::Defined(definition),
            Err(why) => Self::Refused(format!("its type {name}: {why}")),
        }
    }

    #[cfg(feature = "protobuf")]
    fn of_protobuf(schema: Option<(&str, &str, &[u8])>) -> Self {
        let Some((name, "protobuf", descriptors)) = schema else {
            return Self::Refused("it has no descriptors of protobuf".into());
        };
        match super::protobuf::MessageType::new(name, descriptors) {
            Ok(kind) => Self::Protobuf(Box::new(kind)),
            Err(why) => Self::Refused(format!("its type {name}: {why}")),
        }
    }

    #[cfg(all(feature = "mcap", not(feature = "protobuf")))]
    fn of_protobuf(_: Option<(&str, &str, &[u8])>) -> Self {
        Self::Refused("this build cannot read messages in protobuf, its feature `protobuf` is off".into())
    }

    /// Puts the fields of a message into the last row; its stamp in nanoseconds, if it has a header with one.
    ///
    /// # Errors
    /// When the message is not as it should be.
    pub fn decode(&self, message: &[u8], row: &mut InMemoryTable) -> Result<Option<i64>, Failure> {
        match self {
            Self::Defined(definition) => definition.decode(message, row),
            #[cfg(feature = "mcap")]
            Self::Json => super::json::message(message, row),
            #[cfg(feature = "protobuf")]
            Self::Protobuf(kind) => kind.decode(message, row),
            Self::Refused(why) => Err(why.clone().into()),
        }
    }

    /// The same, with the bytes in the field `data`, which are those of a picture in messages with one.
    ///
    /// # Errors
    /// As [`decode`](Self::decode).
    pub(super) fn decode_with_bytes<'m>(
        &self,
        message: &'m [u8],
        row: &mut InMemoryTable,
    ) -> Result<StampedBytes<'m>, Failure> {
        match self {
            Self::Defined(definition) => {
                let (stamp, bytes) = definition.decode_with_bytes(message, row)?;
                Ok((stamp, bytes.map(Cow::Borrowed)))
            }
            #[cfg(feature = "protobuf")]
            Self::Protobuf(kind) => {
                let (stamp, bytes) = kind.decode_with_bytes(message, row)?;
                Ok((stamp, bytes.map(Cow::Owned)))
            }
            other => Ok((other.decode(message, row)?, None)),
        }
    }
}

/// The stamp of a message, ns, and the bytes of its field `data`, where it has them.
pub(super) type StampedBytes<'m> = (Option<i64>, Option<Cow<'m, [u8]>>);

/// Takes messages: topic, decoder, time of recording (ns), and bytes.
pub type MessageSink<'a> = &'a mut dyn FnMut(&str, &MessageDecoder, i64, &[u8]) -> Result<(), InputError>;

/// The topics so far.
pub struct Topics {
    file: String,
    topics: IndexMap<String, Topic>,
}

struct Topic {
    rows: InMemoryTable,
    names: ElementNames,
    /// The stamp of each row, ns.
    stamps: Vec<i64>,
    /// The recording delay of each row with a stamp in its header, ns.
    delays: Vec<i64>,
    writers: Writers<Writer>,
    refused: Option<String>,
}

/// Stamps below this one, ns, are of a clock that began with the recording, such as that of a simulation: the date would be before 1973.
const FIRST_DATE_NS: i64 = 100_000_000_000_000_000;

impl Topic {
    /// Takes the messages so far, whose stamp is zero, for messages at the beginning of a clock that `stamp` (ns) shows to begin at zero. Returns their number: a stamp
    /// of zero is otherwise one that was not set.
    fn begins_at_zero(&mut self, stamp: i64) -> usize {
        let unset = self.stamps.len();
        if !self.delays.is_empty() || stamp >= FIRST_DATE_NS || self.stamps.last().is_none_or(|last| *last <= stamp) {
            return 0;
        }
        self.stamps.fill(0);
        self.writers = Writers::default();
        unset
    }
}

/// A message that comes so long after a later one, s, is reported although it is a single one: two clocks may take turns.
const FAR_BEHIND_S: f64 = 1.0;

/// One of those who write to a topic.
#[derive(Default)]
struct Writer {
    order: StampOrder,
    messages: usize,
    /// Stamp of the first message in the current run of late messages, ns.
    late_from: i64,
    /// Number of late messages that do not count yet: a single slightly late message does not count.
    uncounted: usize,
    /// Number of messages that were too late (two or more in a row, or far behind), with the first and last stamp, ns.
    disordered: Option<(usize, i64, i64)>,
}

impl Writer {
    fn merge(&mut self, other: Self) {
        self.order.raise(other.order.newest_s());
        self.messages += other.messages;
        self.disordered = self.disordered.or(other.disordered);
    }

    /// Takes a stamp (ns), `after_s` seconds after the first one of the topic. Returns whether the clock was set back.
    fn push(&mut self, stamp: i64, after_s: f64) -> bool {
        self.messages += 1;
        let behind_s = self.order.newest_s() - after_s;
        let order = self.order.push(after_s);
        if order == Order::Earlier {
            if self.order.late() == 1 {
                (self.late_from, self.uncounted) = (stamp, 0);
            }
            self.uncounted += 1;
            if self.order.late() > 1 || behind_s > FAR_BEHIND_S {
                let (count, from, to) = self.disordered.unwrap_or((0, self.late_from, stamp));
                self.disordered = Some((count + self.uncounted, from.min(self.late_from), to.max(stamp)));
                self.uncounted = 0;
            }
        }
        order == Order::SetBack
    }
}

impl Topics {
    /// Returns a log without topics.
    pub fn new(file: impl Into<String>) -> Self {
        Self { file: file.into(), topics: IndexMap::new() }
    }

    /// Whether no message was taken yet.
    pub fn is_empty(&self) -> bool {
        self.topics.values().all(|topic| topic.stamps.is_empty())
    }

    /// Takes a message that was recorded at `recorded`, ns.
    ///
    /// # Errors
    /// When the log grows too large; a message that is not as it should be refuses its topic.
    pub fn push(
        &mut self,
        topic: &str,
        reading: &MessageDecoder,
        recorded: i64,
        message: &[u8],
    ) -> Result<(), InputError> {
        if self.topics.len() >= MAX_TOPICS && !self.topics.contains_key(topic) {
            return Err(InputError::new(
                &self.file,
                format!("found more than {MAX_TOPICS} topics, the most that are read"),
            ));
        }
        let file = &self.file;
        let topic = self.topics.entry(topic.to_string()).or_insert_with(|| Topic {
            rows: InMemoryTable::new(format!("{file} topic {topic}")),
            names: ElementNames::default(),
            stamps: vec![],
            delays: vec![],
            writers: Writers::default(),
            refused: None,
        });
        if topic.refused.is_some() {
            return Ok(());
        }
        if let MessageDecoder::Refused(why) = reading {
            topic.refused = Some(why.clone());
            return Ok(());
        }
        topic.rows.begin_row()?;
        match reading.decode(message, &mut topic.rows) {
            Ok(stamp) => {
                topic.names.put(&mut topic.rows, |_| true)?;
                let at_zero = stamp.map_or(0, |stamp| topic.begins_at_zero(stamp));
                topic.delays.extend(stamp.map(|stamp| recorded.saturating_sub(stamp)));
                let stamp = stamp.unwrap_or(recorded);
                topic.stamps.push(stamp);
                let first = topic.stamps.first().copied().unwrap_or(stamp);
                let after = |stamp: i64| stamp.saturating_sub(first) as f64 * 1e-9;
                let after_s = after(stamp);
                let writer = topic.writers.of(&topic.rows.filled(), Writer::merge);
                writer.messages += at_zero;
                let newest_s = writer.order.newest_s();
                if writer.push(stamp, after_s) {
                    let by_s = newest_s - after(writer.late_from);
                    topic.refused = Some(format!(
                        "the clock was set back by {} s before message {}: the stretches before and after it overlap; cut the bag there, or follow it with `teachtree live`",
                        ShortNumber((by_s * 1e6).round() / 1e6),
                        topic.stamps.len() + 1 - SET_BACK
                    ));
                }
            }
            Err(Failure::Log(error)) => return Err(error),
            Err(Failure::Message(message)) => {
                topic.refused = Some(format!("message {}: {message}", topic.stamps.len() + 1));
            }
        }
        Ok(())
    }

    /// The topics as a log.
    ///
    /// # Errors
    /// When none of them can be read.
    pub fn finish(self) -> Result<Source, InputError> {
        let origin = self.topics.values().filter(|topic| topic.refused.is_none()).flat_map(|topic| &topic.stamps).min();
        let origin = origin.copied().unwrap_or_default();
        let mut delays = vec![];
        let mut refused = vec![];
        let mut sheets = vec![];
        for (name, topic) in self.topics {
            let Topic { mut rows, mut stamps, delays: mut of_topic, writers, refused: why, names: _ } = topic;
            match why {
                Some(why) => refused.push((name, why)),
                None => {
                    delays.extend(&of_topic);
                    // Messages that each writer sends only once, such as static transforms, form one row.
                    let holds = writers.all().all(|writer| writer.messages == 1);
                    let recorded_after_s = (!holds).then(|| median(&mut of_topic) as f64 * 1e-9);
                    if holds {
                        let first = stamps.iter().min().copied().unwrap_or_default();
                        stamps.fill(first);
                    }
                    let seconds = |stamp: &i64| stamp.saturating_sub(origin) as f64 * 1e-9;
                    rows.issues.extend(writers.all().filter_map(|writer| writer.disordered).map(
                        |(count, from, to)| {
                            let message =
                                format!("{count} messages came after one with a later stamp; they are sorted by stamp");
                            let (start_s, end_s) = (seconds(&from), seconds(&to));
                            Issue { kind: IssueKind::DUPLICATE_STAMP, start_s, end_s, channel: name.clone(), message }
                        },
                    ));
                    rows.push_first("time [s]", Cells::Numbers(stamps.iter().map(seconds).collect()));
                    rows.sort_by("time [s]");
                    let header = rows.header();
                    sheets.push(Sheet { recorded_after_s, ..Sheet::new(name, header, Box::new(rows)) });
                }
            }
        }
        match (sheets.is_empty(), refused.first()) {
            (false, _) => {
                let recorded_after_ns = median(&mut delays);
                let clock = Some(BagClock { origin_ns: origin, recorded_after_ns });
                Ok(Source { refused, clock, ..Source::many(self.file, sheets) })
            }
            (true, None) => Err(InputError::new(self.file, "the bag holds no message")),
            (true, Some((name, why))) => Err(InputError::new(format!("{} topic {name}", self.file), why)),
        }
    }
}

/// The upper median of some values; 0 of none.
fn median(values: &mut [i64]) -> i64 {
    let middle = values.len() / 2;
    if values.is_empty() { 0 } else { *values.select_nth_unstable(middle).1 }
}
