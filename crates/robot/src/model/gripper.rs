//! Jaws: a hand of two fingers with at most one degree of freedom each. The jaws slide along one line or turn. Each has its own motor, both share one, or one
//! jaw is fixed.
//!
//! One number describes the configuration of a gripper with one motor or two: the share `u` by which it is open, from 0 to 1. `u` is linear in the values of
//! its degrees of freedom. The positions of the tips follow from the kinematics of the jaws:
//!
//! ```text
//! opening(u) = |tip_other(u) - tip_thumb(u)| - radius_thumb - radius_other          between their fingertip balls
//! ```
//!
//! The opening of sliding jaws is linear in `u`; the opening of turning jaws is inverted by bisection.

use crate::kinematics::finger::{FingerModel, FingerPose};
use crate::kinematics::joint_positions::{JointPositions, MAX_DOFS};
use nalgebra::{Point3, Unit, Vector3};
use teachtree_base::hands::Finger;
use teachtree_description::shape::CollisionShape;
use teachtree_description::tree::Dof;

/// The tolerance for tips of sliding jaws that are off their common line, m.
const BESIDE_M: f64 = 1e-4;
/// The maximum angle between a pad's normal and the line to the other jaw, degrees: at each opening for sliding jaws, at the best opening for turning jaws.
const ASKEW_DEG: f64 = 1.0;
const ASKEW_TURNING_DEG: f64 = 30.0;
/// The maximum angle between the motion of a turning jaw's tip and its pad's normal at half opening, degrees.
const ACROSS_DEG: f64 = 60.0;
/// The minimum opening range of jaws, m.
const LEAST_M: f64 = 1e-4;
/// Number of shares at which turning jaws are tested.
const SAMPLES: usize = 32;
/// Number of bisections of a share, and the error of the opening at which they end, m.
const BISECTIONS: usize = 60;
const EXACT_M: f64 = 1e-12;

/// The jaws of a gripper.
#[derive(Clone, Debug)]
pub struct Jaws {
    /// The distance between the palm and the line of the half open tips, m.
    pub out: f64,
    /// The thumb and the other jaw.
    pub pair: [Jaw; 2],
    /// Whether one motor drives both jaws.
    pub geared: bool,
}

/// One of two jaws.
#[derive(Clone, Debug)]
pub struct Jaw {
    /// Its name.
    pub finger: Finger,
    /// Radius of its fingertip ball, m.
    pub radius: f64,
    /// The values of its degree of freedom when closed and open, m or rad; without meaning for a fixed jaw.
    value: [f64; 2],
    model: FingerModel,
}

/// The positions of the jaws, palm frame.
#[derive(Clone, Debug)]
pub struct JawStance {
    /// The direction from the thumb to the other jaw.
    pub along: Unit<Vector3<f64>>,
    /// The center of the thumb's ball, m.
    pub thumb: Point3<f64>,
    /// The point of the line of the tips that is nearest to the palm's origin, m.
    pub middle: Point3<f64>,
    /// The angle between each pad and the line to the other jaw, rad.
    pub askew: [f64; 2],
}

impl Jaw {
    /// Returns the value of its only degree of freedom at an opening share.
    pub fn angles(&self, share: f64) -> JointPositions {
        only(self.value[0] + (self.value[1] - self.value[0]) * share)
    }

    fn posture(&self, share: f64) -> FingerPose {
        self.model.posture(&self.angles(share))
    }

    /// Returns the derivative of its tip position along a direction by its degree of freedom, m per m or rad.
    fn lever(&self, share: f64, along: &Vector3<f64>) -> f64 {
        let jacobian = self.model.jacobian(&self.posture(share));
        jacobian.column_iter().map(|column| column.dot(along).abs()).sum()
    }
}

impl Jaws {
    /// Returns the jaws, if the hand has two fingers with at most one degree of freedom each. Limits the forces of these fingers to those of their motors
    /// (`dofs` of the robot).
    ///
    /// # Errors
    /// The finger that prevents a gripper, and the reason.
    pub(crate) fn of(
        fingers: &mut [FingerModel],
        palm: &[CollisionShape],
        dofs: &[Dof],
    ) -> Result<Option<Self>, (Finger, String)> {
        let slide = fingers.iter().all(FingerModel::slides);
        if let Some(third) = fingers.get(2).filter(|_| slide) {
            return Err((third.finger, "is a third finger that slides, expected the two jaws of a gripper".into()));
        }
        let simple = fingers.iter().all(|model| model.dofs.len() < 2);
        if fingers.len() != 2 || !simple || fingers.iter().all(|model| model.dofs.is_empty()) {
            return Ok(None);
        }
        let Some(thumb) = fingers.iter().position(|model| model.finger == Finger::Thumb) else {
            return Err((
                fingers[0].finger,
                "is a jaw without an opponent, expected one of the two to be `thumb`".into(),
            ));
        };
        let [thumb, other] = [&fingers[thumb], &fingers[1 - thumb]];
        let mut made = Self { out: 0.0, pair: [jaw(thumb)?, jaw(other)?], geared: false };
        let moved = |jaw: &Jaw| jaw.model.dofs.first().copied();
        let motors = [&made.pair[0], &made.pair[1]].map(moved);
        made.geared = motors[0] == motors[1] || motors.contains(&None);
        if motors[0] == motors[1] && made.pair[0].value != made.pair[1].value {
            return Err((other.finger, "opens while the thumb closes, and both are driven by one joint".into()));
        }
        if slide {
            made.check_sliding()?;
        } else {
            made.check_turning()?;
        }
        made.close()?;
        let middle = made.stance(0.5).middle;
        made.out = palm.iter().map(|solid| solid.distance(&middle)).fold(middle.coords.norm(), f64::min);
        for (index, force) in made.forces(dofs).into_iter().enumerate() {
            let pressing = fingers.iter_mut().filter(|model| model.finger == made.pair[index].finger);
            pressing.for_each(|model| model.force = model.force.min(force));
        }
        Ok(Some(made))
    }

    /// Refuses sliding jaws whose pads or tips are off the line on which the thumb slides.
    fn check_sliding(&self) -> Result<(), (Finger, String)> {
        let [closed, open] = [0.0, 1.0].map(|share| self.pair[0].posture(share));
        let along = (closed.tip - open.tip).normalize();
        for (jaw, inward) in self.pair.iter().zip([along, -along]) {
            let ends = [0.0, 1.0].map(|share| jaw.posture(share));
            let off = inward.angle(&ends[0].pad).to_degrees();
            if off > ASKEW_DEG {
                return Err((
                    jaw.finger,
                    format!("has a pad that faces {off:.0} degrees off the line to the other jaw"),
                ));
            }
            let beside = ends.map(|end| (end.tip - closed.tip).cross(&along).norm()).into_iter().fold(0.0, f64::max);
            if beside > BESIDE_M {
                return Err((jaw.finger, format!("slides {:.1} mm beside the line of the thumb", beside * 1e3)));
            }
        }
        Ok(())
    }

    /// Refuses turning jaws whose pads never face each other, or pass each other.
    fn check_turning(&self) -> Result<(), (Finger, String)> {
        let stances: Vec<JawStance> = (0..=SAMPLES).map(|at| self.stance(at as f64 / SAMPLES as f64)).collect();
        for (index, jaw) in self.pair.iter().enumerate() {
            let off = stances.iter().map(|stance| stance.askew[index].to_degrees()).fold(f64::INFINITY, f64::min);
            if off > ASKEW_TURNING_DEG {
                let message = format!("has a pad that faces {off:.0} degrees off the line to the other jaw");
                return Err((jaw.finger, message));
            }
            let [closed, half, open] = [0.0, 0.5, 1.0].map(|share| jaw.posture(share));
            let across = (closed.tip - open.tip).angle(&half.pad).to_degrees();
            if !jaw.model.dofs.is_empty() && across > ACROSS_DEG {
                return Err((
                    jaw.finger,
                    format!("closes {across:.0} degrees off the direction in which its pad faces"),
                ));
            }
        }
        Ok(())
    }

    /// Sets the closed position to the end of the decreasing opening, and refuses jaws that do not open.
    fn close(&mut self) -> Result<(), (Finger, String)> {
        let opening = |at: usize| self.opening(at as f64 / SAMPLES as f64);
        let closed = (0..=SAMPLES).min_by(|a, b| opening(*a).total_cmp(&opening(*b))).unwrap_or_default();
        let opens = (closed..SAMPLES).all(|at| opening(at) < opening(at + 1));
        if !opens || opening(SAMPLES) - opening(closed) < LEAST_M {
            return Err((self.pair[1].finger, "does not open against the thumb".into()));
        }
        if closed > 0 {
            self.close_at(closed as f64 / SAMPLES as f64);
        }
        // Turning pads that could penetrate each other are closed where they touch.
        if self.opening(0.0) < -LEAST_M {
            self.close_at(self.share(0.0));
        }
        Ok(())
    }

    /// Makes the current share the closed position.
    fn close_at(&mut self, share: f64) {
        for jaw in &mut self.pair {
            jaw.value[0] = jaw.angles(share)[0];
        }
    }

    /// Returns the maximum force of each jaw, N, at its longest lever. A motor of both jaws gives the sum; a fixed jaw has the force of the other jaw.
    fn forces(&self, dofs: &[Dof]) -> [f64; 2] {
        let share = |at: usize| at as f64 / SAMPLES as f64;
        let levers = |share: f64| {
            let along = self.stance(share).along;
            [&self.pair[0], &self.pair[1]].map(|jaw| jaw.lever(share, &along))
        };
        let torque = |index: usize| Some(dofs.get(*self.pair[index].model.dofs.first()?)?.torque);
        [0, 1].map(|index| {
            let force = |lever: [f64; 2]| match (self.geared, torque(index).or_else(|| torque(1 - index))) {
                (true, Some(torque)) => torque / (lever[0] + lever[1]),
                (false, Some(torque)) => torque / lever[index],
                (_, None) => f64::INFINITY,
            };
            (0..=SAMPLES).map(|at| force(levers(share(at)))).fold(f64::INFINITY, f64::min)
        })
    }

    /// Returns the motor effort of a jaw, N m or N, for a force, N, at an opening share.
    pub fn effort(&self, index: usize, share: f64, force: f64) -> f64 {
        let along = self.stance(share).along;
        let lever = |jaw: &Jaw| jaw.lever(share, &along);
        force * if self.geared { self.pair.iter().map(lever).sum::<f64>() } else { lever(&self.pair[index]) }
    }

    /// Returns the positions of the jaws at an opening share.
    pub fn stance(&self, share: f64) -> JawStance {
        let [thumb, other] = [&self.pair[0], &self.pair[1]].map(|jaw| jaw.posture(share));
        let along = Unit::try_new(other.tip - thumb.tip, 1e-9);
        // For coincident tips, the normal of the pad gives the direction.
        let along = along.unwrap_or_else(|| Unit::new_normalize(thumb.pad));
        let middle = thumb.tip - along.into_inner() * along.dot(&thumb.tip.coords);
        JawStance {
            askew: [thumb.pad.angle(&along), other.pad.angle(&-along.into_inner())],
            along,
            thumb: thumb.tip,
            middle,
        }
    }

    /// Returns the smallest and the largest opening between the fingertip balls, m.
    pub fn range(&self) -> [f64; 2] {
        [0.0, 1.0].map(|share| self.opening(share))
    }

    /// Returns the opening at a share, m.
    pub fn opening(&self, share: f64) -> f64 {
        let [thumb, other] = [&self.pair[0], &self.pair[1]];
        (other.posture(share).tip - thumb.posture(share).tip).norm() - thumb.radius - other.radius
    }

    /// Returns the share of an opening, m; outside 0 to 1 for an opening out of range.
    pub fn share(&self, opening: f64) -> f64 {
        let [closed, open] = self.range();
        let linear = (opening - closed) / (open - closed);
        if !(0.0..=1.0).contains(&linear) || (self.opening(linear) - opening).abs() < EXACT_M {
            return linear;
        }
        let [mut low, mut high] = [0.0, 1.0];
        for _ in 0..BISECTIONS {
            let middle = (low + high) / 2.0;
            if self.opening(middle) < opening {
                low = middle;
            } else {
                high = middle;
            }
        }
        (low + high) / 2.0
    }

    /// Returns the jaw of this name.
    pub fn jaw(&self, finger: Finger) -> Option<&Jaw> {
        self.pair.iter().find(|jaw| jaw.finger == finger)
    }

    /// Returns the name of the other jaw.
    pub fn opponent(&self, finger: Finger) -> Finger {
        if self.pair[0].finger == finger { self.pair[1].finger } else { self.pair[0].finger }
    }
}

/// Returns a finger as a jaw, which closes in the direction of its pad's normal.
fn jaw(model: &FingerModel) -> Result<Jaw, (Finger, String)> {
    let [low, high] = model.ranges.first().copied().unwrap_or_default();
    let [start, half, end] = [low, (low + high) / 2.0, high].map(|value| model.posture(&only(value)));
    let moved = end.tip - start.tip;
    if !model.dofs.is_empty() && moved.norm() < LEAST_M {
        return Err((model.finger, "does not move".into()));
    }
    let value = if moved.dot(&half.pad) > 0.0 { [high, low] } else { [low, high] };
    Ok(Jaw { finger: model.finger, radius: model.radius, value, model: model.clone() })
}

/// Returns the joint positions of a finger with one degree of freedom.
fn only(value: f64) -> JointPositions {
    let mut angles = [0.0; MAX_DOFS];
    angles[0] = value;
    angles
}
