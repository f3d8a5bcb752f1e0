//! The scenes and operators in the binary, by name.

use super::operator::Operator;
use teachtree_base::error::InputError;
use teachtree_base::scene::Scene;
use teachtree_base::spelling::nearest;
use teachtree_base::yaml;

macro_rules! shipped {
    ($($name:literal)*) => {
        &[$((
            $name,
            include_str!(concat!("../../../scenes/", $name, ".yaml")),
            include_str!(concat!("../../../scenes/", $name, ".operator.yaml")),
        )),*]
    };
}

/// Name, scene and operator of every shipped demonstration.
const SHIPPED: &[(&str, &str, &str)] = shipped! {
    "paper_box"
    "pick_and_place" "pick_and_follow" "pick_and_press" "stamp" "push" "push_and_trace" "slide"
    "peg_in_hole" "peg_in_hole_tight" "peg_pullout_from_hole" "turn_screw" "turn_knob"
    "ball" "several_tasks" "no_task"
    "hand_over_left_to_right" "hand_over_right_to_left" "equal_carry" "main_grasp" "ring_and_pole"
    "independent" "push_together" "follow_together" "hold_and_insert"
};

macro_rules! failing {
    ($($scene:literal: $($name:literal)*;)*) => {
        &[$($((
            $name,
            $scene,
            include_str!(concat!("../../../scenes/", $name, ".operator.yaml")),
        )),*),*]
    };
}

/// Name, scene and operator of every shipped operator that fails on purpose.
const FAILING: &[(&str, &str, &str)] = failing! {
    "peg_in_hole": "peg_in_hole_jam" "peg_in_hole_miss" "peg_in_hole_collision";
    "pick_and_place": "pick_and_place_slip" "pick_and_place_drop" "pick_and_place_miss";
    "pick_over_wall": "pick_over_wall_collision";
    "hold_and_insert": "hold_and_insert_jam";
    "hand_over_left_to_right": "hand_over_drop";
    "independent": "independent_slip" "independent_drop" "independent_miss";
};

/// Scenes that have only operators that fail on purpose.
const OTHER_SCENES: &[(&str, &str)] = &[("pick_over_wall", include_str!("../../../scenes/pick_over_wall.yaml"))];

/// The names of the shipped demonstrations: each is a scene and its operator.
pub fn names() -> impl Iterator<Item = &'static str> {
    SHIPPED.iter().map(|(name, ..)| *name)
}

/// Name and texts of the shipped demonstrations: scene and operator.
pub fn texts() -> impl Iterator<Item = (&'static str, &'static str, &'static str)> {
    SHIPPED.iter().copied()
}

/// The shipped operators that fail on purpose, each with its scene.
pub fn failing() -> impl Iterator<Item = (&'static str, &'static str)> {
    FAILING.iter().map(|(name, scene, _)| (*name, *scene))
}

/// Names and texts of all shipped scenes.
pub fn scenes() -> impl Iterator<Item = (&'static str, &'static str)> + Clone {
    SHIPPED.iter().map(|(name, scene, _)| (*name, *scene)).chain(OTHER_SCENES.iter().copied())
}

/// Names and texts of all shipped operators.
pub fn operators() -> impl Iterator<Item = (&'static str, &'static str)> + Clone {
    let failing = FAILING.iter().map(|(name, _, operator)| (*name, *operator));
    SHIPPED.iter().map(|(name, _, operator)| (*name, *operator)).chain(failing)
}

/// The shipped scene of this name.
///
/// # Errors
/// No shipped scene has this name.
pub fn scene(name: &str) -> Result<Scene, InputError> {
    yaml::read(find(scenes(), name, "scene")?, &format!("scenes/{name}.yaml"))
}

/// The shipped operator of this name.
///
/// # Errors
/// No shipped operator has this name.
pub fn operator(name: &str) -> Result<Operator, InputError> {
    Operator::read(find(operators(), name, "operator")?, &format!("scenes/{name}.operator.yaml"))
}

/// The text of this name among the texts of one kind.
fn find(
    mut texts: impl Iterator<Item = (&'static str, &'static str)> + Clone,
    name: &str,
    what: &str,
) -> Result<&'static str, InputError> {
    let names = texts.clone().map(|(name, _)| name);
    texts.find(|(shipped, _)| *shipped == name).map(|(_, text)| text).ok_or_else(|| {
        let known: Vec<_> = names.clone().map(|name| format!("`{name}`")).collect();
        InputError::new(name, format!("is neither a shipped {what} nor a file that ends in .yaml or .yml")).help(
            match nearest(name, names) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("shipped are {}", known.join(", ")),
            },
        )
    })
}
