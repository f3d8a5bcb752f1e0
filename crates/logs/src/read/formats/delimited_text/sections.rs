//! Sections of a text, as Vicon Nexus exports them: `Devices` and `Trajectories` in one file, each with a rate, titles and rows of its own.
//!
//! A section begins with a line that has its name only, followed by a line that has its rate only, and by titles. It is the first line, or an empty one is
//! before it. The rate gives the stamps of the rows.

use super::rated::stamped;
use super::{BYTE_ORDER_MARK, source_from};
use crate::read::table::Source;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::ops::Range;
use teachtree_base::error::InputError;

/// A longer line names no section, in bytes.
const MAX_LINE: u64 = 64 * 1024;
/// The most sections that a file may have.
const MAX_SECTIONS: usize = 1000;

/// A section of a file.
pub struct Section {
    /// The name in its first line.
    pub name: String,
    /// The positions of its titles and rows.
    bytes: Range<u64>,
    /// Number of lines before them.
    lines: u64,
    /// The rate in its second line, Hz.
    rate_hz: f64,
}

/// Returns the sections of a file; none if its first lines do not begin one.
///
/// # Errors
/// The file cannot be read.
pub fn find(bytes: impl Read, file: &str) -> Result<Vec<Section>, InputError> {
    let mut bytes = BufReader::new(bytes);
    let mut sections: Vec<Section> = vec![];
    // The last lines, the newest last: what each has, where it begins, and its number.
    let mut last: Vec<(LineKind, u64, u64)> = vec![];
    let (mut at, mut lines) = (0, 0);
    let mut line = vec![];
    loop {
        line.clear();
        let read = (&mut bytes).take(MAX_LINE).read_until(b'\n', &mut line);
        if read.map_err(|error| InputError::unreadable(file, &error))? == 0 {
            break;
        }
        let kind = LineKind::of(line.strip_prefix(BYTE_ORDER_MARK).filter(|_| at == 0).unwrap_or(&line));
        let begins = match last.as_slice() {
            [before @ .., (LineKind::Name(name), begin, _), (LineKind::Number(rate_hz), ..)]
                if !matches!(kind, LineKind::Number(_)) =>
            {
                let is_apart = before.last().is_none_or(|(kind, ..)| *kind == LineKind::Empty);
                is_apart.then(|| (name.clone(), *begin, *rate_hz))
            }
            _ => None,
        };
        if let Some((name, begin, rate_hz)) = begins.filter(|_| sections.len() < MAX_SECTIONS) {
            if let Some(last) = sections.last_mut() {
                last.bytes.end = begin;
            }
            // Its rows begin after the line with the rate.
            sections.push(Section { name, bytes: at..u64::MAX, lines, rate_hz });
        }
        if lines == 2 && sections.is_empty() {
            break;
        }
        last.push((kind, at, lines));
        if last.len() > 3 {
            last.remove(0);
        }
        at += line.len() as u64;
        lines += u64::from(line.ends_with(b"\n"));
    }
    Ok(sections)
}

/// The content of a line.
#[derive(PartialEq)]
enum LineKind {
    Empty,
    /// Only one cell, a text.
    Name(String),
    /// Only one cell, a number.
    Number(f64),
    Cells,
}

impl LineKind {
    fn of(line: &[u8]) -> Self {
        match only_cell(line) {
            None => Self::Cells,
            Some(cell) if cell.is_empty() => Self::Empty,
            Some(cell) => cell.parse().map_or(Self::Name(cell), Self::Number),
        }
    }
}

/// The only cell of a line that is filled; empty for an empty line, `None` for several.
fn only_cell(line: &[u8]) -> Option<String> {
    let line = std::str::from_utf8(line).ok()?;
    let mut cells = line.split([',', ';', '\t']).map(|cell| cell.trim().trim_matches('"').trim());
    let first = cells.next()?.to_string();
    cells.all(str::is_empty).then_some(first)
}

/// Opens one section of a file.
///
/// # Errors
/// The named section does not exist, or the text has several sections and the name is missing.
pub fn open(mut file: File, place: String, sections: &[Section], chosen: Option<&str>) -> Result<Source, InputError> {
    let names: Vec<String> = sections.iter().map(|section| format!("`{}`", section.name)).collect();
    let found = match (chosen, sections) {
        (None, [only]) => Some(only),
        (None, _) => None,
        (Some(name), _) => sections.iter().find(|section| section.name.eq_ignore_ascii_case(name)),
    };
    let Some(section) = found else {
        let example = sections.last().map_or("", |section| section.name.as_str());
        let lacks = chosen.map_or(String::new(), |name| format!("; none is `{name}`"));
        let message = format!("the file has the sections {}{lacks}", names.join(", "));
        return Err(InputError::new(&place, message).help(format!("name one of them: `{place}#{example}`")));
    };
    let failed = |error: std::io::Error| InputError::unreadable(&place, &error);
    file.seek(SeekFrom::Start(section.bytes.start)).map_err(failed)?;
    let text = BufReader::new(file).take(section.bytes.end - section.bytes.start);
    let place = if sections.len() > 1 { format!("{place}#{}", section.name) } else { place };
    let source = source_from(Box::new(text), place, section.lines)?;
    let sheets = source.sheets.into_iter().map(|sheet| stamped(sheet, section.rate_hz)).collect();
    Ok(Source { sheets, ..source })
}
