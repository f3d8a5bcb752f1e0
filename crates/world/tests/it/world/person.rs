//! A person in the virtual environment: scripted fingertips as of a device, and a palm that is led as by a pointer.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use teachtree_base::recording::Recording;
use teachtree_base::scene::Scene;
use teachtree_world::{self as world, HandInput, TeleopWorld};

pub fn pick_and_place() -> Scene {
    world::scene("pick_and_place").unwrap()
}

/// Where the box is.
pub fn place_of(work: &TeleopWorld, body: &str) -> Vector3<f64> {
    let index = work.scene().bodies.get_index_of(body).unwrap();
    work.observation().bodies[index].pose.translation.vector
}

/// Fingertips of a hand of three: the thumb in front of the middle, the others after it, `open` from it.
pub fn tips(middle: Vector3<f64>, open: f64) -> HandInput {
    let tip = |x: f64, y: f64| Point3::from(middle + Vector3::new(x, y, 0.0));
    HandInput::Tips { tips: vec![tip(0.0, -open), tip(-0.014, open), tip(0.014, open)], palm: None }
}

/// Sends the fingertips along a path in the given time (s), with a message every `every` steps.
pub fn track(work: &mut TeleopWorld, every: usize, seconds: f64, from: (Vector3<f64>, f64), to: (Vector3<f64>, f64)) {
    let steps = (seconds * 1000.0) as usize;
    for step in 0..steps {
        if step % every == 0 {
            let share = step as f64 / steps as f64;
            let eased = share * share * (3.0 - 2.0 * share);
            assert!(work.set_input(0, tips(from.0.lerp(&to.0, eased), from.1 + (to.1 - from.1) * eased)));
        }
        work.step();
    }
}

/// Leads the palm to a place as a pointer does that jumps there, and gives it time.
pub fn lead(work: &mut TeleopWorld, seconds: f64, at: Vector3<f64>, closes: bool) {
    let palm = Isometry3::from_parts(at.into(), UnitQuaternion::identity());
    for step in 0..(seconds * 1000.0) as usize {
        if step % 16 == 0 {
            assert!(work.set_input(0, HandInput::Palm { palm, closes, squeeze: 1.5, presses: false }));
        }
        work.step();
    }
}

/// A whole pick and place by a led palm: it is taken off its middle by `aside`, and set down onto the table although the pointer moves farther down.
pub fn by_pointer(aside: f64) -> Recording {
    let scene = pick_and_place();
    let mut work = TeleopWorld::new(&scene).unwrap();
    work.start();
    let grip = place_of(&work, "box") + Vector3::new(0.0, aside, 0.112);
    let goal = Vector3::new(0.12, 0.02, grip.z);
    let up = Vector3::new(0.0, 0.0, 1.0);
    let start = work.palm(0).unwrap().translation.vector;
    lead(&mut work, 0.5, start, false);
    lead(&mut work, 1.2, grip + up * 0.1, false);
    lead(&mut work, 1.0, grip, false);
    lead(&mut work, 1.5, grip, true);
    lead(&mut work, 0.8, grip + up * 0.06, true);
    lead(&mut work, 1.2, goal + up * 0.06, true);
    lead(&mut work, 1.2, goal - up * 0.03, true);
    let at = work.palm(0).unwrap().translation.vector;
    lead(&mut work, 0.8, at, false);
    lead(&mut work, 1.0, at + up * 0.12, false);
    work.stop().unwrap().recording()
}
