//! Bags: messages by topic, each decoded by its own definition.

use super::{bound, fixture, folder, header, values};
use crate::shared::bags::{JOINT_STATE, TRANSFORMS, Topic, finish, joint_state, transforms, write};
use mcap::{Compression, WriteOptions};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;

/// A stamped wrench as ROS defines it, cut short to what counts.
pub(super) const WRENCH: &str = "std_msgs/Header header
geometry_msgs/Vector3 force   # N
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
";

/// Joints of a gripper, with a default, a constant and arrays of each kind.
const JOINTS: &str = "uint8 OPEN=1
string<=10 name \"hand\"
float32[] position
int16[2] raw
bool closed
uint8[] image
";

/// A wrench in CDR; an odd frame id shows whether values stand on their grid.
pub(super) fn wrench(stamp_s: f64, force: [f64; 3], little: bool) -> Vec<u8> {
    let nanos = (stamp_s * 1e9).round() as u64;
    let (sec, nanosec) = ((nanos / 1_000_000_000) as u32, (nanos % 1_000_000_000) as u32);
    let u32_of = |value: u32| if little { value.to_le_bytes() } else { value.to_be_bytes() };
    let f64_of = |value: f64| if little { value.to_le_bytes() } else { value.to_be_bytes() };
    let mut body = vec![];
    for value in [sec, nanosec, 6] {
        body.extend(u32_of(value));
    }
    body.extend(b"wrist\0");
    body.resize(body.len().next_multiple_of(8), 0);
    for value in force {
        body.extend(f64_of(value));
    }
    [vec![0, u8::from(little), 0, 0], body].concat()
}

/// Joints in CDR, with an image that is too long to be a column.
fn joints(position: [f32; 2], closed: bool) -> Vec<u8> {
    let mut body = vec![];
    body.extend(5_u32.to_le_bytes());
    body.extend(b"grip\0");
    body.resize(body.len().next_multiple_of(4), 0);
    body.extend(2_u32.to_le_bytes());
    for value in position {
        body.extend(value.to_le_bytes());
    }
    for value in [-3_i16, 7] {
        body.extend(value.to_le_bytes());
    }
    body.push(u8::from(closed));
    body.resize(body.len().next_multiple_of(4), 0);
    body.extend(100_u32.to_le_bytes());
    body.extend([9; 100]);
    [vec![0, 1, 0, 0], body].concat()
}

/// A bag with a wrench at 100 Hz that was recorded in batches and out of order, and joints at 50 Hz without stamps.
fn bag(compression: Option<Compression>) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let stamp = |index: usize| 1000.0 + index as f64 * 0.01;
    let mut wrenches: Vec<(f64, Vec<u8>)> = (0..10)
        .map(|index| (stamp(9) + 0.001, wrench(stamp(index), [index as f64, 0.5, -1.0], index % 2 == 0)))
        .collect();
    wrenches.swap(3, 4);
    let grips = (0..5).map(|index| (stamp(2 * index), joints([0.01, index as f32 * 0.5], index > 2))).collect();
    write(
        &path,
        compression,
        &[
            ("/wrench", "cdr", "geometry_msgs/msg/WrenchStamped", WRENCH, wrenches),
            ("/gripper", "cdr", "my_msgs/msg/Joints", JOINTS, grips),
        ],
    );
    (folder, path)
}

const BINDING: &str = "
resample: 100 Hz
channels:
  right.thumb.force: /wrench.force.<xyz>
  right.gripper.opening: \"/gripper.position[1] [mm]\"
  right.thumb.contact: /gripper.closed
";

#[test]
fn topics_are_decoded_and_laid_on_one_time_base() {
    for compression in [None, Some(Compression::Zstd), Some(Compression::Lz4)] {
        let (_folder, path) = bag(compression);
        assert_eq!(
            header(&path),
            [
                "/wrench.time [s]",
                "/wrench.header.frame_id",
                "/wrench.force.x",
                "/wrench.force.y",
                "/wrench.force.z",
                "/gripper.time [s]",
                "/gripper.name",
                "/gripper.position[0]",
                "/gripper.position[1]",
                "/gripper.raw[0]",
                "/gripper.raw[1]",
                "/gripper.closed",
            ]
        );
        let (recording, issues) = bound(&path, BINDING).unwrap();
        assert!(issues.is_empty());
        // The stamps in the headers count, not the batch in which they were recorded; times begin with the first of them.
        let force = values(&recording, "right.thumb.force.x");
        // The gripper ends 10 ms before the wrench; what is measured by one of them only is cut off.
        assert_eq!(force.len(), 9);
        assert!(force.iter().enumerate().all(|(index, force)| (force - index as f64).abs() < 1e-9), "{force:?}");
        assert!((recording.time[8] - 0.08).abs() < 1e-6);
        // What is slower is held.
        let closed = values(&recording, "right.thumb.contact");
        assert_eq!(closed.iter().filter(|flag| **flag > 0.5).count(), 3);
        assert!((values(&recording, "right.gripper.opening")[2] - 0.0005).abs() < 1e-9);
    }
}

#[test]
fn messages_and_whole_files_may_be_compressed() {
    let packed = |bytes: &[u8]| zstd::stream::encode_all(bytes, 0).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let wrenches =
        (0..4).map(|row| (f64::from(row), packed(&wrench(f64::from(row), [f64::from(row), 0.0, 0.0], true))));
    write(&path, None, &[("/wrench", "cdr", "geometry_msgs/msg/WrenchStamped", WRENCH, wrenches.collect())]);
    let whole = folder.path().join("log.mcap.zstd");
    std::fs::write(&whole, packed(&std::fs::read(&path).unwrap())).unwrap();
    for log in [path, whole] {
        let (recording, _) = bound(&log, "channels: {right.thumb.force: /wrench.force.<xyz>}\n").unwrap();
        assert_eq!(values(&recording, "right.thumb.force.x"), [0.0, 1.0, 2.0, 3.0]);
    }
}

#[test]
fn a_length_that_no_record_has_is_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let file = std::io::BufWriter::new(std::fs::File::create(&path).unwrap());
    let mut writer = WriteOptions::new().use_chunks(false).create(file).unwrap();
    let schema = writer.add_schema("geometry_msgs/msg/WrenchStamped", "ros2msg", WRENCH.as_bytes()).unwrap();
    writer.add_channel(schema, "/wrench", "cdr", &BTreeMap::new()).unwrap();
    finish(writer);
    let mut damaged = std::fs::read(&path).unwrap();
    // The name of the topic declares four thousand million bytes.
    let at = damaged.windows(7).position(|window| window == b"/wrench").unwrap();
    damaged[at - 4..at].copy_from_slice(&[0xff; 4]);
    std::fs::write(&path, damaged).unwrap();
    insta::assert_snapshot!(bound(&path, "").unwrap_err(), @"log.mcap: cannot be read as MCAP: a record is damaged: it declares 4294967295 more bytes, and has 18");
}

#[test]
fn a_topic_that_cannot_be_read_does_not_hide_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let good = || vec![(1.0, wrench(1.0, [1.0; 3], true)), (1.1, wrench(1.1, [1.0; 3], true))];
    write(
        &path,
        None,
        &[
            ("/good", "cdr", "geometry_msgs/msg/WrenchStamped", WRENCH, good()),
            ("/proto", "protobuf", "foxglove.Pose", "x", vec![(1.0, vec![1, 2, 3])]),
            (
                "/short",
                "cdr",
                "geometry_msgs/msg/WrenchStamped",
                WRENCH,
                vec![(1.0, wrench(1.0, [1.0; 3], true)[..40].to_vec())],
            ),
            ("/parameters", "cdr", "a/msg/B", "c/Unknown d", vec![(1.0, vec![0, 1, 0, 0])]),
            ("/newer", "cdr", "geometry_msgs/msg/WrenchStamped", WRENCH, vec![(1.0, vec![0, 9, 0, 0])]),
            ("/bare", "cdr", "", "", vec![(1.0, vec![0, 1, 0, 0])]),
        ],
    );
    let read = |topic: &str| bound(&path, &format!("channels: {{right.thumb.force: {topic}.force.<xyz>}}\n"));
    assert_eq!(read("/good").unwrap().0.time.len(), 2);
    let refused = |topic: &str| read(topic).unwrap_err();
    insta::assert_snapshot!(["/proto", "/short", "/parameters", "/newer", "/bare", "/absent"].map(refused).join("\n"));
}

#[test]
fn elements_are_called_as_the_message_calls_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    // Two nodes tell of two frames each, in messages that alternate; what never changes is reported once.
    let poses = (10..16).map(|half| {
        let x = f64::from(half);
        let printed = if half % 2 == 0 { [("cube", x), ("tip", -x)] } else { [("tip", -x), ("cube", x)] };
        (f64::from(half) / 2.0 + 0.2, transforms(half, &printed))
    });
    let states = (10..16).map(|half| {
        let arm = [("elbow", 1.0), ("finger", f64::from(half))];
        let hand = [("finger", f64::from(half))];
        (f64::from(half) / 2.0, joint_state(if half % 2 == 0 { &arm } else { &hand }))
    });
    write(
        &path,
        None,
        &[
            ("/tf", "cdr", "tf2_msgs/msg/TFMessage", TRANSFORMS, poses.collect()),
            ("/tf_static", "cdr", "tf2_msgs/msg/TFMessage", TRANSFORMS, vec![(3.0, transforms(3, &[("table", 7.0)]))]),
            ("/joint_states", "cdr", "sensor_msgs/msg/JointState", JOINT_STATE, states.collect()),
        ],
    );
    let titles = header(&path);
    assert!(titles.contains(&"/tf.transforms.cube.header.frame_id".to_string()), "{titles:?}");
    assert!(!titles.iter().any(|title| title.contains("[0]")), "{titles:?}");
    let binding = "
resample: 2 Hz
bridge: 1 s
channels:
  cube.position: /tf.transforms.cube.translation.<xyz>
  right.thumb.position: /tf.transforms.tip.translation.<xyz>
  right.palm.position: /tf_static.transforms.table.translation.<xyz>
  right.gripper.opening: /joint_states.position.finger
";
    let (recording, issues) = bound(&path, binding).unwrap();
    assert!(issues.is_empty(), "{issues:?}");
    // The stamps in the headers count, those of the record where there are none.
    assert_eq!(values(&recording, "cube.position.x"), [10.0, 11.0, 12.0, 13.0, 14.0, 15.0]);
    assert_eq!(values(&recording, "right.thumb.position.x"), [-10.0, -11.0, -12.0, -13.0, -14.0, -15.0]);
    assert_eq!(values(&recording, "right.palm.position.x"), [7.0; 6]);
    assert_eq!(values(&recording, "right.gripper.opening"), [10.0, 11.0, 12.0, 13.0, 14.0, 15.0]);
}

/// Returns a topic with JSON messages, each with its recording time (s).
fn json_topic<'a>(name: &'a str, messages: Vec<(f64, String)>) -> Topic<'a> {
    (name, "json", "", "", messages.into_iter().map(|(at, text)| (at, text.into_bytes())).collect())
}

#[test]
fn messages_with_equal_stamps_and_different_elements_form_one_row() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    // Each driver publishes its own frame with the same stamps. The messages of the second driver are recorded together at the end.
    let [cube, tip] = [("cube", 1.0), ("tip", -1.0)].map(|(child, sign)| {
        (10..16).map(move |half| (f64::from(half) / 2.0, transforms(half, &[(child, sign * f64::from(half))])))
    });
    // Two writers publish static transforms; the second message comes later.
    let fixed = vec![(3.0, transforms(3, &[("table", 7.0)])), (4.0, transforms(4, &[("wall", 8.0)]))];
    // Both drivers publish the finger with equal values; each numbers its own messages.
    let joints = (10..16).flat_map(|half| {
        let (arm, hand) =
            ([("elbow", 1.0), ("finger", f64::from(half))], [("finger", f64::from(half)), ("thumb", 2.0)]);
        [(f64::from(half) / 2.0, joint_state(&arm)), (f64::from(half) / 2.0, joint_state(&hand))]
    });
    let counted = (10..16).flat_map(|half| {
        let head = |seq: i32| {
            format!(
                "{{\"header\":{{\"seq\":{seq},\"stamp\":{{\"sec\":{},\"nanosec\":{}}}}}",
                half / 2,
                half % 2 * 500_000_000
            )
        };
        ["a", "b"].map(|name| {
            (f64::from(half) / 2.0, format!("{},\"{name}\":{half}}}", head(if name == "a" { half } else { -half })))
        })
    });
    write(
        &path,
        None,
        &[
            ("/tf", "cdr", "tf2_msgs/msg/TFMessage", TRANSFORMS, cube.chain(tip).collect()),
            ("/tf_static", "cdr", "tf2_msgs/msg/TFMessage", TRANSFORMS, fixed),
            ("/joint_states", "cdr", "sensor_msgs/msg/JointState", JOINT_STATE, joints.collect()),
            json_topic("/counted", counted.collect()),
        ],
    );
    let binding = "
resample: 2 Hz
channels:
  cube.position: /tf.transforms.cube.translation.<xyz>
  right.thumb.position: /tf.transforms.tip.translation.<xyz>
  right.palm.position: [/tf_static.transforms.table.translation.x, /tf_static.transforms.wall.translation.x, \"= 0 m\"]
  right.gripper.opening: /joint_states.position.finger
  right.thumb.force: [/joint_states.position.thumb, /joint_states.position.elbow, /counted.a]
  right.palm.force: [/counted.a, /counted.b, /counted.b]
";
    let (recording, issues) = bound(&path, binding).unwrap();
    assert_eq!(issues, []);
    let halves: Vec<f64> = (10..16).map(f64::from).collect();
    for (name, wanted) in [
        ("cube.position.x", halves.clone()),
        ("right.thumb.position.x", halves.iter().map(|half| -half).collect()),
        ("right.palm.position.x", vec![7.0; 6]),
        ("right.palm.position.y", vec![8.0; 6]),
        ("right.gripper.opening", halves.clone()),
        ("right.thumb.force.x", vec![2.0; 6]),
        ("right.thumb.force.y", vec![1.0; 6]),
        ("right.palm.force.x", halves.clone()),
        ("right.palm.force.z", halves),
    ] {
        assert_eq!(values(&recording, name), wanted, "{name}");
    }
    // A message with another value for the same element is left out and reported.
    let wrenches = [0, 1, 1, 2, 3].iter().zip(0..).map(|(at, force)| {
        let stamp_s = 5.0 + f64::from(*at) * 0.01;
        (stamp_s, wrench(stamp_s, [f64::from(force), 0.0, 0.0], true))
    });
    write(&path, None, &[("/wrench", "cdr", "geometry_msgs/msg/WrenchStamped", WRENCH, wrenches.collect())]);
    let (recording, issues) = bound(&path, "channels: {right.thumb.force: /wrench.force.<xyz>}\n").unwrap();
    assert_eq!(values(&recording, "right.thumb.force.x"), [0.0, 1.0, 3.0, 4.0]);
    insta::assert_snapshot!(issues[0].message, @"1 row repeats the time stamp of the row before, first in row 3; the first of equal stamps is kept");
}

/// Foxglove's schemas have the instant beside the values, and messages reach the recorder late.
#[test]
fn stamps_beside_the_values_count() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let tips = (0..4).map(|at| {
        let text = format!("{{\"timestamp\":{{\"sec\":9,\"nsec\":{}}},\"x\":{at}}}", at * 100_000_000);
        (9.5 + f64::from(at % 2) * 0.3 + f64::from(at) * 0.01, text)
    });
    write(&path, None, &[json_topic("/tip", tips.collect())]);
    let (recording, _) = bound(&path, "channels: {right.gripper.opening: /tip.x}\n").unwrap();
    assert_eq!(values(&recording, "right.gripper.opening"), [0.0, 1.0, 2.0, 3.0]);
    let steps: Vec<f64> = recording.time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(steps.iter().all(|step| (step - 0.1).abs() < 1e-9), "{steps:?}");
}

/// If the messages were sorted by stamp, those of the two stretches would alternate.
#[test]
fn a_clock_that_was_set_back_refuses_its_topic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let wrenches = |back: i32| {
        let all = (0..60).map(move |at| {
            let stamp_s = 5.0 + f64::from(if at < 30 { at } else { at - back }) * 0.01;
            (5.0 + f64::from(at) * 0.01, wrench(stamp_s, [f64::from(at), 0.0, 0.0], true))
        });
        ("/wrench", "cdr", "geometry_msgs/msg/WrenchStamped", WRENCH, all.collect())
    };
    let other =
        || json_topic("/grip", (0..60).map(|at| (5.0 + f64::from(at) * 0.01, format!("{{\"width\":{at}}}"))).collect());
    write(&path, None, &[wrenches(20), other()]);
    let force = "channels: {right.thumb.force: /wrench.force.<xyz>}\n";
    insta::assert_snapshot!(bound(&path, force).unwrap_err(), @"binding.yaml:1:12: `/wrench` cannot be read: the clock was set back by 0.19 s before message 31: the stretches before and after it overlap; cut the bag there, or follow it with `teachtree live`");
    assert_eq!(bound(&path, "channels: {right.gripper.opening: /grip.width}\n").unwrap().0.time.len(), 60);
    // A few late messages are sorted in and reported.
    write(&path, None, &[wrenches(5), other()]);
    let (recording, issues) = bound(&path, force).unwrap();
    assert_eq!(recording.time.len(), 55);
    let said = issues.iter().map(|it| format!("{} {:.2}–{:.2} s: {}", it.kind, it.start_s, it.end_s, it.message));
    insta::assert_snapshot!(said.collect::<Vec<_>>().join("\n"), @"
    duplicate_stamp 0.25–0.28 s: 4 messages came after one with a later stamp; they are sorted by stamp
    duplicate_stamp 0.25–0.29 s: 5 rows repeat the time stamp of the row before, first in row 27; the first of equal stamps is kept
    ");
    // Two clocks that take turns.
    let turns = (0..40).map(|at| {
        let stamp_s = 5.0 + f64::from(at / 2) * 0.01 + if at % 2 == 0 { 5.003 } else { 0.0 };
        (5.0 + f64::from(at) * 0.01, wrench(stamp_s, [f64::from(at), 0.0, 0.0], true))
    });
    write(&path, None, &[("/wrench", "cdr", "geometry_msgs/msg/WrenchStamped", WRENCH, turns.collect())]);
    let (_, issues) = bound(&path, &format!("resample: 100 Hz\n{force}")).unwrap();
    let told = "20 messages came after one with a later stamp";
    assert!(issues.iter().any(|issue| issue.message.starts_with(told)), "{issues:?}");
}

#[test]
fn a_wrong_encoding_is_refused_with_its_channel() {
    let refused = bound(&fixture("rosbag2/wrong_rmw_test_0.mcap"), "").unwrap_err();
    insta::assert_snapshot!(refused, @"wrong_rmw_test_0.mcap topic /test_topic: its messages are encoded as `wrong_format`, expected `cdr`, `ros1`, `json` or `protobuf`");
}

#[test]
fn a_bag_of_ros_itself_is_read() {
    let log = fixture("rosbag2/cdr_test_0.mcap");
    let titles = header(&log);
    assert!(titles.contains(&"/array_topic.basic_types_values[2].float32_value".to_string()), "{titles:?}");
    let binding = "channels: {right.gripper.opening: /test_topic.int32_value, right.label: \"/array_topic.string_values[0]\"}\nresample: 100 Hz\nbridge: 1 s\n";
    let (recording, _) = bound(&log, binding).unwrap();
    let measured: Vec<f64> =
        values(&recording, "right.gripper.opening").iter().copied().filter(|value| !value.is_nan()).collect();
    assert!(measured.len() > 3 && measured.iter().all(|value| *value == 123.0));
}

#[test]
fn a_folder_of_files_is_one_bag() {
    let metadata = |storage: &str, file: &str| {
        format!(
            "rosbag2_bagfile_information:\n  version: 4\n  storage_identifier: {storage}\n  relative_file_paths: [{file}]\n"
        )
    };
    let folder = folder(&[
        ("good/metadata.yaml", &metadata("mcap", "a.mcap, b.mcap")),
        ("old/metadata.yaml", &metadata("sqlite3", "a.db3")),
        ("out/metadata.yaml", &metadata("mcap", "../a.mcap")),
        ("gone/metadata.yaml", &metadata("mcap", "a.mcap")),
    ]);
    let topic = |from: f64| {
        let wrenches = (0..3).map(|index| (0.0, wrench(from + f64::from(index) * 0.1, [from; 3], true))).collect();
        [("/wrench", "cdr", "geometry_msgs/msg/WrenchStamped", WRENCH, wrenches)]
    };
    write(&folder.path().join("good/a.mcap"), None, &topic(5.0));
    write(&folder.path().join("good/b.mcap"), None, &topic(5.3));
    let read = |name: &str| bound(&folder.path().join(name), "channels: {right.thumb.force: /wrench.force.<xyz>}\n");
    let (recording, _) = read("good").unwrap();
    assert_eq!(recording.time.len(), 6);
    assert_eq!(values(&recording, "right.thumb.force.x")[..4], [5.0, 5.0, 5.0, 5.3]);
    let refused = |name: &str| read(name).unwrap_err();
    insta::assert_snapshot!(["old", "out", "gone"].map(refused).join("\n"));
}

#[test]
fn a_bag_that_was_cut_counts_as_far_as_it_goes() {
    let (_folder, path) = bag(None);
    let whole = std::fs::read(&path).unwrap();
    // In the middle of the messages.
    let at = whole.windows(5).rposition(|window| window == b"wrist").unwrap() - 60;
    std::fs::write(&path, &whole[..at]).unwrap();
    let (recording, issues) = bound(&path, "channels: {right.thumb.force: /wrench.force.<xyz>}\n").unwrap();
    assert!(recording.time.len() >= 5 && recording.time.len() < 10, "{}", recording.time.len());
    assert_eq!(issues[0].kind, "truncated");
}

/// A record of a ROS 1 bag.
fn record(fields: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    let sized = |bytes: Vec<u8>| [(bytes.len() as u32).to_le_bytes().to_vec(), bytes].concat();
    let header: Vec<u8> =
        fields.iter().flat_map(|(name, value)| sized([name.as_bytes(), b"=", *value].concat())).collect();
    [sized(header), sized(data.to_vec())].concat()
}

/// A ROS 1 bag of some rows, in one chunk.
fn bag1(compression: &str, rows: u32) -> Vec<u8> {
    let definition = "Header header\ngeometry_msgs/Vector3 force\nint8[] pad\ntime when\n====\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n====\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";
    let of_connection: Vec<u8> = [("type", "my_msgs/Wrench"), ("message_definition", definition)]
        .iter()
        .flat_map(|(name, value)| {
            let field = format!("{name}={value}");
            [(field.len() as u32).to_le_bytes().to_vec(), field.into_bytes()].concat()
        })
        .collect();
    let id = 0_u32.to_le_bytes();
    let mut inner = record(&[("op", &[7]), ("conn", &id), ("topic", b"/wrench")], &of_connection);
    for row in 0..rows {
        let mut data = vec![];
        for value in [row, 100, row * 10_000_000, 5] {
            data.extend(value.to_le_bytes());
        }
        data.extend(b"wrist");
        for value in [f64::from(row), 0.0, -1.0] {
            data.extend(value.to_le_bytes());
        }
        data.extend([2, 0, 0, 0, 255, 1, 7, 0, 0, 0, 0, 0, 0, 0]);
        inner.extend(record(&[("op", &[2]), ("conn", &id), ("time", &[9, 0, 0, 0, 0, 0, 0, 0])], &data));
    }
    let size = (inner.len() as u32).to_le_bytes();
    let packed = match compression {
        "lz4" => {
            let mut encoder = lz4_flex::frame::FrameEncoder::new(vec![]);
            encoder.write_all(&inner).unwrap();
            encoder.finish().unwrap()
        }
        "bz2" => {
            let mut encoder = bzip2::write::BzEncoder::new(vec![], bzip2::Compression::default());
            encoder.write_all(&inner).unwrap();
            encoder.finish().unwrap()
        }
        _ => inner,
    };
    let chunk = record(&[("op", &[5]), ("compression", compression.as_bytes()), ("size", &size)], &packed);
    [b"#ROSBAG V2.0\n".to_vec(), record(&[("op", &[3])], &[b' '; 40]), chunk].concat()
}

#[test]
fn a_bag_of_ros_1_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.bag");
    let read = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        bound(&path, "channels: {right.thumb.force: /wrench.force.<xyz>, right.gripper.opening: \"/wrench.pad[0]\"}\n")
    };
    for compression in ["none", "lz4", "bz2"] {
        let (recording, _) = read(&bag1(compression, 4)).unwrap();
        assert_eq!(values(&recording, "right.thumb.force.x"), [0.0, 1.0, 2.0, 3.0], "{compression}");
        assert_eq!(values(&recording, "right.gripper.opening"), [-1.0; 4]);
        assert!((recording.time[3] - 0.03).abs() < 1e-9);
    }
    let whole = bag1("none", 4);
    // A chunk is read whole or not at all.
    let refused = [read(&bag1("zip", 4)), read(&whole[..whole.len() - 10]), read(b"#ROSBAG V1.2\n")];
    insta::assert_snapshot!(refused.map(Result::unwrap_err).join("\n"));
}
