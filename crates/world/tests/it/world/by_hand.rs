//! The virtual environment as a person works in it, driven by scripted inputs: tracked fingertips as of a device, and a palm that is led as by a pointer.

use super::person::{by_pointer, lead, pick_and_place, place_of, track};
use nalgebra::{Isometry3, Point3, Vector3};
use teachtree_world::{self as world, HandInput, MOST_FORCE_N, TeleopWorld};

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
