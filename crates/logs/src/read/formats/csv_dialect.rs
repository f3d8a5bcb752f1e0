//! What stands above the numbers of a delimited text: what delimits it, lines about the recording, titles, units.

use crate::read::table::{date_time, number};
use teachtree_base::units::compound;

/// How a text is delimited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Dialect {
    pub delimiter: u8,
    /// Blanks in a row are one delimiter.
    pub blanks: bool,
    /// What comment lines begin with.
    pub comment: Option<u8>,
    /// Whether the first row names the columns.
    pub titled: bool,
}

/// The form of a text, and the titles that a comment above it gives.
pub(super) fn dialect(head: &[u8]) -> (Dialect, Option<Vec<String>>) {
    let text = String::from_utf8_lossy(head);
    let text = text.trim_start_matches('\u{feff}');
    let comment = text.bytes().next().filter(|first| matches!(first, b'#' | b'%'));
    let commented = |line: &&str| comment.is_some_and(|sign| line.as_bytes().first() == Some(&sign));
    let above = text.lines().take_while(commented).last();
    let line = text.lines().find(|line| !line.trim().is_empty() && !commented(line)).unwrap_or_default();
    let (delimiter, blanks, titled) = delimiter_of(line);
    let dialect = Dialect { delimiter: if blanks { b'\t' } else { delimiter as u8 }, blanks, comment, titled };
    let titles = above.map(|line| {
        let line = line.trim_start_matches(['#', '%']).trim();
        let cells = |sign: char| line.split(sign).map(|title| title.trim().to_string()).collect::<Vec<_>>();
        if blanks { with_units(line.split_whitespace().map(str::to_string).collect()) } else { cells(delimiter) }
    });
    (dialect, titles)
}

/// What delimits a line, whether blanks do, and whether it names columns rather than giving numbers.
fn delimiter_of(line: &str) -> (char, bool, bool) {
    let numbers = |is_between: fn(char) -> bool, comma: &str| {
        let line = line.replace(',', comma);
        let mut cells = line.split(is_between).filter(|cell| !cell.trim().is_empty()).peekable();
        cells.peek().is_some() && cells.all(|cell| number(cell).is_some())
    };
    let blank: fn(char) -> bool = |c| c == ' ' || c == '\t';
    let count = |sign: char| unquoted(line).filter(|c| *c == sign).count();
    // Where numbers have a decimal comma there are more commas than delimiters.
    let decimal = [(';', (|c| c == ';') as fn(char) -> bool), ('\t', |c| c == '\t')]
        .into_iter()
        .find(|(sign, is_it)| count(*sign) > 0 && numbers(*is_it, "."));
    let most = [',', ';', '\t'].into_iter().rev().max_by_key(|sign| count(*sign)).unwrap_or(',');
    let delimiter = decimal.map_or(most, |(sign, _)| sign);
    let separated = count(delimiter) > 0;
    // Numbers that blanks set apart may have a tab too many; a title may have a blank in it.
    let blanks = if separated { delimiter == '\t' && numbers(blank, ".") } else { line.trim().contains(blank) };
    let titled = !match (blanks, delimiter) {
        (true, _) => numbers(blank, "."),
        (false, ';') => numbers(|c| c == ';', "."),
        (false, '\t') => numbers(|c| c == '\t', "."),
        (false, _) => numbers(|c| c == ',', ","),
    };
    (delimiter, blanks, titled)
}

/// The cells of a line as its delimiter sets them apart.
fn cells(line: &str) -> Vec<&str> {
    let (delimiter, blanks, _) = delimiter_of(line);
    if blanks {
        line.split_whitespace().collect()
    } else {
        line.split(delimiter).map(|cell| cell.trim().trim_matches('"').trim()).collect()
    }
}

/// What stands above the numbers of a text beside the titles.
#[derive(Default)]
pub(super) struct Preamble {
    /// Lines about the recording, before the titles.
    pub lines: usize,
    /// The line below the titles with their units, and these.
    pub units: Option<(usize, Vec<String>)>,
}

/// Finds the lines about a recording that stand before the titles, and the units below them: what the head of a text has before the first
/// line of numbers, when its first line has another number of cells than that.
pub(super) fn preamble(head: &[u8]) -> Preamble {
    const MOST: usize = 200;
    let text = String::from_utf8_lossy(head);
    let lines: Vec<&str> = text.lines().take(MOST).collect();
    let value = |cell: &&str| number(&cell.replace(',', ".")).is_some() || date_time(cell).is_some();
    let is_data = |line: &&str| {
        let cells = cells(line);
        cells.len() > 1
            && cells.first().is_some_and(|cell| !cell.is_empty() && value(cell))
            && 2 * cells.iter().filter(|cell| value(cell)).count() > cells.len()
    };
    let Some(data) = lines.iter().position(is_data) else { return Preamble::default() };
    let width = lines.get(data).map_or(0, |line| cells(line).len());
    let above: Vec<usize> = (0..data)
        .filter(|at| lines.get(*at).is_some_and(|line| !line.trim().is_empty() && !line.starts_with(['#', '%'])))
        .collect();
    let of = |at: Option<&usize>| at.and_then(|at| lines.get(*at)).map(|line| cells(line)).unwrap_or_default();
    let mut titles = above.len().checked_sub(1);
    let mut found = Preamble::default();
    let below = of(titles.and_then(|at| above.get(at)));
    let is_unit = |cell: &&str| !cell.is_empty() && compound(cell.trim_matches(['[', ']', '(', ')'])).is_ok();
    let blank = |cell: &&str| cell.is_empty() || *cell == "-";
    if above.len() > 1
        && below.len() == width
        && below.iter().any(is_unit)
        && below.iter().all(|cell| is_unit(cell) || blank(cell))
    {
        let units = below.iter().map(|cell| if blank(cell) { "" } else { cell.trim_matches(['[', ']', '(', ')']) });
        found.units = titles.and_then(|at| above.get(at)).map(|at| (*at, units.map(str::to_string).collect()));
        titles = titles.and_then(|at| at.checked_sub(1));
    }
    let first = of(above.first());
    let line = titles.and_then(|at| above.get(at)).copied().unwrap_or_default();
    // A first line that goes with the numbers is the titles, whatever stands between them.
    if line > 0 && first.len() != width && of(Some(&line)).len() == width {
        found.lines = line;
    }
    found
}

/// A text with some lines emptied: rows are counted as lines of the file.
pub(super) fn emptied(head: &[u8], is_left_out: impl Fn(usize) -> bool) -> Vec<u8> {
    let lines = head.split_inclusive(|byte| *byte == b'\n').enumerate();
    lines
        .flat_map(
            |(at, line)| if is_left_out(at) { line.strip_prefix(line.trim_ascii_end()).unwrap_or(b"\n") } else { line },
        )
        .copied()
        .collect()
}

/// The letters of a line that are not between quotes.
fn unquoted(line: &str) -> impl Iterator<Item = char> {
    let mut quoted = false;
    line.chars().filter(move |c| {
        quoted ^= *c == '"';
        !quoted
    })
}

/// Titles that were split at blanks, a unit being put back to its title: `x`, `[mm]`.
pub(super) fn with_units(cells: Vec<String>) -> Vec<String> {
    let mut titles: Vec<String> = vec![];
    for cell in cells {
        match titles.last_mut() {
            Some(title) if cell.starts_with('[') && cell.ends_with(']') => *title = format!("{title} {cell}"),
            _ => titles.push(cell),
        }
    }
    titles
}
