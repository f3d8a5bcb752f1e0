//! Limits allocations by a file's declared sizes: they are compared with the size of the file before memory is allocated.

/// Memory limit for the contents of a file, in bytes: a multiple of the file's size plus a constant.
pub(super) struct Budget {
    left: u64,
    /// The limit for all arrays together.
    pub whole: u64,
}

impl Budget {
    /// Maximum expansion per byte of the file. The maximum compression ratio of deflate is 1032.
    const EXPANSION: u64 = 1100;
    /// Limit for every file, in bytes: constant data compresses better than `EXPANSION`.
    const ALWAYS: u64 = 16 << 20;
    /// The message about an array over the limit.
    pub const REFUSED: &str = "promises more data than the file can hold";

    /// Returns the limits for a file of this size.
    pub fn new(file_size: u64) -> Self {
        let whole = file_size.saturating_mul(Self::EXPANSION).saturating_add(Self::ALWAYS);
        Self { left: whole, whole }
    }

    /// Whether an array fits in the remaining memory; if so, reserves it. `size` is the size of an element in the file.
    pub fn take(&mut self, elements: Option<usize>, size: usize, texts: bool) -> bool {
        // A number takes 8 bytes; a text takes a header and its bytes.
        let size = if texts { size.saturating_add(32) } else { size.max(8) };
        let bytes = elements.and_then(|count| count.checked_mul(size)).and_then(|bytes| u64::try_from(bytes).ok());
        let left = bytes.and_then(|bytes| self.left.checked_sub(bytes));
        self.left = left.unwrap_or(self.left);
        left.is_some()
    }

    /// Whether this number of bytes fits.
    pub fn has(&self, bytes: Option<usize>) -> bool {
        bytes.is_some_and(|bytes| bytes as u64 <= self.whole)
    }
}
