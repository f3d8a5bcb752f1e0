//! Names of joints at their controllers: those of URDFs also within parts, and those that a robot file gives.

use super::SourceMap;
use crate::model::robot::Robot;
use indexmap::IndexMap;
use std::collections::BTreeMap;
use teachtree_base::error::InputError;
use teachtree_base::spelling::nearest;

/// Gives joints the names that they have at their controllers.
pub(super) fn rename_joints(
    robot: &mut Robot,
    names: IndexMap<String, String>,
    places: &SourceMap<'_>,
) -> Result<(), InputError> {
    for (joint, name) in names {
        let refuse = |message: String| places.error("joint_names", &joint, message);
        if robot.tree.dof(&joint).is_none() {
            let near = nearest(&joint, robot.tree.dofs.iter().map(|dof| dof.name.as_str()));
            let help = near.map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
            return Err(refuse(format!("is not a joint that moves by itself{help}")));
        }
        if name.trim().is_empty() {
            return Err(refuse("has an empty name, expected that of the joint at its controller".into()));
        }
        let same = robot.tree.dofs.iter().find(|dof| dof.name != joint && robot.controller_name(&dof.name) == name);
        if let Some(other) = same {
            return Err(refuse(format!("is called `{name}`, as `{}` is", other.name)));
        }
        robot.joint_names.insert(joint, name);
    }
    Ok(())
}

/// Leaves out names that several joints have, as those of two arms of one kind: they go by the names of their parts.
pub(super) fn keep_unique(names: &mut BTreeMap<String, String>) {
    let all: Vec<String> = names.values().cloned().collect();
    names.retain(|_, name| all.iter().filter(|other| *other == name).count() == 1);
}
