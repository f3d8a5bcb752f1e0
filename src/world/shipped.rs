//! The scenes and operators in the binary, by name.

use super::operator::Operator;
use crate::base::error::InputError;
use crate::base::scene::Scene;
use crate::base::yaml;

/// Name, scene and operator of every shipped demonstration.
const SHIPPED: &[(&str, &str, &str)] =
    &[("paper_box", include_str!("../../scenes/paper_box.yaml"), include_str!("../../scenes/paper_box.operator.yaml"))];

/// The names of the shipped demonstrations: each is a scene and its operator.
pub fn names() -> impl Iterator<Item = &'static str> {
    SHIPPED.iter().map(|(name, ..)| *name)
}

/// The shipped scene of this name.
///
/// # Errors
/// No shipped scene has this name.
pub fn scene(name: &str) -> Result<Scene, InputError> {
    let (_, scene, _) = find(name)?;
    yaml::read(scene, &format!("scenes/{name}.yaml"))
}

/// The shipped operator of this name.
///
/// # Errors
/// No shipped operator has this name.
pub fn operator(name: &str) -> Result<Operator, InputError> {
    let (.., operator) = find(name)?;
    Operator::read(operator, &format!("scenes/{name}.operator.yaml"))
}

fn find(name: &str) -> Result<(&'static str, &'static str, &'static str), InputError> {
    SHIPPED.iter().copied().find(|(shipped, ..)| *shipped == name).ok_or_else(|| {
        let known: Vec<_> = names().map(|name| format!("`{name}`")).collect();
        InputError::new(name, "is no shipped scene").help(format!("shipped are {}", known.join(", ")))
    })
}
