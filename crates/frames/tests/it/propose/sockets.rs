//! Proposed sockets: bodies that never move, and that others are put into or drawn out of.

use super::{Column, placed_scene};

/// Drawn up out of a hole at 0.3, carried to the side, and put on the table.
const X: fn(f64) -> f64 = |passed| 0.3 + 0.2 * between(passed, 0.55, 0.65);
const Y: fn(f64) -> f64 = |_| 0.1;
const Z: fn(f64) -> f64 = |passed| {
    0.07 + 0.04 * between(passed, 0.3, 0.4) + 0.1 * between(passed, 0.42, 0.52) - 0.16 * between(passed, 0.7, 0.85)
};

/// Held from 0.2 on.
const WIDTH: fn(f64) -> f64 = |passed| if (0.2..0.9).contains(&passed) { 0.03 } else { 0.08 };
/// 2 N of weight when the peg is off, and 6 N of friction in the hole.
const FORCE: fn(f64) -> f64 = |passed| match passed {
    passed if (0.3..0.4).contains(&passed) => 8.0,
    passed if (0.4..0.84).contains(&passed) => 2.0,
    _ => 0.0,
};

/// The part of a way that has passed.
fn between(passed: f64, from: f64, to: f64) -> f64 {
    ((passed - from) / (to - from)).clamp(0.0, 1.0)
}

/// The scene of a peg on this way, and of a block that stands at this height below the way in or out.
fn scene(block: &str, way: [fn(f64) -> f64; 3], place: [fn(f64) -> f64; 3], force: Option<fn(f64) -> f64>) -> String {
    let names = ["x", "y", "z"].map(|axis| format!("{block}_{axis}"));
    let mut columns: Vec<Column> =
        vec![("gripper_width", WIDTH), ("tcp_x", way[0]), ("tcp_y", way[1]), ("tcp_z", way[2])];
    columns.extend(["peg_x", "peg_y", "peg_z"].into_iter().zip(way));
    columns.extend(names.iter().map(String::as_str).zip(place));
    if let Some(force) = force {
        columns.extend([("wrench_fx", Y), ("wrench_fy", Y), ("wrench_fz", force)]);
    }
    placed_scene(&columns)
}

fn line<'a>(scene: &'a str, body: &str) -> &'a str {
    scene.lines().find(|line| line.starts_with(&format!("  {body}: "))).unwrap_or_else(|| panic!("{body}: {scene}"))
}

#[test]
fn friction_shows_the_hole_that_a_peg_is_drawn_out_of() {
    let place: [fn(f64) -> f64; 3] = [|_| 0.3, Y, |_| 0.03];
    let found = scene("block", [X, Y, Z], place, Some(FORCE));
    let block = line(&found, "block");
    // The peg leaves the hole at 110 mm, 80 mm above the origin of the block.
    assert!(block.contains("{role: socket, sockets: {hole: {rim: [0 mm, 0 mm, 79 mm], axis: [0, 0, 1]"), "{block}");
    assert!(
        block.contains("peg moves straight on from a contact there; the rim is where the origin of peg enters: "),
        "{block}"
    );
    assert!(block.contains("with the edge of the hole instead, set `plug` of peg to its lower end"), "{block}");
    // Without friction it may have stood on the block.
    let no_friction: fn(f64) -> f64 = |passed| FORCE(passed).min(2.0);
    for force in [Some(no_friction), None] {
        let found = scene("block", [X, Y, Z], place, force);
        let block = line(&found, "block");
        assert!(block.contains("{role: support, "), "{block}");
        let hole =
            "if peg is in a hole there: `{role: socket, sockets: {hole: {rim: [0 mm, 0 mm, 60 mm], axis: [0, 0, 1], ";
        assert!(block.contains(hole), "{block}");
    }
}

#[test]
fn a_body_below_the_origin_of_one_that_never_moves_is_inside_it() {
    let place: [fn(f64) -> f64; 3] = [|_| 0.3, Y, |_| 0.09];
    // Drawn out, and put in.
    let backward: [fn(f64) -> f64; 3] = [|passed| X(1.0 - passed), Y, |passed| Z(1.0 - passed)];
    for way in [[X, Y, Z], backward] {
        let found = scene("block", way, place, None);
        let block = line(&found, "block");
        assert!(block.contains("{role: socket, sockets: {hole: {rim: [0 mm, 0 mm, 0 mm], axis: [0, 0, 1]"), "{block}");
        assert!(block.contains("below its origin; the rim is where the origin of peg enters: "), "{block}");
    }
    // Containers are wide, and a body beside the axis is not in a hole.
    let found = scene("basket", [X, Y, Z], place, None);
    assert!(!line(&found, "basket").starts_with("  basket: {role: socket"), "{found}");
    let beside: [fn(f64) -> f64; 3] = [|_| 0.308, Y, |_| 0.09];
    let found = scene("block", [X, Y, Z], beside, None);
    assert!(!found.contains("role: socket, sockets"), "{found}");
}

#[test]
fn a_socket_by_its_name_is_within_reach_of_the_tip() {
    // The peg begins at 70 mm.
    let near = scene("port", [X, Y, Z], [|_| 0.3, Y, |_| 0.0], None);
    assert!(line(&near, "port").contains("{role: socket, sockets: {hole: "), "{near}");
    let far = scene("port", [X, Y, Z], [|_| 0.3, Y, |_| -0.1], None);
    assert!(!far.contains("sockets: {hole"), "{far}");
}

/// A tool comes down, presses with 12 N while it goes across a table, and goes up again: most of its way is in contact.
#[test]
fn a_tool_that_presses_for_most_of_its_way_enters_no_socket() {
    let scene = placed_scene(&[
        ("tcp_x", |passed| 0.3 * between(passed, 0.4, 0.65)),
        ("tcp_y", |_| 0.0),
        ("tcp_z", |passed| 0.1 - 0.1 * between(passed, 0.1, 0.25) + 0.1 * between(passed, 0.8, 0.95)),
        ("wrench_fx", |passed| 0.04 * (40.0 * passed).sin()),
        ("wrench_fy", |passed| 0.04 * (50.0 * passed).cos()),
        ("wrench_fz", |passed| if (0.26..0.75).contains(&passed) { 12.0 } else { 0.0 }),
    ]);
    assert!(scene.contains("tool: {role: object"), "{scene}");
    assert!(!scene.contains("role: socket"), "{scene}");
}

#[test]
fn what_never_moves_ahead_of_a_way_is_no_socket() {
    type Way = [fn(f64) -> f64; 3];
    // Slid along the table towards a lamp.
    let slid: [fn(f64) -> f64; 3] = [|passed| 0.3 + 0.15 * between(passed, 0.35, 0.6), Y, |_| 0.02];
    // Lifted below a hook, carried to the side, and put down.
    let height: fn(f64) -> f64 = |passed| 0.02 + 0.12 * (between(passed, 0.3, 0.45) - between(passed, 0.7, 0.85));
    let lifted: [fn(f64) -> f64; 3] = [X, Y, height];
    let cases: [(&str, Way, Way); 2] =
        [("lamp", slid, [|_| 0.55, Y, |_| 0.02]), ("hook", lifted, [|_| 0.3, Y, |_| 0.3])];
    for (name, way, place) in cases {
        let found = scene(name, way, place, None);
        assert!(!found.contains("sockets: {hole"), "{found}");
    }
}

#[test]
fn a_contact_shows_a_socket_where_another_body_rests() {
    let columns: [Column; 16] = [
        ("gripper_width", WIDTH),
        ("tcp_x", X),
        ("tcp_y", Y),
        ("tcp_z", Z),
        // Put on the block once the hole is empty.
        ("cube_x", |passed| 0.6 - 0.3 * between(passed, 0.84, 0.88)),
        ("cube_y", Y),
        ("cube_z", |passed| 0.29 - 0.2 * between(passed, 0.9, 0.95)),
        ("peg_x", X),
        ("peg_y", Y),
        ("peg_z", Z),
        ("block_x", |_| 0.3),
        ("block_y", Y),
        ("block_z", |_| 0.03),
        ("wrench_fx", Y),
        ("wrench_fy", Y),
        ("wrench_fz", FORCE),
    ];
    let found = placed_scene(&columns);
    let block = line(&found, "block");
    assert!(block.contains("{role: socket, ") && block.contains("peg moves straight on from a contact"), "{block}");
}
