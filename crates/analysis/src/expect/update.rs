//! Expectation files written anew: what a person wrote stays, what is missing is added, what differs is replaced where that is asked for.

use super::{Expectation, Line, aligned, is_met};
use crate::TrackId;
use std::fmt::Write;

/// A track of a file: its heading and the lines below it.
struct Section {
    who: TrackId,
    heading: String,
    rows: Vec<Row>,
}

/// A line of a file.
enum Row {
    /// A segment or a task.
    Line { is_task: bool, start_s: f64, text: String },
    /// A comment, or nothing.
    Other(String),
}

impl Expectation {
    /// The text of the file with what was found. Segments and tasks are added whose middle no line of their track holds. With `replace`, lines that are not met are
    /// replaced by what was found; pinned lines stay in any case, as do comments.
    pub fn updated(&self, found: &[Line], replace: bool) -> String {
        let stays: Vec<bool> = self.lines.iter().map(|line| !replace || line.pinned).collect();
        let (stays, added) = self.merged(found, stays, replace);
        let (mut head, mut sections) = self.sections(&stays);
        for line in added {
            let at = sections.iter().position(|section| section.who == line.who).unwrap_or_else(|| {
                sections.push(Section { who: line.who, heading: format!("track {}", line.who), rows: Vec::new() });
                sections.len() - 1
            });
            if let Some(section) = sections.get_mut(at) {
                section.insert(line);
            }
        }
        head.truncate(head.trim_end().len());
        head.push('\n');
        for Section { heading, mut rows, .. } in sections {
            while rows.last().is_some_and(|row| matches!(row, Row::Other(text) if text.trim().is_empty())) {
                rows.pop();
            }
            // A track of which nothing was found is silent.
            if rows.is_empty() {
                continue;
            }
            let _ = writeln!(head, "\n{heading}");
            for Row::Line { text, .. } | Row::Other(text) in rows {
                let _ = writeln!(head, "{text}");
            }
        }
        head
    }

    /// Which lines stay, and which of those that were found are added.
    fn merged<'f>(&self, found: &'f [Line], mut stays: Vec<bool>, replace: bool) -> (Vec<bool>, Vec<&'f Line>) {
        let mut kinds: Vec<(TrackId, bool)> =
            found.iter().chain(&self.lines).map(|line| (line.who, line.is_task)).collect();
        kinds.sort_unstable();
        kinds.dedup();
        let mut added = Vec::new();
        for kind in kinds {
            let of = |line: &Line| (line.who, line.is_task) == kind;
            let own: Vec<usize> = (0..self.lines.len()).filter(|at| self.lines.get(*at).is_some_and(of)).collect();
            let expected: Vec<&Line> = own.iter().filter_map(|at| self.lines.get(*at)).collect();
            let got: Vec<&Line> = found.iter().filter(|line| of(line)).collect();
            let mut met = vec![false; got.len()];
            for pair in aligned(&expected, &got) {
                let (Some(at), Some(other)) = pair else { continue };
                let (Some(line), Some(one), Some(row)) = (expected.get(at), got.get(other), own.get(at)) else {
                    continue;
                };
                if is_met(line, one, self.tolerance_s)
                    && let (Some(stays), Some(met)) = (stays.get_mut(*row), met.get_mut(other))
                {
                    (*stays, *met) = (true, true);
                }
            }
            let hold = |line: &&&Line| if replace { line.pinned } else { true };
            let held: Vec<&&Line> = expected.iter().filter(hold).collect();
            let free = |one: &Line| {
                let middle = (one.start_s + one.end_s) / 2.0;
                !held.iter().any(|line| (line.start_s..line.end_s).contains(&middle))
            };
            let new = got.into_iter().zip(met).filter(|(one, met)| !met && free(one));
            added.extend(new.map(|(one, _)| one));
        }
        (stays, added)
    }

    /// The text up to the first track, and the tracks with the lines that stay.
    fn sections(&self, stays: &[bool]) -> (String, Vec<Section>) {
        let mut lines = self.lines.iter().zip(stays).peekable();
        let mut sections: Vec<Section> = Vec::new();
        for (text, at) in self.text.lines().zip(1..).skip(self.head.lines().count()) {
            if let Some(who) = super::track(text) {
                sections.push(Section { who, heading: text.trim_end().to_string(), rows: Vec::new() });
                continue;
            }
            let row = match lines.next_if(|(line, _)| line.line == at) {
                Some((_, false)) => continue,
                Some((line, true)) => {
                    Row::Line { is_task: line.is_task, start_s: line.start_s, text: text.trim_end().to_string() }
                }
                None => Row::Other(text.trim_end().to_string()),
            };
            if let Some(section) = sections.last_mut() {
                section.rows.push(row);
            }
        }
        (self.head.clone(), sections)
    }
}

impl Section {
    /// Puts a line where its time belongs, segments before tasks.
    fn insert(&mut self, line: &Line) {
        let name = if line.is_task { format!("task {}", line.name) } else { line.name.clone() };
        let text = format!("  {name:<26} {:.3} .. {:.3}", line.start_s, line.end_s);
        let row = Row::Line { is_task: line.is_task, start_s: line.start_s, text };
        let of = |row: &Row, earlier: bool| matches!(row, Row::Line { is_task, start_s, .. } if *is_task == line.is_task && (!earlier || *start_s <= line.start_s));
        let last = |of: &dyn Fn(&Row) -> bool| self.rows.iter().rposition(of).map(|at| at + 1);
        let at = last(&|row| of(row, true)).or_else(|| self.rows.iter().position(|row| of(row, false))).unwrap_or_else(
            || {
                if line.is_task { last(&|row| matches!(row, Row::Line { .. })).unwrap_or(0) } else { 0 }
            },
        );
        self.rows.insert(at, row);
    }
}
