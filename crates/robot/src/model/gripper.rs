//! Parallel jaws: a hand of two fingers that slide to and from each other on one line, each by its own motor or both by one.
//!
//! Everything about them is known in closed form. With `u`, the share by which they are opened, 0 to 1, and places on the line counted from the thumb to
//! the other jaw,
//!
//! ```text
//! tip_i(u)   = closed_i + (open_i - closed_i) u
//! opening(u) = tip_other(u) - tip_thumb(u) - radius_thumb - radius_other          between their fingertip balls
//! ```
//!
//! so that one number says how the gripper stands, whether it has one degree of freedom or two.

use crate::kinematics::finger::FingerModel;
use crate::kinematics::joint_positions::{JointPositions, MAX_DOFS};
use nalgebra::{Point3, Unit, Vector3};
use teachtree_base::hands::Finger;
use teachtree_description::shape::CollisionShape;
use teachtree_description::tree::Dof;

/// Tips may be this far beside one line, m, and pads may look this far off it, degrees.
const BESIDE_M: f64 = 1e-4;
const ASKEW_DEG: f64 = 1.0;
/// Jaws that open by less do not open, m.
const LEAST_M: f64 = 1e-4;

/// What makes a hand a gripper.
#[derive(Clone, Debug, PartialEq)]
pub struct Jaws {
    /// From the thumb to the other jaw, palm frame.
    pub along: Unit<Vector3<f64>>,
    /// The line of the tips' centres goes through this point, the nearest to the palm's origin; palm frame, m.
    pub middle: Point3<f64>,
    /// How far that line is out of the palm, m.
    pub out: f64,
    /// The thumb and the other one.
    pub pair: [Jaw; 2],
    /// Whether one motor drives both.
    pub geared: bool,
}

/// One of two jaws.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jaw {
    /// Its name.
    pub finger: Finger,
    /// Radius of its fingertip ball, m.
    pub radius: f64,
    /// Where the centre of its ball is on the line when it is closed and when it is open, m.
    place: [f64; 2],
    /// The value of its degree of freedom then, m.
    value: [f64; 2],
}

impl Jaw {
    /// Where the centre of its ball is on the line, m from [`Jaws::middle`], when it is opened by a share.
    pub fn place(&self, share: f64) -> f64 {
        self.place[0] + (self.place[1] - self.place[0]) * share
    }

    /// Its angles, which is the value of its only degree of freedom, when it is opened by a share.
    pub fn angles(&self, share: f64) -> JointPositions {
        only(self.value[0] + (self.value[1] - self.value[0]) * share)
    }
}

impl Jaws {
    /// The jaws that fingers are, if all of them slide along one line each; what they can press with at most is then put into the fingers, as far as
    /// their motors (`dofs` of the robot) give it.
    ///
    /// # Errors
    /// The finger because of which sliding fingers are no gripper, and why.
    pub(crate) fn of(
        fingers: &mut [FingerModel],
        palm: &[CollisionShape],
        dofs: &[Dof],
    ) -> Result<Option<Self>, (Finger, String)> {
        if fingers.len() < 2 || !fingers.iter().all(FingerModel::slides) {
            return Ok(None);
        }
        if let Some(third) = fingers.get(2) {
            return Err((third.finger, "is a third finger that slides, expected the two jaws of a gripper".into()));
        }
        let Some(thumb) = fingers.iter().position(|model| model.finger == Finger::Thumb) else {
            return Err((
                fingers[0].finger,
                "is a jaw without an opponent, expected one of the two to be `thumb`".into(),
            ));
        };
        let [thumb, other] = [&fingers[thumb], &fingers[1 - thumb]];
        let ends = |model: &FingerModel| model.ranges[0].map(|value| model.posture(&only(value)));
        let [start, end] = ends(thumb);
        let way = end.tip - start.tip;
        let along = Unit::try_new(way * way.dot(&start.pad).signum(), LEAST_M)
            .ok_or_else(|| (thumb.finger, "does not move".to_string()))?;
        let middle = start.tip - along.into_inner() * along.dot(&start.tip.coords);
        let jaw = |model: &FingerModel, inward: Vector3<f64>| {
            let refuse = |message: String| Err((model.finger, message));
            let [start, end] = ends(model);
            let off = inward.angle(&start.pad).to_degrees();
            if off > ASKEW_DEG {
                return refuse(format!("has a pad that looks {off:.0} degrees off the line to the other jaw"));
            }
            let beside = |tip: Point3<f64>| (tip - middle).cross(&along).norm();
            let beside = beside(start.tip).max(beside(end.tip));
            if beside > BESIDE_M {
                return refuse(format!("slides {:.1} mm beside the line of the thumb", beside * 1e3));
            }
            let place = [start, end].map(|posture| along.dot(&(posture.tip - middle)));
            // It closes inward.
            let closes = (place[1] - place[0]) * inward.dot(&along) > 0.0;
            let order = |[low, high]: [f64; 2]| if closes { [high, low] } else { [low, high] };
            Ok(Jaw { finger: model.finger, radius: model.radius, place: order(place), value: order(model.ranges[0]) })
        };
        let pair = [jaw(thumb, along.into_inner())?, jaw(other, -along.into_inner())?];
        let geared = thumb.dofs[0] == other.dofs[0];
        let out = palm.iter().map(|solid| solid.distance(&middle)).fold(middle.coords.norm(), f64::min);
        let made = Self { along, middle, out, pair, geared };
        if geared && pair[0].value != pair[1].value {
            return Err((other.finger, "opens while the thumb closes, and both are driven by one joint".into()));
        }
        let [closed, open] = made.range();
        if open - closed < LEAST_M {
            return Err((other.finger, "does not open against the thumb".into()));
        }
        // What a motor gives is the sum of what it makes jaws press.
        let per_newton = pair.map(|jaw| ((jaw.place[1] - jaw.place[0]) / (jaw.value[1] - jaw.value[0])).abs());
        for model in fingers {
            let own = if pair[0].finger == model.finger { per_newton[0] } else { per_newton[1] };
            let all = if geared { per_newton[0] + per_newton[1] } else { own };
            model.force = model.force.min(dofs[model.dofs[0]].torque / all);
        }
        Ok(Some(made))
    }

    /// How far they are open when they are closed, and at most, m: between their fingertip balls.
    pub fn range(&self) -> [f64; 2] {
        [0.0, 1.0].map(|share| self.opening(share))
    }

    /// How far they are open at a share, m.
    pub fn opening(&self, share: f64) -> f64 {
        let [thumb, other] = &self.pair;
        other.place(share) - thumb.place(share) - thumb.radius - other.radius
    }

    /// The share at which they are open this far, m; not from 0 to 1 for what they cannot do.
    pub fn share(&self, opening: f64) -> f64 {
        let [closed, open] = self.range();
        (opening - closed) / (open - closed)
    }

    /// The jaw of this name.
    pub fn jaw(&self, finger: Finger) -> Option<&Jaw> {
        self.pair.iter().find(|jaw| jaw.finger == finger)
    }

    /// The name of the other jaw.
    pub fn opponent(&self, finger: Finger) -> Finger {
        if self.pair[0].finger == finger { self.pair[1].finger } else { self.pair[0].finger }
    }
}

/// The angles of a finger with one degree of freedom.
fn only(value: f64) -> JointPositions {
    let mut angles = [0.0; MAX_DOFS];
    angles[0] = value;
    angles
}
