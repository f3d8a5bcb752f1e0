//! The search over poses of the palm: many starts are evaluated, some are improved, the best is polished.
//!
//! Improving is a quasi-Newton descent (BFGS) in six coordinates about the current pose: a shift of the
//! middle of the contacts in m, and a rotation about it in units of 0.1 m / rad, so that both move fingertips by similar distances.

use super::cost::Cost;
use super::grasp_request::GraspRequest;
use nalgebra::{Isometry3, Matrix6, Point3, Translation3, UnitQuaternion, Vector3, Vector6};
use teachtree_base::hands::Finger;

/// Number of steps toward the contacts from each start, by the contacts only; repeated from the better half.
const FITTED: usize = 2;
/// Rounds of the descent: number of the cheapest poses, and number of further steps.
const ROUNDS: [(usize, usize); 3] = [(24, 4), (10, 8), (4, 60)];
/// Number of the best poses from which the descent restarts at the end.
const RENEWED: usize = 2;
/// The angle by which a pose is tilted, rad.
const ROLLS: [f64; 7] = [0.0, -0.4, 0.4, -0.8, 0.8, -1.2, 1.2];
const TILTS: [f64; 3] = [0.0, -0.4, 0.4];
/// m for one rad.
const TURN_M: f64 = 0.1;
/// Smallest gain of a step with which a descent continues.
const GAIN: f64 = 2e-5;
/// Smallest difference of two starts, m.
const APART_M: f64 = 0.030;

/// Returns starts with their fingers brought to the contacts, and their costs, cheapest first; the half with the larger missing distances is left out.
fn ranked(cost: &Cost<'_>, starts: &[Isometry3<f64>]) -> Vec<(f64, Isometry3<f64>)> {
    let mut fitted: Vec<(f64, Isometry3<f64>)> = starts.iter().map(|start| fitted(cost, start)).collect();
    fitted.sort_by(|a, b| a.0.total_cmp(&b.0));
    fitted.truncate(fitted.len().div_ceil(2));
    let looked = fitted.iter().map(|(_, pose)| {
        let (_, pose) = self::fitted(cost, pose);
        (cost.of(&pose), pose)
    });
    let mut ranked: Vec<(f64, Isometry3<f64>)> = looked.collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    ranked
}

/// Returns the `count` cheapest starts at most that are farther than `far_m` apart, m, with their fingers brought to the contacts.
pub(super) fn spread(cost: &Cost<'_>, starts: &[Isometry3<f64>], count: usize, far_m: f64) -> Vec<Isometry3<f64>> {
    let mut kept: Vec<Isometry3<f64>> = Vec::new();
    for (_, pose) in ranked(cost, starts) {
        if kept.len() < count && kept.iter().all(|other| apart(&pose, other) > far_m) {
            kept.push(pose);
        }
    }
    kept
}

/// The best poses that were found, best first.
pub(super) fn best_poses(cost: &Cost<'_>, starts: &[Isometry3<f64>]) -> Vec<Isometry3<f64>> {
    let mut descents: Vec<Descent> = Vec::new();
    for (value, pose) in ranked(cost, starts) {
        if descents.len() < ROUNDS[0].0 && descents.iter().all(|other| apart(&pose, &other.pose) > APART_M) {
            descents.push(Descent::new(pose, value));
        }
    }
    let middle = cost.middle();
    for (count, steps) in ROUNDS {
        descents.iter_mut().take(count).for_each(|descent| descent.run(cost, &middle, steps));
        descents.sort_by(|a, b| a.value.total_cmp(&b.value));
    }
    // A descent that stopped at a kink continues along it after a restart.
    for descent in descents.iter_mut().take(RENEWED) {
        descent.inverse_hessian = None;
        descent.run(cost, &middle, ROUNDS[2].1);
    }
    descents.sort_by(|a, b| a.value.total_cmp(&b.value));
    descents.into_iter().map(|descent| descent.pose).collect()
}

/// Returns a pose with the fingers brought to the contacts, and the missing distance before the last step, m.
fn fitted(cost: &Cost<'_>, pose: &Isometry3<f64>) -> (f64, Isometry3<f64>) {
    (0..FITTED).fold((0.0, *pose), |(_, pose), _| cost.nearer(&pose))
}

/// Improves a pose until the descent ends.
pub(super) fn polished(cost: &Cost<'_>, pose: &Isometry3<f64>) -> Isometry3<f64> {
    let mut descent = Descent::new(*pose, cost.of(pose));
    for _ in 0..4 {
        descent.run(cost, &cost.middle(), 100);
        descent.inverse_hessian = None;
    }
    descent.pose
}

/// Returns a pose tilted about the line from the thumb to the fingers and about the row of fingers, with the fingers at their contacts again.
pub(super) fn leant(cost: &Cost<'_>, request: &GraspRequest<'_>, pose: &Isometry3<f64>) -> Vec<Isometry3<f64>> {
    let middle = cost.middle();
    let thumb = request.contacts.iter().find(|contact| contact.finger == Finger::Thumb).or(request.contacts.first());
    let across = thumb.and_then(|thumb| (middle - thumb.point).try_normalize(1e-6)).unwrap_or_else(Vector3::x);
    let row = (middle.coords - pose.translation.vector).cross(&across).try_normalize(1e-6).unwrap_or_else(Vector3::y);
    let turns = ROLLS.into_iter().flat_map(|roll| TILTS.map(|tilt| across * roll + row * tilt));
    let leant = turns.map(|turn| {
        let leant =
            moved(pose, &middle, &Vector6::new(0.0, 0.0, 0.0, turn.x * TURN_M, turn.y * TURN_M, turn.z * TURN_M));
        let (_, nearer) = fitted(cost, &leant);
        fitted(cost, &nearer).1
    });
    leant.collect()
}

/// Improves a pose by a number of steps; returns its cost and the pose.
pub(super) fn improved(cost: &Cost<'_>, pose: &Isometry3<f64>, steps: usize) -> (f64, Isometry3<f64>) {
    let mut descent = Descent::new(*pose, cost.of(pose));
    descent.run(cost, &cost.middle(), steps);
    (descent.value, descent.pose)
}

/// Differential evolution over all poses near the object, then a polish.
pub(super) fn everywhere(cost: &Cost<'_>, generations: usize, chance: &mut dyn FnMut() -> f64) -> Isometry3<f64> {
    const MEMBERS: usize = 48;
    const REACH_M: f64 = 0.25;
    let middle = cost.middle();
    let at = |x: &Vector6<f64>| moved(&Isometry3::from(middle), &middle, x);
    let mut draw = || {
        let mut x = Vector6::zeros();
        for row in 0..3 {
            x[row] = REACH_M * (2.0 * chance() - 1.0);
            x[row + 3] = std::f64::consts::PI * TURN_M * (2.0 * chance() - 1.0);
        }
        x
    };
    let mut members: Vec<(f64, Vector6<f64>)> = (0..MEMBERS).map(|_| draw()).map(|x| (cost.of(&at(&x)), x)).collect();
    for _ in 0..generations {
        for index in 0..MEMBERS {
            let mut pick = || members[(chance() * MEMBERS as f64) as usize % MEMBERS].1;
            let (a, b, c) = (pick(), pick(), pick());
            let best = members.iter().min_by(|a, b| a.0.total_cmp(&b.0)).map_or(a, |(_, x)| *x);
            let towards = if chance() < 0.5 { best } else { a };
            let mut trial = members[index].1;
            let kept = (chance() * 6.0) as usize;
            for row in 0..6 {
                if chance() < 0.8 || row == kept {
                    trial[row] = towards[row] + 0.6 * (b[row] - c[row]);
                }
            }
            let value = cost.of(&at(&trial));
            if value <= members[index].0 {
                members[index] = (value, trial);
            }
        }
    }
    let best = members.iter().min_by(|a, b| a.0.total_cmp(&b.0)).map_or_else(Vector6::zeros, |(_, x)| *x);
    polished(cost, &at(&best))
}

/// Returns the difference of two poses, m, with rotations scaled as in the search.
pub(super) fn apart(one: &Isometry3<f64>, other: &Isometry3<f64>) -> f64 {
    (one.translation.vector - other.translation.vector).norm() + TURN_M * one.rotation.angle_to(&other.rotation)
}

/// A pose moved by six coordinates about a point of the object.
fn moved(pose: &Isometry3<f64>, about: &Point3<f64>, x: &Vector6<f64>) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(x.fixed_rows::<3>(3) / TURN_M);
    let shift: Vector3<f64> = x.fixed_rows::<3>(0).into();
    let arm = pose.translation.vector - about.coords;
    Isometry3::from_parts(Translation3::from(about.coords + shift + turn * arm), turn * pose.rotation)
}

/// The state of a descent.
struct Descent {
    pose: Isometry3<f64>,
    value: f64,
    inverse_hessian: Option<Matrix6<f64>>,
    slope: Option<Vector6<f64>>,
    over: bool,
}

impl Descent {
    fn new(pose: Isometry3<f64>, value: f64) -> Self {
        Self { pose, value, inverse_hessian: None, slope: None, over: false }
    }

    fn run(&mut self, cost: &Cost<'_>, middle: &Point3<f64>, steps: usize) {
        self.over &= self.inverse_hessian.is_some();
        for _ in 0..steps {
            if self.over {
                return;
            }
            self.step(cost, middle);
        }
    }

    /// Returns the cost and its gradient in the six coordinates.
    fn look(cost: &Cost<'_>, middle: &Point3<f64>, pose: &Isometry3<f64>) -> (f64, Vector6<f64>) {
        let (value, mut slope) = cost.with_slope(pose, middle);
        slope.fixed_rows_mut::<3>(3).scale_mut(1.0 / TURN_M);
        (value, slope)
    }

    fn step(&mut self, cost: &Cost<'_>, middle: &Point3<f64>) {
        let slope = self.slope.take().unwrap_or_else(|| Self::look(cost, middle, &self.pose).1);
        // The first step has about 5 mm.
        let first = Matrix6::identity() * (0.005 / slope.norm().max(1e-9));
        let mut inverse = *self.inverse_hessian.get_or_insert(first);
        let mut direction = -(inverse * slope);
        if direction.dot(&slope) >= 0.0 {
            (inverse, direction) = (first, -(first * slope));
        }
        // No step moves a fingertip by more than 30 mm.
        direction *= (0.03 / direction.norm().max(1e-12)).min(1.0);
        let mut length = 1.0;
        let found = loop {
            let pose = moved(&self.pose, middle, &(direction * length));
            let (value, next) = Self::look(cost, middle, &pose);
            if value < self.value + 1e-4 * length * direction.dot(&slope) {
                break Some((pose, value, next));
            }
            length *= 0.4;
            if length < 1e-4 {
                break None;
            }
        };
        let Some((pose, value, next)) = found else {
            // At a kink: restart once from the gradient alone.
            self.over = self.inverse_hessian.is_some_and(|inverse| inverse == first);
            self.inverse_hessian = Some(first);
            self.slope = Some(slope);
            return;
        };
        self.over = self.value - value < GAIN;
        (self.pose, self.value) = (pose, value);
        let (step, change) = (direction * length, next - slope);
        let curvature = step.dot(&change);
        if curvature > 1e-12 {
            let rho = 1.0 / curvature;
            let left = Matrix6::identity() - step * change.transpose() * rho;
            inverse = left * inverse * left.transpose() + step * step.transpose() * rho;
        }
        self.inverse_hessian = Some(inverse);
        self.slope = Some(next);
    }
}
