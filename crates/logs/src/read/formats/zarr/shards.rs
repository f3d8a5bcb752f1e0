//! Shards of version 3 (`sharding_indexed`): a file has several chunks, and an index with the place of each.

use super::codecs::{Codec, crc32c};
use std::ops::Range;

/// Size of a chunk's entry in the index, bytes: its offset and its length.
const ENTRY: usize = 16;

/// The storage of an array's shards.
#[derive(Clone, Debug)]
pub(super) struct Shards {
    /// The shape of a shard, a multiple of that of a chunk.
    pub shape: Vec<usize>,
    /// Whether the index is before the chunks, not after them.
    pub index_at_start: bool,
    /// Whether the index has a checksum.
    pub has_sum: bool,
    /// The codecs of a shard, in the order of encoding.
    pub codecs: Vec<Codec>,
}

impl Shards {
    /// Returns the number of chunks of this shape in each dimension of a shard.
    pub fn chunks(&self, chunk: &[usize]) -> Vec<usize> {
        self.shape.iter().zip(chunk).map(|(shard, chunk)| shard / (*chunk).max(1)).collect()
    }

    /// The bytes of the index, for chunks of this shape.
    pub fn index_bytes(&self, chunk: &[usize]) -> usize {
        let count = self.chunks(chunk).into_iter().fold(1_usize, usize::saturating_mul);
        count.saturating_mul(ENTRY).saturating_add(if self.has_sum { 4 } else { 0 })
    }

    /// Returns the range of a chunk in the bytes of its shard; `None` for a chunk that was never written. `within` is its index in each dimension of the shard.
    ///
    /// # Errors
    /// The index is damaged.
    pub fn find(&self, shard: &[u8], chunk: &[usize], within: &[usize]) -> Result<Option<Range<usize>>, String> {
        let length = self.index_bytes(chunk);
        let begin = if self.index_at_start { Some(0) } else { shard.len().checked_sub(length) };
        let index = begin.and_then(|begin| shard.get(begin..begin.checked_add(length)?));
        let mut index = index.ok_or("is shorter than its index")?;
        if self.has_sum {
            let (entries, sum) = index.split_at_checked(length.saturating_sub(4)).unwrap_or_default();
            if crc32c(entries).to_le_bytes() != sum {
                return Err("has an index with a wrong checksum".into());
            }
            index = entries;
        }
        let at = self.chunks(chunk).iter().zip(within).fold(0, |at, (count, number)| at * count + number);
        let number = |place: usize| {
            let bytes = index.get(at * ENTRY + place..at * ENTRY + place + 8)?;
            Some(u64::from_le_bytes(bytes.try_into().ok()?))
        };
        let (begin, length) = number(0).zip(number(8)).ok_or("has an index that is too short")?;
        if [begin, length] == [u64::MAX; 2] {
            return Ok(None);
        }
        let outside = || format!("has an index that leads out of its {} bytes", shard.len());
        let [begin, length] = [begin, length].map(|it| usize::try_from(it).unwrap_or(usize::MAX));
        let end = begin.checked_add(length).filter(|end| *end <= shard.len()).ok_or_else(outside)?;
        Ok(Some(begin..end))
    }
}
