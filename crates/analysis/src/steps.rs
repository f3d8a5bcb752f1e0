//! Step signals: 0 until something in an analysis happens, 1 from then on. Programs that generate demonstrations divide them by such signals.
//!
//! ```text
//! start of Grasp of SquareNut0
//! end of Insert of SquareNut0 into peg1
//! last start of Grasp of cube by right
//! ```

use super::{Analysis, Subject, TrackId};
use std::fmt;
use std::ops::Range;
use teachtree_base::hands::Side;

/// An instant that a signal rises at.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Step {
    /// The primitive or task, with a side or without: `Grasp`, `MainGrasp(left)`.
    pub name: String,
    /// Its object and partner.
    pub subject: Subject,
    hand: Option<Side>,
    /// Whether it is the end, not the start.
    end: bool,
    /// Whether the last one counts, not the first.
    last: bool,
}

/// Why a signal does not rise.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SignalError {
    /// There is no such segment and no such task.
    NotFound(String),
    /// Whether the recording begins or ends within it, so that its start or end is unknown.
    CutOff(String),
}

impl fmt::Display for SignalError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFound(what) => write!(f, "no {what}"),
            Self::CutOff(what) => write!(f, "{what} is cut off"),
        }
    }
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let last = if self.last { "last " } else { "" };
        write!(f, "{last}{} of {}", if self.end { "end" } else { "start" }, self.what())
    }
}

/// Describes the form of a step, for messages.
const FORM: &str = "`start of Grasp of cube` or `end of Insert of peg into holder`";

impl Step {
    /// Reads `[first|last] start|end of NAME [of OBJECT] [into PARTNER] [by left|right]`; instead of `into` also `in`, `on`, `onto`, `at`, `to` and
    /// `relative to`.
    ///
    /// # Errors
    /// A text that does not have this form.
    pub fn read(text: &str) -> Result<Self, String> {
        let expected = |what: &str, found: Option<&str>| {
            let found = found.map_or("nothing".to_string(), |word| format!("`{word}`"));
            format!("expected {what}, found {found}, in `{text}`; a step looks like {FORM}")
        };
        let mut words = text.split_whitespace().peekable();
        let last = match words.peek() {
            Some(&"first") => words.next().is_none(),
            Some(&"last") => words.next().is_some(),
            _ => false,
        };
        let end = match words.next() {
            Some("start") => false,
            Some("end") => true,
            other => return Err(expected("`start` or `end`", other)),
        };
        match words.next() {
            Some("of") => {}
            other => return Err(expected("`of`", other)),
        }
        let name = words.next().ok_or_else(|| expected("a primitive or a task", None))?.to_string();
        let mut step = Self { name, subject: Subject::default(), hand: None, end, last };
        while let Some(word) = words.next() {
            let word = if word == "relative" { words.next().unwrap_or(word) } else { word };
            let what = match word {
                "of" if step.subject.object.is_none() => &mut step.subject.object,
                "into" | "in" | "on" | "onto" | "at" | "to" if step.subject.partner.is_none() => {
                    &mut step.subject.partner
                }
                "by" if step.hand.is_none() => {
                    let side = words.next();
                    step.hand =
                        Some(side.and_then(Side::from_name).ok_or_else(|| expected("`left` or `right`", side))?);
                    continue;
                }
                other => return Err(expected("`of`, `into` or `by`, each once", Some(other))),
            };
            *what = Some(words.next().ok_or_else(|| expected("a body", None))?.to_string());
        }
        Ok(step)
    }

    /// The row of the log on which the signal rises, counted from 0: the first that is in what starts, or after what ends.
    ///
    /// # Errors
    /// Why it does not rise.
    pub fn row(&self, analysis: &Analysis) -> Result<usize, SignalError> {
        let spans: Vec<Range<usize>> = self.spans(analysis).into_iter().map(|(.., rows)| rows).collect();
        if spans.is_empty() {
            return Err(SignalError::NotFound(self.what()));
        }
        let key = |rows: &Range<usize>| if self.end { rows.end } else { rows.start };
        // A signal that is 1 from the first row on does not rise, and one that would rise after the last row neither.
        let rows = spans.iter().map(key).filter(|row| (1..analysis.rows).contains(row));
        let row = if self.last { rows.max() } else { rows.min() };
        row.ok_or_else(|| SignalError::CutOff(self.what()))
    }

    /// The segments and tasks that it is about: who does it, what with, and the rows.
    pub fn spans<'a>(&self, analysis: &'a Analysis) -> Vec<(TrackId, &'a Subject, Range<usize>)> {
        let mut spans = Vec::new();
        for track in &analysis.tracks {
            let by = match track.who {
                TrackId::Hand(side) => Some(side),
                TrackId::Both => None,
            };
            // The coordinated action is in the tracks of the hands too, but may have its name only in the track of both.
            if self.hand.is_some() && by != self.hand {
                continue;
            }
            let segments = track.relabeled.iter().filter(|segment| self.is(&segment.primitive, &segment.subject));
            spans.extend(segments.map(|segment| (track.who, &segment.subject, segment.rows.clone())));
            let tasks = track.tasks.iter().filter(|task| self.is(&task.task, &task.subject));
            spans.extend(tasks.map(|task| (track.who, &task.subject, task.rows.clone())));
        }
        spans
    }

    fn is(&self, name: &str, subject: &Subject) -> bool {
        let fits = |wanted: &Option<String>, found: &Option<String>| wanted.is_none() || wanted == found;
        let base = name.split('(').next().unwrap_or(name);
        (name == self.name || base == self.name)
            && fits(&self.subject.object, &subject.object)
            && fits(&self.subject.partner, &subject.partner)
    }

    fn what(&self) -> String {
        let mut text = self.name.clone();
        self.subject.object.iter().for_each(|object| text += &format!(" of {object}"));
        self.subject.partner.iter().for_each(|partner| text += &format!(" into {partner}"));
        self.hand.iter().for_each(|hand| text += &format!(" by {hand}"));
        text
    }
}

/// The values of a signal that rises on a row: integers, as readers take differences of them.
pub fn values(row: usize, rows: usize) -> Vec<i64> {
    (0..rows).map(|at| i64::from(at >= row)).collect()
}
