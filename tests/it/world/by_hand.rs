//! The virtual environment as a person works in it, driven by scripted inputs: tracked fingertips as of a device, and a palm that is led as by a pointer.

use crate::program::{all_said, teachtree_in};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use teachtree_base::recording::Recording;
use teachtree_base::scene::Scene;
use teachtree_logs::read::formats;
use teachtree_world::{self as world, HandInput, MOST_FORCE_N, TeleopWorld};

fn pick_and_place() -> Scene {
    world::scene("pick_and_place").unwrap()
}

/// Where the box is.
fn place_of(work: &TeleopWorld, body: &str) -> Vector3<f64> {
    let index = work.scene().bodies.get_index_of(body).unwrap();
    work.observation().bodies[index].pose.translation.vector
}

/// Fingertips of a hand of three: the thumb in front of the middle, the others behind it, `open` from it.
fn tips(middle: Vector3<f64>, open: f64) -> HandInput {
    let tip = |x: f64, y: f64| Point3::from(middle + Vector3::new(x, y, 0.0));
    HandInput::Tips { tips: vec![tip(0.0, -open), tip(-0.014, open), tip(0.014, open)], palm: None }
}

/// Sends the fingertips along a way in so many seconds, a message every `every` steps.
fn track(work: &mut TeleopWorld, every: usize, seconds: f64, from: (Vector3<f64>, f64), to: (Vector3<f64>, f64)) {
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

/// A whole pick and place by tracked fingertips, with a message every so many steps.
fn by_device(every: usize) -> Recording {
    let scene = pick_and_place();
    let mut work = TeleopWorld::new(&scene).unwrap();
    let grip = place_of(&work, "box") + Vector3::new(0.0, 0.0, 0.012);
    let up = Vector3::new(0.0, 0.0, 1.0);
    let goal = Vector3::new(0.11, 0.04, grip.z);
    let away = grip + Vector3::new(-0.05, -0.12, 0.2);
    // The hand comes to where it is tracked before the recording begins.
    track(&mut work, every, 1.2, (away, 0.06), (away, 0.06));
    work.start();
    // Into the box by 5 mm: the spring presses.
    let (open, closed) = (0.06, 0.030 + 0.010 - 0.005);
    for (seconds, from, to) in [
        (0.5, (away, open), (away, open)),
        (1.0, (away, open), (grip + up * 0.11, open)),
        (0.8, (grip + up * 0.11, open), (grip, open)),
        (0.6, (grip, open), (grip, closed)),
        (0.3, (grip, closed), (grip, closed)),
        (0.6, (grip, closed), (grip + up * 0.04, closed)),
        (1.2, (grip + up * 0.04, closed), (goal + up * 0.04, closed)),
        (0.8, (goal + up * 0.04, closed), (goal, closed)),
        (0.3, (goal, closed), (goal, closed)),
        (0.4, (goal, closed), (goal, open)),
        (0.8, (goal, open), (goal + up * 0.12, open)),
        (0.5, (goal + up * 0.12, open), (goal + up * 0.12, open)),
    ] {
        track(&mut work, every, seconds, from, to);
    }
    work.stop().unwrap().recording()
}

/// Leads the palm to a place as a pointer does that jumps there, and gives it time.
fn lead(work: &mut TeleopWorld, seconds: f64, at: Vector3<f64>, closes: bool) {
    let palm = Isometry3::from_parts(at.into(), UnitQuaternion::identity());
    for step in 0..(seconds * 1000.0) as usize {
        if step % 16 == 0 {
            assert!(work.set_input(0, HandInput::Palm { palm, closes, squeeze: 1.5, presses: false }));
        }
        work.step();
    }
}

/// A whole pick and place by a led palm: it is taken off its middle by `aside`, and set down onto the table although the pointer goes on below.
fn by_pointer(aside: f64) -> Recording {
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

/// What `analyze` finds in a recording that is written as `teach` writes it.
fn analyzed(recording: &Recording) -> String {
    let folder = tempfile::tempdir().unwrap();
    formats::write(recording, &folder.path().join("taught.csv")).unwrap();
    assert!(folder.path().join("taught.scene.yaml").is_file());
    all_said(&teachtree_in(folder.path(), &["analyze", "taught.csv"]))
}

fn assert_picked_and_placed(recording: &Recording, what: &str) {
    let said = analyzed(recording);
    assert_eq!(said.matches("pick_and_place box").count(), 1, "{what}: {said}");
    assert!(!said.contains("warning") && !said.contains("press"), "{what}: {said}");
    let truth: Vec<&str> = recording.labels["right.task"].iter().map(String::as_str).collect();
    assert!(truth.contains(&"pick_and_place"), "{what}");
}

#[test]
fn tracked_fingertips_pick_and_place() {
    for every in [1, 16] {
        assert_picked_and_placed(&by_device(every), &format!("a message every {every} ms"));
    }
}

#[test]
fn a_led_palm_picks_and_places_also_off_the_middle() {
    for aside in [0.0, 0.015, -0.02] {
        assert_picked_and_placed(&by_pointer(aside), &format!("{aside} m aside"));
    }
}

#[test]
fn the_recording_has_the_columns_of_teach() {
    let recording = by_pointer(0.0);
    let taught = world::teach(&pick_and_place(), &world::operator("pick_and_place").unwrap(), 1).unwrap();
    assert!(recording.columns.keys().eq(taught.columns.keys()));
    assert!(recording.labels.keys().eq(taught.labels.keys()));
    assert_eq!(recording.scene, taught.scene);
    assert!(recording.time.iter().enumerate().all(|(row, time)| *time == row as f64 / 1000.0));
}

#[test]
fn the_same_inputs_give_the_same_recording() {
    assert_eq!(by_pointer(0.0), by_pointer(0.0));
}

#[test]
fn undo_goes_back_to_before_the_last_touch_and_reset_to_the_beginning() {
    let scene = pick_and_place();
    let mut work = TeleopWorld::new(&scene).unwrap();
    let start = place_of(&work, "box");
    let grip = start + Vector3::new(0.0, 0.0, 0.112);
    let up = Vector3::new(0.0, 0.0, 1.0);
    work.start();
    lead(&mut work, 1.5, grip, false);
    lead(&mut work, 1.5, grip, true);
    lead(&mut work, 1.0, grip + up * 0.06, true);
    assert!(place_of(&work, "box").z > start.z + 0.04, "{}", place_of(&work, "box"));
    let held = work.recorded();
    work.undo();
    assert!((place_of(&work, "box") - start).norm() < 1e-4);
    let kept = work.recorded();
    assert!(work.is_recording() && kept < held, "{kept} of {held}");
    // The hand stays until it is asked anew, and then picks the box up once more: twice from the same state is the same.
    let once_more = |work: &mut TeleopWorld| {
        for _ in 0..200 {
            work.step();
        }
        lead(work, 1.5, grip, false);
        lead(work, 1.5, grip, true);
        lead(work, 1.0, grip + up * 0.06, true);
        place_of(work, "box")
    };
    let first = once_more(&mut work);
    assert!(first.z > start.z + 0.04);
    work.undo();
    assert_eq!(work.recorded(), kept);
    assert_eq!(once_more(&mut work), first);
    let recording = work.stop().unwrap().recording();
    assert!(recording.time.windows(2).all(|pair| (pair[1] - pair[0] - 0.001).abs() < 1e-9));
    work.start();
    work.reset();
    assert!(!work.is_recording() && work.stop().is_none());
    assert!((place_of(&work, "box") - start).norm() < 1e-4);
}

#[test]
fn forces_are_displayed_up_to_a_limit_and_not_to_a_device_that_is_silent() {
    let scene = pick_and_place();
    let mut work = TeleopWorld::new(&scene).unwrap();
    let grip = place_of(&work, "box") + Vector3::new(0.0, 0.0, 0.012);
    let most = |work: &TeleopWorld| work.displayed(0).iter().map(|force| force.norm()).fold(0.0, f64::max);
    track(&mut work, 1, 1.5, (grip + Vector3::new(0.0, 0.0, 0.15), 0.06), (grip, 0.06));
    assert_eq!(most(&work), 0.0);
    track(&mut work, 1, 0.5, (grip, 0.06), (grip, 0.035));
    // Each fingertip is a spring of 300 N/m in series with its contact of 1000 N/m, 5 mm inside. One against two moves the box by a third of that, up to
    // the friction of the base, 0.16 N; the thumb is pushed out, towards -y.
    let thumb = work.displayed(0)[0];
    let expected = -(0.005 + 0.005 / 3.0) * 300.0 * 1000.0 / 1300.0;
    assert!((thumb.y - expected).abs() < 0.16 && thumb.x.abs() < 0.05, "{thumb} {expected}");
    // Deep inside, no more than the limit.
    track(&mut work, 1, 1.0, (grip, 0.035), (grip, 0.018));
    assert!(most(&work) > 0.9 * MOST_FORCE_N && most(&work) <= MOST_FORCE_N + 1e-9, "{}", most(&work));
    // Nothing arrives any more: after 100 ms no force, and the fingertips are held where they are.
    for _ in 0..98 {
        work.step();
    }
    assert!(most(&work) > 0.0 && !work.is_silent(0));
    work.step();
    assert!(most(&work) == 0.0 && work.is_silent(0));
    let at = work.observation().hands[0].tips[0].position;
    for _ in 0..500 {
        work.step();
    }
    assert!((work.observation().hands[0].tips[0].position - at).norm() < 1e-3);
}

#[test]
fn what_cannot_be_meant_is_not_taken() {
    let mut work = TeleopWorld::new(&pick_and_place()).unwrap();
    let at = |x: f64| Point3::new(x, 0.0, 0.2);
    for tips in [
        vec![],
        vec![at(0.0); 2],
        vec![at(0.0); 4],
        vec![at(f64::NAN); 3],
        vec![at(f64::INFINITY); 3],
        vec![at(1e9); 3],
    ] {
        assert!(!work.set_input(0, HandInput::Tips { tips, palm: None }));
    }
    assert!(!work.set_input(1, HandInput::Tips { tips: vec![at(0.0); 3], palm: None }), "there is one hand");
    let palm = Isometry3::translation(f64::NAN, 0.0, 0.0);
    assert!(!work.set_input(0, HandInput::Palm { palm, closes: true, squeeze: 1.0, presses: false }));
    // A hand that is far from where it is tracked comes slowly, and never faster than a hand.
    let far = HandInput::Tips { tips: vec![at(4.0); 3], palm: None };
    let mut last = work.observation().hands[0].tips[0].position;
    for _ in 0..300 {
        assert!(work.set_input(0, far.clone()));
        work.step();
        let now = work.observation().hands[0].tips[0].position;
        assert!((now - last).norm() < 1e-3, "{}", (now - last).norm());
        last = now;
    }
}

#[test]
fn every_shipped_scene_can_be_worked_in_and_its_hands_start_free() {
    for name in world::shipped::names() {
        let scene = world::scene(name).unwrap();
        let mut work = TeleopWorld::new(&scene).unwrap_or_else(|error| panic!("{name}: {error}"));
        for _ in 0..100 {
            work.step();
        }
        let touches = work.observation().hands.iter().flat_map(|hand| &hand.tips).any(|tip| !tip.touches.is_empty());
        assert!(!touches, "{name}");
        assert_eq!(work.sides().count(), scene.hands.len());
    }
}
