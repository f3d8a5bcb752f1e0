//! The coordination of two hands: the definitions of the paper (section 4.2; docs/sources.md, D1 to D9) on physical facts, with the future known.

use super::facts::Facts;
use super::labels::leaving;
use super::series::{debounce, runs};
use nalgebra::Vector3;
use std::ops::Range;
use teachtree_base::hands::Side;

/// Losses of contact shorter than a period of tremor, ms, are bridged. Contacts of both hands shorter than `PASSING` do not count.
const BRIDGE: usize = 130;
const PASSING: usize = 200;
/// A hand holds more than the other one if the forces differ by more than this share of their sum plus this force, N, for this time, ms.
const SHARE: f64 = 0.2;
const DIFFERS_N: f64 = 0.05;
const MAIN: usize = 300;
/// Forces are means over a period of tremor to either side, ms.
const AROUND: usize = 125;
/// Minimum duration of a coordination, ms.
const SHORTEST: usize = 50;

/// The own primitives of one hand.
pub(super) struct HandTimeline<'a> {
    pub(super) side: Side,
    pub(super) facts: &'a [Facts],
    pub(super) labels: &'a [&'static str],
}

/// Returns the coordination at every moment; empty without coordination.
pub(super) fn coordination(hands: &[HandTimeline; 2]) -> Vec<&'static str> {
    let [one, other] = hands;
    let length = one.facts.len().min(other.facts.len());
    let leave = [leaving(one.facts), leaving(other.facts)];
    let mut joint: Vec<bool> = (0..length)
        .map(|at| {
            let on = |hand: usize| hands[hand].facts[at].fingers > 0 && !leave[hand][at];
            on(0) && on(1)
        })
        .collect();
    debounce(&mut joint, BRIDGE, PASSING);
    // A departure ends it, even within a bridged gap.
    (0..length).for_each(|at| joint[at] &= !leave[0][at] && !leave[1][at]);
    let main = main_hands(hands, &joint);
    let mut labels = vec![""; length];
    let mut label = "";
    for at in (0..length).filter(|&at| joint[at]) {
        if at == 0 || !joint[at - 1] {
            label = "";
        }
        label = coordination_at(&one.facts[at], &other.facts[at], main[at], label);
        labels[at] = label;
    }
    clean(&mut labels);
    relabel_passes(&mut labels, hands);
    labels
}

/// Returns the coordination at a moment at which both hands touch the object; `before` is the coordination of the moment before.
fn coordination_at(one: &Facts, other: &Facts, main: Option<Side>, before: &'static str) -> &'static str {
    let free = |facts: &Facts| !facts.carried_by && !facts.beside;
    if one.target == other.target {
        return match main {
            _ if !(one.held || other.held) || !free(one) || !free(other) || one.inside || other.inside => "",
            Some(Side::Left) => "MainGrasp(left)",
            Some(Side::Right) => "MainGrasp(right)",
            None => "EqualGrasp",
        };
    }
    if !(one.held && other.held) || one.carried_by || other.carried_by {
        return "";
    }
    let either = |is: fn(&Facts) -> bool| [one, other].into_iter().any(|facts| facts.mated && is(facts));
    match before {
        _ if either(|facts| facts.turning && facts.threaded) => "Turn",
        _ if either(|facts| facts.sinking) => "Insert",
        _ if either(|facts| facts.rising) => "Pullout",
        "Insert" | "Pullout" | "Turn" if either(|_| true) => before,
        _ if either(|_| true) || one.meets || other.meets => "Fit",
        _ => "Translate",
    }
}

/// Returns the hand that holds more while both touch the object: only it has a grasp, or it carries clearly more for some time.
fn main_hands(hands: &[HandTimeline; 2], joint: &[bool]) -> Vec<Option<Side>> {
    let forces = hands.each_ref().map(|hand| smooth(hand.facts));
    let more = |hand: usize| {
        let mut more: Vec<bool> = (0..joint.len())
            .map(|at| {
                let held = |hand: usize| hands[hand].facts[at].held;
                let [own, others] = [forces[hand][at], forces[1 - hand][at]];
                let alike = held(hand) == held(1 - hand);
                joint[at]
                    && (held(hand) && !held(1 - hand) || alike && own - others > SHARE * (own + others) + DIFFERS_N)
            })
            .collect();
        for run in runs(joint).into_iter().filter(|run| joint[run.start]) {
            remove_short(&mut more[run], MAIN);
        }
        more
    };
    let [one, other] = [more(0), more(1)];
    let main = |at: usize| match (one[at], other[at]) {
        (true, false) => Some(hands[0].side),
        (false, true) => Some(hands[1].side),
        _ => None,
    };
    (0..joint.len()).map(main).collect()
}

/// Removes intervals shorter than `shortest`, also at the ends.
fn remove_short(series: &mut [bool], shortest: usize) {
    debounce(series, shortest, shortest);
    for run in runs(series) {
        if series[run.start] && run.len() < shortest && run.len() < series.len() {
            series[run].fill(false);
        }
    }
}

/// Returns the norm of a hand's mean force, N.
fn smooth(facts: &[Facts]) -> Vec<f64> {
    let mut sums = vec![Vector3::zeros()];
    let mut sum = Vector3::zeros();
    for facts in facts {
        sum += facts.force;
        sums.push(sum);
    }
    let mean = |at: usize| {
        let (from, to) = (at.saturating_sub(AROUND), (at + AROUND).min(facts.len()));
        ((sums[to] - sums[from]) / (to - from).max(1) as f64).norm()
    };
    (0..facts.len()).map(mean).collect()
}

/// Merges short intervals with a neighbor. A Fit between two Translates is a fluctuation, and two independent carries are not coordination.
fn clean(labels: &mut [&'static str]) {
    for run in runs(labels) {
        if run.len() < SHORTEST && run.end < labels.len() {
            let next = labels[run.end];
            labels[run].fill(next);
        }
    }
    for run in runs(labels) {
        let before = run.start.checked_sub(1).map_or("", |at| labels[at]);
        if labels[run.start] == "Fit" && before == "Translate" && labels.get(run.end) == Some(&"Translate") {
            labels[run].fill("Translate");
        }
    }
    for go in coordinated_runs(labels) {
        if labels[go.clone()].iter().all(|label| *label == "Translate") {
            labels[go].fill("");
        }
    }
}

/// Returns the intervals with a coordination at every moment.
fn coordinated_runs(labels: &[&'static str]) -> Vec<Range<usize>> {
    let some: Vec<bool> = labels.iter().map(|label| !label.is_empty()).collect();
    runs(&some).into_iter().filter(|run| some[run.start]).collect()
}

/// Returns the handovers: intervals in which both hands hold the object, between a hold by one hand and a hold by the other.
fn relabel_passes(labels: &mut [&'static str], hands: &[HandTimeline; 2]) {
    let grasp = |label: &str| label == "EqualGrasp" || label.starts_with("MainGrasp");
    for go in coordinated_runs(labels) {
        let before = |hand: usize| go.start.checked_sub(1).map_or("", |at| hands[hand].labels[at]);
        let after = |hand: usize| hands[hand].labels.get(go.end).copied().unwrap_or("");
        let gives = |hand: usize| matches!(before(hand), "Grasp" | "Translate") && after(hand) == "Release";
        let takes = |hand: usize| {
            matches!(before(hand), "Move" | "Approach" | "Release") && !matches!(after(hand), "Release" | "")
        };
        if (gives(0) && takes(1) || gives(1) && takes(0)) && labels[go.clone()].iter().all(|label| grasp(label)) {
            labels[go].fill("Pass");
        }
    }
}
