//! What a person does in the virtual environment is found by `analyze`.

use super::person::{by_pointer, pick_and_place, place_of, track};
use crate::program::{all_said, teachtree_in};
use nalgebra::Vector3;
use teachtree_base::recording::Recording;
use teachtree_logs::read::formats;
use teachtree_world::TeleopWorld;

/// A complete pick and place by tracked fingertips, with a message at every n-th step.
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

/// What `analyze` finds in a recording that is written as `teach` writes it.
fn analyzed(recording: &Recording) -> String {
    let folder = tempfile::tempdir().unwrap();
    formats::write(recording, &folder.path().join("taught.csv")).unwrap();
    assert!(folder.path().join("taught.scene.yaml").is_file());
    all_said(&teachtree_in(folder.path(), &["analyze", "taught.csv"]))
}

fn assert_picked_and_placed(recording: &Recording, what: &str) {
    let said = analyzed(recording);
    assert_eq!(said.lines().filter(|line| line.starts_with("  pick_and_place box")).count(), 1, "{what}: {said}");
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
