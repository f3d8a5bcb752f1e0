//! A transform between two frames over time, from the samples of a log.

use super::resampler::UsualStep;
use nalgebra::Isometry3;
use std::collections::VecDeque;
use teachtree_base::geometry::pose;

/// A transform is interpolated, or held at the ends, over this many of its usual steps, and at least over `bridge`.
const STEPS: f64 = 3.0;
/// A transform whose numbers differ by less never changes.
const CONSTANT: f64 = 1e-12;

/// The samples of a transform: stamps, s, and parent_from_child, m.
pub struct SampledTransform {
    samples: VecDeque<(f64, Isometry3<f64>)>,
    /// The numbers of the first sample, as long as all samples have them.
    constant: Option<[f64; 7]>,
    /// The usual step of the samples, s.
    usual_s: f64,
    /// Over how long it is interpolated or held at least, s.
    bridge_s: f64,
    /// The last steps of a live log.
    steps: UsualStep,
}

impl SampledTransform {
    /// Returns a transform without samples.
    pub fn new(bridge_s: f64) -> Self {
        Self { samples: VecDeque::new(), constant: None, usual_s: 0.0, bridge_s, steps: UsualStep::default() }
    }

    /// All samples of a log; `columns` are those of x y z w x y z among `numbers`.
    pub fn of(time: &[f64], numbers: &[Vec<f64>], columns: &[usize; 7], bridge_s: f64) -> Self {
        let mut transform = Self::new(bridge_s);
        for (row, stamp) in time.iter().enumerate() {
            transform.add(*stamp, parts(numbers, columns, row));
        }
        let after = transform.samples.iter().skip(1);
        let mut steps: Vec<f64> = transform.samples.iter().zip(after).map(|((from, _), (to, _))| to - from).collect();
        steps.sort_by(f64::total_cmp);
        transform.usual_s = steps.get(steps.len() / 2).copied().unwrap_or_default();
        transform
    }

    /// Takes a row of a live log: its stamp, s, and its columns.
    pub fn push(&mut self, stamp: f64, numbers: &[Vec<f64>], columns: &[usize; 7]) {
        let before = self.samples.back().map(|(before, _)| *before);
        if self.add(stamp, parts(numbers, columns, 0))
            && let Some(before) = before
        {
            self.steps.push(stamp - before);
            self.usual_s = self.steps.usual();
        }
    }

    /// Whether the transform was measured at a stamp.
    fn add(&mut self, stamp: f64, parts: [f64; 7]) -> bool {
        if !parts.iter().all(|part| part.is_finite()) {
            return false;
        }
        let is_same = |first: [f64; 7]| parts.iter().zip(first).all(|(part, first)| (part - first).abs() < CONSTANT);
        self.constant = if self.samples.is_empty() { Some(parts) } else { self.constant.filter(|it| is_same(*it)) };
        let [x, y, z, w, i, j, k] = parts;
        self.samples.push_back((stamp, pose([x, y, z], [w, i, j, k])));
        true
    }

    /// Whether no later row of a live log, whose newest row is at `newest_s`, changes the pose at a stamp, s.
    pub fn is_known(&self, stamp: f64, newest_s: f64) -> bool {
        match self.samples.back() {
            Some((last, _)) => *last >= stamp || newest_s - last > self.reach_s(),
            None => newest_s - stamp > self.reach_s(),
        }
    }

    /// Forgets the samples that no stamp after this one, s, needs.
    pub fn forget(&mut self, stamp: f64) {
        while self.samples.get(1).is_some_and(|(next, _)| *next <= stamp) {
            self.samples.pop_front();
        }
    }

    fn reach_s(&self) -> f64 {
        self.bridge_s.max(STEPS * self.usual_s)
    }

    /// The pose of the child in the parent at a stamp, s; `None` where it is too far from the samples.
    pub fn at(&self, stamp: f64) -> Option<Isometry3<f64>> {
        if self.constant.is_some() {
            return self.samples.front().map(|(_, pose)| *pose);
        }
        let after = self.samples.partition_point(|(time, _)| *time < stamp);
        let (before, after) =
            (after.checked_sub(1).and_then(|before| self.samples.get(before)), self.samples.get(after));
        match (before, after) {
            (_, Some((to, pose))) if *to == stamp => Some(*pose),
            (Some((from, first)), Some((to, last))) if to - from <= self.reach_s() => {
                let share = (stamp - from) / (to - from);
                first.try_lerp_slerp(last, share, 1e-9).or(Some(*first))
            }
            (Some((held, pose)), None) | (None, Some((held, pose))) if (stamp - held).abs() <= self.reach_s() => {
                Some(*pose)
            }
            _ => None,
        }
    }
}

/// The numbers of a transform in a row; NaN where it was not measured.
fn parts(numbers: &[Vec<f64>], columns: &[usize; 7], row: usize) -> [f64; 7] {
    columns.map(|column| numbers.get(column).and_then(|values| values.get(row)).copied().unwrap_or(f64::NAN))
}
