//! Rejects commands that a robot cannot execute, before execution. `retarget` and `simulate` use the same checks.

use super::hand_planner::HandPlanner;
use super::schedule::{first_to_touch, groups, sides};
use crate::model::robot::Robot;
use nalgebra::Isometry3;
use std::collections::BTreeMap;
use teachtree_base::error::InputError;
use teachtree_base::scene::Scene;
use teachtree_command::{Commands, Task};

/// Rejects commands (with mapped grasps) that [`Commands::read`] or [`crate::simulation::run::simulate`] would reject at the start, with all
/// objects at their demonstrated poses.
///
/// # Errors
/// As the two functions.
pub fn validate(commands: &Commands, robot: &Robot, scene: &Scene) -> Result<(), InputError> {
    commands.check()?;
    let tasks = &commands.tasks;
    let all: Vec<usize> = (0..tasks.len()).collect();
    let mut places: BTreeMap<&str, Isometry3<f64>> =
        scene.bodies.iter().map(|(name, body)| (name.as_str(), body.pose())).collect();
    as_demonstrated(&mut places, tasks, &all);
    let mut hands = Vec::new();
    for side in sides(commands, robot)? {
        let limb = robot.limb(side)?;
        let place = |object: &str| places.get(object).copied();
        let (planner, _, target) = HandPlanner::begin(side, &limb, tasks, scene, &place)?;
        hands.push((planner, limb, target.palm));
    }
    for group in &groups(tasks) {
        as_demonstrated(&mut places, tasks, group);
        let place = |object: &str| places.get(object).copied();
        for (planner, limb, palm) in &mut hands {
            let plans = planner.plans(tasks, group, limb, *palm, &place, &mut |_, from_s| from_s)?;
            if let Some((_, last)) = plans.plans.last() {
                *palm = last.at(last.duration()).palm;
            }
        }
    }
    Ok(())
}

/// Sets the pose of each object of these tasks to its pose when the first of them touched it, if the scene contains the object.
fn as_demonstrated<'t>(places: &mut BTreeMap<&'t str, Isometry3<f64>>, tasks: &'t [Task], those: &[usize]) {
    for &number in those {
        let object = &tasks[number].object;
        let same = those.iter().map(|other| &tasks[*other]).filter(|task| task.object == *object);
        if let (Some(first), Some(place)) = (first_to_touch(same), places.get_mut(object.as_str())) {
            *place = first.grasp_pose();
        }
    }
}
