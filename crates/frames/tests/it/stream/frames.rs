//! Poses in different frames of a log: transforms are composed.

use crate::shared::bags;
use crate::shared::files::{SCENE, bound, bound_text, values};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use serde_json::{Value, json};
use teachtree_base::recording::{Column, Recording};
use teachtree_base::units::Dimension;
use teachtree_frames::bind::{BoundRows, RowBinder};
use teachtree_logs::read::memory_table::InMemoryTable;

fn at(position: [f64; 3], axis: Vector3<f64>, angle: f64) -> Isometry3<f64> {
    let rotation = UnitQuaternion::from_axis_angle(&nalgebra::Unit::new_normalize(axis), angle);
    Isometry3::from_parts(Translation3::from(Vector3::from(position)), rotation)
}

/// A transform as ROS has it.
fn transform(parent: &str, child: &str, pose: &Isometry3<f64>) -> Value {
    let (t, q) = (pose.translation.vector, pose.rotation);
    json!({ "header": { "frame_id": parent }, "child_frame_id": child, "transform": {
        "translation": { "x": t.x, "y": t.y, "z": t.z }, "rotation": { "w": q.w, "x": q.i, "y": q.j, "z": q.k } } })
}

fn world_from_camera() -> Isometry3<f64> {
    at([0.5, 0.1, 0.8], Vector3::new(1.0, 0.2, 0.0), 3.0)
}

fn world_from_base() -> Isometry3<f64> {
    at([0.0, -1.0, 0.3], Vector3::z(), 0.7)
}

fn base_from_wrist(time: f64) -> Isometry3<f64> {
    at([0.1, 0.2 * time, 0.4], Vector3::new(0.3, 0.0, 1.0), 0.5 * time)
}

fn wrist_from_tool() -> Isometry3<f64> {
    at([0.0, 0.0, 0.15], Vector3::y(), 0.4)
}

fn camera_from_cube(time: f64) -> Isometry3<f64> {
    at([0.1 * time, 0.0, 0.5], Vector3::x(), 0.2 * time)
}

/// Lines with all transforms; the camera stands in this frame.
fn lines(camera_in: &str) -> String {
    let line = |row: u32| {
        let time = f64::from(row) * 0.02;
        let transforms = [
            transform(camera_in, "camera", &world_from_camera()),
            transform("world", "base", &world_from_base()),
            transform("/base", "wrist", &base_from_wrist(time)),
            transform("wrist", "tool", &wrist_from_tool()),
            transform("camera", "cube", &camera_from_cube(time)),
        ];
        format!("{}\n", json!({ "time": time, "transforms": transforms }))
    };
    (0..20).map(line).collect()
}

const CHANNELS: &str = "
channels:
  right.palm.position: transforms.tool.transform.translation.<xyz>
  right.palm.rotation: transforms.tool.transform.rotation.<wxyz>
  cube.position: transforms.cube.transform.translation.<xyz>
  cube.rotation: transforms.cube.transform.rotation.<wxyz>
";

/// Whether a position and a rotation of a log are those of a pose, in each row.
fn are(log: &Recording, body: &str, wanted: impl Fn(f64) -> Isometry3<f64>, within: f64) {
    let part = |name: &str, row: usize| values(log, &format!("{body}.{name}"))[row];
    for (row, time) in log.time.iter().enumerate() {
        let wanted = wanted(*time);
        let found = Point3::from(["x", "y", "z"].map(|letter| part(&format!("position.{letter}"), row)));
        let [w, x, y, z] = ["w", "x", "y", "z"].map(|letter| part(&format!("rotation.{letter}"), row));
        let turned = UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z));
        assert!((found - wanted * Point3::origin()).norm() < within, "{body} at {time}: {found}");
        assert!(turned.angle_to(&wanted.rotation) < within.max(1e-7), "{body} at {time}: {turned}");
    }
}

#[test]
fn poses_in_different_frames_of_a_tree_count_in_the_frame_that_they_have_in_common() {
    let (log, issues) = bound_text("log.jsonl", &lines("world"), CHANNELS).unwrap();
    let world_from_tool = |time: f64| world_from_base() * base_from_wrist(time) * wrist_from_tool();
    are(&log, "right.palm", world_from_tool, 1e-12);
    are(&log, "cube", |time| world_from_camera() * camera_from_cube(time), 1e-12);
    let told: Vec<&str> =
        issues.iter().filter(|issue| issue.kind == "different_frames").map(|issue| issue.message.as_str()).collect();
    assert_eq!(told.len(), 1);
    assert!(
        told[0].contains("those in `camera` and `wrist` are composed") && told[0].contains("expressed in `world`"),
        "{told:?}"
    );
}

#[test]
fn a_binding_names_the_frame() {
    let of_tool = "frame: base\nchannels:\n  right.palm.position: transforms.tool.transform.translation.<xyz>\n  right.palm.rotation: transforms.tool.transform.rotation.<wxyz>\n";
    let (log, issues) = bound_text("log.jsonl", &lines("world"), of_tool).unwrap();
    are(&log, "right.palm", |time| base_from_wrist(time) * wrist_from_tool(), 1e-12);
    assert!(issues.iter().all(|issue| issue.kind != "different_frames"));
    // Without it, poses of one frame are as the log has them.
    let (log, _) = bound_text("log.jsonl", &lines("world"), &of_tool.replace("frame: base\n", "")).unwrap();
    are(&log, "right.palm", |_| wrist_from_tool(), 1e-12);
    let error = |binding: &str| bound_text("log.jsonl", &lines("world"), binding).map(|_| ()).unwrap_err();
    assert!(
        error(&of_tool.replace("frame: base", "frame: map")).contains(
            "`right.palm.position` is in the frame `wrist`, which no transform of the log connects with `map`"
        )
    );
    assert!(
        error(
            &of_tool
                .replace("transforms.tool.transform.translation.<xyz>", "-transforms.tool.transform.translation.<xyz>")
        )
        .contains("without signs")
    );
    let plain = bound_text(
        "log.csv",
        "t,x,y,z\n0,1,2,3\n0.1,1,2,3\n",
        "time: t\nframe: base\nchannels: {cube.position: <xyz>}\n",
    );
    assert!(plain.map(|_| ()).unwrap_err().contains("the log has no transforms between frames"));
}

#[test]
fn frames_that_nothing_connects_are_reported_and_a_changing_one_is_refused() {
    let (log, issues) = bound_text("log.jsonl", &lines("mast"), CHANNELS).unwrap();
    are(&log, "cube", camera_from_cube, 1e-12);
    let told = issues.iter().find(|issue| issue.kind == "different_frames").unwrap();
    assert!(
        told.message.contains("`cube.position` stands in `camera`")
            && told.message.contains("no transform of the log connects"),
        "{}",
        told.message
    );
    let whole = lines("world");
    let changing = whole.lines().enumerate().map(|(row, line)| {
        let line =
            if row < 10 { line.to_string() } else { line.replace("\"frame_id\":\"/base\"", "\"frame_id\":\"world\"") };
        line + "\n"
    });
    let error = bound_text("log.jsonl", &changing.collect::<String>(), CHANNELS).map(|_| ()).unwrap_err();
    assert!(error.contains("changes from `base` to `world`"), "{error}");
}

/// Topics of a bag: an arm that is sampled between the samples of the tool, Foxglove's schemas, a static transform that is sent once, and a pose with a header.
#[test]
fn transforms_of_other_topics_are_interpolated() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let stamped = |times: Vec<f64>, message: &dyn Fn(f64) -> Value| -> Vec<(f64, Vec<u8>)> {
        times.into_iter().map(|time| (10.0 + time, message(time).to_string().into_bytes())).collect()
    };
    let every = |step: f64, first: f64| {
        (0..).map(|row| first + f64::from(row) * step).take_while(|time| *time < 2.0).collect::<Vec<f64>>()
    };
    let foxglove = |parent: &str, child: &str, pose: Isometry3<f64>| {
        let (t, q) = (pose.translation.vector, pose.rotation);
        json!({ "parent_frame_id": parent, "child_frame_id": child, "translation": { "x": t.x, "y": t.y, "z": t.z }, "rotation": { "w": q.w, "x": q.i, "y": q.j, "z": q.k } })
    };
    let pose_of = |time: f64| {
        let (t, q) = (camera_from_cube(time).translation.vector, camera_from_cube(time).rotation);
        json!({ "header": { "frame_id": "camera" }, "pose": { "position": { "x": t.x, "y": t.y, "z": t.z }, "orientation": { "w": q.w, "x": q.i, "y": q.j, "z": q.k } } })
    };
    bags::write(
        &path,
        None,
        &[
            (
                "/arm",
                "json",
                "",
                "",
                stamped(every(0.02, 0.0), &|time| foxglove("base", "wrist", base_from_wrist(time))),
            ),
            ("/tool", "json", "", "", stamped(every(0.04, 0.013), &|_| foxglove("wrist", "tool", wrist_from_tool()))),
            ("/once", "json", "", "", stamped(vec![0.5], &|_| foxglove("world", "base", world_from_base()))),
            ("/mast", "json", "", "", stamped(vec![0.5], &|_| foxglove("world", "camera", world_from_camera()))),
            ("/cube", "json", "", "", stamped(every(0.04, 0.0), &pose_of)),
        ],
    );
    let binding = "
resample: 25 Hz
channels:
  right.palm.position: /tool.translation.<xyz>
  right.palm.rotation: /tool.rotation.<wxyz>
  cube.position: /cube.pose.position.<xyz>
  cube.rotation: /cube.pose.orientation.<wxyz>
";
    let (log, _) = bound(&path, binding).unwrap();
    assert!(log.time.len() > 40);
    are(&log, "right.palm", |time| world_from_base() * base_from_wrist(time) * wrist_from_tool(), 2e-4);
    are(&log, "cube", |time| world_from_camera() * camera_from_cube(time), 2e-4);
}

/// The messages of topics, in the order in which they come: when, s, the topic, the frame, the child of a transform, and the pose.
fn live_messages(camera_in: &str) -> Vec<(f64, &'static str, String, &'static str, Isometry3<f64>)> {
    let mut messages = vec![
        (0.0, "/tf_static", "world".to_string(), "base", world_from_base()),
        (0.0, "/mast", camera_in.to_string(), "camera", world_from_camera()),
    ];
    for row in 0..200 {
        let time = 0.01 + 0.02 * f64::from(row);
        messages.push((time, "/tf", "base".into(), "wrist", base_from_wrist(time)));
        messages.push((time + 0.007, "/tool", "wrist".into(), "tool", wrist_from_tool()));
        messages.push((time + 0.009, "/cube", "camera".into(), "", camera_from_cube(time + 0.009)));
    }
    messages
}

const LIVE: &str = "
resample: 25 Hz
channels:
  right.palm.position: /tool.transforms.tool.transform.translation.<xyz>
  right.palm.rotation: /tool.transforms.tool.transform.rotation.<wxyz>
  cube.position: /cube.position.<xyz>
  cube.rotation: /cube.rotation.<wxyz>
";

/// What is made of these messages as they come: rows as a recording, and messages of issues.
fn live(camera_in: &str, binding: &str) -> Result<(Recording, Vec<String>), String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("b.yaml");
    std::fs::write(&path, format!("{binding}{SCENE}")).unwrap();
    let mut binder = RowBinder::open(&path, None, 1.0).map_err(|error| error.to_string())?;
    let (mut log, mut issues) = (Recording::default(), vec![]);
    let none = || Column { dimension: Dimension::NONE, values: vec![] };
    let mut take = |bound: BoundRows| {
        issues.extend(bound.issues.into_iter().map(|issue| issue.message));
        for row in bound.rows {
            for (name, cells) in row.columns() {
                let value = cells.numbers().unwrap()[0];
                match name.as_str() {
                    "time" => log.time.push(value),
                    _ => log.columns.entry(name.clone()).or_insert_with(none).values.push(value),
                }
            }
        }
    };
    for (time, topic, parent, child, pose) in live_messages(camera_in) {
        let (path, parts) = match child {
            "" => (String::new(), ["position", "rotation"]),
            child => (format!("transforms.{child}."), ["transform.translation", "transform.rotation"]),
        };
        let (t, q) = (pose.translation.vector, pose.rotation);
        let mut row = InMemoryTable::new("log");
        row.begin_row().unwrap();
        row.put_text(&format!("{path}header.frame_id"), &parent).unwrap();
        let [position, rotation] = parts;
        for (part, letter, value) in [(position, "x", t.x), (position, "y", t.y), (position, "z", t.z)]
            .into_iter()
            .chain([(rotation, "w", q.w), (rotation, "x", q.i), (rotation, "y", q.j), (rotation, "z", q.k)])
        {
            row.put(&format!("{path}{part}.{letter}"), value).unwrap();
        }
        take(binder.bind_message(topic, time, &row).map_err(|error| error.to_string())?);
    }
    take(binder.finish().map_err(|error| error.to_string())?);
    Ok((log, issues))
}

/// The messages of the arm lie between those of the tool; the transforms that hang the arm and the camera are sent once.
#[test]
fn poses_of_a_live_log_are_composed() {
    let (log, issues) = live("world", LIVE).unwrap();
    assert!(log.time.len() > 90, "{}", log.time.len());
    are(&log, "right.palm", |time| world_from_base() * base_from_wrist(time) * wrist_from_tool(), 2e-4);
    are(&log, "cube", |time| world_from_camera() * camera_from_cube(time), 2e-4);
    let told: Vec<&String> = issues.iter().filter(|issue| issue.contains("different frames")).collect();
    assert_eq!(told.len(), 1, "{issues:?}");
    assert!(told[0].contains("all are expressed in `world`"), "{told:?}");
    let (log, issues) = live("world", &format!("frame: world{LIVE}")).unwrap();
    are(&log, "cube", |time| world_from_camera() * camera_from_cube(time), 2e-4);
    assert!(issues.iter().all(|issue| !issue.contains("frames")), "{issues:?}");
}

#[test]
fn frames_of_a_live_log_that_nothing_connects_are_reported_once() {
    let (log, issues) = live("mast", LIVE).unwrap();
    are(&log, "cube", camera_from_cube, 2e-4);
    let told: Vec<&String> = issues.iter().filter(|issue| issue.contains("no transform of the log connects")).collect();
    assert_eq!(told.len(), 1, "{issues:?}");
    let error = live("world", &format!("frame: map{LIVE}")).map(|_| ()).unwrap_err();
    assert!(error.contains("which no transform of the log connects with `map`"), "{error}");
}
