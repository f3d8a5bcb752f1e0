//! The heading of a delimited text: lines about the recording, titles of columns, and their units, before the first row of numbers.

use super::dialect::Dialect;
use super::groups::GroupRows;
use crate::read::date_time::date_time;
use crate::read::memory_table::titled;
use crate::read::table::number;
use teachtree_base::units::compound_of_log;

/// Maximum number of lines in which the first row of numbers is searched.
const MAX_LINES: usize = 200;

/// The heading of a text.
pub(super) struct Heading {
    pub dialect: Dialect,
    /// Whether the first row names the columns.
    pub is_titled: bool,
    /// The titles in a comment above the first row.
    commented: Option<Vec<String>>,
    /// The units in a line below the titles.
    units: Option<Vec<String>>,
    /// The lines above the titles that name groups of columns.
    groups: GroupRows,
    /// Number of cells of the first row of numbers; 0 without one.
    width: usize,
}

impl Heading {
    /// Reads the heading at the beginning of a text. Lines that are neither titles nor rows are made empty, so that rows keep their line numbers.
    pub fn read(head: &mut Vec<u8>) -> Self {
        let Preamble { lines, units, groups, width } = Preamble::find(&String::from_utf8_lossy(head));
        let unit_line = units.as_ref().map(|(line, _)| *line);
        if lines > 0 || unit_line.is_some() {
            *head = emptied(head, |line| line < lines || Some(line) == unit_line);
        }
        let text = String::from_utf8_lossy(head);
        let comment = text.bytes().next().filter(|first| matches!(first, b'#' | b'%'));
        let is_comment = |line: &&str| comment.is_some_and(|sign| line.as_bytes().first() == Some(&sign));
        let above = text.lines().take_while(is_comment).last();
        let line = text.lines().find(|line| !line.trim().is_empty() && !is_comment(line)).unwrap_or_default();
        let dialect = Dialect::detect(line, comment);
        let commented = above.map(|line| {
            let cells = dialect.split(line.trim_start_matches(['#', '%']).trim());
            let titles = cells.into_iter().map(|title| title.trim().to_string()).collect();
            if dialect.blanks { with_units(titles) } else { titles }
        });
        let units = units.map(|(_, units)| units);
        Self { dialect, is_titled: !dialect.has_numbers(line), commented, units, groups, width }
    }

    /// Returns the titles of the columns, given the cells of the first row.
    pub fn titles(&self, first: Vec<String>) -> Vec<String> {
        if !self.is_titled {
            let commented = self.commented.clone().filter(|titles| titles.len() == first.len());
            return commented.unwrap_or_else(|| (1..=first.len()).map(|column| column.to_string()).collect());
        }
        let titles =
            if self.dialect.blanks { with_units(first) } else { self.groups.compose(titles_of(first, self.width)) };
        match self.units.as_ref().filter(|units| units.len() == titles.len()) {
            Some(units) => titles.iter().zip(units).map(|(title, unit)| titled(title, unit)).collect(),
            None => titles,
        }
    }
}

/// The lines of a heading other than titles.
#[derive(Default)]
struct Preamble {
    /// Number of lines about the recording, above the titles.
    lines: usize,
    /// The line below the titles with their units, and the units.
    units: Option<(usize, Vec<String>)>,
    groups: GroupRows,
    /// Number of cells of the first row of numbers; 0 without one.
    width: usize,
}

impl Preamble {
    /// Finds the lines above the first line of numbers. The first line is the titles if it has as many cells as the line of numbers.
    fn find(head: &str) -> Self {
        let lines: Vec<&str> = head.lines().take(MAX_LINES).collect();
        let cells = |at: usize| lines.get(at).map(|line| cells(line)).unwrap_or_default();
        // A row may begin with a text, such as a status, if rows of as many cells follow it.
        let follows = |at: usize, width: usize| (at + 1..at + 3).all(|next| is_row_of(&cells(next), width));
        // A line of numbers and words about the recording, such as its rate and its unit, has titles below it.
        let continues = |at: usize, width: usize| {
            let below = lines.iter().skip(at + 1).find(|line| !line.trim().is_empty());
            // A row of numbers that is too short or too long is a fault of the table.
            below.is_none_or(|line| {
                let row = self::cells(line);
                row.len() == width || is_row_of(&row, row.len())
            })
        };
        let is_data = |at: &usize| {
            let row = cells(*at);
            let begins = row.first().is_some_and(|cell| is_value(cell));
            let is_whole = row.iter().all(|cell| cell.is_empty() || is_value(cell));
            let is_first = begins && (is_whole || continues(*at, row.len()));
            is_row_of(&row, row.len()) && (is_first || follows(*at, row.len()))
        };
        let Some(data) = (0..lines.len()).find(is_data) else { return Self::default() };
        let width = cells(data).len();
        let is_text = |line: &&str| !line.trim().is_empty() && !line.starts_with(['#', '%']);
        let above: Vec<usize> = (0..data).filter(|at| lines.get(*at).is_some_and(is_text)).collect();
        let [first, ..] = *above else { return Self::default() };
        let units = above.last().filter(|_| above.len() > 1).and_then(|at| Some((*at, units(&cells(*at), width)?)));
        let title_lines = above.len() - usize::from(units.is_some());
        let titles = title_lines.checked_sub(1).and_then(|at| above.get(at)).copied().unwrap_or_default();
        let is_title_line = titles_of(cells(titles), width).len() == width;
        let groups = above.iter().rev().skip_while(|at| **at >= titles).filter(|_| is_title_line).map(|at| {
            let mut row = cells(*at);
            while row.len() > width && row.last().is_some_and(|cell| cell.is_empty()) {
                row.pop();
            }
            row
        });
        let groups = GroupRows::new(groups, width);
        let is_preamble =
            titles > 0 && is_title_line && (cells(first).len() != width || groups.distinguish(cells(titles)));
        Self { lines: if is_preamble { titles } else { 0 }, units, groups, width }
    }
}

/// The titles without one that no row has a cell for: an empty one behind a surplus delimiter, and the title of LabVIEW's comments.
fn titles_of<T: AsRef<str>>(mut titles: Vec<T>, width: usize) -> Vec<T> {
    if titles.len() == width + 1
        && titles.last().is_some_and(|last| matches!(last.as_ref(), "" | "Comment"))
        && width > 0
    {
        titles.pop();
    }
    titles
}

/// Whether a text has two rows of numbers, one below the other, near its beginning.
pub fn has_rows(head: &str) -> bool {
    let lines: Vec<&str> = head.lines().take(MAX_LINES).filter(|line| !line.trim().is_empty()).collect();
    lines.windows(2).any(|pair| {
        let widths: Vec<usize> =
            pair.iter().map(|line| cells(line)).filter(|row| is_row_of(row, row.len())).map(|row| row.len()).collect();
        matches!(*widths, [one, other] if one == other)
    })
}

/// The cells of a line, split by a dialect of its own.
fn cells(line: &str) -> Vec<&str> {
    let dialect = Dialect::detect(line, None);
    let cells = dialect.split(line).into_iter();
    if dialect.blanks { cells.collect() } else { cells.map(|cell| cell.trim().trim_matches('"').trim()).collect() }
}

/// Whether a cell is a number or a date; an empty one is neither.
fn is_value(cell: &str) -> bool {
    !cell.is_empty() && (number(&cell.replace(',', ".")).is_some() || date_time(cell).is_some())
}

/// Whether a line has this number of cells, more than one, and most of those that are not empty are numbers or dates.
fn is_row_of(cells: &[&str], width: usize) -> bool {
    let filled: Vec<&&str> = cells.iter().filter(|cell| !cell.is_empty()).collect();
    cells.len() == width && width > 1 && 2 * filled.iter().filter(|cell| is_value(cell)).count() > filled.len()
}

/// Returns the units in a line; none where a cell is neither a unit nor blank.
fn units(cells: &[&str], width: usize) -> Option<Vec<String>> {
    let plain = |cell: &str| cell.trim_matches(['[', ']', '(', ')']).to_string();
    let is_unit = |cell: &str| !cell.is_empty() && compound_of_log(&plain(cell)).is_ok();
    let is_blank = |cell: &str| cell.is_empty() || cell == "-";
    let are_units = cells.len() == width
        && cells.iter().any(|cell| is_unit(cell))
        && cells.iter().all(|cell| is_unit(cell) || is_blank(cell));
    are_units.then(|| cells.iter().map(|cell| if is_blank(cell) { String::new() } else { plain(cell) }).collect())
}

/// A text in which some lines are empty.
fn emptied(text: &[u8], is_left_out: impl Fn(usize) -> bool) -> Vec<u8> {
    let lines = text.split_inclusive(|byte| *byte == b'\n').enumerate();
    let kept = |(at, line)| if is_left_out(at) { line_end(line) } else { line };
    lines.flat_map(kept).copied().collect()
}

/// The end of a line: its line feed, and the carriage return before it. Delimiters at the end of a line would be cells.
fn line_end(line: &[u8]) -> &'static [u8] {
    match line {
        [.., b'\r', b'\n'] => b"\r\n",
        [.., b'\n'] => b"\n",
        _ => b"",
    }
}

/// Joins each unit with its title after both were split at blanks: `x`, `[mm]`.
fn with_units(cells: Vec<String>) -> Vec<String> {
    let mut titles: Vec<String> = vec![];
    for cell in cells {
        match titles.last_mut() {
            Some(title) if cell.starts_with('[') && cell.ends_with(']') => *title = format!("{title} {cell}"),
            _ => titles.push(cell),
        }
    }
    titles
}
