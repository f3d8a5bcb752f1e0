//! From primitives to tasks: each stretch from a Move to a Release, by its key primitive (the paper, section 2.5). It follows the paper's table on
//! the true primitives and shares nothing with the rules.

use super::facts::Facts;
use super::series::runs;
use std::ops::Range;

/// Minimum displacement, m, rotation, rad, or duration, ms, of a key primitive: less is a fluctuation.
const TRAVEL_M: f64 = 0.020;
const TURN_RAD: f64 = 0.17;
const PRESS: usize = 150;

/// Returns the intervals of a hand with their task names, in order; the name is empty outside of tasks.
pub(super) fn tasks(labels: &[&str], facts: &[Facts]) -> Vec<(Range<usize>, &'static str)> {
    let named = |span: Range<usize>| (span.clone(), task(span, labels, facts));
    joined(spans(labels), labels, facts).into_iter().map(named).collect()
}

/// Returns the intervals that end with a Release, or with a Miss or a Drop without a later Release, and the rest.
fn spans(labels: &[&str]) -> Vec<Range<usize>> {
    let mut spans = Vec::new();
    let mut start = 0;
    for run in runs(labels) {
        let fails = matches!(labels[run.start], "Miss" | "Drop") && labels.get(run.end) != Some(&"Release");
        if fails || labels[run.start] == "Release" || run.end == labels.len() {
            spans.push(start..run.end);
            start = run.end;
        }
    }
    spans
}

/// Joins an unsuccessful touch with the next interval if the hand does not leave, and the strokes of one turn.
fn joined(spans: Vec<Range<usize>>, labels: &[&str], facts: &[Facts]) -> Vec<Range<usize>> {
    let mut joined: Vec<Range<usize>> = Vec::new();
    for span in spans {
        let stays = labels[span.start] != "Move";
        let goes_on = |last: &Range<usize>| {
            let before = task(last.clone(), labels, facts);
            stays && (before.is_empty() || before == "turn_screw" && task(span.clone(), labels, facts) == before)
        };
        match joined.last_mut() {
            Some(last) if goes_on(last) => last.end = span.end,
            _ => joined.push(span),
        }
    }
    joined
}

/// Returns the task of a span; empty without a key primitive.
fn task(span: Range<usize>, labels: &[&str], facts: &[Facts]) -> &'static str {
    let parts: Vec<Range<usize>> =
        runs(&labels[span.clone()]).into_iter().map(|run| run.start + span.start..run.end + span.start).collect();
    let way = |of: fn(&Facts) -> f64, part: &Range<usize>| facts[part.clone()].iter().map(of).sum::<f64>() / 1000.0;
    let named = |name: &'static str| parts.iter().filter(move |part| primitive(labels[part.start]) == name);
    // A pushed object may leave the wall and touch it again.
    let pushed = |name| named(name).map(|part| way(|facts| facts.speed, part)).sum::<f64>() >= TRAVEL_M;
    let has = |name| {
        named(name).any(|part| match name {
            "Turn" => way(|facts| facts.spin, part) >= TURN_RAD,
            "Push" | "Trace" => pushed(name),
            "Slide" | "Follow" | "EqualGrasp" | "MainGrasp" => way(|facts| facts.speed, part) >= TRAVEL_M,
            "Press" => part.len() >= PRESS,
            _ => true,
        })
    };
    let grasped = has("Grasp") || has("Translate");
    let keys = [
        ("dropped", has("Drop")),
        ("missed_grasp", has("Miss")),
        ("failed_insertion", has("Jam") && !has("Insert")),
        ("collided", has("Collision") || has("Bump")),
        ("turn_screw", has("Turn")),
        ("peg_in_hole", has("Insert")),
        ("peg_pullout_from_hole", has("Pullout")),
        ("fit", has("Fit")),
        ("pick_and_follow", has("Follow")),
        ("push_and_trace", has("Trace") && !grasped),
        ("pick_and_press", has("Press")),
        ("push", has("Push") && !grasped),
        ("carry_together", (has("EqualGrasp") || has("MainGrasp")) && !has("Pass")),
        ("pick_and_place", has("Translate") || has("Place") || has("Pass")),
        ("slide", has("Slide")),
    ];
    keys.iter().find(|(_, found)| *found).map_or("", |(name, _)| name)
}

/// Returns the primitive of a label, without its side.
fn primitive(label: &str) -> &str {
    label.split_once('(').map_or(label, |(name, _)| name)
}
