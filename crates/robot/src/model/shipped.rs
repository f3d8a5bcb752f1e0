//! The robots in the binary, by name.

/// Name and text of every shipped robot.
const SHIPPED: &[(&str, &str)] = &[
    ("gifu_hand_iii_right", include_str!("../../../../robots/gifu_hand_iii_right.yaml")),
    ("gifu_hand_iii_left", include_str!("../../../../robots/gifu_hand_iii_left.yaml")),
    ("arm_6dof", include_str!("../../../../robots/arm_6dof.yaml")),
    ("parallel_jaw", include_str!("../../../../robots/parallel_jaw.yaml")),
    ("arm_with_gripper", include_str!("../../../../robots/arm_with_gripper.yaml")),
    ("two_grippers", include_str!("../../../../robots/two_grippers.yaml")),
    ("both_hands", include_str!("../../../../robots/both_hands.yaml")),
];

/// The names of the shipped robots.
pub fn names() -> impl Iterator<Item = &'static str> {
    SHIPPED.iter().map(|(name, _)| *name)
}

/// Name and text of the shipped robots.
pub fn texts() -> impl Iterator<Item = (&'static str, &'static str)> {
    SHIPPED.iter().copied()
}

/// The text of a shipped robot.
pub(crate) fn text(name: &str) -> Option<&'static str> {
    SHIPPED.iter().find(|(shipped, _)| *shipped == name).map(|(_, text)| *text)
}
