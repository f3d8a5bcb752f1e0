//! The codecs of a chunk's bytes. The decoded size is limited to that of the chunk.

use super::blosc;
use std::io::Read;

/// The supported codecs, for messages about other ones.
const EXPECTED: &str = "expected none, gzip, zlib, zstd, blosc, lz4 or crc32c";

/// In which order the dimensions of a chunk are stored.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum DimensionOrder {
    /// As they are named: the last one changes fastest.
    RowMajor,
    /// The first one changes fastest.
    ColumnMajor,
    /// The dimension of this number first.
    Transposed(Vec<usize>),
}

/// A codec from bytes to bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Codec {
    Gzip,
    Zlib,
    Zstd,
    Blosc,
    Lz4,
    /// A checksum after the bytes.
    Crc32c,
}

impl Codec {
    /// A codec by its name, and by that of what Blosc packs with.
    ///
    /// # Errors
    /// When it is none that is read here.
    pub fn read(name: &str, packer: Option<&str>) -> Result<Self, String> {
        Ok(match name {
            "gzip" => Self::Gzip,
            "zlib" => Self::Zlib,
            "zstd" => Self::Zstd,
            "blosc" => match packer {
                Some(packer @ ("blosclz" | "snappy")) => return Err(blosc::other(packer)),
                _ => Self::Blosc,
            },
            "lz4" => Self::Lz4,
            "crc32c" => Self::Crc32c,
            other => return Err(format!("went through the codec `{other}`, which is not read here, {EXPECTED}")),
        })
    }

    /// The bytes before they went through this codec, at most `most` of them.
    ///
    /// # Errors
    /// When they are damaged, or more.
    pub fn undo(self, bytes: &[u8], most: usize) -> Result<Vec<u8>, String> {
        let damaged = |error: &dyn std::fmt::Display| format!("cannot be unpacked: {error}");
        match self {
            Self::Gzip => unpacked(flate2::read::MultiGzDecoder::new(bytes), most),
            Self::Zlib => unpacked(flate2::read::ZlibDecoder::new(bytes), most),
            Self::Zstd => zstd(bytes, most),
            Self::Blosc => blosc::undo(bytes, most),
            Self::Lz4 => {
                let (size, packed) = bytes.split_at_checked(4).ok_or("cannot be unpacked: it has no length")?;
                let size = size.iter().rev().fold(0_usize, |size, byte| size << 8 | usize::from(*byte));
                if size > most {
                    return Err(too_long(most));
                }
                let mut unpacked = vec![0; size];
                let length =
                    lz4_flex::block::decompress_into(packed, &mut unpacked).map_err(|error| damaged(&error))?;
                unpacked.truncate(length);
                Ok(unpacked)
            }
            Self::Crc32c => {
                let at = bytes.len().checked_sub(4).ok_or("is too short for its checksum")?;
                let (bytes, sum) = bytes.split_at_checked(at).unwrap_or_default();
                if crc32c(bytes).to_le_bytes() != sum {
                    return Err("has a wrong checksum".into());
                }
                Ok(bytes.to_vec())
            }
        }
    }
}

fn too_long(most: usize) -> String {
    format!("is unpacked to more than the {most} bytes that it should have")
}

fn unpacked(from: impl Read, most: usize) -> Result<Vec<u8>, String> {
    let mut unpacked = vec![];
    let read = from.take(most as u64 + 1).read_to_end(&mut unpacked);
    read.map_err(|error| format!("cannot be unpacked: {error}"))?;
    if unpacked.len() > most { Err(too_long(most)) } else { Ok(unpacked) }
}

/// Unpacks frames of zstd into at most `most` bytes.
pub(super) fn zstd(bytes: &[u8], most: usize) -> Result<Vec<u8>, String> {
    let unpacked = zstd::bulk::decompress(bytes, most);
    unpacked.map_err(|error| format!("cannot be unpacked: {error}"))
}

/// The checksum of Castagnoli (RFC 3720, section B.4).
pub(super) fn crc32c(bytes: &[u8]) -> u32 {
    let step = |sum: u32, byte: &u8| {
        let sum = sum ^ u32::from(*byte);
        (0..8).fold(sum, |sum, _| if sum & 1 == 1 { sum >> 1 ^ 0x82f6_3b78 } else { sum >> 1 })
    };
    !bytes.iter().fold(!0, step)
}
