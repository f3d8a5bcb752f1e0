//! The rows of a delimited text, many lines at a time on all cores: blocks of whole lines in, columns out, in the order of the lines.
//!
//! A cell that is a plain number is read where it stands. Whatever is unusual — quotes, dates, words for numbers, a line with too many
//! cells — goes the slow way of `Plan::check`, which says exactly what is wrong; so both ways read the same.

mod row_block;

use super::csv_dialect::Dialect;
use super::truncated;
use crate::read::stamps::{RowMerge, Stamps};
use crate::read::table::{Blocks, ColumnRequest, Rows, Table, check_rows, check_size, column_place, see};
use memchr::{memchr_iter, memrchr};
use row_block::{Fault, Plan, RowBlock, TruncatedRow};
use std::collections::BTreeMap;
use std::io::Read;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use teachtree_base::error::InputError;

/// How much text one core takes at a time, in bytes.
const BLOCK: usize = 1 << 20;
/// The most cores that read one file.
const MOST_CORES: usize = 8;

/// The lines of a text that are not read yet.
pub(super) struct Lines {
    text: Box<dyn Read + Send>,
    /// What was read behind the last whole line.
    rest: Vec<u8>,
    /// The line of the file with which `rest` begins.
    line: u64,
    ended: bool,
    file: String,
    dialect: Dialect,
}

impl Lines {
    /// The lines of this text, which begins with this line of the file.
    pub fn new(file: String, dialect: Dialect, text: Box<dyn Read + Send>, line: u64) -> Self {
        Self { text, rest: vec![], line, ended: false, file, dialect }
    }

    /// Puts the next whole lines into `block`, about [`BLOCK`] bytes, nothing at the end; the line of the file they begin with.
    fn block(&mut self, block: &mut Vec<u8>) -> Result<u64, InputError> {
        block.clear();
        block.append(&mut self.rest);
        let mut end = None;
        while !self.ended && end.is_none() {
            let before = block.len();
            let read = (&mut self.text).take(BLOCK as u64).read_to_end(block);
            let read = read.map_err(|error| InputError::unreadable(&self.file, &error))?;
            self.ended = read < BLOCK;
            end = memrchr(b'\n', block.get(before..).unwrap_or_default()).map(|at| before + at + 1);
        }
        if let (false, Some(end)) = (self.ended, end) {
            self.rest.extend_from_slice(block.get(end..).unwrap_or_default());
            block.truncate(end);
        }
        let line = self.line;
        self.line += memchr_iter(b'\n', block).count() as u64;
        Ok(line)
    }
}

impl Rows for Lines {
    fn read(
        self: Box<Self>,
        header: &[String],
        wants: &[ColumnRequest],
        rate_hz: Option<f64>,
    ) -> Result<Table, InputError> {
        let mut reading = LineBlocks { in_memory: true, ..LineBlocks::new(*self, header, wants, rate_hz) };
        let mut table = Table::empty(header.len());
        while reading.read_into(&mut table)? {}
        Ok(table)
    }

    fn comes_in_blocks(&self) -> bool {
        true
    }

    fn blocks(
        self: Box<Self>,
        header: &[String],
        wants: &[ColumnRequest],
        rate_hz: Option<f64>,
    ) -> Result<Option<Box<dyn Blocks>>, InputError> {
        Ok(Some(Box::new(LineBlocks::new(*self, header, wants, rate_hz))))
    }
}

/// A text that is being read: blocks come from the cores that read them, and are put in order here.
struct LineBlocks {
    plan: Arc<Plan>,
    parts: BlockQueue,
    stamps: Stamps,
    /// Rows so far, with those that are left out.
    rows: usize,
    /// The last row, if it is one that was being written when the recording stopped; whatever follows makes it an error.
    cut: Option<(TruncatedRow, InputError)>,
    ended: bool,
    /// Whether all rows have to fit in memory.
    in_memory: bool,
}

/// A block with its number.
type NumberedBlock = (usize, Result<RowBlock, InputError>);

/// The blocks of a text as they are read, in any order, and those that wait for one before them.
struct BlockQueue {
    arriving: Receiver<NumberedBlock>,
    waiting: BTreeMap<usize, Result<RowBlock, InputError>>,
    next: usize,
}

impl BlockQueue {
    /// Begins to read a text; a short one is read at once.
    fn begin(mut lines: Lines, plan: &Arc<Plan>) -> Self {
        let (sender, arriving) = sync_channel(MOST_CORES);
        let mut parts = Self { arriving, waiting: BTreeMap::new(), next: 0 };
        let mut text = vec![];
        let first = lines.block(&mut text).map(|line| plan.part(&text, line));
        parts.waiting.insert(0, first);
        if !lines.ended {
            let lines = Arc::new(Mutex::new((lines, 1)));
            for _ in 0..std::thread::available_parallelism().map_or(1, usize::from).min(MOST_CORES) {
                let (lines, plan, sender) = (Arc::clone(&lines), Arc::clone(plan), sender.clone());
                std::thread::spawn(move || work(&lines, &plan, &sender));
            }
        }
        parts
    }

    fn next(&mut self) -> Option<Result<RowBlock, InputError>> {
        loop {
            if let Some(part) = self.waiting.remove(&self.next) {
                self.next += 1;
                return Some(part);
            }
            match self.arriving.recv() {
                Ok((place, part)) => self.waiting.insert(place, part),
                // A part that never came: what reads it was stopped.
                Err(_) if !self.waiting.is_empty() => {
                    return Some(Err(InputError::new("the log", "reading it was stopped")));
                }
                Err(_) => return None,
            };
        }
    }
}

/// Reads one block after another until there is none, or nobody wants them any more.
fn work(lines: &Mutex<(Lines, usize)>, plan: &Plan, sender: &SyncSender<NumberedBlock>) {
    let mut text = vec![];
    loop {
        let (place, block) = {
            let Ok(mut held) = lines.lock() else { return };
            let (lines, next) = &mut *held;
            if lines.ended {
                return;
            }
            let block = lines.block(&mut text);
            lines.ended |= block.is_err();
            *next += 1;
            (*next - 1, block)
        };
        let part = block.map(|line| plan.part(&text, line));
        if sender.send((place, part)).is_err() {
            return;
        }
    }
}

impl LineBlocks {
    fn new(lines: Lines, header: &[String], wants: &[ColumnRequest], rate_hz: Option<f64>) -> Self {
        let (file, dialect) = (lines.file.clone(), lines.dialect);
        let plan = Arc::new(Plan { file, dialect, header: header.to_vec(), wants: wants.to_vec(), rate_hz });
        let parts = BlockQueue::begin(lines, &plan);
        Self { plan, parts, stamps: Stamps::default(), rows: 0, cut: None, ended: false, in_memory: false }
    }

    /// Puts the rows of the next block behind those of a table; whether there may be more.
    fn read_into(&mut self, table: &mut Table) -> Result<bool, InputError> {
        if self.ended {
            return Ok(false);
        }
        match self.parts.next() {
            Some(part) => self.take(part?, table)?,
            None => {
                self.ended = true;
                self.finish(table)?;
            }
        }
        Ok(!self.ended)
    }

    /// Takes the rows of a part, whose places in the file and in time follow those before.
    fn take(&mut self, part: RowBlock, table: &mut Table) -> Result<(), InputError> {
        let RowBlock { rows, offsets, line, stamps, mut numbers, mut texts, fault } = part;
        let Plan { file, header, wants, rate_hz, .. } = &*self.plan;
        if let Some((_, error)) = self.cut.take_if(|_| rows > 0 || fault.is_some()) {
            return Err(error);
        }
        let columns = wants.iter().filter(|want| **want != ColumnRequest::Nothing).count();
        let so_far = self.rows + rows + usize::from(fault.is_some());
        if self.in_memory {
            check_size(file, so_far, columns)?;
        } else {
            check_rows(file, so_far)?;
        }
        let timed = wants.iter().position(|want| matches!(want, ColumnRequest::Time(_)));
        let mut kept = Vec::with_capacity(rows);
        for row in 0..rows {
            let at = line + offsets.get(row).map_or(row as u64, |offset| u64::from(*offset));
            let stamp = match rate_hz {
                Some(rate) => (self.rows + row) as f64 / rate,
                None => stamps.get(row).copied().unwrap_or(f64::NAN),
            };
            let is_kept = self.stamps.push(stamp).map_err(|message| {
                let place = format!("{file} row {at}");
                InputError::new(
                    match timed {
                        Some(column) if rate_hz.is_none() => {
                            column_place(&place, header.get(column).map_or("", String::as_str))
                        }
                        _ => place,
                    },
                    message,
                )
            })?;
            if !is_kept
                && added(row, kept.iter().rposition(|kept| *kept), &mut numbers, &mut texts, table, wants).is_repeat()
            {
                self.stamps.repeats(at, stamp);
            }
            kept.push(is_kept);
        }
        self.rows += rows;
        if kept.contains(&false) {
            numbers.iter_mut().for_each(|column| retain(column, &kept));
            let said = texts.iter_mut().zip(wants).filter(|(_, want)| **want == ColumnRequest::Text);
            said.for_each(|(column, _)| retain(column, &kept));
        }
        for (whole, mut column) in table.numbers.iter_mut().zip(numbers) {
            whole.append(&mut column);
        }
        for ((whole, mut column), want) in table.texts.iter_mut().zip(texts).zip(wants) {
            match want {
                ColumnRequest::Sniff => column.iter().for_each(|text| see(whole, text)),
                _ => whole.append(&mut column),
            }
        }
        match fault {
            // Only the last row can be the one that was being written when the recording stopped.
            Some(Fault { cut: Some(cut), error, last: true }) => self.cut = Some((cut, *error)),
            Some(fault) => return Err(*fault.error),
            None => {}
        }
        self.rows += usize::from(self.cut.is_some());
        table.time.append(&mut self.stamps.time);
        table.row_time.append(&mut self.stamps.row_time);
        Ok(())
    }

    fn finish(&mut self, table: &mut Table) -> Result<(), InputError> {
        let file = &self.plan.file;
        if self.rows == 0 {
            return Err(InputError::new(file, "the file has a header and no rows"));
        }
        if let Some((TruncatedRow { line, cells }, _)) = self.cut.take() {
            let at = self.stamps.last().unwrap_or_default();
            let width = self.plan.header.len();
            let message = format!("row {line}, the last one, is cut short ({cells} of {width} fields); it is left out");
            table.issues.push(truncated(at, message));
        }
        if self.stamps.last().is_none() {
            return Err(InputError::new(file, "the file has no whole row"));
        }
        table.issues.extend(self.stamps.issue(file)?);
        Ok(())
    }
}

impl Blocks for LineBlocks {
    fn next(&mut self) -> Result<Option<Table>, InputError> {
        if self.ended {
            return Ok(None);
        }
        let mut table = Table::empty(self.plan.header.len());
        self.read_into(&mut table)?;
        Ok(Some(table))
    }
}

/// Merges a row into the row with the same stamp: row `before` of the same part, or the last row of the table so far.
fn added(
    row: usize,
    before: Option<usize>,
    numbers: &mut [Vec<f64>],
    texts: &mut [Vec<String>],
    table: &mut Table,
    wants: &[ColumnRequest],
) -> RowMerge {
    let mut addition = RowMerge::default();
    for (column, whole) in numbers.iter_mut().zip(&mut table.numbers) {
        let Some(value) = column.get(row).copied() else { continue };
        let slot = match before {
            Some(before) => column.get_mut(before),
            None => whole.last_mut(),
        };
        slot.into_iter().for_each(|slot| addition.number(slot, value));
    }
    // Columns that are only sniffed have no texts per row.
    let columns = texts.iter_mut().zip(&mut table.texts).zip(wants).filter(|(_, want)| **want == ColumnRequest::Text);
    for ((column, whole), _) in columns {
        let Some(value) = column.get(row).cloned() else { continue };
        let slot = match before {
            Some(before) => column.get_mut(before),
            None => whole.last_mut(),
        };
        slot.into_iter().for_each(|slot| addition.text(slot, &value));
    }
    addition
}

/// Keeps the values of the rows that are kept.
fn retain<T>(values: &mut Vec<T>, kept: &[bool]) {
    let mut kept = kept.iter();
    values.retain(|_| kept.next() != Some(&false));
}
