//! What the rules can tell of a log at all: with each channel that says nothing in it silenced.

use crate::base::channels::Absent;
use crate::base::hands::Side;
use crate::graph::{Graph, Known, Leaf, Target, possible};
use crate::language::rules::{Hand, Label, TreeScope};
use crate::stream::frames::{ColumnKey, Frames, Issue};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// What the rules could tell of a hand, or of both.
#[derive(Debug, Serialize)]
pub struct Track {
    /// A hand, or both.
    pub track: String,
    /// The primitives that can be told.
    pub can: Vec<String>,
    /// Those that cannot.
    pub cannot: Vec<Lack>,
}

/// Primitives that cannot be told, and for lack of what.
#[derive(Debug, Serialize)]
pub struct Lack {
    /// What is lacking.
    pub of: String,
    /// What cannot be told.
    pub primitives: Vec<String>,
}

/// What the trees could tell of each hand, and of both.
pub fn tracks(graph: &Graph, frames: &Frames) -> Vec<Track> {
    let sides: Vec<Side> = frames.layout.hands.iter().map(|hand| hand.side).collect();
    let mut tracks: Vec<Track> =
        sides.iter().map(|side| track(graph, frames, TreeScope::EachHand, Some(*side))).collect();
    if sides.len() > 1 && graph.trees.iter().any(|tree| tree.scope == TreeScope::BothHands) {
        tracks.push(track(graph, frames, TreeScope::BothHands, None));
    }
    tracks
}

/// What cannot be told, as issues of the log.
pub fn issues(graph: &Graph, frames: &Frames) -> Vec<Issue> {
    let at = |time: Option<&f64>| time.copied().unwrap_or_default();
    let (start_s, end_s) = (at(frames.time.first()), at(frames.time.last()));
    let issue = |track: &Track, lack: &Lack| Issue {
        kind: "not_told".into(),
        start_s,
        end_s,
        channel: track.track.clone(),
        message: format!("{} cannot be told: {}", lack.primitives.join(", "), lack.of),
    };
    tracks(graph, frames)
        .iter()
        .flat_map(|track| track.cannot.iter().map(|lack| issue(track, lack)).collect::<Vec<_>>())
        .collect()
}

/// What a tree could tell: with each channel that says nothing silenced, together and one by one.
fn track(graph: &Graph, frames: &Frames, scope: TreeScope, side: Option<Side>) -> Track {
    let silent = silent(frames);
    let known = |silenced: &dyn Fn(&str) -> bool| {
        possible(graph, scope, |channel, hand| {
            let side = match hand {
                Hand::This => side,
                Hand::Named(side) => Some(side),
                Hand::Nobody => None,
            };
            let found = silent.get(&(channel.0, side));
            found.filter(|(of, _)| silenced(of)).map_or(Known::Unknown, |(_, known)| *known)
        })
    };
    let all = possible(graph, scope, |_, _| Known::Unknown);
    let can = known(&|_| true);
    let reasons: BTreeSet<&str> = silent.values().map(|(of, _)| of.as_str()).collect();
    let mut left: BTreeSet<Label> = all.difference(&can).copied().collect();
    let mut cannot = vec![];
    let names = |labels: &BTreeSet<Label>| labels.iter().map(|label| graph.label_name(*label).to_string()).collect();
    for of in &reasons {
        let lost: BTreeSet<Label> = left.difference(&known(&|other| other == *of)).copied().collect();
        if !lost.is_empty() {
            left.retain(|label| !lost.contains(label));
            cannot.push(Lack { of: (*of).to_string(), primitives: names(&lost) });
        }
    }
    // What no single lack explains: as few together as do.
    let mut together: BTreeMap<Vec<&str>, BTreeSet<Label>> = BTreeMap::new();
    for label in left {
        let mut needed: Vec<&str> = reasons.iter().copied().collect();
        for of in &reasons {
            let fewer: Vec<&str> = needed.iter().copied().filter(|other| other != of).collect();
            if !known(&|other| fewer.contains(&other)).contains(&label) {
                needed = fewer;
            }
        }
        together.entry(needed).or_default().insert(label);
    }
    // What stands in the tree, but asks for what the hand file says is never so.
    let never: BTreeSet<Label> = leaves(graph, scope).difference(&all).copied().collect();
    if !never.is_empty() {
        cannot.push(Lack { of: "the hand file says that nothing measures it".into(), primitives: names(&never) });
    }
    cannot.extend(together.into_iter().map(|(of, labels)| Lack { of: of.join(" and "), primitives: names(&labels) }));
    Track { track: side.map_or("both", Side::name).to_string(), can: names(&can), cannot }
}

/// The labels that stand in the trees.
fn leaves(graph: &Graph, scope: TreeScope) -> BTreeSet<Label> {
    let trees = graph.trees.iter().filter(|tree| tree.scope == scope);
    let targets = trees
        .flat_map(|tree| tree.decision.tests.iter().flat_map(|test| [test.yes, test.no]).chain([tree.decision.root]));
    let label = |target| match target {
        Target::Leaf(Leaf::Primitive(label)) => Some(label),
        _ => None,
    };
    targets.filter_map(label).collect()
}

/// The channels that say nothing in this log, with what is to be told about them.
fn silent(frames: &Frames) -> BTreeMap<(u32, Option<Side>), (String, Known)> {
    let mut silent = BTreeMap::new();
    let sides = frames.layout.hands.iter().map(|hand| Some(hand.side)).chain([None]);
    for side in sides {
        for (index, channel) in (0_u32..).zip(&frames.channels) {
            if channel.per_hand != side.is_some() {
                continue;
            }
            let first = ColumnKey { channel: index, side, slot: 0, component: 0 };
            let last = ColumnKey { slot: u32::MAX, component: u32::MAX, ..first };
            let mut columns = frames.columns.range(first..=last).map(|(_, values)| values).peekable();
            if columns.peek().is_none() {
                if let (Some(_), Some((family, _))) = (channel.axis, channel.name.split_once('.')) {
                    silent.insert((index, side), (format!("the log has no {family}"), Known::Empty));
                }
                continue;
            }
            let mut values = columns.flat_map(|column| column.values().iter());
            let Some(first) = values.next() else { continue };
            // What is measured may stand still by chance; a number that is worked out from the scene does not.
            let fixed = first == 0.0 || channel.absent == Absent::Derived && channel.shape.components().len() == 1;
            if fixed && values.all(|value| value == first) {
                let told = if first == 0.0 { "zero" } else { "constant" };
                silent
                    .insert((index, side), (format!("`{}` is {told} all along", channel.name), Known::Constant(first)));
            }
        }
    }
    silent
}
