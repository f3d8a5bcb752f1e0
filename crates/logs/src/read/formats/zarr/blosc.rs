//! Chunks of Blosc (version 1, <https://github.com/Blosc/c-blosc/blob/main/README_CHUNK_FORMAT.rst>): a header, blocks that are each packed in one part or
//! in one for each byte of an element, and bytes or bits that were sorted by their place in an element.

use super::codecs::zstd;
use std::io::Read;

/// Size of the header, bytes.
const HEADER: usize = 16;
/// Blocks of longer elements, and those with fewer elements, are in one part.
const MAX_PARTS: usize = 16;
const MIN_PART: usize = 128;

/// The compression of the parts of blocks.
#[derive(Clone, Copy)]
enum Compressor {
    Lz4,
    Zlib,
    Zstd,
}

/// The bytes that were packed, at most `most` of them.
///
/// # Errors
/// When they are damaged, more, or packed by something that is not read here.
pub(super) fn undo(bytes: &[u8], most: usize) -> Result<Vec<u8>, String> {
    let damaged = || "is damaged: its blocks lie outside of it".to_string();
    let &[version, _, flags, element, ..] = bytes else { return Err(damaged()) };
    if version > 2 {
        return Err(format!("is of version {version} of the format of Blosc, expected 2"));
    }
    let (size, block) = (number(bytes, 4).ok_or_else(damaged)?, number(bytes, 8).ok_or_else(damaged)?);
    if size > most {
        return Err(format!("is unpacked to {size} bytes, at most {most} are expected"));
    }
    if flags & 2 != 0 {
        return Ok(bytes.get(HEADER..HEADER + size).ok_or_else(damaged)?.to_vec());
    }
    let packed = match flags >> 5 {
        0 => return Err(other("blosclz")),
        1 => Compressor::Lz4,
        2 => return Err(other("snappy")),
        3 => Compressor::Zlib,
        4 => Compressor::Zstd,
        other => return Err(format!("is packed by Blosc with the unknown method {other}")),
    };
    let element = usize::from(element).max(1);
    let in_parts = flags & 16 == 0 && element <= MAX_PARTS && block / element >= MIN_PART;
    let mut unpacked = Vec::with_capacity(size);
    let mut index = HEADER;
    while unpacked.len() < size {
        let length = block.min(size - unpacked.len());
        if length == 0 {
            return Err(damaged());
        }
        let mut at = number(bytes, index).ok_or_else(damaged)?;
        index += 4;
        let parts = if in_parts && length == block { element } else { 1 };
        let mut whole = Vec::with_capacity(length);
        for _ in 0..parts {
            let stored = number(bytes, at).ok_or_else(damaged)?;
            at += 4;
            let part = bytes.get(at..at.checked_add(stored).ok_or_else(damaged)?).ok_or_else(damaged)?;
            at += stored;
            let wanted = length / parts;
            let found = if stored == wanted { part.to_vec() } else { unpack(packed, part, wanted)? };
            if found.len() != wanted {
                return Err(format!("has a block of {} bytes, expected {wanted}", found.len()));
            }
            whole.extend(found);
        }
        whole.resize(length, 0);
        match (flags & 1 != 0, flags & 4 != 0) {
            (true, _) if element > 1 => unshuffle(&whole, element, &mut unpacked),
            (_, true) => unshuffle_bits(&whole, element, &mut unpacked),
            _ => unpacked.extend(whole),
        }
    }
    Ok(unpacked)
}

/// The message about parts that are packed by something that is not read here.
pub(super) fn other(packer: &str) -> String {
    format!("is packed by Blosc with `{packer}`, which is not read here, expected lz4, zlib or zstd")
}

/// A whole number of 32 bits.
fn number(bytes: &[u8], at: usize) -> Option<usize> {
    let of = bytes.get(at..at.checked_add(4)?)?;
    let number = of.iter().rev().fold(0_u32, |number, byte| number << 8 | u32::from(*byte));
    usize::try_from(i32::try_from(number).ok()?).ok()
}

fn unpack(packed: Compressor, part: &[u8], size: usize) -> Result<Vec<u8>, String> {
    match packed {
        Compressor::Zstd => zstd(part, size),
        Compressor::Lz4 => {
            let mut unpacked = vec![0; size];
            let length = lz4_flex::block::decompress_into(part, &mut unpacked);
            unpacked.truncate(length.map_err(|error| format!("cannot be unpacked: {error}"))?);
            Ok(unpacked)
        }
        Compressor::Zlib => {
            let mut unpacked = Vec::with_capacity(size);
            let read = flate2::read::ZlibDecoder::new(part).take(size as u64 + 1).read_to_end(&mut unpacked);
            read.map_err(|error| format!("cannot be unpacked: {error}"))?;
            Ok(unpacked)
        }
    }
}

/// Puts bytes that were sorted by their place in an element back.
fn unshuffle(block: &[u8], element: usize, into: &mut Vec<u8>) {
    let count = block.len() / element;
    for at in 0..count {
        into.extend((0..element).map(|byte| block.get(byte * count + at).copied().unwrap_or(0)));
    }
    into.extend_from_slice(block.get(count * element..).unwrap_or_default());
}

/// Puts bits that were sorted by their place in an element back. Blocks whose number of elements is not a multiple of eight are as they were.
fn unshuffle_bits(block: &[u8], element: usize, into: &mut Vec<u8>) {
    let count = block.len() / element;
    if !count.is_multiple_of(8) {
        into.extend_from_slice(block);
        return;
    }
    for at in 0..count {
        for byte in 0..element {
            let bit = |bit: usize| {
                let of = block.get((byte * 8 + bit) * (count / 8) + at / 8).copied().unwrap_or(0);
                (of >> (at % 8) & 1) << bit
            };
            into.push((0..8).map(bit).sum());
        }
    }
    into.extend_from_slice(block.get(count * element..).unwrap_or_default());
}
