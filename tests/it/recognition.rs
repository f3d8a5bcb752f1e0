//! What the harness of docs/measurements/recognition.md does to recordings (`measure/examples/recognition`): every change can be undone, and changes
//! what it says.

#[path = "../../measure/examples/recognition/transforms.rs"]
mod transforms;

use teachtree_base::quantity::Quantity;
use teachtree_base::recording::{Column, Event, Recording};
use teachtree_base::scene::{Body, Role};
use teachtree_base::units::Dimension;
use transforms::{resampled, reversed, slowed, turned, without_contacts, without_flags};

/// Two seconds at 100 Hz in which every column differs from every other.
fn recording() -> Recording {
    let columns = [
        ("right.thumb.force.x", Dimension::FORCE),
        ("right.thumb.force.y", Dimension::FORCE),
        ("right.thumb.force.z", Dimension::FORCE),
        ("right.thumb.contact", Dimension::NONE),
        ("cube.rotation.w", Dimension::NONE),
        ("cube.rotation.x", Dimension::NONE),
        ("cube.rotation.y", Dimension::NONE),
        ("cube.rotation.z", Dimension::NONE),
        ("cube.velocity.x", Dimension::SPEED),
        ("cube.velocity.y", Dimension::SPEED),
        ("cube.velocity.z", Dimension::SPEED),
        ("contact.cube.base.normal.x", Dimension::NONE),
        ("contact.cube.base.normal.y", Dimension::NONE),
        ("contact.cube.base.normal.z", Dimension::NONE),
    ];
    let time: Vec<f64> = (0..200).map(|row| f64::from(row) / 100.0).collect();
    let mut recording = Recording { time, ..Recording::default() };
    for ((name, dimension), nth) in columns.into_iter().zip(1..) {
        let values = recording.time.iter().map(|time| (time * f64::from(nth)).sin()).collect();
        recording.columns.insert(name.to_string(), Column { dimension, values });
    }
    let labels = recording.time.iter().map(|time| if *time < 0.5 { "Move" } else { "Approach" }.to_string());
    recording.labels.insert("right.label".into(), labels.collect());
    let event = |time_s, kind: &str| Event { time_s, kind: kind.into(), subjects: vec!["cube".into()] };
    recording.events = vec![event(0.5, "contact_made"), event(1.25, "contact_lost"), event(1.5, "phase_started")];
    let cube = Body {
        role: Role::Object,
        parts: vec![],
        radius: None,
        mass: None,
        friction: 0.4,
        position: [0.3, 0.0, 0.1].map(Quantity),
        rotation: [1.0, 0.0, 0.0, 0.0],
        sockets: Default::default(),
        plug: None,
        fixed_to: None,
    };
    recording.scene.bodies.insert("cube".into(), cube);
    recording
}

fn assert_near(one: &Recording, other: &Recording) {
    let near = |one: &[f64], other: &[f64]| one.iter().zip(other).all(|(one, other)| (one - other).abs() < 1e-12);
    assert!(near(&one.time, &other.time));
    assert_eq!(one.columns.len(), other.columns.len());
    for (name, column) in &one.columns {
        assert!(near(&column.values, &other.columns[name].values), "{name}");
    }
    assert_eq!(one.labels, other.labels);
    for (one, other) in one.events.iter().zip(&other.events) {
        assert!((one.time_s - other.time_s).abs() < 1e-12 && one.kind == other.kind, "{one:?} {other:?}");
    }
    for (one, other) in one.scene.bodies.values().zip(other.scene.bodies.values()) {
        assert!(near(&one.position.map(|part| part.0), &other.position.map(|part| part.0)));
        assert!(near(&one.rotation, &other.rotation));
    }
}

#[test]
fn what_is_changed_and_changed_back_is_what_it_was() {
    assert_near(&slowed(slowed(recording(), 2.0), 0.5), &recording());
    assert_near(&reversed(reversed(recording())), &recording());
    assert_near(&turned(turned(recording(), 0.9), -0.9), &recording());
    assert_near(&resampled(recording(), 100.0), &recording());
}

#[test]
fn twice_the_time_is_half_the_speed_and_the_same_force() {
    let (was, slow) = (recording(), slowed(recording(), 2.0));
    assert_eq!(slow.time[100], 2.0 * was.time[100]);
    assert_eq!(slow.events[1].time_s, 2.5);
    for (name, factor) in [("cube.velocity.y", 0.5), ("right.thumb.force.y", 1.0), ("contact.cube.base.normal.y", 1.0)]
    {
        assert_eq!(slow.columns[name].values[70], factor * was.columns[name].values[70], "{name}");
    }
}

#[test]
fn backwards_the_last_row_is_the_first_and_a_lost_contact_is_made() {
    let (was, back) = (recording(), reversed(recording()));
    assert_eq!(back.time[0], 0.0);
    assert_eq!(back.columns["right.thumb.force.x"].values[0], was.columns["right.thumb.force.x"].values[199]);
    assert_eq!(back.columns["cube.velocity.x"].values[0], -was.columns["cube.velocity.x"].values[199]);
    assert_eq!(back.labels["right.label"][0], "Approach");
    let ms = |event: &Event| (event.time_s * 1000.0).round() as i64;
    let printed: Vec<(&str, i64)> = back.events.iter().map(|event| (event.kind.as_str(), ms(event))).collect();
    assert_eq!(printed, [("phase_started", 490), ("contact_made", 740), ("contact_lost", 1490)]);
}

#[test]
fn at_another_rate_each_row_is_the_nearest_old_one() {
    let (was, coarse) = (recording(), resampled(recording(), 20.0));
    assert_eq!(coarse.time.len(), 40);
    for (row, time) in coarse.time.iter().enumerate() {
        assert!((time - was.time[5 * row]).abs() < 1e-12);
        assert_eq!(
            coarse.columns["right.thumb.contact"].values[row],
            was.columns["right.thumb.contact"].values[5 * row]
        );
        assert_eq!(coarse.labels["right.label"][row], was.labels["right.label"][5 * row]);
    }
    let fine = resampled(recording(), 300.0);
    assert_eq!(fine.time.len(), 598);
    assert_eq!(fine.columns["cube.rotation.w"].values[4], was.columns["cube.rotation.w"].values[1]);
}

#[test]
fn a_quarter_turn_takes_x_to_y_in_everything_that_has_a_direction() {
    let (was, turned) = (recording(), turned(recording(), std::f64::consts::FRAC_PI_2));
    for vector in ["right.thumb.force", "cube.velocity", "contact.cube.base.normal"] {
        let of = |recording: &Recording, part: &str| recording.columns[&format!("{vector}.{part}")].values[33];
        assert!((of(&turned, "y") - of(&was, "x")).abs() < 1e-12, "{vector}");
        assert!((of(&turned, "x") + of(&was, "y")).abs() < 1e-12, "{vector}");
        assert!((of(&turned, "z") - of(&was, "z")).abs() < 1e-12, "{vector}");
    }
    let body = &turned.scene.bodies["cube"];
    assert!((body.position[1].0 - 0.3).abs() < 1e-12 && body.position[0].0.abs() < 1e-12);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    assert!((body.rotation[0] - half).abs() < 1e-12 && (body.rotation[3] - half).abs() < 1e-12);
    // A rotation is turned as the body of the scene is.
    let of = |recording: &Recording| {
        ["w", "x", "y", "z"].map(|part| recording.columns[&format!("cube.rotation.{part}")].values[33])
    };
    let ([w, x, y, z], found) = (of(&was), of(&turned));
    let wanted = [half * (w - z), half * (x - y), half * (x + y), half * (w + z)];
    assert!(found.iter().zip(wanted).all(|(found, wanted)| (found - wanted).abs() < 1e-12));
}

#[test]
fn flags_and_contacts_are_taken_out_and_nothing_else() {
    let names = |recording: Recording| recording.columns.keys().cloned().collect::<Vec<_>>();
    let (was, unflagged, bare) =
        (names(recording()), names(without_flags(recording())), names(without_contacts(recording())));
    assert_eq!(was.iter().filter(|name| !unflagged.contains(name)).collect::<Vec<_>>(), ["right.thumb.contact"]);
    assert_eq!(was.iter().filter(|name| !bare.contains(name)).count(), 3);
    assert!(bare.iter().all(|name| !name.starts_with("contact.")));
}
