//! Insertions: a carried body touches something and then moves straight on until it rests. On a table it would stop at the touch.

use nalgebra::{UnitQuaternion, Vector3};

/// What stays within this rests, m, …
const REST_M: f64 = 0.0015;
/// … for this long, s.
const REST_S: f64 = 0.3;
/// What is this far from where it began has been carried off, m.
const CARRIED_M: f64 = 0.02;
/// The way before a contact that shows the direction of the approach, m.
const APPROACH_M: f64 = 0.03;
/// A contact that returns within this time has continued, s.
const CONTACT_S: f64 = 0.3;
/// An insertion begins this long after a contact at most, s: the edge of a hole is lost where the body enters.
const ENTRY_S: f64 = 0.15;
/// The least way of an insertion, m.
const LEAST_M: f64 = 0.008;
/// How far a body may be beside its way, m, and as a share of it: a nut is loose on its peg.
const BESIDE: (f64, f64) = (0.003, 0.12);
/// How far it may go back, m, and as a share of its way: what falls bounces.
const BACK: (f64, f64) = (0.003, 0.1);
/// The cosine of the largest angle from the vertical of a way down.
const DOWN: f64 = 0.94;
/// That from the direction of the approach.
const ALONG: f64 = 0.87;
/// The share of another way than down that is in contact: a body also slides along a surface that it has touched.
const IN_CONTACT: f64 = 0.5;
/// Half of the length of a long body, m; its center sinks by this times the sine of its tilt.
const HALF_LENGTH_M: f64 = 0.15;
/// A body searches on the rim for this long, s, …
const SEARCH_S: f64 = 3.0;
/// … so far beside the axis, m, …
const BESIDE_RIM_M: f64 = 0.015;
/// … and so far above the place where it goes straight on, m.
const ABOVE_M: f64 = 0.02;
/// The most rows that are searched.
const MAX_ROWS: usize = 20_000;

/// Where a body is, and whether it touches what stands still.
#[derive(Clone, Debug, Default)]
pub struct Path {
    /// Stamps, s.
    pub time: Vec<f64>,
    /// Positions, m, z up.
    pub at: Vec<Vector3<f64>>,
    /// How it is turned.
    pub turns: Vec<UnitQuaternion<f64>>,
    /// Whether it touches something that no hand holds.
    pub is_touching: Vec<bool>,
}

/// A way into a socket.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Insertion {
    /// Where the body enters, m.
    pub rim: Vector3<f64>,
    /// The direction out of the socket, unit.
    pub axis: Vector3<f64>,
    /// How far it goes in, m.
    pub depth: f64,
    /// The largest distance from the axis on the way, m.
    pub beside: f64,
}

impl Path {
    /// At most [`MAX_ROWS`] rows of it, evenly spaced; a contact in a row that is left out counts in the row before.
    fn thinned(self) -> Self {
        let step = self.time.len().div_ceil(MAX_ROWS).max(1);
        Self {
            time: self.time.into_iter().step_by(step).collect(),
            at: self.at.into_iter().step_by(step).collect(),
            turns: self.turns.into_iter().step_by(step).collect(),
            is_touching: self.is_touching.chunks(step).map(|rows| rows.contains(&true)).collect(),
        }
    }

    fn reversed(&self) -> Self {
        let last = self.time.last().copied().unwrap_or_default();
        Self {
            time: self.time.iter().rev().map(|time| last - time).collect(),
            at: self.at.iter().rev().copied().collect(),
            turns: self.turns.iter().rev().copied().collect(),
            is_touching: self.is_touching.iter().rev().copied().collect(),
        }
    }

    /// The next row from which on the body rests, for each row.
    fn rests(&self) -> Vec<Option<usize>> {
        let rests = |row: usize| {
            let (start_s, start) = (self.time[row], self.at[row]);
            let mut rows = self.time.iter().zip(&self.at).skip(row);
            rows.find(|(time, at)| **time - start_s >= REST_S || (**at - start).norm() > REST_M)
                .is_none_or(|(_, at)| (at - start).norm() <= REST_M)
        };
        let mut next = vec![None; self.time.len()];
        let mut known = None;
        for row in (0..self.time.len()).rev() {
            if rests(row) {
                known = Some(row);
            }
            next[row] = known;
        }
        next
    }

    /// The direction in which the body came to a row without a contact, unit.
    fn approach(&self, row: usize) -> Option<Vector3<f64>> {
        let end = self.at[row];
        let from = (0..row).rev().take_while(|before| !self.is_touching[*before]);
        let from = from.map(|before| end - self.at[before]).find(|way| way.norm() >= APPROACH_M)?;
        Some(from.normalize())
    }

    /// The way between two rows as an insertion, if it is one; `approach` is the direction before the contact.
    fn insertion(&self, from: usize, to: usize, approach: Option<Vector3<f64>>) -> Option<Insertion> {
        let (start, end) = (self.at[from], self.at[to]);
        let depth = (end - start).norm();
        if depth < LEAST_M {
            return None;
        }
        let way = (end - start) / depth;
        let is_down = way.z < -DOWN;
        if !(is_down || approach.is_some_and(|approach| approach.dot(&way) > ALONG)) {
            return None;
        }
        let rows = from..=to;
        let touching = self.is_touching[rows.clone()].iter().filter(|is| **is).count();
        if !is_down && (touching as f64) < IN_CONTACT * rows.clone().count() as f64 {
            return None;
        }
        let limit = |(least, share): (f64, f64)| (depth * share).max(least);
        let (mut farthest, mut back, mut aside) = (0.0_f64, 0.0_f64, 0.0_f64);
        for at in &self.at[rows.clone()] {
            let along = (at - start).dot(&way);
            farthest = farthest.max(along);
            back = back.max(farthest - along);
            aside = aside.max((at - start - way * along).norm());
        }
        if back > limit(BACK) || aside > limit(BESIDE) {
            return None;
        }
        // The place of rest shows where the axis is, and the vertical is meant where the way is nearly that.
        let axis = if way.z.abs() > DOWN { Vector3::new(0.0, 0.0, -way.z.signum()) } else { -way };
        let depth = (start - end).dot(&axis);
        let beside =
            self.at[rows].iter().map(|at| (at - end - axis * (at - end).dot(&axis)).norm()).fold(0.0, f64::max);
        // What is set down with a tilt sinks while it falls flat.
        let upright = self.turns[to].inverse() * axis;
        let tilt = self.turns[from..=to].iter().map(|turn| (turn * upright).angle(&axis)).fold(0.0, f64::max);
        if HALF_LENGTH_M * tilt.sin() > depth / 2.0 {
            return None;
        }
        let depth = self.searched(from, end, axis, depth, beside);
        Some(Insertion { rim: end + axis * depth, axis, depth, beside })
    }

    /// The depth from the rim on which the body searched for the way in before it went straight on.
    fn searched(&self, from: usize, end: Vector3<f64>, axis: Vector3<f64>, depth: f64, beside: f64) -> f64 {
        let before = (0..from).rev().take_while(|row| self.time[from] - self.time[*row] <= SEARCH_S);
        let touching = before.filter(|row| self.is_touching[*row]).map(|row| self.at[row] - end);
        let heights = touching.map(|at| (at.dot(&axis), at)).filter(|(height, at)| {
            (at - axis * *height).norm() <= beside.max(BESIDE_RIM_M) && *height <= depth + ABOVE_M
        });
        heights.map(|(height, _)| height).fold(depth, f64::max)
    }

    fn forward(&self) -> Vec<Insertion> {
        let Some(home) = self.at.first().copied() else { return vec![] };
        let next = self.rests();
        let (mut found, mut approach, mut touched_s, mut from) = (vec![], None, f64::NEG_INFINITY, 0);
        for (row, rest) in next.into_iter().enumerate() {
            let now_s = self.time[row];
            if self.is_touching[row] {
                if now_s - touched_s > CONTACT_S {
                    approach = self.approach(row);
                }
                touched_s = now_s;
            }
            let Some(rest) = rest.filter(|rest| *rest > row && row >= from) else { continue };
            if now_s - touched_s > ENTRY_S || (self.at[row] - home).norm() <= CARRIED_M {
                continue;
            }
            if let Some(insertion) = self.insertion(row, rest, approach) {
                found.push(insertion);
                from = rest;
            }
        }
        found
    }

    /// The insertions, and what is drawn out: that is an insertion backward in time.
    pub fn insertions(self) -> Vec<Insertion> {
        let path = self.thinned();
        let mut found = path.forward();
        found.extend(path.reversed().forward());
        found
    }
}
