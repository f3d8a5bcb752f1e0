//! What a binding says of what a log lacks: constants, planar poses, points in a frame.

use nalgebra::{UnitQuaternion, Vector3};
use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_base::recording::Recording;
use teachtree_frames::{OpenRequest, open};

const LOG: &str = "time,x,y,theta,hx,hy,hz,hr,hp,hw\n0,10,20,90,1,2,3,0.1,0.2,0.3\n0.1,11,22,91,1,2,3,0.4,0.5,0.6\n0.2,12,24,92,1,2,3,0.7,,0.9\n";

fn opened(folder: &Path, channels: &str) -> Result<Recording, InputError> {
    let binding = format!("channels:\n{channels}\nscene:\n  bodies:\n    block: {{role: object, radius: 30 mm}}\n");
    let [log, file] = ["log.csv", "b.yaml"].map(|name| folder.join(name));
    std::fs::write(&log, LOG).unwrap();
    std::fs::write(&file, binding).unwrap();
    open(&OpenRequest { log, binding: Some(file), ..OpenRequest::default() }).map(|opened| opened.recording)
}

#[test]
fn a_planar_pose_has_constants_for_the_rest() {
    let folder = tempfile::tempdir().unwrap();
    let channels = "  block.position: ['x [mm]', 'y [mm]', = 15 mm]\n  block.rotation: [= 0 rad, = 0 rad, 'theta [deg]']\n  right.gripper.closed: = 1";
    let recording = opened(folder.path(), channels).unwrap();
    let value = |name: &str, row: usize| recording.columns[name].values[row];
    assert_eq!((value("block.position.x", 1), value("block.position.z", 1)), (0.011, 0.015));
    let half = (45.0_f64).to_radians();
    assert!(
        (value("block.rotation.w", 0) - half.cos()).abs() < 1e-12
            && (value("block.rotation.z", 0) - half.sin()).abs() < 1e-12
    );
    assert_eq!(recording.columns["right.gripper.closed"].values, [1.0; 3]);
}

#[test]
fn a_fingertip_is_where_the_hand_has_it() {
    let folder = tempfile::tempdir().unwrap();
    let channels = "  right.palm.position: h<xyz>\n  right.palm.rotation: [hr, hp, hw]\n  right.thumb.position: {at: [10 mm, 0 mm, 155 mm], of: right.palm}";
    let recording = opened(folder.path(), channels).unwrap();
    let tip = Vector3::new(1.0, 2.0, 3.0)
        + UnitQuaternion::from_euler_angles(0.4, 0.5, 0.6) * Vector3::new(0.010, 0.0, 0.155);
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let values = &recording.columns[&format!("right.thumb.position.{name}")].values;
        assert!((values[1] - tip[axis]).abs() < 1e-12, "{values:?}");
        // Where the rotation was not measured, neither was the fingertip.
        assert!(values[2].is_nan());
    }
}

#[test]
fn constants_and_points_that_cannot_be_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (channels, told) in [
        ("  block.position: [x, y, = 15]", "`= 15` is a plain number, expected a length (m)"),
        ("  block.position: [x, y, = 15 N]", "expected a length"),
        ("  block.position: [x, y, = 15 furlongs]", "furlongs"),
        ("  right.thumb.position: {at: [0 m, 0 m, 0 m], of: right.palm}", "no channel `right.palm.position` is bound"),
        ("  right.thumb.position: {at: [0 m, 0 m, 0 m]}", "expected `{mean:"),
        ("  right.thumb.position: {at: [0 m, 0 N, 0 m], of: right.palm}", "N"),
        (
            "  right.palm.position: h<xyz>\n  right.palm.rotation: [hr, hp, hw]\n  right.thumb.force: {at: [0 m, 0 m, 0 m], of: right.palm}",
            "`right.thumb.force` is not a position",
        ),
    ] {
        let error = opened(folder.path(), channels).unwrap_err();
        let said = error.to_string();
        assert!(said.contains(told), "{channels}: {said}");
        assert!(said.contains("b.yaml:"), "{said}");
    }
}

#[test]
fn steps_of_the_bridge_itself_are_bridged() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::from("time,x\n");
    // 10 Hz with some jitter: the steps are 0.09 to 0.11 s, the bridge is 0.1 s.
    for row in 0..50 {
        text.push_str(&format!("{},{}\n", f64::from(row) * 0.1 + if row % 3 == 1 { 0.01 } else { 0.0 }, row + 1));
    }
    let [log, file] = ["log.csv", "b.yaml"].map(|name| folder.path().join(name));
    std::fs::write(&log, text).unwrap();
    std::fs::write(&file, "resample: 20 Hz\nchannels: {block.position: [x, x, x]}\nscene: {bodies: {block: {role: object, radius: 30 mm}}}\n").unwrap();
    let recording = open(&OpenRequest { log, binding: Some(file), ..OpenRequest::default() }).unwrap().recording;
    assert_eq!(recording.time.len(), 99);
    assert!(recording.columns["block.position.x"].values.iter().all(|value| !value.is_nan()));
}
