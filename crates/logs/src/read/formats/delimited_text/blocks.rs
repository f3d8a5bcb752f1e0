//! Blocks of whole lines of a text, which are read on all cores and returned in the order of the lines.

use super::columns::{ColumnReader, RowBlock};
use memchr::{memchr_iter, memrchr};
use std::collections::BTreeMap;
use std::io::Read;
use std::ops::Range;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use teachtree_base::error::InputError;

/// Size of a block, in bytes.
const BLOCK: usize = 1 << 20;
/// Maximum number of threads that read one file.
const MAX_THREADS: usize = 8;

/// A text that is cut into blocks.
pub(super) struct TextBlocks {
    text: Box<dyn Read + Send>,
    /// The beginning of a line whose end is not read yet.
    rest: Vec<u8>,
    /// The line of the file with which `rest` begins.
    line: u64,
    has_ended: bool,
    /// The name of the file in messages.
    file: String,
}

impl TextBlocks {
    /// Begins with this line of the file.
    pub fn new(text: Box<dyn Read + Send>, line: u64, file: String) -> Self {
        Self { text, rest: vec![], line, has_ended: false, file }
    }

    /// Reads the next whole lines, about [`BLOCK`] bytes; none at the end. Returns their numbers in the file.
    fn next(&mut self, block: &mut Vec<u8>) -> Result<Range<u64>, InputError> {
        block.clear();
        block.append(&mut self.rest);
        let mut end = None;
        while !self.has_ended && end.is_none() {
            let before = block.len();
            let read = (&mut self.text).take(BLOCK as u64).read_to_end(block);
            let read = read.map_err(|error| InputError::unreadable(&self.file, &error))?;
            self.has_ended = read < BLOCK;
            end = memrchr(b'\n', block.get(before..).unwrap_or_default()).map(|at| before + at + 1);
        }
        if let (false, Some(end)) = (self.has_ended, end) {
            self.rest.extend_from_slice(block.get(end..).unwrap_or_default());
            block.truncate(end);
        }
        let begin = self.line;
        self.line += memchr_iter(b'\n', block).count() as u64;
        // The last line may have no end.
        Ok(begin..self.line + u64::from(block.last().is_some_and(|byte| *byte != b'\n')))
    }
}

/// The rows of a block, and the number of the block.
type Numbered = (usize, Result<RowBlock, InputError>);

/// The rows of all blocks of a text.
pub(super) struct RowBlocks {
    arriving: Receiver<Numbered>,
    /// Blocks that arrived before their predecessors.
    waiting: BTreeMap<usize, Result<RowBlock, InputError>>,
    next: usize,
}

impl RowBlocks {
    /// Starts to read a text. A text of one block is read without threads.
    pub fn start(mut blocks: TextBlocks, reader: &Arc<ColumnReader>) -> Self {
        let (sender, arriving) = sync_channel(MAX_THREADS);
        let mut text = vec![];
        let first = blocks.next(&mut text).map(|lines| reader.read(&text, lines));
        if !blocks.has_ended {
            let blocks = Arc::new(Mutex::new((blocks, 1)));
            for _ in 0..std::thread::available_parallelism().map_or(1, usize::from).min(MAX_THREADS) {
                let (blocks, reader, sender) = (Arc::clone(&blocks), Arc::clone(reader), sender.clone());
                std::thread::spawn(move || read_blocks(&blocks, &reader, &sender));
            }
        }
        Self { arriving, waiting: BTreeMap::from([(0, first)]), next: 0 }
    }

    /// Returns the rows of the next block; none at the end.
    pub fn next(&mut self) -> Option<Result<RowBlock, InputError>> {
        loop {
            if let Some(block) = self.waiting.remove(&self.next) {
                self.next += 1;
                return Some(block);
            }
            match self.arriving.recv() {
                Ok((number, block)) => self.waiting.insert(number, block),
                // The thread that read the next block was stopped.
                Err(_) if !self.waiting.is_empty() => {
                    return Some(Err(InputError::new("the log", "reading it was stopped")));
                }
                Err(_) => return None,
            };
        }
    }
}

/// Reads blocks until the text ends or the receiver is dropped. `blocks` has the number of the next block.
fn read_blocks(blocks: &Mutex<(TextBlocks, usize)>, reader: &ColumnReader, sender: &SyncSender<Numbered>) {
    let mut text = vec![];
    loop {
        let (number, lines) = {
            let Ok(mut held) = blocks.lock() else { return };
            let (blocks, next) = &mut *held;
            if blocks.has_ended {
                return;
            }
            let lines = blocks.next(&mut text);
            blocks.has_ended |= lines.is_err();
            *next += 1;
            (*next - 1, lines)
        };
        let block = lines.map(|lines| reader.read(&text, lines));
        if sender.send((number, block)).is_err() {
            return;
        }
    }
}
