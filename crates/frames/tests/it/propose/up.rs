//! The axis that points up in a log.

use super::{Column, along, binding, binding_of, channel, still, table};

/// Taken off a jar, carried over the table, and put down on it.
fn lid(passed: f64) -> f64 {
    match passed {
        passed if passed < 0.4 => 0.12,
        passed if passed < 0.8 => 0.24,
        _ => 0.01,
    }
}

#[test]
fn what_is_put_down_lower_than_it_was_taken_is_lifted() {
    let height_last = |lid_y: fn(f64) -> f64, lid_z: fn(f64) -> f64| {
        let columns: [Column; 6] = [
            ("tcp_x", along),
            ("tcp_y", lid_y),
            ("tcp_z", lid_z),
            ("lid_x", along),
            ("lid_y", lid_y),
            ("lid_z", lid_z),
        ];
        binding(&columns)
    };
    let found = height_last(lid, along);
    assert_eq!(channel(&found, "lid.position"), Some(r#"["lid_x", "-lid_z", "lid_y"]"#), "{found}");
    assert!(found.contains("# y points up: an object is lifted along it; if z does, "), "{found}");
    // Carried on an arc that is not up.
    let found = height_last(lid, lid);
    assert_eq!(channel(&found, "lid.position"), Some("lid_<xyz>"), "{found}");
    // Lifted along z and held in the air, or put on a shelf, while it goes beyond its last place along y.
    let in_the_air: fn(f64) -> f64 = |passed| if passed < 0.4 { 0.02 } else { 0.25 };
    let on_a_shelf: fn(f64) -> f64 = |passed| match passed {
        passed if passed < 0.4 => 0.02,
        passed if passed < 0.8 => 0.34,
        _ => 0.32,
    };
    for lid_z in [in_the_air, on_a_shelf] {
        let found = height_last(beyond, lid_z);
        assert_eq!(channel(&found, "lid.position"), Some("lid_<xyz>"), "{found}");
    }
}

/// It goes 0.3 m, and 0.1 m back.
fn beyond(passed: f64) -> f64 {
    match passed {
        passed if passed < 0.5 => 0.0,
        passed if passed < 0.8 => passed - 0.5,
        passed => (1.1 - passed).max(0.2),
    }
}

#[test]
fn y_points_up_in_an_export_of_motive_unless_objects_show_z() {
    let export = |lid_y: fn(f64) -> f64, lid_z: fn(f64) -> f64| {
        let columns: [Column; 6] = [
            ("RightHand.Position.X", along),
            ("RightHand.Position.Y", lid_y),
            ("RightHand.Position.Z", lid_z),
            ("Lid.Position.X", along),
            ("Lid.Position.Y", lid_y),
            ("Lid.Position.Z", lid_z),
        ];
        binding_of(&table(&columns).replacen("time", "Time (Seconds)", 1))
    };
    let upright = Some(r#"["Lid.Position.X", "-Lid.Position.Z", "Lid.Position.Y"]"#);
    let found = export(still, along);
    assert_eq!(channel(&found, "Lid.position"), upright, "{found}");
    assert!(found.contains("# y points up: Motive exports it so; if z does, "), "{found}");
    // Lifted along y while it goes to and fro along z.
    let found = export(lid, |passed| 0.1 + 0.1 * (6.3 * passed).sin().max(0.0));
    assert_eq!(channel(&found, "Lid.position"), upright, "{found}");
    let found = export(still, |passed| if (0.3..0.7).contains(&passed) { 0.2 } else { 0.02 });
    assert_eq!(channel(&found, "Lid.position"), Some("Lid.Position.<XYZ>"), "{found}");
    // Lifted along z, higher than it goes back along y.
    let found = export(beyond, |passed| if (0.3..0.9).contains(&passed) { 0.25 } else { 0.02 });
    assert_eq!(channel(&found, "Lid.position"), Some("Lid.Position.<XYZ>"), "{found}");
}
