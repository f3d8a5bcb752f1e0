//! Progress of reading a file: reading is most of the time that a long log takes.

use std::io::{Read, Result};
use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes of the file that was opened last, and how many of them were read.
static TOTAL: AtomicU64 = AtomicU64::new(0);
static DONE: AtomicU64 = AtomicU64::new(0);

/// The share of the file that was opened last which was read so far, 0 to 1; `None` where none is being read.
pub fn share() -> Option<f64> {
    let (done, total) = (DONE.load(Ordering::Relaxed), TOTAL.load(Ordering::Relaxed));
    (done < total).then(|| done as f64 / total as f64)
}

/// A reader that counts its bytes.
pub struct CountingReader<R>(R);

impl<R: Read> CountingReader<R> {
    /// Counts the bytes of a file of this length.
    pub fn new(inner: R, bytes: u64) -> Self {
        DONE.store(0, Ordering::Relaxed);
        TOTAL.store(bytes, Ordering::Relaxed);
        Self(inner)
    }
}

impl<R: Read> Read for CountingReader<R> {
    fn read(&mut self, into: &mut [u8]) -> Result<usize> {
        let count = self.0.read(into)?;
        DONE.fetch_add(count as u64, Ordering::Relaxed);
        Ok(count)
    }
}

impl<R> Drop for CountingReader<R> {
    fn drop(&mut self) {
        TOTAL.store(0, Ordering::Relaxed);
    }
}
