//! `export lerobot`: bags become sets whose episodes are those of the bag, at one rate, as our reader, `datasets` and lerobot read them.

use crate::live_topics::{BEGIN_NS, binding, messages};
use crate::program::{all_said, complained, python_with, said, teachtree_in};
use mcap::{WriteOptions, records::MessageHeader};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use teachtree_logs::read::formats;
use teachtree_logs::read::table::ColumnRequest;

const LOG: &str = "SawyerNutAssembly_demo_1.csv";
const BINDING: &str = "sawyer_nut_assembly.binding.yaml";
const IMAGE: &[u8] = b"std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\nuint8[] data\n================\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n================\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";

/// A message in a bag: topic, time, bytes; JSON but of a camera.
type Sent = (String, u64, Vec<u8>);

/// A picture of 6 x 8 pixels, which says its number in red.
fn image(stamp_ns: u64, number: u8) -> Vec<u8> {
    let mut message = vec![0, 1, 0, 0];
    let aligned = |message: &mut Vec<u8>| message.resize((message.len() - 4).next_multiple_of(4) + 4, 0);
    let put = |message: &mut Vec<u8>, number: u32| {
        message.resize((message.len() - 4).next_multiple_of(4) + 4, 0);
        message.extend(number.to_le_bytes());
    };
    let text = |message: &mut Vec<u8>, text: &str| {
        aligned(message);
        message.extend((text.len() as u32).to_le_bytes());
        message.extend(text.as_bytes());
    };
    put(&mut message, (stamp_ns / 1_000_000_000) as u32);
    put(&mut message, (stamp_ns % 1_000_000_000) as u32);
    text(&mut message, "camera\0");
    put(&mut message, 6);
    put(&mut message, 8);
    text(&mut message, "bgr8\0");
    message.push(0);
    put(&mut message, 26);
    let row: Vec<u8> = [7, 9, number].repeat(8).into_iter().chain([99, 99]).collect();
    put(&mut message, 26 * 6);
    message.extend(row.repeat(6));
    message
}

fn write_bag(path: &Path, mut sent: Vec<Sent>) {
    sent.sort_by_key(|(_, time, _)| *time);
    let file = std::io::BufWriter::new(std::fs::File::create(path).unwrap());
    let mut writer = WriteOptions::new().create(file).unwrap();
    let schema = writer.add_schema("sensor_msgs/msg/Image", "ros2msg", IMAGE).unwrap();
    let mut channels: BTreeMap<String, u16> = BTreeMap::new();
    for (topic, time_ns, data) in sent {
        let (schema, encoding) = if data.starts_with(b"{") { (0, "json") } else { (schema, "cdr") };
        let channel = || writer.add_channel(schema, &topic, encoding, &BTreeMap::new()).unwrap();
        let known = channels.get(&topic).copied();
        let channel_id = known.unwrap_or_else(channel);
        channels.insert(topic, channel_id);
        let header = MessageHeader { channel_id, sequence: 0, log_time: time_ns, publish_time: time_ns };
        writer.write_to_known_channel(&header, &data).unwrap();
    }
    writer.finish().unwrap();
}

/// The demonstration as a bag with a camera at 25 Hz.
fn demonstration(folder: &Path, name: &str) {
    let mut sent: Vec<Sent> = messages(LOG)
        .iter()
        .map(|message| (message.topic.to_string(), message.recorded_ns, message.text().into_bytes()))
        .collect();
    let (first, last) = (sent.iter().map(|it| it.1).min().unwrap(), sent.iter().map(|it| it.1).max().unwrap());
    for (number, time_ns) in (first..last).step_by(40_000_000).enumerate() {
        sent.push(("/wrist/image_raw".into(), time_ns, image(time_ns, number as u8)));
    }
    write_bag(&folder.join(name), sent);
}

/// Joints that move twice for 4 s, after and before rests of 2 s, at 50 Hz.
fn moves(folder: &Path, name: &str, names: &[&str]) {
    let mut sent: Vec<Sent> = Vec::new();
    for at in 0..700_u64 {
        let time_s = at as f64 / 50.0;
        let part = time_s % 6.0;
        let angle = if part < 2.0 || time_s > 12.0 { 0.0 } else { ((part - 2.0) / 4.0 * std::f64::consts::TAU).sin() };
        let time_ns = BEGIN_NS + at * 20_000_000;
        let joints: serde_json::Map<String, Value> = names
            .iter()
            .enumerate()
            .map(|(joint, name)| ((*name).into(), json!(angle * (1.0 + joint as f64))))
            .collect();
        let stamp = json!({ "sec": time_ns / 1_000_000_000, "nanosec": time_ns % 1_000_000_000 });
        let message = json!({ "header": { "stamp": stamp }, "position": joints });
        sent.push(("/joints".into(), time_ns, message.to_string().into_bytes()));
    }
    write_bag(&folder.join(name), sent);
}

/// The columns of an episode as our reader gives them.
fn columns(log: &Path) -> BTreeMap<String, Vec<f64>> {
    let source = formats::open(log).unwrap();
    let header = source.header();
    let wants = vec![ColumnRequest::Optional(1.0); header.len()];
    let table = source.read(&wants, Some(1.0)).unwrap();
    header.into_iter().zip(table.numbers).collect()
}

fn info(set: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(set.join("meta/info.json")).unwrap()).unwrap()
}

fn exported(folder: &Path, args: &[&str]) -> String {
    let output = teachtree_in(folder, &[&["export", "lerobot"], args].concat());
    assert!(output.status.success(), "{args:?}: {}", all_said(&output));
    said(&output)
}

/// A set of the demonstration, cut by its tasks, with the times at which its episodes begin, s of the log.
fn demonstrated(folder: &Path) -> Vec<f64> {
    demonstration(folder, "log.mcap");
    let binding = binding(BINDING, folder);
    let text = exported(
        folder,
        &[
            "log.mcap",
            "-o",
            "set",
            "--binding",
            &binding,
            "--state",
            "/hand",
            "--action",
            "next",
            "--margin",
            "0.25",
            "--fps",
            "25",
        ],
    );
    assert!(text.contains("set: 2 episodes, "), "{text}");
    assert!(text.contains("set: 2 episodes, "), "{text}");
    assert!(text.contains("next.success: 2 of 2 episodes"), "{text}");
    assert!(text.contains("observation.images.wrist: 8 x 6"), "{text}");
    let output = teachtree_in(folder, &["analyze", "log.mcap", "--binding", &binding, "--format", "json"]);
    let analysis: Value = serde_json::from_str(&said(&output)).unwrap();
    let tasks = analysis["tracks"][0]["tasks"].as_array().unwrap();
    let known: Vec<&Value> = tasks.iter().filter(|task| task["task"] != "unknown").collect();
    assert_eq!(known.len(), 2, "{analysis}");
    // A margin ends where the analysis does, and in the middle between two tasks.
    let time = |part: &Value, key: &str| part[key].as_f64().unwrap();
    let first = time(&analysis["tracks"][0]["relabeled"][0], "start_s");
    let middle = 0.5 * (time(known[0], "end_s") + time(known[1], "start_s"));
    vec![(time(known[0], "start_s") - 0.25).max(first), (time(known[1], "start_s") - 0.25).max(middle)]
}

#[test]
fn tasks_become_episodes_at_one_rate() {
    let folder = tempfile::tempdir().unwrap();
    let starts = demonstrated(folder.path());
    let set = folder.path().join("set");
    let info = info(&set);
    assert_eq!(
        (&info["codebase_version"], &info["fps"], &info["total_episodes"]),
        (&json!("v3.0"), &json!(25), &json!(2))
    );
    assert_eq!(info["features"]["observation.images.wrist"]["shape"], json!([6, 8, 3]));
    assert_eq!(info["teachtree"]["bags"], json!(["log.mcap"]));
    // The numbers lie between those of the messages around them.
    let rows: Vec<csv::StringRecord> =
        csv::Reader::from_path(Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite").join(LOG))
            .unwrap()
            .records()
            .map(Result::unwrap)
            .collect();
    let header =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite").join(LOG)).unwrap();
    let column = header.lines().next().unwrap().split(',').position(|title| title == "R_hand_px").unwrap();
    let cell = |row: &csv::StringRecord, at: usize| row[at].parse::<f64>().unwrap();
    let zero = cell(&rows[0], 0);
    for (episode, start) in starts.iter().enumerate() {
        let columns = columns(&set.join("..").join(format!("set#{episode}")));
        let time = &columns["time [s]"];
        let hand = &columns["observation.state.hand.R_hand_px"];
        assert!(time.len() > 25);
        for (frame, value) in hand.iter().enumerate() {
            let at = zero + start + time[frame];
            let next = rows.iter().position(|row| cell(row, 0) >= at).unwrap_or(rows.len() - 1).max(1);
            let (a, b) = (&rows[next - 1], &rows[next]);
            let part = (at - cell(a, 0)) / (cell(b, 0) - cell(a, 0));
            let expected = cell(a, column) + part * (cell(b, column) - cell(a, column));
            assert!((value - expected).abs() < 2e-4, "{episode} {frame}: {value}, expected {expected}");
        }
        // An action is the next state.
        let action = &columns["action.hand.R_hand_px"];
        assert_eq!(action[..action.len() - 1], hand[1..]);
        let success = &columns["next.success"];
        assert!(success.is_sorted() && success[0] == 0.0 && success.last() == Some(&1.0), "{success:?}");
    }
    // An audit finds nothing wrong with it, and it can be labeled again only over its labels.
    let audit = teachtree_in(folder.path(), &["audit", "set", "--allow", "idle"]);
    assert!(said(&audit).contains("2 of 2 recordings are good"), "{}", all_said(&audit));
}

#[test]
fn rests_end_episodes() {
    let folder = tempfile::tempdir().unwrap();
    moves(folder.path(), "one.mcap", &["pan", "lift"]);
    moves(folder.path(), "two.mcap", &["pan", "lift"]);
    moves(folder.path(), "other.mcap", &["pan"]);
    let args = ["one.mcap", "two.mcap", "-o", "set", "--task", "turn", "--fps", "20", "--margin", "0"];
    let text = exported(folder.path(), &args);
    assert!(text.contains("set: 4 episodes, "), "{text}");
    assert!(
        text.contains("observation.state: 2 numbers, joints.position.pan, joints.position.lift\n  action: none"),
        "{text}"
    );
    for episode in 0..4 {
        let columns = columns(&folder.path().join(format!("set#{episode}")));
        let pan = &columns["observation.state.joints.position.pan"];
        assert!((75..=82).contains(&pan.len()), "{}", pan.len());
        assert!(pan.iter().fold(0.0_f64, |most, value| most.max(*value)) > 0.99);
        assert!(!columns.contains_key("next.success"));
    }
    // A bag with other joints is not in the set.
    let output = teachtree_in(
        folder.path(),
        &[&["export", "lerobot", "other.mcap"], &args[..2], &["-o", "more"], &args[4..]].concat(),
    );
    assert_eq!(output.status.code(), Some(3), "{}", all_said(&output));
    assert!(
        complained(&output)
            .contains("one.mcap: has `joints.position.lift` for `observation.state`, which the bags before lack"),
        "{}",
        complained(&output)
    );
    assert_eq!(info(&folder.path().join("more"))["total_episodes"], 2);
    // The same bags give the same bytes.
    exported(folder.path(), &[&args[..2], &["-o", "again"], &args[4..]].concat());
    for file in ["data/chunk-000/file-000.parquet", "meta/episodes/chunk-000/file-000.parquet", "meta/stats.json"] {
        let bytes = |set: &str| std::fs::read(folder.path().join(set).join(file)).unwrap();
        assert!(bytes("set") == bytes("again"), "{file}");
    }
}

/// Which topic sends first differs between recordings.
#[test]
fn bags_of_a_set_have_their_topics_in_any_order() {
    let folder = tempfile::tempdir().unwrap();
    for (name, arms) in [("one.mcap", ["/left", "/right"]), ("two.mcap", ["/right", "/left"])] {
        let mut sent: Vec<Sent> = Vec::new();
        for at in 0..100_u64 {
            for arm in arms {
                let angle = if arm == "/left" { at as f64 / 100.0 } else { -(at as f64) / 100.0 };
                let message = json!({ "position": { "pan": angle } });
                sent.push((arm.into(), BEGIN_NS + at * 20_000_000, message.to_string().into_bytes()));
            }
        }
        write_bag(&folder.path().join(name), sent);
    }
    exported(folder.path(), &["one.mcap", "two.mcap", "-o", "set", "--task", "turn", "--cut", "whole", "--fps", "20"]);
    for episode in 0..2 {
        let columns = columns(&folder.path().join(format!("set#{episode}")));
        let [left, right] = ["left", "right"].map(|arm| &columns[&format!("observation.state.{arm}.position.pan")]);
        assert!(left.last() > Some(&0.9) && right.last() < Some(&-0.9), "{episode}: {left:?} {right:?}");
    }
}

#[test]
fn what_cannot_be_exported_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    moves(folder.path(), "log.mcap", &["pan"]);
    std::fs::create_dir(folder.path().join("there")).unwrap();
    std::fs::write(folder.path().join("log.csv"), "time [s],x\n0,1\n1,2\n").unwrap();
    let task = ["--task", "turn"];
    for (args, message) in [
        (&["log.mcap", "-o", "set"][..], "expected the task of the episodes"),
        (&["log.mcap", "-o", "set", "--cut", "tasks"], "tasks are found by rules, found no binding"),
        (&["log.mcap", "-o", "there", task[0], task[1]], "exists already"),
        (&["log.csv", "-o", "set", task[0], task[1]], "is not a bag, expected an MCAP file or a bag of ROS 1 or ROS 2"),
        (
            &["log.mcap", "-o", "set", task[0], task[1], "--state", "/joint"],
            "no column of numbers begins with `/joint`",
        ),
        (&["log.mcap", "-o", "set", task[0], task[1], "--camera", "/top"], "no topic `/top` has pictures"),
        (&["log.mcap", "-o", "set", task[0], task[1], "--rest", "0.001", "--fps", "2000"], "2000"),
    ] {
        let output = teachtree_in(folder.path(), &[&["export", "lerobot"], args].concat());
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", all_said(&output));
        assert!(complained(&output).contains(message), "{args:?}: {}", complained(&output));
        assert!(!folder.path().join("set").exists());
    }
}

/// Pictures, words and success as lerobot gives them, and as its tools for editing leave them.
const LEROBOT: &str = "
import sys
from lerobot.datasets.dataset_tools import delete_episodes, merge_datasets, split_dataset
from lerobot.datasets.language_render import active_at
from lerobot.datasets.lerobot_dataset import LeRobotDataset

def check(data, episodes):
    assert data.num_episodes == episodes, data.num_episodes
    words, reds = set(), []
    for at in range(len(data)):
        item = data[at]
        image = item['observation.images.wrist']
        assert tuple(image.shape) == (3, 6, 8), image.shape
        assert abs(float(image[1, 0, 0]) * 255 - 9) < 1e-3 and abs(float(image[2, 5, 7]) * 255 - 7) < 1e-3
        reds.append(round(float(image[0, 3, 3]) * 255))
        rows = item['language_persistent']
        found = active_at(float(item['timestamp']), persistent=rows, style='motion')
        words.add(found['content'] if found else None)
    assert any(word and word.startswith('insert') for word in words), words
    assert len(set(reds)) > 20
    last = data.hf_dataset[len(data) - 1]
    assert bool(last['next.success'])
    stats = data.meta.stats
    assert stats['observation.state']['mean'].shape == (data.features['observation.state']['shape'][0],)
    assert stats['observation.images.wrist']['mean'].shape == (3, 1, 1)
    return words

data = LeRobotDataset('local/set', root='set')
words = check(data, 2)
assert data[0]['task'] == data.meta.tasks.iloc[0].name and 'peg in hole' in data[0]['task'], data[0]['task']
window = LeRobotDataset('local/set', root='set', delta_timestamps={'observation.state': [-0.04, 0.0], 'action': [0.0, 0.04]})
assert window[10]['action'].shape[0] == 2
one = delete_episodes(data, [0], output_dir='one', repo_id='local/one')
check(LeRobotDataset('local/one', root='one'), 1)
parts = split_dataset(data, {'first': [0], 'second': [1]}, output_dir='parts')
check(parts['second'], 1)
merge_datasets([parts['first'], parts['second']], output_repo_id='local/both', output_dir='both')
assert check(LeRobotDataset('local/both', root='both'), 2) == words
print('all as expected')
";

#[test]
fn lerobot_loads_the_set_and_edits_it() {
    let Some(python) = python_with("lerobot.datasets.lerobot_dataset", "lerobot") else { return };
    let folder = tempfile::tempdir().unwrap();
    demonstrated(folder.path());
    let output = Command::new(&python)
        .args(["-c", LEROBOT])
        .current_dir(folder.path())
        .env("HF_HUB_OFFLINE", "1")
        .env("HF_HOME", folder.path().join("hub"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", all_said(&output));
}

/// The same without lerobot: the columns of the data file, and the pixels of a picture.
const DATASETS: &str = "
import zlib
from datasets import Dataset
frames = Dataset.from_parquet('set/data/chunk-000/file-000.parquet')
kinds = {name: repr(kind) for name, kind in frames.features.items()}
assert kinds['observation.images.wrist'].startswith('Image'), kinds
assert kinds['observation.state'] == 'List(Value(\\'float32\\'))', kinds
file = frames.with_format('arrow')[20:21].column('observation.images.wrist')[0].as_py()['bytes']
assert file[:8] == b'\\x89PNG\\r\\n\\x1a\\n' and file[16:26] == (8).to_bytes(4, 'big') + (6).to_bytes(4, 'big') + bytes([8, 2])
start = file.index(b'IDAT')
pixels = zlib.decompress(file[start + 4:start + 4 + int.from_bytes(file[start - 4:start], 'big')])
row = pixels[:25]
assert pixels == row * 6 and row[0] == 0 and row[2:4] == bytes([9, 7]) and row[1:4] * 8 == row[1:], row
print('all as expected')
";

#[test]
fn datasets_loads_the_data_files() {
    let Some(python) = python_with("datasets", "`datasets`") else { return };
    let folder = tempfile::tempdir().unwrap();
    demonstrated(folder.path());
    let output = Command::new(&python).args(["-c", DATASETS]).current_dir(folder.path()).output().unwrap();
    assert!(output.status.success(), "{}", all_said(&output));
}
