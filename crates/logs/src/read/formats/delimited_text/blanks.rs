//! Runs of blanks as delimiters: a text is read with one tab in the place of each run, and without blanks at the ends of lines.

use std::io::{BufRead, BufReader, Read, Result};

/// A text whose runs of blanks are read as one tab.
pub(super) struct BlanksAsTabs<R> {
    bytes: BufReader<R>,
    /// Whether blanks were read since the last letter of the line.
    gap: bool,
    /// Whether the line has a letter.
    begun: bool,
}

impl<R: Read> BlanksAsTabs<R> {
    pub fn new(bytes: R) -> Self {
        Self { bytes: BufReader::new(bytes), gap: false, begun: false }
    }
}

impl<R: Read> Read for BlanksAsTabs<R> {
    fn read(&mut self, out: &mut [u8]) -> Result<usize> {
        let mut written = 0;
        // A call that writes nothing marks the end of the text.
        while written == 0 && !out.is_empty() {
            let chunk = self.bytes.fill_buf()?;
            if chunk.is_empty() {
                break;
            }
            let mut used = 0;
            while let (Some(slot), Some(byte)) = (out.get_mut(written), chunk.get(used)) {
                let line_ends = matches!(byte, b'\n' | b'\r');
                match byte {
                    b' ' | b'\t' => (self.gap, used) = (true, used + 1),
                    // The tab comes first; the next iteration writes the letter.
                    _ if self.gap && self.begun && !line_ends => {
                        (*slot, self.gap, written) = (b'\t', false, written + 1);
                    }
                    byte => {
                        (*slot, self.gap, self.begun) = (*byte, false, !line_ends);
                        (used, written) = (used + 1, written + 1);
                    }
                }
            }
            self.bytes.consume(used);
        }
        Ok(written)
    }
}
