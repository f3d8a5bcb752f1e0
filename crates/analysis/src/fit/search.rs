//! The search: one param after the other, over its whole range, until none brings anything more.
//!
//! The objective of a threshold is a staircase: gradients are zero or nowhere. Therefore each line is sampled in even steps from end to end, then more
//! finely around the best; of a plateau the middle is taken, which is as far as can be from where it gets worse.

use super::{Objectives, ParamVector, Space, mean, rounded};

/// A change that is not objective this is not made.
pub const MIN_GAIN: f64 = 0.002;
/// Values of a plateau differ by no more than this.
const TIE: f64 = 0.001;
/// Steps over a range.
const STEPS: usize = 8;
/// Number of refinements around the best value.
const REFINED: usize = 2;
/// Rounds over all params, at most.
const SWEEPS: usize = 4;

/// Receives the share of a search that is done, 0 to 1.
pub type Progress<'a> = dyn FnMut(f64) + 'a;

/// A line through the space.
#[derive(Clone, Copy, Debug)]
enum Line {
    /// One param.
    One(usize),
    /// The two thresholds of a hysteresis; their ratio stays.
    Both(usize, usize),
}

/// The params that change nothing on any recording, wherever they lie in their ranges while the others stay as they are.
pub fn idle(space: &Space, objectives: &mut Objectives) -> Vec<usize> {
    let start = space.start();
    let at_start = objectives(std::slice::from_ref(&start)).pop().flatten();
    let is_idle = |at: &usize| {
        let Some(param) = space.params.get(*at) else { return true };
        let points: Vec<ParamVector> =
            (0..=STEPS / 2).map(|step| with(&start, *at, param.at(step as f64 / (STEPS / 2) as f64))).collect();
        // A point that cannot run says nothing.
        objectives(&points).into_iter().all(|found| found.is_none() || found == at_start)
    };
    (0..space.params.len()).filter(is_idle).collect()
}

/// The best point that is found for some of the recordings, from the values in the files on.
pub fn search(
    space: &Space,
    of: &[usize],
    still: &[usize],
    objectives: &mut Objectives,
    progress: &mut Progress,
) -> ParamVector {
    let mut search = Search { space, of, objectives };
    let mut best = space.start();
    let Some(mut objective) = search.objective(std::slice::from_ref(&best)).pop().flatten() else { return best };
    let one = (0..space.params.len()).map(Line::One);
    let both = space.pairs.iter().map(|(on, off)| Line::Both(*on, *off));
    let is_still = |line: &Line| match line {
        Line::One(at) => still.contains(at),
        Line::Both(on, off) => still.contains(on) && still.contains(off),
    };
    let mut lines: Vec<Line> = both.chain(one).filter(|line| !is_still(line)).collect();
    let all = (SWEEPS * lines.len()).max(1) as f64;
    for sweep in 0..SWEEPS {
        let before = objective;
        for (number, line) in lines.iter().enumerate() {
            (best, objective) = search.line(*line, best, objective);
            progress((sweep * lines.len() + number + 1) as f64 / all);
        }
        if objective - before < MIN_GAIN {
            break;
        }
        // The order alternates, because the first param of a round has an advantage.
        lines.reverse();
    }
    let found = search.without_needless(best, objective);
    progress(1.0);
    found
}

struct Search<'a, 'w> {
    space: &'a Space,
    of: &'a [usize],
    objectives: &'a mut Objectives<'w>,
}

impl Search<'_, '_> {
    fn objective(&mut self, points: &[ParamVector]) -> Vec<Option<f64>> {
        let found = (self.objectives)(points);
        found.into_iter().map(|found| found.map(|objectives| mean(&objectives, self.of).objective)).collect()
    }

    /// The point of a line at a value of its first param.
    fn on(&self, line: Line, from: &ParamVector, value: f64) -> Option<ParamVector> {
        match line {
            Line::One(at) => Some(with(from, at, value)),
            Line::Both(on, off) => {
                let (begin, end) = (from.get(on)?, from.get(off)?);
                let param = self.space.params.get(off)?;
                let scaled = rounded(value * end / begin, 3).clamp(param.range.0, param.range.1);
                scaled.is_finite().then(|| with(&with(from, on, value), off, scaled))
            }
        }
    }

    /// The best of a line, and its objective.
    fn line(&mut self, line: Line, from: ParamVector, objective: f64) -> (ParamVector, f64) {
        let at = match line {
            Line::One(at) | Line::Both(at, _) => at,
        };
        let (Some(param), Some(now)) = (self.space.params.get(at), from.get(at).copied()) else {
            return (from, objective);
        };
        let mut known: Vec<(f64, Option<f64>)> = vec![(now, Some(objective))];
        let steps = (0..=STEPS).map(|step| param.at(step as f64 / STEPS as f64)).collect();
        self.look(line, &from, steps, &mut known);
        for _ in 0..REFINED {
            let Some(best) = best_of(&known, now) else { break };
            let mut between = Vec::new();
            for other in [best.checked_sub(1), Some(best + 1)].into_iter().flatten() {
                let (Some(here), Some(there)) = (known.get(best), known.get(other)) else { continue };
                let (here, there) = (param.part(here.0), param.part(there.0));
                between.extend([1.0, 2.0].map(|third| param.at(here + (there - here) * third / 3.0)));
            }
            self.look(line, &from, between, &mut known);
        }
        let Some(best) = best_of(&known, now) else { return (from, objective) };
        let Some((mut value, Some(mut most))) = known.get(best).copied() else { return (from, objective) };
        let (low, high) = plateau(&known, best, most);
        if (low..=high).contains(&now) || most - objective < MIN_GAIN {
            return (from, objective);
        }
        // The middle, then fewer digits, each only where it is as good.
        let middle = param.at((param.part(low) + param.part(high)) / 2.0);
        for other in [middle, rounded(middle, 2)] {
            let Some(point) = self.on(line, &from, other).filter(|_| (low..=high).contains(&other)) else { continue };
            if let Some(Some(found)) = self.objective(&[point]).pop()
                && found >= most - TIE
            {
                value = other;
                most = found;
            }
        }
        match self.on(line, &from, value) {
            Some(point) if most - objective >= MIN_GAIN => (point, most),
            _ => (from, objective),
        }
    }

    /// Looks at values of a line that are not known yet; `known` is in order.
    fn look(&mut self, line: Line, from: &ParamVector, values: Vec<f64>, known: &mut Vec<(f64, Option<f64>)>) {
        let mut new: Vec<f64> = values
            .into_iter()
            .filter(|value| !known.iter().any(|(other, _)| other.to_bits() == value.to_bits()))
            .collect();
        new.sort_by(f64::total_cmp);
        new.dedup();
        let points: Vec<(f64, ParamVector)> =
            new.into_iter().filter_map(|value| Some((value, self.on(line, from, value)?))).collect();
        let objectives = self.objective(&points.iter().map(|(_, point)| point.clone()).collect::<Vec<_>>());
        known.extend(points.into_iter().map(|(value, _)| value).zip(objectives));
        known.sort_by(|a, b| a.0.total_cmp(&b.0));
    }

    /// The point with every change taken back that brings nothing beside the others.
    fn without_needless(&mut self, best: ParamVector, objective: f64) -> ParamVector {
        let start = self.space.start();
        let mut kept = best;
        let mut objective = objective;
        for (at, value) in start.iter().enumerate() {
            if kept.get(at).is_some_and(|now| now.to_bits() == value.to_bits()) {
                continue;
            }
            let without = with(&kept, at, *value);
            if let Some(Some(found)) = self.objective(std::slice::from_ref(&without)).pop()
                && found >= objective - TIE
            {
                kept = without;
                objective = objective.max(found);
            }
        }
        kept
    }
}

fn with(point: &ParamVector, at: usize, value: f64) -> ParamVector {
    let mut point = point.clone();
    if let Some(old) = point.get_mut(at) {
        *old = value;
    }
    point
}

/// The position of the best value; of equal ones the nearest to what is.
fn best_of(known: &[(f64, Option<f64>)], now: f64) -> Option<usize> {
    let far = |value: f64| -> f64 { (value - now).abs() };
    let can = known.iter().enumerate().filter_map(|(at, (value, objective))| Some((at, *value, (*objective)?)));
    can.max_by(|a, b| a.2.total_cmp(&b.2).then(far(b.1).total_cmp(&far(a.1)))).map(|(at, ..)| at)
}

/// The ends of the values around the best that are as good.
fn plateau(known: &[(f64, Option<f64>)], best: usize, most: f64) -> (f64, f64) {
    let good = |one: &&(f64, Option<f64>)| one.1.is_some_and(|objective| objective >= most - TIE);
    let (below, above) = known.split_at(best);
    let value = known.get(best).map_or(0.0, |one| one.0);
    let low = below.iter().rev().take_while(good).last().map_or(value, |one| one.0);
    let high = above.iter().take_while(good).last().map_or(value, |one| one.0);
    (low, high)
}
