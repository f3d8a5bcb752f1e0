//! The obstacles around an object when it is grasped and released, and which of them prevent a grasp.

use super::grasp_request::Obstacle;
use super::held_path::{FEW, held, way};
use nalgebra::Isometry3;
use teachtree_base::scene::{Body, Role, Scene};
use teachtree_command::Task;

/// Distance by which obstacles are lowered, m: a demonstrated pose penetrates the support of the object a little.
pub(super) const SUNK_M: f64 = 0.001;

/// Largest number of obstacles that are left out one at a time, since each requires a search.
const MANY: usize = 24;

/// An obstacle, with its name in messages; times are those of the recording.
pub(crate) struct NamedObstacle<'a> {
    pub(crate) obstacle: Obstacle<'a>,
    what: String,
    when: String,
}

/// Returns the obstacles of a grasp, in the frame of the object: the fixed bodies where it is grasped and released, the other objects at their initial poses where it
/// is grasped, and `others`, the other hand.
pub(crate) fn around<'a>(task: &Task, grasp: usize, scene: &'a Scene, others: &'a [Body]) -> Vec<NamedObstacle<'a>> {
    let mut around = Vec::new();
    let way = way(task, grasp, FEW);
    let [taken_s, let_go_s] = held(task, grasp).unwrap_or([task.start_s, task.end_s]);
    let ends = [(way.first(), "taken", taken_s), (way.last(), "let go", let_go_s)];
    for (at, (world_from_object, happens, when_s)) in ends.into_iter().enumerate() {
        let Some(world_from_object) = world_from_object else { continue };
        let others = scene.bodies.iter().filter(|(name, _)| **name != task.object);
        for (name, body) in others.filter(|(_, body)| at == 0 || body.role != Role::Object) {
            let mut world_from_obstacle = body.pose();
            world_from_obstacle.translation.vector.z -= SUNK_M;
            let object_from_obstacle = world_from_object.inverse() * world_from_obstacle;
            around.push(NamedObstacle {
                obstacle: Obstacle { object_from_obstacle, body },
                what: format!("`{name}`"),
                when: format!(" where `{}` is {happens}, at {when_s:.1} s", task.object),
            });
        }
    }
    around.extend(others.iter().map(|body| NamedObstacle {
        obstacle: Obstacle { object_from_obstacle: Isometry3::identity(), body },
        what: "the other hand".into(),
        when: String::new(),
    }));
    around
}

/// Returns the obstacles without which a grasp `can` be held: each one that alone makes the difference, else each body at all its poses, else all of them; `None` if
/// it cannot be held without any.
pub(crate) fn to_blame(around: &[NamedObstacle<'_>], can: &dyn Fn(Vec<Obstacle<'_>>) -> bool) -> Option<String> {
    let without = |left_out: &dyn Fn(&NamedObstacle<'_>) -> bool| {
        can(around.iter().filter(|it| !left_out(it)).map(|it| it.obstacle.clone()).collect())
    };
    if around.is_empty() || !without(&|_| true) {
        return None;
    }
    let each = |name: &dyn Fn(&NamedObstacle<'_>) -> String| {
        let mut names: Vec<String> = Vec::new();
        for it in around {
            if !names.contains(&name(it)) {
                names.push(name(it));
            }
        }
        names.retain(|this| without(&|it| name(it) == *this));
        names
    };
    if around.len() > MANY {
        return Some("the bodies around it".into());
    }
    let mut blamed = each(&|it| format!("{}{}", it.what, it.when));
    if blamed.is_empty() {
        blamed = each(&|it| it.what.clone());
    }
    Some(if blamed.is_empty() { "the bodies around it".into() } else { blamed.join(", or without ") })
}
