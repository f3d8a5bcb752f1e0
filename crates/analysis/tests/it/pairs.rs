//! Checks the results of `prove additive` and `diff` for whole rule sets against analyses of random recordings. The rule sets contain all kinds of
//! declarations, and one of them extends or changes the other. A pair that contradicts a proof is minimized before it is printed.

mod recordings;
mod texts;

use crate::numbers::Random;
use rayon::prelude::*;
use recordings::{RecordingPart, recording};
use std::fmt::Write;
use teachtree_analysis::{Track, TrackId, analyze, channels, check_rate};
use teachtree_engine::evaluator::evaluate;
use teachtree_engine::runs::{Leaves, Run};
use teachtree_frames as stream;
use teachtree_frames::frames::Frames;
use teachtree_language::graph::compare::{declarations, differences, prove_extension};
use teachtree_language::graph::lower;
use teachtree_language::load_text;
use teachtree_language::rules::{Label, Rules};
use texts::{Pair, pair};

/// Number of recordings.
const RECORDINGS: u64 = 40;

/// The results for a number of pairs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct PairCounts {
    pairs: usize,
    proved: usize,
    same: usize,
    /// Number of analyses of a recording by a proved pair, and number of those with an interval without a new primitive.
    runs: usize,
    without_new: usize,
}

impl PairCounts {
    fn plus(self, other: Self) -> Self {
        Self {
            pairs: self.pairs + other.pairs,
            proved: self.proved + other.proved,
            same: self.same + other.same,
            runs: self.runs + other.runs,
            without_new: self.without_new + other.without_new,
        }
    }
}

#[test]
fn proofs_for_whole_rule_sets_hold_on_recordings() {
    let count = of_seeds(0, 500, 3);
    // Both answers must occur, and some recordings must be able to contradict a proof.
    let PairCounts { pairs, proved, without_new, .. } = count;
    assert!(pairs == 500 && (80..450).contains(&proved) && without_new > 200, "{count:?}");
}

/// Checks `PAIRS` pairs from `SEED` on, on all cores.
#[test]
#[ignore = "minutes: `PAIRS=100000 cargo test --release -p teachtree-analysis -- --ignored --nocapture many_pairs`"]
fn many_pairs_of_rule_sets_hold_on_recordings() {
    let number = |name: &str, default: u64| std::env::var(name).map_or(default, |text| text.parse().unwrap());
    let PairCounts { pairs, proved, same, runs, without_new } = of_seeds(number("SEED", 0), number("PAIRS", 10_000), 6);
    let report = format!(
        "{pairs} pairs of rule sets: {proved} proved to only add, {same} said not to differ; of {runs} analyses of these by both, \
         {without_new} have stretches without a new primitive; none says otherwise\n"
    );
    std::io::Write::write_all(&mut std::io::stderr(), report.as_bytes()).unwrap();
}

fn of_seeds(first: u64, pairs: u64, recordings: u64) -> PairCounts {
    let all = (first..first + pairs).into_par_iter().map(|seed| checked(seed, recordings));
    all.reduce(PairCounts::default, PairCounts::plus)
}

/// Fails if the analyses of a recording contradict the proof for a pair of rule sets.
fn checked(seed: u64, recordings: u64) -> PairCounts {
    let mut random = Random::new(seed.wrapping_mul(0x5851_F42D_4C95_7F2D));
    let mut loaded = None;
    while loaded.is_none() {
        let pair = pair(&mut random);
        loaded = pair.loaded().map(|rules| (pair, rules));
    }
    let (pair, (base, extended)) = loaded.unwrap();
    let said = PairVerdict::of(&base, &extended);
    let mut count =
        PairCounts { pairs: 1, proved: usize::from(said.adds), same: usize::from(said.same), ..PairCounts::default() };
    if !said.adds && !said.same {
        return count;
    }
    for _ in 0..recordings {
        let cut = RecordingPart::whole(random.below(RECORDINGS as usize) as u64);
        match contradiction(&base, &extended, &cut) {
            Ok(without_new) => {
                count.runs += 1;
                count.without_new += usize::from(without_new);
            }
            Err(_) => {
                let (pair, cut) = smaller(pair, cut);
                let (base, extended) = pair.loaded().unwrap();
                let said = PairVerdict::of(&base, &extended);
                panic!(
                    "seed {seed}: {said:?}\n{pair}\n{cut:?}\n{}",
                    contradiction(&base, &extended, &cut).unwrap_err()
                );
            }
        }
    }
    count
}

/// The results for a pair without a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
struct PairVerdict {
    /// Whether `prove additive` proves the pair.
    adds: bool,
    /// Whether `diff` lists no difference.
    same: bool,
}

impl PairVerdict {
    fn of(base: &Rules, extended: &Rules) -> Self {
        let trees = differences(base, extended);
        let same = trees.differences.is_empty() && trees.alone.is_empty() && !trees.is_cut;
        Self {
            adds: prove_extension(base, extended).is_proved(),
            same: same && declarations(base, extended).is_empty(),
        }
    }
}

/// Minimizes a pair and a recording that contradict each other.
fn smaller(mut pair: Pair, mut cut: RecordingPart) -> (Pair, RecordingPart) {
    let fails = |pair: &Pair, cut: &RecordingPart| {
        pair.loaded().is_some_and(|(base, extended)| {
            let said = PairVerdict::of(&base, &extended);
            (said.adds || said.same) && contradiction(&base, &extended, cut).is_err()
        })
    };
    loop {
        let shorter = pair.shorter().find(|shorter| fails(shorter, &cut));
        let Some(shorter) = shorter else { break };
        pair = shorter;
    }
    while let Some(shorter) = cut.shorter().into_iter().find(|shorter| fails(&pair, shorter)) {
        cut = shorter;
    }
    (pair, cut)
}

impl Pair {
    /// Loads both rule sets; `None` if one has an error.
    fn loaded(&self) -> Option<(Rules, Rules)> {
        let rules = |items: &[String]| load_text("pair.rules", &items.join("\n")).rules;
        Some((rules(&self.base)?, rules(&self.extended)?)).filter(|(base, _)| !base.trees.is_empty())
    }
}

/// Analyzes a recording by both rule sets. Returns whether an interval has no new primitive; the error describes an inadmissible difference.
fn contradiction(base: &Rules, extended: &Rules, cut: &RecordingPart) -> Result<bool, String> {
    let recording = recording(cut);
    let run = |rules: &Rules| -> Option<(Frames, Vec<Leaves>)> {
        let frames = stream::frames(&recording, &channels(rules)).ok()?;
        check_rate(rules, frames.layout.rate_hz).ok()?;
        let leaves = evaluate(&lower(rules), &frames).ok()?;
        Some((frames, leaves))
    };
    // Recordings that one of them refuses are not compared.
    let (Some((ours, our_leaves)), Some((theirs, their_leaves))) = (run(base), run(extended)) else { return Ok(false) };
    if ours.stretches != theirs.stretches {
        return Err(format!("stretches {:?} become {:?}", ours.stretches, theirs.stretches));
    }
    let mut without_new = false;
    for (one, other) in our_leaves.iter().zip(&their_leaves) {
        let is_new = |run: &&Run| {
            let primitive = run.label.and_then(|label| extended.primitives.get(label.primitive.index()));
            primitive.is_some_and(|primitive| base.primitive(&primitive.name).is_none())
        };
        let first_new = tracks(other).flatten().filter(is_new).map(|run| run.start).min();
        for frame in one.frames.start..first_new.unwrap_or(one.frames.end) {
            let (ours, theirs) = (names(base, one, frame), names(extended, other, frame));
            if ours != theirs {
                return Err(format!("frame {frame}: the leaves {ours:?} become {theirs:?}"));
            }
        }
        if first_new.is_some() {
            continue;
        }
        without_new = true;
        let analyzed = |rules: &Rules, frames: &Frames, leaves: &Leaves| {
            let mut tracks = analyze(rules, frames, std::slice::from_ref(leaves)).tracks;
            tracks.retain(|track| track.who != TrackId::Both || !track.segments.is_empty());
            tracks
        };
        let (ours, theirs) = (analyzed(base, &ours, one), analyzed(extended, &theirs, other));
        if ours != theirs {
            return Err(format!("without a new primitive\n{}becomes\n{}", shown(&ours), shown(&theirs)));
        }
    }
    Ok(without_new)
}

fn tracks(leaves: &Leaves) -> impl Iterator<Item = &Vec<Run>> {
    leaves.hands.values().chain([&leaves.both])
}

/// Returns the names of a frame's leaves. Without a tree over both hands, their leaf is `separate`.
fn names(rules: &Rules, leaves: &Leaves, frame: usize) -> Vec<String> {
    let label = |runs: &Vec<Run>| -> Option<Label> {
        runs.iter().find(|run| (run.start..run.end).contains(&frame)).and_then(|run| run.label)
    };
    tracks(leaves).map(|runs| label(runs).map_or("separate".into(), |label| rules.label_name(label))).collect()
}

fn shown(tracks: &[Track]) -> String {
    let mut text = String::new();
    for track in tracks {
        for (what, segments) in [("raw", &track.segments), ("relabeled", &track.relabeled)] {
            let all = segments.iter().map(|it| format!("{} {:?} {:?}", it.primitive, it.frames, it.by));
            let _ = writeln!(text, "  {} {what}: {}", track.who, all.collect::<Vec<_>>().join(", "));
        }
        for task in &track.tasks {
            let _ = writeln!(
                text,
                "  {} {:?} also {:?} {}-{}",
                task.task, task.frames, task.secondary, task.open_start, task.open_end
            );
        }
        for composite in &track.composites {
            let _ = writeln!(text, "  {} {:?}", composite.task, composite.tasks);
        }
    }
    text
}

/// Pairs with a known fault, as texts of the generator: none is proved.
#[test]
fn known_faults_are_not_proved() {
    for (base, more) in texts::FOUND {
        let items = |text: &str| text.lines().map(str::to_string).collect::<Vec<_>>();
        let (base, more) = (items(base), items(more));
        let extended = base.iter().chain(&more).cloned().collect();
        let pair = Pair { base, extended };
        let (base, extended) = pair.loaded().unwrap_or_else(|| panic!("{pair}"));
        assert!(!PairVerdict::of(&base, &extended).adds, "{pair}");
        let differs = (0..RECORDINGS).any(|seed| contradiction(&base, &extended, &RecordingPart::whole(seed)).is_err());
        assert!(differs, "no recording shows the fault\n{pair}");
    }
}
