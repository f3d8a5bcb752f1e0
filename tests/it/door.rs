//! The public interface, as a program uses it that embeds the library. Only names at the root of the crate are used, except to make logs.

use crate::program::{said, teachtree};
use crate::recordings::SHIPPED;
use std::path::Path;
use teachtree::{
    Column, Error, ErrorKind, Log, Position, Question, Rules, Scene, Segment, Severity, Side, Style, Track, TrackId,
};
use teachtree_base::recording::Recording;
use teachtree_logs::read::formats;
use teachtree_world::{shipped, teach};

const LOG: &str = "demos/robosuite/SawyerNutAssembly_demo_1.csv";
const BINDING: &str = "demos/robosuite/sawyer_nut_assembly.binding.yaml";

fn nuts() -> Log {
    Log::options().binding(BINDING).open(LOG).unwrap()
}

fn taught(name: &str) -> Recording {
    teach(&shipped::scene(name).unwrap(), &shipped::operator(name).unwrap(), 1).unwrap()
}

/// A recording as columns in memory, each in SI, with the text of its scene.
fn columns(recording: &Recording) -> (Vec<Column>, Scene) {
    let mut columns = vec![Column::new("time", "s", recording.time.clone())];
    columns.extend(recording.columns.iter().map(|(name, it)| Column::new(name, "", it.values.clone())));
    (columns, Scene::parse("scene", &serde_json::to_string(&recording.scene).unwrap()).unwrap())
}

#[test]
fn the_json_is_that_of_the_command_line() {
    for (log, binding) in SHIPPED {
        let (log, binding) = (format!("demos/{log}"), format!("demos/{binding}.binding.yaml"));
        let opened = Log::options().binding(&binding).open(&log).unwrap();
        let analysis = Rules::for_log(&opened).unwrap().analyze(&opened).unwrap();
        let printed = said(&teachtree(&["analyze", &log, "--binding", &binding, "--format", "json"]));
        assert_eq!(analysis.json(), printed, "{log}");
    }
}

#[test]
fn a_log_of_two_hands_is_read_in_windows_as_in_memory() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let recording = taught("equal_carry");
    formats::write(&recording, &path).unwrap();
    let in_windows = Log::open(&path).unwrap();
    assert_eq!(in_windows.hands(), [Side::Left, Side::Right]);
    let in_memory = Log::open(&path).unwrap();
    in_memory.read().unwrap();
    let rules = Rules::for_log(&in_windows).unwrap();
    assert!(rules.files().any(|file| file == "rules/bimanual.rules"));
    let analysis = rules.analyze(&in_windows).unwrap();
    assert_eq!(analysis.json(), rules.analyze(&in_memory).unwrap().json());
    // What needs the frames reads the log once more.
    let [one, other] = [&in_windows, &in_memory].map(|log| rules.analyze(log).unwrap().html().unwrap());
    assert_eq!(one, other);

    // The same log as columns, under the same name, is the same.
    let (columns, scene) = columns(&recording);
    let log = Log::from_columns(path.display().to_string(), columns, &scene).unwrap();
    assert_eq!(Rules::for_log(&log).unwrap().analyze(&log).unwrap().json(), analysis.json());
    assert!(analysis.track(TrackId::Both).unwrap().segments().any(|segment| segment.primitive() == "EqualGrasp"));
}

#[test]
fn tasks_and_segments_say_what_they_are() {
    let log = nuts();
    let analysis = Rules::for_log(&log).unwrap().analyze(&log).unwrap();
    let lines: Vec<String> = analysis.tasks().iter().map(ToString::to_string).collect();
    insta::assert_snapshot!(lines.join("\n"));
    let starts: Vec<f64> = analysis.tasks().iter().map(|task| task.start_s()).collect();
    assert!(starts.is_sorted());
    let task = analysis.tasks()[0];
    assert_eq!(task.track(), TrackId::Hand(Side::Right));
    let segments: Vec<Segment> = task.segments().collect();
    assert_eq!(segments[0].frames().start, task.frames().start);
    assert!((task.start_s() - analysis.start_s() - task.frames().start as f64 / analysis.rate_hz()).abs() < 1e-6);
    assert_eq!(segments.last().unwrap().frames().end, task.frames().end);
    let track: Track = analysis.tracks().next().unwrap();
    // Each frame of a hand has a label, before and after relabeling.
    for segments in [track.segments().collect::<Vec<_>>(), track.raw_segments().collect()] {
        assert_eq!(segments.iter().map(|it| it.frames().len()).sum::<usize>(), analysis.frame_count());
    }
    let changed = track.segments().find(|segment| !segment.changed_by().is_empty()).unwrap();
    assert!(!changed.was().is_empty());
}

#[test]
fn text_csv_and_page_are_those_of_the_command_line() {
    let log = nuts();
    let analysis = Rules::for_log(&log).unwrap().analyze(&log).unwrap();
    let args = ["analyze", LOG, "--binding", BINDING];
    let style = Style { width: 90, ..Style::default() };
    assert_eq!(analysis.text(style), said(&teachtree(&args)));
    assert_eq!(analysis.csv().unwrap(), said(&teachtree(&[&args[..], &["--format", "csv"]].concat())));
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("report.html");
    teachtree(&[&args[..], &["--report", page.to_str().unwrap()]].concat());
    assert_eq!(analysis.html().unwrap(), std::fs::read_to_string(page).unwrap());
}

#[test]
fn rules_in_a_text_extend_the_shipped_ones() {
    let log = nuts();
    let text = std::fs::read_to_string("examples/tap.rules").unwrap();
    let options = || Rules::options().param("tap_time", "80 ms").param("touch_on", "0.2 N");
    let of_text = options().text("examples/tap.rules", &text).for_log(&log).unwrap();
    let of_file = options().file("examples/tap.rules").for_log(&log).unwrap();
    assert!(of_text.primitives().any(|name| name == "Tap") && of_text.tasks().any(|name| name == "tap"));
    assert_eq!(of_text.digest(), of_file.digest());
    assert_eq!(of_text.analyze(&log).unwrap().json(), of_file.analyze(&log).unwrap().json());
    assert_ne!(of_text.digest(), Rules::options().text("tap", &text).for_log(&log).unwrap().digest());
    // Params and the hand model of the binding count, unless others are named.
    let shown = of_text.analyze(&log).unwrap().text(Style::default());
    assert!(shown.contains("touch_on = 0.2 N"), "{shown}");
    assert!(Rules::for_log(&log).unwrap().files().any(|file| file == "rules/hand_flags.rules"));
    let forces = Rules::options().hand_file("hand_force.rules").for_log(&log).unwrap();
    assert!(forces.files().any(|file| file == "rules/hand_force.rules"));
}

#[test]
fn questions_are_answered_as_on_the_command_line() {
    let log = nuts();
    let analysis = Rules::for_log(&log).unwrap().analyze(&log).unwrap();
    let explained = analysis.explain(&Question::between(14.0, 14.5).why_not("Press")).unwrap();
    let args = ["explain", LOG, "--binding", BINDING, "--at", "14s..14.5s", "--why-not", "Press"];
    assert_eq!(explained.to_string(), said(&teachtree(&args)));
    assert_eq!(explained.json(), said(&teachtree(&[&args[..], &["--format", "json"]].concat())));
    let first = explained.iter().next().unwrap();
    assert_eq!(first.track(), TrackId::Hand(Side::Right));
    assert!(first.start_s() <= first.end_s() && (14.0 - first.start_s()).abs() < 0.1);
    let taken: Vec<&str> = first.choices().filter(|it| it.is_taken()).map(|it| it.condition()).collect();
    assert!(taken.last().unwrap().contains(first.primitive()), "{taken:?}");
    assert!(first.choices().all(|choice| choice.place().starts_with("rules/")));
    let reversed = analysis.explain(&Question::between(14.5, 14.0)).unwrap_err();
    assert_eq!(reversed.kind(), ErrorKind::Argument);
    assert!(reversed.to_string().contains("expected the earlier time first"), "{reversed}");
}

#[test]
fn a_table_of_frames_is_of_the_format_that_its_name_ends_in() {
    let log = nuts();
    let table = Rules::for_log(&log).unwrap().analyze(&log).unwrap().frames(&[]).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let error = table.write(folder.path().join("frames.xls")).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Argument);
    assert!(error.to_string().contains("ends in .xls, expected .csv or .parquet"), "{error}");
    assert!(folder.path().read_dir().unwrap().next().is_none());
    table.write(folder.path().join("frames.csv")).unwrap();
}

#[test]
fn what_rules_cannot_detect_is_known_before_they_run() {
    let log = Log::options().binding("demos/robosuite/panda_lift.binding.yaml").open("demos/robosuite/lift_demo_1.csv");
    let log = log.unwrap();
    let rules = Rules::for_log(&log).unwrap();
    let found = rules.observability(&log).unwrap();
    let [right] = found.tracks.as_slice() else { panic!("one hand") };
    assert_eq!(right.track, TrackId::Hand(Side::Right));
    assert!(right.detectable.iter().any(|name| name == "Grasp"));
    assert!(!right.undetectable.is_empty());
    for lack in &right.undetectable {
        assert!(!lack.reason.is_empty() && lack.primitives.iter().all(|name| !right.detectable.contains(name)));
    }
    // It is an issue of the analysis, too, since foreign logs may lack anything.
    let analysis = rules.analyze(&log).unwrap();
    let issues =
        analysis.issues().iter().filter(|issue| right.undetectable.iter().any(|it| issue.message.contains(&it.reason)));
    assert_eq!(issues.count(), right.undetectable.len());
}

#[test]
fn diagnostics_are_data_and_a_text() {
    let error = Rules::options().text("mine.rules", "use \"contact.rules\"\nprimitive Grasp\n").load().unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Rules);
    let [found] = error.diagnostics() else { panic!("{error}") };
    assert_eq!((found.severity(), found.file()), (Severity::Error, Some("mine.rules")));
    let (start, end) = found.range().unwrap();
    assert_eq!(start, Position { line: 2, column: 11 });
    assert_eq!(end, Position { line: 2, column: 16 });
    assert!(found.code().starts_with('E') && found.message().contains("`Grasp`"));
    assert_eq!(error.place(), "mine.rules:2:11");
    assert!(error.to_string().contains("2 | primitive Grasp"), "{error}");
    assert_eq!(found.to_string(), error.to_string());
    // A warning is not an error.
    let rules = Rules::options().text("mine.rules", "use \"contact.rules\"\nparam idle = 1 s\n").load().unwrap();
    let [warning] = rules.warnings() else { panic!("{:?}", rules.warnings()) };
    assert_eq!((warning.severity(), warning.file()), (Severity::Warning, Some("mine.rules")));
}

/// What goes wrong, its kind and its place.
fn failed<T: std::fmt::Debug>(result: Result<T, Error>) -> (ErrorKind, String) {
    let error = result.unwrap_err();
    assert!(!error.message().is_empty() && error.to_string().contains(error.message()));
    (error.kind(), error.place().to_string())
}

#[test]
fn an_error_has_its_kind() {
    // What a `main` prints that returns the error.
    let missing = Log::open("nothing.csv").err().unwrap();
    assert_eq!(format!("{missing:?}"), missing.to_string());
    assert!(missing.to_string().starts_with("nothing.csv: "), "{missing}");
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let logs = Path::new("tests/fixtures/logs");
    let scene = logs.join("box.yaml");
    let open = |log: &str| Log::options().scene(&scene).open(logs.join(log));

    let missing = Log::open("nowhere.csv").unwrap_err();
    assert_eq!((missing.kind(), missing.place()), (ErrorKind::Io, "nowhere.csv"));
    let source = std::error::Error::source(&missing).unwrap();
    let source = source.downcast_ref::<std::io::Error>().unwrap();
    assert_eq!(source.kind(), std::io::ErrorKind::NotFound);

    // Of a log that is read in windows the rows are read when they are needed.
    let log = open("text_for_a_number.csv").and_then(|log| log.read());
    let (kind, place) = failed(log);
    assert!(kind == ErrorKind::Format && place.contains("text_for_a_number.csv row"), "{kind:?} {place}");
    assert_eq!(failed(open("not_utf8.csv").and_then(|log| log.read())).0, ErrorKind::Format);

    assert_eq!(failed(Log::open(logs.join("whole.csv"))).0, ErrorKind::Scene);
    assert_eq!(
        failed(Log::options().scene(write("s.yaml", "bodies: {a: 3}")).open(logs.join("whole.csv"))).0,
        ErrorKind::Scene
    );
    assert_eq!(failed(Scene::open(write("t.yaml", "bodies: [\n"))).0, ErrorKind::Scene);
    let (kind, place) = failed(Scene::parse("mine", "bodies: {cube: {role: thing}}"));
    assert!(kind == ErrorKind::Scene && place.starts_with("mine:1:"), "{kind:?} {place}");

    let binding = write("b.binding.yaml", "time: t\nrate: 10 Hz\n");
    let (kind, place) = failed(Log::options().binding(&binding).open(LOG));
    assert!(kind == ErrorKind::Binding && place.starts_with(&binding), "{kind:?} {place}");
    let binding = write("c.binding.yaml", "time: when\n");
    assert_eq!(failed(Log::options().binding(&binding).scene(&scene).open(LOG)).0, ErrorKind::Binding);

    let log = nuts();
    assert_eq!(failed(Rules::options().file("nowhere.rules").load()).0, ErrorKind::Rules);
    assert_eq!(failed(Rules::options().param("nothing", "1 N").for_log(&log)).0, ErrorKind::Rules);
    assert_eq!(failed(Rules::options().hand_file("nowhere.rules").for_log(&log)).0, ErrorKind::Rules);

    let brief = std::fs::read_to_string("examples/hold.rules").unwrap().replace("300 ms in 100 ms .. 1 s", "10 ms");
    let at_20_hz = open("whole.csv").unwrap();
    let brief = Rules::options().text("brief.rules", brief).for_log(&at_20_hz).unwrap();
    let (kind, place) = failed(brief.analyze(&at_20_hz));
    assert!(kind == ErrorKind::Mismatch && place.starts_with("brief.rules:"), "{kind:?} {place}");
    let of_forces = Rules::options().hand_file("hand_force.rules");
    let (kind, place) = failed(open("no_forces.csv").and_then(|log| of_forces.for_log(&log)?.analyze(&log)));
    assert!(kind == ErrorKind::Mismatch && place.contains("no_forces.csv"), "{kind:?} {place}");

    let analysis = Rules::for_log(&log).unwrap().analyze(&log).unwrap();
    assert_eq!(failed(analysis.explain(&Question::at(1e6))).0, ErrorKind::Argument);
    assert_eq!(failed(analysis.explain(&Question::at(8.0).track(TrackId::Both))).0, ErrorKind::Argument);
    assert_eq!(failed(analysis.explain(&Question::at(8.0).why_not("Dance"))).0, ErrorKind::Argument);

    let column = |name: &str, values: &[f64]| Column::new(name, "", values);
    let of = |columns: Vec<Column>| failed(Log::from_columns("mine", columns, &Scene::default()));
    let x = "right.thumb.force.x";
    assert_eq!(of(vec![]).0, ErrorKind::Format);
    let (kind, place) = of(vec![column("time", &[0.0, 0.1]), column(x, &[1.0])]);
    assert_eq!((kind, place.as_str()), (ErrorKind::Format, "mine column right.thumb.force.x"));
    assert_eq!(of(vec![column("time", &[0.0, 0.1]), column(x, &[1.0; 2]), column(x, &[1.0; 2])]).0, ErrorKind::Format);
    assert_eq!(of(vec![column("time", &[0.1, 0.0]), column(x, &[1.0; 2])]).0, ErrorKind::Format);
    assert_eq!(of(vec![column("time", &[0.1, f64::NAN]), column(x, &[1.0; 2])]).0, ErrorKind::Format);
    assert_eq!(of(vec![column("time", &[0.0, 0.1]), Column::new(x, "m", [1.0; 2])]).0, ErrorKind::Format);
    assert_eq!(of(vec![column("time", &[]), column(x, &[])]).0, ErrorKind::Format);
}

/// The types can be sent between threads, and shared.
#[test]
fn logs_rules_and_analyses_are_shared_by_threads() {
    fn shared<T: Send + Sync>(_: &T) {}
    let log = nuts();
    let rules = Rules::for_log(&log).unwrap();
    shared(&log);
    shared(&rules);
    shared(&Log::open("nowhere.csv").unwrap_err());
    let found: Vec<String> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..2).map(|_| scope.spawn(|| rules.analyze(&log).unwrap())).collect();
        threads.into_iter().map(|thread| thread.join().unwrap().json()).collect()
    });
    assert_eq!(found[0], found[1]);
    shared(&rules.analyze(&log).unwrap());
}

/// What the root names is the interface; the crates are none.
#[test]
fn the_root_names_the_whole_interface() {
    let root = std::fs::read_to_string("src/lib.rs").unwrap();
    assert!(!root.contains("pub mod "), "the root has names, and no modules");
    let named = root.split("pub use ").skip(1).filter_map(|rest| rest.split(';').next());
    let names: usize = named.map(|it| it.split_once('{').map_or(1, |(_, list)| list.split(',').count())).sum();
    assert!((20..=60).contains(&names), "{names} names at the root");
}
