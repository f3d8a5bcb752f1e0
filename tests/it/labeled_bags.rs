//! `analyze --mcap --into`: every message of the log is there as it was, and labels lie at its stamps. The traces of `--trace`.

use crate::program::{all_said, complained, said, teachtree_in};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, WriteOptions};
use serde_json::{Map, Value, json};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

const LOG: &str = "nut_assembly_panda_demo_1.csv";
const BINDING: &str = "panda_nut_assembly.binding.yaml";
/// When the first row was recorded, and how much later than its stamp, ns.
const RECORDED: u64 = 1_760_000_000_000_000_000;
const LATER: u64 = 3_000_000;

fn demos() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite")
}

/// How a bag is stored.
#[derive(Clone, Copy)]
enum BagLayout {
    Chunks(Option<Compression>),
    Loose,
    /// The device that stamps messages has a clock of its own.
    OtherClock,
}

/// Writes the demonstration as a bag: its rows as JSON, messages in between that are not read, an attachment and metadata. And its binding, and what its
/// recorder's clock showed at t = 0.
fn bag(folder: &Path, stored: BagLayout) -> u64 {
    let mut rows = csv::Reader::from_path(demos().join(LOG)).unwrap();
    let header: Vec<String> = rows.headers().unwrap().iter().map(str::to_string).collect();
    let options = match stored {
        BagLayout::Chunks(compression) => WriteOptions::new().compression(compression).chunk_size(Some(20_000)),
        BagLayout::Loose => WriteOptions::new().use_chunks(false),
        BagLayout::OtherClock => WriteOptions::new(),
    };
    let file = std::io::BufWriter::new(std::fs::File::create(folder.join("log.mcap")).unwrap());
    let mut writer = options.profile("ros2").create(file).unwrap();
    let camera = writer.add_schema("my_msgs/msg/Image", "ros2msg", b"uint8[] data\n").unwrap();
    let of = BTreeMap::from([("offered_qos_profiles".to_string(), "- depth: 3".to_string())]);
    let log = writer.add_channel(0, "/log", "json", &BTreeMap::new()).unwrap();
    let image = writer.add_channel(camera, "/camera", "cdr", &of).unwrap();
    let frames = writer.add_channel(0, "/tf", "protobuf", &BTreeMap::new()).unwrap();
    let zero = 6.002;
    for (at, row) in rows.records().enumerate() {
        let row = row.unwrap();
        let mut object: Map<String, Value> =
            header.iter().zip(&row).map(|(name, cell)| (name.clone(), json!(cell.parse::<f64>().unwrap()))).collect();
        let since = ((object["t"].as_f64().unwrap() - zero) * 1e9).round() as u64;
        let mut time = RECORDED + since;
        if matches!(stored, BagLayout::OtherClock) {
            let stamp = 50_000_000_000 + since;
            object.insert(
                "header".into(),
                json!({ "stamp": { "sec": stamp / 1_000_000_000, "nanosec": stamp % 1_000_000_000 } }),
            );
            time += LATER;
        }
        let mut put = |channel: u16, time: u64, data: &[u8]| {
            let header =
                MessageHeader { channel_id: channel, sequence: at as u32, log_time: time, publish_time: time - 1 };
            writer.write_to_known_channel(&header, data).unwrap();
        };
        put(log, time, serde_json::to_string(&object).unwrap().as_bytes());
        if at % 5 == 0 {
            put(image, time + 7, &[vec![0, 1, 0, 0, 2, 0, 0, 0], vec![at as u8; 2]].concat());
            put(frames, time, &[0xff, at as u8]);
        }
        if at == 30 {
            let data = Cow::Owned(vec![7; 5000]);
            let attachment = Attachment {
                log_time: time,
                create_time: 5,
                name: "arm.urdf".into(),
                media_type: "text/xml".into(),
                data,
            };
            writer.attach(&attachment).unwrap();
            let metadata = BTreeMap::from([("operator".to_string(), "A".to_string())]);
            writer.write_metadata(&Metadata { name: "session".into(), metadata }).unwrap();
        }
    }
    writer.finish().unwrap();
    // The columns of the only sheet are called by its topic.
    let binding = std::fs::read_to_string(demos().join(BINDING)).unwrap().replace("time: t [s]\n", "");
    let (head, rest) = binding.split_once("channels:\n").unwrap();
    let (channels, tail) = rest.split_once("\n\n").unwrap();
    let bound = |line: &str| {
        let (name, column) = line.split_once(": ").unwrap();
        let (sign, column) = column.strip_prefix('-').map_or(("", column), |column| ("-", column));
        format!("{name}: {sign}/log.{column}\n")
    };
    let channels: String = channels.lines().map(bound).collect();
    std::fs::write(folder.join("log.binding.yaml"), format!("{head}channels:\n{channels}\n{tail}")).unwrap();
    let at_zero = (zero * 1e9) as u64;
    RECORDED - at_zero + if matches!(stored, BagLayout::OtherClock) { LATER } else { 0 }
}

fn label(folder: &Path, log: &str, more: &[&str]) -> std::process::Output {
    let args = ["analyze", log, "--binding", "log.binding.yaml", "--mcap", "labeled.mcap", "--into"];
    teachtree_in(folder, &[&args[..], more].concat())
}

/// A message: topic, encoding, schema, sequence, both times, bytes.
type Message = (String, String, String, u32, u64, u64, Vec<u8>);

/// The messages of a file in its order.
fn messages(bytes: &[u8]) -> Vec<Message> {
    let of = |message: mcap::Message| {
        let schema = message.channel.schema.as_ref().map_or(String::new(), |schema| schema.name.clone());
        let channel = &message.channel;
        let encoding = format!("{} {:?}", channel.message_encoding, channel.metadata);
        let times = (message.log_time, message.publish_time);
        (channel.topic.clone(), encoding, schema, message.sequence, times.0, times.1, message.data.to_vec())
    };
    mcap::MessageStream::new(bytes).unwrap().map(|message| of(message.unwrap())).collect()
}

fn is_ours(message: &Message) -> bool {
    message.0.starts_with("/teachtree/")
}

fn check(stored: BagLayout) {
    let folder = tempfile::tempdir().unwrap();
    let zero = bag(folder.path(), stored);
    let original = std::fs::read(folder.path().join("log.mcap")).unwrap();
    let output = label(folder.path(), "log.mcap", &["--signals", "near"]);
    assert!(output.status.success(), "{}", all_said(&output));
    assert_eq!(std::fs::read(folder.path().join("log.mcap")).unwrap(), original, "the log is only read");
    let bytes = std::fs::read(folder.path().join("labeled.mcap")).unwrap();
    let (ours, theirs): (Vec<Message>, Vec<Message>) = messages(&bytes).into_iter().partition(is_ours);
    assert!(theirs == messages(&original), "all messages of the log, in its order");
    assert!(ours.windows(2).all(|pair| pair[0].4 <= pair[1].4), "in the order of their times");
    // The index finds each of them, and what is beside them.
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let old = mcap::Summary::read(&original).unwrap().unwrap();
    let mut indexed: Vec<Message> = Vec::new();
    for chunk in &summary.chunk_indexes {
        for message in summary.stream_chunk(&bytes, chunk).unwrap() {
            let message = message.unwrap();
            assert!((chunk.message_start_time..=chunk.message_end_time).contains(&message.log_time));
        }
        let places: usize = summary.read_message_indexes(&bytes, chunk).unwrap().values().map(Vec::len).sum();
        indexed.extend((0..places).map(|_| Message::default()));
    }
    assert_eq!(indexed.len(), ours.len() + theirs.len(), "each message is in the index of its chunk");
    let statistics = summary.stats.as_ref().unwrap();
    assert_eq!(statistics.message_count as usize, ours.len() + theirs.len());
    assert_eq!(statistics.channel_message_counts.len(), summary.channels.len());
    assert_eq!((statistics.attachment_count, statistics.metadata_count), (1, 2));
    let attached = mcap::read::attachment(&bytes, &summary.attachment_indexes[0]).unwrap();
    assert_eq!(attached, mcap::read::attachment(&original, &old.attachment_indexes[0]).unwrap());
    let metadata: BTreeMap<String, BTreeMap<String, String>> = summary
        .metadata_indexes
        .iter()
        .map(|index| mcap::read::metadata(&bytes, index).unwrap())
        .map(|metadata| (metadata.name, metadata.metadata))
        .collect();
    assert_eq!(metadata["session"]["operator"], "A");
    assert!(metadata["teachtree"]["digest"].starts_with("sha256:") || !metadata["teachtree"]["digest"].is_empty());
    // Labels are where the analysis of the table has them, by the clock of the recorder.
    let args = ["analyze", LOG, "--binding", BINDING, "--format", "json"];
    let document: Value = serde_json::from_str(&said(&teachtree_in(&demos(), &args))).unwrap();
    let spans = document["tracks"][0]["relabeled"].as_array().unwrap();
    let times = ours.iter().filter(|message| message.0 == "/teachtree/right/primitive").map(|message| message.4);
    let starts: Vec<u64> =
        spans.iter().map(|span| span["start_s"].as_f64().unwrap()).map(|s| (s * 1e9).round() as u64).collect();
    let found: Vec<u64> = times.map(|time| time - zero).collect();
    assert_eq!(found.len(), spans.len() + 1);
    for (found, expected) in found.iter().zip(&starts) {
        assert!(found.abs_diff(*expected) <= 1000, "{found} ns, expected {expected} ns");
    }
    // Poses keep apart from those of the robot.
    let topics: BTreeSet<&str> = ours.iter().map(|message| message.0.as_str()).collect();
    assert!(topics.contains("/teachtree/tf") && topics.contains("/teachtree/signal/right/near"), "{topics:?}");
    // The copy is a log like the one that it is of.
    let args = ["analyze", "labeled.mcap", "--binding", "log.binding.yaml", "--format", "csv"];
    let again = said(&teachtree_in(folder.path(), &args));
    let first = said(&teachtree_in(
        folder.path(),
        &["analyze", "log.mcap", "--binding", "log.binding.yaml", "--format", "csv"],
    ));
    assert_eq!(again.replace("labeled.mcap", "log.mcap"), first);
    let output = label(folder.path(), "labeled.mcap", &["-o", "x"]);
    assert_eq!(output.status.code(), Some(2), "{}", all_said(&output));
    check_in_python(folder.path());
}

/// The library of others finds all messages, by the order of the file and by the index.
fn check_in_python(folder: &Path) {
    let python = std::env::var("TEACHTREE_PYTHON").unwrap_or_else(|_| "python3".into());
    let run = |args: &[&str]| Command::new(&python).args(args).current_dir(folder).output();
    if !run(&["-c", "import mcap_ros2"]).is_ok_and(|output| output.status.success()) {
        let _ = writeln!(std::io::stderr(), "skipped: Python with `mcap-ros2-support` is not installed");
        return;
    }
    let tool = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/check_mcap.py");
    let output = run(&[tool.to_str().unwrap(), "labeled.mcap", "log.mcap"]).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(String::from_utf8_lossy(&output.stdout).contains("all messages of log.mcap"));
}

#[test]
fn a_bag_in_compressed_chunks_keeps_all_its_messages() {
    check(BagLayout::Chunks(Some(Compression::Zstd)));
    check(BagLayout::Chunks(Some(Compression::Lz4)));
}

#[test]
fn a_bag_without_compression_or_chunks_keeps_all_its_messages() {
    check(BagLayout::Chunks(None));
    check(BagLayout::Loose);
}

#[test]
fn labels_lie_over_messages_whose_stamps_are_of_another_clock() {
    check(BagLayout::OtherClock);
}

#[test]
fn a_bag_that_is_cut_off_keeps_what_is_there() {
    let folder = tempfile::tempdir().unwrap();
    bag(folder.path(), BagLayout::Chunks(Some(Compression::Zstd)));
    let original = std::fs::read(folder.path().join("log.mcap")).unwrap();
    let whole = messages(&original);
    std::fs::write(folder.path().join("log.mcap"), &original[..original.len() * 2 / 3]).unwrap();
    let output = label(folder.path(), "log.mcap", &[]);
    assert!(output.status.success(), "{}", all_said(&output));
    let bytes = std::fs::read(folder.path().join("labeled.mcap")).unwrap();
    let kept: Vec<Message> = messages(&bytes).into_iter().filter(|message| !is_ours(message)).collect();
    assert!(kept.len() > 100 && kept.len() < whole.len() && kept == whole[..kept.len()], "{}", kept.len());
    let statistics = mcap::Summary::read(&bytes).unwrap().unwrap().stats.unwrap();
    assert!(statistics.message_count as usize > kept.len());
}

/// Splits a bag into a folder of two files; with `renumbered`, the second one has other numbers for its topics.
fn split(folder: &Path, renumbered: bool) {
    let original = std::fs::read(folder.join("log.mcap")).unwrap();
    let all: Vec<mcap::Message> = mcap::MessageStream::new(&original).unwrap().map(Result::unwrap).collect();
    std::fs::create_dir(folder.join("two")).unwrap();
    let metadata =
        "rosbag2_bagfile_information:\n  storage_identifier: mcap\n  relative_file_paths: [a.mcap, b.mcap]\n";
    std::fs::write(folder.join("two/metadata.yaml"), metadata).unwrap();
    let (first, second) = all.split_at(all.len() / 2);
    for (name, part, is_second) in [("a.mcap", first, false), ("b.mcap", second, true)] {
        let file = std::io::BufWriter::new(std::fs::File::create(folder.join("two").join(name)).unwrap());
        let mut writer = WriteOptions::new().profile("ros2").create(file).unwrap();
        let mut channels: Vec<_> = first.iter().map(|message| message.channel.clone()).collect();
        channels.sort_by_key(|channel| channel.topic.clone());
        channels.dedup_by_key(|channel| channel.topic.clone());
        if is_second && renumbered {
            channels.reverse();
        }
        let mut ids = BTreeMap::new();
        for channel in &channels {
            let schema = channel.schema.as_ref();
            let id = schema.map_or(0, |of| writer.add_schema(&of.name, &of.encoding, &of.data).unwrap());
            let channel_id =
                writer.add_channel(id, &channel.topic, &channel.message_encoding, &channel.metadata).unwrap();
            ids.insert(channel.topic.clone(), channel_id);
        }
        for message in part {
            let header = MessageHeader {
                channel_id: ids[&message.channel.topic],
                sequence: message.sequence,
                log_time: message.log_time,
                publish_time: message.publish_time,
            };
            writer.write_to_known_channel(&header, &message.data).unwrap();
        }
        writer.finish().unwrap();
    }
}

#[test]
fn a_bag_of_several_files_keeps_all_its_messages() {
    for renumbered in [false, true] {
        let folder = tempfile::tempdir().unwrap();
        bag(folder.path(), BagLayout::Chunks(Some(Compression::Zstd)));
        split(folder.path(), renumbered);
        let output = label(folder.path(), "two", &[]);
        assert!(output.status.success(), "{}", all_said(&output));
        let bytes = std::fs::read(folder.path().join("labeled.mcap")).unwrap();
        let (ours, theirs): (Vec<Message>, Vec<Message>) = messages(&bytes).into_iter().partition(is_ours);
        assert!(!ours.is_empty());
        assert!(theirs == messages(&std::fs::read(folder.path().join("log.mcap")).unwrap()), "{renumbered}");
        let topics = mcap::Summary::read(&bytes).unwrap().unwrap().channels;
        assert_eq!(topics.values().filter(|channel| !channel.topic.starts_with("/teachtree/")).count(), 3);
    }
}

#[test]
fn other_logs_are_not_copied() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("log.bag"), b"#ROSBAG V2.0\n").unwrap();
    std::fs::create_dir(path("two")).unwrap();
    let metadata =
        "rosbag2_bagfile_information:\n  storage_identifier: mcap\n  relative_file_paths: [a.mcap, b.mcap]\n";
    std::fs::write(path("two/metadata.yaml"), metadata).unwrap();
    bag(folder.path(), BagLayout::Loose);
    std::fs::copy(demos().join(LOG), path("log.csv")).unwrap();
    let before = std::fs::read_dir(folder.path()).unwrap().count();
    for (log, message) in [
        ("log.bag", "is a bag of ROS 1, expected an MCAP file"),
        ("log.csv", "is another kind of log, expected an MCAP file"),
        ("two", "a.mcap"),
        ("gone.mcap", "gone.mcap"),
    ] {
        let output = label(folder.path(), log, &[]);
        assert!(output.status.code() == Some(2) && complained(&output).contains(message), "{}", all_said(&output));
    }
    // Over its own log, and with stamps that are none of its messages'.
    let args = ["analyze", "log.mcap", "--binding", "log.binding.yaml", "--mcap", "log.mcap", "--into"];
    let output = teachtree_in(folder.path(), &args);
    assert!(complained(&output).contains("is an input of this command"), "{}", all_said(&output));
    let binding = std::fs::read_to_string(path("log.binding.yaml")).unwrap();
    std::fs::write(path("log.binding.yaml"), format!("time: /log.t [s]\n{binding}")).unwrap();
    let output = label(folder.path(), "log.mcap", &[]);
    assert!(output.status.code() == Some(2), "{}", all_said(&output));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), before, "nothing is written");
}

#[test]
fn a_trace_has_the_segments_below_their_tasks() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("trace.json");
    let args = ["analyze", LOG, "--binding", BINDING, "--format", "json", "--trace", out.to_str().unwrap()];
    let output = teachtree_in(&demos(), &[&args[..], &["--signals", "near,squeeze"]].concat());
    assert!(output.status.success(), "{}", all_said(&output));
    let document: Value = serde_json::from_str(&said(&output)).unwrap();
    let trace: Value = serde_json::from_str(&std::fs::read_to_string(&out).unwrap()).unwrap();
    let events = trace["traceEvents"].as_array().unwrap();
    let microseconds = |value: &Value| (value.as_f64().unwrap() * 1e6).round() as i64;
    let track = &document["tracks"][0];
    for (list, kind, name) in [("relabeled", "primitive", "primitive"), ("tasks", "task", "task")] {
        let expected: Vec<(i64, i64, &str)> = track[list]
            .as_array()
            .unwrap()
            .iter()
            .map(|span| (microseconds(&span["start_s"]), microseconds(&span["end_s"]), span[name].as_str().unwrap()))
            .collect();
        let found: Vec<(i64, i64, &str)> = events
            .iter()
            .filter(|event| event["cat"] == kind)
            .map(|event| {
                let (start, length) = (event["ts"].as_i64().unwrap(), event["dur"].as_i64().unwrap());
                (start, start + length, event["name"].as_str().unwrap())
            })
            .collect();
        assert_eq!(found, expected, "{list}");
    }
    // Readers stack events of a thread: each is within the one that is open, or behind it.
    let mut open: Vec<i64> = Vec::new();
    let mut deepest = 0;
    for event in events.iter().filter(|event| event["ph"] == "X") {
        let (start, length) = (event["ts"].as_i64().unwrap(), event["dur"].as_i64().unwrap());
        open.retain(|end| *end > start);
        assert!(open.iter().all(|end| *end >= start + length), "{event}");
        open.push(start + length);
        deepest = deepest.max(open.len());
    }
    assert_eq!(deepest, 2);
    let counters: BTreeSet<&str> =
        events.iter().filter(|event| event["ph"] == "C").map(|event| event["name"].as_str().unwrap()).collect();
    assert!(counters.contains("right.near") && counters.contains("right.squeeze"), "{counters:?}");
    assert!(events.iter().any(|event| event["name"] == "thread_name" && event["args"]["name"] == "right"));
    let several = teachtree_in(&demos(), &["analyze", LOG, "lift_demo_1.csv", "--trace", out.to_str().unwrap()]);
    assert!(complained(&several).contains("a trace is written for one recording"), "{}", all_said(&several));
}
