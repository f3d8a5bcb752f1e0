//! One damaged cell of a recording is reported, or changes nothing that is found in it.

use std::fmt::Write as _;
use std::path::Path;
use teachtree_analysis as analysis;
use teachtree_base::recording::Recording;
use teachtree_engine::evaluator::evaluate;
use teachtree_frames::OpenRequest;
use teachtree_frames::open;
use teachtree_language::graph::{Graph, lower};
use teachtree_language::{Request, Rules, load};
use teachtree_logs::issue::Issue;
use teachtree_logs::read::formats;
use teachtree_world::{shipped, teach};

/// The shipped rules of one hand.
struct Program {
    rules: Rules,
    graph: Graph,
}

/// What is found in a recording: the primitives and tasks of each track, and the issues.
#[derive(Clone, PartialEq)]
struct RecordingLabels {
    labels: Vec<(Vec<String>, Vec<String>)>,
    issues: Vec<Issue>,
}

impl Program {
    fn new() -> Self {
        let rules = load(&Request { needs_tree: true, ..Request::default() }).rules.unwrap();
        let graph = lower(&rules);
        Self { rules, graph }
    }

    /// Writes a recording, opens it and runs the rules; `None` when it is refused.
    fn run(&self, folder: &Path, recording: &Recording) -> Option<RecordingLabels> {
        let log = folder.join("log.parquet");
        formats::write(recording, &log).unwrap();
        let opened = open(&OpenRequest { log, ..OpenRequest::default() }).ok()?;
        let frames = opened.frames(&analysis::channels(&self.rules)).ok()?;
        let leaves = evaluate(&self.graph, &frames).unwrap();
        let found = analysis::analyze(&self.rules, &frames, &leaves);
        let labels = found.tracks.iter().map(|track| {
            let segments = track.relabeled.iter().map(|segment| segment.primitive.clone()).collect();
            (segments, track.tasks.iter().map(|task| task.task.clone()).collect())
        });
        Some(RecordingLabels { labels: labels.collect(), issues: frames.issues })
    }
}

/// Numbers that look random and are the same each time (SplitMix64).
struct SplitMix64(u64);

impl SplitMix64 {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) % end as u64) as usize
    }
}

/// How many cells were damaged, and what came of it.
#[derive(Debug, Default, PartialEq)]
struct Counts {
    refused: usize,
    reported: usize,
    without_effect: usize,
    /// Sequences that changed without an issue: what was damaged, and the new sequence.
    silent: Vec<String>,
}

/// What a cell becomes: a decimal point that is lost or moved, a sign, nothing, the value of another row, no number.
fn damaged(numbers: &mut SplitMix64, values: &[f64], row: usize) -> (String, f64) {
    let value = values[row];
    match numbers.below(12) {
        kind @ 0..=6 => {
            let power = [1, 2, 3, 4, 6, -1, -3][kind];
            (format!("times 1e{power}"), value * 10f64.powi(power))
        }
        7 | 8 => ("turned".into(), -value),
        9 => ("zero".into(), 0.0),
        10 => ("of another row".into(), values[numbers.below(values.len())]),
        _ => ("no number".into(), f64::NAN),
    }
}

/// Damages a number of cells of a recording, one at a time, in columns whose names end as given.
fn campaign(program: &Program, plain: &Recording, cells: usize, seed: u64, only: &str) -> Counts {
    let folder = tempfile::tempdir().unwrap();
    let wanted = program.run(folder.path(), plain).unwrap();
    let (mut counts, mut numbers) = (Counts::default(), SplitMix64(seed));
    let columns: Vec<usize> = (0..plain.columns.len())
        .filter(|at| plain.columns.get_index(*at).unwrap().0.contains(only))
        .filter(|at| plain.columns[*at].values.iter().any(|value| *value != plain.columns[*at].values[0]))
        .collect();
    let mut recording = plain.clone();
    let mut left = cells;
    while left > 0 {
        let column = columns[numbers.below(columns.len())];
        let row = numbers.below(plain.time.len());
        let was = plain.columns[column].values[row];
        let (what, value) = damaged(&mut numbers, &plain.columns[column].values, row);
        if value.to_bits() == was.to_bits() || value == was {
            continue;
        }
        left -= 1;
        recording.columns[column].values[row] = value;
        let found = program.run(folder.path(), &recording);
        recording.columns[column].values[row] = was;
        match found {
            None => counts.refused += 1,
            Some(found) if found.issues != wanted.issues => counts.reported += 1,
            Some(found) if found.labels == wanted.labels => counts.without_effect += 1,
            Some(found) => {
                let (name, _) = plain.columns.get_index(column).unwrap();
                let mut text = format!("{name} at {} s {what}: {was} became {value}: ", plain.time[row]);
                let _ = write!(text, "{:?}", found.labels);
                counts.silent.push(text);
            }
        }
    }
    counts
}

fn taught(name: &str) -> Recording {
    teach(&shipped::scene(name).unwrap(), &shipped::operator(name).unwrap(), 1).unwrap()
}

#[test]
fn a_damaged_cell_is_reported_or_changes_nothing() {
    let program = Program::new();
    for (name, seed) in [("peg_in_hole", 1), ("pick_and_place", 2)] {
        let plain = taught(name);
        for only in ["", "velocity", "contact."] {
            let counts = campaign(&program, &plain, 16, seed, only);
            assert!(counts.silent.is_empty(), "{name}: {}", counts.silent.join("\n"));
            assert!(counts.reported > 0, "{name} {only}: {counts:?}");
        }
    }
}

#[test]
#[ignore = "minutes: `cargo test -p teachtree-analysis -- --ignored --nocapture damaged_cells`"]
fn damaged_cells_of_many_recordings() {
    let program = Program::new();
    let cells = std::env::var("CELLS").map_or(500, |text| text.parse().unwrap());
    let only = std::env::var("ONLY").unwrap_or_default();
    for name in ["peg_in_hole", "turn_screw", "pick_and_place", "slide", "several_tasks"] {
        let counts = campaign(&program, &taught(name), cells, 1, &only);
        let mut report = format!(
            "{name}: {cells} cells, {} refused, {} reported, {} without effect, {} silent\n",
            counts.refused,
            counts.reported,
            counts.without_effect,
            counts.silent.len()
        );
        counts.silent.iter().for_each(|text| report += &format!("  {text}\n"));
        std::io::Write::write_all(&mut std::io::stderr(), report.as_bytes()).unwrap();
    }
}
