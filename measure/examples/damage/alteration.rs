//! Damage that devices, spreadsheets, scripts and disks do to recordings.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::ops::Range;
use teachtree_base::recording::Recording;

pub type Random = ChaCha8Rng;

/// The cells of a recording, as they are written.
#[derive(Clone)]
pub struct Table {
    pub titles: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

/// How cells are written.
pub enum FileForm {
    Delimited {
        delimiter: char,
        preamble: Vec<String>,
    },
    JsonLines,
    /// With the dimensions and the scene of the plain recording.
    Parquet(Box<Recording>),
    Mcap,
    Npy,
    Npz,
    Zarr,
    Bag,
    /// A file that is only damaged byte by byte.
    Bytes,
}

/// A damaged file.
pub struct DamagedFile {
    pub kind: &'static str,
    pub what: String,
    /// The rows that are damaged; `None` when all may be.
    pub rows: Option<Range<usize>>,
    pub bytes: Vec<u8>,
}

/// Whether the bytes of a file are damaged, and not its cells: rarely where cells are text.
pub fn aims_at_bytes(random: &mut Random, form: &FileForm) -> bool {
    random.random_bool(match form {
        FileForm::Bytes => 1.0,
        FileForm::Delimited { .. } | FileForm::JsonLines => 0.15,
        _ => 0.4,
    })
}

/// Scales a number as it is written; one that is none stays.
fn scaled(cell: &str, factor: f64) -> String {
    cell.parse::<f64>().map_or_else(|_| cell.into(), |value| (value * factor).to_string())
}

/// Turns the sign of a number.
fn turned(cell: &str) -> String {
    cell.strip_prefix('-').map_or_else(|| format!("-{cell}"), str::to_string)
}

/// Damages one cell, row or column.
pub fn cells(random: &mut Random, plain: &Table, bytes: impl Fn(&Table) -> Option<Vec<u8>>) -> Option<DamagedFile> {
    let mut table = plain.clone();
    let (kind, what, rows) = match random.random_range(0..10) {
        0..6 => cell(random, &mut table)?,
        6 | 7 => row(random, &mut table)?,
        _ => column(random, &mut table)?,
    };
    Some(DamagedFile { kind, what, rows, bytes: bytes(&table)? })
}

type Damage = (&'static str, String, Option<Range<usize>>);

fn cell(random: &mut Random, table: &mut Table) -> Option<Damage> {
    let (at, row) = (random.random_range(0..table.titles.len()), random.random_range(0..table.rows.len()));
    let other = random.random_range(0..table.rows.len());
    let beside = if at + 1 < table.titles.len() { at + 1 } else { at.checked_sub(1)? };
    let was = table.rows[row][at].clone();
    let digits: Vec<usize> = was.char_indices().filter(|(_, it)| it.is_ascii_digit()).map(|(at, _)| at).collect();
    let (kind, is) = match random.random_range(0..12) {
        0 => ("cell: decimal point lost", was.replacen('.', "", 1)),
        1 => ("cell: decimal point moved", scaled(&was, if random.random_bool(0.5) { 10.0 } else { 0.1 })),
        2 => ("cell: another unit", scaled(&was, [1000.0, 0.001, 100.0, 57.29577951308232][random.random_range(0..4)])),
        3 => ("cell: sign turned", turned(&was)),
        4 => ("cell: empty", String::new()),
        5 => ("cell: NaN", "NaN".into()),
        6 => ("cell: no number", ["#REF!", "1.2.3", "1,5", "--", "0x1F", "inf"][random.random_range(0..6)].into()),
        7 => ("cell: zero", "0".into()),
        8 | 9 => {
            let digit = *digits.get(random.random_range(0..digits.len().max(1)))?;
            let mut text = was.clone();
            text.replace_range(digit..=digit, &random.random_range(0..10).to_string());
            ("cell: a digit changed", text)
        }
        10 => ("cell: that of another row", table.rows[other][at].clone()),
        _ => ("cell: swapped with the next column", table.rows[row][beside].clone()),
    };
    if kind.ends_with("next column") {
        table.rows[row][beside].clone_from(&was);
    }
    let what = format!("{} row {row}: {was:?} became {is:?}", table.titles[at]);
    table.rows[row][at] = is;
    Some((kind, what, Some(row..row + 1)))
}

fn row(random: &mut Random, table: &mut Table) -> Option<Damage> {
    let row = random.random_range(0..table.rows.len().checked_sub(12)?);
    let kind = match random.random_range(0..8) {
        0 => {
            let copy = table.rows[row].clone();
            table.rows.insert(row, copy);
            "row: repeated"
        }
        1 => {
            table.rows.remove(row);
            "row: missing"
        }
        2 => {
            table.rows.drain(row..row + 10);
            "row: ten are missing"
        }
        3 => {
            table.rows.swap(row, row + 1);
            "row: swapped with the next"
        }
        4 => {
            let cells = table.rows[row].len();
            table.rows[row].truncate(random.random_range(1..cells));
            "row: cut"
        }
        5 => {
            table.rows[row].iter_mut().skip(1).for_each(|cell| *cell = "0".into());
            "row: zeros"
        }
        6 => {
            table.rows[row].get_mut(1..)?.rotate_right(1);
            "row: cells shifted"
        }
        _ => {
            let other = table.rows[random.random_range(0..table.rows.len())].clone();
            table.rows[row].iter_mut().zip(other).skip(1).for_each(|(cell, other)| *cell = other);
            "row: that of another time"
        }
    };
    Some((kind, format!("row {row}"), Some(row.saturating_sub(1)..row + 11)))
}

fn column(random: &mut Random, table: &mut Table) -> Option<Damage> {
    let at = random.random_range(0..table.titles.len());
    let from = random.random_range(0..table.rows.len());
    let title = table.titles[at].clone();
    let next = if at + 1 < table.titles.len() { at + 1 } else { at.checked_sub(1)? };
    let change =
        |table: &mut Table, how: &dyn Fn(&str) -> String| table.rows.iter_mut().for_each(|row| row[at] = how(&row[at]));
    let mut rows = None;
    let kind = match random.random_range(0..10) {
        0 => {
            let factor = [1000.0, 0.001, 100.0, 57.29577951308232][random.random_range(0..4)];
            change(table, &|cell| scaled(cell, factor));
            "column: another unit"
        }
        1 => {
            change(table, &turned);
            "column: sign turned"
        }
        2 => {
            table.rows.iter_mut().for_each(|row| row.swap(at, next));
            "column: swapped with the next"
        }
        3 => {
            let stays = table.rows[from][at].clone();
            table.rows.iter_mut().skip(from).for_each(|row| row[at].clone_from(&stays));
            rows = Some(from..table.rows.len());
            "column: stays from a row on"
        }
        4 => {
            change(table, &|_| "0".into());
            "column: zeros"
        }
        5 => {
            change(table, &|_| "NaN".into());
            "column: NaN"
        }
        6 => {
            let mut cells: Vec<String> = table.rows.iter().map(|row| row[at].clone()).collect();
            let by = random.random_range(1..20.min(cells.len()));
            cells.rotate_right(by);
            table.rows.iter_mut().zip(cells).for_each(|(row, cell)| row[at] = cell);
            "column: late by some rows"
        }
        7 => {
            table.titles.remove(at);
            table.rows.iter_mut().for_each(|row| _ = row.remove(at));
            "column: missing"
        }
        8 => {
            table.titles[at] = format!("{title}_1");
            "column: renamed"
        }
        _ => {
            let offset = [0.01, 0.1, 1.0][random.random_range(0..3)] * if random.random_bool(0.5) { 1.0 } else { -1.0 };
            change(table, &|cell| {
                cell.parse::<f64>().map_or_else(|_| cell.into(), |value| (value + offset).to_string())
            });
            "column: an offset"
        }
    };
    Some((kind, format!("{title} from row {from}"), rows))
}

/// Damages the bytes of a file.
pub fn bytes(random: &mut Random, plain: &[u8], form: &FileForm) -> Option<DamagedFile> {
    const BLOCK: usize = 512;
    let mut bytes = plain.to_vec();
    let at = random.random_range(0..bytes.len().checked_sub(2 * BLOCK)?);
    // In a text the row is known.
    let row = match form {
        FileForm::Delimited { .. } | FileForm::JsonLines => {
            Some(plain[..at].iter().filter(|byte| **byte == b'\n').count())
        }
        _ => None,
    };
    let mut rows = row.map(|row| row.saturating_sub(2)..row + 1);
    let kind = match random.random_range(0..8) {
        0..3 => {
            bytes[at] ^= 1 << random.random_range(0..8);
            "file: a bit"
        }
        3 => {
            bytes[at] = random.random_range(0..=255);
            "file: a byte"
        }
        4 => {
            bytes.truncate(at);
            rows = row.map(|row| row.saturating_sub(2)..usize::MAX >> 16);
            "file: cut"
        }
        5 => {
            bytes[at..at + BLOCK].fill(0);
            rows = row.map(|row| row.saturating_sub(2)..row + BLOCK);
            "file: a block of zeros"
        }
        6 => {
            bytes.drain(at..at + BLOCK);
            rows = row.map(|row| row.saturating_sub(2)..row + BLOCK);
            "file: a block is missing"
        }
        _ => {
            let block = bytes[at..at + BLOCK].to_vec();
            bytes.splice(at..at, block);
            rows = row.map(|row| row.saturating_sub(2)..row + BLOCK);
            "file: a block is repeated"
        }
    };
    Some(DamagedFile { kind, what: format!("byte {at}"), rows, bytes })
}
