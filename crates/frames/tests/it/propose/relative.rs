//! Positions relative to a tool, in the arrays of robosuite: positions and quaternions of objects, and of objects in the frame of the gripper.

use super::{Column, along, binding, channel, lift, still};

#[test]
fn a_position_with_the_length_of_a_distance_from_the_tool_is_relative() {
    let one: fn(f64) -> f64 = |_| 1.0;
    let zero: fn(f64) -> f64 = |_| 0.0;
    let tool: [fn(f64) -> f64; 3] = [along, still, lift];
    let object: [fn(f64) -> f64; 3] = [|_| 0.7, |_| 0.2, |_| 0.02];
    let other: [fn(f64) -> f64; 3] = [|_| 0.5, |_| -0.1, |_| 0.02];
    // From the tool in a turned frame.
    let relative: [fn(f64) -> f64; 3] = [|_| 0.1, |passed| 0.02 - lift(passed), |passed| along(passed) - 0.7];
    let turn = [zero, zero, zero, one];
    let turned: [fn(f64) -> f64; 4] = [zero, zero, |passed| (0.3 * passed).sin(), |passed| (0.3 * passed).cos()];
    let values: Vec<fn(f64) -> f64> =
        [&object[..], &turn, &relative, &turned, &other, &turn].into_iter().flatten().copied().collect();
    let names: Vec<String> = (0..values.len()).map(|at| format!("object[{at}]")).collect();
    let mut columns: Vec<Column> = ["eef_pos[0]", "eef_pos[1]", "eef_pos[2]"].into_iter().zip(tool).collect();
    columns.extend(names.iter().map(String::as_str).zip(values));
    let found = binding(&columns);
    assert_eq!(channel(&found, "object.position"), Some("object[<xyz=0 1 2>]"), "{found}");
    assert_eq!(channel(&found, "object_3.position"), Some("object[<xyz=14 15 16>]"), "{found}");
    assert_eq!(channel(&found, "object_3.rotation"), Some("object[<xyzw=17 18 19 20>]"), "{found}");
    let why = "(relative: its length is the distance between eef_pos<xyz=[0] [1] [2]> and object[<xyz=0 1 2>])";
    for left_out in ["object[<xyz=7 8 9>]", "object[<xyzw=10 11 12 13>]"] {
        assert!(found.contains(&format!("#   {left_out}    {why}")), "{found}");
    }
}

#[test]
fn what_a_hand_holds_is_not_relative_to_an_object_in_the_origin() {
    let zero: fn(f64) -> f64 = |_| 0.0;
    // A peg 1 mm above the tool point.
    let above: fn(f64) -> f64 = |passed| lift(passed) + 0.001;
    let beside: fn(f64) -> f64 = |_| 0.004;
    for block_y in [zero, beside] {
        let columns: [Column; 9] = [
            ("tcp_x", along),
            ("tcp_y", still),
            ("tcp_z", lift),
            ("peg_x", along),
            ("peg_y", still),
            ("peg_z", above),
            ("block_x", zero),
            ("block_y", block_y),
            ("block_z", zero),
        ];
        let found = binding(&columns);
        assert_eq!(channel(&found, "peg.position"), Some("peg_<xyz>"), "{found}");
    }
}

/// The log begins just before the object is taken, so that the relative position is still in more rows than the object.
#[test]
fn what_is_carried_in_most_rows_is_an_object() {
    let zero: fn(f64) -> f64 = |_| 0.0;
    let one: fn(f64) -> f64 = |_| 1.0;
    let tool: [fn(f64) -> f64; 3] = [|passed| 0.2 + 0.5 * passed, still, |passed| 1.0 + 0.1 * (9.0 * passed).sin()];
    let object: [fn(f64) -> f64; 3] =
        [|passed| 0.35 + 0.5 * (passed - 0.2).max(0.0), |_| 0.2, |passed| 0.9 + 0.1 * (9.0 * passed.max(0.2)).sin()];
    let relative: [fn(f64) -> f64; 3] = [
        |passed| 0.15 + 0.5 * ((passed - 0.2).max(0.0) - passed),
        |_| 0.1,
        |passed| -0.1 + 0.1 * ((9.0 * passed.max(0.2)).sin() - (9.0 * passed).sin()),
    ];
    let to_object: [fn(f64) -> f64; 3] = [
        |passed| -0.15 - 0.5 * ((passed - 0.2).max(0.0) - passed),
        |_| -0.1,
        |passed| 0.1 - 0.1 * ((9.0 * passed.max(0.2)).sin() - (9.0 * passed).sin()),
    ];
    let turn = [zero, zero, zero, one];
    for of_tool in [relative, to_object] {
        let values: Vec<fn(f64) -> f64> =
            [&of_tool[..], &turn, &object, &turn].into_iter().flatten().copied().collect();
        let names: Vec<String> = (0..values.len()).map(|at| format!("object[{at}]")).collect();
        let mut columns: Vec<Column> = ["eef_pos[0]", "eef_pos[1]", "eef_pos[2]"].into_iter().zip(tool).collect();
        columns.extend(names.iter().map(String::as_str).zip(values));
        let found = binding(&columns);
        assert_eq!(channel(&found, "object.position"), Some("object[<xyz=7 8 9>]"), "{found}");
        assert_eq!(channel(&found, "object_2.position"), None, "{found}");
    }
}

/// robosuite writes each object twice: under its name, and in the array of all objects.
#[test]
fn a_copy_of_a_position_is_no_object() {
    let zero: fn(f64) -> f64 = |_| 0.0;
    let one: fn(f64) -> f64 = |_| 1.0;
    let cube: [fn(f64) -> f64; 3] = [along, |_| 0.2, lift];
    let plate: [fn(f64) -> f64; 3] = [|_| 0.5, |_| -0.1, |_| 0.02];
    let turn = [zero, zero, zero, one];
    let values: Vec<fn(f64) -> f64> = [&cube[..], &turn, &plate, &turn].into_iter().flatten().copied().collect();
    let names: Vec<String> = (0..values.len()).map(|at| format!("object[{at}]")).collect();
    let mut columns: Vec<Column> = names.iter().map(String::as_str).zip(values).collect();
    columns.extend(["eef_pos[0]", "eef_pos[1]", "eef_pos[2]"].into_iter().zip([along, still, lift]));
    columns.extend(["zcube_pos[0]", "zcube_pos[1]", "zcube_pos[2]"].into_iter().zip(cube));
    columns.extend(["zplate_pos[0]", "zplate_pos[1]", "zplate_pos[2]"].into_iter().zip(plate));
    let found = binding(&columns);
    assert_eq!(channel(&found, "zcube.position"), Some("zcube_pos<xyz=[0] [1] [2]>"), "{found}");
    assert_eq!(channel(&found, "zplate.position"), Some("zplate_pos<xyz=[0] [1] [2]>"), "{found}");
    assert_eq!(channel(&found, "object.position"), None, "{found}");
    assert!(found.contains("#   object[<xyz=0 1 2>]    (a copy of zcube_pos<xyz=[0] [1] [2]>)"), "{found}");
    // Its rotation is nowhere else in the log.
    assert_eq!(channel(&found, "zcube.rotation"), Some("object[<xyzw=3 4 5 6>]"), "{found}");
}

/// The state of MuJoCo as robosuite stores it: time, joints, poses of free bodies with w first, velocities. One body lies at a height of nearly zero.
#[test]
fn free_bodies_of_a_state_are_objects_where_no_other_is_known() {
    let one: fn(f64) -> f64 = |_| 1.0;
    let zero: fn(f64) -> f64 = |_| 0.0;
    let cube: [fn(f64) -> f64; 7] = [along, still, lift, one, zero, zero, zero];
    let plate: [fn(f64) -> f64; 7] = [|_| 0.6, |_| 0.2, |_| 0.004, one, zero, zero, zero];
    let values: Vec<fn(f64) -> f64> =
        [&[along, still, along][..], &cube, &plate, &[along, along]].into_iter().flatten().copied().collect();
    let names: Vec<String> = (0..values.len()).map(|at| format!("states[{at}]")).collect();
    let mut columns: Vec<Column> =
        ["eef_pos[0]", "eef_pos[1]", "eef_pos[2]"].into_iter().zip([along, still, lift]).collect();
    columns.extend(names.iter().map(String::as_str).zip(values));
    let found = binding(&columns);
    assert_eq!(channel(&found, "object.position"), Some("states[<xyz=3 4 5>]"), "{found}");
    assert_eq!(channel(&found, "object.rotation"), Some("states[<wxyz=6 7 8 9>]"), "{found}");
    assert_eq!(channel(&found, "object_2.position"), Some("states[<xyz=10 11 12>]"), "{found}");
    assert_eq!(channel(&found, "right.tcp.position"), Some("eef_pos<xyz=[0] [1] [2]>"), "{found}");
    // Bodies with names count instead.
    let named: [Column; 3] = [("mug_x", along), ("mug_y", still), ("mug_z", lift)];
    columns.extend(named);
    let found = binding(&columns);
    assert_eq!(channel(&found, "object.position"), None, "{found}");
    assert_eq!(channel(&found, "mug.position"), Some("mug_<xyz>"), "{found}");
}
