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

/// The names of the shipped demonstrations: each is a scene and its operator.
pub fn names() -> impl Iterator<Item = &'static str> {
    SHIPPED.iter().map(|(name, ..)| *name)
}

/// Name and texts of the shipped demonstrations: scene and operator.
pub fn texts() -> impl Iterator<Item = (&'static str, &'static str, &'static str)> {
    SHIPPED.iter().copied()
}

/// The shipped scene of this name.
///
/// # Errors
/// No shipped scene has this name.
pub fn scene(name: &str) -> Result<Scene, InputError> {
    let (_, scene, _) = find(name, "scene")?;
    yaml::read(scene, &format!("scenes/{name}.yaml"))
}

/// The shipped operator of this name.
///
/// # Errors
/// No shipped operator has this name.
pub fn operator(name: &str) -> Result<Operator, InputError> {
    let (.., operator) = find(name, "operator")?;
    Operator::read(operator, &format!("scenes/{name}.operator.yaml"))
}

fn find(name: &str, what: &str) -> Result<(&'static str, &'static str, &'static str), InputError> {
    SHIPPED.iter().copied().find(|(shipped, ..)| *shipped == name).ok_or_else(|| {
        let known: Vec<_> = names().map(|name| format!("`{name}`")).collect();
        InputError::new(name, format!("is no shipped {what}, and no file that ends in .yaml or .yml")).help(
            match nearest(name, names()) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("shipped are {}", known.join(", ")),
            },
        )
    })
}
