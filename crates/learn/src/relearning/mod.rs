//! A written rule file whose guards and numbers are learned again, one by one, where groups that are held out gain. The order of the choices, their labels,
//! `from`, `stay`, latches and settling stay.
//!
//! `written_file`, `guard_text` and `columns` edit the text, `candidates` lists what is tried at a site, `search` tries. The caller runs the texts.

mod candidates;
mod columns;
mod guard_text;
mod search;
mod written_file;

use super::bank::{Bank, runs, spans};
use super::objective::{Counts, Truth};
use super::search_extent::SearchExtent;
use super::{Candidate, Demonstration, LabeledSpan, PRESENT, checked, fold_of};
use candidates::Candidates;
use search::{Groups, TextScores};
use std::collections::{BTreeMap, BTreeSet};
use teachtree_base::error::InputError;
use teachtree_engine::runs::Run;
use teachtree_language::rules::Rules;
use written_file::{Edits, WrittenFile};

/// Texts of the file that searches run, at most; and frames of all recordings together times texts.
pub const MOST_RUNS: usize = 6000;
const MOST_FRAMES: usize = 1_000_000_000;

/// Runs the rules with another text of the file: the labels of each recording and labeled track, in the order of the demonstrations. `None` if the text is no
/// rule file, or cannot run.
pub type RunText<'a> = dyn Fn(&str) -> Option<Vec<Vec<Vec<LabeledSpan>>>> + Sync + 'a;

/// What was learned of a written file.
#[derive(Clone, Debug, PartialEq)]
pub struct RelearnedRules {
    /// The file as it is, and with the changed lines while groups are held out.
    pub candidates: [Candidate; 2],
    /// The changed lines in their order; none where no group that is held out gains.
    pub changes: Vec<LineChange>,
    /// The text of the file with the changed lines.
    pub text: String,
    /// How many conditions were tried.
    pub conditions: usize,
    /// How many texts of the file were run.
    pub runs: usize,
    /// Whether the search ended before all of its changes were tried, because no more texts may be run.
    pub is_cut: bool,
}

impl RelearnedRules {
    /// How much of the file was searched: `tried 812 versions of mine.rules`.
    pub fn extent(&self, file: &str) -> String {
        SearchExtent { versions: self.runs, is_cut: self.is_cut }.text(file)
    }

    /// Why nothing changes; `None` if something does.
    pub const fn obstacle(&self) -> Option<&'static str> {
        match (self.changes.is_empty(), self.is_cut) {
            (false, _) => None,
            (true, true) => Some("the search stopped early"),
            (true, false) => Some("on held-out groups, no change gains more than one standard error"),
        }
    }
}

/// A changed guard or number.
#[derive(Clone, Debug, PartialEq)]
pub struct LineChange {
    /// Its line in the file as it was, from 1.
    pub line: usize,
    /// The old and the new text, each on one line without comments.
    pub texts: [String; 2],
    /// F1@50 and the share of right frames of all groups while they are held out, 0 to 1: without this change, and with it, all other changes made. A change is
    /// made for a group only if the search without that group makes it too, up to its numbers.
    pub held_out: [[f64; 2]; 2],
}

impl LineChange {
    /// What speaks for the change: `held out in 4 groups: F1@50 62.1 -> 81.0 %, frames 70.1 -> 83.0 %`.
    pub fn evidence(&self, groups: usize) -> String {
        let [[f1, frames], [f1_now, frames_now]] = self.held_out.map(|it| it.map(|part| part * 100.0));
        format!("held out in {groups} groups: F1@50 {f1:.1} -> {f1_now:.1} %, frames {frames:.1} -> {frames_now:.1} %")
    }
}

/// A labeled stretch of a track.
struct ScoredTrack {
    demonstration: usize,
    track: usize,
    group: usize,
    truth: Truth,
    /// The time of each frame, s.
    time: Vec<f64>,
    rate_hz: f64,
}

/// The labels of a stretch as runs that leave no frame out.
fn of_track(track: &ScoredTrack, labels: &[Vec<Vec<LabeledSpan>>]) -> Vec<Run> {
    let of_recording = labels.get(track.demonstration).and_then(|tracks| tracks.get(track.track));
    runs(&spans(of_recording.map_or(&[], Vec::as_slice), &track.time, track.rate_hz), track.time.len())
}

/// The labeled stretches, in the order of the bank.
fn scored(demonstrations: &[Demonstration]) -> Result<Vec<ScoredTrack>, InputError> {
    let mut found = Vec::new();
    for (demonstration, one) in demonstrations.iter().enumerate() {
        let frames = (one.frames)(&[])?;
        for stretch in &frames.stretches {
            for (track, labeled) in one.tracks.iter().enumerate() {
                let (time, rate_hz) = (frames.time[stretch.clone()].to_vec(), frames.layout.rate_hz);
                let truth = Truth::new(spans(&labeled.spans, &time, rate_hz));
                if !truth.spans.is_empty() {
                    found.push(ScoredTrack { demonstration, track, group: one.group, truth, time, rate_hz });
                }
            }
        }
    }
    Ok(found)
}

/// Learns guards and numbers of the file at a position of the sources of `rules` again. `names` are the labels, `run` runs the rules with another text of the
/// file, searches run at most about `most_runs` texts and then use the best ones, and `shown` receives the share that is done, 0 to 1.
///
/// # Errors
/// Those of [`learn`](super::learn); a file without choices, or rules that cannot run.
pub fn relearn(
    demonstrations: &[Demonstration],
    names: &[String],
    (rules, file): (&Rules, u32),
    (run, most_runs): (&RunText, usize),
    shown: &(dyn Fn(f64) + Sync),
) -> Result<RelearnedRules, InputError> {
    let both = checked(demonstrations, names)?;
    let written = WrittenFile::new(rules, file);
    let name = rules.sources.files.get(file as usize).map_or("", |source| source.name.as_str());
    if written.sites.declarations_at.is_none() {
        return Err(InputError::new(name, "has no tree and no `extend`, expected a file with choices")
            .help("name the file whose tree is to be learned again"));
    }
    let bank = Bank::new(demonstrations, names.len(), both)?;
    let scored = scored(demonstrations)?;
    let frames: usize = scored.iter().map(|track| track.time.len()).sum();
    let most_runs = most_runs.min(MOST_FRAMES / frames.max(1));
    let candidates = Candidates { file: &written, rules, bank: &bank, names, both };
    let mut measured = TextScores::new(candidates, &scored, run);
    let all: Vec<usize> = (0..scored.len()).collect();
    let Some(before) = measured.groups(&Edits::new(), &all) else {
        return Err(InputError::new(name, "cannot run on the recordings"));
    };
    let folds: BTreeSet<usize> = scored.iter().map(|track| fold_of(track.group)).collect();
    let searches = folds.len() as f64 + 1.0;
    // The first search makes the changes. The others confirm them, with equal shares of what it leaves.
    let of_all = measured.search(&all, most_runs / 2, &|part| shown(part / searches));
    let mut of_folds: Vec<(Vec<usize>, Edits)> = Vec::new();
    if !of_all.is_empty() {
        for (done, fold) in (1_u32..).zip(&folds) {
            let left = most_runs.saturating_sub(measured.runs) / (folds.len() + 1 - done as usize);
            let (held, others): (Vec<usize>, Vec<usize>) =
                all.iter().partition(|track| fold_of(scored[**track].group) == *fold);
            let mut edits = measured.search(&others, left, &|part| shown((f64::from(done) + part) / searches));
            // Another change at the same place is not evidence for the written one.
            edits.retain(|site, edit| of_all.get(site).is_some_and(|written| written.is_alike(edit)));
            of_folds.push((held, edits));
        }
    }
    let (held_out, kept) = kept(&mut measured, &of_all, &of_folds).unwrap_or_else(|| (before.clone(), BTreeMap::new()));
    let edits: Edits = of_all.into_iter().filter(|(site, _)| kept.contains_key(site)).collect();
    let change = |(site, without): (&usize, &Groups)| LineChange {
        line: written.line(*site),
        texts: [written.written(*site), written.shown(*site, &edits)],
        held_out: [without, &held_out].map(shares),
    };
    let mut changes: Vec<(usize, LineChange)> = kept.iter().map(|found| (*found.0, change(found))).collect();
    let evidence = changes.iter().map(|(site, it)| (*site, it.evidence(before.len()))).collect();
    let text = written.rendered(&edits, &evidence);
    changes.sort_by_key(|(_, change)| change.line);
    let candidate = |name, groups: &Groups| {
        let [f1, accuracy] = shares(groups);
        Candidate { name, f1, accuracy, lines: None }
    };
    Ok(RelearnedRules {
        candidates: [candidate(PRESENT, &before), candidate("with the changes", &held_out)],
        changes: changes.into_iter().map(|(_, change)| change).collect(),
        text,
        conditions: bank.atoms.len(),
        runs: measured.runs,
        is_cut: measured.is_cut,
    })
}

/// F1@50 and the share of right frames of all groups.
fn shares(groups: &Groups) -> [f64; 2] {
    let all: Counts = groups.values().sum();
    [all.f1(), all.accuracy()]
}

/// The counts of each group while it is held out, with the edits of the sites that are `asked` for; `None` if they cannot be measured on all groups.
fn held_out(
    measured: &mut TextScores,
    of_folds: &[(Vec<usize>, Edits)],
    asked: &dyn Fn(usize) -> bool,
) -> Option<Groups> {
    let mut groups = Groups::new();
    for (held, edits) in of_folds {
        let edits: Edits =
            edits.iter().filter(|(site, _)| asked(**site)).map(|(site, it)| (*site, it.clone())).collect();
        // Each group is of one fold.
        groups.extend(measured.groups(&edits, held)?);
    }
    Some(groups)
}

/// The counts with all edits that stay, and the sites of these edits: each brings more than one standard error to groups that are held out, and has the counts
/// without it. The least one is left out first, until each of the others does. `None` if no edit stays: all of them together do not bring that either, or
/// cannot be measured on all groups.
fn kept(
    measured: &mut TextScores,
    of_all: &Edits,
    of_folds: &[(Vec<usize>, Edits)],
) -> Option<(Groups, BTreeMap<usize, Groups>)> {
    let mut sites: BTreeSet<usize> = of_all.keys().copied().collect();
    while !sites.is_empty() {
        let with = held_out(measured, of_folds, &|site| sites.contains(&site))?;
        let without: BTreeMap<usize, Groups> = sites
            .iter()
            .map(|left_out| {
                let groups = held_out(measured, of_folds, &|site| site != *left_out && sites.contains(&site))?;
                Some((*left_out, groups))
            })
            .collect::<Option<_>>()?;
        let gains = without.iter().map(|(site, without)| (*site, gain(without, &with)));
        let (least, worst) = gains.reduce(|least, next| if next.1 < least.1 { next } else { least })?;
        if worst > 0.0 {
            let before = held_out(measured, of_folds, &|_| false)?;
            return (gain(&before, &with) > 0.0).then_some((with, without));
        }
        sites.remove(&least);
    }
    None
}

/// The mean gain of a group beyond the standard error of that mean.
fn gain(before: &Groups, after: &Groups) -> f64 {
    let gains: Vec<f64> = before
        .iter()
        .map(|(group, before)| after.get(group).map_or(0.0, |after| after.objective() - before.objective()))
        .collect();
    let count = gains.len().max(1) as f64;
    let mean = gains.iter().sum::<f64>() / count;
    let squares: f64 = gains.iter().map(|gain| (gain - mean) * (gain - mean)).sum();
    mean - (squares / (count - 1.0).max(1.0) / count).sqrt()
}
