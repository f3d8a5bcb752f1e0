//! The other hand as an obstacle: if both hold one object, the second hand takes the remaining room.

use super::held_path::held;
use crate::kinematics::finger::FingerModel;
use crate::kinematics::joint_positions::{JointPositions, MAX_DOFS};
use crate::model::hand::HandModel;
use crate::model::robot::Robot;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use teachtree_base::hands::Finger;
use teachtree_base::pose::{pose, pose_from_array};
use teachtree_base::quantity::Quantity;
use teachtree_base::scene::{Body, Part, Role, Shape};
use teachtree_command::Task;
use teachtree_description::shape::CollisionShape;

/// Shorter overlaps of two holds are ignored, s.
const TOGETHER_S: f64 = 0.05;

/// Returns the grasps of the other hand on the same object during a grasp of a task: indices of task and grasp.
pub(crate) fn meeting(tasks: &[Task], (number, grasp): (usize, usize)) -> Vec<(usize, usize)> {
    let task = &tasks[number];
    let Some([from_s, to_s]) = held(task, grasp) else { return Vec::new() };
    let same = tasks.iter().enumerate().filter(|(_, it)| it.track != task.track && it.object == task.object);
    let places = same.flat_map(|(other, it)| (0..it.grasps.len()).map(move |grasp| (other, grasp)));
    let meets = |&(other, grasp): &(usize, usize)| {
        held(&tasks[other], grasp).is_some_and(|[from, to]| from.max(from_s) + TOGETHER_S < to.min(to_s))
    };
    places.filter(meets).collect()
}

/// Returns the hands in the mapped ones of these grasps as bodies in the frame of the object.
pub(crate) fn bodies(tasks: &[Task], places: &[(usize, usize)], robot: &Robot) -> Vec<Body> {
    let body = |&(number, grasp): &(usize, usize)| {
        let task = &tasks[number];
        let hand = robot.hands.get(&task.track)?;
        let mapped = task.grasps.get(grasp)?.mapped.as_ref()?;
        let angles = |finger: &FingerModel| {
            let mut angles: JointPositions = [0.0; MAX_DOFS];
            for (angle, dof) in angles.iter_mut().zip(&finger.dofs) {
                *angle = mapped.joints.get(&robot.tree.dofs[*dof].name).copied().unwrap_or_default();
            }
            (finger.finger, angles)
        };
        let angles: Vec<(Finger, JointPositions)> = hand.fingers.iter().map(angles).collect();
        Some(body(hand, &pose_from_array(&mapped.object_from_palm), &angles))
    };
    places.iter().filter_map(body).collect()
}

/// Returns a hand with these finger angles as a body in the frame of the object.
pub(crate) fn body(hand: &HandModel, object_from_palm: &Isometry3<f64>, angles: &[(Finger, JointPositions)]) -> Body {
    let mut solids = hand.palm_solids.clone();
    for (finger, angles) in angles {
        let Some(model) = hand.finger(*finger) else { continue };
        solids.extend(model.solids(&model.posture(angles)).map(|(_, solid)| solid));
    }
    Body {
        role: Role::Wall,
        parts: solids.iter().flat_map(|solid| parts(&solid.moved(object_from_palm))).collect(),
        radius: None,
        mass: None,
        friction: 0.0,
        position: [Quantity(0.0); 3],
        rotation: [1.0, 0.0, 0.0, 0.0],
        sockets: Default::default(),
        plug: None,
        fixed_to: None,
    }
}

/// A capsule becomes a cylinder and two balls, and a piece of a mesh its bounding box.
fn parts(solid: &CollisionShape) -> Vec<Part> {
    let part = |shape: Shape, at: &Isometry3<f64>| Part {
        shape,
        at: [at.translation.x, at.translation.y, at.translation.z].map(Quantity),
        turned: [at.rotation.w, at.rotation.i, at.rotation.j, at.rotation.k],
    };
    match *solid {
        CollisionShape::Box(..) | CollisionShape::Piece(..) => {
            let (at, half) = solid.bounding_box();
            vec![part(Shape::Box([half.x, half.y, half.z].map(|half| Quantity(2.0 * half))), &at)]
        }
        CollisionShape::Capsule(from, to, radius) => {
            let ball =
                |at: Point3<f64>| part(Shape::Ball(Quantity(radius)), &pose([at.x, at.y, at.z], [1.0, 0.0, 0.0, 0.0]));
            let way = to - from;
            let Some(turn) = UnitQuaternion::rotation_between(&Vector3::z(), &way) else {
                return vec![ball(from), ball(to)];
            };
            let middle = Isometry3::from_parts(((from.coords + to.coords) / 2.0).into(), turn);
            vec![ball(from), part(Shape::Cylinder([Quantity(radius), Quantity(way.norm())]), &middle), ball(to)]
        }
    }
}
