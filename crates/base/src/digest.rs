//! Digests that identify files, rules and results: the first 128 bits of SHA-256, equal on all machines.

use sha2::{Digest as _, Sha256};
use std::fmt::Write as _;

/// Length of a digest in bytes. Two printed digits represent one byte.
const BYTES: usize = 16;

/// The SHA-256 digest of the bytes added so far.
///
/// Bytes may be added in pieces of any size. A field has its length before its bytes, so that the fields `ab`, `c` and `a`, `bc` differ.
#[derive(Clone, Debug, Default)]
pub struct Digest(Sha256);

impl Digest {
    /// Adds bytes without their length: the digest of the bytes of a file is the beginning of its SHA-256 checksum.
    pub fn bytes(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// Adds the number of fields that follow.
    pub fn count(&mut self, count: usize) {
        self.bytes(&(count as u64).to_le_bytes());
    }

    /// Adds a field.
    pub fn field(&mut self, text: &str) {
        self.count(text.len());
        self.bytes(text.as_bytes());
    }

    /// Returns the first 128 bits of the digest as 32 hexadecimal digits.
    pub fn finish(self) -> String {
        self.0.finalize().iter().take(BYTES).fold(String::new(), |mut digits, byte| {
            let _ = write!(digits, "{byte:02x}");
            digits
        })
    }
}
