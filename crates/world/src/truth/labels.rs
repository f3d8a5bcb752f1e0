//! From facts to primitives: the definitions of the paper (docs/sources.md, C1 to C20) with the future known.

use super::facts::Facts;
use super::series::runs;
use std::ops::Range;

/// Minimum duration of a primitive, ms.
const SHORTEST: usize = 50;
/// Maximum time in which fingers leave an object, ms.
const LEAVING: usize = 500;
/// Maximum duration of a hold at a wall before following it, and of a loss of the wall, that count as following, ms.
const FUMBLED: usize = 600;

/// Returns the primitive of a hand at every moment.
pub(super) fn labels(facts: &[Facts]) -> Vec<&'static str> {
    let mut labels = Vec::with_capacity(facts.len());
    let mut memory = GraspHistory::default();
    let pressing = pressing(facts);
    for ((now, leaves), pressing) in facts.iter().zip(leaving(facts)).zip(pressing) {
        labels.push(memory.label(now, leaves, pressing));
    }
    short(&mut labels);
    relabel_interruptions(&mut labels);
    relabel_rests(&mut labels);
    labels
}

/// The history of the current grasp.
struct GraspHistory {
    label: &'static str,
    lifted: bool,
    placed: bool,
    /// Whether the body beside the object was touched before the lift, or when the object was set down.
    beside_before: bool,
}

impl Default for GraspHistory {
    fn default() -> Self {
        Self { label: "Move", lifted: false, placed: false, beside_before: false }
    }
}

impl GraspHistory {
    fn label(&mut self, now: &Facts, leaves: bool, pressing: bool) -> &'static str {
        self.label = if now.fingers == 0 {
            (self.lifted, self.placed) = (false, false);
            match self.label {
                "Move" | "Approach" if now.near => "Approach",
                "Move" | "Approach" => "Move",
                "Release" if !now.near => "Move",
                "Release" if now.returns => "Approach",
                _ => "Release",
            }
        } else if leaves && !matches!(self.label, "Move" | "Approach") {
            "Release"
        } else if now.inside {
            self.inside(now)
        } else if !now.held {
            match (now.moving, now.beside, self.label) {
                (true, true, _) => "Trace",
                (true, false, _) if now.carried_by => "Push",
                (.., "Move") => "Approach",
                (.., label) => label,
            }
        } else {
            self.held(now, pressing)
        };
        self.label
    }

    fn inside(&mut self, now: &Facts) -> &'static str {
        match self.label {
            _ if now.turning && now.held => "Turn",
            // Motion along a thread without rotation is play.
            _ if now.sinking && !now.threaded => "Insert",
            _ if now.rising && !now.threaded => "Pullout",
            label @ ("Insert" | "Pullout" | "Turn") => label,
            "Translate" => "Translate",
            _ if now.held => "Grasp",
            "Move" => "Approach",
            label => label,
        }
    }

    fn held(&mut self, now: &Facts, pressing: bool) -> &'static str {
        if !now.carried_by {
            (self.lifted, self.placed, self.beside_before) = (true, false, self.beside_before && now.beside);
        }
        let landing = self.lifted && now.carried_by;
        if landing && !self.placed || now.carried_by && !self.lifted {
            self.beside_before = now.beside;
        }
        self.placed |= landing;
        match now {
            Facts { carried_by: false, beside: false, .. } => "Translate",
            Facts { beside: true, along: true, .. } if !self.beside_before => "Follow",
            Facts { beside: true, .. } if !self.beside_before => "Press",
            _ if landing && pressing => "Press",
            _ if landing => "Place",
            Facts { turning: true, .. } => "Turn",
            Facts { sliding: true, .. } => "Slide",
            _ => "Grasp",
        }
    }
}

/// Returns when a carried object is pressed down: from its landing until the force ends.
fn pressing(facts: &[Facts]) -> Vec<bool> {
    let mut pressing = vec![false; facts.len()];
    let landed: Vec<bool> = facts.iter().map(|facts| facts.carried_by && facts.fingers > 0).collect();
    for run in runs(&landed).into_iter().filter(|run| landed[run.start]) {
        let last = run.clone().rev().find(|&index| facts[index].pressed);
        if let Some(last) = last {
            pressing[run.start..=last].fill(true);
        }
    }
    pressing
}

/// Returns when the fingers leave an object: from the first departure after which no finger returns.
pub(super) fn leaving(facts: &[Facts]) -> Vec<bool> {
    let mut leaving = vec![false; facts.len()];
    let mut end = None;
    for index in (0..facts.len()).rev() {
        let (fingers, after) = (facts[index].fingers, facts.get(index + 1).map_or(0, |next| next.fingers));
        if after == 0 && fingers > 0 {
            end = (index + 1 < facts.len()).then_some((index, 0));
        }
        if let Some((last, most)) = end {
            // Backwards in time, the number of fingers must not decrease.
            if fingers == 0 || fingers < most || last - index > LEAVING {
                end = None;
            } else {
                leaving[index] = true;
                end = Some((last, fingers));
            }
        }
    }
    // The first moments with all fingers in contact do not belong to the departure.
    for run in runs(&leaving).into_iter().filter(|run| leaving[run.start]).collect::<Vec<_>>() {
        let most = facts[run.start].fingers;
        let departure = run.clone().find(|&next| facts[next].fingers < most).unwrap_or(run.end);
        leaving[run.start..departure].fill(false);
    }
    leaving
}

/// Merges primitives that are too short with the next one.
fn short(labels: &mut [&'static str]) {
    for run in runs(labels) {
        if run.len() < SHORTEST && run.start > 0 && run.end < labels.len() {
            let next = labels[run.end];
            labels[run].fill(next);
        }
    }
}

/// Relabels interruptions: following a wall begins and ends with a hold at it and may lose it briefly; an object that is set down may bounce; a hand that
/// comes back and leaves without a touch has only released.
fn relabel_interruptions(labels: &mut [&'static str]) {
    for run in runs(labels) {
        let Some((before, next)) = neighbors(labels, &run) else { continue };
        let into = match (before, labels[run.start], next) {
            ("Translate" | "Follow", "Press", "Follow") | ("Follow", "Translate", "Follow") => "Follow",
            ("Follow", "Press", _) => "Follow",
            ("Place", "Translate", "Place" | "Release") => "Place",
            ("Press", "Place", "Translate") => "Press",
            ("Release", "Approach", "Move") => "Release",
            _ => continue,
        };
        if run.len() < FUMBLED {
            labels[run].fill(into);
        }
    }
}

/// Relabels rests: an object that comes to rest before its release was slid until the release (docs/sources.md, X3).
fn relabel_rests(labels: &mut [&'static str]) {
    for run in runs(labels) {
        if neighbors(labels, &run) == Some(("Slide", "Release")) && labels[run.start] == "Grasp" {
            labels[run].fill("Slide");
        }
    }
}

/// Returns the labels before and after a run.
fn neighbors(labels: &[&'static str], run: &Range<usize>) -> Option<(&'static str, &'static str)> {
    Some((*labels.get(run.start.checked_sub(1)?)?, *labels.get(run.end)?))
}
