//! The names of bodies.

use super::{Column, along, binding, binding_of, channel, lift, proposed, still};

#[test]
fn names_of_bodies_are_without_those_of_their_sources() {
    let names =
        ["/perception/drawer/pose", "/vrpn_mocap/block/pose", "datagen_info/object_poses/cubeA.position", "obs/object"];
    let titles: Vec<String> =
        names.iter().flat_map(|name| ["x", "y", "z"].map(|axis| format!("{name}.{axis}"))).collect();
    let ways: [fn(f64) -> f64; 12] = [along, still, lift, lift, still, along, along, along, still, still, still, along];
    let columns: Vec<Column> = titles.iter().map(String::as_str).zip(ways).collect();
    let found = binding(&columns);
    for (name, body) in names.iter().zip(["drawer", "block", "cubeA", "object"]) {
        let is_bound = channel(&found, &format!("{body}.position")).is_some_and(|columns| columns.contains(name));
        assert!(is_bound, "{name}: {found}");
    }
}

#[test]
fn bodies_of_several_sources_keep_their_names() {
    let pairs = [["cube", "perception_cube"], ["tracker_block", "object_block"], ["Vicon_Cube", "optitrack_cube"]];
    for names in pairs {
        let titles: Vec<String> =
            names.iter().flat_map(|name| ["x", "y", "z"].map(|axis| format!("{name}_{axis}"))).collect();
        // The second one moves.
        let ways: [fn(f64) -> f64; 6] = [still, still, still, along, still, lift];
        let columns: Vec<Column> = titles.iter().map(String::as_str).zip(ways).collect();
        let found = binding(&columns);
        for name in names {
            assert_eq!(channel(&found, &format!("{name}.position")), Some(format!("{name}_<xyz>").as_str()), "{found}");
        }
    }
}

/// A tracker and the simulation measure one cube, which moves.
#[test]
fn two_measurements_of_one_body_are_one_body() {
    let with = |x: fn(f64) -> f64| {
        let titles: Vec<String> = ["perception_cube", "cube"]
            .iter()
            .flat_map(|name| ["x", "y", "z"].map(|axis| format!("{name}_{axis}")))
            .collect();
        let ways: [fn(f64) -> f64; 6] = [x, still, lift, along, still, lift];
        let columns: Vec<Column> = titles.iter().map(String::as_str).zip(ways).collect();
        binding(&columns)
    };
    let found = with(|passed| along(passed) + 0.02);
    assert_eq!(channel(&found, "cube.position"), Some("cube_<xyz>"), "{found}");
    assert_eq!(channel(&found, "perception_cube.position"), None, "{found}");
    assert!(found.contains("#   perception_cube_<xyz>    (another measurement of cube)"), "{found}");
    let found = with(|passed| along(passed) + 0.2);
    assert!(channel(&found, "perception_cube.position").is_some(), "{found}");
}

/// `a` after a name is an acceleration, unless `b` is there too.
#[test]
fn letters_of_several_bodies_are_in_their_names() {
    let titles: Vec<String> = ["box_a", "box_b", "hand_a"]
        .iter()
        .flat_map(|name| ["x", "y", "z"].map(|axis| format!("{name}_{axis}")))
        .collect();
    let ways: [fn(f64) -> f64; 9] = [along, still, lift, still, still, still, along, along, lift];
    let columns: Vec<Column> = titles.iter().map(String::as_str).zip(ways).collect();
    let found = binding(&columns);
    for name in ["box_a", "box_b"] {
        assert_eq!(channel(&found, &format!("{name}.position")), Some(format!("{name}_<xyz>").as_str()), "{found}");
    }
    assert_eq!(channel(&found, "right.tcp.position"), None, "{found}");
}

#[test]
fn a_hand_that_does_not_move_is_no_object() {
    let titles: Vec<String> = ["right_palm", "left_palm", "tool_rack"]
        .iter()
        .flat_map(|name| ["x", "y", "z"].map(|axis| format!("{name}_{axis}")))
        .collect();
    let ways: [fn(f64) -> f64; 9] = [along, still, lift, still, still, still, still, still, still];
    let columns: Vec<Column> = titles.iter().map(String::as_str).zip(ways).collect();
    let found = binding(&columns);
    assert_eq!(channel(&found, "left_palm.position"), None, "{found}");
    assert!(channel(&found, "tool_rack.position").is_some(), "{found}");
    // It is named nevertheless, with its columns.
    assert!(found.contains("  #   left_palm_<xyz>    (it never moves, and its name is that of a hand"), "{found}");
}

#[test]
fn a_stand_for_a_tool_is_an_object() {
    let titles: Vec<String> = ["tcp", "tool_rest", "robot_home"]
        .iter()
        .flat_map(|name| ["x", "y", "z"].map(|axis| format!("{name}_{axis}")))
        .collect();
    let ways: [fn(f64) -> f64; 9] = [along, still, lift, still, still, still, still, still, |_| 0.3];
    let (binding, scene) = proposed(&titles.iter().map(String::as_str).zip(ways).collect::<Vec<Column>>());
    assert_eq!(channel(&binding, "tool_rest.position"), Some("tool_rest_<xyz>"), "{binding}");
    assert!(scene.contains("  tool_rest: "), "{scene}");
    assert_eq!(channel(&binding, "robot_home.position"), None, "{binding}");
    assert!(binding.contains("  #   robot_home_<xyz>    ("), "{binding}");
}

/// Motive states how well markers fit their rigid body.
#[test]
fn a_marker_error_is_the_residual_of_the_tracker() {
    let columns: [Column; 5] = [
        ("tcp_x", along),
        ("tcp_y", still),
        ("tcp_z", lift),
        ("Cup.Mean Marker Error", along),
        ("tracking_error", along),
    ];
    let found = binding(&columns);
    assert!(found.contains("Cup.Mean Marker Error    (the residual of the tracker)"), "{found}");
    assert!(found.contains("tracking_error    (relative to something)"), "{found}");
}

/// Beside a tool point, what is worn at a hand is an object; alone, it is the tool point.
#[test]
fn a_glove_beside_a_tool_is_an_object() {
    let bound = |names: &[&str]| {
        let titles: Vec<String> =
            names.iter().flat_map(|name| ["x", "y", "z"].map(|axis| format!("{name}_{axis}"))).collect();
        let ways: [fn(f64) -> f64; 6] = [along, still, lift, lift, still, along];
        binding(&titles.iter().map(String::as_str).zip(ways).collect::<Vec<Column>>())
    };
    for [tool, object] in [["tcp", "glove"], ["palm", "oven_glove"], ["tcp", "bracelet"], ["flange", "glove"]] {
        let found = bound(&[tool, object]);
        let position = format!("{object}_<xyz>");
        assert_eq!(channel(&found, &format!("{object}.position")), Some(position.as_str()), "{found}");
    }
    for [tool, object] in [["glove", "cup"], ["bracelet_link", "cup"], ["left_glove", "cup"]] {
        let found = bound(&[tool, object]);
        assert_eq!(channel(&found, &format!("{tool}.position")), None, "{found}");
        assert!(found.contains(&format!(": {tool}_<xyz>")), "{found}");
    }
}

/// A camera of 3 by 4 pixels, which move as positions do, in columns of a number each; and a grid of the same form that is not of bytes.
#[test]
fn bytes_with_several_indices_are_an_image() {
    let names: Vec<String> = (0..3).flat_map(|row| (0..4).map(move |at| format!("[{row}][{at}]"))).collect();
    let of = |array: &str, value: fn(f64) -> f64| {
        let names: Vec<String> = names.iter().map(|name| format!("{array}{name}")).collect();
        let mut columns: Vec<Column> = vec![("tcp_x", along), ("tcp_y", along), ("tcp_z", lift)];
        columns.extend(names.iter().map(|name| (name.as_str(), value)));
        proposed(&columns)
    };
    let (binding, scene) = of("images/top", |passed| (20.0 + 200.0 * passed).floor());
    assert!(binding.contains("(an image, as all 12 columns of images/top)"), "{binding}");
    assert_eq!(binding.matches("  #   ").count(), 1, "{binding}");
    assert!(channel(&binding, "right.tcp.position") == Some("tcp_<xyz>"), "{binding}");
    assert!(!scene.contains("top"), "{scene}");
    let (binding, _) = of("images/top", |passed| 0.2 + passed);
    assert!(!binding.contains("an image"), "{binding}");
    // Few numbers of an array without such a name may be those of pads.
    let (binding, _) = of("tactile", |passed| (20.0 + 200.0 * passed).floor());
    assert!(!binding.contains("an image") && binding.matches("  #   tactile").count() > 1, "{binding}");
}

/// An array without the name of an image: 9 by 8 bytes are one, two objects with positions in whole mm are none.
#[test]
fn whole_coordinates_of_objects_are_no_image() {
    let of = |rows: usize, columns: usize| {
        let names: Vec<String> =
            (0..rows).flat_map(|row| (0..columns).map(move |at| format!("objects[{row}][{at}]"))).collect();
        let ways: [fn(f64) -> f64; 6] = [
            |passed| (10.0 + 190.0 * passed).floor(),
            |_| 50.0,
            |passed| (500.0 * lift(passed)).floor(),
            |_| 120.0,
            |passed| (200.0 - 90.0 * passed).floor(),
            |_| 20.0,
        ];
        let mut all: Vec<Column> = vec![("tcp_x", along), ("tcp_y", still), ("tcp_z", lift)];
        all.extend(names.iter().map(String::as_str).zip(ways.into_iter().cycle()));
        proposed(&all)
    };
    let (binding, scene) = of(2, 3);
    for name in ["objects_0", "objects_1"] {
        assert!(channel(&binding, &format!("{name}.position")).is_some(), "{binding}");
        assert!(scene.contains(&format!("  {name}: ")), "{scene}");
    }
    let (binding, _) = of(9, 8);
    assert!(binding.contains("(an image, as all 72 columns of objects)"), "{binding}");
}

/// A rigid body on the back of a hand, and where a robot begins and ends in a demonstration.
#[test]
fn the_back_of_a_hand_is_a_hand_and_the_ends_of_a_demonstration_are_no_objects() {
    for name in ["BackOfHand", "hand_back"] {
        let names = ["x", "y", "z"].map(|axis| format!("{name}_{axis}"));
        let ways: [fn(f64) -> f64; 3] = [along, along, lift];
        let columns: Vec<Column> = names.iter().map(String::as_str).zip(ways).collect();
        let found = binding(&columns);
        assert_eq!(channel(&found, "right.tcp.position"), Some(format!("{name}_<xyz>").as_str()), "{found}");
    }
    let columns: [Column; 6] = [
        ("robot0_eef_pos_x", along),
        ("robot0_eef_pos_y", still),
        ("robot0_eef_pos_z", lift),
        ("robot0_demo_start_pose_x", |_| 0.4),
        ("robot0_demo_start_pose_y", still),
        ("robot0_demo_start_pose_z", still),
    ];
    let (_, scene) = proposed(&columns);
    assert!(!scene.contains("demo"), "{scene}");
}

/// A replay buffer of UMI without stamps.
#[test]
fn rows_of_umi_have_the_rate_of_its_camera() {
    let names = "robot0_demo_start_pose[0],robot0_eef_rot_axis_angle[0],robot0_gripper_width[0]";
    let rows: String =
        (0..50).map(|row| format!("0.4,{:.3},{:.3}\n", lift(f64::from(row) / 50.0), still(0.0))).collect();
    let found = binding_of(&format!("{names}\n{rows}"));
    assert!(found.contains("rate: 59.94 Hz"), "{found}");
    let found = binding_of(&format!("{}\n{rows}", names.replace("demo_start", "other")));
    assert!(found.contains("rate: 100 Hz"), "{found}");
}

#[test]
fn names_of_bodies_without_frames_and_quantities() {
    let (found, _) = proposed(&[
        ("eePosX", along),
        ("eePosY", still),
        ("eePosZ", lift),
        ("bottlePosX", along),
        ("bottlePosY", still),
        ("bottlePosZ", lift),
        ("bottleQuatX", |_| 0.0),
        ("bottleQuatY", |_| 0.0),
        ("bottleQuatZ", |_| 0.6),
        ("bottleQuatW", |_| 0.8),
        ("T_base_cube.position.x", still),
        ("T_base_cube.position.y", along),
        ("T_base_cube.position.z", lift),
    ]);
    for line in [
        "right.tcp.position: eePos<XYZ>",
        "bottle.position: bottlePos<XYZ>",
        "bottle.rotation: bottleQuat<WXYZ>",
        "cube.position: T_base_cube.position.<xyz>",
    ] {
        assert!(found.contains(line), "{found}");
    }
}

#[test]
fn the_segment_of_a_subject_of_the_same_name_does_not_repeat_it() {
    let (found, _) = proposed(&[
        ("Gripper:Gripper.TX [mm]", along),
        ("Gripper:Gripper.TY [mm]", still),
        ("Gripper:Gripper.TZ [mm]", lift),
        ("Cup:Cup.TX [mm]", along),
        ("Cup:Cup.TY [mm]", still),
        ("Cup:Cup.TZ [mm]", lift),
    ]);
    assert_eq!(channel(&found, "Cup.position"), Some("\"Cup:Cup.T<XYZ>\""), "{found}");
}

#[test]
fn a_gap_of_fingers_is_not_the_way_of_one() {
    let (found, _) = proposed(&[("finger_gap", |passed| if passed < 0.5 { 0.08 } else { 0.04 })]);
    assert!(found.contains("right.gripper.opening: finger_gap [m]"), "{found}");
}
