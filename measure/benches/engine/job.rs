//! The job of the comparison: twelve predicates and a tree, as rules, as a hand-written row loop, and as an expert's blocks of columns.

pub mod baseline;
pub mod data;

use crate::timing::{Contestant, TargetFigure, figure, heading, race};
use baseline::{LABELS, Runs};
use std::collections::BTreeMap;
use std::hint::black_box;
use teachtree_base::hands::{Finger, Side};
use teachtree_engine::evaluator::evaluate;
use teachtree_frames::frames::{ColumnKey, Frames, HandLayout, Layout};
use teachtree_language as language;
use teachtree_language::graph::{Graph, lower};
use teachtree_language::rules::Rules;

const FRAMES: usize = 1_000_000;
const ROUNDS: usize = 7;

pub fn section() {
    let rows = data::rows(FRAMES, 1);
    let wide: Vec<[f64; data::CHANNELS]> = rows.iter().map(|row| row.map(f64::from)).collect();
    let narrow = data::columns::<f32>(&rows);
    let columns = data::columns::<f64>(&rows);

    let loaded = language::load_text("job.rules", include_str!("job/job.rules"));
    let rules = loaded.rules.expect("the job's rules are right");
    let graph = lower(&rules);
    let frames = frames(&rules, &columns);

    heading(&format!("twelve predicates and a tree, {FRAMES} frames, one core"));
    let truth = baseline::in_rows(&wide);
    let others = [
        baseline::in_rows(&rows),
        baseline::in_blocks(&columns),
        baseline::in_blocks(&narrow),
        by_rules(&graph, &frames),
    ];
    let differing: usize = others.iter().map(|runs| differing(runs, &truth)).sum();
    figure("frames labeled otherwise than by the row loop", differing as f64, "", TargetFigure::AtMost(0.0));

    let speeds: Vec<f64> = race(
        ROUNDS,
        &mut [
            Contestant::new("row loop, f64", || drop(black_box(baseline::in_rows(&wide)))),
            Contestant::new("row loop, f32", || drop(black_box(baseline::in_rows(&rows)))),
            Contestant::new("expert, f64", || drop(black_box(baseline::in_blocks(&columns)))),
            Contestant::new("expert, f32", || drop(black_box(baseline::in_blocks(&narrow)))),
            Contestant::new("rules", || drop(black_box(by_rules(&graph, &frames)))),
        ],
    )
    .into_iter()
    .map(|time| FRAMES as f64 / time / 1e6)
    .collect();
    for (at, bits) in ["f64", "f32"].into_iter().enumerate() {
        figure(&format!("row loop, {bits}"), speeds[at], "M frames/s", TargetFigure::Nothing);
        figure(&format!("blocks of columns by an expert, {bits}"), speeds[2 + at], "M frames/s", TargetFigure::Nothing);
    }
    figure("rules", speeds[4], "M frames/s", TargetFigure::Nothing);
    figure("rules to the row loop, f64", speeds[4] / speeds[0], "", TargetFigure::AtLeast(1.0));
    figure("rules to the expert, f64", speeds[4] / speeds[2], "", TargetFigure::AtLeast(0.8));
}

/// Returns the number of frames with different labels, or with a label in one of both only.
pub fn differing(runs: &Runs, truth: &Runs) -> usize {
    let labels = |runs: &Runs| -> Vec<u8> { runs.iter().flat_map(|(label, frames)| vec![*label; *frames]).collect() };
    let (runs, truth) = (labels(runs), labels(truth));
    runs.len().abs_diff(truth.len()) + runs.iter().zip(&truth).filter(|(found, wanted)| found != wanted).count()
}

/// Returns the leaves of the right hand, computed by rules, as positions in a list of names.
pub fn runs_by_rules(graph: &Graph, frames: &Frames, names: &[&str]) -> Runs {
    let leaves = evaluate(graph, frames).expect("the rate suits the rules");
    let hand = leaves.iter().flat_map(|leaves| &leaves.hands[&Side::Right]);
    hand.map(|run| {
        let name = run.label.map_or("", |label| graph.label_name(label));
        let at = names.iter().position(|label| *label == name).unwrap_or_else(|| panic!("unknown label {name}"));
        (at as u8, run.end - run.start)
    })
    .collect()
}

fn by_rules(graph: &Graph, frames: &Frames) -> Runs {
    runs_by_rules(graph, frames, &LABELS)
}

/// Maps the job's columns to channels.
pub fn frames(rules: &Rules, columns: &[Vec<f64>]) -> Frames {
    let layout = Layout {
        rate_hz: 1000.0,
        hands: vec![HandLayout {
            side: Side::Right,
            fingers: vec![Finger::Thumb, Finger::Index, Finger::Middle, Finger::Ring, Finger::Little],
            contacts: vec![],
            knows_distance: false,
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
            // No rule of the job reads this channel.
            _ => vec![],
        };
        for (slot, first) in places {
            for component in 0..spec.shape.components().len() {
                let key =
                    ColumnKey { channel: channel as u32, side: Some(Side::Right), slot, component: component as u32 };
                named.insert(key, columns[first + component].clone());
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
        ..Frames::default()
    }
}
