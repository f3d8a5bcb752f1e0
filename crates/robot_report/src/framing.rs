//! What all pictures of a page show: moments in, the part of the view out that holds the hands with their wrists and what they handle.

use nalgebra::{Isometry3, Point3, Vector3};
use teachtree_base::scene::Role;
use teachtree_robot::simulation::trace::{Limb, Trace, TraceSample};
use teachtree_robot::{CollisionShape, Robot};

/// From where it is seen: from the far right and above.
const EYE: [f64; 3] = [0.62, 0.72, 0.50];
/// The width of a picture.
pub(super) const WIDTH: f64 = 300.0;
/// Its height lies between these.
const HEIGHT: [f64; 2] = [190.0, 300.0];
/// Room at each edge.
const EDGE: f64 = 8.0;
/// As much of an arm belongs to the picture, from the palm, m.
const ARM_M: f64 = 0.16;
/// A picture shows at most this much: what fell far away is not looked for, m.
const MOST_M: f64 = 1.3;
/// A picture shows at least this much, m.
const LEAST_M: f64 = 0.3;

/// A part of the view.
#[derive(Clone, Copy, Debug)]
pub(super) struct Framing {
    /// Height of a picture whose width is [`WIDTH`].
    pub height: f64,
    /// Units of a picture in a meter.
    pub scale: f64,
    /// What is in the middle: meters to the right and up from the origin.
    pub middle: [f64; 2],
}

/// The framing that holds, at all these moments, the hands of the robot with a piece of their arms, and the objects that they can reach.
pub(super) fn framing(trace: &Trace, moments: &[&TraceSample]) -> Framing {
    let mut held = Bounds::default();
    for moment in moments {
        for (limb, poses) in trace.limbs.iter().zip(poses(trace, moment)) {
            held = held.with(&of_hand(limb, &poses));
        }
    }
    for moment in moments {
        for (body, pose) in trace.scene.bodies.values().zip(&moment.bodies) {
            if matches!(body.role, Role::Object | Role::Socket) {
                let around = Bounds::default().around(&Point3::from(pose.translation.vector), body.bounding_radius());
                let both = held.with(&around);
                if both.across() <= MOST_M {
                    held = both;
                }
            }
        }
    }
    let [wide, high] = held.size().map(|size| size.max(LEAST_M));
    let room = WIDTH - 2.0 * EDGE;
    let scale = (room / wide).min((HEIGHT[1] - 2.0 * EDGE) / high);
    let height = (high * scale + 2.0 * EDGE).clamp(HEIGHT[0], HEIGHT[1]);
    Framing { height, scale, middle: held.middle() }
}

/// Where the links of every limb are.
pub(super) fn poses(trace: &Trace, moment: &TraceSample) -> Vec<Vec<Isometry3<f64>>> {
    let links = |(limb, stance): (&Limb, &teachtree_robot::simulation::trace::LimbPose)| {
        limb.robot.tree.forward_kinematics(&stance.q).into_iter().map(|link| stance.root * link).collect()
    };
    trace.limbs.iter().zip(&moment.stances).map(links).collect()
}

/// Whether a link is the palm or hangs at it.
pub(super) fn is_of_hand(robot: &Robot, palm: usize, link: usize) -> bool {
    let mut at = link;
    while at > palm {
        let Some(parent) = robot.tree.links.get(at).map(|link| link.parent) else { return false };
        if parent == at {
            return false;
        }
        at = parent;
    }
    at == palm
}

/// The bounds of a hand and of the piece of the arm before it.
fn of_hand(limb: &Limb, poses: &[Isometry3<f64>]) -> Bounds {
    let Some(hand) = limb.robot.hands.get(&limb.side) else { return Bounds::default() };
    let mut bounds = Bounds::default();
    let mut piece = Bounds::default();
    let Some(palm) = poses.get(hand.palm).map(|pose| Point3::from(pose.translation.vector)) else { return bounds };
    for (at, (link, pose)) in limb.robot.tree.links.iter().zip(poses).enumerate() {
        let own = is_of_hand(&limb.robot, hand.palm, at);
        for solid in &link.solids {
            for (corner, radius) in corners(solid, pose) {
                if own {
                    bounds = bounds.around(&corner, radius);
                } else if nalgebra::distance(&corner, &palm) < ARM_M {
                    piece = piece.around(&corner, radius);
                }
            }
        }
    }
    for finger in &hand.fingers {
        if let Some(pose) = poses.get(finger.tip_link) {
            bounds = bounds.around(&(pose * finger.tip_in_link), finger.radius);
        }
    }
    bounds.with(&piece)
}

/// Balls that hold a solid between them.
fn corners(solid: &CollisionShape, pose: &Isometry3<f64>) -> Vec<(Point3<f64>, f64)> {
    match solid {
        CollisionShape::Capsule(from, to, radius) => vec![(pose * from, *radius), (pose * to, *radius)],
        CollisionShape::Box(..) | CollisionShape::Piece(..) => {
            let (at, half) = solid.bounding_box();
            let signs =
                (0..8).map(|corner: u8| Vector3::from([0, 1, 2].map(|axis| f64::from(corner >> axis & 1) * 2.0 - 1.0)));
            signs.map(|sign| (pose * at * Point3::from(half.component_mul(&sign)), 0.0)).collect()
        }
    }
}

/// What lies between these, seen from the eye: to the right and up, m. Nothing at first.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    least: [f64; 2],
    greatest: [f64; 2],
}

impl Default for Bounds {
    fn default() -> Self {
        Self { least: [f64::INFINITY; 2], greatest: [f64::NEG_INFINITY; 2] }
    }
}

impl Bounds {
    fn around(self, point: &Point3<f64>, radius: f64) -> Self {
        let at = across(point);
        self.with(&Self { least: at.map(|at| at - radius), greatest: at.map(|at| at + radius) })
    }

    fn with(self, other: &Self) -> Self {
        Self {
            least: std::array::from_fn(|axis| self.least[axis].min(other.least[axis])),
            greatest: std::array::from_fn(|axis| self.greatest[axis].max(other.greatest[axis])),
        }
    }

    fn size(&self) -> [f64; 2] {
        std::array::from_fn(|axis| (self.greatest[axis] - self.least[axis]).max(0.0))
    }

    /// The longer edge.
    fn across(&self) -> f64 {
        let [wide, high] = self.size();
        wide.max(high)
    }

    fn middle(&self) -> [f64; 2] {
        std::array::from_fn(|axis| {
            let middle = (self.least[axis] + self.greatest[axis]) / 2.0;
            if middle.is_finite() { middle } else { 0.0 }
        })
    }
}

/// Returns the unit vectors to the right, up, and towards the eye, reference frame.
pub(super) fn axes() -> [Vector3<f64>; 3] {
    let eye = Vector3::from(EYE).normalize();
    let right = Vector3::z().cross(&eye).normalize();
    [right, eye.cross(&right), eye]
}

/// Returns how far a point is to the right of the origin and above it, seen from the eye, m.
pub(super) fn across(point: &Point3<f64>) -> [f64; 2] {
    let [right, up, _] = axes();
    [point.coords.dot(&right), point.coords.dot(&up)]
}
