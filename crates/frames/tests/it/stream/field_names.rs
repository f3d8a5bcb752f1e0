//! Logs whose channels have the field's names: a tool point and a wrist in place of a thumb and a palm.

use super::ask_fingers;
use crate::shared::files::folder;
use std::path::Path;
use teachtree_base::channels::{ChannelSpec, Fallback, Shape};
use teachtree_base::hands::Finger;
use teachtree_base::units::Dimension;
use teachtree_frames::bind::BindingFile;
use teachtree_frames::frames::Frames;
use teachtree_frames::{OpenRequest, OpenedLog, open};

/// The field's names, and ours.
const NAMES: [(&str, &str); 3] =
    [("tcp.position", "thumb.position"), ("tcp.rotation", "palm.rotation"), ("wrist.force", "palm.force")];

const SCENE: &str = "bodies: {cube: {role: object, radius: 20 mm}}\n";

/// A text with our names in place of the field's.
fn plain(text: &str) -> String {
    NAMES.iter().fold(text.to_string(), |text, (field, own)| text.replace(field, own))
}

/// A log of a tool with a force sensor at the wrist.
fn log() -> String {
    let columns: String = ["tcp.position", "wrist.force"]
        .iter()
        .flat_map(|channel| ["x", "y", "z"].map(|axis| format!(",right.{channel}.{axis}")))
        .collect();
    let rows = (0..100).map(|row| {
        let time = f64::from(row) * 0.01;
        let force = if row > 50 { 8.0 } else { 0.0 } + 0.01 * (time * 400.0).sin();
        format!("{time:.2},{:.4},0,0.1,0.02,{:.4},{force:.4},0.2,0.3,{:.4}\n", 0.1 * time, 0.01 * time, 0.1 * time)
    });
    format!("time{columns},cube.position.x,cube.position.y,cube.position.z\n{}", rows.collect::<String>())
}

fn opened(log: &str, binding: Option<&str>, scene: &str) -> OpenedLog {
    let folder = folder(&[("log.csv", log), ("log.scene.yaml", scene), ("b.yaml", binding.unwrap_or_default())]);
    let path = |name: &str| folder.path().join(name);
    let binding = binding.map(|_| path("b.yaml"));
    open(&OpenRequest { log: path("log.csv"), binding, ..OpenRequest::default() }).unwrap()
}

/// What rules with a wrist sensor read.
fn channels() -> Vec<ChannelSpec> {
    let palm = ChannelSpec {
        name: "palm.rotation".into(),
        per_hand: true,
        axis: None,
        shape: Shape::Rotation,
        dimension: Dimension::NONE,
        absent: Fallback::Constant(0.0),
    };
    let position = ask_fingers("position", Shape::Vec3, Dimension::LENGTH);
    vec![position, ask_fingers("force", Shape::Vec3, Dimension::FORCE), super::ask_contact(), palm]
}

/// The frames, and the issues as texts.
fn read(opened: &OpenedLog) -> (Frames, Vec<String>) {
    let mut frames = opened.frames(&channels()).unwrap();
    let issues = std::mem::take(&mut frames.issues);
    (frames, issues.iter().map(|issue| format!("{} {}: {}", issue.kind, issue.channel, issue.message)).collect())
}

#[test]
fn both_names_make_the_same_frames() {
    let (field, issues) = read(&opened(&log(), None, SCENE));
    let (own, own_issues) = read(&opened(&plain(&log()), None, SCENE));
    assert_eq!(field.layout.hands[0].fingers, [Finger::Thumb, Finger::Palm]);
    assert_eq!(field, own);
    // Each message has the names of its log.
    let rotation = issues.iter().find(|issue| issue.starts_with("missing_channel")).unwrap();
    assert!(rotation.starts_with("missing_channel right.tcp.rotation: "), "{issues:?}");
    assert_eq!(issues.iter().map(|issue| plain(issue)).collect::<Vec<_>>(), own_issues);
    assert!(!own_issues.concat().contains("tcp"), "{own_issues:?}");
}

/// Neither does a tool point measure a force nor a wrist a position: nothing is missing.
#[test]
fn a_tool_with_a_wrist_sensor_lacks_nothing() {
    for scene in ["[tcp]", "[tcp, wrist]", "[thumb, palm]", "[thumb]"] {
        let scene = format!("{SCENE}hands: {{right: {{fingers: {scene}}}}}\n");
        let (frames, issues) = read(&opened(&log(), None, &scene));
        assert_eq!(frames.layout.hands[0].fingers, [Finger::Thumb, Finger::Palm], "{scene}");
        let missing: Vec<&String> = issues.iter().filter(|issue| issue.starts_with("missing_channel")).collect();
        assert!(matches!(missing.as_slice(), [rotation] if rotation.contains("right.tcp.rotation")), "{missing:?}");
    }
}

const BINDING: &str = "
time: t
channels:
  right.tcp.position: p<xyz>
  right.tcp.rotation: q<wxyz>
  right.wrist.force: f<xyz>
  right.index.position: {at: [0 mm, 0 mm, 10 mm], of: right.tcp}
  right.gripper.opening: {between: [right.tcp, right.index]}
sensors: {right.wrist.force: {frame: right.tcp.rotation, tool: 100 g}}
tare: {channels: [right.wrist.force], from: 0 s, to: 0.2 s}
trust: [right.wrist.force]
scene: {bodies: {cube: {role: object, radius: 20 mm, position: [1 m, 0 m, 0 m]}}}
";

fn foreign() -> String {
    let turned = |row: u32| (f64::from(row) * 0.02, f64::from(row) * 0.01);
    let rows = (0..60).map(|row| {
        let (angle, time) = turned(row);
        let force = 1.0 + 0.1 * (time * 300.0).sin();
        format!("{time:.2},{time:.3},0,0,{:.6},{:.6},0,0,0,{:.4},{force:.4}\n", angle.cos(), angle.sin(), time * 0.1)
    });
    format!("t,px,py,pz,qw,qx,qy,qz,fx,fy,fz\n{}", rows.collect::<String>())
}

#[test]
fn a_binding_may_use_either_name_wherever_it_names_a_channel() {
    let field = opened(&foreign(), Some(BINDING), SCENE);
    let own = plain(BINDING).replace("[right.tcp,", "[right.thumb,");
    let own = opened(&foreign(), Some(&own), SCENE);
    assert_eq!(field.recording.columns, own.recording.columns);
    let opening = &field.recording.columns["right.gripper.opening"].values;
    assert!(opening.iter().all(|value| (value - 0.010).abs() < 1e-9), "{opening:?}");
    assert_eq!(field.trust, ["right.palm.force"]);
    assert_eq!(read(&field).0, read(&own).0);
}

fn refused(binding: &str) -> String {
    let folder = folder(&[("log.csv", foreign().as_str()), ("b.yaml", binding)]);
    let path = |name: &str| folder.path().join(name);
    let request = OpenRequest { log: path("log.csv"), binding: Some(path("b.yaml")), ..OpenRequest::default() };
    let error = open(&request).and_then(|opened| opened.frames(&channels()).map(|_| ())).unwrap_err();
    error.to_string().replace(&format!("{}{}", folder.path().display(), std::path::MAIN_SEPARATOR), "")
}

#[test]
fn errors_of_a_binding_have_the_names_that_it_has() {
    let twice = BINDING.replace("  right.tcp.rotation", "  right.thumb.position: f<xyz>\n  right.tcp.rotation");
    assert_eq!(
        refused(&twice),
        "b.yaml:5:3: `right.tcp.position` and `right.thumb.position` are one channel, expected one of the two"
    );
    let unit = BINDING.replace("p<xyz>", "p<xyz> [N]");
    assert_eq!(refused(&unit), "b.yaml:4:3: `N` is a force (N), expected a length (m)");
    let untared = BINDING.replace("  right.wrist.force: f<xyz>\n", "");
    assert!(refused(&untared).ends_with("no channel `right.wrist.force` is bound"), "{}", refused(&untared));
    let place = BINDING.replace("  right.tcp.position: p<xyz>\n", "");
    assert!(
        refused(&place).contains("is a point of `right.tcp`, and no channel `right.tcp.position` is bound"),
        "{}",
        refused(&place)
    );
    let force =
        BINDING.replace("  right.wrist.force: f<xyz>", "  right.wrist.force: f<xyz>\n  right.tcp.force: f<xyz>");
    assert!(
        refused(&force)
            .ends_with("the force that a tool feels is that of the wrist; did you mean `right.wrist.force`?"),
        "{}",
        refused(&force)
    );
}

#[test]
fn a_log_with_both_names_of_a_channel_is_refused() {
    let folder = folder(&[
        ("log.csv", "time,right.tcp.position.x,right.thumb.position.x\n0,0,0\n0.1,0,0\n"),
        ("log.scene.yaml", SCENE),
    ]);
    let request = OpenRequest { log: folder.path().join("log.csv"), ..OpenRequest::default() };
    let error = open(&request).unwrap_err().to_string();
    assert!(error.contains("column right.thumb.position.x: the column occurs twice, as columns 2 and 3"), "{error}");
}

/// Rules may declare a channel under the name of the field, whatever the log calls it.
#[test]
fn rules_read_channels_by_the_names_of_the_field() {
    let ask = |name: &str, dimension: Dimension| ChannelSpec {
        name: name.into(),
        per_hand: true,
        axis: None,
        shape: Shape::Vec3,
        dimension,
        absent: Fallback::Refused,
    };
    for log in [log(), plain(&log())] {
        let frames = opened(&log, None, SCENE)
            .frames(&[ask("tcp.position", Dimension::LENGTH), ask("wrist.force", Dimension::FORCE)])
            .unwrap();
        assert!((super::column(&frames, "tcp.position", 0, 0)[50] - 0.05).abs() < 1e-9);
        assert!((super::column(&frames, "wrist.force", 0, 2)[60]) > 7.0);
    }
}

#[test]
fn a_torque_is_a_known_channel() {
    let text = "channels: {right.wrist.torque: 'f<xyz> [Nmm]', right.tcp.position: p<xyz>}\ntime: t\nscene: {bodies: {cube: {role: object, radius: 2 mm}}}\n";
    let opened = opened(&foreign(), Some(text), SCENE);
    let torque = &opened.recording.columns["right.wrist.torque.y"];
    assert_eq!((torque.dimension, torque.values[50]), (Dimension::TORQUE, 0.05 * 1e-3));
    let frames = opened.frames(&[ask_fingers("position", Shape::Vec3, Dimension::LENGTH)]).unwrap();
    assert!(frames.issues.iter().all(|issue| issue.kind != "unknown_channel"), "{:?}", frames.issues);
    let wrong = BindingFile::parse(text.replace("[Nmm]", "[N]"), "b.yaml".into()).unwrap();
    let file = Path::new("log.csv");
    let source = teachtree_logs::read::formats::delimited_text::source(
        Box::new(std::io::Cursor::new(foreign().into_bytes())),
        file.display().to_string(),
    );
    let error = teachtree_frames::bind::bind(source.unwrap(), &wrong, wrong.binding.scene.clone().unwrap());
    assert_eq!(error.unwrap_err().message, "`N` is a force (N), expected a torque (N m)");
}
