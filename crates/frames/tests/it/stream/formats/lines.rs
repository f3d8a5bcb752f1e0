//! JSON lines.

use super::{bound_text, values};
use teachtree_frames::OpenRequest;
use teachtree_frames::open;

#[test]
fn an_object_a_line_is_a_row() {
    let text = r#"{"time": 0, "right": {"thumb": {"force": [0, 0.5, 1], "contact": true}}, "right.label": "Move"}
{"time": 0.1, "right.thumb.force": [1, 0.5, 2], "right.thumb.contact": false, "right.label": "Grasp"}

{"time": 0.2, "right.thumb.force.x": null, "right.thumb.force.y": 3}
{"time": 0.3, "right.thu"#;
    let (recording, issues) = bound_text("log.jsonl", text, "").unwrap();
    assert_eq!(recording.time, [0.0, 0.1, 0.2]);
    assert_eq!(values(&recording, "right.thumb.force.y"), [0.5, 0.5, 3.0]);
    assert!(values(&recording, "right.thumb.force.x")[2].is_nan());
    assert_eq!(values(&recording, "right.thumb.contact")[..2], [1.0, 0.0]);
    assert_eq!(recording.labels["right.label"], ["Move", "Grasp", ""]);
    assert_eq!(issues[0].kind, "truncated");
}

/// Rows with equal stamps and cells of different sources form one row in every format.
#[test]
fn rows_with_equal_stamps_and_different_cells_form_one_row() {
    let lines = "{\"time\": 0, \"a\": 1}\n{\"time\": 0, \"b\": 2}\n{\"time\": 0.1, \"a\": 3}\n{\"time\": 0.1, \"b\": 4}\n{\"time\": 0.1, \"b\": 5}\n";
    let cells = "time,a,b\n0,1,\n0,,2\n0.1,3,\n0.1,,4\n0.1,,5\n";
    let binding = "channels: {right.gripper.opening: a, right.palm.level: b}\n";
    for (name, text) in [("log.jsonl", lines), ("log.csv", cells)] {
        let (recording, issues) = bound_text(name, text, binding).unwrap();
        assert_eq!(values(&recording, "right.gripper.opening"), [1.0, 3.0], "{name}");
        assert_eq!(values(&recording, "right.palm.level"), [2.0, 4.0], "{name}");
        // A row with a different value for a filled cell is left out.
        assert!(issues.len() == 1 && issues[0].message.starts_with("1 row repeats"), "{name}: {issues:?}");
    }
    // A row with cells that are not bound repeats nothing.
    let lines =
        "{\"time\": 0, \"a\": 1}\n{\"time\": 0, \"c\": 2}\n{\"time\": 0.1, \"c\": 3}\n{\"time\": 0.1, \"a\": 4}\n";
    let cells = "time,a,c\n0,1,\n0,,2\n0.1,,3\n0.1,4,\n";
    for (name, text) in [("log.jsonl", lines), ("log.csv", cells)] {
        let (recording, issues) = bound_text(name, text, "channels: {right.gripper.opening: a}\n").unwrap();
        assert_eq!(values(&recording, "right.gripper.opening"), [1.0, 4.0], "{name}");
        assert_eq!(issues, [], "{name}");
    }
}

#[test]
fn the_first_line_may_carry_the_scene() {
    let folder = super::folder(&[(
        "log.jsonl",
        r#"{"scene": {"bodies": {"cube": {"role": "object", "radius": "50 mm"}}, "hands": {"right": {"fingers": ["thumb"]}}}}
{"time": 0, "cube.position": [0, 0, 1]}
{"time": 0.1, "cube.position": [0, 0, 1]}
"#,
    )]);
    let opened = open(&OpenRequest { log: folder.path().join("log.jsonl"), ..OpenRequest::default() }).unwrap();
    assert_eq!(opened.recording.scene.bodies["cube"].bounding_radius(), 0.05);
    assert_eq!(values(&opened.recording, "cube.position.z"), [1.0, 1.0]);
}

#[test]
fn lines_that_are_not_objects_are_refused() {
    let refused = |text: &str| bound_text("log.jsonl", text, "").unwrap_err();
    insta::assert_snapshot!(
        [
            refused("{\"time\": 0}\n{\"time\": 0.1\n{\"time\": 0.2}\n"),
            refused("{\"time\": 0}\n[1, 2]\n"),
            refused("{\"time\": \"soon\"}\n"),
            refused("{\"time\": 0.2}\n{\"time\": 0.1}\n"),
            refused("{\"scene\": {\"bodies\": {\"left\": {\"role\": \"object\"}}}}\n"),
            refused("{\"time\": 0"),
            refused(&format!("{{\"time\": 0, \"a\": {}1{}}}\n", "[".repeat(40), "]".repeat(40))),
        ]
        .join("\n")
    );
}

#[test]
fn what_is_said_twice_is_refused_at_its_line() {
    let refused = |text: &str| bound_text("log.jsonl", text, "").unwrap_err();
    let scene = r#"{"scene": {"bodies": {}}}"#;
    let row = r#"{"time": 0, "right.thumb.noise": 1}"#;
    let printed = [
        refused(&format!("{row}\n{{\"time\": 0.1, \"right.thumb.noise\": 1, \"right.thumb.noise\": 2}}\n")),
        refused(&format!("{row}\n{{\"time\": 0.1, \"right\": {{\"thumb\": {{\"noise\": 1, \"noise\": 2}}}}}}\n")),
        refused(&format!("{row}\n{{\"time\": 0.1, \"right.thumb.noise\": 1, \"right\": {{\"thumb.noise\": 2}}}}\n")),
        refused(&format!("{row}\n{{\"time\": 0.1, \"time\": 0.2}}")),
        refused(&format!("{row}\n{scene}\n")),
        refused(&format!("{scene}\n{scene}\n{row}\n")),
        refused("{\"scene\": {\"bodies\": {}}, \"time\": 0}\n"),
    ];
    let wanted = [
        "log.jsonl row 2: the key `right.thumb.noise` occurs twice",
        "log.jsonl row 2: the key `noise` occurs twice",
        "log.jsonl row 2: `right.thumb.noise` occurs twice, as one key and as nested ones",
        "log.jsonl row 2: the key `time` occurs twice",
        "log.jsonl row 2: found a `scene`, expected it in the first line only",
        "log.jsonl row 2: found a `scene`, expected it in the first line only",
        "log.jsonl row 1: found a `scene` beside other keys, expected it in a line of its own",
    ];
    // The column of a letter is the reader's affair.
    let without_letter = |text: &str| {
        let (place, message) = text.split_once(": ").unwrap();
        format!("{}: {message}", place.split(" letter ").next().unwrap())
    };
    assert_eq!(printed.each_ref().map(|text| without_letter(text.as_str())), wanted);
}

/// Lines without a row, the scene or a blank one, count.
#[test]
fn rows_are_lines_of_the_file() {
    let refused = |text: &str| bound_text("log.jsonl", text, "").unwrap_err();
    let text =
        "{\"scene\": {\"bodies\": {}}}\n{\"time\": 0, \"right.thumb.noise\": 1}\n\n{\"time\": 1}\n{\"time\": 0.5}\n";
    assert!(refused(text).starts_with("log.jsonl row 5: time runs backwards"), "{}", refused(text));
    let text = "{\"scene\": {\"bodies\": {}}}\n{\"time\": 0, \"right.thumb.noise\": 1}\n\n{\"time\": \"soon\"}\n";
    assert!(refused(text).starts_with("log.jsonl row 4 column time: "), "{}", refused(text));
}
