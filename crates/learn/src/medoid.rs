//! The medoid of models that were learned from parts of the recordings: the one that agrees most with the majority of them. Single recordings change it less
//! than they change a model that was learned from all.

use super::bank::{Bank, label};
use super::model::{Model, labels};
use super::objective::{Counts, Span, Truth};
use teachtree_engine::runs::{Run, append};

/// The number of models.
const MODELS: u64 = 5;
/// The percentage of the tracks that a model is learned from.
const SHARE: usize = 60;

/// The medoid of the models that `learn` gives for parts of some tracks.
pub(crate) fn medoid(bank: &Bank, tracks: &[usize], mut learn: impl FnMut(&[usize]) -> Model) -> Option<Model> {
    let models: Vec<Model> = (0..MODELS).map(|seed| part(tracks, seed)).map(|part| learn(&part)).collect();
    let found: Vec<Vec<Vec<Run>>> = models.iter().map(|model| labels(bank, model, tracks)).collect();
    let majority: Vec<Truth> = (0..tracks.len()).map(|at| majority(bank, &found, at)).collect();
    let agreement = |found: &Vec<Vec<Run>>| {
        let counts: Vec<Counts> = majority.iter().zip(found).map(|(truth, runs)| truth.compare(runs)).collect();
        counts.iter().sum::<Counts>().objective()
    };
    let agreements = models.into_iter().zip(found.iter().map(agreement));
    agreements.reduce(|best, next| if next.1 > best.1 { next } else { best }).map(|(model, _)| model)
}

/// A part of the tracks, the same every time for a seed; at least two of them.
fn part(tracks: &[usize], seed: u64) -> Vec<usize> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize
    };
    let mut part = tracks.to_vec();
    for at in (1..part.len()).rev() {
        part.swap(at, next() % (at + 1));
    }
    part.truncate((tracks.len() * SHARE / 100).max(2));
    part.sort_unstable();
    part
}

/// The label that most models give each frame of a track, of equally many the first one.
fn majority(bank: &Bank, found: &[Vec<Vec<Run>>], at: usize) -> Truth {
    let frames = found.iter().filter_map(|tracks| tracks[at].last()).map(|run| run.end).max().unwrap_or(0);
    let mut votes = vec![0_u8; frames * bank.labels];
    for run in found.iter().flat_map(|tracks| &tracks[at]) {
        let Some(of_run) = run.label.map(|label| label.primitive.index()) else { continue };
        (run.start..run.end).for_each(|frame| votes[frame * bank.labels + of_run] += 1);
    }
    let mut runs = Vec::new();
    for (frame, votes) in votes.chunks_exact(bank.labels).enumerate() {
        let best = votes.iter().enumerate().reduce(|best, next| if next.1 > best.1 { next } else { best });
        let label = best.map(|(of_most, _)| label(of_most));
        append(&mut runs, Run { start: frame, end: frame + 1, label });
    }
    let span = |run: &Run| Some(Span { start: run.start, end: run.end, label: run.label?.primitive.index() });
    Truth::new(runs.iter().filter_map(span).collect())
}
