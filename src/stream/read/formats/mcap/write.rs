//! Writes MCAP: messages of ROS 2 in CDR, in compressed chunks with an index and a summary, so that viewers may jump.

use super::MAGIC;
use std::collections::BTreeMap;
use std::io::{Result, Write};

/// Records that are written beside those that are read.
const HEADER: u8 = 1;
const FOOTER: u8 = 2;
const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;
const MESSAGE_INDEX: u8 = 7;
const CHUNK_INDEX: u8 = 8;
const STATISTICS: u8 = 11;
const METADATA: u8 = 12;
const METADATA_INDEX: u8 = 13;
const SUMMARY_OFFSET: u8 = 14;
const DATA_END: u8 = 15;
/// How many bytes a chunk has, about, before it is compressed.
const CHUNK_BYTES: usize = 1 << 20;

/// The type of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Type {
    /// `std_msgs/msg/String`.
    Text,
    /// `std_msgs/msg/Float64`.
    Number,
    /// `tf2_msgs/msg/TFMessage`.
    Poses,
}

impl Type {
    const ALL: [Self; 3] = [Self::Text, Self::Number, Self::Poses];

    const fn name(self) -> &'static str {
        match self {
            Self::Text => "std_msgs/msg/String",
            Self::Number => "std_msgs/msg/Float64",
            Self::Poses => "tf2_msgs/msg/TFMessage",
        }
    }

    const fn definition(self) -> &'static str {
        match self {
            Self::Text => "string data\n",
            Self::Number => "float64 data\n",
            Self::Poses => POSES,
        }
    }

    /// Its number in the file, from 1 on.
    const fn id(self) -> u16 {
        match self {
            Self::Text => 1,
            Self::Number => 2,
            Self::Poses => 3,
        }
    }
}

/// The definition of `TFMessage` with all that it is made of.
const POSES: &str = "geometry_msgs/TransformStamped[] transforms
================================================================================
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
";

/// A message that is being written in CDR, little endian: numbers stand at multiples of their size.
#[derive(Default)]
pub struct Cdr(Vec<u8>);

impl Cdr {
    fn number<const N: usize>(&mut self, bytes: [u8; N]) {
        self.0.resize(self.0.len().next_multiple_of(N), 0);
        self.0.extend(bytes);
    }

    fn text(&mut self, text: &str) {
        self.number(length(text.len() + 1).to_le_bytes());
        self.0.extend(text.bytes().chain([0]));
    }

    fn message(self) -> Vec<u8> {
        // The order of bytes stands before the message.
        [0, 1, 0, 0].into_iter().chain(self.0).collect()
    }
}

/// A text as a message.
pub fn text(text: &str) -> Vec<u8> {
    let mut cdr = Cdr::default();
    cdr.text(text);
    cdr.message()
}

/// A number as a message.
pub fn number(value: f64) -> Vec<u8> {
    let mut cdr = Cdr::default();
    cdr.number(value.to_le_bytes());
    cdr.message()
}

/// A pose of a body in the frame of another: the names of both, position in m, rotation as w, x, y, z.
pub struct Pose<'a> {
    /// In whose frame.
    pub parent: &'a str,
    /// Of which body.
    pub child: &'a str,
    /// m.
    pub position: [f64; 3],
    /// parent_from_child: w, x, y, z.
    pub rotation: [f64; 4],
}

/// Poses at a time, ns, as a message.
pub fn poses(time: u64, poses: &[Pose]) -> Vec<u8> {
    let mut cdr = Cdr::default();
    cdr.number(length(poses.len()).to_le_bytes());
    for Pose { parent, child, position, rotation: [w, x, y, z] } in poses {
        cdr.number(i32::try_from(time / 1_000_000_000).unwrap_or(i32::MAX).to_le_bytes());
        cdr.number(((time % 1_000_000_000) as u32).to_le_bytes());
        cdr.text(parent);
        cdr.text(child);
        for value in position.iter().chain([x, y, z, w]) {
            cdr.number(value.to_le_bytes());
        }
    }
    cdr.message()
}

fn length(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}

/// The fields of a record.
#[derive(Default)]
struct Fields(Vec<u8>);

impl Fields {
    fn with(mut self, bytes: impl AsRef<[u8]>) -> Self {
        self.0.extend(bytes.as_ref());
        self
    }

    fn u16(self, value: u16) -> Self {
        self.with(value.to_le_bytes())
    }

    fn u32(self, value: u32) -> Self {
        self.with(value.to_le_bytes())
    }

    fn u64(self, value: u64) -> Self {
        self.with(value.to_le_bytes())
    }

    fn text(self, text: &str) -> Self {
        self.u32(length(text.len())).with(text)
    }

    /// A list or map: its length in bytes before it.
    fn sized(self, inner: Self) -> Self {
        self.u32(length(inner.0.len())).with(inner.0)
    }

    fn record(self, kind: u8) -> Vec<u8> {
        let mut record = vec![kind];
        record.extend((self.0.len() as u64).to_le_bytes());
        record.extend(self.0);
        record
    }
}

/// A chunk that is being filled.
#[derive(Default)]
struct Chunk {
    records: Vec<u8>,
    /// Time and place of each message, by channel.
    index: BTreeMap<u16, Vec<(u64, u64)>>,
    start: u64,
    end: u64,
}

/// A file that is being written.
pub struct Writer<'a> {
    out: &'a mut dyn Write,
    offset: u64,
    /// Topic and type of each channel, which has its place in the list as its number.
    channels: Vec<(String, Type)>,
    chunk: Chunk,
    /// The index of all chunks so far.
    chunks: Vec<Vec<u8>>,
    counts: BTreeMap<u16, u64>,
    start: u64,
    end: u64,
}

impl<'a> Writer<'a> {
    /// A file with these channels.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn new(out: &'a mut dyn Write, channels: Vec<(String, Type)>) -> Result<Self> {
        let library = concat!("teachtree ", env!("CARGO_PKG_VERSION"));
        let mut writer = Self {
            out,
            offset: 0,
            channels,
            chunk: Chunk::default(),
            chunks: vec![],
            counts: BTreeMap::new(),
            start: u64::MAX,
            end: 0,
        };
        writer.put(&MAGIC)?;
        writer.put(&Fields::default().text("ros2").text(library).record(HEADER))?;
        let known = writer.schemas_and_channels();
        writer.put(&known)?;
        Ok(writer)
    }

    fn put(&mut self, bytes: &[u8]) -> Result<()> {
        self.offset += bytes.len() as u64;
        self.out.write_all(bytes)
    }

    fn schemas(&self) -> Vec<u8> {
        let used = Type::ALL.into_iter().filter(|ty| self.channels.iter().any(|(_, used)| used == ty));
        let schema = |ty: Type| Fields::default().u16(ty.id()).text(ty.name()).text("ros2msg").text(ty.definition());
        used.flat_map(|ty| schema(ty).record(SCHEMA)).collect()
    }

    fn channels(&self) -> Vec<u8> {
        let channels = (0..).zip(&self.channels).flat_map(|(id, (topic, ty))| {
            let fields = Fields::default().u16(id).u16(ty.id()).text(topic).text("cdr");
            fields.sized(Fields::default()).record(CHANNEL)
        });
        channels.collect()
    }

    fn schemas_and_channels(&self) -> Vec<u8> {
        [self.schemas(), self.channels()].concat()
    }

    /// Writes a message of a channel at a time, ns.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn message(&mut self, channel: u16, time: u64, message: &[u8]) -> Result<()> {
        let sequence = self.counts.entry(channel).or_default();
        *sequence += 1;
        let fields =
            Fields::default().u16(channel).u32(u32::try_from(*sequence).unwrap_or(u32::MAX)).u64(time).u64(time);
        let chunk = &mut self.chunk;
        if chunk.records.is_empty() {
            (chunk.start, chunk.end) = (time, time);
        }
        (chunk.start, chunk.end) = (chunk.start.min(time), chunk.end.max(time));
        chunk.index.entry(channel).or_default().push((time, chunk.records.len() as u64));
        chunk.records.extend(fields.with(message).record(MESSAGE));
        if chunk.records.len() >= CHUNK_BYTES { self.close_chunk() } else { Ok(()) }
    }

    fn close_chunk(&mut self) -> Result<()> {
        let Chunk { records, index, start, end } = std::mem::take(&mut self.chunk);
        if records.is_empty() {
            return Ok(());
        }
        (self.start, self.end) = (self.start.min(start), self.end.max(end));
        let packed = ::zstd::bulk::compress(&records, 3)?;
        let fields = Fields::default().u64(start).u64(end).u64(records.len() as u64).u32(crc32fast::hash(&records));
        let chunk = fields.text("zstd").u64(packed.len() as u64).with(&packed).record(CHUNK);
        let at = self.offset;
        self.put(&chunk)?;
        let (first, mut offsets) = (self.offset, Fields::default());
        for (channel, messages) in &index {
            offsets = offsets.u16(*channel).u64(self.offset);
            let pairs = messages.iter().fold(Fields::default(), |pairs, (time, place)| pairs.u64(*time).u64(*place));
            self.put(&Fields::default().u16(*channel).sized(pairs).record(MESSAGE_INDEX))?;
        }
        let fields = Fields::default().u64(start).u64(end).u64(at).u64(chunk.len() as u64).sized(offsets);
        let fields = fields.u64(self.offset - first).text("zstd").u64(packed.len() as u64).u64(records.len() as u64);
        self.chunks.push(fields.record(CHUNK_INDEX));
        Ok(())
    }

    /// Writes what is left, what is said about the file, and the summary.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn finish(mut self, said: &[(&str, String)]) -> Result<()> {
        self.close_chunk()?;
        let pairs = said.iter().fold(Fields::default(), |pairs, (key, value)| pairs.text(key).text(value));
        let metadata = Fields::default().text("teachtree").sized(pairs).record(METADATA);
        let at = self.offset;
        self.put(&metadata)?;
        let metadata = Fields::default().u64(at).u64(metadata.len() as u64).text("teachtree").record(METADATA_INDEX);
        self.put(&Fields::default().u32(0).record(DATA_END))?;
        let total: u64 = self.counts.values().sum();
        let counts =
            self.counts.iter().fold(Fields::default(), |counts, (channel, count)| counts.u16(*channel).u64(*count));
        let used = Type::ALL.into_iter().filter(|ty| self.channels.iter().any(|(_, used)| used == ty)).count();
        let start = if total == 0 { 0 } else { self.start };
        let statistics = Fields::default()
            .u64(total)
            .u16(used as u16)
            .u32(length(self.channels.len()))
            .u32(0)
            .u32(1)
            .u32(length(self.chunks.len()))
            .u64(start)
            .u64(self.end)
            .sized(counts)
            .record(STATISTICS);
        let groups = [
            (SCHEMA, self.schemas()),
            (CHANNEL, self.channels()),
            (STATISTICS, statistics),
            (CHUNK_INDEX, self.chunks.concat()),
            (METADATA_INDEX, metadata),
        ];
        let summary_at = self.offset;
        let (mut summary, mut offsets) = (vec![], vec![]);
        for (kind, records) in groups.into_iter().filter(|(_, records)| !records.is_empty()) {
            let place = Fields::default().with([kind]).u64(summary_at + summary.len() as u64).u64(records.len() as u64);
            offsets.extend(place.record(SUMMARY_OFFSET));
            summary.extend(records);
        }
        let offsets_at = summary_at + summary.len() as u64;
        summary.extend(offsets);
        // The check sum covers the summary and the footer up to itself.
        let footer = Fields::default().u64(summary_at).u64(offsets_at);
        let mut covered = summary.clone();
        covered.push(FOOTER);
        covered.extend(20_u64.to_le_bytes());
        covered.extend(&footer.0);
        self.put(&summary)?;
        self.put(&footer.u32(crc32fast::hash(&covered)).record(FOOTER))?;
        self.put(&MAGIC)
    }
}
