//! Compares recordings: the usual properties of the set, and the recordings that differ.

use super::{FEWEST_HALVES, Facts, Finding, FindingKind, ORDERED, Step, finding, usual_tasks};
use crate::TrackId;
use crate::score::statistics::quantile;
use std::collections::{BTreeMap, BTreeSet};

/// The fewest recordings of which most can be spoken of.
const FEWEST: usize = 5;
/// The share of recordings that a rare sequence has at most, and that the usual one has at least.
const RARE: f64 = 0.1;
const USUAL: f64 = 0.5;
/// From which modified z-score on a duration is an outlier (Iglewicz and Hoaglin 1993), and at least how many times it is longer or shorter.
const OUTLIER: f64 = 3.5;
const TIMES: f64 = 1.5;
/// The least deviation that is reckoned with, as a share of the median: recordings may be equally long to the frame.
const LEAST_DEVIATION: f64 = 0.05;
/// Steps that a message lists.
const LISTED: usize = 6;

/// Adds the differences from the other recordings to each recording, and sorts its findings. Returns the usual properties of the set, in words. Recordings with a
/// failure are not compared, since their common properties are not usual.
pub fn compare(recordings: &mut [Facts]) -> Vec<String> {
    let mut usual = edges(recordings);
    let (places, sound): (Vec<usize>, Vec<&Facts>) =
        recordings.iter().enumerate().filter(|(_, facts)| facts.failures.is_empty()).unzip();
    let (findings, sentences) = differences(&sound);
    usual.extend((!sound.is_empty() && sound.len() < recordings.len()).then(|| {
        format!("{} of {} recordings have no failure; the others are not compared", sound.len(), recordings.len())
    }));
    usual.extend(sentences);
    for (at, finding) in findings {
        let facts = places.get(at).and_then(|place| recordings.get_mut(*place));
        facts.into_iter().for_each(|facts| facts.findings.push(finding.clone()));
    }
    for facts in recordings {
        facts.findings.sort_by(|a, b| {
            let start = |it: &Finding| it.span_s.map_or(f64::NEG_INFINITY, |[start, _]| start);
            a.kind.cmp(&b.kind).then(start(a).total_cmp(&start(b)))
        });
    }
    usual
}

/// The differences of recordings from the others, by their indices, and the usual properties.
fn differences(recordings: &[&Facts]) -> (Vec<(usize, Finding)>, Option<String>) {
    let tasks = |facts: &&Facts| -> Vec<String> { facts.compared_tasks().map(|step| step.name.clone()).collect() };
    let primitives =
        |facts: &&Facts| -> Vec<String> { facts.primitives.iter().map(|step| step.name.clone()).collect() };
    let mut sequences: Vec<Vec<String>> = recordings.iter().map(tasks).collect();
    if !sequences.iter().any(|tasks| tasks.iter().any(|task| Some(task) != tasks.first())) {
        sequences = recordings.iter().map(primitives).collect();
    }
    let mut findings = usual_tasks::lacking(recordings);
    findings.extend(order(&sequences));
    let (rare, sentence) = rare(&sequences, &findings);
    findings.extend(rare);
    findings.extend(durations(recordings));
    (findings, sentence)
}

/// The checks that were left out because recordings do not show what they are about, in words.
pub fn unchecked(recordings: &[Facts]) -> Vec<String> {
    let count = |is: fn(&Facts) -> bool| recordings.iter().filter(|facts| is(facts)).count();
    let all = recordings.len();
    let mut sentences = Vec::new();
    let grasps = count(|facts| facts.has_unjudged_grasps);
    if grasps > 0 {
        sentences.push(format!(
            "failed grasps in {grasps} of {all} recordings: without poses of the objects, the rules cannot detect that an object is carried"
        ));
    }
    let unmeasured = count(|facts| facts.has_unmeasured);
    if unmeasured > 0 {
        sentences
            .push(format!("expected tasks in {unmeasured} of {all} recordings: the logs lack channels by which these tasks are detected"));
    }
    sentences
}

/// Recordings that begin or end in the middle of something, unless more than half of all do so: then that is how they are made.
fn edges(recordings: &mut [Facts]) -> Vec<String> {
    let mut counts: BTreeMap<(TrackId, bool, String), usize> = BTreeMap::new();
    for facts in recordings.iter() {
        for edge in &facts.edges {
            *counts.entry((edge.who, edge.is_start, edge.does.clone())).or_default() += 1;
        }
    }
    let all = recordings.len();
    counts.retain(|_, count| all >= FEWEST_HALVES && *count * 2 > all);
    for facts in recordings.iter_mut() {
        let is_usual = |edge: &super::Edge| counts.contains_key(&(edge.who, edge.is_start, edge.does.clone()));
        let cut = facts.edges.iter().filter(|edge| !is_usual(edge)).map(|edge| edge.finding.clone());
        facts.findings.extend(cut.collect::<Vec<_>>());
    }
    let sentence = |((who, is_start, does), count): (&(TrackId, bool, String), &usize)| {
        let verb = if *is_start { "begin" } else { "end" };
        format!(
            "{count} of {all} recordings {verb} while the {who} hand does `{does}`, which is not counted as cut off"
        )
    };
    counts.iter().map(sentence).collect()
}

/// Returns the first index of each step in a sequence.
fn first(sequence: &[String]) -> BTreeMap<&str, usize> {
    let mut first = BTreeMap::new();
    for (at, step) in sequence.iter().enumerate() {
        first.entry(step.as_str()).or_insert(at);
    }
    first
}

/// Recordings in which two steps are the other way round than in most.
fn order(sequences: &[Vec<String>]) -> Vec<(usize, Finding)> {
    let firsts: Vec<BTreeMap<&str, usize>> = sequences.iter().map(|sequence| first(sequence)).collect();
    let mut before: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    for first in &firsts {
        for (one, at) in first {
            for (other, _) in first.iter().filter(|(_, place)| at < *place) {
                *before.entry((one, other)).or_default() += 1;
            }
        }
    }
    let mut findings = Vec::new();
    for (at, first) in firsts.iter().enumerate() {
        let mut wrong: Vec<(usize, &str, &str, usize, usize)> = Vec::new();
        for (one, place) in first {
            for (other, _) in first.iter().filter(|(_, behind)| place < *behind) {
                let so = before.get(&(one, other)).copied().unwrap_or_default();
                let otherwise = before.get(&(other, one)).copied().unwrap_or_default();
                let all = so + otherwise;
                if all >= FEWEST && otherwise as f64 >= ORDERED * all as f64 {
                    wrong.push((*place, one, other, otherwise, all));
                }
            }
        }
        wrong.sort_unstable();
        if let Some((_, one, other, otherwise, all)) = wrong.first() {
            let more = if wrong.len() > 1 { format!(" (and {} more pairs)", wrong.len() - 1) } else { String::new() };
            let message =
                format!("{one} before {other}{more}; {otherwise} of {all} recordings have it the other way round");
            findings.push(finding(at, FindingKind::OutOfOrder, message));
        }
    }
    findings
}

/// Recordings with a sequence of steps that few have, where there is one that most have; and what that is.
fn rare(sequences: &[Vec<String>], known: &[(usize, Finding)]) -> (Vec<(usize, Finding)>, Option<String>) {
    let all = sequences.len();
    let mut counts: BTreeMap<&[String], usize> = BTreeMap::new();
    for sequence in sequences {
        *counts.entry(sequence).or_default() += 1;
    }
    // Among equally frequent ones, the first by name.
    let usual =
        counts.iter().rev().max_by_key(|(_, count)| **count).map(|(sequence, count)| (sequence.to_vec(), *count));
    let Some((usual, count)) = usual.filter(|(_, count)| all >= FEWEST && *count as f64 >= USUAL * all as f64) else {
        return (Vec::new(), None);
    };
    let few = ((RARE * all as f64) as usize).max(1);
    let has = format!("{count} of {all} recordings have {}", listed(&usual));
    let is_known = |at: &usize| known.iter().any(|(other, _)| other == at);
    let findings = sequences.iter().enumerate().filter(|(at, sequence)| {
        **sequence != usual && !is_known(at) && counts.get(sequence.as_slice()).is_some_and(|count| *count <= few)
    });
    let findings = findings
        .map(|(at, sequence)| finding(at, FindingKind::Outlier, format!("{}; {has}", difference(sequence, &usual))));
    (findings.collect(), Some(has.clone()))
}

/// Steps as a list.
fn listed(steps: &[String]) -> String {
    let shown: Vec<&str> = steps.iter().take(LISTED).map(String::as_str).collect();
    match steps.len().checked_sub(LISTED + 1) {
        _ if steps.is_empty() => "no steps".into(),
        None => shown.join(", "),
        Some(more) => format!("{}, and {} more steps", shown.join(", "), more + 1),
    }
}

/// Returns the additional and the missing steps of a sequence relative to another one.
fn difference(sequence: &[String], usual: &[String]) -> String {
    let count = |of: &[String], step: &String| of.iter().filter(|other| *other == step).count();
    let steps: BTreeSet<&String> = sequence.iter().chain(usual).collect();
    let more = |of: &[String], than: &[String]| -> Vec<String> {
        let over = |step: &&String| match count(of, step).checked_sub(count(than, step)) {
            None | Some(0) => None,
            Some(1) => Some((*step).clone()),
            Some(times) => Some(format!("{times} × {step}")),
        };
        steps.iter().filter_map(over).collect()
    };
    let (extra, missing) = (more(sequence, usual), more(usual, sequence));
    match (extra.is_empty(), missing.is_empty()) {
        (true, true) => "has the same steps in another order".into(),
        (true, false) => format!("lacks {}", listed(&missing)),
        (false, true) => format!("has {} besides", listed(&extra)),
        (false, false) => format!("lacks {}, has {} instead", listed(&missing), listed(&extra)),
    }
}

/// Recordings, and tasks in them, that take much longer or shorter than most.
fn durations(recordings: &[&Facts]) -> Vec<(usize, Finding)> {
    let mut values: BTreeMap<&str, Vec<(usize, &Step)>> = BTreeMap::new();
    for (at, facts) in recordings.iter().enumerate() {
        for step in facts.compared_tasks() {
            values.entry(&step.name).or_default().push((at, step));
        }
    }
    let whole: Vec<f64> = recordings.iter().map(|facts| facts.duration_s()).collect();
    let mut findings: Vec<(usize, Finding)> = outliers(&whole)
        .into_iter()
        .map(|(at, words)| finding(at, FindingKind::Outlier, format!("lasts {words}")))
        .collect();
    for (name, steps) in values {
        let of: Vec<f64> = steps.iter().map(|(_, step)| step.duration_s).collect();
        for (place, words) in outliers(&of) {
            if let Some((at, step)) = steps.get(place) {
                let span_s = Some([step.start_s, step.start_s + step.duration_s]);
                let message = format!("{name} lasts {words}");
                findings.push((*at, Finding { span_s, ..Finding::new(FindingKind::Outlier, message) }));
            }
        }
    }
    findings
}

/// The values that are far from the median, by their places, each in words.
fn outliers(values: &[f64]) -> Vec<(usize, String)> {
    let median = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        quantile(&values, 0.5).unwrap_or_default()
    };
    if values.len() < FEWEST {
        return Vec::new();
    }
    let middle = median(values.to_vec());
    let deviation = median(values.iter().map(|value| (value - middle).abs()).collect()).max(LEAST_DEVIATION * middle);
    let is_far = |value: f64| {
        // 0.6745 is the quartile of the normal distribution.
        let score = 0.6745 * (value - middle).abs() / deviation.max(f64::MIN_POSITIVE);
        score > OUTLIER && (value > TIMES * middle || value * TIMES < middle)
    };
    let words = |value: f64| format!("{value:.1} s; the median of {} is {middle:.1} s", values.len());
    values.iter().enumerate().filter(|(_, value)| is_far(**value)).map(|(at, value)| (at, words(*value))).collect()
}
