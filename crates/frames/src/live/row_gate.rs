//! Which rows become frames: an even sequence of measured rows, with the same bounds as of a log that was recorded ([`crate::clean`]).
//!
//! A row that does not come after the one before, or in which a value was not measured, is left out. Where one row is missing, or up to 20 ms, rows
//! are put back as soon as the next one comes; where more is missing, the stretch ends. It also ends where the clock was set back.

use crate::clean::dropouts::{self, BRIDGED_SECS, fill, moves};
use crate::clean::preprocess::channel_of;
use crate::clean::timebase::{EVEN_WITHIN, GAP_STEPS, ODD_SHARE};
use crate::clean::untracked_bodies::{self, is_origin, is_position};
use teachtree_base::short_number::ShortNumber;
use teachtree_base::units::Dimension;
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::names;
use teachtree_logs::read::stamp_order::{Order, StampOrder, set_back};

/// Why values of another unit, and of a lost body, were not measured.
const LARGE: &str = "; values beyond 1e6 in SI units are in another unit, or counts";
const LOST: &str = "; a position that is exactly 0 0 0 is that of a lost body";
/// Number of frames whose steps are compared with the step of the calibration.
const PACED_FRAMES: usize = 1000;

/// The columns of one channel.
#[derive(Clone, Debug)]
struct Channel {
    name: String,
    columns: Vec<usize>,
    /// Whether it changes evenly between samples.
    moves: bool,
    /// Whether it is a position that was last measured away from the origin: a tracker has lost a body that is exactly there in the next row.
    is_away: Option<bool>,
}

/// Turns rows into frames.
#[derive(Clone, Debug)]
pub struct RowGate {
    step_s: f64,
    /// How many missing rows are put back.
    longest: f64,
    channels: Vec<Channel>,
    /// The largest value of each column, and whether it is a flag.
    bounds: Vec<(f64, bool)>,
    /// The frame before.
    last: Option<(f64, Vec<f64>)>,
    /// The order of the stamps of all rows, including rows that were left out.
    order: StampOrder,
    /// The channel that lacked a value in a row that was left out, since the last frame.
    lacking: Option<usize>,
    /// Whether the previous row came too late.
    is_late: bool,
    pace: StepCounts,
    /// Since when steps are counted, s.
    paced_from_s: f64,
}

/// What becomes of a row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GateOutcome {
    /// What was wrong.
    pub issues: Vec<Issue>,
    /// Whether the stretch ends before this row.
    pub ends: bool,
    /// The frames that are put back before this row: stamp and values.
    pub bridged: Vec<(f64, Vec<f64>)>,
    /// Whether this row is a frame.
    pub is_frame: bool,
}

/// A measured row after the one before.
struct Step<'a> {
    before_s: f64,
    before: &'a [f64],
    time_s: f64,
    values: &'a [f64],
    /// The channel that lacked a value in between.
    lacking: Option<usize>,
}

/// How many steps were counted, and how many of them are not those of the calibration.
#[derive(Clone, Debug, Default)]
struct StepCounts {
    counted: usize,
    odd: usize,
    is_reported: bool,
}

impl RowGate {
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
                    let is_away = is_position(name).then_some(false);
                    channels.push(Channel { name: name.to_string(), columns: vec![at], moves, is_away });
                }
            }
        }
        Self {
            step_s,
            longest: (BRIDGED_SECS / step_s * (1.0 + 1e-6)).floor().max(1.0),
            channels,
            bounds: columns.iter().map(|(column, _)| dropouts::bound(column)).collect(),
            last: None,
            order: StampOrder::default(),
            lacking: None,
            is_late: false,
            pace: StepCounts::default(),
            paced_from_s: 0.0,
        }
    }

    /// The stretch has ended: the next row begins another one.
    pub fn restart(&mut self) {
        (self.last, self.lacking) = (None, None);
    }

    /// Takes a row: its stamp, s, and a value for each column, SI; NaN was not measured.
    pub fn take(&mut self, time_s: f64, values: &[f64]) -> GateOutcome {
        let mut admitted = GateOutcome::default();
        if !time_s.is_finite() || self.is_late(time_s, &mut admitted) {
            return admitted;
        }
        if let Some((column, why)) = self.unmeasured(values) {
            self.left_out(time_s, column, why, &mut admitted);
            return admitted;
        }
        admitted.is_frame = true;
        let lacking = self.lacking.take();
        if let Some((before_s, before)) = self.last.take() {
            self.step(Step { before_s, before: &before, time_s, values, lacking }, &mut admitted);
            // The memory of the row before is that of this one.
            let mut kept = before;
            kept.clear();
            kept.extend_from_slice(values);
            self.last = Some((time_s, kept));
        } else {
            self.last = Some((time_s, values.to_vec()));
        }
        admitted
    }

    /// Whether a row that is not later than the one before is left out. Where many of them follow each other in order, the clock was set back.
    fn is_late(&mut self, time_s: f64, admitted: &mut GateOutcome) -> bool {
        let last_s = self.order.newest_s();
        let order = self.order.push(time_s);
        let was_late = std::mem::replace(&mut self.is_late, matches!(order, Order::Equal | Order::Earlier));
        if order == Order::SetBack {
            let message = set_back(last_s, time_s, "everything restarts");
            admitted.issues.push(issue(IssueKind::GAP, time_s, last_s, "", message));
            admitted.ends = true;
            (self.last, self.lacking) = (None, None);
        }
        if self.is_late && !was_late {
            let message = format!(
                "a row of {} s came after the row of {} s; rows are left out until a later one comes",
                ShortNumber(time_s),
                ShortNumber(last_s)
            );
            admitted.issues.push(issue(IssueKind::DUPLICATE_STAMP, time_s, last_s, "", message));
        }
        self.is_late
    }

    /// Leaves a row out in which a column was not measured. The stretch ends as soon as the rows that are missing cannot be bridged.
    fn left_out(&mut self, time_s: f64, column: usize, why: &str, admitted: &mut GateOutcome) {
        self.lacking = Some(column);
        let Some((before_s, _)) = &self.last else { return };
        if ((time_s - before_s) / self.step_s).round() > self.longest {
            let message = format!(
                "no complete rows since {} s, longer than can be bridged{why}; everything restarts with the next one",
                ShortNumber(*before_s)
            );
            admitted.issues.push(issue(IssueKind::NOT_A_NUMBER, *before_s, time_s, self.channel(column), message));
            admitted.ends = true;
            (self.last, self.lacking) = (None, None);
        }
    }

    /// Bridges what is missing before a frame, or ends the stretch before it.
    fn step(&mut self, step: Step, admitted: &mut GateOutcome) {
        let Step { before_s, before, time_s, values, lacking } = step;
        let steps = (time_s - before_s) / self.step_s;
        if steps <= GAP_STEPS {
            self.pace(steps, time_s, admitted);
            return;
        }
        let whole = steps.round();
        let channel = lacking.map_or("", |column| self.channel(column));
        if whole - 1.0 <= self.longest && (steps - whole).abs() <= EVEN_WITHIN {
            // At most `longest`, which is a few.
            admitted.bridged = self.between((before_s, before), (time_s, values), whole as usize - 1);
            let rows = admitted.bridged.len();
            let rows = if rows == 1 { "1 row".to_string() } else { format!("{rows} rows") };
            let (kind, message) = if lacking.is_some() {
                (IssueKind::NOT_A_NUMBER, format!("{rows} in which a value was not measured: bridged"))
            } else {
                (IssueKind::MISSING_ROW, format!("{rows} missing by the stamps: bridged"))
            };
            admitted.issues.push(issue(kind, before_s, time_s, channel, message));
            return;
        }
        let (kind, what) =
            if lacking.is_some() { (IssueKind::NOT_A_NUMBER, "complete rows") } else { (IssueKind::GAP, "rows") };
        let message = format!("no {what} for {:.0} ms; everything restarts after the gap", (time_s - before_s) * 1e3);
        admitted.issues.push(issue(kind, before_s, time_s, channel, message));
        admitted.ends = true;
    }

    /// Counts the steps that are not those of the calibration.
    fn pace(&mut self, steps: f64, time_s: f64, admitted: &mut GateOutcome) {
        let StepCounts { counted, odd, is_reported } = &mut self.pace;
        if *counted == 0 {
            self.paced_from_s = time_s;
        }
        *counted += 1;
        *odd += usize::from((steps - 1.0).abs() > EVEN_WITHIN);
        let is_uneven = *odd as f64 > ODD_SHARE * PACED_FRAMES as f64;
        if is_uneven && !*is_reported {
            *is_reported = true;
            let message = format!(
                "{odd} of {counted} steps differ by more than {:.0} % from {:.3} ms, the step of the calibration; durations of rules are counted in frames",
                EVEN_WITHIN * 100.0,
                self.step_s * 1e3
            );
            admitted.issues.push(issue(IssueKind::UNEVEN_STEP, self.paced_from_s, time_s, "", message));
        }
        if *counted >= PACED_FRAMES {
            // Uneven steps are reported again after they were even.
            (*counted, *odd, *is_reported) = (0, 0, is_uneven);
        }
    }

    fn channel(&self, column: usize) -> &str {
        let own = self.channels.iter().find(|channel| channel.columns.contains(&column));
        own.map_or("", |channel| channel.name.as_str())
    }

    /// The first column with an impossible value, and the reason if it is known.
    fn unmeasured(&mut self, values: &[f64]) -> Option<(usize, &'static str)> {
        let possible = |(value, (largest, flag)): (&f64, &(f64, bool))| {
            value.abs() <= *largest && (!flag || *value == 0.0 || *value == 1.0)
        };
        if let Some(bad) = values.iter().zip(&self.bounds).position(|it| !possible(it)) {
            let is_large = values.get(bad).is_some_and(|value| value.is_finite() && value.abs() > dropouts::LARGEST);
            return Some((bad, if is_large { LARGE } else { "" }));
        }
        let mut found = None;
        for channel in &mut self.channels {
            let parts = || channel.columns.iter().filter_map(|at| values.get(*at).copied());
            let at = channel.columns.first().copied();
            if let Some(is_away) = &mut channel.is_away {
                let mut position = [0.0; 3];
                position.iter_mut().zip(parts()).for_each(|(slot, part)| *slot = part);
                if *is_away && is_origin(position) {
                    found = found.or(at.map(|at| (at, LOST)));
                } else {
                    *is_away = untracked_bodies::is_away(position);
                }
            }
            let is_turned = || parts().map(|value| value * value).sum::<f64>().sqrt() > dropouts::NO_ROTATION;
            if channel.columns.len() == 4 && !is_turned() {
                found = found.or(at.map(|at| (at, "")));
            }
        }
        found
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
