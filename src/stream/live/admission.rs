//! Which rows become frames: an even sequence of measured rows, with the same bounds as of a log that was recorded ([`crate::stream::clean`]).
//!
//! A row that does not come after the one before, or in which a value was not measured, is left out. Where one row is missing, or up to 20 ms, rows
//! are put back as soon as the next one comes; where more is missing, the stretch ends.

use crate::base::units::Dimension;
use crate::stream::clean::dropouts::{self, BRIDGED_SECS, fill, moves};
use crate::stream::clean::preprocess::channel_of;
use crate::stream::clean::timebase::{EVEN_WITHIN, GAP_STEPS};
use crate::stream::issue::{Issue, IssueKind};
use crate::stream::names;

/// The columns of one channel.
#[derive(Clone, Debug)]
struct Channel {
    name: String,
    columns: Vec<usize>,
    /// Whether it changes evenly between samples.
    moves: bool,
}

/// Turns rows into frames.
#[derive(Clone, Debug)]
pub struct Admission {
    step_s: f64,
    /// How many missing rows are put back.
    longest: f64,
    channels: Vec<Channel>,
    /// The largest value of each column, and whether it is a flag.
    bounds: Vec<(f64, bool)>,
    /// The frame before.
    last: Option<(f64, Vec<f64>)>,
    /// Stamp of the row before, also of one that was left out.
    last_stamp: f64,
    /// The channel that lacked a value in a row that was left out, since the last frame.
    lacking: Option<usize>,
}

/// What becomes of a row.
#[derive(Clone, Debug, PartialEq)]
pub enum Admitted {
    /// It is a frame, after frames that were put back.
    Frames {
        /// The frames: stamp and values.
        frames: Vec<(f64, Vec<f64>)>,
        /// Whether a stretch begins with them, and the one before ends.
        restarts: bool,
        /// What was wrong.
        issue: Option<Issue>,
    },
    /// It is left out.
    Dropped(Option<Issue>),
}

impl Admission {
    /// Rows with these columns, at a rate, frames per second.
    pub fn new(columns: &[(String, Dimension)], rate_hz: f64) -> Self {
        let step_s = 1.0 / rate_hz;
        let mut channels: Vec<Channel> = Vec::new();
        for (at, (column, _)) in columns.iter().enumerate() {
            let name = channel_of(column);
            match channels.iter_mut().find(|channel| channel.name == name) {
                Some(channel) => channel.columns.push(at),
                None => {
                    let moves = names::meaning(column).is_some_and(|it| moves(it.dimension, it.shape));
                    channels.push(Channel { name: name.to_string(), columns: vec![at], moves });
                }
            }
        }
        Self {
            step_s,
            longest: (BRIDGED_SECS / step_s * (1.0 + 1e-6)).floor().max(1.0),
            channels,
            bounds: columns.iter().map(|(column, _)| dropouts::bound(column)).collect(),
            last: None,
            last_stamp: f64::NEG_INFINITY,
            lacking: None,
        }
    }

    /// Takes a row: its stamp, s, and a value for each column, SI; NaN was not measured.
    pub fn take(&mut self, time_s: f64, values: Vec<f64>) -> Admitted {
        if !time_s.is_finite() {
            return Admitted::Dropped(None);
        }
        if time_s <= self.last_stamp {
            let message = format!("a row of {time_s} s came after the row of {} s; it is left out", self.last_stamp);
            return Admitted::Dropped(Some(issue(IssueKind::DUPLICATE_STAMP, time_s, self.last_stamp, "", message)));
        }
        self.last_stamp = time_s;
        if let Some(column) = self.unmeasured(&values) {
            self.lacking = Some(column);
            return Admitted::Dropped(None);
        }
        let lacking = self.lacking.take();
        let Some((before_s, before)) = self.last.replace((time_s, values.clone())) else {
            return Admitted::Frames { frames: vec![(time_s, values)], restarts: false, issue: None };
        };
        let steps = (time_s - before_s) / self.step_s;
        if steps <= GAP_STEPS {
            return Admitted::Frames { frames: vec![(time_s, values)], restarts: false, issue: None };
        }
        let whole = steps.round();
        let channel = lacking.map_or("", |column| self.channel(column));
        if whole - 1.0 <= self.longest && (steps - whole).abs() <= EVEN_WITHIN {
            // At most `longest`, which is a few.
            let mut frames = self.between((before_s, &before), (time_s, &values), whole as usize - 1);
            let rows = frames.len();
            frames.push((time_s, values));
            let rows = if rows == 1 { "1 row".to_string() } else { format!("{rows} rows") };
            let (kind, message) = if lacking.is_some() {
                (IssueKind::NOT_A_NUMBER, format!("{rows} in which a value was not measured: bridged"))
            } else {
                (IssueKind::MISSING_ROW, format!("{rows} missing by the stamps: bridged"))
            };
            let issue = issue(kind, before_s, time_s, channel, message);
            return Admitted::Frames { frames, restarts: false, issue: Some(issue) };
        }
        let (kind, what) =
            if lacking.is_some() { (IssueKind::NOT_A_NUMBER, "complete rows") } else { (IssueKind::GAP, "rows") };
        let message = format!("no {what} for {:.0} ms; everything restarts after the gap", (time_s - before_s) * 1e3);
        let issue = issue(kind, before_s, time_s, channel, message);
        Admitted::Frames { frames: vec![(time_s, values)], restarts: true, issue: Some(issue) }
    }

    fn channel(&self, column: usize) -> &str {
        let own = self.channels.iter().find(|channel| channel.columns.contains(&column));
        own.map_or("", |channel| channel.name.as_str())
    }

    /// The first column with a value that cannot have been measured.
    fn unmeasured(&self, values: &[f64]) -> Option<usize> {
        let possible = |(value, (largest, flag)): (&f64, &(f64, bool))| {
            value.abs() <= *largest && (!flag || *value == 0.0 || *value == 1.0)
        };
        let bad = values.iter().zip(&self.bounds).position(|it| !possible(it));
        bad.or_else(|| {
            let rotations = self.channels.iter().filter(|channel| channel.columns.len() == 4);
            let is_one = |channel: &&Channel| {
                let squares = channel.columns.iter().filter_map(|at| values.get(*at)).map(|value| value * value);
                squares.sum::<f64>().sqrt() > dropouts::NO_ROTATION
            };
            rotations.into_iter().find(|channel| !is_one(channel)).and_then(|channel| channel.columns.first().copied())
        })
    }

    /// Frames between two: poses and velocities on a straight line, forces and flags held.
    fn between(&self, (from_s, from): (f64, &[f64]), (to_s, to): (f64, &[f64]), rows: usize) -> Vec<(f64, Vec<f64>)> {
        let steps = (rows + 1) as f64;
        let stamps: Vec<f64> = (0..=rows + 1).map(|step| from_s + (to_s - from_s) * step as f64 / steps).collect();
        let mut frames: Vec<(f64, Vec<f64>)> =
            stamps.iter().skip(1).take(rows).map(|stamp| (*stamp, from.to_vec())).collect();
        for channel in &self.channels {
            let value = |row: &[f64], at: usize| row.get(at).copied().unwrap_or_default();
            let mut parts: Vec<Vec<f64>> = channel
                .columns
                .iter()
                .map(|at| {
                    let mut part = vec![value(from, *at); rows + 1];
                    part.push(value(to, *at));
                    part
                })
                .collect();
            fill(&stamps, &mut parts, &(1..rows + 1), channel.moves);
            for (at, part) in channel.columns.iter().zip(parts) {
                for ((_, frame), value) in frames.iter_mut().zip(part.into_iter().skip(1)) {
                    if let Some(place) = frame.get_mut(*at) {
                        *place = value;
                    }
                }
            }
        }
        frames
    }
}

fn issue(kind: IssueKind, start_s: f64, end_s: f64, channel: &str, message: String) -> Issue {
    Issue { kind, start_s: start_s.min(end_s), end_s: end_s.max(start_s), channel: channel.into(), message }
}
