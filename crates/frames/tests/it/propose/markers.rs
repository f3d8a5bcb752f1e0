//! Proposed bodies of motion captures: the markers of a body are one position.

use super::{Column, binding, channel};

/// The names of the columns of markers, each with its place beside the first one, m, and whether it moves.
fn found(markers: &[(&str, f64, bool)]) -> String {
    let mut text = String::from("time");
    for (name, ..) in markers {
        text.push_str(&["X", "Y", "Z"].map(|axis| format!(",{name}{axis} [mm]")).concat());
    }
    for row in 0..super::ROWS {
        let passed = f64::from(row) / f64::from(super::ROWS - 1);
        text.push_str(&format!("\n{:.3}", passed * 10.0));
        for (_, beside, moves) in markers {
            let (x, z) = if *moves { (super::along(passed), super::lift(passed)) } else { (0.7, 0.05) };
            text.push_str(&format!(",{:.2},{:.2},{:.2}", (x + beside) * 1e3, 100.0, (z + beside / 2.0) * 1e3));
        }
    }
    super::binding_of(&text)
}

/// The mean of markers.
fn mean(names: &[&str]) -> String {
    let columns: Vec<String> = names.iter().map(|name| format!("\"{name}<XYZ>\"")).collect();
    format!("{{mean: [{}]}}", columns.join(", "))
}

#[test]
fn markers_that_share_a_stem_and_keep_their_distances_are_one_body() {
    let found = found(&[
        ("bottle1 ", 0.0, true),
        ("bottle2 ", 0.05, true),
        ("bottle3 ", 0.08, true),
        ("glass_1 ", 0.0, false),
        ("glass_2 ", 0.03, false),
        ("glass_3 ", 0.06, false),
        ("plate_1 ", 0.2, false),
        ("plate_2 ", 0.25, false),
        ("Hand_A ", 0.1, true),
        ("Hand_B ", 0.13, true),
        ("Hand_C ", 0.15, true),
    ]);
    let is = |name: &str, markers: &[&str]| assert_eq!(channel(&found, name), Some(&*mean(markers)), "{found}");
    is("bottle.position", &["bottle1 ", "bottle2 ", "bottle3 "]);
    is("glass.position", &["glass_1 ", "glass_2 ", "glass_3 "]);
    is("right.tcp.position", &["Hand_A ", "Hand_B ", "Hand_C "]);
    // Two points at rest may be two things.
    assert_eq!(channel(&found, "plate_1.position"), Some("plate_1 <XYZ>"), "{found}");
}

#[test]
fn things_that_move_at_different_ends_of_a_log_are_several() {
    let columns: [Column; 6] = [
        ("cube1_x", |passed| if passed < 0.06 { 0.1 } else { 0.2 }),
        ("cube1_y", super::still),
        ("cube1_z", super::still),
        ("cube2_x", |passed| if passed < 0.94 { 0.3 } else { 0.4 }),
        ("cube2_y", super::still),
        ("cube2_z", super::still),
    ];
    let found = binding(&columns);
    assert_eq!(channel(&found, "cube1.position"), Some("cube1_<xyz>"), "{found}");
    assert_eq!(channel(&found, "cube2.position"), Some("cube2_<xyz>"), "{found}");
}

/// A system that loses a marker writes it in the origin.
#[test]
fn a_marker_that_is_lost_at_an_end_is_of_its_body() {
    let beside: fn(f64) -> f64 = |passed| super::along(passed) + 0.03;
    let lost_x: fn(f64) -> f64 = |passed| if passed < 0.03 { 0.0 } else { super::along(passed) + 0.05 };
    let y: fn(f64) -> f64 = |_| 0.1;
    let lost_y: fn(f64) -> f64 = |passed| if passed < 0.03 { 0.0 } else { 0.1 };
    let lost_z: fn(f64) -> f64 = |passed| if passed < 0.03 { 0.0 } else { super::lift(passed) };
    let columns: [Column; 9] = [
        ("jug_1_x", super::along),
        ("jug_1_y", y),
        ("jug_1_z", super::lift),
        ("jug_2_x", beside),
        ("jug_2_y", y),
        ("jug_2_z", super::lift),
        ("jug_3_x", lost_x),
        ("jug_3_y", lost_y),
        ("jug_3_z", lost_z),
    ];
    let found = binding(&columns);
    let wanted = r#"{mean: ["jug_1_<xyz>", "jug_2_<xyz>", "jug_3_<xyz>"]}"#;
    assert_eq!(channel(&found, "jug.position"), Some(wanted), "{found}");
}

#[test]
fn subjects_of_vicon_are_bodies_unless_all_markers_have_one() {
    let of_bodies = found(&[
        ("Hand:A.", 0.0, true),
        ("glass:m1.", 0.0, false),
        ("glass:m2.", 0.04, false),
        ("glass:m3.", 0.07, false),
        ("cup:cup1.", 0.2, true),
        ("cup:cup2.", 0.25, true),
    ]);
    let markers = mean(&["glass:m1.", "glass:m2.", "glass:m3."]);
    assert_eq!(channel(&of_bodies, "glass.position"), Some(&*markers), "{of_bodies}");
    assert_eq!(channel(&of_bodies, "cup.position"), Some(&*mean(&["cup:cup1.", "cup:cup2."])), "{of_bodies}");
    let of_session = found(&[
        ("Try:tool.", 0.0, true),
        ("Try:glass_1.", 0.0, false),
        ("Try:glass_2.", 0.04, false),
        ("Try:glass_3.", 0.07, false),
        ("Try:saucer.", 0.2, false),
        ("Try:cup.", 0.25, false),
    ]);
    let markers = mean(&["Try:glass_1.", "Try:glass_2.", "Try:glass_3."]);
    assert_eq!(channel(&of_session, "glass.position"), Some(&*markers), "{of_session}");
    for name in ["saucer", "cup"] {
        let wanted = format!("\"Try:{name}.<XYZ>\"");
        assert_eq!(channel(&of_session, &format!("{name}.position")), Some(&*wanted), "{of_session}");
    }
}

/// Nothing shows that these are markers: neither a robot nor the fingertips of a person.
#[test]
fn points_at_rest_are_bodies_beside_a_robot_and_a_person() {
    let rest: fn(f64) -> f64 = |_| 0.3;
    let blocks: [Column; 9] = [
        ("block_1_x", rest),
        ("block_1_y", rest),
        ("block_1_z", rest),
        ("block_2_x", |_| 0.4),
        ("block_2_y", rest),
        ("block_2_z", rest),
        ("block_3_x", |_| 0.5),
        ("block_3_y", rest),
        ("block_3_z", rest),
    ];
    let points = |names: &[&str]| -> Vec<String> {
        names.iter().flat_map(|name| ["x", "y", "z"].map(|axis| format!("{name}_{axis}"))).collect()
    };
    let ways = [super::along as fn(f64) -> f64, super::still, super::lift];
    let tips = ["thumb", "index", "middle", "ring", "pinky"].map(|finger| format!("right_{finger}_tip"));
    for hand in [points(&["tcp"]), points(&tips.each_ref().map(String::as_str))] {
        let mut columns: Vec<Column> = hand.iter().map(String::as_str).zip(ways.into_iter().cycle()).collect();
        columns.extend(blocks);
        let found = binding(&columns);
        for name in ["block_1", "block_2", "block_3"] {
            assert_eq!(channel(&found, &format!("{name}.position")), Some(&*format!("{name}_<xyz>")), "{found}");
        }
    }
}

/// Points of a hand that carries a bottle: each with its subject and label, its place beside the middle of the fingertips, m, and how far it goes apart as the
/// hand opens.
fn hand_and_bottle(points: &[(&str, [f64; 3], f64)]) -> String {
    let names = points.iter().map(|(name, ..)| *name).chain(["Bottle:B1.", "Bottle:B2.", "Bottle:B3."]);
    let names: Vec<String> = names.flat_map(|name| ["X", "Y", "Z"].map(|axis| format!("{name}{axis} [mm]"))).collect();
    let mut text = format!("time,{}", names.join(","));
    for row in 0..super::ROWS {
        let passed = f64::from(row) / f64::from(super::ROWS - 1);
        // The hand comes, carries the bottle to another place, and goes back.
        let way = |passed: f64| 0.4 * (passed.clamp(0.3, 0.7) - 0.3);
        let free = (0.3 - passed).max(0.0) + (passed - 0.7).max(0.0);
        let is_closed = (0.3..0.7).contains(&passed);
        text.push_str(&format!("\n{:.3}", passed * 10.0));
        for (_, [x, y, z], opens) in points {
            let y = y + if is_closed { 0.0 } else { *opens };
            text.push_str(&format!(",{:.1},{:.1},{:.1}", 1e3 * (x + way(passed) - free), 1e3 * y, 1e3 * (z + 0.8)));
        }
        for z in [0.0, 0.05, 0.12] {
            text.push_str(&format!(",{:.1},{:.1},{:.1}", 1e3 * (way(passed) + z / 4.0), 0.0, 1e3 * (z + 0.7)));
        }
    }
    super::binding_of(&text)
}

#[test]
fn markers_of_a_hand_are_no_object() {
    let tips = [[0.0, 0.04, 0.0], [0.0, -0.04, 0.0], [0.0, -0.04, -0.02]];
    let wrist = [[-0.16, 0.03, 0.01], [-0.16, -0.03, 0.01], [-0.09, 0.0, 0.04]];
    let sets = [
        ["Subject1:RTHT.", "Subject1:RIFT.", "Subject1:RMFT.", "Subject1:RWRA.", "Subject1:RWRB.", "Subject1:RFIN."],
        ["Subject1:RThumb.", "Subject1:RIndex.", "Subject1:RMiddle.", "Subject1:M1.", "Subject1:M2.", "Subject1:M3."],
        ["RightHand:Thumb.", "RightHand:Index.", "RightHand:Middle.", "RightHand:A.", "RightHand:B.", "RightHand:C."],
    ];
    for names in sets {
        let places = [&tips[..], &wrist].concat();
        let opens = [0.02, -0.02, -0.02, 0.0, 0.0, 0.0];
        let points: Vec<(&str, [f64; 3], f64)> =
            names.into_iter().zip(places).zip(opens).map(|((name, at), opens)| (name, at, opens)).collect();
        let found = hand_and_bottle(&points);
        for (finger, name) in ["thumb", "index", "middle"].into_iter().zip(names) {
            let wanted = format!("\"{name}<XYZ>\"");
            assert_eq!(channel(&found, &format!("right.{finger}.position")), Some(&*wanted), "{found}");
        }
        let bottle = mean(&["Bottle:B1.", "Bottle:B2.", "Bottle:B3."]);
        assert_eq!(channel(&found, "Bottle.position"), Some(&*bottle), "{found}");
        let others = found.lines().filter(|line| line.contains(".position: ") && !line.contains("right."));
        assert_eq!(others.count(), 1, "{found}");
    }
}

/// Nothing but the motion shows that the markers without a name are on the hand.
#[test]
fn markers_that_keep_their_distance_from_the_fingertips_are_of_the_hand() {
    let at = [[0.0, 0.04, 0.0], [0.0, -0.04, 0.0], [-0.16, 0.03, 0.01], [-0.16, -0.03, 0.01]];
    let found = hand_and_bottle(&[
        ("Hand:RThumb.", at[0], 0.02),
        ("Hand:RIndex.", at[1], -0.02),
        ("Set2:M1.", at[2], 0.0),
        ("Set2:M2.", at[3], 0.0),
    ]);
    assert!(found.contains("#   \"Set2:M1.<XYZ>\"    (a marker of the hand: it stays near the fingertips)"), "{found}");
    assert_eq!(found.lines().filter(|line| line.contains(".position: \"Set2")).count(), 0, "{found}");
    assert!(channel(&found, "Bottle.position").is_some(), "{found}");
}

/// The export of a tracker may have the markers of rigid bodies beside their poses.
#[test]
fn markers_of_a_body_with_a_pose_are_not_bodies() {
    let mut text = String::from("time");
    for (name, parts) in [
        ("Hand", "pose"),
        ("Bottle", "pose"),
        ("Bottle:Marker1", ""),
        ("Bottle:Marker 002", ""),
        ("Tray", "pose"),
        ("Tray:Marker1", ""),
    ] {
        text.push_str(&["X", "Y", "Z"].map(|axis| format!(",{name}.Position.{axis} [mm]")).concat());
        if parts == "pose" {
            text.push_str(&["W", "X", "Y", "Z"].map(|axis| format!(",{name}.Rotation.{axis}")).concat());
        }
    }
    for row in 0..super::ROWS {
        let passed = f64::from(row) / f64::from(super::ROWS - 1);
        let (x, z) = (super::along(passed) * 1e3, super::lift(passed) * 1e3);
        text.push_str(&format!("\n{:.3}", passed * 10.0));
        let near_hand = if (0.1..0.9).contains(&passed) { 0.0 } else { 200.0 };
        text.push_str(&format!(",{:.2},100,{:.2},1,0,0,0", x - 60.0 - near_hand, z + 60.0));
        text.push_str(&format!(",{x:.2},100,{z:.2},1,0,0,0,{:.2},120,{z:.2},{x:.2},80,{:.2}", x + 30.0, z + 25.0));
        text.push_str(",700,300,20,1,0,0,0,780,300,22");
    }
    let found = super::binding_of(&text);
    assert!(channel(&found, "Bottle.position").is_some() && channel(&found, "Tray.position").is_some(), "{found}");
    assert!(!found.lines().any(|line| line.contains("Marker") && !line.trim_start().starts_with('#')), "{found}");
    assert!(found.contains("(a marker of Bottle, whose pose is in the log)"), "{found}");
}
