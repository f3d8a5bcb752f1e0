//! The signature of HDF5, which stands at the start of a file or behind a user block (HDF5 file format, II.A).

use std::io::{Read, Result, Seek, SeekFrom};

/// The signature.
const SIGNATURE: [u8; 8] = [0x89, b'H', b'D', b'F', b'\r', b'\n', 0x1a, b'\n'];
/// The size of the smallest user block, bytes; each larger one has twice the size of the one before.
const LEAST_BLOCK: u64 = 512;

/// Whether the signature is at byte 0, 512, 1024, 2048, … Afterward, the file is read from its start again.
///
/// # Errors
/// When the file cannot be read.
pub fn is_at_start_or_behind_block(file: &mut (impl Read + Seek)) -> Result<bool> {
    let length = file.seek(SeekFrom::End(0))?;
    let mut at = 0;
    let mut is_found = false;
    while !is_found && at + SIGNATURE.len() as u64 <= length {
        let mut bytes = [0; SIGNATURE.len()];
        file.seek(SeekFrom::Start(at))?;
        file.read_exact(&mut bytes)?;
        is_found = bytes == SIGNATURE;
        at = (2 * at).max(LEAST_BLOCK);
    }
    file.seek(SeekFrom::Start(0))?;
    Ok(is_found)
}
