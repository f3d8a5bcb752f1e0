//! What was counted of many people in, tables in Markdown out.

use crate::coordination::Coordination;
use crate::person::{Person, Rulesets, STRESSES, Seen};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use teachtree::analysis::score::{Share, Tally};

/// The channels with which each person was seen, in the order of `Person::seen`.
const CHANNELS: [&str; 3] = ["all channels", "without contact flags", "forces and poses only"];

/// `199 of 200, 99.5 % (97.2 to 99.9)`.
fn told(share: Share) -> String {
    let Some((rate, (low, high))) = share.rate().zip(share.bounds()) else { return "–".into() };
    format!("{} of {}, {} ({} to {})", share.right, share.of, percent(rate), hundred(low), hundred(high))
}

/// Never rounded to 100 while something is missing.
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

/// The counts of all people, seen with some channels.
fn tally(people: &[Person], channels: usize) -> Tally {
    let mut all = Tally::default();
    people.iter().for_each(|person| all.add(&person.seen[channels].tally));
    all
}

fn negative(people: &[Person], channels: usize) -> Share {
    sum(people.iter().map(|person| person.seen[channels].negative))
}

/// The scenes in their order.
fn scenes(people: &[Person]) -> Vec<&[Person]> {
    people.chunk_by(|one, next| one.scene == next.scene).collect()
}

/// Tasks found, pooled and by name; and what was found where there is none.
pub fn tasks(people: &[Person]) -> String {
    let tallies = [0, 1, 2].map(|channels| tally(people, channels));
    let row = |name: &str, shares: [Share; 3]| {
        std::iter::once(name.to_string()).chain(shares.map(told)).collect::<Vec<String>>()
    };
    let of = |tally: &Tally, task: &str| tally.task_measures().get(task).map(|task| task.found).unwrap_or_default();
    let names: BTreeSet<String> = tallies[0].task_measures().keys().map(|name| name.to_string()).collect();
    let mut rows = vec![row("**all tasks**", tallies.each_ref().map(Tally::tasks_found))];
    rows.extend(names.iter().map(|name| row(&format!("`{name}`"), tallies.each_ref().map(|tally| of(tally, name)))));
    rows.push(row("**no task, none found**", [0, 1, 2].map(|channels| negative(people, channels))));
    let mut falsely = vec!["false tasks anywhere".to_string()];
    falsely.extend(tallies.iter().map(|tally| tally.false_tasks().to_string()));
    rows.push(falsely);
    table(&["true task", CHANNELS[0], CHANNELS[1], CHANNELS[2]], rows)
}

/// Which tasks went wrong, by scene, and whose they are.
pub fn wrong(people: &[Person]) -> String {
    let mut wrong: BTreeMap<(&str, &str, &str), Vec<String>> = BTreeMap::new();
    for person in people {
        for pair in person.seen[0].pairs() {
            if pair.is_true() && !pair.is_right() || pair.is_false_alarm() {
                let seeds = wrong.entry((person.scene, &pair.truth, &pair.result)).or_default();
                seeds.push(person.seed.to_string());
            }
        }
    }
    if wrong.is_empty() {
        return "Nothing was.".into();
    }
    let rows = wrong.into_iter().map(|((scene, truth, result), seeds)| {
        let more = if seeds.len() > 12 { ", …" } else { "" };
        let first = seeds.iter().take(12).map(String::as_str).collect::<Vec<_>>().join(", ");
        vec![format!("`{scene}`"), truth.into(), result.into(), seeds.len().to_string(), format!("{first}{more}")]
    });
    table(&["scene", "true", "found", "how often", "seeds"], rows)
}

/// Frames and segments.
pub fn segments(people: &[Person]) -> String {
    let rows = CHANNELS.iter().enumerate().map(|(channels, name)| {
        let tally = tally(people, channels);
        let mut row = vec![name.to_string(), rate(tally.accuracy())];
        row.extend(tally.f1().map(rate));
        row.push(rate(tally.edit()));
        row
    });
    table(&["seen with", "frames right", "F1 at 10 %", "F1 at 25 %", "F1 at 50 %", "edit score"], rows)
}

/// Errors of the boundaries that a contact makes, by the primitive that begins.
pub fn boundaries(people: &[Person]) -> String {
    let all = tally(people, 0);
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

fn by_paper(people: &[Person]) -> Share {
    sum(people.iter().filter(|person| !person.incident).map(|person| person.expected))
}

fn by_truth(people: &[Person]) -> Share {
    sum(people.iter().map(|person| person.seen[0].tally.task_sequences()))
}

/// Sequences of primitives, by scene.
pub fn sequences(people: &[Person]) -> String {
    let row = |name: String, people: &[Person]| vec![name, told(by_paper(people)), told(by_truth(people))];
    let mut rows = vec![row("**all**".into(), people)];
    rows.extend(
        scenes(people).into_iter().filter_map(|people| Some(row(format!("`{}`", people.first()?.scene), people))),
    );
    table(&["scene", "as in the chapter, no incident", "as the relabelled truth, everybody"], rows)
}

/// Recordings whose tasks stay right when they are recorded or judged otherwise.
pub fn stress(people: &[Person]) -> String {
    let tried = people.iter().filter(|person| !person.stress.is_empty());
    let as_they_are = count(tried.map(|person| person.seen[0].is_right()));
    let mut rows = vec![vec!["as they are".to_string(), told(as_they_are)]];
    rows.extend(STRESSES.iter().enumerate().map(|(at, stress)| {
        let right = people.iter().filter_map(|person| person.stress.get(at).copied());
        vec![stress.name.to_string(), told(count(right))]
    }));
    table(&["recordings", "all tasks right, no other found"], rows)
}

/// Which numbers of the rules were not scaled in full.
pub fn ends(rules: &Rulesets) -> String {
    let [low, high] = rules.at_their_end.each_ref().map(|names| match names.as_slice() {
        [] => "none".to_string(),
        names => names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", "),
    });
    format!("at × 0.75: {low}; at × 1.25: {high}")
}

/// How many of the recordings that were played backwards are what they may not be.
pub fn backwards(people: &[Person]) -> String {
    let taken = count(people.iter().filter_map(|person| person.backwards));
    let who = people.iter().filter(|person| person.backwards == Some(true));
    let who: Vec<String> = who.map(|person| format!("`{}` {}", person.scene, person.seed)).collect();
    let told = if who.is_empty() { String::new() } else { format!(" ({})", who.join(", ")) };
    format!("{} of {}{told}", taken.right, taken.of)
}

/// What the base rules say alone.
pub fn additivity(people: &[Person]) -> String {
    let of = |apart: bool| {
        let cases = people.iter().filter_map(|person| person.additive.as_ref());
        count(cases.filter(|additive| additive.apart == apart).map(|additive| additive.same))
    };
    let rows = [
        vec!["none of the four occurs: the same frame for frame".to_string(), told(of(true))],
        vec!["one occurs, tasks of the first five: the same tasks".to_string(), told(of(false))],
    ];
    table(&["recordings", "same without `contact.rules`"], rows)
}

/// The pooled figures of sets of people, beside each other.
pub fn pooled(sets: &[(String, &[Person])]) -> String {
    type Figure = (&'static str, fn(&[Person]) -> String);
    let figures: [Figure; 12] = [
        ("tasks right, all channels", |people| told(tally(people, 0).tasks_found())),
        ("tasks right, without contact flags", |people| told(tally(people, 1).tasks_found())),
        ("tasks right, forces and poses only", |people| told(tally(people, 2).tasks_found())),
        ("no task, none found", |people| told(negative(people, 0))),
        ("recordings with all tasks right and no other", |people| {
            told(count(people.iter().map(|person| Seen::is_right(&person.seen[0]))))
        }),
        ("boundaries by contact, median, ms", |people| ms(tally(people, 0).contact_errors().median_s())),
        ("boundaries by contact, 95th percentile, ms", |people| ms(tally(people, 0).contact_errors().p95_s())),
        ("F1 at 50 %", |people| rate(tally(people, 0).f1()[2])),
        ("frames right", |people| rate(tally(people, 0).accuracy())),
        ("edit score", |people| rate(tally(people, 0).edit())),
        ("sequences as in the chapter, no incident", |people| told(by_paper(people))),
        ("sequences as the relabelled truth", |people| told(by_truth(people))),
    ];
    let mut head = vec!["pooled".to_string()];
    head.extend(sets.iter().map(|(seeds, _)| format!("seeds {seeds}")));
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    table(
        &head,
        figures.map(|(name, of)| {
            std::iter::once(name.to_string()).chain(sets.iter().map(|(_, people)| of(people))).collect()
        }),
    )
}

/// The coordination of two hands, by scene.
pub fn coordination(people: &[Person]) -> String {
    let rows = scenes(people).into_iter().filter_map(|people| {
        let both: Vec<&Coordination> = people.iter().filter_map(|person| person.both.as_ref()).collect();
        let mut off_s: Vec<f64> = both.iter().flat_map(|both| both.off_s.iter().copied()).collect();
        off_s.sort_by(f64::total_cmp);
        let at = |share: f64| off_s.get(((off_s.len() as f64 - 1.0) * share).round() as usize).copied();
        Some(vec![
            format!("`{}`", people.first()?.scene),
            told(sum(people.iter().map(|person| person.seen[0].tally.tasks_found()))),
            told(count(both.iter().map(|both| both.same))),
            told(count(both.iter().filter_map(|both| both.none))),
            told(sum(both.iter().map(|both| both.passes))),
            both.iter().map(|both| both.false_passes).sum::<usize>().to_string(),
            format!("{} / {}", ms(at(0.5)), ms(at(0.95))),
        ])
    });
    let head = [
        "scene",
        "tasks right",
        "coordination as it was",
        "none found where none is",
        "Pass: giver and receiver right",
        "false Pass",
        "ends of Pass off, median / 95th percentile, ms",
    ];
    table(&head, rows)
}
