//! Arms that a binding names, `model: so101`: links and joints, the ranges of their motors, and the parts of their tools.

use super::lerobot_motors::Motor;
use serde::Deserialize;

/// An arm that comes with the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ArmModel {
    /// The follower arm of LeRobot, with its gripper.
    So101,
    /// Franka's arm with the Franka Hand.
    Panda,
    /// Trossen's ViperX 300 with six joints and its gripper, the follower arm of ALOHA.
    Vx300s,
}

/// The parts of an arm that a hand of a binding consists of.
#[derive(Debug)]
pub struct Tool {
    /// The link of the palm.
    pub palm: &'static str,
    /// The links in the middle of the pads: thumb and index.
    pub pads: [&'static str; 2],
    /// The joint of the gripper.
    pub gripper: &'static str,
    /// The distance of the pads when the gripper is shut, m.
    pub shut: f64,
}

/// Name and text of the URDFs of the models.
pub const URDFS: [(&str, &str); 3] = [
    ("so101.urdf", include_str!("../../../../robots/so101.urdf")),
    ("panda.urdf", include_str!("../../../../robots/panda.urdf")),
    ("vx300s.urdf", include_str!("../../../../robots/vx300s.urdf")),
];

/// The motors of an SO-101: ranges as published for its zero in the middle; that of the wrist is a whole turn, as LeRobot calibrates it.
const SO101: &[Motor] = &[
    Motor::of_arm("shoulder_pan", [-110.0, 110.0]),
    Motor::of_arm("shoulder_lift", [-100.0, 100.0]),
    Motor::of_arm("elbow_flex", [-96.83, 96.83]),
    Motor::of_arm("wrist_flex", [-95.0, 95.0]),
    Motor::of_arm("wrist_roll", [-180.0, 180.0]),
    Motor::of_gripper("gripper", [-10.0, 100.0]),
];

impl ArmModel {
    /// The name in a binding.
    pub const fn name(self) -> &'static str {
        match self {
            Self::So101 => "so101",
            Self::Panda => "panda",
            Self::Vx300s => "vx300s",
        }
    }

    /// The text of the URDF with its links and joints.
    pub const fn urdf(self) -> &'static str {
        match self {
            Self::So101 => URDFS[0].1,
            Self::Panda => URDFS[1].1,
            Self::Vx300s => URDFS[2].1,
        }
    }

    /// The motors whose numbers LeRobot normalizes; empty if the joints are logged in rad.
    pub const fn motors(self) -> &'static [Motor] {
        match self {
            Self::So101 => SO101,
            Self::Panda | Self::Vx300s => &[],
        }
    }

    /// The columns of the joints in data sets of LeRobot; `None` without a usual name.
    pub const fn columns(self) -> Option<&'static str> {
        match self {
            Self::So101 => Some("observation.state.<joint>.pos"),
            Self::Panda | Self::Vx300s => None,
        }
    }

    /// Whether a joint is one of those that `<joint>` and `<index>` stand for: all of an SO-101, and those of the arm of others, whose fingers are
    /// rarely logged beside them.
    pub fn is_numbered(self, joint: &str) -> bool {
        self == Self::So101 || joint != self.tool().gripper
    }

    /// The parts of its tool.
    pub const fn tool(self) -> Tool {
        match self {
            Self::So101 => Tool {
                palm: "gripper_link",
                pads: ["fixed_jaw_pad", "moving_jaw_pad"],
                gripper: "gripper",
                shut: 0.0044,
            },
            Self::Panda => Tool {
                palm: "panda_hand",
                pads: ["panda_left_pad", "panda_right_pad"],
                gripper: "panda_finger_joint1",
                shut: 0.0,
            },
            Self::Vx300s => {
                Tool { palm: "gripper_link", pads: ["left_pad", "right_pad"], gripper: "left_finger", shut: 0.0 }
            }
        }
    }
}
