//! What becomes of logs that are not as they should be: every policy of docs/logs.md has a fixture, one fault a file.

use super::{ask, ask_contact, ask_fingers};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use teachtree_base::channels::Shape;
use teachtree_base::units::Dimension;
use teachtree_frames::OpenRequest;
use teachtree_frames::open;
use teachtree_logs::issue::IssueKind;
use teachtree_logs::read::formats::delimited_text;

/// A file of the fixtures.
fn fixture(name: &str) -> PathBuf {
    Path::new(crate::ROOT).join("tests/fixtures").join(name)
}

/// Returns the messages about a log in the folder of the project, and the rest of the log.
fn report(request: &OpenRequest) -> String {
    let channels = [
        ask_fingers("force", Shape::Vec3, Dimension::FORCE),
        ask_contact(),
        ask("target"),
        ask("target.velocity"),
        ask("contacts.force"),
    ];
    match open(request).and_then(|opened| opened.frames(&channels)) {
        Err(error) => format!("error: {error}").replace(&format!("{}/", crate::ROOT), ""),
        Ok(frames) => {
            let mut text =
                format!("{} frames at {} Hz, stretches {:?}", frames.len, frames.layout.rate_hz, frames.stretches);
            let touching = |frame: &usize| {
                let contact = frames.channel("fingers.contact").unwrap();
                frames.columns.iter().any(|(key, column)| key.channel == contact && column.get(*frame) > Some(&0.5))
            };
            write!(text, ", touched in {}", (0..frames.len).filter(touching).count()).unwrap();
            for issue in &frames.issues {
                write!(
                    text,
                    "\n{} {} {}–{} s: {}",
                    issue.kind, issue.channel, issue.start_s, issue.end_s, issue.message
                )
                .unwrap();
            }
            text
        }
    }
}

/// The report of each file in a folder of the fixtures with this ending, in order of their names.
fn reports(folder: &str, ending: &str, request: impl Fn(PathBuf) -> OpenRequest) -> String {
    let files = fixture(folder).read_dir().unwrap().map(|file| file.unwrap().path());
    let mut files: Vec<PathBuf> = files.filter(|file| file.extension().is_some_and(|found| found == ending)).collect();
    files.sort();
    let printed = files.into_iter().map(|file| {
        let title = file.file_stem().unwrap().to_string_lossy().replace('_', " ");
        format!("# {title}\n{}\n", report(&request(file)))
    });
    printed.collect::<Vec<_>>().join("\n")
}

#[test]
fn each_fault_of_a_log_is_reported() {
    let scene = Some(fixture("logs/box.yaml"));
    insta::assert_snapshot!(reports("logs", "csv", |log| OpenRequest {
        log,
        scene: scene.clone(),
        ..OpenRequest::default()
    }));
}

/// At 30000 s, stamps of 32 bits are 2 ms apart, as the rows are: some steps are twice as long, and none of the others has their true length.
#[test]
fn stamps_of_32_bits_are_refused_with_their_rate() {
    let whole = std::fs::read_to_string(fixture("logs/whole.csv")).unwrap();
    let mut lines = whole.lines();
    let mut text = format!("{}\n", lines.next().unwrap());
    let cells = lines.next().unwrap().split_once(',').unwrap().1;
    for row in 0..1000 {
        let stamp = (30_000.0 + f64::from(row) * 0.002) as f32;
        writeln!(text, "{:.6},{cells}", f64::from(stamp)).unwrap();
    }
    let folder = crate::shared::files::folder(&[("log.csv", &text)]);
    let log = folder.path().join("log.csv");
    let said = report(&OpenRequest { log, scene: Some(fixture("logs/box.yaml")), ..OpenRequest::default() });
    assert!(said.contains("the stamps are numbers of 32 bits, which at 30002 s are 1.953 ms apart"), "{said}");
    assert!(said.contains("a binding with `rate: 500 Hz` replaces them"), "{said}");
}

#[test]
fn each_fault_of_a_binding_is_reported() {
    let log = fixture("bindings/foreign.csv");
    insta::assert_snapshot!(reports("bindings", "yaml", |binding| OpenRequest {
        log: log.clone(),
        binding: Some(binding),
        ..OpenRequest::default()
    }));
}

#[test]
fn a_log_without_a_scene_is_refused() {
    let log = fixture("logs/whole.csv");
    insta::assert_snapshot!(report(&OpenRequest { log, ..OpenRequest::default() }));
}

#[test]
fn a_log_that_is_not_there_is_refused() {
    let request =
        OpenRequest { log: "no/such/log.csv".into(), scene: Some(fixture("logs/box.yaml")), ..OpenRequest::default() };
    insta::assert_snapshot!(report(&request));
    insta::assert_snapshot!(report(&OpenRequest { log: "demonstration.mcap".into(), ..request }));
}

#[test]
fn a_huge_field_is_refused() {
    let text = format!("time,cube.position.x\n0,1\n0.1,{}\n0.2,1\n", "9".repeat(100_000));
    let source = delimited_text::source(Box::new(std::io::Cursor::new(text.into_bytes())), "huge.csv").unwrap();
    let wants = [
        teachtree_logs::read::table::ColumnRequest::Time(1.0),
        teachtree_logs::read::table::ColumnRequest::Number(1.0),
    ];
    insta::assert_snapshot!(source.read(&wants, None).unwrap_err());
}

#[test]
fn brackets_that_stand_too_deep_are_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let binding = folder.path().join("deep.yaml");
    for (text, place) in [("[".repeat(100_000), "1:"), ("{a: ".repeat(100_000), "1:"), ("- '['\n".repeat(100), "")] {
        std::fs::write(&binding, text).unwrap();
        let log = fixture("bindings/foreign.csv");
        let error = open(&OpenRequest { log, binding: Some(binding.clone()), ..OpenRequest::default() }).unwrap_err();
        let too_deep = error.message == "brackets are nested more than 64 deep";
        // Brackets in quotes are text.
        assert_eq!(too_deep, !place.is_empty(), "{error}");
        assert!(error.place.contains(place), "{error}");
    }
}

/// One letter makes a box of 80 m of one of 80 mm.
#[test]
fn a_scene_beyond_all_sizes_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log.csv");
    std::fs::write(&log, "time,cube.position.x,cube.position.y,cube.position.z\n0,0,0,0\n0.1,0,0,0\n").unwrap();
    let bodies = (0..300).fold(String::new(), |text, body| text + &format!("  body{body}: {{role: object}}\n"));
    let scenes = [
        "bodies:\n  cube: {role: object, parts: [{box: [80 m, 80 mm, 80 mm]}]}\n".to_string(),
        "bodies:\n  cube: {role: object, parts: [{cylinder: [80 mm, 80 m]}]}\n".to_string(),
        "bodies:\n  cube: {role: object, parts: [{ball: 10 mm, at: [0 m, 0 m, 20 m]}]}\n".to_string(),
        format!("bodies:\n{bodies}"),
    ];
    let printed = scenes.map(|scene| {
        std::fs::write(folder.path().join("log.scene.yaml"), scene).unwrap();
        let error = open(&OpenRequest { log: log.clone(), ..OpenRequest::default() }).unwrap_err();
        assert!(error.place.contains("log.scene.yaml"), "{error}");
        error.to_string()
    });
    let wanted = [
        "bodies.cube.parts.0: has an edge of 80 m, expected 0.1 mm to 10 m",
        "bodies.cube.parts.0: has a height of 80 m, expected 0.1 mm to 10 m",
        "bodies.cube.parts.0: is 20 m from the middle of its body, expected at most 10 m",
        "bodies: found 300 bodies, expected at most 256",
    ];
    for (printed, wanted) in printed.iter().zip(wanted) {
        assert!(printed.contains(wanted), "{printed}");
    }
}

/// The pages list every kind of issue that there is.
#[test]
fn every_kind_of_issue_is_documented() {
    let read = |page: &str| std::fs::read_to_string(Path::new(crate::ROOT).join(page)).unwrap();
    let pages = read("docs/logs.md") + &read("docs/live.md");
    let missing: Vec<&str> =
        IssueKind::ALL.iter().map(|kind| kind.name()).filter(|name| !pages.contains(&format!("`{name}`"))).collect();
    assert!(missing.is_empty(), "{missing:?}");
}
