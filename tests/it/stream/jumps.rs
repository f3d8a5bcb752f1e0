//! One bad sample changes nothing that is found in a log.

use crate::program::{complained, said, teachtree_in};
use crate::shared::samples::{Change, add, jumps, set, slower, taught};
use std::path::Path;
use teachtree_base::recording::Recording;
use teachtree_frames::OpenRequest;
use teachtree_frames::open;
use teachtree_logs::read::formats;
use teachtree_world::{shipped, teach};

fn scale(log: &mut Recording, column: &str, row: usize, factor: f64) {
    log.columns[column].values[row] *= factor;
}

/// The segments that are found, without the name of the log.
fn segments(folder: &Path, log: &str, more: &[&str]) -> Vec<String> {
    let output = teachtree_in(folder, &[&["analyze", log, "--format", "csv"], more].concat());
    assert!(output.status.success(), "{}", complained(&output));
    said(&output).lines().map(|line| line.split_once(',').unwrap().1.to_string()).collect()
}

#[test]
fn a_bad_sample_is_reported_and_changes_no_segment() {
    let folder = tempfile::tempdir().unwrap();
    let plain = taught();
    formats::write(&plain, &folder.path().join("plain.csv")).unwrap();
    let wanted = segments(folder.path(), "plain.csv", &[]);
    assert!(wanted.len() > 5, "{wanted:?}");
    // 1900 is in the middle of Translate.
    let changes: [(&str, usize, Change); 10] = [
        ("box.velocity", 1, &|log| scale(log, "box.velocity.y", 1900, 1e6)),
        ("box.velocity", 1, &|log| set(log, "box.velocity.y", 1900, 0.6)),
        ("box.angular_velocity", 1, &|log| set(log, "box.angular_velocity.z", 1900, 30.0)),
        ("contact.box.base.force", 1, &|log| scale(log, "contact.box.base.force.z", 100, 1e4)),
        ("right.thumb.position", 1, &|log| set(log, "right.thumb.position.x", 1900, 0.3)),
        ("right.thumb.position", 2, &|log| {
            [1900, 1901].iter().for_each(|row| set(log, "right.thumb.position.x", *row, 2.0))
        }),
        ("box.position", 1, &|log| set(log, "box.position.z", 1900, 2.0)),
        ("right.thumb.force", 1, &|log| set(log, "right.thumb.force.y", 400, 900.0)),
        ("right.index.force", 3, &|log| {
            [400, 900, 1900].iter().for_each(|row| add(log, "right.index.force.x", *row, -300.0))
        }),
        ("box.rotation", 1, &|log| {
            ["w", "x", "y", "z"].iter().for_each(|part| set(log, &format!("box.rotation.{part}"), 1900, 0.5));
        }),
    ];
    for (channel, count, change) in changes {
        let mut recording = plain.clone();
        change(&mut recording);
        let printed = jumps(folder.path(), &recording);
        let [issue] = printed.as_slice() else { panic!("{channel}: {printed:?}") };
        assert_eq!(issue.channel, channel);
        assert!(issue.message.starts_with(&format!("{count} sample")), "{}", issue.message);
        assert_eq!(segments(folder.path(), "log.csv", &[]), wanted, "{channel}: {}", issue.message);
    }
}

/// A decimal point that is lost in one cell had made a `turn_screw` of this task.
#[test]
fn a_lost_decimal_point_in_a_velocity_is_reported_and_changes_no_task() {
    let folder = tempfile::tempdir().unwrap();
    let plain = teach(&shipped::scene("peg_in_hole").unwrap(), &shipped::operator("peg_in_hole").unwrap(), 1).unwrap();
    formats::write(&plain, &folder.path().join("plain.csv")).unwrap();
    let wanted = segments(folder.path(), "plain.csv", &[]);
    for column in ["peg.velocity.x", "peg.angular_velocity.x", "peg.velocity.z"] {
        let mut log = plain.clone();
        let row = 4144;
        let digits = (log.columns[column].values[row] * 1e6).round();
        set(&mut log, column, row, digits);
        let printed = jumps(folder.path(), &log);
        assert_eq!(printed.len(), 1, "{column} became {digits}: {printed:?}");
        assert_eq!(segments(folder.path(), "log.csv", &[]), wanted, "{column} became {digits}");
        // What is read in windows is reported as what is in memory.
        let json = ["analyze", "log.csv", "--format", "json"];
        let in_memory = teachtree_in(folder.path(), &[&json[..], &["--report", "report.html"]].concat());
        assert_eq!(said(&teachtree_in(folder.path(), &json)), said(&in_memory), "{column}");
    }
}

/// At 20 Hz anything may turn right round between two samples, so that no jump shows a lost decimal point: the length of the quaternion does. It had made a
/// `turn_screw` of this recording.
#[test]
fn a_quaternion_of_another_length_is_reported_and_changes_no_task() {
    let folder = tempfile::tempdir().unwrap();
    let demos = Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite");
    let binding = demos.join("panda_lift.binding.yaml");
    let bound = ["--binding", binding.to_str().unwrap()];
    let log = std::fs::read_to_string(demos.join("lift_demo_1.csv")).unwrap();
    std::fs::write(folder.path().join("plain.csv"), &log).unwrap();
    let wanted = segments(folder.path(), "plain.csv", &bound);
    let mut rows: Vec<Vec<&str>> = log.lines().map(|line| line.split(',').collect()).collect();
    let column = rows[0].iter().position(|title| *title == "cube_qw").unwrap();
    let cell = rows[188][column].replace('.', "");
    rows[188][column] = &cell;
    let lines: Vec<String> = rows.iter().map(|row| row.join(",")).collect();
    std::fs::write(folder.path().join("damaged.csv"), lines.join("\n")).unwrap();
    assert_eq!(segments(folder.path(), "damaged.csv", &bound), wanted);
    let json = ["analyze", "damaged.csv", "--format", "json"];
    let printed = said(&teachtree_in(folder.path(), &[&json[..], &bound].concat()));
    assert!(printed.contains("1 sample is not a rotation: it is 852731 long"), "{printed}");
}

/// A binding reads the same log in other units, turned angles and at another rate.
#[test]
fn a_bad_sample_is_taken_out_before_a_log_is_resampled() {
    let folder = tempfile::tempdir().unwrap();
    let mut log = taught();
    slower(&mut log, 5);
    let binding = folder.path().join("binding.yaml");
    std::fs::write(&binding, "resample: 500 Hz\n").unwrap();
    formats::write(&log, &folder.path().join("plain.csv")).unwrap();
    let wanted = segments(folder.path(), "plain.csv", &["--binding", "binding.yaml"]);
    for row in [100, 380] {
        add(&mut log, "right.thumb.position.x", row, 0.3);
    }
    formats::write(&log, &folder.path().join("log.csv")).unwrap();
    let request = OpenRequest { log: folder.path().join("log.csv"), binding: Some(binding), ..OpenRequest::default() };
    let opened = open(&request).unwrap();
    assert_eq!(opened.issues.iter().filter(|issue| issue.kind == "impossible_jump").count(), 1, "{:?}", opened.issues);
    assert_eq!(segments(folder.path(), "log.csv", &["--binding", "binding.yaml"]), wanted);
}

/// A device that does not see yet tells zeros, and one that goes off tells anything.
#[test]
fn what_begins_or_ends_a_log_and_cannot_be_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let plain = taught();
    formats::write(&plain, &folder.path().join("plain.csv")).unwrap();
    // Unmeasured frames are not part of a segment: the first begins a little later, the last ends a little sooner.
    let names = |log: &str| {
        let name = |line: &String| line.split(',').take(3).map(String::from).collect::<Vec<_>>();
        segments(folder.path(), log, &[]).iter().map(name).collect::<Vec<_>>()
    };
    let wanted = names("plain.csv");
    let rows = plain.time.len();
    for (from, count) in [(0, 1), (0, 2), (rows - 1, 1), (rows - 2, 2)] {
        let mut log = plain.clone();
        for at in from..from + count {
            ["x", "y", "z"].iter().for_each(|part| {
                set(&mut log, &format!("right.thumb.position.{part}"), at, 0.0);
                set(&mut log, &format!("box.position.{part}"), at, -0.5);
            });
            add(&mut log, "right.thumb.force.y", at, 300.0);
        }
        let printed = jumps(folder.path(), &log);
        assert_eq!(printed.len(), 3, "row {from}: {printed:?}");
        for issue in printed {
            assert_eq!([issue.start_s, issue.end_s], [plain.time[from], plain.time[from + count - 1]]);
        }
        assert_eq!(names("log.csv"), wanted, "row {from}");
    }
    let mut log = plain.clone();
    (0..3).for_each(|at| add(&mut log, "right.thumb.position.x", at, 0.3));
    assert_eq!(jumps(folder.path(), &log), [], "three samples are not a spike");
}

/// The shipped capture with one wrong cell in one marker of a body: the labels equal those of the unchanged file.
#[test]
fn one_wrong_cell_of_a_marker_changes_no_segment() {
    let folder = tempfile::tempdir().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("demos");
    let binding = root.join("bindings/dfki_hand.binding.yaml").display().to_string();
    let text = std::fs::read_to_string(root.join("dfki_hand/recording_excerpt.tsv")).unwrap();
    std::fs::write(folder.path().join("log.tsv"), &text).unwrap();
    let wanted = segments(folder.path(), "log.tsv", &["--binding", &binding]);
    // The frame, the column and the error in millimeters. The second error alone used to create a task.
    for (frame, column, by) in [(300, 17, 140.0), (682, 25, -78.653), (900, 20, 2000.0)] {
        let line = |line: &str| {
            let mut cells: Vec<String> = line.split('\t').map(str::to_string).collect();
            if cells[0] == frame.to_string() {
                cells[column] = (cells[column].parse::<f64>().unwrap() + by).to_string();
            }
            cells.join("\t")
        };
        std::fs::write(folder.path().join("log.tsv"), text.lines().map(line).collect::<Vec<_>>().join("\n")).unwrap();
        assert_eq!(segments(folder.path(), "log.tsv", &["--binding", &binding]), wanted, "frame {frame}");
    }
}
