//! Elements of arrays that a log names: bound by their names, whatever their places are.

use crate::shared::bags::{Topic, write};
use crate::shared::files::{bound, bound_text, folder, header, values};
use std::fmt::Write as _;
use teachtree_frames::bind::{BindingFile, RowBinder};
use teachtree_frames::inspect::inspect;
use teachtree_frames::propose::{Answers, propose};
use teachtree_logs::issue::Issue;
use teachtree_logs::read::formats;
use teachtree_logs::read::memory_table::{Cells, InMemoryTable};

const BY_NAME: &str = "channels: {cube.position: 'poses.<object>.position.<xyz>'}\nrate: 10 Hz\n";
const BY_PLACE: &str = "channels: {cube.position: 'poses[1].position.<xyz>'}\nrate: 10 Hz\n";

/// A can at x = 1 and a cube at x = 2 that comes from the second to the first place while the can is lost, from row 4 to 6.
fn lines(element: impl Fn(&str, f64) -> String, names: impl Fn(&[&str]) -> String) -> String {
    let mut text = String::new();
    for row in 0..10 {
        let bodies: &[(&str, f64)] =
            if (4..7).contains(&row) { &[("cube", 2.0), ("ball", 3.0)] } else { &[("can", 1.0), ("cube", 2.0)] };
        let elements: Vec<String> = bodies.iter().map(|(name, x)| element(name, *x)).collect();
        let beside = names(&bodies.iter().map(|(name, _)| *name).collect::<Vec<_>>());
        let _ = writeln!(text, "{{\"n\": {row}, \"poses\": [{}]{beside}}}", elements.join(","));
    }
    text
}

fn at(x: f64) -> String {
    format!("\"position\": {{\"x\": {x}, \"y\": 0, \"z\": 0}}")
}

fn changes(issues: &[Issue]) -> Vec<&str> {
    issues.iter().filter(|issue| issue.kind == "changed_element").map(|issue| issue.message.as_str()).collect()
}

#[test]
fn an_element_is_bound_by_the_name_that_it_says() {
    for field in ["name", "label", "child_frame_id", "id"] {
        let text = lines(|name, x| format!("{{\"{field}\": \"{name}\", {}}}", at(x)), |_| String::new());
        let (recording, issues) = bound_text("log.jsonl", &text, BY_NAME).unwrap();
        assert_eq!(values(&recording, "cube.position.x"), [2.0; 10], "{field}");
        assert_eq!(changes(&issues), Vec::<&str>::new());
    }
}

#[test]
fn an_element_is_bound_by_the_name_beside_its_array() {
    for key in ["name", "names", "label", "labels", "ids", "id"] {
        let beside = |names: &[&str]| format!(", \"{key}\": {names:?}");
        let text = lines(|_, x| format!("{{{}}}", at(x)), beside);
        let (recording, _) = bound_text("log.jsonl", &text, BY_NAME).unwrap();
        assert_eq!(values(&recording, "cube.position.x"), [2.0; 10], "{key}");
    }
    // Names may be numbers.
    let number = |name: &&str| ["can", "cube", "ball"].iter().position(|known| known == name).unwrap() + 4;
    let beside = |names: &[&str]| format!(", \"ids\": {:?}", names.iter().map(number).collect::<Vec<_>>());
    let text = lines(|_, x| format!("{{{}}}", at(x)), beside);
    let (recording, _) = bound_text("log.jsonl", &text, &BY_NAME.replace("<object>", "5")).unwrap();
    assert_eq!(values(&recording, "cube.position.x"), [2.0; 10]);
}

#[test]
fn an_element_that_is_lost_is_not_measured_and_no_other_one_takes_its_place() {
    let text = lines(|name, x| format!("{{\"name\": \"{name}\", {}}}", at(x)), |_| String::new());
    let (recording, _) = bound_text("log.jsonl", &text, &BY_NAME.replace("<object>", "can")).unwrap();
    let measured: Vec<bool> = values(&recording, "cube.position.x").iter().map(|x| !x.is_nan()).collect();
    assert_eq!(measured, [true, true, true, true, false, false, false, true, true, true]);
    // Two elements of one name are neither.
    let twice = text.replace("\"ball\"", "\"cube\"");
    let (recording, _) = bound_text("log.jsonl", &twice, BY_NAME).unwrap();
    assert!(values(&recording, "cube.position.x")[4..7].iter().all(|x| x.is_nan()));
}

#[test]
fn an_element_bound_by_its_place_is_reported_where_another_one_takes_it() {
    let text = lines(|name, x| format!("{{\"name\": \"{name}\", {}}}", at(x)), |_| String::new());
    let (recording, issues) = bound_text("log.jsonl", &text, BY_PLACE).unwrap();
    assert_eq!(values(&recording, "cube.position.x")[3..6], [2.0, 3.0, 3.0], "the place counts");
    assert_eq!(
        changes(&issues),
        [
            "is bound by its index, whose element is `cube` at first and `ball` at 0.4 s; bind it by its name, `poses.cube.position.x`"
        ]
    );
    // An array without names has places only, and nothing can be said about them.
    let text = lines(|_, x| format!("{{{}}}", at(x)), |_| String::new());
    let (_, issues) = bound_text("log.jsonl", &text, BY_PLACE).unwrap();
    assert_eq!(changes(&issues), Vec::<&str>::new());
}

#[test]
fn numbers_of_detections_that_never_end_do_not_fill_the_log() {
    let mut text = String::new();
    for row in 0..300 {
        let _ = writeln!(text, "{{\"n\": {row}, \"found\": [{{\"id\": {row}, \"x\": 1}}]}}");
    }
    let folder = folder(&[("log.jsonl", &text)]);
    let titles = header(&folder.path().join("log.jsonl"));
    assert_eq!(titles.iter().filter(|title| title.starts_with("found.")).count(), 64, "{titles:?}");
}

/// Markers with their labels, as a tracker publishes them.
const MARKERS: &str = "Marker[] markers
================================================================================
MSG: tracker/Marker
string label
float64 x
";

fn markers(of: &[(&str, f64)]) -> Vec<u8> {
    let mut body = (of.len() as u32).to_le_bytes().to_vec();
    for (label, x) in of {
        body.resize(body.len().next_multiple_of(4), 0);
        body.extend((label.len() as u32 + 1).to_le_bytes());
        body.extend(label.as_bytes());
        body.push(0);
        body.resize(body.len().next_multiple_of(8), 0);
        body.extend(x.to_le_bytes());
    }
    [vec![0, 1, 0, 0], body].concat()
}

#[test]
fn elements_of_messages_in_bags_have_their_names_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let messages = (0..10).map(|row| {
        let of: &[(&str, f64)] = if row < 5 { &[("can", 1.0), ("cube", 2.0)] } else { &[("cube", 2.0)] };
        (f64::from(row) * 0.1, markers(of))
    });
    let topic: Topic = ("/tracker", "cdr", "tracker/Markers", MARKERS, messages.collect());
    write(&path, None, &[topic]);
    let binding = "channels: {cube.position: ['/tracker.markers.cube.x', = 0 m, = 0 m]}\n";
    let (recording, _) = bound(&path, binding).unwrap();
    assert_eq!(values(&recording, "cube.position.x"), [2.0; 10]);
    let (_, issues) = bound(&path, &binding.replace(".cube.x", "[0].x")).unwrap();
    assert_eq!(changes(&issues).len(), 1, "{issues:?}");
}

#[test]
fn a_proposed_binding_has_the_names_and_not_the_places() {
    let text = lines(|name, x| format!("{{\"name\": \"{name}\", {}}}", at(x)), |_| String::new());
    let folder = folder(&[("log.jsonl", &text)]);
    let found = inspect(formats::open(&folder.path().join("log.jsonl")).unwrap(), None, Some(10.0)).unwrap();
    let binding = propose(&found, &Answers::default()).binding;
    assert!(
        binding.contains("cube.position: poses.cube.position.<xyz>")
            && binding.contains("can.position: poses.can.position.<xyz>"),
        "{binding}"
    );
    assert!(!binding.contains("poses["), "{binding}");
}

#[test]
fn a_live_log_binds_elements_by_name_and_reports_places_that_change() {
    let folder = folder(&[("b.yaml", "")]);
    let path = folder.path().join("b.yaml");
    let rows = |binding: &str| {
        let scene = "scene: {bodies: {cube: {role: object, radius: 50 mm}}}\n";
        std::fs::write(&path, format!("{binding}{scene}")).unwrap();
        assert!(BindingFile::read(&path).is_ok());
        let mut binder = RowBinder::open(&path, None, 1.0).unwrap();
        let (mut cubes, mut issues) = (vec![], vec![]);
        for row in 0..10 {
            let mut message = InMemoryTable::new("topic /tracker");
            message.begin_row().unwrap();
            let of: &[(&str, f64)] =
                if row < 5 { &[("can", 1.0), ("cube", 2.0)] } else { &[("cube", 2.0), ("can", 1.0)] };
            for (at, (label, x)) in of.iter().enumerate() {
                message.put_text(&format!("markers[{at}].label"), label).unwrap();
                message.put(&format!("markers[{at}].x"), *x).unwrap();
            }
            let made = binder.bind_message("/tracker", f64::from(row) * 0.1, &message).unwrap();
            issues.extend(made.issues);
            cubes.extend(made.rows.iter().map(|row| match row.columns().get("cube.position.x") {
                Some(Cells::Numbers(values)) => values[0],
                other => panic!("{other:?}"),
            }));
        }
        (cubes, issues)
    };
    let (cubes, issues) = rows("channels: {cube.position: ['/tracker.markers.cube.x', = 0 m, = 0 m]}\n");
    assert!(cubes.len() >= 9 && cubes.iter().all(|x| *x == 2.0), "{cubes:?}");
    assert_eq!(changes(&issues), Vec::<&str>::new());
    let (_, issues) = rows("channels: {cube.position: ['/tracker.markers[1].x', = 0 m, = 0 m]}\n");
    assert_eq!(changes(&issues).len(), 1, "{issues:?}");
}
