//! The columns of tables in a folder: recordings have the same ones, parts of a recording have their own.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;
use teachtree_frames::bind::BindingFile;
use teachtree_logs::allowed_folders::AllowedFolders;
use teachtree_logs::read::formats;

/// The most tables of a folder whose columns are compared.
pub const MOST_COMPARED: usize = 64;
/// Tables with the same columns that are recordings although others in the folder have different ones.
const LEAST: usize = 3;

/// The columns of a file, if it can be read; of several recordings in it those of the first one.
pub fn header(file: &Path) -> Option<Vec<String>> {
    header_within(file, &AllowedFolders::default())
}

fn header_within(file: &Path, folders: &AllowedFolders) -> Option<Vec<String>> {
    let first = match formats::recording_of(file) {
        None => formats::all_of_within(file, folders).ok()?.and_then(|all| all.into_iter().next()),
        Some(_) => None,
    };
    formats::open_within(first.as_deref().unwrap_or(file), folders).ok().map(|source| source.header())
}

/// Files that stand for all, at most [`MOST_COMPARED`]: evenly spaced ones.
pub fn sampled(files: &[PathBuf]) -> impl Iterator<Item = &PathBuf> {
    files.iter().step_by(files.len().div_ceil(MOST_COMPARED).max(1))
}

/// Whether tables of text are recordings: all of them have the same columns, or most of at least three. Tables without titles are parts.
pub fn are_equal(tables: &[PathBuf], folders: &AllowedFolders) -> bool {
    let mut counts: BTreeMap<Vec<String>, usize> = BTreeMap::new();
    for header in sampled(tables).filter_map(|table| header_within(table, folders)) {
        let is_number = |title: &String| title.bytes().all(|byte| byte.is_ascii_digit());
        if header.iter().all(is_number) {
            return false;
        }
        *counts.entry(header).or_default() += 1;
    }
    let (all, most) = (counts.values().sum::<usize>(), counts.values().copied().max().unwrap_or_default());
    counts.len() == 1 || most >= LEAST && 2 * most > all
}

/// Whether a binding names a column of one of these tables as a part of a recording: `arm.x` of `arm.csv`. A table that has a column with this whole name is a
/// recording, such as `left.csv` with the column `left.tcp.position.x`.
///
/// # Errors
/// A binding that cannot be read.
pub fn are_parts(tables: &[PathBuf], binding: &Path, folders: &AllowedFolders) -> Result<bool, InputError> {
    let columns = BindingFile::read(binding)?.named_columns()?;
    let is_part = |table: &PathBuf| {
        let Some(prefix) = table.file_stem().map(|stem| format!("{}.", stem.to_string_lossy())) else { return false };
        let mut named = columns.iter().filter(|column| column.starts_with(&prefix)).peekable();
        if named.peek().is_none() {
            return false;
        }
        let titles = header_within(table, folders).unwrap_or_default();
        let without_unit = |title: &String| title.split(" [").next().unwrap_or_default().to_string();
        let titles: Vec<String> = titles.iter().map(without_unit).collect();
        !named.any(|column| titles.contains(column))
    };
    Ok(tables.iter().any(is_part))
}
