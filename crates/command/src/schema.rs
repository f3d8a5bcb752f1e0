//! The form of commands, schema `teachtree.commands/1`. Everything is SI; frames are named in each field.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::meaning::Meaning;

/// The name and version of the schema.
pub const SCHEMA: &str = "teachtree.commands/1";

/// What a robot is to do.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Commands {
    /// [`SCHEMA`].
    pub schema: String,
    /// The recording that they come from.
    pub log: String,
    /// Samples a second.
    pub rate_hz: f64,
    /// The robot whose hand the grasps are mapped to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot: Option<String>,
    /// Name of the scene.
    pub scene: String,
    /// The tasks in order of time.
    pub tasks: Vec<Task>,
}

/// One task of one hand.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Task {
    /// The hand.
    pub track: Side,
    /// Its name.
    pub task: String,
    /// The object that it is about.
    pub object: String,
    /// When the operator began, s of the recording.
    pub start_s: f64,
    /// When the operator was done, s of the recording.
    pub end_s: f64,
    /// How the object is touched, in order of time.
    pub grasps: Vec<GraspSpec>,
    /// What is to be done, one after the other.
    pub segments: Vec<Segment>,
    /// The other object whose hole this one goes into, if it does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub into: Option<HoleBody>,
    /// What the operator did that is not commanded.
    pub left_out: Vec<Omission>,
}

/// A body with a hole that may be elsewhere when the robot comes to it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HoleBody {
    /// Its name.
    pub body: String,
    /// Where it was when the operator's object was in its hole, reference frame: x y z in m, quaternion w x y z.
    pub pose: [f64; 7],
}

/// Contact points that are kept from one touch to the next release.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GraspSpec {
    /// One for each finger that touches.
    pub contacts: Vec<Contact>,
    /// Fingers that touch too briefly to take part.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub brief: Vec<Finger>,
    /// The robot's hand on them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mapped: Option<MappedGrasp>,
    /// Why the robot's hand cannot take hold there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub infeasible: Option<String>,
}

/// Where a finger touches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// The finger.
    pub finger: Finger,
    /// The mean contact point, frame of the object, m.
    pub point: [f64; 3],
    /// Unit normal out of the object there.
    pub normal: [f64; 3],
}

/// A robot's hand on the contacts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MappedGrasp {
    /// Pose of the robot's palm in the frame of the object: x y z in m, quaternion w x y z.
    pub object_from_palm: [f64; 7],
    /// Values of the hand's degrees of freedom, rad or m.
    pub joints: BTreeMap<String, f64>,
    /// In the first grasp of a hand that works beside the other one: the joints of its arm where it is to begin, rad or m.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub arm: BTreeMap<String, f64>,
    /// The criterion by which the grasp was chosen.
    #[serde(default, skip_serializing_if = "GraspCriterion::is_quality")]
    pub criterion: GraspCriterion,
    /// The geometric mean of the fingers' measures, times the margin of friction; of a gripper: freedom of the opening, how squarely the jaws stand, and the palm's
    /// room.
    pub measure: f64,
    /// The share by which the friction of fingertips may be smaller than assumed until the contacts do not hold, 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction_margin: Option<f64>,
    /// The same where the palm copies the demonstrated one; nothing where fingers would not reach.
    pub copied_measure: Option<f64>,
    /// How far the jaws of a gripper are open, m: from pad to pad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub opening: Option<f64>,
    /// How far fingertips open, m, where it is not as far as usual: beside the other hand there may be less room.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub opens: Option<f64>,
    /// Each finger's share.
    pub fingers: Vec<MappedFinger>,
}

impl MappedGrasp {
    /// Returns the margin of friction in percent, rounded down to 0 to 99: no grasp holds without friction.
    pub fn friction_margin_percent(&self) -> Option<f64> {
        self.friction_margin.map(|margin| (margin * 100.0).floor().clamp(0.0, 99.0))
    }
}

/// A finger of a robot's hand on its contact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MappedFinger {
    /// The finger.
    pub finger: Finger,
    /// Manipulability over the cube of its length; nothing for a jaw.
    pub manipulability: f64,
    /// Freedom from joint limits, 0 to 1.
    pub freedom: f64,
    /// The angle between the pad and the way into the surface, degrees.
    pub pad_angle_deg: f64,
    /// The alignment of the pad with the surface, 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub alignment: Option<f64>,
}

/// What makes a grasp of a hand good.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum GraspCriterion {
    /// Manipulability, freedom from joint limits, alignment of the pads, and the margin of friction.
    #[default]
    Quality,
    /// Manipulability and freedom from joint limits.
    Manipulability,
}

impl GraspCriterion {
    /// Whether it is the default.
    fn is_quality(&self) -> bool {
        *self == Self::Quality
    }
}

/// One primitive.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Segment {
    /// Its name.
    pub primitive: String,
    /// What the hand does in it.
    pub does: Meaning,
    /// When it begins after the beginning of the task's commands, s.
    pub start_s: f64,
    /// How long it takes, s.
    pub duration_s: f64,
    /// When the operator did it, s of the recording.
    #[serde(alias = "taught_start_s")]
    pub demonstrated_start_s: f64,
    /// When a way without the object is gone, where it is not gone while the other hand does what it did then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub precedence: Option<Precedence>,
    /// Index of the grasp that it leads to, has, or comes from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grasp: Option<usize>,
    /// Whether the object is touched in it.
    pub touching: bool,
    /// Desired poses of the object, reference frame: x y z in m, quaternion w x y z; one a sample.
    pub object: Vec<[f64; 7]>,
    /// The middle of the fingertips that take part, frame of the object, m; one a sample.
    pub hand: Vec<[f64; 3]>,
    /// The fingertips.
    pub tips: Vec<Tip>,
    /// What smoothing did.
    pub quality: Quality,
}

/// When a hand goes a way without the object, beside what the other hand does between its beginning and its end in the demonstration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Precedence {
    /// Before it: the other hand waits.
    First,
    /// After it: this hand waits, and then the other one.
    Last,
}

/// A fingertip through a segment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tip {
    /// The finger.
    pub finger: Finger,
    /// Center of the fingertip, frame of the object, m; one a sample.
    pub position: Vec<[f64; 3]>,
    /// Desired force on the object, frame of the object, N; one a sample, zero without contact.
    pub force: Vec<[f64; 3]>,
    /// Recorded force on the object in the object's frame, N. One vector per sample, zero without contact. Empty if forces were not measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub demonstrated_force: Vec<[f64; 3]>,
}

/// What smoothing did to a segment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quality {
    /// Largest jerk of object and fingertips as recorded, at the rate of the commands, m/s^3.
    pub jerk_before: f64,
    /// The same as commanded, m/s^3.
    pub jerk_after: f64,
    /// The farthest that the commanded object, the hand, and fingertips without contact are from where they were recorded, m.
    pub position_deviation: f64,
    /// The farthest that a fingertip in contact is from where it was recorded, m: it stays at its mean contact point, which the operator's did not.
    #[serde(default)]
    pub contact_deviation: f64,
    /// The farthest that a commanded force is from the recorded one, N.
    pub force_deviation: f64,
    /// How many samples of force were put into the cone.
    pub into_cone: usize,
}

/// Something that the operator did and the robot does not.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Omission {
    /// What.
    pub primitives: Vec<String>,
    /// From when, s of the recording.
    pub start_s: f64,
    /// Until when, s of the recording.
    pub end_s: f64,
    /// The reason: `aborted approach`, `failed try`, `dropped`, `pause`; `falls` for an object that does not land; ``moves `NAME` `` for an object
    /// that the task does not handle.
    pub why: String,
}
