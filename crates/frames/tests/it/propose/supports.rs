//! Proposed scenes: what carries the objects of a log, and how high it is.

use super::{Column, carried, placed_scene, still};

/// Up from 20 mm, and down to 40 mm.
fn set_down_higher(passed: f64) -> f64 {
    match passed {
        passed if passed < 0.2 => 0.02,
        passed if passed < 0.3 => 0.02 + (passed - 0.2),
        passed if passed < 0.6 => 0.12,
        passed if passed < 0.8 => 0.12 - (passed - 0.6) * 0.4,
        _ => 0.04,
    }
}

/// 40 mm wide on the object.
fn width(passed: f64) -> f64 {
    if (0.15..0.88).contains(&passed) { 0.04 } else { 0.08 }
}

/// A cube of 40 mm that a gripper carries from the table to a place that is 20 mm higher, and other columns.
fn scene_with(others: &[Column]) -> String {
    let columns: [Column; 7] = [
        ("tcp_x", carried),
        ("tcp_y", still),
        ("tcp_z", set_down_higher),
        ("gripper_width", width),
        ("cube_x", carried),
        ("cube_y", still),
        ("cube_z", set_down_higher),
    ];
    placed_scene(&[&columns, others].concat())
}

fn line<'a>(scene: &'a str, body: &str) -> &'a str {
    scene.lines().find(|line| line.starts_with(&format!("  {body}: "))).unwrap_or_else(|| panic!("{body}: {scene}"))
}

const TABLE: &str = "table: {role: support, position: [100 mm, 100 mm, -10 mm], parts: [{box: [2 m, 2 m, 20 mm]}]}";

#[test]
fn a_body_that_never_moves_is_as_high_as_what_rests_on_it_shows() {
    for name in ["plate", "coaster"] {
        let names = ["x", "y", "z"].map(|axis| format!("{name}_{axis}"));
        let values: [fn(f64) -> f64; 3] = [|_| 0.3, still, |_| 0.005];
        let columns: Vec<Column> = names.iter().map(String::as_str).zip(values).collect();
        let scene = scene_with(&columns);
        let support = line(&scene, name);
        // Its top is at 20 mm, 15 mm above its origin.
        assert!(
            support.contains("{role: support, parts: [{box: [300 mm, 300 mm, 20 mm], at: [0 mm, 0 mm, 5 mm]}]}"),
            "{support}"
        );
        assert!(support.contains("if the lowest point of cube is 20 mm below the origin of cube"), "{support}");
        assert_eq!(support.contains("else `role: object`"), name == "coaster", "{support}");
        assert!(scene.contains(TABLE), "{scene}");
        assert!(!scene.contains("  support: "), "{scene}");
    }
}

#[test]
fn what_carries_an_object_and_is_not_in_the_log_is_added() {
    let scene = scene_with(&[]);
    assert!(scene.contains(TABLE), "{scene}");
    let support = line(&scene, "support");
    assert!(
        support.contains("position: [300 mm, 100 mm, 10 mm], parts: [{box: [150 mm, 150 mm, 20 mm]}]"),
        "{support}"
    );
    assert!(support.contains("cube rests here, 20 mm above the table"), "{support}");
}

/// The cube rises beside its shelf while it goes there.
#[test]
fn a_shelf_is_not_where_its_object_passes_lower() {
    let columns: [Column; 7] = [
        ("tcp_x", |passed| 0.1 + 0.5 * (passed - 0.3).clamp(0.0, 0.4)),
        ("tcp_y", still),
        ("tcp_z", |passed| 0.02 + 0.6 * (passed - 0.2).clamp(0.0, 0.4)),
        ("gripper_width", width),
        ("cube_x", |passed| 0.1 + 0.5 * (passed - 0.3).clamp(0.0, 0.4)),
        ("cube_y", still),
        ("cube_z", |passed| 0.02 + 0.6 * (passed - 0.2).clamp(0.0, 0.4)),
    ];
    let scene = placed_scene(&columns);
    // It comes to the height of the shelf 50 mm before its place.
    assert!(line(&scene, "support").contains("parts: [{box: [5"), "{scene}");
}

#[test]
fn a_body_is_as_high_as_it_stands_above_the_table() {
    // A bottle that is pushed over, after the cube has moved.
    let pushed: fn(f64) -> f64 = |passed| if passed > 0.9 { 0.5 } else { 0.45 };
    let scene = scene_with(&[("bottle_x", pushed), ("bottle_y", still), ("bottle_z", |_| 0.08)]);
    assert!(line(&scene, "bottle").contains("{box: [40 mm, 40 mm, 160 mm]}"), "{scene}");
    assert!(line(&scene, "cube").contains("{box: [40 mm, 40 mm, 40 mm]}"), "{scene}");
    assert!(scene.contains("its top at 0 mm"), "{scene}");
}

#[test]
fn an_object_that_stands_on_one_of_its_size_is_stacked() {
    let columns: [Column; 3] = [("block_x", |_| 0.3), ("block_y", still), ("block_z", |_| 0.0)];
    let scene = scene_with(&columns);
    // The gripper never holds the block.
    assert!(line(&scene, "block").contains("role: object"), "{scene}");
    assert!(line(&scene, "block").contains("# its size is not in the log"), "{scene}");
    assert!(!scene.contains("  support: "), "{scene}");
}

#[test]
fn a_named_support_does_not_replace_the_table_beside_it() {
    // The cube begins on a tray, whose origin is its bottom, and ends beside it.
    let columns: [Column; 3] = [("tray_x", |_| 0.1), ("tray_y", still), ("tray_z", |_| -0.01)];
    let scene = scene_with(&columns);
    let tray = line(&scene, "tray");
    assert!(tray.contains("at: [0 mm, 0 mm, 0 mm]"), "{tray}");
    assert!(tray.contains("cube rests on it: its top is 10 mm above its origin"), "{tray}");
    assert!(scene.contains("its top at 20 mm"), "{scene}");
}

#[test]
fn of_two_objects_on_one_support_the_taller_one_shows_its_height() {
    let tray: [Column; 3] = [("tray_x", |_| 0.1), ("tray_y", still), ("tray_z", |_| -0.01)];
    // The can goes aside at the end.
    let can: [Column; 3] =
        [("can_x", |passed| if passed < 0.9 { 0.16 } else { 0.2 }), ("can_y", still), ("can_z", |_| 0.06)];
    let scene = scene_with(&[tray, can].concat());
    // The cube of 40 mm rests with its origin at 20 mm, on a top at 0 mm.
    assert!(
        line(&scene, "can").contains("{box: [40 mm, 40 mm, 120 mm]}]}    # the width that the gripper holds"),
        "{scene}"
    );
    assert!(line(&scene, "can").contains("as high as it stands above its support"), "{scene}");
    assert!(line(&scene, "tray").contains("its top is 10 mm above its origin"), "{scene}");
}

/// A bowl that is held by its rim, 60 mm beside its origin.
#[test]
fn an_object_is_as_wide_as_it_is_held_beside_its_origin() {
    for (beside, size) in
        [(0.06, "[120 mm, 120 mm, 40 mm]"), (0.01, "[40 mm, 40 mm, 40 mm]"), (0.1, "[40 mm, 40 mm, 40 mm]")]
    {
        let at: fn(f64) -> f64 = match beside {
            0.06 => |_| 0.16,
            0.01 => |_| 0.11,
            _ => |_| 0.2,
        };
        let scene = placed_scene(&[
            ("tcp_x", carried),
            ("tcp_y", at),
            ("tcp_z", set_down_higher),
            ("gripper_width", width),
            ("bowl_x", carried),
            ("bowl_y", still),
            ("bowl_z", set_down_higher),
        ]);
        assert!(line(&scene, "bowl").contains(&format!("parts: [{{box: {size}}}]")), "{scene}");
    }
}

/// The fingertips of a hand that carries an object from 0.3 to 0.5 of the log, 40 mm from its middle.
fn tip(side: f64, passed: f64) -> f64 {
    0.1 + side * if (0.2..0.7).contains(&passed) { 0.04 } else { 0.07 }
}

/// Up from 100 mm while it is carried, and down again.
fn lifted(passed: f64) -> f64 {
    0.1 + 0.1 * (((passed - 0.3) / 0.05).clamp(0.0, 1.0) - ((passed - 0.5) / 0.05).clamp(0.0, 1.0))
}

#[test]
fn fingertips_that_carry_an_object_show_its_width_and_its_support() {
    let columns: [Column; 9] = [
        ("thumb_tip_x", carried),
        ("thumb_tip_y", |passed| tip(1.0, passed)),
        ("thumb_tip_z", lifted),
        ("index_tip_x", carried),
        ("index_tip_y", |passed| tip(-1.0, passed)),
        ("index_tip_z", |passed| lifted(passed) - 0.02),
        ("middle_tip_x", carried),
        ("middle_tip_y", |passed| tip(-1.2, passed)),
        ("middle_tip_z", lifted),
    ];
    // The origin is 30 mm above the fingertips, 10 mm beside their middle.
    let cup_of_log: [Column; 3] = [("cup_x", carried), ("cup_y", |_| 0.11), ("cup_z", |passed| lifted(passed) + 0.03)];
    let saucer: [Column; 3] = [("saucer_x", |_| 0.5), ("saucer_y", still), ("saucer_z", |_| 0.08)];
    let scene = placed_scene(&[&columns[..], &cup_of_log, &saucer].concat());
    let cup = line(&scene, "cup");
    // 80 mm between the tips, each 10 mm from its skin; from 10 mm below the lower tip to 10 mm above the upper one.
    assert!(cup.contains("{cylinder: [30 mm, 40 mm], at: [0 mm, -10 mm, -40 mm]}"), "{cup}");
    // It rests with its origin at 130 mm, 60 mm above its lower end.
    assert!(scene.contains("table: {role: support, position: [100 mm, 110 mm, 60 mm], parts:"), "{scene}");
    // What never moves stands on the table, whose top is at 70 mm.
    let saucer = line(&scene, "saucer");
    assert!(
        saucer.contains("{role: object, parts: [{box: [50 mm, 50 mm, 20 mm], at: [0 mm, 0 mm, 0 mm]}]}"),
        "{saucer}"
    );
    // One that is lower shows that the cup is higher.
    let lower: [Column; 3] = [("saucer_x", |_| 0.5), ("saucer_y", still), ("saucer_z", |_| 0.03)];
    let scene = placed_scene(&[&columns[..], &cup_of_log, &lower].concat());
    assert!(line(&scene, "cup").contains("{cylinder: [30 mm, 90 mm], at: [0 mm, -10 mm, -65 mm]}"), "{scene}");
    assert!(line(&scene, "saucer").contains("{box: [50 mm, 50 mm, 20 mm], at: [0 mm, 0 mm, 0 mm]}"), "{scene}");
}

#[test]
fn markers_that_no_fingertip_carries_are_as_large_as_they_are_apart() {
    let columns: [Column; 12] = [
        // The tool leaves what it has pushed.
        ("tcp_x", |passed| carried(passed) - (passed - 0.85).max(0.0)),
        ("tcp_y", still),
        ("tcp_z", set_down_higher),
        ("jug_1_x", carried),
        ("jug_1_y", |_| 0.1),
        ("jug_1_z", set_down_higher),
        ("jug_2_x", carried),
        ("jug_2_y", |_| 0.16),
        ("jug_2_z", |passed| set_down_higher(passed) + 0.08),
        ("jug_3_x", carried),
        ("jug_3_y", |_| 0.13),
        ("jug_3_z", |passed| set_down_higher(passed) + 0.08),
    ];
    let scene = placed_scene(&columns);
    assert!(line(&scene, "jug").contains("{box: [20 mm, 60 mm, 80 mm], at: [0 mm, 0 mm, -13 mm]}"), "{scene}");
    assert!(scene.contains("  support: {role: support"), "{scene}");
}
