//! Tables in Markdown from the counts of many trials.

use crate::coordination::Coordination;
use crate::trial::{Rulesets, STRESSES, Trial, TruthComparison};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use teachtree_analysis::score::{Share, Tally};

/// The channels with which each trial was analyzed, in the order of `Trial::seen`.
const CHANNELS: [&str; 3] = ["all channels", "without contact flags", "forces and poses only"];

/// `199 of 200, 99.5 % (97.2 to 99.9)`.
fn format_share(share: Share) -> String {
    let Some((rate, (low, high))) = share.rate().zip(share.bounds()) else { return "–".into() };
    format!("{} of {}, {} ({} to {})", share.right, share.of, percent(rate), hundred(low), hundred(high))
}

/// Rounded down, so that only a full share is 100.
fn percent(rate: f64) -> String {
    format!("{} %", hundred(rate))
}

fn hundred(rate: f64) -> String {
    format!("{:.1}", (rate * 1000.0 + 1e-9).floor() / 10.0)
}

fn ms(seconds: Option<f64>) -> String {
    seconds.map_or("–".into(), |seconds| format!("{:.1}", seconds * 1000.0))
}

fn rate(rate: Option<f64>) -> String {
    rate.map_or("–".into(), percent)
}

fn table(head: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut text = format!("| {} |\n|{}\n", head.join(" | "), "---|".repeat(head.len()));
    for row in rows {
        let _ = writeln!(text, "| {} |", row.join(" | "));
    }
    text.trim_end().to_string()
}

fn sum(shares: impl IntoIterator<Item = Share>) -> Share {
    let mut sum = Share::default();
    shares.into_iter().for_each(|share| sum.add(share));
    sum
}

fn count(cases: impl IntoIterator<Item = bool>) -> Share {
    let mut share = Share::default();
    cases.into_iter().for_each(|right| share.count(right));
    share
}

/// The counts of all trials, with one choice of channels.
fn tally(trials: &[Trial], channels: usize) -> Tally {
    let mut all = Tally::default();
    trials.iter().for_each(|trial| all.add(&trial.seen[channels].tally));
    all
}

fn negative(trials: &[Trial], channels: usize) -> Share {
    sum(trials.iter().map(|trial| trial.seen[channels].negative))
}

/// The scenes in their order.
fn scenes(trials: &[Trial]) -> Vec<&[Trial]> {
    trials.chunk_by(|one, next| one.scene == next.scene).collect()
}

/// Tasks found, pooled and by name; and what was found where there is none.
pub fn tasks(trials: &[Trial]) -> String {
    let tallies = [0, 1, 2].map(|channels| tally(trials, channels));
    let row = |name: &str, shares: [Share; 3]| {
        std::iter::once(name.to_string()).chain(shares.map(format_share)).collect::<Vec<String>>()
    };
    let of = |tally: &Tally, task: &str| tally.task_measures().get(task).map(|task| task.found).unwrap_or_default();
    let names: BTreeSet<String> = tallies[0].task_measures().keys().map(|name| name.to_string()).collect();
    let mut rows = vec![row("**all tasks**", tallies.each_ref().map(Tally::tasks_found))];
    rows.extend(names.iter().map(|name| row(&format!("`{name}`"), tallies.each_ref().map(|tally| of(tally, name)))));
    rows.push(row("**no task, none found**", [0, 1, 2].map(|channels| negative(trials, channels))));
    let mut falsely = vec!["false tasks anywhere".to_string()];
    falsely.extend(tallies.iter().map(|tally| tally.false_tasks().to_string()));
    rows.push(falsely);
    table(&["true task", CHANNELS[0], CHANNELS[1], CHANNELS[2]], rows)
}

/// The wrong tasks by scene, with their seeds.
pub fn wrong(trials: &[Trial]) -> String {
    let mut wrong: BTreeMap<(&str, &str, &str), Vec<String>> = BTreeMap::new();
    for trial in trials {
        for pair in trial.seen[0].pairs() {
            if pair.is_true() && !pair.is_right() || pair.is_false_alarm() {
                let seeds = wrong.entry((trial.scene, &pair.truth, &pair.result)).or_default();
                seeds.push(trial.seed.to_string());
            }
        }
    }
    if wrong.is_empty() {
        return "None.".into();
    }
    let rows = wrong.into_iter().map(|((scene, truth, result), seeds)| {
        let more = if seeds.len() > 12 { ", …" } else { "" };
        let first = seeds.iter().take(12).map(String::as_str).collect::<Vec<_>>().join(", ");
        vec![format!("`{scene}`"), truth.into(), result.into(), seeds.len().to_string(), format!("{first}{more}")]
    });
    table(&["scene", "true", "found", "count", "seeds"], rows)
}

/// Frames and segments.
pub fn segments(trials: &[Trial]) -> String {
    let rows = CHANNELS.iter().enumerate().map(|(channels, name)| {
        let tally = tally(trials, channels);
        let mut row = vec![name.to_string(), rate(tally.accuracy())];
        row.extend(tally.f1().map(rate));
        row.push(rate(tally.edit()));
        row
    });
    table(&["seen with", "frames right", "F1 at 10 %", "F1 at 25 %", "F1 at 50 %", "edit score"], rows)
}

/// Errors of the boundaries that a contact makes, by the primitive that begins.
pub fn boundaries(trials: &[Trial]) -> String {
    let all = tally(trials, 0);
    let row = |name: String, tally: &Tally| {
        let errors = tally.contact_errors();
        let found = format!("{} of {}", errors.found.right, errors.found.of);
        let [early, late] = [errors.late_s.first(), errors.late_s.last()].map(|late| ms(late.copied()));
        vec![name, found, ms(errors.median_s()), ms(errors.p95_s()), early, late]
    };
    let of = |primitive: &str| {
        let of = all.boundaries.iter().filter(|boundary| boundary.after == primitive);
        Tally { boundaries: of.cloned().collect(), ..Tally::default() }
    };
    let by_contact = all.boundaries.iter().filter(|boundary| boundary.by_contact);
    let primitives: BTreeSet<&str> = by_contact.map(|boundary| boundary.after.as_str()).collect();
    let mut rows = vec![row("**all**".into(), &all)];
    rows.extend(primitives.into_iter().map(|primitive| row(primitive.into(), &of(primitive))));
    table(&["begins", "found", "median, ms", "95th percentile, ms", "earliest, ms", "latest, ms"], rows)
}

fn by_paper(trials: &[Trial]) -> Share {
    sum(trials.iter().filter(|trial| !trial.perturbation).map(|trial| trial.expected))
}

fn by_truth(trials: &[Trial]) -> Share {
    sum(trials.iter().map(|trial| trial.seen[0].tally.task_sequences()))
}

/// Sequences of primitives, by scene.
pub fn sequences(trials: &[Trial]) -> String {
    let row =
        |name: String, trials: &[Trial]| vec![name, format_share(by_paper(trials)), format_share(by_truth(trials))];
    let mut rows = vec![row("**all**".into(), trials)];
    rows.extend(
        scenes(trials).into_iter().filter_map(|trials| Some(row(format!("`{}`", trials.first()?.scene), trials))),
    );
    table(&["scene", "as in the paper, no perturbation", "as the relabeled truth, all operators"], rows)
}

/// The recordings whose tasks are right under each stress condition.
pub fn stress(trials: &[Trial]) -> String {
    let tried = trials.iter().filter(|trial| !trial.stress.is_empty());
    let as_they_are = count(tried.map(|trial| trial.seen[0].is_right()));
    let mut rows = vec![vec!["as they are".to_string(), format_share(as_they_are)]];
    rows.extend(STRESSES.iter().enumerate().map(|(at, stress)| {
        let right = trials.iter().filter_map(|trial| trial.stress.get(at).copied());
        vec![stress.name.to_string(), format_share(count(right))]
    }));
    table(&["recordings", "all tasks right, no other found"], rows)
}

/// The params that reached the end of their range when scaled.
pub fn ends(rules: &Rulesets) -> String {
    let [low, high] = rules.at_their_end.each_ref().map(|names| match names.as_slice() {
        [] => "none".to_string(),
        names => names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", "),
    });
    format!("at × 0.75: {low}; at × 1.25: {high}")
}

/// The number of recordings recognized as a peg-in-hole although they were played backward.
pub fn backwards(trials: &[Trial]) -> String {
    let taken = count(trials.iter().filter_map(|trial| trial.backwards));
    let who = trials.iter().filter(|trial| trial.backwards == Some(true));
    let who: Vec<String> = who.map(|trial| format!("`{}` {}", trial.scene, trial.seed)).collect();
    let seeds = if who.is_empty() { String::new() } else { format!(" ({})", who.join(", ")) };
    format!("{} of {}{seeds}", taken.right, taken.of)
}

/// Agreement with the base rules alone.
pub fn additivity(trials: &[Trial]) -> String {
    let of = |apart: bool| {
        let cases = trials.iter().filter_map(|trial| trial.additive.as_ref());
        count(cases.filter(|additive| additive.apart == apart).map(|additive| additive.same))
    };
    let rows = [
        vec!["none of the four occurs: the same frame for frame".to_string(), format_share(of(true))],
        vec!["one occurs, tasks of the first five: the same tasks".to_string(), format_share(of(false))],
    ];
    table(&["recordings", "same without `contact.rules`"], rows)
}

/// The pooled results of several sets of trials, side by side.
pub fn pooled(sets: &[(String, &[Trial])]) -> String {
    type Figure = (&'static str, fn(&[Trial]) -> String);
    let figures: [Figure; 12] = [
        ("tasks right, all channels", |trials| format_share(tally(trials, 0).tasks_found())),
        ("tasks right, without contact flags", |trials| format_share(tally(trials, 1).tasks_found())),
        ("tasks right, forces and poses only", |trials| format_share(tally(trials, 2).tasks_found())),
        ("no task, none found", |trials| format_share(negative(trials, 0))),
        ("recordings with all tasks right and no other", |trials| {
            format_share(count(trials.iter().map(|trial| TruthComparison::is_right(&trial.seen[0]))))
        }),
        ("boundaries by contact, median, ms", |trials| ms(tally(trials, 0).contact_errors().median_s())),
        ("boundaries by contact, 95th percentile, ms", |trials| ms(tally(trials, 0).contact_errors().p95_s())),
        ("F1 at 50 %", |trials| rate(tally(trials, 0).f1()[2])),
        ("frames right", |trials| rate(tally(trials, 0).accuracy())),
        ("edit score", |trials| rate(tally(trials, 0).edit())),
        ("sequences as in the paper, no perturbation", |trials| format_share(by_paper(trials))),
        ("sequences as the relabeled truth", |trials| format_share(by_truth(trials))),
    ];
    let mut head = vec!["pooled".to_string()];
    head.extend(sets.iter().map(|(seeds, _)| format!("seeds {seeds}")));
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    table(
        &head,
        figures.map(|(name, of)| {
            std::iter::once(name.to_string()).chain(sets.iter().map(|(_, trials)| of(trials))).collect()
        }),
    )
}

/// The coordination of two hands, by scene.
pub fn coordination(trials: &[Trial]) -> String {
    let rows = scenes(trials).into_iter().filter_map(|trials| {
        let both: Vec<&Coordination> = trials.iter().filter_map(|trial| trial.both.as_ref()).collect();
        let mut off_s: Vec<f64> = both.iter().flat_map(|both| both.off_s.iter().copied()).collect();
        off_s.sort_by(f64::total_cmp);
        let at = |share: f64| off_s.get(((off_s.len() as f64 - 1.0) * share).round() as usize).copied();
        Some(vec![
            format!("`{}`", trials.first()?.scene),
            format_share(sum(trials.iter().map(|trial| trial.seen[0].tally.tasks_found()))),
            format_share(count(both.iter().map(|both| both.same))),
            format_share(count(both.iter().filter_map(|both| both.none))),
            format_share(sum(both.iter().map(|both| both.passes))),
            both.iter().map(|both| both.false_passes).sum::<usize>().to_string(),
            format!("{} / {}", ms(at(0.5)), ms(at(0.95))),
        ])
    });
    let head = [
        "scene",
        "tasks right",
        "coordination right",
        "none found where none is",
        "Pass: giver and receiver right",
        "false Pass",
        "ends of Pass off, median / 95th percentile, ms",
    ];
    table(&head, rows)
}
