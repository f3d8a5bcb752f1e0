//! The pads of a gripper follow from its tool point, its rotation and its opening.

use crate::shared::files::folder;
use teachtree_base::recording::Recording;
use teachtree_frames::{OpenRequest, open};

const BINDING: &str = "
pads: {of: tcp, opening: gripper, axis: y}
channels:
  right.tcp.position: p<xyz>
  right.tcp.rotation: [qw, qx, qy, qz]
  right.gripper.opening: width [mm]
scene: {bodies: {cube: {role: object, radius: 20 mm, position: [1 m, 0 m, 0 m]}}}
";

/// The tool turns about x by a quarter, and about z by a quarter; its opening is 80 mm, then 20 mm.
const LOG: &str = "time,px,py,pz,qw,qx,qy,qz,width
0.0,0.1,0.2,0.3,1,0,0,0,80
0.1,0.1,0.2,0.3,0.7071067811865476,0.7071067811865476,0,0,20
0.2,0.1,0.2,0.3,0.7071067811865476,0,0,0.7071067811865476,20
";

fn bound(binding: &str) -> Result<Recording, String> {
    let folder = folder(&[("log.csv", LOG), ("b.yaml", binding)]);
    let path = |name: &str| folder.path().join(name);
    let request = OpenRequest { log: path("log.csv"), binding: Some(path("b.yaml")), ..OpenRequest::default() };
    let opened = open(&request).map_err(|error| error.to_string());
    opened.map(|opened| opened.recording).map_err(|text| text.split_once("b.yaml").unwrap().1.to_string())
}

fn points(recording: &Recording, finger: &str) -> Vec<[f64; 3]> {
    let at = |row: usize| {
        ["x", "y", "z"].map(|axis| recording.columns[&format!("right.{finger}.position.{axis}")].values[row])
    };
    (0..3).map(at).collect()
}

fn assert_near(found: &[[f64; 3]], expected: &[[f64; 3]]) {
    let near = |(one, other): (&f64, &f64)| (one - other).abs() < 1e-12;
    assert!(found.as_flattened().iter().zip(expected.as_flattened()).all(near), "{found:?}, expected {expected:?}");
}

#[test]
fn pads_are_half_the_opening_to_each_side_of_the_tool_point() {
    let recording = bound(BINDING).unwrap();
    // The y axis of the tool points along y, then along z, then against x.
    assert_near(&points(&recording, "thumb"), &[[0.1, 0.24, 0.3], [0.1, 0.2, 0.31], [0.09, 0.2, 0.3]]);
    assert_near(&points(&recording, "index"), &[[0.1, 0.16, 0.3], [0.1, 0.2, 0.29], [0.11, 0.2, 0.3]]);
    assert_near(&points(&recording, "palm"), &[[0.1, 0.2, 0.3]; 3]);
    let along_x = bound(&BINDING.replace("axis: y", "axis: x")).unwrap();
    assert_near(&points(&along_x, "thumb"), &[[0.14, 0.2, 0.3], [0.11, 0.2, 0.3], [0.1, 0.21, 0.3]]);
    // The keys whose value is the usual one may be left out.
    assert_eq!(bound(&BINDING.replace("of: tcp, opening: gripper, ", "")).unwrap(), recording);
}

#[test]
fn pads_need_what_they_follow_from() {
    let lacking = bound(&BINDING.replace("  right.tcp.rotation: [qw, qx, qy, qz]\n", "")).unwrap_err();
    assert!(lacking.starts_with(":2:1: no hand has a tool point with a rotation and an opening"), "{lacking}");
    let twice = bound(&BINDING.replace("channels:\n", "channels:\n  right.index.position: p<xyz>\n")).unwrap_err();
    assert!(twice.starts_with(":2:1: `right.index.position` is bound"), "{twice}");
    let axis = bound(&BINDING.replace("axis: y", "axis: w")).unwrap_err();
    assert!(axis.contains("found `w`, expected one of `x`, `y`, `z`"), "{axis}");
}
