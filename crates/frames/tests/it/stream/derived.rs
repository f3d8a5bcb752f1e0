//! Derived channels against values worked out by hand.

use super::{ask, ask_contact, ask_fingers, column};
use crate::shared::recordings::{passing, recording};
use teachtree_base::channels::Shape;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::recording::{Column, Recording};
use teachtree_base::units::Dimension;
use teachtree_frames::frames;

fn near(found: f64, wanted: f64, tolerance: f64) {
    assert!((found - wanted).abs() <= tolerance, "found {found}, expected {wanted} within {tolerance}");
}

#[test]
fn the_target_changes_only_while_nothing_is_touched() {
    let frames =
        frames(&passing(), &[ask("target"), ask_contact(), ask("target.radius"), ask("target.weight")]).unwrap();
    assert_eq!(frames.objects, ["cube", "ball"]);
    let target = column(&frames, "target", 0, 0);
    // The thumb presses the cube until 0.8 s, although the fingertips are over the ball from 0.5 s on.
    assert!(target[..80].iter().all(|object| *object == 0.0));
    assert!(target[80..].iter().all(|object| *object == 1.0));
    let touches = column(&frames, "fingers.contact", 0, 0);
    assert_eq!((touches[19], touches[20], touches[79], touches[80]), (0.0, 1.0, 1.0, 0.0));
    near(column(&frames, "target.radius", 0, 0)[0], 0.06 * 3f64.sqrt(), 1e-12);
    near(column(&frames, "target.weight", 0, 0)[0], 0.4905, 1e-12);
    near(column(&frames, "target.radius", 0, 0)[99], 0.04, 1e-12);
}

#[test]
fn velocities_are_averaged_about_the_frame() {
    let frames = frames(&passing(), &[ask("target.velocity"), ask("target.spin")]).unwrap();
    let velocity = column(&frames, "target.velocity", 0, 0);
    // The slope of a parabola through windows that are even on both sides is exact: x = 0.05 t², v = 0.1 t.
    near(velocity[40], 0.04, 1e-12);
    // At the beginning the windows are one-sided: six samples after the frame, of means that are 60 to 120 ms wide.
    near(velocity[0], 0.1 * 0.045, 1e-4);
    assert_eq!(column(&frames, "target.velocity", 0, 2)[40], 0.0);
    assert_eq!(column(&frames, "target.spin", 0, 0)[40], 0.0);
}

#[test]
fn contacts_have_a_slot_for_each_body_and_the_direction_of_their_force() {
    let frames = frames(
        &passing(),
        &[
            ask("contacts.force"),
            ask("contacts.normal"),
            ask("load"),
            ask_fingers("force", Shape::Vec3, Dimension::FORCE),
        ],
    )
    .unwrap();
    let right = &frames.layout.hands[0];
    assert_eq!(right.contacts, ["base"]);
    assert_eq!(right.fingers, [Finger::Thumb, Finger::Index]);
    assert_eq!(column(&frames, "contacts.force", 0, 2)[10], 0.49);
    assert_eq!(column(&frames, "contacts.normal", 0, 2)[10], 1.0);
    near(column(&frames, "load", 0, 0)[50], 0.35f64.hypot(0.4), 1e-12);
    // The index has no force in the log: it feels nothing, and that is reported.
    assert!(column(&frames, "fingers.force", 1, 2).iter().all(|force| *force == 0.0));
    assert!(frames.issues.iter().any(|issue| issue.kind == "missing_channel" && issue.channel == "right.index.force"));
}

#[test]
fn a_contact_is_the_same_from_either_side() {
    let mut turned = passing();
    turned.columns = turned
        .columns
        .into_iter()
        .map(|(name, mut column)| match name.strip_prefix("contact.cube.base") {
            Some(rest) => {
                column.values.iter_mut().for_each(|value| *value = -*value);
                (format!("contact.base.cube{rest}"), column)
            }
            None => (name, column),
        })
        .collect();
    let channels = [ask("contacts.force"), ask("contacts.normal")];
    let (one, other) = (frames(&passing(), &channels).unwrap(), frames(&turned, &channels).unwrap());
    assert_eq!(one.columns, other.columns);
}

const MATING: &str = "
bodies:
  peg: {role: object, plug: [0 m, 0 m, -20 mm], radius: 25 mm}
  ring: {role: object, radius: 30 mm, sockets: {hole: {rim: [0 m, 0 m, 10 mm], axis: [0, 0, 1], radius: 4 mm, depth: 30 mm}}}
hands:
  left: {fingers: [thumb]}
  right: {fingers: [thumb]}
";

/// The left hand holds the ring at rest, the right hand lowers the peg at 20 mm/s and turns it at 0.5 rad/s: its plug passes the rim at 1 s.
fn mating() -> Recording {
    let height = |t: f64| 0.020 - 0.020 * t;
    let tip = |t: f64| 0.010 + 0.020 + height(t);
    recording(
        MATING,
        100.0,
        200,
        &[
            ("left.thumb.position.x", &|_| -0.03),
            ("left.thumb.position.y", &|_| 0.0),
            ("left.thumb.position.z", &|_| 0.0),
            ("right.thumb.position.x", &|_| 0.02),
            ("right.thumb.position.y", &|_| 0.0),
            ("right.thumb.position.z", &|t| 0.05 + tip(t)),
            ("left.thumb.contact.ring", &|_| 1.0),
            ("right.thumb.contact.peg", &|_| 1.0),
            ("ring.position.x", &|_| 0.0),
            ("ring.position.y", &|_| 0.0),
            ("ring.position.z", &|_| 0.0),
            ("peg.position.x", &|_| 0.003),
            ("peg.position.y", &|_| 0.0),
            ("peg.position.z", &tip),
            ("peg.rotation.w", &|t| (0.25 * t).cos()),
            ("peg.rotation.x", &|_| 0.0),
            ("peg.rotation.y", &|_| 0.0),
            ("peg.rotation.z", &|t| (0.25 * t).sin()),
            ("contact.ring.peg", &|t| f64::from(u8::from(t >= 1.2))),
            ("contact.ring.peg.force.x", &|_| 0.0),
            ("contact.ring.peg.force.y", &|_| 0.0),
            ("contact.ring.peg.force.z", &|t| if t >= 1.2 { -0.5 } else { 0.0 }),
        ],
    )
}

#[test]
fn a_peg_goes_into_a_ring_that_the_other_hand_holds() {
    let names = [
        "target.depth",
        "target.over_socket",
        "target.spin",
        "closing",
        "targets.contact",
        "contacts.handled",
        "contacts.force",
    ];
    let channels: Vec<_> = names.map(ask).into();
    let frames = frames(&mating(), &channels).unwrap();
    let [depth, over, spin] =
        ["target.depth", "target.over_socket", "target.spin"].map(|name| column(&frames, name, 0, 0));
    // The rim is 10 mm above the ring's origin, the plug 20 mm below the peg's: depth is 20 mm/s times the time since 1 s.
    near(depth[150], 0.010, 1e-12);
    assert!(depth[..100].iter().all(|depth| *depth == 0.0));
    assert_eq!((over[50], over[150]), (1.0, 0.0));
    // It searches until it is 5 mm deep: rules take it for inserted at some depth before that.
    assert_eq!((over[101], over[110], over[124], over[126]), (1.0, 1.0, 1.0, 0.0));
    near(spin[150], 0.5, 1e-9);
    let closing = column(&frames, "closing", 0, 0);
    near(closing[150], 0.020, 1e-9);
    assert_eq!(closing[50], 0.0);
    let touching = column(&frames, "targets.contact", 0, 0);
    assert_eq!((touching[119], touching[120]), (0.0, 1.0));
    // The slots are the bodies that an object touches: peg and ring. The ring is in the other hand, and pushes the peg up.
    assert_eq!(frames.layout.hands[1].contacts, ["peg", "ring"]);
    assert_eq!(column(&frames, "contacts.handled", 1, 0)[50], 1.0);
    assert_eq!(column(&frames, "contacts.handled", 0, 0)[50], 0.0);
    assert_eq!(column(&frames, "contacts.force", 1, 2)[150], 0.5);
}

#[test]
fn a_peg_beside_the_hole_is_not_in_it() {
    let mut beside = mating();
    beside.columns["peg.position.x"].values.fill(0.006);
    let frames = frames(&beside, &[ask("target.depth")]).unwrap();
    assert!(column(&frames, "target.depth", 0, 0).iter().all(|depth| *depth == 0.0));
}

#[test]
fn a_logged_depth_counts_before_geometry() {
    let mut logged = mating();
    let depth = Column { dimension: Dimension::LENGTH, values: vec![0.003; 200] };
    logged.columns.insert("peg.depth.hole".into(), depth);
    let frames = frames(&logged, &[ask("target.depth")]).unwrap();
    assert!(column(&frames, "target.depth", 0, 0).iter().all(|depth| *depth == 0.003));
}

/// A peg that turns in a plain hole is twisted; only a thread or a bearing makes it a Turn, which rules ask of this channel.
#[test]
fn a_hole_without_pitch_is_plain() {
    let plain = |recording: &Recording| {
        let frames = frames(recording, &[ask("target.in_plain_socket")]).unwrap();
        column(&frames, "target.in_plain_socket", 0, 0).to_vec()
    };
    let mut turned = mating();
    let found = plain(&turned);
    assert_eq!((found[50], found[150]), (0.0, 1.0), "it is in the hole from 1 s on");
    turned.scene.bodies["ring"].sockets["hole"].pitch = Some(teachtree_base::quantity::Quantity(0.0));
    assert!(plain(&turned).iter().all(|plain| *plain == 0.0));
}

/// A latch never leaves its bearing, and its logged angle says how fast it turns there.
#[test]
fn a_logged_angle_is_a_body_in_its_bearing() {
    let mut latch = mating();
    let angle = Column { dimension: Dimension::ANGLE, values: (0..200).map(|row| 0.02 * f64::from(row)).collect() };
    latch.columns.insert("peg.angle.hole".into(), angle);
    let frames = frames(&latch, &[ask("target.depth"), ask("target.spin")]).unwrap();
    assert!(column(&frames, "target.depth", 0, 0).iter().all(|depth| *depth == 0.030));
    near(column(&frames, "target.spin", 0, 0)[20], 2.0, 1e-9);
}

#[test]
fn a_gap_restarts_the_slopes() {
    let mut broken = passing();
    for column in broken.columns.values_mut() {
        column.values.drain(40..60);
    }
    broken.time.drain(40..60);
    let frames = frames(&broken, &[ask("target.velocity")]).unwrap();
    assert_eq!(frames.stretches, [0..40, 40..80]);
    // The last windows before the gap end with it.
    near(column(&frames, "target.velocity", 0, 0)[39], 0.1 * 0.345, 1e-4);
}

#[test]
fn a_hand_of_the_scene_that_the_log_does_not_measure_is_left_out() {
    let mut one_hand = mating();
    one_hand.columns.retain(|name, _| !name.starts_with("left."));
    let frames = frames(&one_hand, &[ask("target")]).unwrap();
    assert_eq!(frames.layout.hands.iter().map(|hand| hand.side).collect::<Vec<_>>(), [Side::Right]);
}
