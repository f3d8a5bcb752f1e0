//! `cargo bench --bench engine`: the compiled rules against the same job written by hand, in the same run, on one core.
//!
//! Each figure is the median of several rounds in which all take their turn; labels are compared frame by frame.
#![allow(missing_docs, reason = "a program")]
#![allow(
    clippy::print_stdout,
    clippy::expect_used,
    clippy::panic,
    reason = "a program that stops when something is wrong"
)]

#[path = "job/by_hand.rs"]
mod by_hand;
#[path = "job/data.rs"]
mod data;
mod shipped;
mod streaming;

use by_hand::{LABELS, Runs};
use std::collections::BTreeMap;
use std::hint::black_box;
use std::time::Instant;
use teachtree::base::hands::{Finger, Side};
use teachtree::engine::evaluator::evaluate;
use teachtree::graph::{Graph, lower};
use teachtree::language;
use teachtree::language::rules::Rules;
use teachtree::stream::frames::{Column, ColumnKey, Frames, HandLayout, Layout};

const FRAMES: usize = 1_000_000;
const ROUNDS: usize = 7;

/// A name and what it does.
type Contestant<'a> = (&'static str, Box<dyn Fn() -> Runs + 'a>);

fn main() {
    shipped();
    if std::env::args().any(|arg| arg == "shipped") {
        return;
    }
    let rows = data::rows(FRAMES, 1);
    let wide: Vec<[f64; data::CHANNELS]> = rows.iter().map(|row| row.map(f64::from)).collect();
    let narrow = data::columns::<f32>(&rows);
    let columns = data::columns::<f64>(&rows);

    let loaded = language::load_text("job.rules", include_str!("job/job.rules"));
    let rules = loaded.rules.expect("the job's rules are right");
    let graph = lower(&rules);
    let (frames_wide, frames_narrow) = (frames(&rules, &columns), frames(&rules, &narrow));

    let truth = by_hand::in_rows(&wide);
    let contestants: Vec<Contestant> = vec![
        ("row loop, f64", Box::new(|| by_hand::in_rows(&wide))),
        ("row loop, f32", Box::new(|| by_hand::in_rows(&rows))),
        ("blocks of columns by an expert, f64", Box::new(|| by_hand::in_blocks(&columns))),
        ("blocks of columns by an expert, f32", Box::new(|| by_hand::in_blocks(&narrow))),
        ("rules, f64", Box::new(|| by_rules(&graph, &frames_wide))),
        ("rules, f32", Box::new(|| by_rules(&graph, &frames_narrow))),
    ];
    let mut times: Vec<Vec<f64>> = vec![Vec::new(); contestants.len()];
    for round in 0..=ROUNDS {
        for ((name, run), times) in contestants.iter().zip(&mut times) {
            let start = Instant::now();
            let runs = black_box(run());
            let took = start.elapsed().as_secs_f64();
            if round > 0 {
                times.push(took);
            } else {
                println!("{name}: {} frames of {FRAMES} labelled otherwise", differing(&runs, &truth));
            }
        }
    }
    let speeds: Vec<f64> = times.iter_mut().map(|times| FRAMES as f64 / median(times)).collect();
    println!(
        "\n{:<38} {:>14} {:>16} {:>16}",
        "one core, twelve predicates", "frames/s", "to the row loop", "to the expert"
    );
    for ((name, _), speed) in contestants.iter().zip(&speeds) {
        println!("{name:<38} {:>12.1} M {:>16.2} {:>16.2}", speed / 1e6, speed / speeds[1], speed / speeds[3]);
    }
}

fn shipped() {
    for (rules, scene) in [
        ("rules/contact.rules", "pick_and_press"),
        ("rules/bimanual.rules", "hand_over_left_to_right"),
        ("rules/bimanual.rules", "hold_and_insert"),
    ] {
        let job = shipped::Shipped::new(rules, scene, 100_000);
        let mut times: Vec<f64> = (0..5)
            .map(|_| {
                let start = Instant::now();
                black_box(job.run());
                start.elapsed().as_secs_f64()
            })
            .collect();
        let frames = streaming::times(&job);
        let at = |share: f64| frames[((frames.len() - 1) as f64 * share) as usize];
        println!("streaming: median {} ns, 99.9 % {} ns", at(0.5), at(0.999));
        println!("{rules} {scene} {:.2} M", job.frames.len as f64 / median(&mut times) / 1e6);
    }
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn differing(runs: &Runs, truth: &Runs) -> usize {
    let labels = |runs: &Runs| -> Vec<u8> { runs.iter().flat_map(|(label, frames)| vec![*label; *frames]).collect() };
    let (runs, truth) = (labels(runs), labels(truth));
    runs.len().abs_diff(truth.len()) + runs.iter().zip(&truth).filter(|(found, wanted)| found != wanted).count()
}

fn by_rules(graph: &Graph, frames: &Frames) -> Runs {
    let leaves = evaluate(graph, frames).expect("the rate suits the rules");
    let hand = leaves.iter().flat_map(|leaves| &leaves.hands[&Side::Right]);
    hand.map(|run| {
        let name = run.label.map_or("", |label| graph.label_name(label));
        let at = LABELS.iter().position(|label| *label == name).unwrap_or_else(|| panic!("unknown label {name}"));
        (at as u8, run.end - run.start)
    })
    .collect()
}

/// The job's columns under the names that the rules know.
fn frames<T: Clone>(rules: &Rules, columns: &[Vec<T>]) -> Frames
where
    Column: From<Vec<T>>,
{
    let layout = Layout {
        rate_hz: 1000.0,
        hands: vec![HandLayout {
            side: Side::Right,
            fingers: vec![Finger::Thumb, Finger::Index, Finger::Middle, Finger::Ring, Finger::Little],
            contacts: vec![],
        }],
    };
    let len = columns[0].len();
    let mut named = BTreeMap::new();
    for (channel, spec) in rules.channels.iter().enumerate() {
        let places: Vec<(u32, usize)> = match spec.name.as_str() {
            "target.position" => vec![(0, 0)],
            "target.velocity" => vec![(0, 7)],
            "target.angular_velocity" => vec![(0, 10)],
            "floor.flag" => vec![(0, 43)],
            "wall.flag" => vec![(0, 44)],
            "fingers.position" => (0..5).map(|slot| (slot, 13 + 6 * slot as usize)).collect(),
            "fingers.force" => (0..5).map(|slot| (slot, 16 + 6 * slot as usize)).collect(),
            // Read by no rule of the job.
            _ => vec![],
        };
        for (slot, first) in places {
            for component in 0..spec.shape.components().len() {
                let key =
                    ColumnKey { channel: channel as u32, side: Some(Side::Right), slot, component: component as u32 };
                named.insert(key, columns[first + component].clone().into());
            }
        }
    }
    Frames {
        layout,
        channels: rules.channels.clone(),
        columns: named,
        len,
        time: (0..len).map(|frame| frame as f64 / 1000.0).collect(),
        stretches: std::iter::once(0..len).collect(),
        objects: vec![],
        issues: vec![],
    }
}
