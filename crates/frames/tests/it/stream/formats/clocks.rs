//! Stamps: the clocks of topics, and the forms in which programs write dates and times of day.

use super::messages::{WRENCH, wrench};
use super::{bound, bound_text, folder, stamps, values};
use crate::shared::bags;
use teachtree_frames::{OpenRequest, open};
use teachtree_logs::read::date_time;

const PALM: &str =
    "resample: 100 Hz\nchannels: {right.palm.force: /wrench.force.<xyz>, right.gripper.opening: \"/grip.width [m]\"}\n";

/// Topics of 200 messages at 100 Hz: a wrench, whose stamps differ from the clock of the recorder by some seconds, and a gripper in JSON.
fn bag(path: &std::path::Path, wrench_ahead_s: f64, grip: &dyn Fn(usize) -> String) {
    let at = |row: usize| 1_795_288_020.0 + row as f64 * 0.01;
    let wrenches =
        (0..200).map(|row| (at(row), wrench(at(row) + wrench_ahead_s, [row as f64, 0.0, 1.0], true))).collect();
    let grips = (0..200).map(|row| (at(row), grip(row).into_bytes())).collect();
    let topics =
        [("/wrench", "cdr", "geometry_msgs/msg/WrenchStamped", WRENCH, wrenches), ("/grip", "json", "", "", grips)];
    bags::write(path, None, &topics);
}

#[test]
fn topics_with_stamps_of_different_clocks_are_reported_with_the_offset() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let told = |ahead_s: f64, binding: &str| {
        bag(&path, ahead_s, &|row| format!("{{\"width\": {}}}", 0.05 + row as f64 * 1e-4));
        let (_, issues) = bound(&path, binding).unwrap();
        let of_clocks: Vec<String> = issues
            .into_iter()
            .filter(|issue| issue.kind == "different_clocks")
            .map(|issue| format!("{}: {}", issue.channel, issue.message))
            .collect();
        of_clocks.join("\n")
    };
    insta::assert_snapshot!(told(0.4, PALM), @"/wrench: messages are recorded 0.4 s before their stamps, those of `/grip` 0 s after their stamps: the clocks differ; if the clocks differ, `time_offset: -0.4 s` in `sensors` of the binding corrects the channels of this topic");
    insta::assert_snapshot!(told(-1.0, PALM), @"/wrench: messages are recorded 1 s after their stamps, those of `/grip` 0 s after their stamps: the clocks differ, or the sensor is slow; if the clocks differ, `time_offset: 1 s` in `sensors` of the binding corrects the channels of this topic");
    // A network or a driver delays messages by as much.
    assert_eq!(told(-0.3, PALM), "");
    assert_eq!(told(0.05, PALM), "");
    // The binding corrects it.
    let corrected = PALM.replace("channels", "sensors: {right.palm.force: {time_offset: -0.4 s}}\nchannels");
    assert_eq!(told(0.4, &corrected), "");
}

#[test]
fn topics_that_are_stamped_together_are_resampled() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    // Half of the steps are 20 us.
    bag(&path, 2e-5, &|row| format!("{{\"width\": {}}}", 0.05 + row as f64 * 1e-4));
    let (recording, _) = bound(&path, PALM).unwrap();
    assert!((198..=200).contains(&recording.time.len()), "{} rows", recording.time.len());
}

#[test]
fn stamps_in_messages_of_json_have_any_common_form() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let stamps: [(&str, &dyn Fn(u64) -> String); 7] = [
        ("numbers of s", &|ms| format!("\"timestamp\": {}", ms as f64 / 1000.0)),
        ("numbers of ms", &|ms| format!("\"timestamp\": {ms}")),
        ("numbers of us", &|ms| format!("\"stamp\": {}", ms * 1000)),
        ("numbers of ns", &|ms| format!("\"timestamp\": {}", ms * 1_000_000)),
        ("ISO 8601", &|ms| {
            format!("\"timestamp\": \"2026-11-21T19:07:{:06.3}Z\"", (ms - 1_795_288_020_000) as f64 / 1000.0)
        }),
        ("ROS 1", &|ms| {
            format!("\"header\": {{\"stamp\": {{\"secs\": {}, \"nsecs\": {}}}}}", ms / 1000, ms % 1000 * 1_000_000)
        }),
        ("protobuf", &|ms| {
            format!("\"timestamp\": {{\"seconds\": {}, \"nanos\": {}}}", ms / 1000, ms % 1000 * 1_000_000)
        }),
    ];
    for (form, stamp) in stamps {
        // The recorder gets the messages in pairs, the later one first.
        let message = |row: usize| {
            let row = row ^ 1;
            format!("{{\"width\": {}, {}}}", row as f64 * 1e-3, stamp(1_795_288_020_000 + 10 * row as u64))
        };
        bag(&path, 0.0, &message);
        let (log, _) = bound(&path, "channels: {right.gripper.opening: '/grip.width [m]'}\n").unwrap();
        let widths = values(&log, "right.gripper.opening");
        for (row, width) in (0..).zip(widths) {
            assert!((width - f64::from(row) * 1e-3).abs() < 1e-6, "{form}: {width} in row {row}");
        }
    }
}

/// The clock of a simulation begins at zero, which is not a stamp that was not set.
#[test]
fn clocks_of_simulations_may_begin_at_zero() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let recorded = |row: usize| 1_795_288_020.0 + row as f64 * 0.01;
    let wrenches = |first_s: f64| -> Vec<(f64, Vec<u8>)> {
        let stamp = |row: usize| if row == 0 { 0.0 } else { first_s + row as f64 * 0.01 };
        (0..100).map(|row| (recorded(row), wrench(stamp(row), [row as f64, 0.0, 1.0], true))).collect()
    };
    for first_s in [0.0, recorded(0)] {
        let topic = ("/wrench", "cdr", "geometry_msgs/msg/WrenchStamped", WRENCH, wrenches(first_s));
        bags::write(&path, None, &[topic]);
        let (log, issues) = bound(&path, "channels: {right.palm.force: /wrench.force.<xyz>}\n").unwrap();
        assert!(issues.iter().all(|issue| issue.kind == "stuck_sensor"), "{issues:?}");
        assert_eq!((log.time.len(), (log.time[99] * 1e6).round() as i64), (100, 990_000));
    }
}

#[test]
fn dates_and_times_of_day_have_the_forms_of_common_programs() {
    // Three stamps a second apart, over noon.
    let forms: [(&str, [&str; 3]); 17] = [
        ("ISO 8601", ["2026-11-21T11:59:59.5Z", "2026-11-21T12:00:00.5Z", "2026-11-21T12:00:01.5Z"]),
        ("ISO 8601, basic", ["20261121T115959.5Z", "20261121T120000.5Z", "20261121T120001.5Z"]),
        ("zones", ["2026-11-21 11:59:59.5+00:00", "2026-11-21 13:00:00.5+0100", "2026-11-21 07:00:01.5-05"]),
        ("Python's logging", ["2026-11-21 11:59:59,500", "2026-11-21 12:00:00,500", "2026-11-21 12:00:01,500"]),
        ("12 hours", ["11/21/2026 11:59:59.5 AM", "11/21/2026 12:00:00.5 PM", "11/21/2026 12:00:01.5 PM"]),
        ("12 hours, short", ["11:59:59.5 am", "12:00:00.5pm", "12:00:01.5 p.m."]),
        ("German", ["21.11.2026 11:59:59,5", "21.11.2026 12:00:00,5", "21.11.2026 12:00:01,5"]),
        ("American", ["11/21/2026 11:59:59.5", "11/21/2026 12:00:00.5", "11/21/2026 12:00:01.5"]),
        ("British", ["21/11/2026 11:59:59.5", "21/11/2026 12:00:00.5", "21/11/2026 12:00:01.5"]),
        ("MATLAB", ["21-Nov-2026 11:59:59.5", "21-Nov-2026 12:00:00.5", "21-Nov-2026 12:00:01.5"]),
        ("words", ["21 Nov 2026 11:59:59.5", "21 November 2026 12:00:00.5", "21 nov 2026 12:00:01.5"]),
        ("underscores", ["2026-11-21_11:59:59.5", "2026-11-21_12:00:00.5", "2026-11-21_12:00:01.5"]),
        ("UTC", ["2026-11-21 11:59:59.5 UTC", "2026-11-21 12:00:00.5 UTC", "2026-11-21 12:00:01.5 UTC"]),
        ("times of day", ["11:59:59.5", "12:00:00.5", "12:00:01.5"]),
        ("durations of pandas", ["0 days 11:59:59.5", "0 days 12:00:00.5", "0 days 12:00:01.5"]),
        ("durations of Python", ["23:59:59.5", "1 day, 0:00:00.5", "1 day, 0:00:01.5"]),
        ("minutes", ["59:59.5", "60:00.5", "60:01.5"]),
    ];
    for (form, stamps) in forms {
        let rows: String = stamps.iter().map(|stamp| format!("{stamp}\t1\n")).collect();
        let read =
            bound_text("log.tsv", &format!("when\ta\n{rows}"), "time: when\nchannels: {right.gripper.opening: a}\n");
        // A second a row is too slow for a hand, which is found out after the stamps were read.
        let (log, _) = read.unwrap_or_else(|error| panic!("{form}: {error}"));
        let steps: Vec<f64> = log.time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert_eq!(steps, [1.0, 1.0], "{form}");
    }
    let at = |stamp: &str| {
        let folder = folder(&[("log.csv", &format!("when;a\n{stamp};1\n"))]);
        stamps(&folder.path().join("log.csv"), "time: when\nchannels: {right.gripper.opening: a}\n")
    };
    assert_eq!(at("21.11.2026 07:07:00,25 PM").unwrap(), [1_795_288_020.25]);
    // The third of April or the fourth of March, and hours that are none.
    insta::assert_snapshot!(at("03/04/2026 10:00:00").unwrap_err(), @r"
    log.csv row 2 column when: found `03/04/2026 10:00:00`, expected a time
      help: write dates as `2026-11-21 19:07:00.25`, times of day as `19:07:00.25` or `07:07:00.25 PM`, minutes as `07:00.25`
    ");
    assert!(at("13:00:00 PM").is_err() && at("00:30:00 AM").is_err());
}

#[test]
fn a_clock_that_begins_again_is_refused_with_the_cause() {
    let refused = |stamps: [&str; 3]| {
        let rows: String = stamps.iter().map(|stamp| format!("{stamp},1\n")).collect();
        bound_text("log.csv", &format!("t [us],a\n{rows}"), "time: t\nchannels: {right.gripper.opening: a}\n")
            .unwrap_err()
    };
    insta::assert_snapshot!([
        refused(["23:59:59.98", "23:59:59.99", "00:00:00.00"]),
        refused(["12:59:59.98", "12:59:59.99", "01:00:00.00"]),
        refused(["59:59.98", "59:59.99", "00:00.00"]),
        refused(["4294957295", "4294967295", "9999"]),
    ].join("\n"), @r"
    log.csv row 4 column t: time runs backwards: 0 s after 86399.99 s; the clock passes midnight: write the date into the stamps
    log.csv row 4 column t: time runs backwards: 3600 s after 46799.99 s; the clock has 12 hours: write AM or PM, or the date, into the stamps
    log.csv row 4 column t: time runs backwards: 0 s after 3599.99 s; the minutes begin again at a full hour: write the hour into the stamps
    log.csv row 4 column t: time runs backwards: 0.009999 s after 4294.9672949999995 s; a counter of us with 32 bits begins again: add 4294967296 to the stamps from this row on
    ");
    assert!(!refused(["10", "20", "10"]).contains(';'));
}

/// As `rosbag` and its successors convert messages to tables.
#[test]
fn seconds_and_nanoseconds_in_two_columns_are_one_stamp() {
    let names = [("stamp.sec", "stamp.nanosec"), ("stamp.secs", "stamp.nsecs"), ("stamp_sec", "stamp_nsec")];
    for ((seconds, rest), bound_as) in names.into_iter().flat_map(|pair| [(pair, "stamp"), (pair, pair.0)]) {
        let text = format!("{seconds},{rest},a\n1795288020,990000000,1\n1795288021,0,2\n1795288021,10000000,3\n");
        let binding = format!("time: {bound_as}\nchannels: {{right.gripper.opening: a}}\n");
        let folder = folder(&[("log.csv", text.as_str())]);
        let found = stamps(&folder.path().join("log.csv"), &binding).unwrap();
        let after: Vec<i64> = found.iter().map(|stamp| ((stamp - 1_795_288_020.0) * 1e3).round() as i64).collect();
        assert_eq!(after, [990, 1000, 1010], "{bound_as}");
        let object =
            |row: i64| format!("{{\"{seconds}\": {}, \"{rest}\": {}, \"a\": 1}}\n", 9 + row / 2, row % 2 * 500_000_000);
        let (log, _) = bound_text("log.jsonl", &(0..4).map(object).collect::<String>(), &binding).unwrap();
        assert_eq!(log.time, [9.0, 9.5, 10.0, 10.5], "{bound_as}");
    }
}

#[test]
fn times_count_from_the_first_stamp_if_stamps_count_from_1970() {
    let rows = |from: f64| -> String {
        let row = |row: usize| format!("{:.2},{row}\n", from + row as f64 * 0.02);
        format!("t,a\n{}", (0..60).filter(|at| *at != 7).map(row).collect::<String>())
    };
    let binding = "channels: {right.gripper.opening: a}\ntime: t\n";
    let at = |from: f64, more: &str| {
        let folder =
            folder(&[("log.csv", &rows(from)), ("b.yaml", &format!("{binding}{more}scene: {{bodies: {{}}}}\n"))]);
        let path = |name: &str| folder.path().join(name);
        open(&OpenRequest { log: path("log.csv"), binding: Some(path("b.yaml")), ..OpenRequest::default() }).unwrap()
    };
    let [since_1970, since_boot] = [1.7e9, 5000.0].map(|from| at(from, ""));
    assert_eq!((since_1970.recording.time[0], since_1970.zero_stamp_s), (0.0, 1.7e9));
    assert!((since_1970.recording.time[59] - 1.18).abs() < 1e-6, "{:?}", since_1970.recording.time);
    assert_eq!(since_1970.row_time[0], 0.0);
    assert!(since_1970.issues.iter().all(|issue| issue.end_s < 2.0), "{:?}", since_1970.issues);
    assert_eq!((since_boot.recording.time[0], since_boot.zero_stamp_s), (5000.0, 0.0));
    // The offset of a binding is part of the stamps.
    let shifted = at(1.7e9, "time_offset: 2 s\n");
    assert_eq!((shifted.recording.time[0], shifted.zero_stamp_s), (0.0, 1.7e9));
    assert_eq!(date_time::written(1_795_288_020.25), "2026-11-21 19:07:00");
}

#[test]
fn dates_are_written_as_they_are_read() {
    for day in (-719_000..2_900_000).step_by(997) {
        let stamp_s = f64::from(day) * 86_400.0 + 45_296.0;
        let text = date_time::written(stamp_s);
        assert_eq!(date_time::date_time(&text), Some(stamp_s), "{text}");
    }
}
