//! Controllers at 1 ms (the paper, section 3.1; gains are ours: docs/sources.md, Control).
//!
//! ```text
//! arm     τ = M (ω² e + 2 ζ ω ė + k_i ∫e) + F_c tanh(q̇_d / v_0) + F_v q̇_d + τ_g           PID with inertia and friction compensation
//! finger  τ = J_iᵀ [ K_p (x_d - x) + K_d (ẋ_d - ẋ) + f_d + K_f (f_d - f) ] + τ_g           impedance with force feedback
//! idle    τ = M_ii (ω² e - 2 ζ ω q̇) + τ_g
//! ```
//!
//! The integral stops where the torque is at its limit (anti-windup). Force feedback acts only in contact, on the low-passed force.
//! INVARIANT (limits last): all returned torques are finite and within the limits of the motors. Targets and measurements that are not numbers are ignored: the
//! joint keeps its position, the finger gives no torque, and the state of the controller does not change.

use crate::dynamics::motion::{DynamicsTerms, Motion};
use crate::kinematics::finger::FingerModel;
use crate::kinematics::joint_positions::JointPositions;
use crate::model::hand::HandModel;
use nalgebra::{DVector, Matrix3, Point3, Vector3};
use teachtree_description::tree::KinematicTree;

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
    /// K_f, without unit.
    pub force_feedback: f64,
    /// Cut-off of the measured force, Hz.
    pub force_hz: f64,
    /// The maximum force from a position error, N.
    pub pull: f64,
    /// The stiffness in the null space of a redundant finger, N m/rad.
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

/// The target of a fingertip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipTarget {
    /// The position of its center, reference frame, m.
    pub position: Point3<f64>,
    /// The velocity of its center, reference frame, m/s.
    pub velocity: Vector3<f64>,
    /// The commanded force, reference frame, N.
    pub force: Vector3<f64>,
    /// Joint positions that a redundant finger prefers.
    pub posture: JointPositions,
}

impl TipTarget {
    fn is_finite(&self) -> bool {
        let Self { position, velocity, force, posture } = self;
        [&position.coords, velocity, force].into_iter().all(is_finite) && posture.iter().all(|angle| angle.is_finite())
    }
}

fn is_finite(vector: &Vector3<f64>) -> bool {
    vector.iter().all(|part| part.is_finite())
}

/// The target of a finger.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FingerTarget {
    /// Impedance control.
    Tip(TipTarget),
    /// Joint control to these angles.
    Idle(JointPositions),
}

/// The controllers of an arm and a hand, with their state.
#[derive(Clone, Debug)]
pub struct Controller {
    gains: Gains,
    integral: DVector<f64>,
    felt: Vec<Vector3<f64>>,
    /// The part of the last command that exceeded the limits of the motors, N m or N.
    lacking: DVector<f64>,
}

impl Controller {
    /// Returns the controllers of a robot whose hand has `fingers` fingers.
    pub fn new(tree: &KinematicTree, fingers: usize, gains: Gains) -> Self {
        let none = DVector::zeros(tree.dofs.len());
        Self { gains, integral: none.clone(), felt: vec![Vector3::zeros(); fingers], lacking: none }
    }

    /// Returns the torque (N m) or force (N) by which the last command exceeded the limit of a motor.
    pub(crate) fn lacking(&self, dof: usize) -> f64 {
        self.lacking[dof].abs()
    }

    /// Returns the torques of this step. `arm` has the desired values and rates of the arm's degrees of freedom; `exerted` the measured forces of the
    /// fingertips, reference frame, N.
    #[allow(clippy::too_many_arguments, reason = "what a controller reads")]
    pub fn torques(
        &mut self,
        tree: &KinematicTree,
        hand: &HandModel,
        motion: &Motion,
        posture: &DynamicsTerms,
        arm: &[(f64, f64)],
        fingers: &[FingerTarget],
        exerted: &[Vector3<f64>],
        dt: f64,
    ) -> DVector<f64> {
        let gains = self.gains;
        let mut torques = posture.gravity.clone();
        self.move_arm(tree, &hand.arm, motion, posture, arm, dt, &mut torques);
        let share = 1.0 - (-std::f64::consts::TAU * gains.force_hz * dt).exp();
        for (index, (finger, target)) in hand.fingers.iter().zip(fingers).enumerate() {
            let measured = exerted.get(index).copied().unwrap_or_default();
            let felt = &mut self.felt[index];
            if is_finite(&measured) {
                *felt += (measured - *felt) * share;
            }
            match target {
                FingerTarget::Tip(target) if target.is_finite() => {
                    let (point, velocity, _) = posture.point(finger.tip_link, finger.tip_in_link);
                    let pull = gains.stiffness * (target.position - point);
                    let pull = pull * (gains.pull / pull.norm().max(1e-12)).min(1.0);
                    let mut force = pull + gains.damping * (target.velocity - velocity) + target.force;
                    if measured != Vector3::zeros() && target.force != Vector3::zeros() {
                        force += gains.force_feedback * (target.force - *felt);
                    }
                    // The force of each tip is limited.
                    let force = force * (finger.force / force.norm().max(1e-12)).min(1.0);
                    posture.add_wrench_within(tree, hand.palm, finger.tip_link, point, force, &mut torques);
                    if finger.dofs.len() > 3 {
                        self.hold_null_space(motion, posture, finger, &target.posture, &mut torques);
                    }
                }
                FingerTarget::Tip(_) => {}
                FingerTarget::Idle(angles) => {
                    for (&dof, angle) in finger.dofs.iter().zip(angles).filter(|(_, angle)| angle.is_finite()) {
                        let inertia = posture.mass[(dof, dof)];
                        torques[dof] += inertia
                            * (gains.arm_omega.powi(2) * (angle - motion.q[dof])
                                - 2.0 * gains.arm_zeta * gains.arm_omega * motion.rates[dof]);
                    }
                }
            }
        }
        let given = limited(tree, torques.clone());
        self.lacking = torques - &given;
        given
    }

    /// Adds the torques of the arm: the mass matrix times the accelerations of the PID law, and the friction compensation.
    #[allow(clippy::too_many_arguments, reason = "what a controller reads")]
    fn move_arm(
        &mut self,
        tree: &KinematicTree,
        dofs: &[usize],
        motion: &Motion,
        posture: &DynamicsTerms,
        arm: &[(f64, f64)],
        dt: f64,
        torques: &mut DVector<f64>,
    ) {
        let gains = self.gains;
        let mut errors = DVector::zeros(torques.len());
        let mut accelerations = DVector::zeros(torques.len());
        for (&dof, &(wanted, wanted_rate)) in dofs.iter().zip(arm) {
            let heard = wanted.is_finite() && wanted_rate.is_finite();
            let (wanted, wanted_rate) = if heard { (wanted, wanted_rate) } else { (motion.q[dof], 0.0) };
            errors[dof] = wanted - motion.q[dof];
            let rate_error = wanted_rate - motion.rates[dof];
            accelerations[dof] =
                gains.arm_omega.powi(2) * errors[dof] + 2.0 * gains.arm_zeta * gains.arm_omega * rate_error;
            let model = &tree.dofs[dof];
            torques[dof] += model.friction * (wanted_rate / 0.02).tanh() + model.damping * wanted_rate;
        }
        let integral = &self.integral + &errors * dt;
        let whole = &*torques + &posture.mass * (&accelerations + &integral * gains.arm_integral);
        // Anti-windup: the integral does not grow in the direction in which the motor is at its limit.
        for &dof in dofs {
            if whole[dof].abs() < tree.dofs[dof].torque || whole[dof].signum() != errors[dof].signum() {
                self.integral[dof] = integral[dof];
            }
        }
        let moving = &posture.mass * (accelerations + &self.integral * gains.arm_integral);
        for &dof in dofs {
            torques[dof] += moving[dof];
        }
    }

    /// Adds a weak spring and damper towards preferred angles, projected into the null space of the tip position.
    fn hold_null_space(
        &self,
        motion: &Motion,
        posture: &DynamicsTerms,
        finger: &FingerModel,
        preferred: &JointPositions,
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

/// Returns the torques within the limits of the motors; zero in place of values that are not numbers.
pub fn limited(tree: &KinematicTree, mut torques: DVector<f64>) -> DVector<f64> {
    for (torque, dof) in torques.iter_mut().zip(&tree.dofs) {
        *torque = if torque.is_finite() { torque.clamp(-dof.torque, dof.torque) } else { 0.0 };
    }
    torques
}

impl DynamicsTerms {
    /// Adds the torques of a finger for a force at its tip: `Jᵀ f` over the joints between the palm and the tip.
    fn add_wrench_within(
        &self,
        tree: &KinematicTree,
        palm: usize,
        link: usize,
        point: Point3<f64>,
        force: Vector3<f64>,
        to: &mut DVector<f64>,
    ) {
        let arm: Vec<usize> = tree.joints_above(palm).collect();
        let mut whole = DVector::zeros(to.len());
        self.add_wrench(tree, link, point, (force, Vector3::zeros()), &mut whole);
        for above in arm {
            if let Some(joint) = &tree.links[above].joint {
                whole[joint.dof] = 0.0;
            }
        }
        *to += whole;
    }
}
