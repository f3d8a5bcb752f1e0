//! Controllers at 1 ms (chapter, section 3.1; gains are ours, PAPER.md section 12).
//!
//! ```text
//! arm     τ = M_ii (ω² e + 2 ζ ω ė + k_i ∫e) + F_c tanh(q̇_d / v_0) + F_v q̇_d + τ_g        PID with friction compensation
//! finger  τ = J_iᵀ [ K_p (x_d - x) + K_d (ẋ_d - ẋ) + f_d + K_f (f_d - f) ] + τ_g           impedance with force feedback
//! idle    τ = M_ii (ω² e - 2 ζ ω q̇) + τ_g
//! ```
//!
//! The integral stops where the torque is at its limit (anti-windup). Force feedback acts only in contact, on the low-passed force.
//! INVARIANT (limits last): whatever leaves is finite and within the torques of the motors.

use super::dynamics::{Motion, Posture};
use super::hand::{Angles, HandModel};
use super::tree::Robot;
use nalgebra::{DVector, Isometry3, Matrix3, Point3, Vector3};

/// Gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    /// ω of the arm and of idle fingers, rad/s.
    pub arm_omega: f64,
    /// ζ of both.
    pub arm_zeta: f64,
    /// k_i of the arm, rad/s^3.
    pub arm_integral: f64,
    /// K_p of a fingertip, N/m.
    pub stiffness: f64,
    /// K_d, N s/m.
    pub damping: f64,
    /// K_f.
    pub force_feedback: f64,
    /// Cut-off of the measured force, Hz.
    pub force_hz: f64,
    /// A position error pulls with this force at most, N.
    pub pull: f64,
    /// What holds the null space of a redundant finger, N m/rad.
    pub posture: f64,
}

impl Default for Gains {
    fn default() -> Self {
        Self {
            arm_omega: 60.0,
            arm_zeta: 0.9,
            arm_integral: 20_000.0,
            stiffness: 400.0,
            damping: 8.0,
            force_feedback: 1.0,
            force_hz: 40.0,
            pull: 3.0,
            posture: 0.1,
        }
    }
}

/// What a fingertip is to do now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipTarget {
    /// Where its centre is to be, reference frame, m.
    pub position: Point3<f64>,
    /// Its velocity, m/s.
    pub velocity: Vector3<f64>,
    /// The force that it is to exert, N, reference frame.
    pub force: Vector3<f64>,
    /// Angles that a redundant finger prefers.
    pub posture: Angles,
}

/// What a finger is to do now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FingerTarget {
    /// Impedance control.
    Tip(TipTarget),
    /// It keeps these angles.
    Idle(Angles),
}

/// The controllers of an arm and a hand, with what they remember.
#[derive(Clone, Debug)]
pub struct Controller {
    gains: Gains,
    integral: DVector<f64>,
    felt: Vec<Vector3<f64>>,
}

impl Controller {
    /// Controllers of a robot whose hand has `fingers` fingers.
    pub fn new(robot: &Robot, fingers: usize, gains: Gains) -> Self {
        Self { gains, integral: DVector::zeros(robot.dofs.len()), felt: vec![Vector3::zeros(); fingers] }
    }

    /// The torques of this step. `arm` has the desired values and rates of the arm's degrees of freedom; `exerted` the forces that the
    /// fingertips exert as they are measured, N, reference frame.
    #[allow(clippy::too_many_arguments, reason = "what a controller reads")]
    pub fn torques(
        &mut self,
        robot: &Robot,
        hand: &HandModel,
        motion: &Motion,
        posture: &Posture,
        arm: &[(f64, f64)],
        fingers: &[FingerTarget],
        exerted: &[Vector3<f64>],
        dt: f64,
    ) -> DVector<f64> {
        let gains = self.gains;
        let mut torques = posture.gravity.clone();
        for (&dof, &(wanted, wanted_rate)) in hand.arm.iter().zip(arm) {
            let inertia = posture.mass[(dof, dof)];
            let (error, rate_error) = (wanted - motion.q[dof], wanted_rate - motion.rates[dof]);
            let model = &robot.dofs[dof];
            let friction = model.friction * (wanted_rate / 0.02).tanh() + model.damping * wanted_rate;
            let without = torques[dof]
                + inertia * (gains.arm_omega.powi(2) * error + 2.0 * gains.arm_zeta * gains.arm_omega * rate_error)
                + friction;
            let integral = self.integral[dof] + error * dt;
            let whole = without + inertia * gains.arm_integral * integral;
            // Anti-windup: no more is gathered in the direction in which the motor can do no more.
            if whole.abs() < model.torque || whole.signum() != error.signum() {
                self.integral[dof] = integral;
            }
            torques[dof] = without + inertia * gains.arm_integral * self.integral[dof];
        }
        let share = 1.0 - (-std::f64::consts::TAU * gains.force_hz * dt).exp();
        for (index, (finger, target)) in hand.fingers.iter().zip(fingers).enumerate() {
            let measured = exerted.get(index).copied().unwrap_or_default();
            let felt = &mut self.felt[index];
            *felt += (measured - *felt) * share;
            match target {
                FingerTarget::Tip(target) => {
                    let (point, velocity, _) = posture.point(finger.tip_link, finger.tip_in_link);
                    let pull = gains.stiffness * (target.position - point);
                    let pull = pull * (gains.pull / pull.norm().max(1e-12)).min(1.0);
                    let mut force = pull + gains.damping * (target.velocity - velocity) + target.force;
                    if measured != Vector3::zeros() && target.force != Vector3::zeros() {
                        force += gains.force_feedback * (target.force - *felt);
                    }
                    // No tip presses harder than it may.
                    let force = force * (finger.force / force.norm().max(1e-12)).min(1.0);
                    posture.add_wrench_within(robot, hand.palm, finger.tip_link, point, force, &mut torques);
                    if finger.dofs.len() > 3 {
                        self.hold_null_space(motion, posture, finger, &target.posture, &mut torques);
                    }
                }
                FingerTarget::Idle(angles) => {
                    for (&dof, angle) in finger.dofs.iter().zip(angles) {
                        let inertia = posture.mass[(dof, dof)];
                        torques[dof] += inertia
                            * (gains.arm_omega.powi(2) * (angle - motion.q[dof])
                                - 2.0 * gains.arm_zeta * gains.arm_omega * motion.rates[dof]);
                    }
                }
            }
        }
        limited(robot, torques)
    }

    /// A weak spring and damper towards preferred angles, in the motions that leave the tip where it is.
    fn hold_null_space(
        &self,
        motion: &Motion,
        posture: &Posture,
        finger: &super::hand::FingerModel,
        preferred: &Angles,
        torques: &mut DVector<f64>,
    ) {
        let angles = finger.angles(motion.q.as_slice());
        let jacobian = finger.jacobian(&finger.posture(&angles));
        let square: Matrix3<f64> = &jacobian * jacobian.transpose() + Matrix3::identity() * 1e-9;
        let Some(inverse) = square.try_inverse() else { return };
        let wanted = DVector::from_iterator(
            finger.dofs.len(),
            finger.dofs.iter().zip(preferred.iter().zip(&angles)).map(|(&dof, (to, at))| {
                let damping = 2.0 * (self.gains.posture * posture.mass[(dof, dof)]).sqrt();
                self.gains.posture * (to - at) - damping * motion.rates[dof]
            }),
        );
        let seen = inverse * (&jacobian * &wanted);
        let null = wanted - jacobian.transpose() * seen;
        for (&dof, torque) in finger.dofs.iter().zip(null.iter()) {
            torques[dof] += torque;
        }
    }
}

/// Torques that motors can give; what is not a number is none.
pub fn limited(robot: &Robot, mut torques: DVector<f64>) -> DVector<f64> {
    for (torque, dof) in torques.iter_mut().zip(&robot.dofs) {
        *torque = if torque.is_finite() { torque.clamp(-dof.torque, dof.torque) } else { 0.0 };
    }
    torques
}

impl Posture {
    /// What motors of a finger give for a force at its tip: `Jᵀ f` over the joints between the palm and the tip.
    fn add_wrench_within(
        &self,
        robot: &Robot,
        palm: usize,
        link: usize,
        point: Point3<f64>,
        force: Vector3<f64>,
        to: &mut DVector<f64>,
    ) {
        let arm: Vec<usize> = robot.joints_above(palm).collect();
        let mut whole = DVector::zeros(to.len());
        self.add_wrench(robot, link, point, (force, Vector3::zeros()), &mut whole);
        for above in arm {
            if let Some(joint) = &robot.links[above].joint {
                whole[joint.dof] = 0.0;
            }
        }
        *to += whole;
    }
}

/// Brings a link of an arm to a pose by damped least squares from the present values; what is missing at the end, m and rad.
pub fn solve_arm(
    robot: &Robot,
    hand: &HandModel,
    root: &Isometry3<f64>,
    palm: &Isometry3<f64>,
    q: &mut [f64],
    iterations: usize,
) -> (f64, f64) {
    let mut missing = (f64::INFINITY, f64::INFINITY);
    for _ in 0..=iterations {
        let mut pose = *root;
        let mut columns: Vec<(usize, Vector3<f64>, Vector3<f64>)> = Vec::with_capacity(hand.arm.len());
        let mut path: Vec<usize> =
            std::iter::successors(Some(hand.palm), |at| (*at != 0).then(|| robot.links[*at].parent)).collect();
        path.reverse();
        for link in path {
            let link = &robot.links[link];
            pose *= link.parent_from_joint;
            if let Some(joint) = &link.joint {
                columns.push((joint.dof, pose.rotation * joint.axis.into_inner(), pose.translation.vector));
                pose *= joint.motion(q[joint.dof]);
            }
        }
        let way = palm.translation.vector - pose.translation.vector;
        let turn = (palm.rotation * pose.rotation.inverse()).scaled_axis();
        missing = (way.norm(), turn.norm());
        if missing.0 < 1e-7 && missing.1 < 1e-7 {
            break;
        }
        let mut jacobian = nalgebra::Matrix6xX::<f64>::zeros(columns.len());
        for (index, (_, axis, origin)) in columns.iter().enumerate() {
            let linear = axis.cross(&(pose.translation.vector - origin));
            jacobian.fixed_view_mut::<3, 1>(0, index).copy_from(&linear);
            jacobian.fixed_view_mut::<3, 1>(3, index).copy_from(axis);
        }
        let square = &jacobian * jacobian.transpose() + nalgebra::Matrix6::identity() * 1e-5;
        let Some(inverse) = square.try_inverse() else { break };
        let error = nalgebra::Vector6::new(way.x, way.y, way.z, turn.x, turn.y, turn.z);
        let step = jacobian.transpose() * (inverse * error);
        for ((dof, ..), change) in columns.iter().zip(step.iter()) {
            q[*dof] = robot.dofs[*dof].clamp(q[*dof] + change.clamp(-0.2, 0.2));
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
    /// What may be missing, m and rad.
    const REACHED: (f64, f64) = (1e-4, 1e-3);
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
