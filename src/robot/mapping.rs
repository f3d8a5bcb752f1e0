//! Commands mapped to a robot: for each grasp of each task, the palm pose and the finger angles of the hand that does it.
//!
//! One pose is chosen for a grasp and carried along its trajectory. Whatever stands about the object when it is taken and when it is let go is
//! in the way.

use super::arm::solve_arm_along;
use super::grasp::{Contact, Mapper, Obstacle, Wanted};
use super::hand::HandModel;
use super::tree::Robot;
use crate::base::error::InputError;
use crate::base::geometry::pose;
use crate::base::hands::{Finger, Side};
use crate::base::scene::{Role, Scene};
use crate::command::{self, Commands, MappedFinger, MappedGrasp, Task};
use nalgebra::{Isometry3, Point3, Vector3};
use std::collections::BTreeMap;

/// A taught pose goes a little into what carries the object: obstacles are lowered by this, m.
const SUNK_M: f64 = 0.001;
/// So many starts of the arm's inverse kinematics, with so many steps each, decide whether it reaches.
const REACH_STARTS: usize = 48;
const REACH_STEPS: usize = 100;
/// The arm must bring the palm to so many places on the way of the object after the first.
const BETWEEN: usize = 5;

/// Maps every grasp of commands; what cannot be held is noted with its reason.
///
/// # Errors
/// A hand that the robot does not have, an object that the scene does not have.
pub fn map(commands: &mut Commands, robot: &Robot, scene: &Scene) -> Result<(), InputError> {
    commands.robot = Some(robot.name.clone());
    for (number, task) in commands.tasks.iter_mut().enumerate() {
        let refuse = |message: String| InputError::new(format!("task {} ({})", number + 1, task.task), message);
        let side = Side::from_name(&task.track).ok_or_else(|| refuse(format!("is of no hand: `{}`", task.track)))?;
        let hand = robot
            .hands
            .get(&side)
            .ok_or_else(|| refuse(format!("is of the {side} hand, which robot `{}` does not have", robot.name)))?;
        let object = scene
            .bodies
            .get(&task.object)
            .ok_or_else(|| refuse(format!("is about `{}`, which is no body of the scene", task.object)))?;
        let mapper = Mapper::new(hand);
        for index in 0..task.grasps.len() {
            let obstacles = obstacles(task, index, scene);
            let ends = way(task, index);
            let contacts: Vec<Contact> = task.grasps[index].contacts.iter().filter_map(contact).collect();
            let reachable = |object_from_palm: &Isometry3<f64>| {
                let way: Vec<Isometry3<f64>> =
                    ends.iter().map(|world_from_object| world_from_object * object_from_palm).collect();
                hand.arm.is_empty() || {
                    let mut q = vec![0.0; robot.dofs.len()];
                    solve_arm_along(robot, hand, &Isometry3::identity(), &way, &mut q, REACH_STARTS, REACH_STEPS)
                }
            };
            let mut wanted = Wanted { contacts, object, obstacles };
            let mut mapped = mapper.map_where(&wanted, &reachable);
            // Which finger pushes where does not matter: the row may be taken the other way round.
            if mapped.is_err() && wanted.contacts.iter().all(|contact| contact.finger != Finger::Thumb) {
                let turned = Wanted { contacts: turned_round(&wanted.contacts), ..wanted.clone() };
                if let Ok(found) = mapper.map_where(&turned, &reachable) {
                    rename(task, index, &wanted.contacts, &turned.contacts);
                    (wanted, mapped) = (turned, Ok(found));
                }
            }
            let grasp = &mut task.grasps[index];
            match mapped {
                Ok(found) => {
                    let mut q = vec![0.0; robot.dofs.len()];
                    found.set(hand, &mut q);
                    grasp.mapped = Some(MappedGrasp {
                        object_from_palm: seven(&found.object_from_palm),
                        joints: joints(robot, hand, &q),
                        measure: found.measure,
                        copied_measure: mapper.copied(&wanted),
                        fingers: found
                            .fingers
                            .iter()
                            .map(|held| MappedFinger {
                                finger: held.finger.name().into(),
                                manipulability: held.manipulability,
                                freedom: held.freedom,
                                pad_angle_deg: held.pad_angle.to_degrees(),
                            })
                            .collect(),
                    });
                }
                Err(why) => grasp.infeasible = Some(why.to_string()),
            }
        }
    }
    Ok(())
}

fn contact(contact: &command::Contact) -> Option<Contact> {
    Some(Contact {
        finger: Finger::from_name(&contact.finger)?,
        point: Point3::from(contact.point),
        normal: Vector3::from(contact.normal),
    })
}

/// The same contacts with their fingers in the opposite order.
fn turned_round(contacts: &[Contact]) -> Vec<Contact> {
    let fingers = contacts.iter().rev().map(|contact| contact.finger);
    let mut turned: Vec<Contact> =
        contacts.iter().zip(fingers).map(|(contact, finger)| Contact { finger, ..*contact }).collect();
    turned.reverse();
    turned
}

/// Gives what a finger did in a grasp to the one that is at its contact now.
fn rename(task: &mut Task, grasp: usize, before: &[Contact], after: &[Contact]) {
    let now = |name: &str| {
        let point = before.iter().find(|contact| contact.finger.name() == name)?.point;
        after.iter().find(|contact| contact.point == point).map(|contact| contact.finger.name().to_string())
    };
    for contact in &mut task.grasps[grasp].contacts {
        contact.finger = now(&contact.finger).unwrap_or_else(|| contact.finger.clone());
    }
    for tip in task.segments.iter_mut().filter(|segment| segment.grasp == Some(grasp)).flat_map(|it| &mut it.tips) {
        tip.finger = now(&tip.finger).unwrap_or_else(|| tip.finger.clone());
    }
}

/// What is in the way of a grasp: the fixed bodies, seen from the object where it is taken and where it is let go, and the other objects where they
/// stood at the beginning, seen from where it is taken.
fn obstacles<'a>(task: &Task, grasp: usize, scene: &'a Scene) -> Vec<Obstacle<'a>> {
    let mut obstacles = Vec::new();
    let way = way(task, grasp);
    for (at, world_from_object) in way.first().into_iter().chain(way.last()).enumerate() {
        let others = scene.bodies.iter().filter(|(name, _)| **name != task.object);
        for (_, body) in others.filter(|(_, body)| at == 0 || body.role != Role::Object) {
            let mut world_from_obstacle = pose(body.position.map(|at| at.0), body.rotation);
            world_from_obstacle.translation.vector.z -= SUNK_M;
            let object_from_obstacle = world_from_object.inverse() * world_from_obstacle;
            obstacles.push(Obstacle { object_from_obstacle, body });
        }
    }
    obstacles
}

/// Where the object is taken, where it is let go, and some places between, in order; reference frame.
fn way(task: &Task, grasp: usize) -> Vec<Isometry3<f64>> {
    let held = task.segments.iter().filter(|segment| segment.touching && segment.grasp == Some(grasp));
    let poses: Vec<&[f64; 7]> = held.flat_map(|segment| &segment.object).collect();
    let Some(last) = poses.len().checked_sub(1) else { return Vec::new() };
    (0..=BETWEEN).map(|at| from_seven(poses[at * last / BETWEEN])).collect()
}

fn joints(robot: &Robot, hand: &HandModel, q: &[f64]) -> BTreeMap<String, f64> {
    let dofs = hand.fingers.iter().flat_map(|finger| &finger.dofs);
    dofs.map(|&dof| (robot.dofs[dof].name.clone(), q[dof])).collect()
}

/// A pose as x y z and quaternion w x y z.
pub(super) fn seven(pose: &Isometry3<f64>) -> [f64; 7] {
    let (at, turn) = (pose.translation.vector, pose.rotation);
    [at.x, at.y, at.z, turn.w, turn.i, turn.j, turn.k]
}

/// The pose that [`seven`] writes.
pub(super) fn from_seven([x, y, z, a, b, c, d]: &[f64; 7]) -> Isometry3<f64> {
    pose([*x, *y, *z], [*a, *b, *c, *d])
}
