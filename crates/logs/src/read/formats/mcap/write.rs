//! Writes MCAP: messages of ROS 2 in CDR, in compressed chunks with an index and a summary, so that viewers may jump; alone, or among all messages of another
//! file.

use super::copy::OriginalRecords;
use super::ros2_message::Ros2Type;
use super::{Fault, Fields as Read, MAGIC};
use std::collections::BTreeMap;
use std::io::{Error, Result, Write};

/// Records that are written beside those that are read.
pub(super) const HEADER: u8 = 1;
const FOOTER: u8 = 2;
const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;
const MESSAGE_INDEX: u8 = 7;
const CHUNK_INDEX: u8 = 8;
pub(super) const ATTACHMENT: u8 = 9;
const ATTACHMENT_INDEX: u8 = 10;
const STATISTICS: u8 = 11;
pub(super) const METADATA: u8 = 12;
const METADATA_INDEX: u8 = 13;
const SUMMARY_OFFSET: u8 = 14;
const DATA_END: u8 = 15;
/// The first opcode of private records of other programs.
pub(super) const PRIVATE: u8 = 0x80;
/// Approximate size of a chunk before compression, bytes.
const CHUNK_BYTES: usize = 1 << 20;

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

/// The channel and the time, ns, of a message.
fn stamp(fields: &mut Read) -> std::result::Result<(u16, u64), Fault> {
    let (channel, _sequence, time) = (fields.u16()?, fields.u32()?, fields.u64()?);
    Ok((channel, time))
}

/// The index of an attachment that is written at a place.
fn attachment(body: &[u8], at: u64) -> std::result::Result<Vec<u8>, Fault> {
    let mut fields = Read(body);
    let (logged, created, name, media, size) =
        (fields.u64()?, fields.u64()?, fields.text()?, fields.text()?, fields.u64()?);
    // With the kind and the length before it.
    let index = Fields::default().u64(at).u64(body.len() as u64 + 9).u64(logged).u64(created).u64(size);
    Ok(index.text(&name).text(&media).record(ATTACHMENT_INDEX))
}

fn length(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}

/// A chunk that is being filled.
#[derive(Default)]
struct Chunk {
    records: Vec<u8>,
    index: Index,
}

/// Which messages a chunk has.
#[derive(Default)]
struct Index {
    /// Time and place of each message, by channel.
    messages: BTreeMap<u16, Vec<(u64, u64)>>,
    /// Times of the first and the last one.
    span: Option<(u64, u64)>,
}

impl Index {
    fn add(&mut self, channel: u16, time: u64, place: usize) {
        let (start, end) = self.span.unwrap_or((time, time));
        self.span = Some((start.min(time), end.max(time)));
        self.messages.entry(channel).or_default().push((time, place as u64));
    }
}

/// The summary of what was written so far.
#[derive(Default)]
struct Summary {
    /// The records of schemas and channels by their numbers.
    schemas: BTreeMap<u16, Vec<u8>>,
    channels: BTreeMap<u16, Vec<u8>>,
    chunks: Vec<Vec<u8>>,
    attachments: Vec<Vec<u8>>,
    metadata: Vec<Vec<u8>>,
    /// Number of messages of each channel.
    counts: BTreeMap<u16, u64>,
    /// Times of the first and the last message.
    span: Option<(u64, u64)>,
}

/// A file that is being written.
pub struct Writer<'a> {
    out: &'a mut dyn Write,
    offset: u64,
    /// The number in the file of each channel that messages are given for by their place in a list.
    ids: Vec<u16>,
    sequence: BTreeMap<u16, u32>,
    chunk: Chunk,
    summary: Summary,
    /// The file whose records are copied in order of time.
    original: Option<OriginalRecords>,
}

impl<'a> Writer<'a> {
    /// A file with these channels, topic and type each; among the records of another one where there is one.
    ///
    /// # Errors
    /// When it cannot be written, or the original has no numbers left for these channels.
    pub fn new(
        out: &'a mut dyn Write,
        channels: &[(String, Ros2Type)],
        original: Option<OriginalRecords>,
    ) -> Result<Self> {
        let library = concat!("teachtree ", env!("CARGO_PKG_VERSION"));
        let taken = |id: &u16| original.as_ref().is_some_and(|file| file.survey().channels.contains_key(id));
        let ids: Vec<u16> = (0..=u16::MAX).filter(|id| !taken(id)).take(channels.len()).collect();
        let taken = |id: &u16| original.as_ref().is_some_and(|file| file.survey().schemas.contains_key(id));
        let schemas: Vec<u16> = (1..=u16::MAX).filter(|id| !taken(id)).take(Ros2Type::ALL.len()).collect();
        if ids.len() < channels.len() || schemas.len() < Ros2Type::ALL.len() {
            return Err(Error::other("the file that is copied has no number left for another channel"));
        }
        let profile = original.as_ref().map_or("ros2", |file| file.survey().profile());
        let header = Fields::default().text(profile).text(library).record(HEADER);
        let summary = Summary::default();
        let mut writer =
            Self { out, offset: 0, ids, sequence: BTreeMap::new(), chunk: Chunk::default(), summary, original };
        writer.put(&MAGIC)?;
        writer.put(&header)?;
        let of: BTreeMap<Ros2Type, u16> = Ros2Type::ALL.into_iter().zip(schemas).collect();
        for (ty, id) in &of {
            if channels.iter().any(|(_, used)| used == ty) {
                let fields = Fields::default().u16(*id).text(ty.name()).text("ros2msg").text(ty.definition());
                writer.schema(*id, fields.record(SCHEMA))?;
            }
        }
        for (id, (topic, ty)) in writer.ids.clone().into_iter().zip(channels) {
            let schema = of.get(ty).copied().unwrap_or_default();
            let fields = Fields::default().u16(id).u16(schema).text(topic).text("cdr").sized(Fields::default());
            writer.channel(id, fields.record(CHANNEL))?;
        }
        Ok(writer)
    }

    fn put(&mut self, bytes: &[u8]) -> Result<()> {
        self.offset += bytes.len() as u64;
        self.out.write_all(bytes)
    }

    fn schema(&mut self, id: u16, record: Vec<u8>) -> Result<()> {
        self.put(&record)?;
        self.summary.schemas.entry(id).or_insert(record);
        Ok(())
    }

    fn channel(&mut self, id: u16, record: Vec<u8>) -> Result<()> {
        self.put(&record)?;
        self.summary.channels.entry(id).or_insert(record);
        Ok(())
    }

    /// Writes a message of a channel, by its place in the list, at a time, ns.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn message(&mut self, channel: u16, time: u64, message: &[u8]) -> Result<()> {
        self.copy_until(time)?;
        let Some(id) = self.ids.get(usize::from(channel)).copied() else { return Ok(()) };
        let sequence = self.sequence.entry(id).or_default();
        *sequence = sequence.saturating_add(1);
        let fields = Fields::default().u16(id).u32(*sequence).u64(time).u64(time);
        self.add(id, time, &fields.with(message).record(MESSAGE))
    }

    /// Adds a message to the chunk that is being filled.
    fn add(&mut self, channel: u16, time: u64, record: &[u8]) -> Result<()> {
        self.chunk.index.add(channel, time, self.chunk.records.len());
        self.chunk.records.extend(record);
        if self.chunk.records.len() >= CHUNK_BYTES { self.close_chunk() } else { Ok(()) }
    }

    fn close_chunk(&mut self) -> Result<()> {
        let Chunk { records, index } = std::mem::take(&mut self.chunk);
        let Some((start, end)) = index.span else { return Ok(()) };
        let packed = ::zstd::bulk::compress(&records, 3)?;
        let fields = Fields::default().u64(start).u64(end).u64(records.len() as u64).u32(crc32fast::hash(&records));
        let body = fields.text("zstd").u64(packed.len() as u64).with(&packed).0;
        self.put_chunk(&body, &index)
    }

    /// Writes a chunk and the index of its messages.
    fn put_chunk(&mut self, body: &[u8], index: &Index) -> Result<()> {
        let mut head = Read(body);
        let read = |head: &mut Read| Some((head.u64().ok()?, head.u64().ok()?, head.u64().ok()?, head.u32().ok()?));
        let cut = || Error::other("a chunk that is copied is damaged");
        let (start, end, plain, _) = read(&mut head).ok_or_else(cut)?;
        let compression = head.text().map_err(|_| cut())?;
        let packed = head.u64().map_err(|_| cut())?;
        let at = self.offset;
        let record = Fields(body.to_vec()).record(CHUNK);
        self.put(&record)?;
        let (first, mut offsets) = (self.offset, Fields::default());
        for (channel, messages) in &index.messages {
            offsets = offsets.u16(*channel).u64(self.offset);
            let pairs = messages.iter().fold(Fields::default(), |pairs, (time, place)| pairs.u64(*time).u64(*place));
            self.put(&Fields::default().u16(*channel).sized(pairs).record(MESSAGE_INDEX))?;
            *self.summary.counts.entry(*channel).or_default() += messages.len() as u64;
        }
        if let Some((start, end)) = index.span {
            let (first, last) = self.summary.span.unwrap_or((start, end));
            self.summary.span = Some((first.min(start), last.max(end)));
        }
        let fields = Fields::default().u64(start).u64(end).u64(at).u64(record.len() as u64).sized(offsets);
        let fields = fields.u64(self.offset - first).text(&compression).u64(packed).u64(plain);
        self.summary.chunks.push(fields.record(CHUNK_INDEX));
        Ok(())
    }

    /// Copies the records of the original that are not later than a time, ns.
    fn copy_until(&mut self, time: u64) -> Result<()> {
        while let Some(mut original) = self.original.take() {
            let next = original.next_until(time);
            let done = matches!(next, Ok(None));
            self.original = Some(original);
            if let Some((kind, body)) = next? {
                self.copy(kind, &body)?;
            }
            if done {
                return Ok(());
            }
        }
        Ok(())
    }

    /// Copies a record unchanged. A message outside a chunk is put into one, since readers that use the index find messages in chunks only.
    fn copy(&mut self, kind: u8, body: &[u8]) -> Result<()> {
        let damaged = |_| Error::other("a record that is copied is damaged");
        let record = || Fields(body.to_vec()).record(kind);
        let mut fields = Read(body);
        match kind {
            SCHEMA => self.schema(fields.u16().map_err(damaged)?, record()),
            CHANNEL => {
                let id = fields.u16().map_err(damaged)?;
                if self.ids.contains(&id) {
                    return Err(Error::other("the file that is copied has changed in the meantime"));
                }
                self.channel(id, record())
            }
            MESSAGE => {
                let (channel, time) = stamp(&mut fields).map_err(damaged)?;
                self.add(channel, time, &record())
            }
            CHUNK => {
                self.close_chunk()?;
                let index = self.index(&super::decompressed(body).map_err(damaged)?).map_err(damaged)?;
                self.put_chunk(body, &index)
            }
            ATTACHMENT => {
                self.summary.attachments.push(attachment(body, self.offset).map_err(damaged)?);
                self.put(&record())
            }
            METADATA => self.metadata(&fields.text().map_err(damaged)?, &record()),
            PRIVATE.. => self.put(&record()),
            // The index and the summary are made anew.
            _ => Ok(()),
        }
    }

    /// The messages in the records of a chunk. Its schemas and channels are in the summary from then on.
    fn index(&mut self, plain: &[u8]) -> std::result::Result<Index, Fault> {
        let (mut rest, mut index) = (plain, Index::default());
        loop {
            let place = plain.len() - rest.len();
            let (kind, body) = match super::record(&mut rest) {
                Ok(Some(record)) => record,
                Ok(None) | Err(Fault::Truncated) => return Ok(index),
                Err(fault) => return Err(fault),
            };
            let mut fields = Read(&body);
            match kind {
                SCHEMA | CHANNEL => {
                    let id = fields.u16()?;
                    let known = if kind == SCHEMA { &mut self.summary.schemas } else { &mut self.summary.channels };
                    known.entry(id).or_insert_with(|| Fields(body).record(kind));
                }
                MESSAGE => {
                    let (channel, time) = stamp(&mut fields)?;
                    index.add(channel, time, place);
                }
                _ => {}
            }
        }
    }

    fn metadata(&mut self, name: &str, record: &[u8]) -> Result<()> {
        let place = Fields::default().u64(self.offset).u64(record.len() as u64);
        self.summary.metadata.push(place.text(name).record(METADATA_INDEX));
        self.put(record)
    }

    /// Writes the remaining records, the metadata and the summary.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn finish(mut self, said: &[(&str, String)]) -> Result<()> {
        self.copy_until(u64::MAX)?;
        self.close_chunk()?;
        let pairs = said.iter().fold(Fields::default(), |pairs, (key, value)| pairs.text(key).text(value));
        self.metadata("teachtree", &Fields::default().text("teachtree").sized(pairs).record(METADATA))?;
        self.put(&Fields::default().u32(0).record(DATA_END))?;
        let Summary { schemas, channels, chunks, attachments, metadata, counts, span } =
            std::mem::take(&mut self.summary);
        let (start, end) = span.unwrap_or_default();
        let by_channel =
            counts.iter().fold(Fields::default(), |counts, (channel, count)| counts.u16(*channel).u64(*count));
        let statistics = Fields::default()
            .u64(counts.values().sum())
            .u16(u16::try_from(schemas.len()).unwrap_or(u16::MAX))
            .u32(length(channels.len()))
            .u32(length(attachments.len()))
            .u32(length(metadata.len()))
            .u32(length(chunks.len()))
            .u64(start)
            .u64(end)
            .sized(by_channel)
            .record(STATISTICS);
        let groups = [
            (SCHEMA, schemas.into_values().collect::<Vec<_>>().concat()),
            (CHANNEL, channels.into_values().collect::<Vec<_>>().concat()),
            (STATISTICS, statistics),
            (CHUNK_INDEX, chunks.concat()),
            (ATTACHMENT_INDEX, attachments.concat()),
            (METADATA_INDEX, metadata.concat()),
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
        // The checksum covers the summary and the footer up to itself.
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
