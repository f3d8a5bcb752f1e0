//! A stable hash of bytes: the same on all machines and in all versions of this program.

/// FNV-1a of 64 bits. Texts that differ by accident have different hashes; an attacker can make two texts with the same hash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Digest(u64);

impl Default for Digest {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Digest {
    /// Adds bytes.
    pub fn add(&mut self, bytes: impl IntoIterator<Item = u8>) {
        let hash = bytes.into_iter().fold(self.0, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3));
        self.0 = hash;
    }

    /// Adds a text and its end, so that two texts differ from one that is both.
    pub fn text(&mut self, text: &str) {
        self.add(text.bytes().chain([0]));
    }

    /// The hash as 16 hexadecimal digits.
    pub fn shown(&self) -> String {
        format!("{:016x}", self.0)
    }
}
