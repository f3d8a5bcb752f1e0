//! Qualisys motion capture as text: lines `KEY<tab>values`, then a row of markers a frame, in millimeters.
//!
//! A marker that was lost is written as zeros or as nothing at all; both become values that were not measured.
//! The columns are `time [s]`, `frame`, and `<marker> X [mm]`, `<marker> Y [mm]`, `<marker> Z [mm]`.

use crate::read::memory_table::{Cells, InMemoryTable};
use crate::read::table::{MAX_CELL, MAX_COLUMNS, Source, check_size, number, shown};
use std::io::{BufRead, Read};
use teachtree_base::error::InputError;

/// The most lines that may stand before the frames.
const MAX_HEADER_LINES: u64 = 100;
/// The longest line that is read, in bytes.
const MAX_LINE: u64 = 4 << 20;

/// The header lines before the frames.
#[derive(Default)]
struct Header {
    markers: Vec<String>,
    rate_hz: Option<f64>,
    frames: Option<usize>,
    /// The row of titles, where there is one.
    titles: Option<Vec<String>>,
}

/// Reads a recording.
///
/// # Errors
/// At the first line that is not as it should be.
pub fn source(bytes: impl Read, file: String) -> Result<Source, InputError> {
    let mut lines = Lines { bytes: std::io::BufReader::new(bytes), row: 0, file: file.clone() };
    let mut header = Header::default();
    let mut line = lines.next()?;
    // Keys are words; the frames begin with a number.
    while let Some(text) = &line {
        let cells: Vec<&str> = text.split('\t').map(str::trim).collect();
        let key = cells.first().copied().unwrap_or_default();
        if number(key).is_some_and(|value| !value.is_nan()) {
            break;
        }
        match key {
            "MARKER_NAMES" => {
                header.markers = cells.iter().skip(1).filter(|name| !name.is_empty()).map(ToString::to_string).collect()
            }
            "FREQUENCY" => header.rate_hz = cells.get(1).and_then(|cell| number(cell)).filter(|rate| *rate > 0.0),
            "NO_OF_FRAMES" => header.frames = cells.get(1).and_then(|cell| cell.parse().ok()),
            "Frame" | "Time" => header.titles = Some(cells.iter().map(ToString::to_string).collect()),
            _ => {}
        }
        if lines.row > MAX_HEADER_LINES {
            return Err(InputError::new(file, format!("found no frame in the first {MAX_HEADER_LINES} lines")));
        }
        line = lines.next()?;
    }
    let place = |row: u64| format!("{file} row {row}");
    if header.markers.is_empty() {
        return Err(InputError::new(&file, "the line MARKER_NAMES is missing, or names no marker"));
    }
    let leading: Vec<&str> = header
        .titles
        .iter()
        .flatten()
        .map(String::as_str)
        .take_while(|title| matches!(*title, "Frame" | "Time"))
        .collect();
    let width = leading.len() + 3 * header.markers.len();
    if width > MAX_COLUMNS {
        return Err(InputError::new(&file, format!("found {width} columns, at most {MAX_COLUMNS} are read")));
    }
    let mut columns: Vec<Vec<f64>> = vec![vec![]; width];
    let mut rows = 0_usize;
    let mut cut = None;
    while let Some(text) = line.take() {
        let row = lines.row;
        line = lines.next()?;
        if text.trim().is_empty() {
            continue;
        }
        rows += 1;
        check_size(&file, rows, width)?;
        let values = match values(&text, width) {
            Ok(values) => values,
            // Only the last row can be the one that was being written when the recording stopped.
            Err(message) if line.is_none() && rows > 1 => {
                cut = Some(format!("row {row}, the last one, is cut short ({message}); it is left out"));
                break;
            }
            Err(message) => return Err(InputError::new(place(row), message)),
        };
        for (column, value) in columns.iter_mut().zip(values) {
            column.push(value);
        }
    }
    for marker in columns.get_mut(leading.len()..).unwrap_or_default().chunks_mut(3) {
        forget_lost(marker);
    }
    let mut sheet = InMemoryTable::new(&file);
    let rows = columns.first().map_or(0, Vec::len);
    let stamps = leading.iter().position(|title| *title == "Time").and_then(|at| columns.get(at));
    let last_s = stamps.and_then(|stamps| stamps.last()).copied();
    let end_s = last_s.or(header.rate_hz.map(|rate| rows.saturating_sub(1) as f64 / rate)).unwrap_or_default();
    if !leading.contains(&"Time")
        && let Some(rate) = header.rate_hz
    {
        sheet.push_column("time [s]".into(), Cells::Numbers((0..rows).map(|row| row as f64 / rate).collect()));
    }
    let axes = header.markers.iter().flat_map(|marker| ["X", "Y", "Z"].map(|axis| format!("{marker} {axis} [mm]")));
    let titles =
        leading.iter().map(|title| if *title == "Time" { "time [s]".into() } else { "frame".into() }).chain(axes);
    for (title, values) in titles.zip(columns) {
        sheet.push_column(title, Cells::Numbers(values));
    }
    let mut source = Source::one(&file, sheet.header(), Box::new(sheet));
    let lacks = header
        .frames
        .filter(|frames| *frames > rows)
        .map(|frames| format!("the header declares {frames} frames, found {rows}: the file is incomplete"));
    let found: Vec<String> = [cut, lacks].into_iter().flatten().collect();
    if !found.is_empty() {
        source.issues.push(super::truncated(end_s, found.join("; ")));
    }
    Ok(source)
}

/// The numbers of a row; a delimiter too many at its end is not a column.
fn values(text: &str, width: usize) -> Result<Vec<f64>, String> {
    let mut cells: Vec<&str> = text.split('\t').collect();
    if cells.len() == width + 1 && cells.last().is_some_and(|cell| cell.trim().is_empty()) {
        cells.pop();
    }
    if cells.len() != width {
        return Err(format!("found {} fields, expected {width}", cells.len()));
    }
    cells.iter().map(|cell| number(cell).ok_or_else(|| format!("found `{}`, expected a number", shown(cell)))).collect()
}

/// Makes positions of a marker that was lost, all zero, unmeasured.
fn forget_lost(marker: &mut [Vec<f64>]) {
    let [x, y, z] = marker else { return };
    for ((x, y), z) in x.iter_mut().zip(y).zip(z) {
        if [*x, *y, *z].iter().all(|value| value.abs() < f64::MIN_POSITIVE) {
            (*x, *y, *z) = (f64::NAN, f64::NAN, f64::NAN);
        }
    }
}

/// Lines of bounded length.
struct Lines<R> {
    bytes: R,
    row: u64,
    file: String,
}

impl<R: BufRead> Lines<R> {
    fn next(&mut self) -> Result<Option<String>, InputError> {
        let place = format!("{} row {}", self.file, self.row + 1);
        let mut line = vec![];
        let read = self.bytes.by_ref().take(MAX_LINE).read_until(b'\n', &mut line);
        let read = read.map_err(|error| InputError::new(&place, format!("cannot be read: {error}")))?;
        if read == 0 {
            return Ok(None);
        }
        if read as u64 == MAX_LINE || line.split(|byte| *byte == b'\t').any(|cell| cell.len() > MAX_CELL) {
            return Err(InputError::new(place, "the line is longer than the maximum"));
        }
        self.row += 1;
        let text =
            String::from_utf8(line).map_err(|_| InputError::new(place, "found bytes that are not valid UTF-8"))?;
        Ok(Some(text.trim_end_matches(['\n', '\r']).to_string()))
    }
}
