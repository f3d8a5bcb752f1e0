//! What a file may promise: the sizes that it states are compared with its own before memory is taken for them.

/// How much of a file may become memory, in bytes: so many times the file, and a little that every file may have.
pub(super) struct Budget {
    left: u64,
    /// For all arrays.
    pub whole: u64,
}

impl Budget {
    /// How many bytes a byte of the file may become: deflate compresses by a factor of 1032 at best.
    const EXPANSION: u64 = 1100;
    /// How many bytes every file may become: what is constant compresses better than that.
    const ALWAYS: u64 = 16 << 20;
    /// What is said of an array that does not fit.
    pub const REFUSED: &str = "promises more data than the file can hold";

    /// That of a file of this size.
    pub fn new(file_size: u64) -> Self {
        let whole = file_size.saturating_mul(Self::EXPANSION).saturating_add(Self::ALWAYS);
        Self { left: whole, whole }
    }

    /// Whether an array fits beside those that were taken before; then it is taken. `size` is that of an element in the file.
    pub fn take(&mut self, elements: Option<usize>, size: usize, texts: bool) -> bool {
        // Numbers take 8 bytes; a text has a head beside its bytes.
        let size = if texts { size.saturating_add(32) } else { size.max(8) };
        let bytes = elements.and_then(|count| count.checked_mul(size)).and_then(|bytes| u64::try_from(bytes).ok());
        let left = bytes.and_then(|bytes| self.left.checked_sub(bytes));
        self.left = left.unwrap_or(self.left);
        left.is_some()
    }

    /// Whether so many bytes fit.
    pub fn has(&self, bytes: Option<usize>) -> bool {
        bytes.is_some_and(|bytes| bytes as u64 <= self.whole)
    }
}
