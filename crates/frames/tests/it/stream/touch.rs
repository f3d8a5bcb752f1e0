//! Contacts that the log does not have, or has as flags only: shapes, poses and forces tell.

use super::{ask, ask_contact, ask_fingers, column};
use crate::shared::recordings::recording;
use teachtree_base::channels::Shape;
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;
use teachtree_base::units::Dimension;
use teachtree_frames::frames;
use teachtree_frames::frames::Frames;

/// A function of time.
type Signal<'a> = &'a dyn Fn(f64) -> f64;

/// What the target of the right hand feels of a body.
struct ContactFrames {
    frames: Frames,
    slot: u32,
}

impl ContactFrames {
    fn of(recording: &Recording, body: &str) -> Self {
        let channels = [ask("contacts.force"), ask("contacts.normal"), ask("target"), ask_contact()];
        let frames = frames(recording, &channels).unwrap();
        let slot = frames.layout.hand(Side::Right).unwrap().contacts.iter().position(|name| name == body).unwrap();
        Self { frames, slot: slot as u32 }
    }

    fn at(&self, channel: &str, time: f64) -> [f64; 3] {
        let frame = (time * self.frames.layout.rate_hz).round() as usize;
        [0, 1, 2].map(|axis| column(&self.frames, channel, self.slot, axis)[frame])
    }

    /// The first time of a force, s.
    fn begins(&self) -> f64 {
        let force = [0, 1, 2].map(|axis| column(&self.frames, "contacts.force", self.slot, axis));
        let loaded = |frame: &usize| force.iter().any(|axis| axis[*frame] != 0.0);
        self.frames.time[(0..self.frames.len).find(loaded).unwrap()]
    }
}

fn near(found: f64, wanted: f64, tolerance: f64) {
    assert!((found - wanted).abs() <= tolerance, "found {found}, expected {wanted} within {tolerance}");
}

/// An object over a base whose upper face is z = 0; `position` and `turned` (about x, rad) over time, thumb and index with opposite forces
/// along x and half of `up` each.
fn over_base(object: &str, position: [Signal; 3], turned: f64, squeeze: Signal, up: Signal) -> Recording {
    let scene = format!(
        "
bodies:
  thing: {{role: object, {object}}}
  base: {{role: support, position: [0 m, 0 m, -10 mm], parts: [{{box: [600 mm, 600 mm, 20 mm]}}]}}
  wall: {{role: wall, position: [310 mm, 0 m, 0.2 m], parts: [{{box: [20 mm, 600 mm, 400 mm]}}]}}
hands:
  right: {{fingers: [thumb, index]}}
"
    );
    let [x, y, z] = position;
    let half_up = |t: f64| up(t) / 2.0;
    recording(
        &scene,
        200.0,
        400,
        &[
            ("right.thumb.position.x", &|t| x(t) - 0.02),
            ("right.thumb.position.y", y),
            ("right.thumb.position.z", z),
            ("right.thumb.force.x", squeeze),
            ("right.thumb.force.y", &|_| 0.0),
            ("right.thumb.force.z", &half_up),
            ("right.index.position.x", &|t| x(t) + 0.02),
            ("right.index.position.y", y),
            ("right.index.position.z", z),
            ("right.index.force.x", &|t| -squeeze(t)),
            ("right.index.force.y", &|_| 0.0),
            ("right.index.force.z", &half_up),
            ("thing.position.x", x),
            ("thing.position.y", y),
            ("thing.position.z", z),
            ("thing.rotation.w", &|_| (turned / 2.0).cos()),
            ("thing.rotation.x", &|_| (turned / 2.0).sin()),
            ("thing.rotation.y", &|_| 0.0),
            ("thing.rotation.z", &|_| 0.0),
        ],
    )
}

const CUBE: &str = "mass: 100 g, parts: [{box: [60 mm, 60 mm, 60 mm]}]";
const WEIGHT: f64 = 0.1 * 9.81;

#[test]
fn every_shape_touches_when_it_comes_down() {
    let right_angle = std::f64::consts::FRAC_PI_2;
    for (shape, turned, height) in [
        ("parts: [{box: [40 mm, 40 mm, 40 mm]}]", 0.0, 0.020),
        ("parts: [{box: [40 mm, 40 mm, 40 mm]}]", right_angle / 2.0, 0.020 * 2f64.sqrt()),
        ("parts: [{cylinder: [15 mm, 60 mm]}]", 0.0, 0.030),
        ("parts: [{cylinder: [15 mm, 60 mm]}]", right_angle, 0.015),
        ("parts: [{cylinder: [15 mm, 60 mm]}]", 0.5, 0.030 * 0.5f64.cos() + 0.015 * 0.5f64.sin()),
        ("parts: [{ball: 25 mm}]", 0.0, 0.025),
        ("parts: [{ball: 5 mm}, {box: [10 mm, 10 mm, 10 mm], at: [0 mm, 0 mm, -50 mm]}]", 0.0, 0.055),
    ] {
        // 10 mm above the base, it comes down with 10 mm/s: the gap is 0.3 mm after 0.97 s.
        let falling =
            over_base(shape, [&|_| 0.0, &|_| 0.0, &|t| height + 0.010 - 0.010 * t], turned, &|_| 0.0, &|_| 0.0);
        let felt = ContactFrames::of(&falling, "base");
        near(felt.begins(), 0.97, 0.006);
        near(felt.at("contacts.normal", 0.99)[2], 1.0, 1e-6);
        // The mass is not known, so how much it bears is not either.
        near(felt.at("contacts.force", 0.99)[2], 1.0, 1e-6);
    }
}

#[test]
fn the_balance_tells_how_much_a_contact_bears() {
    // The hand takes over the weight from 0.5 s to 1.5 s, and the cube does not move.
    let up = |t: f64| WEIGHT * (t - 0.5).clamp(0.0, 1.0);
    let squeeze = |t: f64| if t >= 0.4 { 1.0 } else { 0.0 };
    let felt = ContactFrames::of(&over_base(CUBE, [&|_| 0.0, &|_| 0.0, &|_| 0.030], 0.0, &squeeze, &up), "base");
    near(felt.at("contacts.force", 0.2)[2], WEIGHT, 1e-9);
    near(felt.at("contacts.force", 1.0)[2], WEIGHT / 2.0, 1e-9);
    // It touches still, and bears nothing any more.
    near(felt.at("contacts.force", 1.8)[2], 0.0, 0.0);
    near(felt.at("contacts.normal", 1.8)[2], 1.0, 1e-9);
}

#[test]
fn a_loaded_wall_is_reported_from_one_that_is_merely_touched() {
    let squeeze = |t: f64| 1.0 + 0.01 * (50.0 * t).sin();
    // In the air, 0.1 mm beside the wall; from 1 s on the thumb pushes with 0.5 N more than the index.
    let mut pressed = over_base(CUBE, [&|_| 0.300 - 0.0301, &|_| 0.0, &|_| 0.150], 0.0, &squeeze, &|_| WEIGHT);
    let time = pressed.time.clone();
    for (force, time) in pressed.columns["right.thumb.force.x"].values.iter_mut().zip(time) {
        *force += if time >= 1.0 { 0.5 } else { 0.0 };
    }
    let felt = ContactFrames::of(&pressed, "wall");
    near(felt.at("contacts.force", 0.5)[0], 0.0, 0.0);
    near(felt.at("contacts.normal", 0.5)[0], -1.0, 1e-9);
    near(felt.at("contacts.force", 1.5)[0], -0.5, 1e-9);
    near(felt.begins(), 1.0, 0.025);
}

#[test]
fn a_scene_that_is_wrong_by_millimetres_still_carries() {
    // The cube rests 2 mm above where the scene has the base, and is lifted with 20 mm/s from 1 s on.
    let height = |t: f64| 0.032 + 0.020 * (t - 1.0).max(0.0);
    let held = |t: f64| if t >= 0.8 { 1.0 } else { 0.0 };
    // No mass: only the gap tells. 0.51 mm are reached after 26 ms.
    let cube = "parts: [{box: [60 mm, 60 mm, 60 mm]}]";
    let felt = ContactFrames::of(&over_base(cube, [&|_| 0.0, &|_| 0.0, &height], 0.0, &held, &|_| 0.0), "base");
    near(felt.at("contacts.force", 0.5)[2], 1.0, 1e-9);
    near(felt.at("contacts.force", 1.02)[2], 1.0, 1e-9);
    near(felt.at("contacts.force", 1.035)[2], 0.0, 0.0);
}

#[test]
fn noise_of_the_poses_widens_the_tolerance() {
    // A cube at rest that is seen 0.3 mm higher in every third frame, and 0.3 mm lower in the next.
    let shaken = |t: f64| 0.030 + [0.3e-3, -0.3e-3, 0.0][(t * 200.0).round() as usize % 3];
    let felt = ContactFrames::of(
        &over_base("parts: [{box: [60 mm, 60 mm, 60 mm]}]", [&|_| 0.0, &|_| 0.0, &shaken], 0.0, &|_| 0.0, &|_| 0.0),
        "base",
    );
    assert!(column(&felt.frames, "contacts.force", felt.slot, 2).iter().all(|force| *force > 0.0));
}

#[test]
fn forces_that_do_not_balance_are_not_believed() {
    // Held in the air by forces that read zero: the gap alone decides, and the cube on the base bears its weight all the time.
    let height = |t: f64| 0.030 + 0.100 * (t - 1.0).clamp(0.0, 0.5);
    let squeeze = |t: f64| if t >= 0.4 { 1.0 } else { 0.0 };
    let felt = ContactFrames::of(&over_base(CUBE, [&|_| 0.0, &|_| 0.0, &height], 0.0, &squeeze, &|_| 0.0), "base");
    near(felt.at("contacts.force", 0.8)[2], WEIGHT, 1e-9);
    near(felt.at("contacts.force", 1.2)[2], 0.0, 0.0);
}

#[test]
fn the_wall_of_a_hand_without_sensors_bears_the_weight() {
    // The cube is carried through the air to the wall, which it reaches at 1 s. What the hand bears is not known, so the balance is not either.
    let way = |t: f64| 0.270 - 0.020 * (1.0 - t).max(0.0);
    let mut carried = over_base(CUBE, [&way, &|_| 0.0, &|_| 0.150], 0.0, &|_| 0.0, &|_| 0.0);
    carried.columns.retain(|name, _| !name.contains(".force"));
    let frames = frames(&carried, &[ask("contacts.force"), ask("target")]).unwrap();
    let wall = frames.layout.hand(Side::Right).unwrap().contacts.iter().position(|name| name == "wall").unwrap();
    let force = column(&frames, "contacts.force", wall as u32, 0);
    near(force[100], 0.0, 0.0);
    near(force[300], -WEIGHT, 1e-9);
}

/// The cube on the base for 1 s and in the air thereafter, as a flag and nothing else; the base has no shape.
fn flagged(name: &str) -> Recording {
    let mut log =
        over_base("parts: [{box: [60 mm, 60 mm, 60 mm]}]", [&|_| 0.0, &|_| 0.0, &|_| 0.5], 0.0, &|_| 0.0, &|_| 0.0);
    log.scene.bodies["base"].parts.clear();
    let flag = log.time.iter().map(|time| f64::from(u8::from(*time < 1.0))).collect();
    log.columns.insert(name.into(), teachtree_base::recording::Column { dimension: Dimension::NONE, values: flag });
    log
}

#[test]
fn a_flag_is_a_contact() {
    for name in ["contact.thing.base", "contact.base.thing"] {
        let felt = ContactFrames::of(&flagged(name), "base");
        assert_eq!(felt.at("contacts.force", 0.5), [0.0, 0.0, 1.0]);
        assert_eq!(felt.at("contacts.normal", 0.5), [0.0, 0.0, 1.0]);
        assert_eq!(felt.at("contacts.force", 1.5), [0.0; 3]);
    }
}

#[test]
fn channels_that_need_a_support_are_reported_missing() {
    let mut log = flagged("contact.thing.base");
    log.columns.shift_remove("contact.thing.base");
    let printed = |log: &Recording| {
        let issues = frames(log, &[ask("contacts.force")]).unwrap().issues;
        let printed: Vec<String> =
            issues.into_iter().filter(|it| it.kind == "no_support").map(|it| it.message).collect();
        printed.join("\n")
    };
    insta::assert_snapshot!(printed(&log));
    // Fingertips that are only seen hold what moves with them.
    log.columns.retain(|name, _| !name.contains("force"));
    let seen = printed(&log);
    assert!(seen.contains("Translate begins when it moves, and Place is not found"), "{seen}");
}

#[test]
fn a_log_with_neither_flags_nor_forces_is_refused() {
    let mut log = flagged("contact.thing.base");
    log.columns.retain(|name, _| !name.contains("force"));
    let error = frames(&log, &[ask_contact()]).unwrap_err();
    insta::assert_snapshot!(error);
    // The same when the rules have a default for the forces.
    let forces = teachtree_base::channels::ChannelSpec {
        absent: teachtree_base::channels::Fallback::Constant(0.0),
        ..ask_fingers("force", Shape::Vec3, Dimension::FORCE)
    };
    assert_eq!(frames(&log, &[forces, ask_contact()]).unwrap_err(), error);
}

/// A hand of which only the palm is measured has no fingers that could feel nothing.
#[test]
fn a_hand_without_fingers_is_refused_where_rules_ask_what_they_touch() {
    let mut log = flagged("contact.thing.base");
    log.scene.hands.clear();
    log.columns.retain(|name, _| !name.starts_with("right."));
    for axis in ["x", "y", "z"] {
        let position = log.columns[&format!("thing.position.{axis}")].clone();
        log.columns.insert(format!("right.palm.position.{axis}"), position);
    }
    let error = frames(&log, &[ask_contact()]).unwrap_err().to_string();
    assert!(error.contains("the rules need `fingers.contact` of the right hand"), "{error}");
}
