//! One bad sample does not ruin a log: what is out and back at once is taken as not measured, and nothing else is.

use crate::program::{complained, said, teachtree_in};
use std::path::Path;
use teachtree_base::recording::Recording;
use teachtree_frames::OpenRequest;
use teachtree_frames::open;
use teachtree_logs::issue::Issue;
use teachtree_logs::read::formats;
use teachtree_world::{shipped, teach};

type Change<'a> = &'a dyn Fn(&mut Recording);

fn taught() -> Recording {
    teach(&shipped::scene("pick_and_place").unwrap(), &shipped::operator("pick_and_place").unwrap(), 1).unwrap()
}

fn set(log: &mut Recording, column: &str, row: usize, value: f64) {
    log.columns[column].values[row] = value;
}

fn add(log: &mut Recording, column: &str, row: usize, value: f64) {
    log.columns[column].values[row] += value;
}

fn scale(log: &mut Recording, column: &str, row: usize, factor: f64) {
    log.columns[column].values[row] *= factor;
}

/// Every so many rows of a recording.
fn slower(log: &mut Recording, every: usize) {
    log.time = log.time.iter().copied().step_by(every).collect();
    log.columns.values_mut().for_each(|column| column.values = column.values.iter().copied().step_by(every).collect());
    log.labels.values_mut().for_each(|texts| *texts = texts.iter().cloned().step_by(every).collect());
}

/// What is reported of the jumps of a log that is written and opened.
fn jumps(folder: &Path, recording: &Recording) -> Vec<Issue> {
    let log = folder.join("log.csv");
    formats::write(recording, &log).unwrap();
    let opened = open(&OpenRequest { log, ..OpenRequest::default() }).unwrap();
    opened.issues.into_iter().filter(|issue| issue.kind == "impossible_jump").collect()
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
    assert!(printed.contains("1 sample is no rotation: it is 852731 long"), "{printed}");
}

/// A velocity that its pose bears out was measured, and so was one that changes for good.
#[test]
fn a_velocity_that_the_pose_bears_out_is_no_jump() {
    let folder = tempfile::tempdir().unwrap();
    let mut log = taught();
    // 0.6 mm within a millisecond, and back in the next.
    add(&mut log, "box.position.y", 1900, 0.0006);
    set(&mut log, "box.velocity.y", 1900, 0.6);
    assert_eq!(jumps(folder.path(), &log), []);
    let mut log = taught();
    log.columns["box.velocity.y"].values[1900..].iter_mut().for_each(|value| *value += 0.6);
    assert_eq!(jumps(folder.path(), &log), []);
}

#[test]
fn what_is_said_names_value_and_time() {
    let folder = tempfile::tempdir().unwrap();
    let mut log = taught();
    set(&mut log, "box.position.z", 1900, 2.0);
    add(&mut log, "right.thumb.force.x", 700, 250.0);
    add(&mut log, "right.thumb.force.x", 900, 150.0);
    let printed: Vec<String> = jumps(folder.path(), &log)
        .iter()
        .map(|it| format!("{} {}–{} s: {}", it.channel, it.start_s, it.end_s, it.message))
        .collect();
    insta::assert_snapshot!(printed.join("\n"));
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

#[test]
fn what_may_be_is_no_jump() {
    let folder = tempfile::tempdir().unwrap();
    let plain = taught();
    let blow = |log: &mut Recording| {
        let blow = [60.0, 200.0, 400.0, 300.0, 100.0];
        blow.iter().zip(700..).for_each(|(force, row)| add(log, "right.thumb.force.z", row, *force));
    };
    let changes: [(&str, Change); 10] = [
        ("nothing", &|_| {}),
        ("a place that stays for three samples", &|log| {
            (1900..1903).for_each(|row| set(log, "right.thumb.position.x", row, 0.3));
        }),
        ("a place that stays", &|log| {
            log.columns["box.position.z"].values[1900..].iter_mut().for_each(|value| *value += 0.3);
        }),
        ("a blow", &blow),
        ("a blow of which two samples are left", &|log| {
            blow(log);
            slower(log, 2);
        }),
        ("a blow of which one sample is left", &|log| {
            blow(log);
            log.columns.values_mut().for_each(|column| column.values.rotate_left(2));
            slower(log, 10);
        }),
        ("something that the scene does not have", &|log| {
            for part in ["x", "y", "z"] {
                let mut column = log.columns[&format!("box.position.{part}")].clone();
                column.values[1900] += 1.0;
                log.columns.insert(format!("lamp.position.{part}"), column);
            }
        }),
        ("centimetres", &|log| {
            log.columns["right.thumb.position.x"]
                .values
                .iter_mut()
                .for_each(|value| *value = (*value * 1e2).round() / 1e2);
        }),
        ("a slow log", &|log| {
            slower(log, 50);
            add(log, "right.thumb.position.x", 30, 0.3);
            add(log, "right.thumb.force.x", 30, 300.0);
            ["w", "x", "y", "z"].iter().for_each(|part| set(log, &format!("box.rotation.{part}"), 30, 0.5));
        }),
        ("the other quaternion of the same rotation", &|log| {
            ["w", "x", "y", "z"]
                .iter()
                .for_each(|part| log.columns[&format!("box.rotation.{part}")].values[1900] *= -1.0);
        }),
    ];
    for (what, change) in changes {
        let mut recording = plain.clone();
        change(&mut recording);
        assert_eq!(jumps(folder.path(), &recording), [], "{what}");
    }
}

/// A device that does not see yet tells zeros, and one that goes off tells anything.
#[test]
fn what_begins_or_ends_a_log_and_cannot_be_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let plain = taught();
    formats::write(&plain, &folder.path().join("plain.csv")).unwrap();
    // What is not measured is no part of a segment: the first begins a little later, the last ends a little sooner.
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
    assert_eq!(jumps(folder.path(), &log), [], "three samples are no slip");
}

/// Rows are looked at many together where nothing happens; where a jump lies among them makes no difference.
#[test]
fn a_jump_is_found_wherever_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let plain = taught();
    for row in [1, 2, 1022, 1023, 1024, 1025, 2047, 2048, plain.time.len() - 3] {
        let mut log = plain.clone();
        for at in [row, row + 1] {
            add(&mut log, "right.thumb.position.x", at, 0.3);
            add(&mut log, "right.thumb.force.y", at, 300.0);
            ["w", "x", "y", "z"].iter().for_each(|part| set(&mut log, &format!("box.rotation.{part}"), at, 0.5));
        }
        let printed = jumps(folder.path(), &log);
        assert_eq!(printed.len(), 3, "row {row}: {printed:?}");
        for issue in printed {
            assert_eq!([issue.start_s, issue.end_s], [plain.time[row], plain.time[row + 1]], "{}", issue.message);
        }
    }
}

/// One cell of one column is wrong, in logs at 1 kHz. The computed value moves by less than 20 mm, which a hand motion may reach, or is a flag, so only the
/// column itself shows the spike.
#[test]
fn one_wrong_cell_is_taken_out_before_columns_are_combined() {
    const ROW: usize = 30;
    const ARM: &str = r#"<robot name="arm"><link name="base"/><link name="hand"/><joint name="wrist" type="continuous"><parent link="base"/><child link="hand"/><axis xyz="0 0 1"/></joint></robot>"#;
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("arm.urdf"), ARM).unwrap();
    let scene =
        "scene: {bodies: {cube: {role: object}, ball: {role: object}}, hands: {right: {fingers: [thumb, index]}}}\n";
    let arm = "robots: {arm: {urdf: arm.urdf, joints: {wrist: j}}}\n";
    // Each case has the wrong cells with their errors, the binding, the computed column, the reported channel, and the first of its columns.
    type Case<'a> = (&'a [&'a str], f64, &'a str, &'a str, &'a str, &'a str);
    let cases: [Case; 12] = [
        (&["ax"], 0.03, "cube.position: {mean: [a<xyz>, b<xyz>]}", "cube.position.x", "cube.position", "ax"),
        (&["bz"], -0.05, "cube.position: {mean: [a<xyz>, b<xyz>, c<xyz>]}", "cube.position.z", "cube.position", "bx"),
        (
            &["qw", "qx"],
            1.0,
            "cube.rotation: {mean: [q<wxyz>, r<wxyz>, r<wxyz>, r<wxyz>]}",
            "cube.rotation.w",
            "cube.rotation",
            "qw",
        ),
        (
            &["ax"],
            0.03,
            "right.gripper.opening: {mean: [ax, bx]}",
            "right.gripper.opening",
            "right.gripper.opening",
            "ax",
        ),
        (
            &["cube_z", "ball_z"],
            150.0,
            "right.thumb.force: [ay, by, <object>_z]",
            "right.thumb.force.z",
            "right.thumb.force",
            "ay",
        ),
        (
            &["qw", "qx"],
            1.0,
            "right.palm.position: a<xyz>\n  right.palm.rotation: q<wxyz>\n  right.thumb.position: {at: [0 mm, 0 mm, 8 mm], of: right.palm}",
            "right.thumb.position.z",
            "right.palm.rotation",
            "qw",
        ),
        (
            &["j"],
            2.0,
            "right.thumb.position: {link: arm.hand, at: [8 mm, 0 mm, 0 mm]}",
            "right.thumb.position.x",
            "robots.arm.wrist",
            "j",
        ),
        (
            &["ax"],
            0.03,
            "right.thumb.position: a<xyz>\n  right.index.position: b<xyz>\n  right.gripper.closed: {between: [right.thumb, right.index], below: 20 mm}",
            "right.gripper.closed",
            "right.thumb.position",
            "ax",
        ),
        (
            &["ax"],
            0.03,
            "right.gripper.opening: ax\n  right.gripper.closed: ax [m] < 120 mm",
            "right.gripper.closed",
            "right.gripper.closed",
            "ax",
        ),
        (
            &["ax"],
            0.03,
            "right.gripper.closed: ax [m] < 120 mm\n  right.gripper.opening: {mean: [ax, bx]}",
            "right.gripper.opening",
            "right.gripper.closed",
            "ax",
        ),
        (&["j"], 2.0, "right.gripper.closed: -j [rad] < -1 rad", "right.gripper.closed", "right.gripper.closed", "j"),
        (
            &["cube_z"],
            150.0,
            "right.thumb.contact: <object>_z [N] > 5 N",
            "right.thumb.contact",
            "right.thumb.contact",
            "cube_z",
        ),
    ];
    let titles = "t,ax,ay,az,bx,by,bz,cx,cy,cz,qw,qx,qy,qz,rw,rx,ry,rz,j,cube_z,ball_z";
    let plain = [0.1, 0.2, 0.3, 0.11, 0.2, 0.3, 0.12, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0];
    for (wrong, by, channels, computed, reported, column) in cases {
        let row = |row: usize| {
            let cell = |(title, value): (&str, &f64)| {
                let share = match title {
                    _ if row != ROW || !wrong.contains(&title) => 0.0,
                    "ball_z" => -0.5,
                    "qw" => -1.0,
                    _ => 1.0,
                };
                value + share * by
            };
            let cells = titles.split(',').skip(1).zip(&plain).map(cell).map(|value| value.to_string());
            format!("{},{}\n", row as f64 / 1e3, cells.collect::<Vec<_>>().join(","))
        };
        let [log, binding] = ["log.csv", "b.yaml"].map(|name| folder.path().join(name));
        std::fs::write(&log, format!("{titles}\n{}", (0..60).map(row).collect::<String>())).unwrap();
        let robot = if channels.contains("link") { arm } else { "" };
        std::fs::write(&binding, format!("time: t\n{robot}channels:\n  {channels}\n{scene}")).unwrap();
        let opened = open(&OpenRequest { log, binding: Some(binding), ..OpenRequest::default() }).unwrap();
        let values = &opened.recording.columns[computed].values;
        let measured: Vec<usize> = (0..60).filter(|row| !values[*row].is_nan()).collect();
        assert_eq!(measured, (0..60).filter(|row| *row != ROW).collect::<Vec<_>>(), "{channels}: {:?}", opened.issues);
        let jumps: Vec<&Issue> = opened.issues.iter().filter(|issue| issue.kind == "impossible_jump").collect();
        assert!(!jumps.is_empty() && jumps.iter().all(|issue| issue.channel == reported), "{channels}: {jumps:?}");
        assert!(
            jumps[0].message.starts_with(&format!("`{column}`: 1 sample cannot be")),
            "{channels}: {}",
            jumps[0].message
        );
    }
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
