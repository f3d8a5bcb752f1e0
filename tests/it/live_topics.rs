//! `teachtree live` of topics: messages with stamps of their own are joined as they come, and the results are those of the analysis of the whole bag.

use crate::program::{complained, said, teachtree_fed};
use mcap::{WriteOptions, records::MessageHeader};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A message of a topic, in JSON.
#[derive(Clone)]
pub struct Message {
    pub topic: &'static str,
    /// When it was recorded, and when its values were measured, ns since 1970.
    pub recorded_ns: u64,
    pub stamp_ns: u64,
    pub fields: Value,
}

impl Message {
    pub fn text(&self) -> String {
        let mut fields = self.fields.clone();
        let (sec, nanosec) = (self.stamp_ns / 1_000_000_000, self.stamp_ns % 1_000_000_000);
        fields["header"] = json!({ "stamp": { "sec": sec, "nanosec": nanosec } });
        fields.to_string()
    }
}

/// When recordings begin, ns since 1970.
pub const BEGIN_NS: u64 = 1_700_000_000_000_000_000;

fn demo(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite").join(name)
}

/// A shipped recording as three topics, in the order in which they were recorded: the hand as it is; contacts and forces 2 ms later, which are recorded 4 ms
/// late; the objects every second time, which are recorded 30 ms late, as a camera does.
pub fn messages(log: &str) -> Vec<Message> {
    let text = std::fs::read_to_string(demo(log)).unwrap();
    let mut lines = text.lines();
    let titles: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut messages = vec![];
    for (at, line) in lines.enumerate() {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        let time_ns = BEGIN_NS + (cells[0] * 1e9).round() as u64;
        let mut fields = BTreeMap::from([("/hand", json!({})), ("/touch", json!({})), ("/objects", json!({}))]);
        for (title, cell) in titles.iter().zip(&cells).skip(1) {
            fields.get_mut(topic(title)).unwrap()[*title] = json!(cell);
        }
        for (topic, fields) in fields {
            let (shift_ms, late_ms) = match topic {
                "/hand" => (0, 0),
                "/touch" => (2, 4),
                _ if at % 2 == 1 => continue,
                _ => (1, 30),
            };
            let stamp_ns = time_ns + shift_ms * 1_000_000;
            messages.push(Message { topic, recorded_ns: stamp_ns + late_ms * 1_000_000, stamp_ns, fields });
        }
    }
    messages.sort_by_key(|message| message.recorded_ns);
    messages
}

/// The topic of a column of robosuite's recordings.
fn topic(title: &str) -> &'static str {
    match title {
        _ if title.starts_with("R_") || title.starts_with("L_") => "/hand",
        _ if title.starts_with("C_") || title.starts_with("F_") => "/touch",
        _ => "/objects",
    }
}

/// The binding of a recording, for its topics.
pub fn binding(name: &str, folder: &Path) -> String {
    let text = std::fs::read_to_string(demo(name)).unwrap();
    let mut is_channels = false;
    let line = |line: &str| {
        is_channels = if line.starts_with(' ') { is_channels } else { line.starts_with("channels:") };
        match line.split_once(": ").filter(|_| is_channels) {
            Some((key, column)) => {
                let (sign, column) = column.strip_prefix('-').map_or(("", column), |column| ("-", column));
                format!("{key}: {sign}{}.{column}\n", topic(column))
            }
            None if line.starts_with("time:") => String::new(),
            None => format!("{line}\n"),
        }
    };
    let path = folder.join("topics.binding.yaml");
    std::fs::write(&path, text.lines().map(line).collect::<String>()).unwrap();
    path.display().to_string()
}

pub fn bag(messages: &[Message], path: &Path) {
    let file = std::io::BufWriter::new(std::fs::File::create(path).unwrap());
    let mut writer = WriteOptions::new().chunk_size(Some(1 << 14)).create(file).unwrap();
    let mut channels = BTreeMap::new();
    for message in messages {
        let channel_id = *channels
            .entry(message.topic)
            .or_insert_with(|| writer.add_channel(0, message.topic, "json", &BTreeMap::new()).unwrap());
        let header =
            MessageHeader { channel_id, sequence: 0, log_time: message.recorded_ns, publish_time: message.recorded_ns };
        writer.write_to_known_channel(&header, message.text().as_bytes()).unwrap();
    }
    writer.finish().unwrap();
}

/// Tasks and segments, of all tracks.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelTexts {
    pub tasks: Vec<String>,
    pub segments: Vec<String>,
}

fn span(of: &Value, name: &str) -> String {
    let time = |key: &str| format!("{:.6}", of[key].as_f64().unwrap());
    format!("{} {} {} – {}", of["track"].as_str().unwrap(), of[name].as_str().unwrap(), time("start_s"), time("end_s"))
}

/// What `analyze` finds in a log.
pub fn analyzed(log: &str, binding: &str) -> LabelTexts {
    let output = teachtree_fed(&["analyze", log, "--binding", binding, "--format", "json"], b"");
    assert!(output.status.success(), "{}", complained(&output));
    let analysis: Value = serde_json::from_str(&said(&output)).unwrap();
    let mut found = LabelTexts { tasks: vec![], segments: vec![] };
    for track in analysis["tracks"].as_array().unwrap() {
        let all = |key: &str, name: &str| -> Vec<String> {
            let spans = track[key].as_array().unwrap().iter().cloned().map(|mut of| {
                of["track"] = track["track"].clone();
                span(&of, name)
            });
            spans.collect()
        };
        found.tasks.extend(all("tasks", "task"));
        found.segments.extend(all("relabeled", "primitive"));
    }
    found.tasks.sort();
    found.segments.sort();
    found
}

/// What is final of events, and the messages of issues.
pub fn finals(events: &str) -> (LabelTexts, Vec<String>) {
    let events: Vec<Value> = events.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert!(events.iter().enumerate().all(|(at, event)| event["sequence"] == at), "{events:?}");
    let all = |kind: &str, name: &str| {
        let finals = events.iter().filter(|event| event["event"] == kind && event["final"] == true);
        let mut spans: Vec<String> = finals.map(|event| span(event, name)).collect();
        spans.sort();
        spans
    };
    let issues = events.iter().filter(|event| event["event"] == "issue");
    let issue = |of: &Value| {
        let text = |key: &str| of[key].as_str().unwrap();
        format!("{} {} {}", text("kind"), text("channel"), text("message"))
    };
    (LabelTexts { tasks: all("task", "task"), segments: all("segment", "primitive") }, issues.map(issue).collect())
}

/// What `live` finds in a log.
fn live(args: &[&str]) -> (LabelTexts, Vec<String>) {
    let output = teachtree_fed(&[&["live", "--format", "json"], args].concat(), b"");
    assert!(output.status.success(), "{}", complained(&output));
    finals(&said(&output))
}

/// The recordings whose topics are joined here, with their bindings.
const JOINED: [(&str, &str); 3] = [
    ("SawyerLift_demo_1.csv", "sawyer_lift.binding.yaml"),
    ("SawyerNutAssembly_demo_1.csv", "sawyer_nut_assembly.binding.yaml"),
    ("BaxterLift_demo_1.csv", "baxter_lift.binding.yaml"),
];

#[test]
fn topics_are_joined_as_in_the_whole_bag() {
    let mut tasks = 0;
    for (log, name) in JOINED {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.mcap");
        bag(&messages(log), &path);
        let (path, binding) = (path.display().to_string(), binding(name, folder.path()));
        let whole = analyzed(&path, &binding);
        let (found, issues) = live(&[&path, "--binding", &binding, "--calibration", &path]);
        assert_eq!(found, whole, "{log}: {issues:?}");
        tasks += found.tasks.len();
    }
    assert!(tasks >= 3, "only {tasks} tasks were compared");
}

/// The camera stands in a frame of its own, which one message of `/tf_static` connects with that of the arm.
#[test]
fn poses_in_different_frames_are_composed_as_in_the_whole_bag() {
    let folder = tempfile::tempdir().unwrap();
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/ros2_bag");
    let text = std::fs::read_to_string(example.join("insertion.binding.yaml")).unwrap();
    // A live log needs the flag.
    let width = "/joint_states.position.gripper_width";
    let closed = format!("{width}\n  right.gripper.closed: {width} [m] < 43 mm");
    let binding = folder.path().join("bag.binding.yaml");
    let path = example.join("insertion/insertion.mcap").display().to_string();
    for frame in ["frame: base_link\n", ""] {
        assert!(text.contains("frame: base_link\n") && text.contains(width));
        let text = text.replace(width, &closed).replace("frame: base_link\n", frame);
        std::fs::write(&binding, text).unwrap();
        let binding = binding.display().to_string();
        let wanted = analyzed(&path, &binding);
        assert!(wanted.segments.iter().any(|segment| segment.contains("Insert")), "{:?}", wanted.segments);
        let (found, issues) = live(&[&path, "--binding", &binding, "--calibration", &path]);
        assert_eq!(found, wanted, "{issues:?}");
        let told = issues.iter().filter(|issue| issue.starts_with("different_frames"));
        assert_eq!(told.count(), usize::from(frame.is_empty()), "{issues:?}");
    }
}

/// Two drivers on one topic, each with a part of the joints, use the same stamps: their messages with equal stamps form one row.
#[test]
fn messages_with_equal_stamps_and_different_joints_form_one_row() {
    let folder = tempfile::tempdir().unwrap();
    let (log, name) = JOINED[1];
    let binding = binding(name, folder.path());
    let plain = messages(log);
    let split = plain.iter().flat_map(|message| {
        let fields = message.fields.as_object().unwrap();
        // The messages of the second driver are recorded later, like those of another process.
        [0, 1].map(|half| {
            let own = (0..)
                .zip(fields)
                .filter(|(at, _)| at % 2 == half)
                .map(|(_, (key, value))| (key.clone(), value.clone()));
            let recorded_ns = message.recorded_ns + 1_000 * half as u64;
            Message { recorded_ns, fields: Value::Object(own.collect()), ..message.clone() }
        })
    });
    let mut split: Vec<Message> = split.collect();
    split.sort_by_key(|message| message.recorded_ns);
    let [plain, split] = [("plain.mcap", plain), ("split.mcap", split)].map(|(name, messages)| {
        let path = folder.path().join(name);
        bag(&messages, &path);
        path.display().to_string()
    });
    let wanted = analyzed(&plain, &binding);
    assert_eq!(analyzed(&split, &binding), wanted);
    let (found, issues) = live(&[&split, "--binding", &binding, "--calibration", &plain]);
    assert_eq!(found, wanted, "{issues:?}");
    assert_eq!(issues, live(&[&plain, "--binding", &binding, "--calibration", &plain]).1);
}

/// One of two markers of a body is wrong in one message: it is rejected before the mean is computed, in live logs too.
#[test]
fn a_wrong_cell_of_one_marker_is_taken_out_of_topics() {
    let folder = tempfile::tempdir().unwrap();
    let (log, name) = JOINED[0];
    let binding = binding(name, folder.path());
    let text = std::fs::read_to_string(&binding).unwrap();
    let both = "{mean: [\"/objects.<object>_p<xyz>\", \"/objects.other_<object>_p<xyz>\"]}";
    let changed = text.replace("/objects.<object>_p<xyz>", both);
    assert_ne!(changed, text);
    std::fs::write(&binding, changed).unwrap();
    let mut messages = messages(log);
    for message in messages.iter_mut().filter(|message| message.topic == "/objects") {
        for axis in ["x", "y", "z"] {
            message.fields[format!("other_cube_p{axis}")] = message.fields[format!("cube_p{axis}")].clone();
        }
    }
    let written = |name: &str, messages: &[Message]| {
        let path = folder.path().join(name);
        bag(messages, &path);
        path.display().to_string()
    };
    let plain = written("plain.mcap", &messages);
    let wrong = messages.iter_mut().filter(|message| message.topic == "/objects").nth(50).unwrap();
    wrong.fields["other_cube_px"] = json!(wrong.fields["cube_px"].as_f64().unwrap() + 0.35);
    let spoiled = written("spoiled.mcap", &messages);
    let wanted = analyzed(&plain, &binding);
    assert_eq!(analyzed(&spoiled, &binding), wanted);
    let (found, issues) = live(&[&spoiled, "--binding", &binding, "--calibration", &plain]);
    assert_eq!(found, wanted, "{issues:?}");
    let named =
        issues.iter().filter(|issue| issue.starts_with("impossible_jump cube.position `/objects.other_cube_px`"));
    assert_eq!(named.count(), 1, "{issues:?}");
}

/// The parts of a recording before and behind a silence of its camera; messages that come too late or twice.
#[test]
fn what_topics_lack_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let (log, name) = JOINED[1];
    let binding = binding(name, folder.path());
    let mut messages = messages(log);
    let at_s = |message: &Message| (message.stamp_ns - BEGIN_NS) as f64 * 1e-9;
    messages.retain(|message| message.topic != "/objects" || !(25.0..28.0).contains(&at_s(message)));
    let [calm, silent] = [10.0, 27.5].map(|at| messages.iter().position(|message| at_s(message) > at).unwrap());
    // Twice, and too late: of one topic, and behind all topics while one is silent.
    let early = |topic: &str, before: usize, ms: u64| {
        let same = messages[..before].iter().rev().find(|message| message.topic == topic).unwrap();
        Message { stamp_ns: same.stamp_ns - ms * 1_000_000, ..same.clone() }
    };
    let extra =
        [(silent, early("/objects", silent, 0)), (calm, early("/hand", calm, 500)), (calm, early("/hand", calm, 0))];
    for (at, message) in extra {
        messages.insert(at, message);
    }
    let path = folder.path().join("log.mcap");
    bag(&messages, &path);
    let path = path.display().to_string();
    let (found, issues) = live(&[&path, "--binding", &binding, "--calibration", &path]);
    insta::assert_snapshot!(format!("{}\n\n{}", found.tasks.join("\n"), issues.join("\n")));
}

#[test]
fn a_bag_that_does_not_fit_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    bag(&messages(JOINED[0].0)[..200], &path);
    let path = path.display().to_string();
    let binding = binding(JOINED[0].1, folder.path());
    let refused = |args: &[&str]| {
        let output = teachtree_fed(&[&["live"], args].concat(), b"");
        assert_eq!(output.status.code(), Some(2));
        complained(&output).replace(&folder.path().display().to_string(), "FOLDER")
    };
    let text = std::fs::read_to_string(&binding).unwrap();
    let other = |from: &str, to: &str| {
        let changed = text.replace(from, to);
        assert_ne!(changed, text);
        std::fs::write(folder.path().join("other.binding.yaml"), changed).unwrap();
        refused(&[&path, "--binding", &folder.path().join("other.binding.yaml").display().to_string()])
    };
    let said = [
        refused(&[&path]),
        other("/touch.C_<object>_env", "/tuch.C_<object>_env"),
        other("resample: 100 Hz", ""),
        other("channels:", "time: t [s]\nchannels:"),
    ];
    insta::assert_snapshot!(said.join("\n"));
}
