//! How fast a way of joints can be gone: as fast as it was planned where the joints can, and slower only where they cannot.
//!
//! Time-optimal path parametrisation by reachability (Pham and Pham, "A new approach to time-optimal path parameterization based on reachability
//! analysis", IEEE Transactions on Robotics 34, 2018). A way q(s) and the square x of its pace ds/dt: along it velocities are q' √x and
//! accelerations q' u + q'' x, where u is the same from one knot to the next. A pass from the end finds at each knot the largest x from which
//! the rest can still be gone, a pass from the beginning takes the largest that can be had.
//!
//! The way is the uniform cubic B-spline of its samples: its second derivative is continuous, so a corner is rounded within two samples
//! instead of being a step of velocity, and where samples bend by q'' it cuts off no more than q'' h² / 6.
//!
//! Where a joint has a limit of jerk, x comes from [`jerk`] instead.

mod jerk;

use teachtree_description::tree::Dof;

/// A way with its times.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TimedPath {
    /// Its knots, in order.
    pub knots: Vec<Knot>,
    /// How many times slower than planned it is, at least 1.
    pub slower: f64,
    /// Which joint is at a limit of its own for longest.
    pub at_limit: Option<usize>,
}

/// Where all joints are at one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Knot {
    /// Since the beginning, s.
    pub time_s: f64,
    /// Of each joint.
    pub positions: Vec<f64>,
    /// Of each joint.
    pub velocities: Vec<f64>,
    /// Of each joint; where it changes at once, the mean of before and after.
    pub accelerations: Vec<f64>,
}

/// From one knot to the next x changes by this share of itself at most, so that polynomials between them are what the way is.
const EASED: f64 = 0.25;
/// Polynomials through positions and velocities of the knots speed up a little more than the way between them: this share of a limit is used.
const USED: f64 = 0.9;
/// Halvings of a range in which the largest pace is looked for.
const HALVINGS: usize = 40;

/// The times of a way of samples that are `step_s` apart as planned. It begins and ends at rest.
pub fn timed(samples: &[Vec<f64>], step_s: f64, dofs: &[Dof]) -> TimedPath {
    let way = SampledPath::new(samples, step_s);
    let limited = dofs.iter().any(|dof| dof.jerk.is_finite());
    let squares = if limited { jerk::squares(&way, dofs) } else { squares(&way, dofs) };
    let mut knots: Vec<Knot> = Vec::with_capacity(way.len());
    let (mut time_s, mut before) = (0.0, None);
    for (knot, &x) in squares.iter().enumerate() {
        let next = squares.get(knot + 1).copied();
        let u = next.map(|next| (next - x) / (2.0 * step_s));
        let mean = match (before, u) {
            (Some(before), Some(after)) => f64::midpoint(before, after),
            (one, other) => one.or(other).unwrap_or_default(),
        };
        let [positions, first, second] = way.at(knot);
        let velocities = first.iter().map(|first| first * x.sqrt()).collect();
        let accelerations = first.iter().zip(&second).map(|(first, second)| first * mean + second * x).collect();
        knots.push(Knot { time_s, positions, velocities, accelerations });
        time_s += next.map_or(0.0, |next| way.time_s(x, next));
        before = u;
    }
    let stretched = over_limit(&knots, dofs).sqrt().max(jerk::share(&knots, dofs).cbrt()).max(1.0);
    for knot in knots.iter_mut().filter(|_| stretched > 1.0) {
        knot.time_s *= stretched;
        knot.velocities.iter_mut().for_each(|velocity| *velocity /= stretched);
        knot.accelerations.iter_mut().for_each(|acceleration| *acceleration /= stretched * stretched);
    }
    let planned = squares.len().saturating_sub(1) as f64 * step_s;
    let slower = knots.last().map_or(1.0, |knot| if planned > 0.0 { knot.time_s / planned } else { 1.0 });
    let at_limit = longest_at_limit(&knots, dofs);
    TimedPath { knots, slower: slower.max(1.0), at_limit }
}

/// The largest share of its limit of acceleration that a joint takes where cubic polynomials join positions and velocities of the knots, which may exceed
/// what the way itself takes by more than what [`USED`] leaves.
fn over_limit(knots: &[Knot], dofs: &[Dof]) -> f64 {
    let shares = knots.windows(2).flat_map(|pair| {
        let [knot, next] = [&pair[0], &pair[1]];
        let step_s = next.time_s - knot.time_s;
        dofs.iter().enumerate().map(move |(joint, dof)| {
            let mean = (next.positions[joint] - knot.positions[joint]) / step_s;
            let [before, after] = [knot.velocities[joint], next.velocities[joint]];
            let ends = [6.0 * mean - 4.0 * before - 2.0 * after, 4.0 * after + 2.0 * before - 6.0 * mean];
            ends.into_iter().map(f64::abs).fold(0.0, f64::max) / step_s / dof.acceleration
        })
    });
    shares.filter(|share| share.is_finite()).fold(0.0, f64::max)
}

/// The squares of the pace at the knots for the limits of velocity and acceleration, by reachability.
fn squares(way: &SampledPath<'_>, dofs: &[Dof]) -> Vec<f64> {
    let last = way.len().saturating_sub(1);
    // The largest x of each knot from which the rest can be gone.
    let mut most = vec![1.0; way.len()];
    for knot in (0..last).rev() {
        let can = |x: f64| way.paces(knot, x, most[knot + 1], dofs).is_some();
        let fastest = way.fastest(knot, dofs);
        most[knot] = if can(fastest) { fastest } else { largest(fastest, &can) };
    }
    let mut squares: Vec<f64> = most.first().copied().into_iter().collect();
    for knot in 0..last {
        let x = squares[knot];
        // Rounding may leave nothing where the pass from the end found just enough.
        let next = way.paces(knot, x, most[knot + 1], dofs).map_or(most[knot + 1], |u| x + 2.0 * way.step_s * u);
        squares.push(next.clamp(0.0, 1.0));
    }
    squares
}

/// Of the joints that come to within a hundredth of a limit, the one that is there for longest.
fn longest_at_limit(knots: &[Knot], dofs: &[Dof]) -> Option<usize> {
    let at_limit = |joint: usize| {
        let dof = &dofs[joint];
        let close = |pair: &&[Knot]| {
            let [knot, next] = pair else { return false };
            let jerk = (next.accelerations[joint] - knot.accelerations[joint]) / (next.time_s - knot.time_s);
            let used = (knot.accelerations[joint] / dof.acceleration).abs().max((jerk / dof.jerk).abs()) / USED;
            used.max((knot.velocities[joint] / dof.speed).abs()) > 0.99
        };
        knots.windows(2).filter(close).count()
    };
    let times = (0..dofs.len()).map(|joint| (at_limit(joint), joint)).filter(|(times, _)| *times > 0);
    times.max_by_key(|(times, joint)| (*times, std::cmp::Reverse(*joint))).map(|(_, joint)| joint)
}

/// The largest number up to `most` that can be; 0 always can.
fn largest(most: f64, can: &dyn Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, most);
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(low, high);
        if can(middle) { low = middle } else { high = middle }
    }
    low
}

/// A way by its knots, `step_s` apart.
struct SampledPath<'a> {
    /// Its ends stand three times, so that it begins and ends at rest, on them.
    samples: Vec<&'a [f64]>,
    step_s: f64,
}

impl<'a> SampledPath<'a> {
    fn new(samples: &'a [Vec<f64>], step_s: f64) -> Self {
        let (first, last) = (samples.first(), samples.last());
        let all = first.into_iter().chain(first).chain(samples).chain(last).chain(last);
        Self { samples: all.map(Vec::as_slice).collect(), step_s }
    }

    /// Knots.
    fn len(&self) -> usize {
        self.samples.len().saturating_sub(2)
    }

    /// The three samples about a knot, of each joint.
    fn about(&self, knot: usize) -> impl Iterator<Item = [f64; 3]> {
        let [before, here, after] = [0, 1, 2].map(|step| self.samples[knot + step]);
        before.iter().zip(here).zip(after).map(|((before, here), after)| [*before, *here, *after])
    }

    /// First and second derivative of a joint, of the samples about a knot.
    fn derivatives(&self, [before, here, after]: [f64; 3]) -> [f64; 2] {
        let h = self.step_s;
        [(after - before) / (2.0 * h), (after - 2.0 * here + before) / (h * h)]
    }

    /// Values, first and second derivatives of all joints at a knot.
    fn at(&self, knot: usize) -> [Vec<f64>; 3] {
        let mut made = [Vec::new(), Vec::new(), Vec::new()];
        for about in self.about(knot) {
            let [before, here, after] = about;
            let [first, second] = self.derivatives(about);
            made[0].push((before + 4.0 * here + after) / 6.0);
            made[1].push(first);
            made[2].push(second);
        }
        made
    }

    /// The largest x for the velocities at a knot; nothing is done faster than planned.
    fn fastest(&self, knot: usize, dofs: &[Dof]) -> f64 {
        let asks = |(about, dof): ([f64; 3], &Dof)| (dof.speed / self.derivatives(about)[0]).powi(2);
        self.about(knot).zip(dofs).map(asks).fold(1.0, f64::min)
    }

    /// The largest u from a knot to the next with x at the first and at most `next` at the other; `None` when there is none.
    fn paces(&self, knot: usize, x: f64, next: f64, dofs: &[Dof]) -> Option<f64> {
        let h2 = 2.0 * self.step_s;
        let (mut low, mut high) = (-EASED * x / h2, (EASED * x).min(next - x) / h2);
        let mut keep = |slope: f64, offset: f64, most: f64| {
            // -most <= slope u + offset <= most
            if slope == 0.0 {
                if offset.abs() > most {
                    (low, high) = (f64::INFINITY, f64::NEG_INFINITY);
                }
                return;
            }
            let (one, other) = ((-most - offset) / slope, (most - offset) / slope);
            (low, high) = (low.max(one.min(other)), high.min(one.max(other)));
        };
        for (along, dof) in self.accelerations(knot).zip(dofs) {
            along.into_iter().for_each(|[slope, offset]| keep(slope, offset * x, USED * dof.acceleration));
        }
        (low <= high).then_some(high)
    }

    /// The accelerations of each joint from a knot to the next, at its beginning, halfway and at its end, as `[slope, offset]`: slope u + offset x with x at
    /// the beginning.
    fn accelerations(&self, knot: usize) -> impl Iterator<Item = [[f64; 2]; 3]> {
        let h = self.step_s;
        self.about(knot).zip(self.about(knot + 1)).map(move |(here, after)| {
            let [[first, second], [end_first, end_second]] = [here, after].map(|about| self.derivatives(about));
            // The second derivative is straight between knots.
            let (middle, bend) = (first + (3.0 * second + end_second) * h / 8.0, f64::midpoint(second, end_second));
            [[first, second], [middle + bend * h, bend], [end_first + end_second * 2.0 * h, end_second]]
        })
    }

    /// How long it takes from a knot to the next with these squares of the pace at both, s.
    fn time_s(&self, x: f64, next: f64) -> f64 {
        2.0 * self.step_s / (x.sqrt() + next.sqrt())
    }
}
