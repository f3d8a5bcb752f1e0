//! What a gripper shows while a body moves with the tool: the end at which it is closed, and how far it is open on what it holds.

use super::bodies::Body;
use super::parts::{Part, distance};
use super::words;
use crate::inspect::ColumnReport;
use std::collections::BTreeSet;

/// The fewest rows in which a body moves with the tool that show at which end a gripper is closed.
const LEAST: usize = 5;
/// A value counts for this number of rows without one at most.
const MOST_HELD: usize = 100;
/// The ratio of the rows that show one end to those that show the other one.
const CLEARLY: usize = 3;
/// Values that differ by more than this share of the range are two levels, …
const LEVEL: f64 = 1.0 / 8.0;
/// … and those of one object differ by less than this share.
const SPREAD: f64 = 1.0 / 10.0;

/// The values of a gripper while it carries something.
pub struct Holds<'a> {
    column: &'a ColumnReport,
    /// The rows in which it carries something.
    rows: BTreeSet<usize>,
    /// A value for each body and row, in rising order.
    values: Vec<f64>,
}

/// The two ends of a gripper, and the value between them at which it counts as closed.
pub struct Levels {
    /// Closed on what it holds.
    pub closed: f64,
    /// Open.
    pub open: f64,
    /// The limit between them.
    pub limit: f64,
}

impl<'a> Holds<'a> {
    /// The rows in which a body moves with the tool, or moves at all where the tool is unknown.
    pub fn new(part: &Part, column: &'a ColumnReport, tool: Option<&Part>, bodies: &[Body]) -> Self {
        // Messages about other joints of the topic have no value of this one.
        let value = |row: &usize| column.samples.get(*row).copied().filter(|value| value.is_finite());
        let last = |row: usize| (row.saturating_sub(MOST_HELD)..=row).rev().find(|row| value(row).is_some());
        let rows: Vec<usize> = carrying_rows(part, tool, bodies).into_iter().filter_map(last).collect();
        let mut values: Vec<f64> = rows.iter().filter_map(value).collect();
        values.sort_by(f64::total_cmp);
        Self { column, rows: rows.into_iter().collect(), values }
    }

    fn range(&self) -> f64 {
        self.column.max - self.column.min
    }

    /// Whether the gripper is closed at the lower end. `None` if nothing shows that.
    ///
    /// A width is smaller where it is closed. Any other gripper is open before it holds something. It may be shut further where it missed the object, so that the
    /// end at which it holds may be either one.
    pub fn is_low_closed(&self, part: &Part, middle: f64) -> Option<bool> {
        let low = self.values.iter().filter(|value| **value < middle).count();
        let is_width = words::has(&part.words, &["opening", "width", "aperture", "gap"]);
        let by_name = (is_width && self.values.len() >= LEAST && self.loosest(true).is_some_and(|it| !self.is_end(it)))
            .then_some(true);
        by_name.or_else(|| self.opens_up()).or_else(|| clearly(low, self.values.len() - low))
    }

    /// Whether a value is at the upper end of the range, within the spread of a level.
    fn is_end(&self, value: f64) -> bool {
        value > self.column.max - SPREAD * self.range()
    }

    /// Whether the gripper closes on objects from higher values. Where the log begins with a hold, the end of the hold counts.
    fn opens_up(&self) -> Option<bool> {
        let samples = &self.column.samples;
        let least = LEVEL * self.range();
        let side = |row: usize, is_before: bool| {
            let held = samples.get(row)?;
            let is_other = |other: &&f64| (*other - held).abs() > least;
            let mut before = samples.iter().take(row).rev();
            let mut after = samples.iter().skip(row);
            let other = if is_before { before.find(is_other) } else { after.find(is_other) };
            other.map(|other| other > held)
        };
        let sides = |is_before: bool| {
            let found = self.rows.iter().filter_map(|row| side(*row, is_before));
            let (up, down): (Vec<bool>, Vec<bool>) = found.partition(|is_up| *is_up);
            clearly(up.len(), down.len())
        };
        sides(true).or_else(|| sides(false))
    }

    /// The value of the loosest hold, without the rows of the release.
    fn loosest(&self, is_low_closed: bool) -> Option<f64> {
        let count = self.values.len();
        self.values.get(if is_low_closed { count * 9 / 10 } else { count / 10 }).copied()
    }

    /// The levels of a gripper whose values fall into two groups. One that also shut on nothing has three levels: it is open at the end of its range.
    pub fn levels(&self, [low, high]: [f64; 2], is_low_closed: bool) -> Levels {
        // Distances count towards the open end.
        let sign = if is_low_closed { 1.0 } else { -1.0 };
        let [closed, open] = if is_low_closed { [low, high] } else { [high, low] };
        let end = if is_low_closed { self.column.max } else { self.column.min };
        let two = Levels { closed, open, limit: f64::midpoint(low, high) };
        let (Some(held), Some(loosest)) =
            (self.values.get(self.values.len() / 2).copied(), self.loosest(is_low_closed))
        else {
            return two;
        };
        let (spread, level) = (SPREAD * self.range(), LEVEL * self.range());
        let is_one = (loosest - held) * sign < spread;
        let is_third = (held - closed).abs() > level && is_one;
        if self.values.len() < LEAST || !is_third || (end - held) * sign <= spread {
            return two;
        }
        let is_open = (open - held) * sign > (end - held) * sign / 2.0;
        let open = if is_open { open } else { end };
        Levels { closed: held, open, limit: f64::midpoint(held, open) }
    }

    /// The limit beyond which a gripper without a known opening is closed: near the values at which it carries, since it grasps in the last part of its way.
    pub fn plateau_limit(&self, open: f64, is_low_closed: bool) -> Option<f64> {
        /// The share of the way that is left there.
        const LEFT: f64 = 0.1;
        let held = self.loosest(is_low_closed)?;
        Some(held + LEFT * (open - held))
    }
}

/// Whether the first of two counts is clearly larger; `None` if neither is.
fn clearly(one: usize, other: usize) -> Option<bool> {
    match () {
        () if one >= LEAST && one >= CLEARLY * other => Some(true),
        () if other >= LEAST && other >= CLEARLY * one => Some(false),
        () => None,
    }
}

/// The rows of a gripper in which a body moves with the tool, once for each body.
fn carrying_rows(part: &Part, tool: Option<&Part>, bodies: &[Body]) -> Vec<usize> {
    /// A step that is longer is a motion, m.
    const STEP_M: f64 = 1e-3;
    /// Positions from a noisy tracker are compared over this time, s; they differ if they are this multiple of the noise apart.
    const WINDOW_S: f64 = 0.25;
    const NOISES: f64 = 4.0;
    /// The noise of a tracker may move a body at rest this far, m.
    const AT_REST_M: f64 = 0.01;
    /// What moves with the tool moves relative to it by less than this share of its way. Relative to a tool at rest it moves by its whole way.
    const SLIPS: f64 = 0.5;
    if part.members.len() != 1 {
        return vec![];
    }
    let mut rows = vec![];
    let bodies = bodies.iter().filter_map(|body| body.positions.first());
    for body in bodies.filter(|body| body.extent() > AT_REST_M) {
        let least_m = STEP_M.min(body.extent() / 100.0).max(2e-4);
        let noise_m = body.members.iter().map(|column| column.noise.powi(2)).sum::<f64>().sqrt() * body.scale();
        // Steps of a tracker that scatters, or is slower than the log, show nothing.
        let is_noisy = NOISES * noise_m > least_m;
        let back = if is_noisy || is_repeated(body) { body.rows_in(WINDOW_S) } else { 1 };
        let least_m = if is_noisy { NOISES * noise_m } else { least_m };
        for row in back..body.rows() {
            let (Some(before), Some(now)) = (body.position(row - back), body.position(row)) else { continue };
            let moved = distance(before, now);
            if moved < least_m {
                continue;
            }
            let with_tool = tool.is_none_or(|tool| {
                let at = |row: usize| tool.position(body.row_in(row, tool));
                let (Some(from), Some(to)) = (at(row - back), at(row)) else { return false };
                let relative = distance(
                    [0, 1, 2].map(|axis| now[axis] - before[axis]),
                    [0, 1, 2].map(|axis| to[axis] - from[axis]),
                );
                relative < SLIPS * moved
            });
            rows.extend(with_tool.then(|| body.row_in(row - back / 2, part)));
        }
    }
    rows
}

/// Whether most positions of a moving body are repeated in the next row: a camera is slower than the log.
fn is_repeated(body: &Part) -> bool {
    let is_new = |row: &usize| body.position(*row) != body.position(row - 1);
    let changes: Vec<usize> = (1..body.rows()).filter(is_new).collect();
    let mut steps: Vec<usize> = changes.windows(2).filter_map(|pair| Some(pair.last()? - pair.first()?)).collect();
    steps.sort_unstable();
    steps.get(steps.len() / 2).is_some_and(|step| *step > 1)
}
