//! The candidates and the choice between them: every method learns from all groups but some, and is measured on those.

use super::bank::Bank;
use super::fold_of;
use super::guards::guards;
use super::medoid::medoid;
use super::model::{Model, labels};
use super::objective::Counts;
use super::search::Search;
use super::search_extent::SearchExtent;
use super::tree::tree;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use teachtree_engine::runs::Run;

/// The most times that groups are held out.
pub(crate) const FOLDS: usize = 10;
/// What a rule or condition more must bring to groups that are held out, of F1.
const READING: f64 = 0.002;
/// Rules of a model, at most: a file of 40 lines has no more.
const MOST_RULES: usize = 9;

/// How a candidate is learned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Method {
    Guards,
    GuardsSearched,
    GuardsMedoid,
    Tree,
    TreeSearched,
}

impl Method {
    /// The methods for a bank.
    fn all(bank: &Bank) -> &'static [Self] {
        if bank.slots == 1 {
            &[Self::Guards, Self::GuardsSearched, Self::GuardsMedoid, Self::Tree, Self::TreeSearched]
        } else {
            &[Self::Guards, Self::GuardsSearched, Self::GuardsMedoid]
        }
    }

    pub const fn name(self) -> &'static str {
        match self {
            Self::Guards => "guards",
            Self::GuardsSearched => "guards, searched",
            Self::GuardsMedoid => "guards, medoid",
            Self::Tree => "tree",
            Self::TreeSearched => "tree, searched",
        }
    }
}

/// The models of all methods, in their order, and what the searches have tried.
fn fit(bank: &Bank, tracks: &[usize]) -> (Vec<Model>, SearchExtent) {
    let mut models: Vec<Model> = Vec::new();
    let mut extent = SearchExtent::default();
    let first = guards(bank, tracks, MOST_RULES);
    for method in Method::all(bank) {
        let mut search = |tracks: &[usize], model| {
            let (model, tried) = Search::run(bank, tracks, model, MOST_RULES);
            extent += tried;
            model
        };
        let model = match method {
            Method::Guards => Some(Search::recovered(bank, tracks, first.clone())),
            Method::Tree => Some(tree(bank, tracks, MOST_RULES)),
            Method::GuardsSearched => Some(search(tracks, first.clone())),
            Method::TreeSearched => models.last().cloned().map(|it| search(tracks, it)),
            Method::GuardsMedoid => medoid(bank, tracks, |part| search(part, guards(bank, part, MOST_RULES))),
        };
        models.extend(model);
    }
    (models, extent)
}

/// A method with what it has learned from all tracks, and what it gives those that are held out.
pub(crate) struct MethodResult {
    pub method: Method,
    pub model: Model,
    /// By track.
    pub held_out: Vec<Vec<Run>>,
}

/// The fold in which a track is held out.
fn fold(bank: &Bank, track: usize) -> usize {
    fold_of(bank.tracks[track].group)
}

/// Learns by each method, from all tracks and without each fold; returns what the searches have tried, too. `shown` receives the share that is done, 0 to 1.
pub(crate) fn fitted(bank: &Bank, shown: &(dyn Fn(f64) + Sync)) -> (Vec<MethodResult>, SearchExtent) {
    let all: Vec<usize> = (0..bank.tracks.len()).collect();
    let folds = bank.tracks.iter().map(|track| track.group + 1).max().unwrap_or(0).min(FOLDS);
    let done = AtomicUsize::new(0);
    let (learned, extents): (Vec<Vec<Model>>, Vec<SearchExtent>) = (0..=folds)
        .into_par_iter()
        .map(|held| {
            // No track has the last number: that is the model of all.
            let others: Vec<usize> = all.iter().copied().filter(|track| fold(bank, *track) != held).collect();
            let found = fit(bank, &others);
            shown((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / (folds + 1) as f64);
            found
        })
        .unzip();
    let of_method = |(at, method): (usize, &Method)| {
        let model = learned.last()?.get(at)?.clone();
        let mut held_out = vec![Vec::new(); all.len()];
        for (held, models) in learned.iter().enumerate().take(folds) {
            let tracks: Vec<usize> = all.iter().copied().filter(|track| fold(bank, *track) == held).collect();
            for (track, runs) in tracks.iter().zip(labels(bank, models.get(at)?, &tracks)) {
                held_out[*track] = runs;
            }
        }
        Some(MethodResult { method: *method, model, held_out })
    };
    let mut extent = SearchExtent::default();
    extents.into_iter().for_each(|tried| extent += tried);
    (Method::all(bank).iter().enumerate().filter_map(of_method).collect(), extent)
}

/// How right the labels of all tracks are: together, and by fold.
pub(crate) struct FoldCounts {
    pub all: Counts,
    folds: Vec<Counts>,
}

/// Measures the labels of all tracks.
pub(crate) fn measured(bank: &Bank, labels: &[Vec<Run>]) -> FoldCounts {
    let mut measured = FoldCounts { all: Counts::default(), folds: vec![Counts::default(); FOLDS] };
    for (at, (track, labels)) in bank.tracks.iter().zip(labels).enumerate() {
        let counts = track.truth.compare(labels);
        measured.all += counts;
        measured.folds[fold(bank, at)] += counts;
    }
    measured
}

/// Returns the index of the candidate to write. Candidates whose F1 is lower than the best one by more than the standard error of the mean difference over folds
/// are left out. Each rule or condition of the others costs [`READING`]: with few groups, the standard error alone would accept a candidate that is far worse.
pub(crate) fn choice(candidates: &[(usize, &FoldCounts)]) -> Option<usize> {
    let best =
        candidates.iter().map(|(_, it)| *it).reduce(|best, it| if it.all.f1() > best.all.f1() { it } else { best })?;
    let is_near = |measured: &FoldCounts| {
        let used = best.folds.iter().zip(&measured.folds).filter(|(best, _)| **best != Counts::default());
        let lost: Vec<f64> = used.map(|(best, it)| best.f1() - it.f1()).collect();
        let count = lost.len() as f64;
        let mean = lost.iter().sum::<f64>() / count.max(1.0);
        let squares: f64 = lost.iter().map(|lost| (lost - mean) * (lost - mean)).sum();
        mean <= (squares / (count - 1.0).max(1.0) / count.max(1.0)).sqrt()
    };
    let worth = |(size, measured): &(usize, &FoldCounts)| measured.all.f1() - READING * *size as f64;
    let near = candidates.iter().enumerate().filter(|(_, (_, measured))| is_near(measured));
    let worths = near.map(|(at, candidate)| (at, worth(candidate)));
    worths.reduce(|best, next| if next.1 > best.1 { next } else { best }).map(|(at, _)| at)
}
