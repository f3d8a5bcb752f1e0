//! Columns of a file that is not formatted: where a change moves what stands behind it on its line, blanks before the next column take up the difference.

use super::guard_text::TextChanges;
use std::collections::BTreeMap;
use std::ops::Range;
use teachtree_language::evidence::evidence_in;

/// The changes of blanks that keep columns of a text despite other changes. A column is where blanks end on a line and on the one above or below, more than
/// one of them on either. A change that is longer than the blanks moves its line alone.
pub(super) fn kept_columns(file: &str, changes: &TextChanges) -> TextChanges {
    // The end of the last change of each line, and by how many characters the line grows.
    let mut of_lines: BTreeMap<usize, (usize, i64)> = BTreeMap::new();
    for (range, text) in changes {
        let Some(old) = file.get(range.clone()).filter(|old| !old.contains('\n')) else { continue };
        let start = file.get(..range.start).and_then(|head| head.rfind('\n')).map_or(0, |newline| newline + 1);
        let (end, growth) = of_lines.entry(start).or_default();
        *end = (*end).max(range.end);
        *growth += text.chars().count() as i64 - old.chars().count() as i64;
    }
    let blanks = |(start, (end, growth)): (usize, (usize, i64))| {
        let column = next_column(file, start, end)?;
        let width = usize::try_from(column.len() as i64 - growth).unwrap_or(0).max(1);
        (width != column.len()).then(|| (column, " ".repeat(width)))
    };
    of_lines.into_iter().filter_map(blanks).collect()
}

/// The blanks from a byte on that end at a column, of the line that begins at `start`.
fn next_column(file: &str, start: usize, from: usize) -> Option<Range<usize>> {
    let (before, after) = file.split_at_checked(start)?;
    let mut below = after.split('\n');
    let line = below.next()?;
    let around = [before.trim_end_matches('\n').rsplit('\n').next(), below.next()];
    let others: Vec<(usize, usize)> = around
        .into_iter()
        .flatten()
        .flat_map(|line| blanks(line).into_iter().map(|it| (end(line, &it), it.len())))
        .collect();
    let is_column = |it: &Range<usize>| {
        others.iter().any(|(column, width)| *column == end(line, it) && (*width > 1 || it.len() > 1))
    };
    // Evidence is written again with its blanks.
    let is_evidence = |it: &Range<usize>| evidence_in(line).is_some_and(|(at, _)| at == it.end);
    let found = blanks(line).into_iter().filter(|it| start + it.start >= from).find(is_column)?;
    (!is_evidence(&found)).then_some(start + found.start..start + found.end)
}

/// The column at which blanks of a line end, in characters.
fn end(line: &str, blanks: &Range<usize>) -> usize {
    line.get(..blanks.end).map_or(0, |head| head.chars().count())
}

/// The blanks within a line, up to its comment: bytes.
fn blanks(line: &str) -> Vec<Range<usize>> {
    let line = line.trim_end();
    let comment = line.find("//").unwrap_or(line.len());
    let mut found: Vec<Range<usize>> = Vec::new();
    for (at, _) in line.match_indices(' ').take_while(|(at, _)| *at < comment) {
        match found.last_mut() {
            Some(last) if last.end == at => last.end = at + 1,
            _ => found.push(at..at + 1),
        }
    }
    found.retain(|it| it.start > 0);
    found
}
