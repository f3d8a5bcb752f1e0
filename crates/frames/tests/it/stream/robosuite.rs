//! The shipped recordings through their bindings: what the rules will see at the instants that are known from the contact events.

use super::{ask, ask_contact, ask_fingers, column};
use std::path::Path;
use teachtree_base::channels::Shape;
use teachtree_base::hands::Finger;
use teachtree_base::units::Dimension;
use teachtree_frames::OpenRequest;
use teachtree_frames::frames::Frames;
use teachtree_frames::open;

fn request(log: &str, binding: &str) -> OpenRequest {
    let [log, binding] = [format!("{log}.csv"), format!("{binding}.binding.yaml")]
        .map(|file| Path::new(crate::ROOT).join("demos/robosuite").join(file));
    OpenRequest { log, binding: Some(binding), ..OpenRequest::default() }
}

fn frames(log: &str, binding: &str) -> Frames {
    let opened = open(&request(log, binding)).unwrap();
    assert_eq!(opened.hand_file.as_deref(), Some("hand_flags.rules"));
    let names =
        ["target", "target.depth", "target.over_socket", "target.velocity", "contacts.force", "contacts.normal"];
    let mut channels: Vec<_> = names.map(ask).into();
    channels.extend([ask_contact(), ask_fingers("position", Shape::Vec3, Dimension::LENGTH)]);
    let frames = opened.frames(&channels).unwrap();
    assert_eq!(frames.issues, []);
    assert_eq!(frames.stretches.len(), 1);
    assert_eq!(frames.layout.hands[0].fingers, [Finger::Thumb, Finger::Index, Finger::Palm]);
    frames
}

/// The frame at a time, s.
fn at(frames: &Frames, time: f64) -> usize {
    frames.time.partition_point(|stamp| *stamp < time - 1e-9)
}

/// The first time from `from` on at which a column is above `limit`, s.
fn rises(frames: &Frames, values: &[f64], from: f64, limit: f64) -> f64 {
    let start = at(frames, from);
    frames.time[start + values[start..].iter().position(|value| *value > limit).unwrap()]
}

/// The first time from `from` on at which the target has no force from this body, s.
fn loses(frames: &Frames, body: &str, from: f64) -> f64 {
    let slot = frames.layout.hands[0].contacts.iter().position(|contact| contact == body).unwrap() as u32;
    let up = column(frames, "contacts.force", slot, 2);
    let start = at(frames, from);
    frames.time[start + up[start..].iter().position(|force| *force < 0.02).unwrap()]
}

fn near(found: f64, wanted: f64, tolerance: f64) {
    assert!((found - wanted).abs() <= tolerance, "found {found} s, expected {wanted} s within {tolerance} s");
}

#[test]
fn nuts_go_over_their_pegs() {
    let frames = frames("SawyerNutAssembly_demo_1", "sawyer_nut_assembly");
    assert_eq!(frames.objects, ["SquareNut0", "RoundNut0"]);
    assert_eq!(frames.layout.rate_hz, 100.0);
    let depth = column(&frames, "target.depth", 0, 0);
    near(rises(&frames, depth, 0.0, 0.002), 17.87, 0.02);
    near(rises(&frames, depth, 22.0, 0.002), 36.45, 0.02);
    near(loses(&frames, "env", 13.1), 13.37, 0.02);
    near(loses(&frames, "env", 29.15), 29.17, 0.02);
    let target = column(&frames, "target", 0, 0);
    assert!(target[..at(&frames, 18.93)].iter().all(|object| *object == 0.0));
    assert!(target[at(&frames, 25.0)..].iter().all(|object| *object == 1.0));
    // The round nut searches on the rim of its peg.
    let over = column(&frames, "target.over_socket", 0, 0);
    assert!(over[at(&frames, 35.16)..at(&frames, 36.3)].iter().all(|over| *over == 1.0));
    assert!(over[..at(&frames, 17.0)].iter().all(|over| *over == 0.0));
}

#[test]
fn fingers_touch_as_the_flags_say() {
    let frames = frames("SawyerNutAssembly_demo_1", "sawyer_nut_assembly");
    let [thumb, index] = [0, 1].map(|slot| column(&frames, "fingers.contact", slot, 0));
    let both = |time: f64| (thumb[at(&frames, time)], index[at(&frames, time)]);
    assert_eq!(both(10.0), (0.0, 1.0));
    assert_eq!(both(13.2), (1.0, 1.0));
    assert_eq!(both(18.5), (1.0, 1.0));
    assert_eq!(both(18.96), (0.0, 0.0));
}

#[test]
fn cubes_are_stacked() {
    for (log, binding, lifted, stacked) in
        [("SawyerStack_demo_1", "sawyer_stack", 9.18, 13.54), ("stack_panda_demo_1", "panda_stack", 9.352, 21.702)]
    {
        let frames = frames(log, binding);
        assert_eq!(frames.objects, ["cubeA", "cubeB"]);
        assert_eq!(frames.layout.hands[0].contacts, ["cubeA", "cubeB", "env"]);
        near(loses(&frames, "env", 9.0), lifted, 0.03);
        // The cube below pushes up, so it carries.
        let [force, normal] = ["contacts.force", "contacts.normal"].map(|name| column(&frames, name, 1, 2));
        let down = rises(&frames, force, 0.0, 0.05);
        near(down, stacked, 0.05);
        assert!(normal[at(&frames, down)] > 0.9);
        assert!(column(&frames, "target", 0, 0)[at(&frames, 9.0)..].iter().all(|object| *object == 0.0));
    }
}
