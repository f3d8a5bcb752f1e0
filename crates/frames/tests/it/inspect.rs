//! Columns that belong together, as a proposed binding groups them.

use teachtree_frames::inspect::{ColumnReport, ValueKind};
use teachtree_frames::propose::{Form, groups};

fn column(name: &str, samples: &[f64]) -> ColumnReport {
    let ends = samples.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), it| (low.min(*it), high.max(*it)));
    ColumnReport {
        name: name.into(),
        unit: String::new(),
        kind: ValueKind::Number,
        min: ends.0,
        max: ends.1,
        noise: 0.0,
        missing: 0.0,
        texts: vec![],
        repeated_s: 0.0,
        repeated_share: 0.0,
        groups: None,
        samples: samples.to_vec(),
    }
}

fn patterns(columns: &[(&str, &[f64])]) -> Vec<(String, Form)> {
    let columns: Vec<ColumnReport> = columns.iter().map(|(name, samples)| column(name, samples)).collect();
    let named: Vec<(String, &ColumnReport)> = columns.iter().map(|column| (column.name.clone(), column)).collect();
    groups(&named).into_iter().map(|group| (group.pattern, group.form)).collect()
}

fn plain(names: &[&str]) -> Vec<String> {
    let columns: Vec<(&str, &[f64])> = names.iter().map(|name| (*name, &[0.0, 0.5][..])).collect();
    patterns(&columns).into_iter().map(|(pattern, _)| pattern).collect()
}

#[test]
fn numbered_columns_are_not_a_vector() {
    assert_eq!(plain(&["pos_1", "pos_2", "pos_3"]), ["pos<xyz=_1 _2 _3>"]);
    let joints = ["joint_1", "joint_2", "joint_3", "joint_4", "joint_5", "joint_6", "joint_7"];
    assert_eq!(plain(&joints), joints);
    assert_eq!(plain(&["q_0", "q_1", "q_2", "q_3"]), ["q_0", "q_1", "q_2", "q_3"]);
    assert_eq!(plain(&["tip_x_mm", "tip_y_mm", "tip_z_mm", "comma"]), ["tip_<xyz>_mm", "comma"]);
    assert_eq!(plain(&["x", "y", "z", "Fx", "Fy", "Fz"]), ["<xyz>", "F<xyz>"]);
    // Letters of a component elsewhere in the name.
    assert_eq!(plain(&["box_max_x", "box_max_y", "box_max_z"]), ["box_max_<xyz>"]);
    assert_eq!(plain(&["x_max", "y_max", "z_max"]), ["<xyz>_max"]);
}

/// The groups of an array with these elements after a position.
fn pose(values: [&[f64]; 4]) -> Vec<(String, Form)> {
    let at: &[f64] = &[0.1, 0.4];
    let names = ["p[0]", "p[1]", "p[2]", "p[3]", "p[4]", "p[5]", "p[6]"];
    patterns(&names.into_iter().zip([at, at, at].into_iter().chain(values)).collect::<Vec<_>>())
}

#[test]
fn the_norm_of_one_shows_a_rotation() {
    let half = 0.5_f64.sqrt();
    let (one, zero, turned): (&[f64], &[f64], &[f64]) = (&[1.0, half], &[0.0, 0.0], &[0.0, half]);
    let found = pose([one, zero, zero, turned]);
    assert_eq!(found, [("p[<xyz=0 1 2>]".into(), Form::Vector), ("p[<wxyz=3 4 5 6>]".into(), Form::Quaternion)]);
    assert_eq!(pose([zero, zero, turned, one])[1], ("p[<xyzw=3 4 5 6>]".into(), Form::Quaternion));
    // Four numbers that are called so and are none.
    let at: &[f64] = &[0.1, 0.4];
    let named = patterns(&[("aw", at), ("ax", at), ("ay", at), ("az", at)]);
    assert_eq!(named[1].0, "a<xyz>");
    let named = patterns(&[("qw", one), ("qx", zero), ("qy", zero), ("qz", turned)]);
    assert_eq!(named, [("q<wxyz>".into(), Form::Quaternion)]);
    let named = patterns(&[("screw_qx", zero), ("screw_qy", zero), ("screw_qz", turned), ("screw_qw", one)]);
    assert_eq!(named, [("screw_q<wxyz>".into(), Form::Quaternion)]);
}

#[test]
fn three_columns_that_turn_are_a_rotation() {
    let found = |names: [&str; 3], values: [&[f64]; 3]| {
        let columns: Vec<(&str, &[f64])> = names.into_iter().zip(values).collect();
        patterns(&columns).remove(0)
    };
    let small: &[f64] = &[0.1, 0.4];
    // Down and turned about the vertical: no pitch is this large.
    let beyond: &[f64] = &[3.0, 3.1];
    let degrees: &[f64] = &[170.0, 180.0];
    let r = ["tcp_rx", "tcp_ry", "tcp_rz"];
    assert_eq!(found(r, [small; 3]), ("tcp_r<rotvec=x y z>".into(), Form::RotationVector));
    assert_eq!(found(r, [degrees, small, small]), ("tcp_r<rpy=x y z>".into(), Form::Angles));
    assert_eq!(found(["r_x", "r_y", "r_z"], [small; 3]), ("r_<xyz>".into(), Form::Vector));
    let euler = ["euler_x", "euler_y", "euler_z"];
    assert_eq!(found(euler, [small; 3]), ("euler_<rpy=x y z>".into(), Form::Angles));
    let orientation = ["orientation[0]", "orientation[1]", "orientation[2]"];
    assert_eq!(found(orientation, [small; 3]), ("orientation<rpy=[0] [1] [2]>".into(), Form::Angles));
    assert_eq!(found(orientation, [small, beyond, small]).1, Form::RotationVector);
    let names: Vec<String> = (0..6).map(|at| format!("actual_TCP_pose_{at}")).collect();
    let columns: Vec<(&str, &[f64])> = names.iter().map(|name| (name.as_str(), small)).collect();
    let of_ur = patterns(&columns);
    assert_eq!(of_ur[0], ("actual_TCP_pose_<xyz=0 1 2>".into(), Form::Vector));
    assert_eq!(of_ur[1], ("actual_TCP_pose_<rotvec=3 4 5>".into(), Form::RotationVector));
}
