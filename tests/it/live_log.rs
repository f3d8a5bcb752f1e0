//! `Live`: rows of a log one at a time; what is final is what the analysis of the whole log says.

use crate::program::{said, teachtree_fed};
use crate::recordings::SHIPPED;
use std::collections::BTreeMap;
use teachtree::{Analysis, Calibration, Column, Live, LiveEvent, Log, Rules, Scene, Segment, Task, TrackId};
use teachtree_base::recording::Recording;
use teachtree_frames::{OpenRequest, open};
use teachtree_world::{shipped, teach};

pub fn demonstration(name: &str) -> Recording {
    teach(&shipped::scene(name).unwrap(), &shipped::operator(name).unwrap(), 1).unwrap()
}

/// A recording as titles, rows and scene.
#[derive(Clone)]
pub struct Rows {
    pub titles: Vec<String>,
    pub rows: Vec<Vec<f64>>,
    pub scene: Scene,
}

impl Rows {
    pub fn of(recording: &Recording) -> Self {
        let columns = || recording.columns.values();
        let row = |at: usize| [recording.time[at]].into_iter().chain(columns().map(|it| it.values[at])).collect();
        Self {
            titles: ["time".to_string()].into_iter().chain(recording.columns.keys().cloned()).collect(),
            rows: (0..recording.time.len()).map(row).collect(),
            scene: Scene::parse("scene", &serde_json::to_string(&recording.scene).unwrap()).unwrap(),
        }
    }

    pub fn log(&self) -> Log {
        let column = |at: usize| self.rows.iter().map(|row| row[at]).collect::<Vec<f64>>();
        let columns = self.titles.iter().enumerate().map(|(at, title)| Column::new(title, "", column(at)));
        Log::from_columns("log", columns, &self.scene).unwrap()
    }
}

/// The events until the log ends, and those at its end.
pub fn events(rows: &Rows, rules: &Rules, calibration: &Calibration) -> [Vec<LiveEvent>; 2] {
    let mut live = Live::new(rules, &rows.titles, &rows.scene, calibration).unwrap();
    let before = rows.rows.iter().flat_map(|row| live.push(row).unwrap()).collect();
    [before, live.finish().unwrap()]
}

pub fn segment(segment: Segment) -> String {
    format!("{segment} {:?} {:?}", segment.was(), segment.changed_by())
}

fn task(task: Task) -> String {
    let segments: Vec<String> = task.segments().map(segment).collect();
    format!("{task}\n  {}", segments.join("\n  "))
}

/// What an analysis says of each track: segments of the trees, segments after relabeling, tasks.
pub fn whole(analysis: &Analysis) -> BTreeMap<TrackId, [Vec<String>; 3]> {
    let of = |track: teachtree::Track<'_>| {
        let [raw, relabeled] = [track.raw_segments().map(segment).collect(), track.segments().map(segment).collect()];
        (track.who(), [raw, relabeled, track.tasks().map(task).collect()])
    };
    analysis.tracks().map(of).collect()
}

/// The same of events.
pub fn reported<'a>(events: impl Iterator<Item = &'a LiveEvent>) -> BTreeMap<TrackId, [Vec<String>; 3]> {
    let mut tracks: BTreeMap<TrackId, [Vec<String>; 3]> = BTreeMap::new();
    for event in events {
        if let Some(found) = event.segment() {
            let lists = tracks.entry(found.track()).or_default();
            lists[usize::from(event.is_final())].push(segment(found));
        }
        if let Some(found) = event.task().filter(|_| event.is_final()) {
            tracks.entry(found.track()).or_default()[2].push(task(found));
        }
    }
    tracks
}

#[test]
fn what_is_final_is_the_analysis_of_the_whole_log() {
    let mut early = 0;
    for name in
        ["several_tasks", "paper_box", "turn_screw", "equal_carry", "hand_over_left_to_right", "hold_and_insert"]
    {
        let rows = Rows::of(&demonstration(name));
        let log = rows.log();
        let rules = Rules::for_log(&log).unwrap();
        let calibration = Calibration::of_whole(&log, &rules).unwrap();
        let [before, after] = events(&rows, &rules, &calibration);
        early += before.iter().filter(|event| event.task().is_some() && event.is_final()).count();
        let sequence: Vec<u64> = before.iter().chain(&after).map(LiveEvent::sequence).collect();
        assert!(sequence.iter().copied().eq(0..sequence.len() as u64), "{name}");
        assert_eq!(reported(before.iter().chain(&after)), whole(&rules.analyze(&log).unwrap()), "{name}");
    }
    assert!(early >= 3, "only {early} tasks were final before the end");
}

/// `prompt.rules` look at no later frame: a segment has closed 50 ms after its end, and what is final is what the whole log says.
#[test]
fn prompt_rules_label_for_good_within_50_ms() {
    for name in ["several_tasks", "push_and_trace", "equal_carry"] {
        let rows = Rows::of(&demonstration(name));
        let log = rows.log();
        let rules = Rules::options().file("prompt.rules").load().unwrap();
        let calibration = Calibration::of_whole(&log, &rules).unwrap();
        let mut live = Live::new(&rules, &rows.titles, &rows.scene, &calibration).unwrap();
        let (mut events, mut closed, mut labels) = (vec![], 0, 0);
        for row in &rows.rows {
            for event in live.push(row).unwrap() {
                labels += usize::from(event.label().is_some());
                if let Some(segment) = event.segment().filter(|_| !event.is_final()) {
                    let late = row[0] - segment.end_s();
                    assert!(late <= 0.05, "{name}: {segment} closed {late} s after its end");
                    closed += 1;
                }
                events.push(event);
            }
        }
        assert_eq!(live.lag_s(), Some(0.0), "{name}");
        events.extend(live.finish().unwrap());
        assert!(closed >= 4 && labels >= closed, "{name}: {closed} segments closed, {labels} labels");
        assert_eq!(reported(events.iter()), whole(&rules.analyze(&log).unwrap()), "{name}");
    }
}

/// The label of the newest frame is mostly that which the tree returns of the whole log: in the least share of the frames it flickers, or comes late.
#[test]
fn a_label_is_known_at_once() {
    let rows = Rows::of(&demonstration("pick_and_place"));
    let log = rows.log();
    let rules = Rules::for_log(&log).unwrap();
    let calibration = Calibration::of_whole(&log, &rules).unwrap();
    let [before, _] = events(&rows, &rules, &calibration);
    let labels: Vec<(f64, &str)> =
        before.iter().filter_map(|event| event.label().and_then(|(_, label, at)| Some((at, label?)))).collect();
    let analysis = rules.analyze(&log).unwrap();
    let segments: Vec<Segment> = analysis.tracks().next().unwrap().raw_segments().collect();
    let times: Vec<f64> = (50..200).map(|at| f64::from(at) * 0.02).collect();
    let agree = times.iter().filter(|at| {
        let label = labels.iter().rev().find(|(from, _)| from <= at).map(|(_, label)| *label);
        let segment = segments.iter().find(|segment| segment.start_s() <= **at && segment.end_s() > **at);
        label == segment.map(|segment| segment.primitive())
    });
    let share = agree.count() as f64 / times.len() as f64;
    assert!(share > 0.85, "{share}");
}

/// Without confidence a label is reported when it changes; with it also when it becomes surer.
#[test]
fn a_label_becomes_sure_while_it_stands() {
    let rows = Rows::of(&demonstration("pick_and_place"));
    let log = rows.log();
    let rules = Rules::for_log(&log).unwrap();
    let calibration = Calibration::of_whole(&log, &rules).unwrap();
    let run = |confident: bool| {
        let live = Live::new(&rules, &rows.titles, &rows.scene, &calibration).unwrap();
        let mut live = if confident { live.with_confidence() } else { live };
        let events: Vec<LiveEvent> = rows.rows.iter().flat_map(|row| live.push(row).unwrap()).collect();
        let all =
            events.iter().chain(&live.finish().unwrap()).map(|it| (it.name(), it.to_string())).collect::<Vec<_>>();
        (all, events)
    };
    let ((plain, labels), (with, sure)) = (run(false), run(true));
    assert!(labels.iter().all(|event| event.confidence().is_none() && !event.json().contains("confidence")));
    let others = |all: &[(&'static str, String)]| all.iter().filter(|it| it.0 != "label").cloned().collect::<Vec<_>>();
    assert_eq!(others(&plain), others(&with));
    let label = |it: &LiveEvent| it.label().map(|(_, label, at_s)| (label.unwrap().to_string(), at_s, it.confidence()));
    let (labels, sure) = (labels.iter().filter_map(label), sure.iter().filter_map(label));
    let sure: Vec<(String, f64, f64)> = sure.map(|(name, at_s, share)| (name, at_s, share.unwrap())).collect();
    // The labels and when they begin are the same.
    let begun = sure.iter().filter(|it| it.2 <= 0.59).map(|it| (it.0.clone(), it.1));
    assert!(labels.map(|it| (it.0, it.1)).eq(begun));
    for pair in sure.windows(2) {
        assert!((0.59..0.9).contains(&pair[1].2));
        assert!(pair[0].0 != pair[1].0 || pair[0].2 < pair[1].2, "{pair:?}");
    }
    // The averages look 128 ms ahead, and the tree settles for 50 ms: four fifths are 142 ms. Labels are given every 20 ms.
    assert!(sure.iter().filter(|it| it.2 >= 0.88).count() >= 4, "{sure:?}");
    let [move_at, sure_at] = [0.59, 0.88].map(|share| sure.iter().find(|it| it.2 >= share).unwrap().1);
    assert!((0.142..0.162 + 1e-9).contains(&(sure_at - move_at)), "{move_at} s, {sure_at} s");
}

/// Recordings of real robots, of which contacts are computed from shapes.
#[test]
fn contacts_from_shapes_are_those_of_the_whole_log() {
    let mut tasks = 0;
    for (log, binding) in SHIPPED {
        let binding = format!("demos/{binding}.binding.yaml");
        let bound = Log::options().binding(&binding).open(format!("demos/{log}")).unwrap();
        let rules = Rules::for_log(&bound).unwrap();
        let recording = open(&OpenRequest {
            log: format!("demos/{log}").into(),
            binding: Some(binding.into()),
            ..OpenRequest::default()
        });
        let rows = Rows::of(&recording.unwrap().recording);
        let whole_log = rows.log();
        // A log that has to be mended is mended otherwise while it is being made.
        let analysis = rules.analyze(&whole_log).unwrap();
        let mended = ["impossible_jump", "stuck_sensor", "not_a_number", "gap", "missing_row", "uneven_step"];
        if analysis.issues().iter().any(|issue| mended.contains(&issue.kind.name())) {
            continue;
        }
        let calibration = Calibration::of_whole(&whole_log, &rules).unwrap();
        let [before, after] = events(&rows, &rules, &calibration);
        assert_eq!(reported(before.iter().chain(&after)), whole(&analysis), "{log}");
        tasks += analysis.tasks().len();
    }
    assert!(tasks >= 5, "only {tasks} tasks were compared");
}

/// Simulated demonstrations without their contacts, which are then computed from shapes and from forces with noise.
#[test]
fn contacts_from_shapes_and_noisy_forces_are_those_of_the_whole_log() {
    let mut tasks = 0;
    for name in ["pick_and_press", "several_tasks", "equal_carry"] {
        let rows = without_contacts(name);
        let log = rows.log();
        let rules = Rules::for_log(&log).unwrap();
        let calibration = Calibration::of_whole(&log, &rules).unwrap();
        let [before, after] = events(&rows, &rules, &calibration);
        let analysis = rules.analyze(&log).unwrap();
        assert_eq!(reported(before.iter().chain(&after)), whole(&analysis), "{name}");
        tasks += analysis.tasks().len();
    }
    assert!(tasks >= 3, "only {tasks} tasks were compared");
}

/// A demonstration without its contacts, with noise on the forces of fingers.
pub fn without_contacts(name: &str) -> Rows {
    let mut recording = demonstration(name);
    recording.columns.retain(|column, _| !column.starts_with("contact."));
    // A sequence that fills an interval evenly.
    let noise = |at: usize| 2.0 * (at as f64 * 0.618_033_988_749_894_9).fract() - 1.0;
    for (seed, (name, column)) in recording.columns.iter_mut().enumerate() {
        if name.contains(".force.") {
            column.values.iter_mut().enumerate().for_each(|(at, value)| *value += 0.02 * noise(at * 31 + seed * 7));
        }
    }
    Rows::of(&recording)
}

#[test]
fn lines_of_json_and_csv_are_labeled() {
    let recording = demonstration("pick_and_place");
    let rows = Rows::of(&recording);
    let mut csv = format!("{}\n", rows.titles.join(","));
    let mut json = format!("{}\n", serde_json::json!({ "scene": recording.scene }));
    for row in &rows.rows {
        let cells: Vec<String> = row.iter().map(f64::to_string).collect();
        csv += &format!("{}\n", cells.join(","));
        let object: serde_json::Map<String, serde_json::Value> =
            rows.titles.iter().cloned().zip(row.iter().map(|value| serde_json::json!(value))).collect();
        json += &format!("{}\n", serde_json::Value::Object(object));
    }
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("cell.scene.yaml");
    std::fs::write(&scene, serde_json::to_string(&recording.scene).unwrap()).unwrap();
    let scene = scene.display().to_string();
    let of_csv = said(&teachtree_fed(&["live", "-", "--scene", &scene, "--no-labels"], csv.as_bytes()));
    let of_json = said(&teachtree_fed(&["live", "-", "--no-labels"], json.as_bytes()));
    assert_eq!(of_csv, of_json);
    insta::assert_snapshot!(of_csv);
    let sure = said(&teachtree_fed(&["live", "-", "--confidence"], json.as_bytes()));
    let sure: Vec<&str> = sure.lines().filter(|line| line.starts_with("now")).collect();
    insta::assert_snapshot!("labels_with_confidence", sure[..12].join("\n"));
    let lines = said(&teachtree_fed(&["live", "-", "--format", "json"], json.as_bytes()));
    let events: Vec<serde_json::Value> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert!(events.iter().all(|event| event["schema"] == "teachtree.live/1"));
    insta::assert_snapshot!(
        lines.lines().filter(|line| line.contains("\"final\": true")).collect::<Vec<_>>().join("\n")
    );
}
