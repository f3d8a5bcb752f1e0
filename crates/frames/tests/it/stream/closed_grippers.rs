//! A gripper whose log has only the opening: the limit of closed is learned.

use crate::shared::files::folder;
use std::fmt::Write as _;
use teachtree_frames::streaming::StreamedLog;
use teachtree_frames::{OpenRequest, OpenedLog, open};

const SCENE: &str = "bodies: {cube: {role: object, radius: 20 mm}}\n";

/// A log with these columns besides `time` and the opening, mm, at each row.
fn opened(more: &str, opening_mm: impl Fn(usize) -> f64) -> (OpenedLog, bool) {
    let names: String = more.split_whitespace().map(|name| format!(",{name}")).collect();
    let zeros = ",0".repeat(more.split_whitespace().count());
    let mut log = format!("time,right.gripper.opening [mm]{names}\n");
    for row in 0..200 {
        let _ = writeln!(log, "{:.2},{}{zeros}", row as f64 * 0.01, opening_mm(row));
    }
    let folder = folder(&[("log.csv", log.as_str()), ("log.scene.yaml", SCENE)]);
    let request = OpenRequest { log: folder.path().join("log.csv"), ..OpenRequest::default() };
    (open(&request).unwrap(), StreamedLog::open(&request).is_some())
}

/// Open at 80 mm, around things of 25 mm and 40 mm for 0.5 s each.
fn sorts(row: usize) -> f64 {
    match row {
        50..100 => 25.0,
        130..180 => 40.0,
        _ => 80.0,
    }
}

fn issues(opened: &OpenedLog) -> Vec<String> {
    opened.issues.iter().map(|issue| format!("{} {}: {}", issue.kind, issue.channel, issue.message)).collect()
}

#[test]
fn the_limit_is_in_the_middle_between_two_groups() {
    let (opened, is_streamed) = opened("", sorts);
    let closed = &opened.recording.columns["right.gripper.closed"].values;
    let expected: Vec<f64> = (0..200).map(|row| f64::from(u8::from(sorts(row) < 50.0))).collect();
    assert_eq!(*closed, expected);
    let [issue] = &issues(&opened)[..] else { panic!("{:?}", opened.issues) };
    assert!(
        issue.starts_with("learned_closing right.gripper.opening: the gripper counts as closed below 56."),
        "{issue}"
    );
    assert!(issue.contains("usual openings of 32.5 mm and 80.0 mm"), "{issue}");
    assert_eq!(opened.hand_model().to_string(), "hand_gripper.rules, since the log has right.gripper.opening");
    // The groups are those of the whole log.
    assert!(!is_streamed);
}

#[test]
fn a_gripper_that_does_not_move_counts_as_open() {
    for opening in [|_: usize| 80.0, |row: usize| row as f64 * 0.4] {
        let (opened, _) = opened("", opening);
        assert!(opened.recording.columns["right.gripper.closed"].values.iter().all(|flag| *flag == 0.0));
        let [issue] = &issues(&opened)[..] else { panic!("{:?}", opened.issues) };
        assert!(
            issue.contains("do not fall into two groups") && issue.contains("bind `right.gripper.closed`"),
            "{issue}"
        );
        assert_eq!(opened.hand_model().file, "hand_gripper.rules");
    }
}

#[test]
fn what_shows_more_than_an_opening_is_left_as_it_is() {
    let force = "right.thumb.force.x right.thumb.force.y right.thumb.force.z";
    for more in ["right.gripper.closed", "right.thumb.contact", "right.index.contact.cube", force] {
        let (opened, is_streamed) = opened(more, sorts);
        assert_eq!(
            opened.recording.columns.contains_key("right.gripper.closed"),
            more == "right.gripper.closed",
            "{more}"
        );
        assert_eq!(issues(&opened), [""; 0], "{more}");
        assert!(is_streamed, "{more}");
    }
    // The palm and the other hand show nothing of the grasp.
    for more in ["left.thumb.contact", "right.palm.contact"] {
        assert!(opened(more, sorts).0.recording.columns.contains_key("right.gripper.closed"), "{more}");
    }
}
