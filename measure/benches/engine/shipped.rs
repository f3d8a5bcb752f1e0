//! The shipped rules on repeated recordings of shipped scenes.

pub mod baseline;
mod rows;

use crate::job::{self, differing, runs_by_rules};
use crate::timing::{Contestant, TargetFigure, figure, heading, race};
use baseline::LABELS;
use rows::rows;
use std::hint::black_box;
use teachtree_base::hands::Finger;
use teachtree_engine::evaluator::evaluate;
use teachtree_frames::frames::Frames;
use teachtree_language::graph::{Graph, lower};
use teachtree_language::{self as language, Request};
use teachtree_report as report;
use teachtree_world::{shipped, teach};

/// Scenes with one hand.
const ONE_HAND: [&str; 4] = ["pick_and_press", "peg_in_hole", "push_and_trace", "pick_and_follow"];
/// Scenes with two hands.
pub const TWO_HANDS: [&str; 2] = ["hand_over_left_to_right", "hold_and_insert"];
/// The largest number of bodies that a scene's target may touch. (Four suffice for some, but the compiler's code for five is faster.)
const CONTACTS: usize = 5;
/// Most scenes with one hand use three fingers; the others are present and idle.
const FINGERS: [Finger; 5] = [Finger::Thumb, Finger::Index, Finger::Middle, Finger::Ring, Finger::Little];
const FRAMES: usize = 200_000;
/// The number of frames beside the job: the same as the job's.
const FRAMES_TWO_HANDS: usize = 1_000_000;
const ROUNDS: usize = 15;

/// Compiled rules, and a log of at least the given number of frames without a gap.
pub struct RulesOnLog {
    pub graph: Graph,
    pub frames: Frames,
}

impl RulesOnLog {
    /// Records a scene with hands of five fingers and repeats it.
    pub fn new(rules: &str, scene: &str, frames: usize) -> Self {
        let request = Request { files: vec![rules.into()], needs_tree: true, ..Request::default() };
        let rules = language::load(&request).rules.expect("shipped rules are right");
        let (mut scene, operator) =
            (shipped::scene(scene).expect("shipped"), shipped::operator(scene).expect("shipped"));
        for hand in scene.hands.values_mut() {
            hand.fingers = FINGERS.to_vec();
        }
        let recording = teach(&scene, &operator, 1).expect("it can be taught");
        let log = teachtree_frames::frames(&recording, &report::channels(&rules)).expect("all channels are there");
        Self { graph: lower(&rules), frames: repeated(&log, frames) }
    }

    pub fn run(&self) {
        drop(black_box(evaluate(&self.graph, &self.frames).expect("1 kHz suits the rules")));
    }
}

/// Repeats a log without a gap, with numbers as a sensor of 32 bits gives them, which the rows have too.
fn repeated(log: &Frames, frames: usize) -> Frames {
    let times = frames.div_ceil(log.len);
    let column = |values: &[f64]| values.iter().map(|v| f64::from(*v as f32)).collect::<Vec<f64>>().repeat(times);
    let len = times * log.len;
    Frames {
        columns: log.columns.iter().map(|(key, values)| (*key, column(values))).collect(),
        len,
        time: (0..len).map(|frame| frame as f64 / log.layout.rate_hz).collect(),
        stretches: std::iter::once(0..len).collect(),
        ..log.clone()
    }
}

/// Compares `single_hand.rules` and `contact.rules` with their translation.
pub fn one_hand() {
    heading(&format!("single_hand.rules and contact.rules against their translation by hand, {FRAMES} frames a scene"));
    for scene in ONE_HAND {
        let job = RulesOnLog::new("rules/contact.rules", scene, FRAMES);
        against_by_hand(scene, &job);
    }
}

fn against_by_hand(scene: &str, job: &RulesOnLog) {
    let rows = rows::<CONTACTS>(&job.frames).expect("no scene has more bodies to touch");
    let [narrow, wide] = [baseline::in_rows::<f32, CONTACTS>(&rows), baseline::in_rows::<f64, CONTACTS>(&rows)];
    let by_rules = runs_by_rules(&job.graph, &job.frames, &LABELS);
    let kinds = by_rules.iter().fold(0_u32, |kinds, (label, _)| kinds | 1 << label).count_ones();
    let printed = |what: &str| format!("{scene}: {what}");
    figure(&printed("kinds of leaves"), f64::from(kinds), "", TargetFigure::Nothing);
    figure(&printed("runs of leaves"), by_rules.len() as f64, "", TargetFigure::Nothing);
    let [narrow, wide] = [narrow, wide].map(|runs| differing(&runs, &by_rules) as f64);
    figure(&printed("frames labeled otherwise by hand, f64"), wide, "", TargetFigure::AtMost(0.0));
    figure(&printed("frames labeled otherwise by hand, f32"), narrow, "", TargetFigure::AtMost(0.0));
    let speeds: Vec<f64> = race(
        ROUNDS,
        &mut [
            Contestant::new("by hand, f64", || drop(black_box(baseline::in_rows::<f64, CONTACTS>(&rows)))),
            Contestant::new("by hand, f32", || drop(black_box(baseline::in_rows::<f32, CONTACTS>(&rows)))),
            Contestant::new("rules", || job.run()),
        ],
    )
    .into_iter()
    .map(|time| job.frames.len as f64 / time / 1e6)
    .collect();
    let [wide, narrow, rules] = [speeds[0], speeds[1], speeds[2]];
    figure(&printed("by hand, arithmetic in f64"), wide, "M frames/s", TargetFigure::Nothing);
    figure(&printed("by hand, arithmetic in f32"), narrow, "M frames/s", TargetFigure::Nothing);
    figure(&printed("rules"), rules, "M frames/s", TargetFigure::Nothing);
    figure(&printed("rules to the one by hand, f64"), rules / wide, "", TargetFigure::AtLeast(0.6));
}

/// Compares all three rule files with two hands with the row loop of the job with twelve predicates.
pub fn two_hands() {
    heading(&format!("all three rule files with two hands, {FRAMES_TWO_HANDS} frames a scene"));
    let rows = job::data::rows(FRAMES_TWO_HANDS, 1);
    let wide: Vec<[f64; job::data::CHANNELS]> = rows.iter().map(|row| row.map(f64::from)).collect();
    let jobs = TWO_HANDS.map(|scene| RulesOnLog::new("rules/bimanual.rules", scene, FRAMES_TWO_HANDS));
    let mut contestants = vec![
        Contestant::new("row loop of twelve predicates, f32", || drop(black_box(job::baseline::in_rows(&rows)))),
        Contestant::new("row loop of twelve predicates, f64", || drop(black_box(job::baseline::in_rows(&wide)))),
    ];
    contestants.extend(TWO_HANDS.iter().zip(&jobs).map(|(scene, job)| Contestant::new(*scene, || job.run())));
    let times = race(ROUNDS, &mut contestants);
    let frames = [rows.len(), wide.len()].into_iter().chain(jobs.iter().map(|job| job.frames.len));
    let speeds: Vec<f64> = frames.zip(times).map(|(frames, time)| frames as f64 / time / 1e6).collect();
    for (contestant, speed) in contestants.iter().zip(&speeds) {
        figure(&contestant.name, *speed, "M frames/s", TargetFigure::Nothing);
    }
    for (scene, speed) in TWO_HANDS.iter().zip(&speeds[2..]) {
        let wanted = TargetFigure::AtLeast((1.0_f64 / 3.0 * 1000.0).floor() / 1000.0);
        figure(&format!("{scene} to the row loop, f32"), speed / speeds[0], "", TargetFigure::Nothing);
        figure(&format!("{scene} to the row loop, f64"), speed / speeds[1], "", wanted);
    }
}
