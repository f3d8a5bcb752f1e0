//! How fast a way of joints can be gone where their jerk is limited too.
//!
//! With x, the square of the pace at each knot, all limits of [`super`] are linear, and so is the acceleration a at the beginning of each interval between
//! knots, halfway and at its end. The time is the least that they and the jerk within each interval and from its middle to the next one allow:
//!
//! ```text
//! minimize  Σ τ(x_i, x_i+1)          subject to  |a_i+1 - a_i| ≤ J τ_i,   |a_i+½ - a_i-½| ≤ J (τ_i-1 + τ_i) / 2
//!                                    with the time between two knots τ(x, y) = 2 h / (√x + √y)
//! ```
//!
//! τ is convex, so the limits of jerk are not. Each step takes their tangents for them (F. Debrouwere et al., "Time-Optimal Path Following for Robots
//! With Convex-Concave Constraints Using Sequential Convex Programming", IEEE Transactions on Robotics 29, 2013), within a logarithmic barrier (S. Boyd
//! and L. Vandenberghe, *Convex Optimization*, 2004, 11.3). No place is left in which all limits are kept, so they are wherever it ends; it may end in a
//! local minimum.

use super::{EASED, Knot, SampledPath, USED};
use teachtree_description::tree::Dof;

/// The time is this share above that of the minimum at most, by the bound of the barrier.
const GAP: f64 = 1e-3;
/// By how much the barrier is lowered at once, and from what share of the time on.
const LOWERED: f64 = 10.0;
const FIRST_GAP: f64 = 10.0;
/// Newton steps for one barrier, and halvings of a step, at most.
const STEPS: usize = 40;
const HALVINGS: usize = 40;
/// Half the square of the Newton decrement at which a barrier is done.
const DONE: f64 = 1e-2;

/// A limit: what is left of it is `most + rows · x + jerk · τ` over the knots from `at` on, and never below zero.
struct Limit {
    at: usize,
    rows: [f64; 3],
    most: f64,
    jerk: [f64; 2],
}

/// The squares of the pace at the knots.
pub(super) fn squares(way: &SampledPath<'_>, dofs: &[Dof]) -> Vec<f64> {
    if way.len() < 2 {
        return vec![1.0; way.len()];
    }
    let barrier = Barrier { way, limits: limits(way, dofs) };
    // Slowly enough, at an even pace, all limits are kept.
    let mut even = (0..).map(|halvings| vec![0.5_f64.powi(halvings); way.len()]).take(1000);
    let Some(mut squares) = even.find(|squares| barrier.value(squares, 0.0).is_some()) else {
        return vec![0.0; way.len()];
    };
    let mut weight = barrier.limits.len() as f64 / (FIRST_GAP * barrier.time_s(&squares));
    loop {
        barrier.descend(&mut squares, weight);
        if barrier.limits.len() as f64 / weight < GAP * barrier.time_s(&squares) {
            return squares;
        }
        weight *= LOWERED;
    }
}

/// The largest share of its limit of jerk that the mean jerk of a joint over four knots takes.
///
/// It can exceed 1: [`limits`] limit the change of acceleration within an interval and from its middle to the next one. The mean over three intervals adds
/// the steps at both ends of the middle one, and at a corner all three have the same sign.
pub(super) fn share(knots: &[Knot], dofs: &[Dof]) -> f64 {
    let shares = knots
        .windows(4)
        .flat_map(|four| dofs.iter().enumerate().map(move |(joint, dof)| (mean_jerk(four, joint) / dof.jerk).abs()));
    shares.filter(|share| share.is_finite()).fold(0.0, f64::max)
}

/// The mean jerk of a joint over four knots, rad/s³ or m/s³: six times the third divided difference of its positions.
fn mean_jerk(four: &[Knot], joint: usize) -> f64 {
    let mut differences = [0, 1, 2, 3].map(|knot: usize| four[knot].positions[joint]);
    for order in 1..4 {
        for knot in 0..4 - order {
            let time_s = four[knot + order].time_s - four[knot].time_s;
            differences[knot] = (differences[knot + 1] - differences[knot]) / time_s;
        }
    }
    6.0 * differences[0]
}

fn limits(way: &SampledPath<'_>, dofs: &[Dof]) -> Vec<Limit> {
    let mut limits = Vec::new();
    let last = way.len().saturating_sub(1);
    let per_u = 0.5 / way.step_s;
    // The accelerations of all joints halfway from the knot before.
    let mut before: Vec<[f64; 2]> = vec![[0.0; 2]; dofs.len()];
    for knot in 0..way.len() {
        limits.push(Limit { at: knot, rows: [-1.0, 0.0, 0.0], most: way.fastest(knot, dofs), jerk: [0.0; 2] });
        let mut both = |at: usize, rows: [f64; 3], most: f64, jerk: [f64; 2]| {
            // No more can come together of x up to 1.
            if rows.iter().map(|row| row.abs()).sum::<f64>() > most {
                limits.push(Limit { at, rows, most, jerk });
                limits.push(Limit { at, rows: rows.map(|row| -row), most, jerk });
            }
        };
        let mut now = vec![[0.0; 2]; dofs.len()];
        if knot < last {
            for (joint, along) in way.accelerations(knot).enumerate() {
                let rows = along.map(|[slope, offset]| [offset - slope * per_u, slope * per_u]);
                rows.iter()
                    .for_each(|[x, next]| both(knot, [*x, *next, 0.0], USED * dofs[joint].acceleration, [0.0; 2]));
                now[joint] = rows[1];
                if dofs[joint].jerk.is_finite() {
                    let [begins, _, ends] = rows;
                    let changes = [ends[0] - begins[0], ends[1] - begins[1], 0.0];
                    both(knot, changes, 0.0, [USED * dofs[joint].jerk, 0.0]);
                }
            }
        }
        for ((now, before), dof) in now.iter().zip(&before).zip(dofs).filter(|(_, dof)| dof.jerk.is_finite()) {
            let half = USED * dof.jerk / 2.0;
            match knot {
                0 => both(0, [now[0], now[1], 0.0], 0.0, [half, 0.0]),
                _ if knot == last => both(knot - 1, [before[0], before[1], 0.0], 0.0, [half, 0.0]),
                _ => both(knot - 1, [-before[0], now[0] - before[1], now[1]], 0.0, [half, half]),
            }
        }
        if knot < last {
            limits.push(Limit { at: knot, rows: [1.0 + EASED, -1.0, 0.0], most: 0.0, jerk: [0.0; 2] });
            limits.push(Limit { at: knot, rows: [EASED - 1.0, 1.0, 0.0], most: 0.0, jerk: [0.0; 2] });
        }
        before = now;
    }
    limits
}

/// The time, and a barrier before each limit.
struct Barrier<'a> {
    way: &'a SampledPath<'a>,
    limits: Vec<Limit>,
}

/// A symmetric matrix by its rows, each from the diagonal on: no limit is about more than three knots.
type Band = Vec<[f64; 3]>;

impl Barrier<'_> {
    fn time_s(&self, squares: &[f64]) -> f64 {
        squares.windows(2).map(|pair| self.way.time_s(pair[0], pair[1])).sum()
    }

    /// What is left of a limit; its derivatives with respect to the three squares as well.
    fn left(&self, limit: &Limit, squares: &[f64]) -> (f64, [f64; 3]) {
        let (mut left, mut slopes) = (limit.most, limit.rows);
        for (row, x) in limit.rows.iter().zip(&squares[limit.at..]) {
            left += row * x;
        }
        for (knot, jerk) in limit.jerk.iter().enumerate().filter(|(_, jerk)| **jerk != 0.0) {
            let [x, next] = [squares[limit.at + knot], squares[limit.at + knot + 1]];
            let [by_x, by_next] = self.slopes(x, next);
            left += jerk * self.way.time_s(x, next);
            slopes[knot] += jerk * by_x;
            slopes[knot + 1] += jerk * by_next;
        }
        (left, slopes)
    }

    /// The derivatives of τ.
    fn slopes(&self, x: f64, next: f64) -> [f64; 2] {
        let [a, b] = [x, next].map(f64::sqrt);
        [a, b].map(|root| -self.way.step_s / (root * (a + b).powi(2)))
    }

    /// The weighted time less the logarithms of what is left; `None` where a limit is not kept.
    fn value(&self, squares: &[f64], weight: f64) -> Option<f64> {
        let mut value = weight * self.time_s(squares);
        for limit in &self.limits {
            let (left, _) = self.left(limit, squares);
            if left.is_nan() || left <= 0.0 {
                return None;
            }
            value -= left.ln();
        }
        value.is_finite().then_some(value)
    }

    /// Newton's method for one weight.
    fn descend(&self, squares: &mut Vec<f64>, weight: f64) {
        let Some(mut value) = self.value(squares, weight) else { return };
        for _ in 0..STEPS {
            let (slopes, bends) = self.derivatives(squares, weight);
            let step = solved(bends, &slopes);
            let falls: f64 = step.iter().zip(&slopes).map(|(step, slope)| step * slope).sum();
            if falls.is_nan() || falls <= 2.0 * DONE {
                return;
            }
            let to = |share: f64| squares.iter().zip(&step).map(|(x, step)| x - share * step).collect::<Vec<f64>>();
            let lower = (0..HALVINGS).find_map(|halvings| {
                let share = 0.5_f64.powi(halvings as i32);
                let to = to(share);
                self.value(&to, weight).filter(|new| *new < value - 0.1 * share * falls).map(|new| (to, new))
            });
            let Some((to, new)) = lower else { return };
            (*squares, value) = (to, new);
        }
    }

    /// First and second derivatives of the value; those of limits are taken for straight.
    fn derivatives(&self, squares: &[f64], weight: f64) -> (Vec<f64>, Band) {
        let mut slopes = vec![0.0; squares.len()];
        let mut bends: Band = vec![[0.0; 3]; squares.len()];
        let h = self.way.step_s;
        for (knot, pair) in squares.windows(2).enumerate() {
            let [by_x, by_next] = self.slopes(pair[0], pair[1]);
            slopes[knot] += weight * by_x;
            slopes[knot + 1] += weight * by_next;
            let [a, b] = [pair[0].sqrt(), pair[1].sqrt()];
            let sum = a + b;
            let own = |root: f64| h / (2.0 * root.powi(3) * sum.powi(2)) + h / (root.powi(2) * sum.powi(3));
            bends[knot][0] += weight * own(a);
            bends[knot + 1][0] += weight * own(b);
            bends[knot][1] += weight * h / (a * b * sum.powi(3));
        }
        for limit in &self.limits {
            let (left, by) = self.left(limit, squares);
            for (row, one) in by.iter().enumerate().filter(|(_, one)| **one != 0.0) {
                slopes[limit.at + row] -= one / left;
                for (column, other) in by.iter().enumerate().skip(row) {
                    bends[limit.at + row][column - row] += one * other / (left * left);
                }
            }
        }
        (slopes, bends)
    }
}

/// Solves a system with a positive definite band, by Cholesky's method without roots.
fn solved(mut band: Band, right: &[f64]) -> Vec<f64> {
    let count = right.len();
    let mut made = right.to_vec();
    for row in 0..count {
        let [pivot, ..] = band[row];
        for down in (1..3).filter(|down| row + down < count) {
            let factor = band[row][down] / pivot;
            for along in down..3 {
                band[row + down][along - down] -= factor * band[row][along];
            }
            made[row + down] -= factor * made[row];
        }
    }
    for row in (0..count).rev() {
        for along in (1..3).filter(|along| row + along < count) {
            made[row] -= band[row][along] * made[row + along];
        }
        made[row] /= band[row][0];
    }
    made
}
