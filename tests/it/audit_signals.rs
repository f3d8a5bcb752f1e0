//! `audit` without a binding: the shipped sets and bags have no faults but those that are known, and faults of files are found.

use crate::program::{all_said, complained, said, teachtree, teachtree_in};
use crate::shared::folders::copy;
use mcap::{WriteOptions, records::MessageHeader};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

fn fixture(name: &str) -> String {
    format!("tests/fixtures/formats/{name}")
}

fn document(args: &[&str]) -> Value {
    let output = teachtree(&[&["audit", "--format", "json"], args].concat());
    assert!(output.status.success(), "{args:?}: {}", all_said(&output));
    serde_json::from_str(&said(&output)).unwrap()
}

fn messages(document: &Value) -> Vec<String> {
    let findings = |recording: &Value| -> Vec<String> {
        let of = |finding: &Value| {
            format!("{}: {}", recording["log"].as_str().unwrap(), finding["message"].as_str().unwrap())
        };
        recording["findings"].as_array().unwrap().iter().map(of).collect()
    };
    document["recordings"].as_array().unwrap().iter().flat_map(findings).collect()
}

#[test]
fn shipped_recordings_have_no_faults() {
    let sets = ["lerobot_v30", "lerobot_v30_hands", "lerobot_v21_nuts", "lerobot_v21#2"].map(fixture);
    let bags = [
        "rosbag2/cdr_test_0.mcap",
        "rosbag2_db3/plain.mcap",
        "rosbag2_db3/jazzy",
        "rosbag2_db3/humble",
        "foxglove/json.mcap",
        "foxglove/protobuf.mcap",
    ]
    .map(fixture);
    let logs: Vec<&str> = sets.iter().chain(&bags).map(String::as_str).collect();
    let document = document(&logs);
    assert_eq!(document["rules"], Value::Null);
    assert_eq!(messages(&document), Vec::<String>::new());
}

/// A set with a wrong number of frames and a wrong rate.
#[test]
fn a_set_that_describes_itself_wrongly_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let set = folder.path().join("set");
    copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join(fixture("lerobot_v21_nuts")), &set);
    let change = |file: &str, from: &str, to: &str| {
        let text = std::fs::read_to_string(set.join(file)).unwrap();
        assert!(text.contains(from), "{text}");
        std::fs::write(set.join(file), text.replacen(from, to, 1)).unwrap();
    };
    change("meta/episodes.jsonl", "\"length\": 100", "\"length\": 104");
    change("meta/info.json", "\"fps\": 20", "\"fps\": 30");
    let output = teachtree_in(folder.path(), &["audit", "set", "--fail-on", "missing_frames"]);
    assert_eq!(output.status.code(), Some(1));
    // Lines are wrapped.
    let text = said(&output).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains("time: the list of episodes says 104 frames, and the data file has 100"), "{text}");
    assert!(text.contains("`fps` of meta/info.json is 30"), "{text}");
    assert!(text.contains("0 of 2 recordings are good, 1 with missing frames, 2 with uneven stamps"), "{text}");
}

/// A file of MP4 that describes frames of these sizes, of which every second one is a key frame, and contains none.
fn video(sizes: &[u32]) -> Vec<u8> {
    let boxed = |kind: &[u8; 4], inner: &[u8]| [&(8 + inner.len() as u32).to_be_bytes()[..], kind, inner].concat();
    let numbers = |numbers: &[u32]| numbers.iter().flat_map(|number| number.to_be_bytes()).collect::<Vec<u8>>();
    let keys: Vec<u32> = (1..=sizes.len() as u32).step_by(2).collect();
    let table = [
        boxed(b"stsz", &[numbers(&[0, 0, sizes.len() as u32]), numbers(sizes)].concat()),
        boxed(b"stss", &[numbers(&[0, keys.len() as u32]), numbers(&keys)].concat()),
    ];
    let handler = boxed(b"hdlr", &[&[0; 8][..], b"vide", &[0; 12]].concat());
    let media = [handler, boxed(b"minf", &boxed(b"stbl", &table.concat()))].concat();
    let track = boxed(b"moov", &boxed(b"trak", &boxed(b"mdia", &media)));
    [boxed(b"ftyp", b"isom"), boxed(b"mdat", &[0; 40]), track].concat()
}

#[test]
fn a_video_that_freezes_or_ends_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let set = folder.path().join("set");
    copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join(fixture("lerobot_v21_nuts")), &set);
    let mut info: Value = serde_json::from_str(&std::fs::read_to_string(set.join("meta/info.json")).unwrap()).unwrap();
    let camera = "observation.images.top";
    info["features"][camera] = json!({ "dtype": "video", "shape": [48, 64, 3], "names": null });
    info["video_path"] = json!("videos/chunk-{episode_chunk:03d}/{video_key}/episode_{episode_index:06d}.mp4");
    std::fs::write(set.join("meta/info.json"), info.to_string()).unwrap();
    let videos = set.join("videos/chunk-000").join(camera);
    std::fs::create_dir_all(&videos).unwrap();
    let size = |frame: u32| if frame.is_multiple_of(2) { 4000 + frame * 7919 % 311 } else { 30 };
    let good: Vec<u32> = (0..100).map(size).collect();
    let frozen: Vec<u32> =
        (0..190).map(|at| if (40..90).contains(&at) && at % 2 == 0 { 4000 + at % 3 } else { size(at) }).collect();
    std::fs::write(videos.join("episode_000000.mp4"), video(&good)).unwrap();
    std::fs::write(videos.join("episode_000001.mp4"), video(&frozen)).unwrap();
    let output = teachtree_in(folder.path(), &["audit", "set", "--format", "json"]);
    assert!(output.status.success(), "{}", complained(&output));
    let document: Value = serde_json::from_str(&said(&output)).unwrap();
    assert_eq!(document["recordings"][0]["findings"], json!([]), "{document}");
    let findings = document["recordings"][1]["findings"].as_array().unwrap();
    let of =
        |kind: &str| findings.iter().find(|finding| finding["kind"] == kind).unwrap_or_else(|| panic!("{document}"));
    assert_eq!((&of("missing_frames")["column"], &of("missing_frames")["value"]), (&json!(camera), &json!(4)));
    let frozen = of("frozen_camera");
    assert_eq!(frozen["column"], camera);
    assert!(
        (frozen["start_s"].as_f64().unwrap() - 2.0).abs() < 0.01
            && (frozen["value"].as_f64().unwrap() - 2.4).abs() < 0.01
    );
}

/// Writes a bag: joints at 50 Hz with a gap, a spike and a clock that goes back, and a camera that freezes.
fn faulty_bag(path: &Path) {
    let file = std::io::BufWriter::new(std::fs::File::create(path).unwrap());
    let mut writer = WriteOptions::new().create(file).unwrap();
    let text = b"std_msgs/Header header\nstring format\nuint8[] data\n================\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n================\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
    let image = writer.add_schema("sensor_msgs/msg/CompressedImage", "ros2msg", text).unwrap();
    let joints = writer.add_channel(0, "/joints", "json", &BTreeMap::new()).unwrap();
    let camera = writer.add_channel(image, "/wrist/compressed", "cdr", &BTreeMap::new()).unwrap();
    let mut put = |channel_id: u16, time_ns: u64, data: &[u8]| {
        let header = MessageHeader { channel_id, sequence: 0, log_time: time_ns, publish_time: time_ns };
        writer.write_to_known_channel(&header, data).unwrap();
    };
    for at in 0..500_u64 {
        let begin = 1_700_000_000_000_000_000;
        let time_ns = begin + at * 20_000_000;
        if (200..210).contains(&at) {
            continue;
        }
        let angle = if at == 100 { 9.0 } else { (at as f64 / 20.0).sin() };
        // The clock of the arm is set back by a second.
        let stamp = if at >= 400 { time_ns - 1_000_000_000 } else { time_ns };
        let stamp = json!({ "sec": stamp / 1_000_000_000, "nanosec": stamp % 1_000_000_000 });
        let message = json!({ "header": { "stamp": stamp }, "position": { "pan": angle } });
        put(joints, time_ns, message.to_string().as_bytes());
        if at % 2 == 0 {
            let shown = if (250..350).contains(&at) { 250 } else { at };
            let mut jpeg = vec![0xff, 0xd8, 0xff, 0xe0];
            jpeg.extend((0..100).map(|byte| (shown as u8).wrapping_mul(byte)));
            put(camera, time_ns, &compressed_image(time_ns, &jpeg));
        }
    }
    writer.finish().unwrap();
}

/// A message of ROS 2, `sensor_msgs/msg/CompressedImage`.
pub fn compressed_image(stamp_ns: u64, bytes: &[u8]) -> Vec<u8> {
    let mut message = vec![0, 1, 0, 0];
    let aligned = |message: &mut Vec<u8>| message.resize((message.len() - 4).next_multiple_of(4) + 4, 0);
    message.extend(i32::try_from(stamp_ns / 1_000_000_000).unwrap().to_le_bytes());
    message.extend(u32::try_from(stamp_ns % 1_000_000_000).unwrap().to_le_bytes());
    for text in ["camera\0", "jpeg\0"] {
        aligned(&mut message);
        message.extend((text.len() as u32).to_le_bytes());
        message.extend(text.as_bytes());
    }
    aligned(&mut message);
    message.extend((bytes.len() as u32).to_le_bytes());
    message.extend(bytes);
    message
}

#[test]
fn faults_of_a_bag_have_topic_time_and_number() {
    let folder = tempfile::tempdir().unwrap();
    faulty_bag(&folder.path().join("bag.mcap"));
    std::fs::create_dir(folder.path().join("bags")).unwrap();
    std::fs::copy(folder.path().join("bag.mcap"), folder.path().join("bags/one.mcap")).unwrap();
    std::fs::copy(folder.path().join("bag.mcap"), folder.path().join("bags/two.mcap")).unwrap();
    let args = ["audit", "bag.mcap", "--format", "json", "--page", "page.html"];
    let output = teachtree_in(folder.path(), &args);
    assert!(output.status.success(), "{}", complained(&output));
    let document: Value = serde_json::from_str(&said(&output)).unwrap();
    let rounded = |value: &Value| value.as_f64().map(|value| (value * 100.0).round() / 100.0);
    let findings: Vec<_> = document["recordings"][0]["findings"]
        .as_array()
        .unwrap()
        .iter()
        .map(|finding| {
            let text = |key: &str| finding[key].as_str().unwrap_or_default().to_string();
            (text("kind"), text("column"), rounded(&finding["start_s"]), rounded(&finding["value"]))
        })
        .collect();
    let expected = [
        ("missing_frames", "/joints", Some(3.98), Some(10.0)),
        ("missing_frames", "/wrist/compressed", Some(3.96), Some(5.0)),
        ("stamps_back", "/joints", Some(7.0), Some(0.98)),
        ("spike", "/joints.position.pan", Some(2.0), Some(9.96)),
        ("frozen_camera", "/wrist/compressed", Some(5.0), Some(1.96)),
    ];
    let expected = expected.map(|(kind, column, start, value)| (kind.to_string(), column.to_string(), start, value));
    assert_eq!(findings, expected, "{}", said(&output));
    let page = std::fs::read_to_string(folder.path().join("page.html")).unwrap();
    assert!(page.contains("frozen camera") && page.contains("no rules"), "{page}");
    // A folder of bags is a set of recordings.
    let output = teachtree_in(folder.path(), &["audit", "bags", "--format", "csv"]);
    assert!(output.status.success(), "{}", complained(&output));
    assert_eq!(said(&output).lines().count(), 1 + 2 * 5, "{}", said(&output));
    assert!(said(&output).contains(",/wrist/compressed,1.96"), "{}", said(&output));
}
