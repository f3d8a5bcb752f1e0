//! One bad sample does not ruin a log: a spike is treated as not measured, and nothing else is.

use crate::shared::samples::{Change, add, jumps, set, slower, taught};
use teachtree_base::recording::Recording;
use teachtree_frames::OpenRequest;
use teachtree_frames::open;
use teachtree_logs::issue::Issue;

/// A velocity that its pose bears out was measured, and so was one that changes for good.
#[test]
fn a_velocity_that_the_pose_bears_out_is_not_a_jump() {
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

#[test]
fn what_may_be_is_not_a_jump() {
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
        ("a blow that kept two samples", &|log| {
            blow(log);
            slower(log, 2);
        }),
        ("a blow that kept one sample", &|log| {
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

/// Quiet rows are checked in blocks. The place of a spike within a block makes no difference.
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
            jumps[0].message.starts_with(&format!("`{column}`: 1 sample is impossible")),
            "{channels}: {}",
            jumps[0].message
        );
    }
}
