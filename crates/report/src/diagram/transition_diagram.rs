//! Which leaf can follow which, and how often one did in a recording.

use std::collections::BTreeMap;
use teachtree_base::hands::Side;
use teachtree_base::meaning::Primitives;
use teachtree_engine::runs::{Leaves, Run};
use teachtree_language::graph::transitions::{Arrow, NONE, SEPARATE, Transitions};
use teachtree_language::rules::{Rules, TreeScope};

/// The transitions of a tree, with those of a recording if one is shown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TransitionDiagram {
    /// The tree.
    pub tree: String,
    /// `none`, then its leaves.
    pub leaves: Vec<String>,
    /// Leaves that are never reached.
    pub never: Vec<String>,
    /// From one leaf to another one, by their positions.
    pub arrows: BTreeMap<(usize, usize), Arrow>,
    /// The recording, if one is shown.
    pub log: Option<String>,
    /// How often one leaf followed another one in it.
    pub counts: BTreeMap<(usize, usize), usize>,
    /// What was taken on a frame, if one is shown.
    pub now: Vec<CurrentLeaf>,
    /// The primitives of the rules.
    pub primitives: Primitives,
}

/// The leaf of a track on a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CurrentLeaf {
    /// Its caption: `right at 2.500 s: Grasp`.
    pub caption: String,
    /// The leaf before it.
    pub before: String,
    /// The leaf.
    pub leaf: String,
}

/// The transitions of a tree with what the leaves of a recording, if there is one, show of them; `only` leaves the other hand out.
pub fn transition_diagram(
    rules: &Rules,
    of: &Transitions,
    recording: Option<(&str, &[Leaves])>,
    only: Option<Side>,
) -> TransitionDiagram {
    let Transitions { tree, scope, leaves, never, arrows } = of.clone();
    let mut counts = BTreeMap::new();
    for stretch in recording.iter().flat_map(|(_, stretches)| *stretches) {
        let hands = stretch.hands.iter().filter(|(side, _)| only.is_none_or(|only| only == **side));
        let tracks: Vec<&[Run]> = match scope {
            TreeScope::EachHand => hands.map(|(_, runs)| runs.as_slice()).collect(),
            TreeScope::BothHands => vec![&stretch.both],
        };
        for runs in tracks {
            let mut before = NONE.to_string();
            for run in runs {
                let leaf = run.label.map_or(SEPARATE.to_string(), |label| rules.label_name(label));
                let at = |name: &String| leaves.iter().position(|leaf| leaf == name);
                if let (Some(from), Some(to)) = (at(&before), at(&leaf)) {
                    *counts.entry((from, to)).or_default() += 1;
                }
                before = leaf;
            }
        }
    }
    let log = recording.map(|(log, _)| log.to_string());
    TransitionDiagram { tree, leaves, never, arrows, log, counts, now: Vec::new(), primitives: rules.by_name() }
}

impl TransitionDiagram {
    /// The arrows that are drawn: all, or those that the recording shows.
    pub fn shown(&self) -> impl Iterator<Item = ((usize, usize), &Arrow)> {
        let shown = |ends: &(usize, usize)| self.log.is_none() || self.counts.contains_key(ends);
        self.arrows.iter().filter(move |(ends, _)| shown(ends)).map(|(ends, arrow)| (*ends, arrow))
    }

    /// The leaves that are drawn: all, or those that the recording shows.
    pub fn drawn(&self) -> impl Iterator<Item = (usize, &str)> {
        let drawn = |at: usize| self.log.is_none() || self.counts.keys().any(|(from, to)| *from == at || *to == at);
        self.leaves.iter().enumerate().filter(move |(at, _)| drawn(*at)).map(|(at, leaf)| (at, leaf.as_str()))
    }

    /// Whether a leaf is the one of the frame that is shown.
    pub fn is_now(&self, leaf: &str) -> bool {
        self.now.iter().any(|now| now.leaf == leaf)
    }

    /// Whether an arrow is the one that led to the frame that is shown.
    pub fn is_current_transition(&self, (from, to): (usize, usize)) -> bool {
        let named = |at: usize, name: &str| self.leaves.get(at).is_some_and(|leaf| leaf == name);
        self.now.iter().any(|now| named(from, &now.before) && named(to, &now.leaf))
    }
}
