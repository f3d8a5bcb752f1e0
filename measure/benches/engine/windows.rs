//! The cost of windows and conditions: a window of one second costs as much as one of 20 ms, the cost of conditions is proportional to their number,
//! and a rule that shares a condition costs nothing.

use crate::job;
use crate::timing::{Contestant, TargetFigure, figure, heading, race};
use std::fmt::Write;
use std::hint::black_box;
use teachtree_engine::evaluator::Evaluator;
use teachtree_frames::frames::Frames;
use teachtree_language as language;
use teachtree_language::graph::lower;

const FRAMES: usize = 500_000;
const ROUNDS: usize = 11;
const WINDOWS: [&str; 2] = ["20 ms", "1 s"];
const CONDITIONS: [usize; 4] = [10, 20, 40, 80];
const SHARING: [usize; 3] = [1, 10, 100];

/// Each operator with a window, on quantities that cross their thresholds frequently, all in one tree.
const OPERATORS: [(&str, &str); 10] = [
    ("for", "(pressed) for window"),
    ("within last", "(pressed) within last window"),
    ("within next", "(pressed) within next window"),
    ("rate", "rate(target.position.z, window) < -5 mm/s"),
    ("mean", "mean(target.velocity.z over last window) < -5 mm/s"),
    ("max", "max(norm(target.velocity) over last window) > 100 mm/s"),
    ("integral", "norm(integral(target.velocity over last window)) > 5 mm"),
    ("earliest", "norm(target.position - earliest(target.position over last window)) > 5 mm"),
    ("since", "norm(target.position - earliest(target.position since pressed)) > 5 mm"),
    ("a latch of `for`", "moved"),
];

/// Rules that test conditions in turn, with a window.
fn windowed(conditions: &[&str], window: &str) -> String {
    let mut rules = format!(
        "stream {{ for each hand {{ fingers.force : vec3 N per finger }} }}
primitive Idle, One, Other
param window = {window} in 1 ms .. 2 s
for each hand {{
  signal pressed = norm(sum(fingers.force)) above 0.5 N until below 0.3 N
  signal moving  = norm(target.velocity) above 20 mm/s until below 10 mm/s
  latch moved set (moving) for window clear (not moving) for window
}}
tree windows for each hand {{\n  pressed and moving => One\n"
    );
    for condition in conditions {
        let _ = writeln!(rules, "  {condition} => Other");
    }
    rules + "  else => Idle\n}\n"
}

struct Job {
    /// The state before the first frame.
    evaluator: Evaluator,
    frames: Frames,
}

impl Job {
    fn new(rules: &str, columns: &[Vec<f64>]) -> Self {
        let loaded = language::load_text("windows.rules", rules);
        let rules = loaded.rules.unwrap_or_else(|| panic!("{:#?}", loaded.diagnostics));
        let frames = job::frames(&rules, columns);
        Self { evaluator: Evaluator::new(&lower(&rules), &frames.layout).expect("1 kHz suits the rules"), frames }
    }

    /// Returns the number of runs of leaves.
    fn run(&self) -> usize {
        let (mut evaluator, mut runs) = (self.evaluator.clone(), 0);
        let inputs = evaluator.plan().inputs.clone();
        let columns: Vec<&[f64]> = inputs.iter().map(|key| self.frames.column(*key).unwrap_or(&[])).collect();
        evaluator.push(&columns, 0, self.frames.len, &mut |_, _| runs += 1);
        evaluator.finish(&mut |_, _| runs += 1);
        runs
    }
}

/// Returns the time per frame of each candidate, ns.
fn race_of(jobs: &[Job]) -> Vec<f64> {
    let mut contestants: Vec<Contestant> =
        jobs.iter().map(|job| Contestant::new("", || _ = black_box(job.run()))).collect();
    race(ROUNDS, &mut contestants).into_iter().map(|time| time / FRAMES as f64 * 1e9).collect()
}

pub fn section() {
    let columns = job::data::columns::<f64>(&job::data::rows(FRAMES, 1));

    heading("windows: the same rules with short and with long ones");
    let all: Vec<&str> = OPERATORS.iter().map(|(_, condition)| *condition).collect();
    let each = OPERATORS.iter().map(|(name, condition)| (*name, vec![*condition]));
    for (name, conditions) in each.chain([("all of them", all)]) {
        let jobs = WINDOWS.map(|window| Job::new(&windowed(&conditions, window), &columns));
        let times = race_of(&jobs);
        for ((window, time), job) in WINDOWS.iter().zip(&times).zip(&jobs) {
            figure(
                &format!("{name}, {window}: {} runs of leaves", job.run()),
                *time,
                "ns/frame",
                TargetFigure::Nothing,
            );
        }
        let wanted = if conditions.len() > 1 { TargetFigure::AtMost(1.1) } else { TargetFigure::Nothing };
        figure(&format!("{name}: long to short"), times[1] / times[0], "", wanted);
    }

    heading("distinct conditions, each with its own threshold and window");
    let jobs = CONDITIONS.map(|count| Job::new(&distinct(count), &columns));
    let times = race_of(&jobs);
    for (count, time) in CONDITIONS.iter().zip(&times) {
        figure(&format!("{count} conditions"), *time, "ns/frame", TargetFigure::Nothing);
    }
    let condition = (times[3] - times[0]) / (CONDITIONS[3] - CONDITIONS[0]) as f64;
    figure("one more condition", condition, "ns/frame", TargetFigure::Nothing);
    figure("80 conditions to twice 40", times[3] / (2.0 * times[2]), "", TargetFigure::AtMost(1.1));

    heading("rules that share one condition with memory, written out in each of them");
    let jobs = SHARING.map(|rules| Job::new(&sharing(rules), &columns));
    let times = race_of(&jobs);
    for ((rules, time), job) in SHARING.iter().zip(&times).zip(&jobs) {
        figure(&format!("{rules} rules, {} runs of leaves", job.run()), *time, "ns/frame", TargetFigure::Nothing);
    }
    // Rules have a cost on the few frames on which the label changes.
    let rule = (times[2] - times[0]) / (SHARING[2] - SHARING[0]) as f64;
    figure("one more rule that shares it, to one more condition", rule / condition, "", TargetFigure::AtMost(0.1));
}

/// Returns a tree with the given number of conditions, one after the other. Thresholds and windows are all different, but so similar that all
/// conditions change about equally often.
fn distinct(count: usize) -> String {
    let mut rules = String::from("primitive Idle, Up, Down\nfor each hand {\n");
    for at in 0..count {
        let (speed, time) = (30.0 + 0.01 * at as f64, 20 + at % 7);
        let _ = writeln!(rules, "  signal c{at} = (target.velocity.z > {speed} mm/s) for {time} ms");
    }
    rules.push_str("}\ntree conditions for each hand {\n");
    for at in 0..count {
        let _ = writeln!(rules, "  c{at} => {}", if at % 2 == 0 { "Up" } else { "Down" });
    }
    rules + "  else => Idle\n}\n"
}

/// Returns a tree with the given number of rules whose label advances by one whenever one condition becomes true.
fn sharing(count: usize) -> String {
    let labels: Vec<String> = (0..=count).map(|at| format!("P{at}")).collect();
    let mut rules = format!("primitive {}\ntree shared for each hand {{\n  from(none) => P0\n", labels.join(", "));
    for at in 0..count {
        let shared = "rises((norm(target.velocity) above 20 mm/s until below 10 mm/s) for 20 ms)";
        let _ = writeln!(rules, "  {shared} and from(P{at}) => P{}", at + 1);
    }
    let _ = writeln!(rules, "  rises((norm(target.velocity) above 20 mm/s until below 10 mm/s) for 20 ms) => P0");
    rules + "  else => stay\n}\n"
}
