//! The search for edits: in each round the best one of all sites is taken, as long as the labels that the whole file gives become better.

use super::super::guards::windows;
use super::super::objective::Counts;
use super::candidates::{Candidates, RankingData, Variants};
use super::written_file::{Edit, Edits};
use super::{RunText, ScoredTrack, of_track};
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};
use teachtree_engine::runs::Run;

/// What an edit must bring.
const GAIN: f64 = 0.004;
/// What a learned condition must bring beyond that.
const PENALTY: f64 = 0.0008;
/// Numbers are as good that are less worse than this.
const AS_GOOD: f64 = 0.0005;
/// A group is worse when it loses more than this.
const WORSE: f64 = 0.004;
/// The share of the groups that may be worse.
const VETO: f64 = 0.34;
/// Edits of a search, at most.
const ROUNDS: usize = 6;
/// Families of edits of a site that are tried again after another site was edited.
const AGAIN: usize = 3;

/// Counts by group.
pub(super) type Groups = BTreeMap<usize, Counts>;

/// Versions of a file with the counts of all tracks.
pub(super) struct TextScores<'a> {
    pub candidates: Candidates<'a>,
    pub scored: &'a [ScoredTrack],
    pub run: &'a RunText<'a>,
    known: HashMap<String, Option<Vec<Counts>>>,
    /// How many texts the search may still run.
    left: usize,
    /// How many were run.
    pub runs: usize,
    /// Whether a search left out a text because too many were run.
    pub is_cut: bool,
}

impl<'a> TextScores<'a> {
    pub fn new(candidates: Candidates<'a>, scored: &'a [ScoredTrack], run: &'a RunText<'a>) -> Self {
        Self { candidates, scored, run, known: HashMap::new(), left: 0, runs: 0, is_cut: false }
    }

    /// The text with some edits.
    pub fn text(&self, edits: &Edits) -> String {
        self.candidates.file.rendered(edits, &BTreeMap::new())
    }

    /// Runs the texts of all families of all sites that are not known yet, as many as the search may run. Sites take turns, so each of them is tried.
    fn run_all(&mut self, edits: &Edits, tried: &[Vec<Variants>]) {
        let mut families: Vec<_> = tried.iter().map(|families| families.iter().flatten()).collect();
        let mut new: Vec<String> = Vec::new();
        'search: loop {
            let turn: Vec<(usize, &Edit)> =
                families.iter_mut().enumerate().filter_map(|(site, edits)| Some((site, edits.next()?))).collect();
            if turn.is_empty() {
                break;
            }
            for (site, edit) in turn {
                let text = self.text(&with(edits, site, edit));
                if self.known.contains_key(&text) {
                    continue;
                }
                if new.len() >= self.left {
                    self.is_cut = true;
                    break 'search;
                }
                // Its counts follow; until then the same text is not run again.
                self.known.insert(text.clone(), None);
                new.push(text);
            }
        }
        self.run_new(&new);
    }

    fn run_new(&mut self, new: &[String]) {
        self.left = self.left.saturating_sub(new.len());
        self.runs += new.len();
        let (run, scored) = (self.run, self.scored);
        let found: Vec<Option<Vec<Counts>>> = new
            .par_iter()
            .map(|text| {
                let labels = run(text)?;
                Some(scored.iter().map(|track| track.truth.compare(&of_track(track, &labels))).collect())
            })
            .collect();
        self.known.extend(new.iter().cloned().zip(found));
    }

    /// The counts of some tracks with some edits, by group, also beyond the limit of the search; `None` if the text is not a valid rule file.
    pub fn groups(&mut self, edits: &Edits, tracks: &[usize]) -> Option<Groups> {
        let text = self.text(edits);
        if !self.known.contains_key(&text) {
            self.run_new(std::slice::from_ref(&text));
        }
        self.known_groups(&text, tracks)
    }

    fn known_groups(&self, text: &str, tracks: &[usize]) -> Option<Groups> {
        let counts = self.known.get(text)?.as_ref()?;
        let mut groups = Groups::new();
        for track in tracks {
            *groups.entry(self.scored[*track].group).or_default() += counts[*track];
        }
        Some(groups)
    }

    /// The labels of some tracks with some edits.
    fn labels(&self, edits: &Edits, tracks: &[usize]) -> Vec<Vec<Run>> {
        let labels = (self.run)(&self.text(edits));
        let of = |track: &usize| labels.as_ref().map_or_else(Vec::new, |it| of_track(&self.scored[*track], it));
        tracks.iter().map(of).collect()
    }

    /// The edits that suit some tracks, the best that at most `most_runs` more texts show. `shown` receives the share that is done, 0 to 1.
    pub fn search(&mut self, tracks: &[usize], most_runs: usize, shown: &dyn Fn(f64)) -> Edits {
        self.left = most_runs;
        let mut edits = Edits::new();
        let Some(mut groups) = self.groups(&edits, tracks) else { return edits };
        let windows = windows(self.candidates.bank, tracks);
        let mut tried: Vec<Vec<Variants>> = Vec::new();
        let mut last = None;
        for round in 0..ROUNDS {
            shown(round as f64 / ROUNDS as f64);
            let now = self.labels(&edits, tracks);
            let asked = RankingData { tracks, windows: &windows, scored: self.scored, now: &now };
            for site in 0..self.candidates.file.count() {
                match last {
                    None => tried.push(self.candidates.of(site, None, &asked)),
                    Some(edited) if edited == site => tried[site] = self.candidates.of(site, edits.get(&site), &asked),
                    Some(_) => {}
                }
            }
            self.run_all(&edits, &tried);
            let mut best: Option<Trial> = None;
            for (site, families) in tried.iter_mut().enumerate() {
                let mut trials = self.trials(&edits, site, std::mem::take(families), tracks, &groups);
                trials.sort_by(|one, other| other.value.total_cmp(&one.value));
                trials.truncate(AGAIN);
                if let Some(first) = trials.first()
                    && best.as_ref().is_none_or(|best| first.value > best.value)
                {
                    best = Some(first.clone());
                }
                *families = trials.into_iter().map(|trial| trial.variants).collect();
            }
            let Some(best) = best.filter(|best| best.value >= worth(&groups, &edits) + GAIN) else { break };
            edits.insert(best.site, best.variants[best.chosen].clone());
            last = Some(best.site);
            let Some(now) = self.groups(&edits, tracks) else { break };
            groups = now;
        }
        edits
    }

    /// Tries families of edits of a site. A family is left out if no member is a valid rule file, or if each is worse for many groups.
    fn trials(
        &self,
        edits: &Edits,
        site: usize,
        families: Vec<Variants>,
        tracks: &[usize],
        before: &Groups,
    ) -> Vec<Trial> {
        let mut trials = Vec::new();
        for variants in families {
            let value = |edit: &Edit| {
                let edits = with(edits, site, edit);
                let groups = self.known_groups(&self.text(&edits), tracks);
                let groups = groups.filter(|groups| !is_vetoed(groups, before));
                groups.map_or(f64::NEG_INFINITY, |groups| worth(&groups, &edits))
            };
            let values: Vec<f64> = variants.iter().map(value).collect();
            let best = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let Some(at) = values.iter().position(|value| *value == best).filter(|_| best.is_finite()) else {
                continue;
            };
            let is_as_good = |value: &&f64| **value >= best - AS_GOOD;
            let below = values[..at].iter().rev().take_while(is_as_good).count();
            let above = values[at + 1..].iter().take_while(is_as_good).count();
            trials.push(Trial { site, value: best, chosen: at + above / 2 - below / 2, variants });
        }
        trials
    }
}

/// Some edits and another one.
fn with(edits: &Edits, site: usize, edit: &Edit) -> Edits {
    let mut edits = edits.clone();
    edits.insert(site, edit.clone());
    edits
}

/// A family of edits of a site with the value of its best member; the chosen member is in the middle of those that are as good.
#[derive(Clone)]
struct Trial {
    site: usize,
    value: f64,
    chosen: usize,
    variants: Variants,
}

/// The objective of all groups, less a penalty for each rule and condition.
pub(super) fn worth(groups: &Groups, edits: &Edits) -> f64 {
    let learned = edits.values().map(|edit| match edit {
        Edit::Guard(parts) => parts.iter().filter(|part| part.is_learned).count(),
        Edit::Number(_) => 0,
    });
    groups.values().sum::<Counts>().objective() - PENALTY * learned.sum::<usize>() as f64
}

fn is_vetoed(groups: &Groups, before: &Groups) -> bool {
    let worse = groups.iter().filter(|(group, counts)| {
        before.get(group).is_some_and(|before| counts.objective() < before.objective() - WORSE)
    });
    worse.count() as f64 > VETO * groups.len() as f64
}
