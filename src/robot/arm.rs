//! The arm's inverse kinematics: the palm to a pose, and along a way.

use super::hand::HandModel;
use super::tree::Robot;
use nalgebra::{Isometry3, Matrix6, Point3, Vector6};

/// Damps the steps where the arm is nearly singular; no joint goes farther in one step, rad or m.
const DAMPING: f64 = 1e-5;
const STEP: f64 = 0.2;

/// Brings the palm to a pose by damped least squares from the present values, moving the arm alone; what is missing at the end, m and rad.
pub fn solve_arm(
    robot: &Robot,
    hand: &HandModel,
    root: &Isometry3<f64>,
    palm: &Isometry3<f64>,
    q: &mut [f64],
    iterations: usize,
) -> (f64, f64) {
    let root_from_palm = root.inverse() * palm;
    let mut missing = (f64::INFINITY, f64::INFINITY);
    for _ in 0..=iterations {
        let poses = robot.forward(q);
        let pose = poses[hand.palm];
        let way = root_from_palm.translation.vector - pose.translation.vector;
        let turn = (root_from_palm.rotation * pose.rotation.inverse()).scaled_axis();
        missing = (way.norm(), turn.norm());
        if missing.0 < 1e-7 && missing.1 < 1e-7 {
            break;
        }
        let jacobian =
            robot.jacobian(&poses, hand.palm, Point3::from(pose.translation.vector)).select_columns(&hand.arm);
        let square = &jacobian * jacobian.transpose() + Matrix6::identity() * DAMPING;
        let Some(inverse) = square.try_inverse() else { break };
        let error = Vector6::new(way.x, way.y, way.z, turn.x, turn.y, turn.z);
        let step = jacobian.transpose() * (inverse * error);
        for (&dof, change) in hand.arm.iter().zip(step.iter()) {
            q[dof] = robot.dofs[dof].clamp(q[dof] + change.clamp(-STEP, STEP));
        }
    }
    missing
}

/// Values of the arm with which it can bring the palm along a whole way, from several starts that are the same ones each time; of those that can,
/// the ones that stay farthest from the limits. Whether there are any.
pub fn solve_arm_along(
    robot: &Robot,
    hand: &HandModel,
    root: &Isometry3<f64>,
    way: &[Isometry3<f64>],
    q: &mut [f64],
    starts: usize,
    iterations: usize,
) -> bool {
    /// What may be missing, m and rad: a joint that just comes to its limit is no reason not to go.
    const REACHED: (f64, f64) = (1e-3, 1e-2);
    /// Irrational steps spread the starts evenly.
    const STEPS: [f64; 6] = [0.618_034, 0.754_878, 0.569_840, 0.430_160, 0.819_173, 0.671_044];
    /// From one pose of the way to the next, so many iterations.
    const FOLLOWING: usize = 12;
    let mut best: Option<(f64, Vec<f64>)> = None;
    for index in 0..starts {
        let mut tried = q.to_vec();
        for (place, &dof) in hand.arm.iter().enumerate() {
            let [low, high] = robot.dofs[dof].range;
            let share = ((index * 7 + 3) as f64 * STEPS[place % STEPS.len()]).fract();
            tried[dof] = low + (0.15 + 0.7 * share) * (high - low);
        }
        let off_middle = |tried: &[f64]| {
            let off = hand.arm.iter().map(|&dof| {
                let [low, high] = robot.dofs[dof].range;
                ((2.0 * tried[dof] - low - high) / (high - low)).abs()
            });
            off.fold(0.0, f64::max)
        };
        let (mut worst, mut first) = (0.0_f64, None);
        let reaches = way.iter().enumerate().all(|(at, palm)| {
            let steps = if at == 0 { iterations } else { FOLLOWING };
            let missing = solve_arm(robot, hand, root, palm, &mut tried, steps);
            worst = worst.max(off_middle(&tried));
            first.get_or_insert_with(|| tried.clone());
            missing.0 <= REACHED.0 && missing.1 <= REACHED.1
        });
        if let (true, Some(first)) = (reaches, first)
            && best.as_ref().is_none_or(|(other, _)| worst < *other)
        {
            best = Some((worst, first));
        }
    }
    let Some((_, found)) = best else { return false };
    q.copy_from_slice(&found);
    true
}
