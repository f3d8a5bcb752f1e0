//! A decision tree of frames (CART, Gini impurity) as rules from any label: the other first guess, for labels that depend on the signals of the moment. Only for tracks
//! of one hand, in which a condition and its negation are conditions of the same hand.

use super::bank::Bank;
use super::guards::start;
use super::model::{Model, Rule, guard};
use std::collections::HashMap;

/// Leaves of the tree, at most.
const LEAVES: usize = 8;
/// Conditions above a leaf, at most.
const DEPTH: usize = 4;
/// Labeled frames of a leaf, at least.
const LEAST_FRAMES: usize = 10;
/// The settling time before it is searched.
const SETTLE_MS: u32 = 600;

/// The bits of each label in some tracks, and what a frame of it counts.
struct Labels {
    bits: Vec<Vec<u64>>,
    weights: Vec<f64>,
}

impl Labels {
    /// Half of the weight is even over frames, half over labels.
    fn new(bank: &Bank, tracks: &[usize]) -> Self {
        let mut bits = vec![vec![0_u64; bank.words]; bank.labels];
        for track in tracks {
            let track = &bank.tracks[*track];
            for span in &track.truth.spans {
                for frame in span.start..span.end {
                    bits[span.label][track.words.start + frame / 64] |= 1 << (frame % 64);
                }
            }
        }
        let counts: Vec<f64> = bits.iter().map(|bits| count(bits) as f64).collect();
        let used = counts.iter().filter(|count| **count > 0.0).count().max(1) as f64;
        let all: f64 = counts.iter().sum();
        let weights = counts.iter().map(|count| 0.5 + 0.5 * all / used / count.max(1.0)).collect();
        Self { bits, weights }
    }

    /// The weight of each label on some frames.
    fn weighed(&self, frames: impl Fn(usize) -> u64) -> Vec<f64> {
        let of_label = |bits: &Vec<u64>| {
            let frames =
                bits.iter().enumerate().filter(|(_, bits)| **bits != 0).map(|(word, bits)| bits & frames(word));
            frames.map(|word| f64::from(word.count_ones())).sum::<f64>()
        };
        self.bits.iter().zip(&self.weights).map(|(bits, weight)| weight * of_label(bits)).collect()
    }
}

fn count(bits: &[u64]) -> usize {
    bits.iter().map(|word| word.count_ones() as usize).sum()
}

/// The impurity of weights, times their sum.
fn impurity(weights: &[f64]) -> f64 {
    let sum: f64 = weights.iter().sum();
    if sum > 0.0 { sum - weights.iter().map(|weight| weight * weight).sum::<f64>() / sum } else { 0.0 }
}

struct Node {
    frames: Vec<u64>,
    path: Vec<usize>,
    split: Option<Split>,
}

#[derive(Clone, Copy)]
struct Split {
    gain: f64,
    atom: usize,
    negation: usize,
}

/// The tree of some tracks as rules.
pub(crate) fn tree(bank: &Bank, tracks: &[usize], most: usize) -> Model {
    let labels = Labels::new(bank, tracks);
    let negations = negations(bank);
    let labeled: Vec<u64> =
        (0..bank.words).map(|word| labels.bits.iter().fold(0, |any, bits| any | bits[word])).collect();
    let node = |frames: Vec<u64>, path: Vec<usize>| {
        let split = (path.len() < DEPTH).then(|| split(bank, &labels, &negations, &frames)).flatten();
        Node { frames, path, split }
    };
    let mut nodes = vec![node(labeled, Vec::new())];
    while nodes.len() < LEAVES.min(most) {
        let gain = |node: &Node| node.split.map_or(0.0, |split| split.gain);
        let best = nodes.iter().enumerate().filter(|(_, node)| gain(node) > 0.0);
        let Some((at, _)) = best.reduce(|best, next| if gain(next.1) > gain(best.1) { next } else { best }) else {
            break;
        };
        let Node { frames, path, split } = nodes.remove(at);
        let Some(Split { atom, negation, .. }) = split else { break };
        for side in [atom, negation] {
            let frames = frames.iter().zip(bank.row(side, 0)).map(|(frames, bits)| frames & bits).collect();
            nodes.insert(at, node(frames, [path.as_slice(), &[side]].concat()));
        }
    }
    let rule = |node: &Node| {
        let weights = labels.weighed(|word| node.frames[word]);
        let best = weights.iter().enumerate().reduce(|best, next| if next.1 > best.1 { next } else { best });
        let to = best.map_or(0, |(label, _)| label);
        let all = if bank.labels == 32 { u32::MAX } else { (1 << bank.labels) - 1 };
        Rule { from: all & !(1 << to), atoms: shortened(bank, tracks, node.path.clone()), to }
    };
    let rules = nodes.iter().filter(|node| !node.path.is_empty()).map(rule).collect();
    Model { rules, start: start(bank, tracks), settle_ms: SETTLE_MS }
}

/// A path without the conditions that follow from the others.
fn shortened(bank: &Bank, tracks: &[usize], mut path: Vec<usize>) -> Vec<usize> {
    let whole = guard(bank, &path, tracks);
    let mut at = 0;
    while at < path.len() && path.len() > 1 {
        let mut shorter = path.clone();
        shorter.remove(at);
        if guard(bank, &shorter, tracks) == whole {
            path = shorter;
        } else {
            at += 1;
        }
    }
    path.sort_unstable();
    path
}

/// For each atom another one that holds exactly where it does not.
fn negations(bank: &Bank) -> Vec<Option<usize>> {
    let mut frames = vec![0_u64; bank.words];
    for track in &bank.tracks {
        for frame in 0..track.frames {
            frames[track.words.start + frame / 64] |= 1 << (frame % 64);
        }
    }
    let atoms: HashMap<&[u64], usize> = (0..bank.atoms.len()).map(|atom| (bank.row(atom, 0), atom)).collect();
    let negated =
        |atom: usize| -> Vec<u64> { frames.iter().zip(bank.row(atom, 0)).map(|(all, bits)| all & !bits).collect() };
    (0..bank.atoms.len()).map(|atom| atoms.get(negated(atom).as_slice()).copied()).collect()
}

fn split(bank: &Bank, labels: &Labels, negations: &[Option<usize>], frames: &[u64]) -> Option<Split> {
    let whole = labels.weighed(|word| frames[word]);
    let mut best: Option<Split> = None;
    for (atom, negation) in negations.iter().enumerate() {
        // A split is found once, from the atom before its negation.
        let Some(negation) = negation.filter(|negation| atom < *negation) else { continue };
        let row = bank.row(atom, 0);
        let yes = labels.weighed(|word| frames[word] & row[word]);
        let no: Vec<f64> = whole.iter().zip(&yes).map(|(all, yes)| all - yes).collect();
        let gain = impurity(&whole) - impurity(&yes) - impurity(&no);
        if gain > best.map_or(1e-9, |best| best.gain) {
            let frames_of = |row: &[u64]| {
                frames.iter().zip(row).map(|(all, bits)| (all & bits).count_ones() as usize).sum::<usize>()
            };
            if frames_of(row) >= LEAST_FRAMES && frames_of(bank.row(negation, 0)) >= LEAST_FRAMES {
                best = Some(Split { gain, atom, negation });
            }
        }
    }
    best
}
