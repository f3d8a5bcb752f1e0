//! What segments and tasks are about: the object, its partner, and the rows of the log.

use teachtree::{Analysis, Log, Rules, Segment, Side, Track, TrackId};
use teachtree_base::recording::Recording;
use teachtree_logs::read::formats;
use teachtree_world::{shipped, teach};

fn taught(name: &str) -> Recording {
    teach(&shipped::scene(name).unwrap(), &shipped::operator(name).unwrap(), 3).unwrap()
}

fn analyzed(log: &Log) -> Analysis {
    Rules::for_log(log).unwrap().analyze(log).unwrap()
}

/// The analysis of a shipped scene.
fn of_scene(name: &str) -> Analysis {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    formats::write(&taught(name), &path).unwrap();
    analyzed(&Log::open(&path).unwrap())
}

fn track(analysis: &Analysis, who: TrackId) -> Track<'_> {
    analysis.track(who).unwrap_or_else(|| panic!("no {who} in {analysis:?}"))
}

/// The segments of a track with a primitive, as `object` or `object (partner)`.
fn about(analysis: &Analysis, who: TrackId, primitive: &str) -> Vec<String> {
    let segments = track(analysis, who).segments().filter(|segment| segment.primitive() == primitive);
    segments.map(|segment| printed(segment.object(), segment.partner())).collect()
}

fn printed(object: Option<&str>, partner: Option<&str>) -> String {
    let partner = partner.map_or(String::new(), |partner| format!(" ({partner})"));
    format!("{}{partner}", object.unwrap_or("-"))
}

const LEFT: TrackId = TrackId::Hand(Side::Left);
const RIGHT: TrackId = TrackId::Hand(Side::Right);

#[test]
fn an_inserted_peg_has_the_body_of_its_hole_as_partner_not_what_the_body_stands_on() {
    let analysis = of_scene("hold_and_insert");
    assert_eq!(about(&analysis, RIGHT, "Insert"), ["peg (holder)"]);
    assert_eq!(about(&analysis, RIGHT, "Translate"), ["peg"]);
    assert_eq!(about(&analysis, LEFT, "Translate"), ["holder"]);
    let tasks = analysis.tasks();
    let task = tasks.iter().find(|task| task.track() == RIGHT).unwrap();
    assert_eq!((task.name(), printed(task.object(), task.partner())), ("peg_in_hole", "peg (holder)".into()));
    assert!(task.to_string().starts_with("right peg_in_hole peg (holder), 0.000 – "), "{task}");
    let insert = task.segments().find(|segment| segment.primitive() == "Insert").unwrap();
    assert!(insert.to_string().starts_with("right Insert peg (holder), "), "{insert}");
}

#[test]
fn a_wall_is_the_partner_of_what_slides_along_it() {
    let analysis = of_scene("pick_and_follow");
    assert_eq!(about(&analysis, RIGHT, "Follow"), ["cube (right_wall)"]);
    assert_eq!(about(&analysis, RIGHT, "Translate"), ["cube"]);
    let analysis = of_scene("push");
    assert_eq!(about(&analysis, RIGHT, "Push"), ["box"]);
}

#[test]
fn a_hand_over_is_about_one_object() {
    let analysis = of_scene("hand_over_left_to_right");
    for who in [LEFT, RIGHT, TrackId::Both] {
        assert_eq!(about(&analysis, who, "Pass"), ["box"], "{who}");
    }
}

#[test]
fn what_two_hands_join_is_about_the_object_that_enters_the_other() {
    let analysis = of_scene("ring_and_pole");
    assert_eq!(about(&analysis, LEFT, "Insert"), ["cylinder (ring)"]);
    assert_eq!(about(&analysis, RIGHT, "Insert"), ["ring (cylinder)"]);
    assert_eq!(about(&analysis, TrackId::Both, "Insert"), ["ring (cylinder)"]);
}

#[test]
fn a_hand_that_comes_near_is_about_the_object_that_it_will_touch() {
    let analysis = of_scene("several_tasks");
    let segments: Vec<Segment> = track(&analysis, RIGHT).segments().collect();
    assert_eq!(about(&analysis, RIGHT, "Approach"), ["box", "block", "block"]);
    for pair in segments.windows(2).filter(|pair| pair[0].primitive() == "Approach") {
        assert_eq!(pair[0].object(), pair[1].object(), "{} {}", pair[0], pair[1]);
    }
}

/// Fingers that open push at the block beside the box: what is let go is the box.
#[test]
fn a_hand_that_opens_lets_go_of_what_it_held() {
    let mut scene = shipped::scene("pick_and_place").unwrap();
    let block = scene.bodies.get_mut("block").unwrap();
    (block.position[0].0, block.position[1].0) = (0.110, 0.130);
    let mut operator = shipped::operator("pick_and_place").unwrap();
    operator.variation = operator.variation.scaled(0.0);
    let recording = teach(&scene, &operator, 1).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    formats::write(&recording, &path).unwrap();
    let analysis = analyzed(&Log::open(&path).unwrap());
    let release: Vec<Segment> = analysis.segments().into_iter().filter(|it| it.primitive() == "Release").collect();
    assert_eq!(about(&analysis, RIGHT, "Release"), ["box"]);
    // The block was pushed while it opened.
    let rows = release[0].rows();
    let at = |row: usize| recording.columns["block.position.y"].values[row];
    assert!(at(rows.end - 1) - at(rows.start) > 1e-3, "{rows:?}");
}

#[test]
fn rows_are_those_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    formats::write(&taught("pick_and_place"), &path).unwrap();
    let whole = analyzed(&Log::open(&path).unwrap());
    assert!(whole.segments().iter().all(|segment| segment.rows() == segment.frames()));

    // A row that stands twice is one frame, and rows that are lost are a gap.
    let text = std::fs::read_to_string(&path).unwrap();
    let mut lines: Vec<&str> = text.lines().collect();
    lines.drain(3000..3300);
    lines.insert(1000, lines[1000]);
    std::fs::write(&path, lines.join("\n") + "\n").unwrap();
    let time = |row: usize| lines[row + 1].split(',').next().unwrap().parse::<f64>().unwrap();
    let analysis = analyzed(&Log::open(&path).unwrap());
    let segments: Vec<Segment> = track(&analysis, RIGHT).segments().collect();
    assert!(segments.iter().any(|segment| segment.rows() != segment.frames()));
    for segment in &segments {
        let rows = segment.rows();
        assert!(time(rows.start) == segment.start_s(), "{segment}: {rows:?}");
        assert!(time(rows.end - 1) < segment.end_s(), "{segment}: {rows:?}");
    }
    // No row is lost between the segments.
    assert_eq!(segments.first().unwrap().rows().start, 0);
    assert_eq!(segments.last().unwrap().rows().end, lines.len() - 1);
    assert!(segments.windows(2).all(|pair| pair[0].rows().end == pair[1].rows().start));
}

#[test]
fn a_shifted_clock_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let (log, binding) = (folder.path().join("log.csv"), folder.path().join("shifted.binding.yaml"));
    formats::write(&taught("push"), &log).unwrap();
    std::fs::write(&binding, "time_offset: 2.5 s\n").unwrap();
    let opened = Log::options().binding(&binding).open(&log).unwrap();
    let analysis: serde_json::Value = serde_json::from_str(&analyzed(&opened).json()).unwrap();
    let log = &analysis["log"];
    assert_eq!((log["zero_stamp_s"].as_f64(), log["start_s"].as_f64()), (Some(-2.5), Some(2.5)));
    assert_eq!(log["name"], "log");
    assert_eq!(analysis["version"], env!("CARGO_PKG_VERSION"));
}
