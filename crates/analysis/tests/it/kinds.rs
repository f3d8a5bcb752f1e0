//! Rules with kinds do what the same rules do in which every list is written out.

use proptest::prelude::*;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use teachtree_analysis::analyze;
use teachtree_base::hands::{Finger, Side};
use teachtree_engine::evaluator::evaluate;
use teachtree_engine::reference;
use teachtree_frames::frames::{ColumnKey, Frames, HandLayout, Layout};
use teachtree_language as language;
use teachtree_language::graph::lower;
use teachtree_language::rules::*;

fn rules(text: &str) -> Rules {
    let loaded = language::load_text("my.rules", text);
    loaded.rules.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics))
}

/// The leaves of the tree, each on a speed of its own, so that a log with these speeds has these labels.
const TREE: [&str; 6] = ["A", "B", "C", "D", "E", "F"];

/// A rule set in which the primitives are kinds as `parents` says (position of the parent), or with each list written out in full.
struct KindRules {
    parents: Vec<Option<usize>>,
    expands: bool,
}

impl KindRules {
    /// The nearest of the named primitives that this one is, or is a kind of.
    fn counts_for(&self, mut one: usize, named: &[usize]) -> Option<usize> {
        loop {
            if named.contains(&one) {
                return Some(one);
            }
            one = self.parents[one]?;
        }
    }

    /// What stands where `labels` are written in something that names `named`.
    fn list(&self, labels: &[usize], named: &[usize]) -> Vec<&'static str> {
        let counts = |one: &usize| match self.expands {
            true => self.counts_for(*one, named).is_some_and(|label| labels.contains(&label)),
            false => labels.contains(one),
        };
        (0..TREE.len()).filter(counts).map(|one| TREE[one]).collect()
    }

    fn any(&self, labels: &[usize], named: &[usize]) -> String {
        format!("({})", self.list(labels, named).join(" or "))
    }

    fn text(&self, from: &[Vec<usize>], tasks: &[(usize, usize)], relabels: &[[usize; 4]]) -> String {
        let mut text = "stream { for each hand { speed : scalar m/s } }\nprimitive ".to_string();
        let declared = TREE.iter().zip(&self.parents).map(|(name, parent)| match parent {
            Some(parent) if !self.expands => format!("{name} is {}", TREE[*parent]),
            _ => name.to_string(),
        });
        text += &(declared.collect::<Vec<_>>().join(", ") + "\n");
        // Which leaf was before changes what comes: a list of `from` is seen in the leaves.
        text += "tree t for each hand {\n";
        for (at, list) in from.iter().enumerate() {
            let _ = writeln!(
                text,
                "  from({}) and speed > {at} m/s and speed < {}.4 m/s => {}",
                self.list(list, list).join(", "),
                at,
                TREE[(at + 1) % 6]
            );
        }
        for (at, name) in TREE.iter().enumerate() {
            let _ = writeln!(text, "  speed < {} m/s => {name}", at + 1);
        }
        text += "  else => A\n}\n";
        for (at, (key, without)) in tasks.iter().enumerate() {
            // A task begins with A, ends with F: they are named too.
            let named = [0, 5, *key, *without];
            let keys = self.list(&[*key], &named).join(" or ");
            let without = self.list(&[*without], &named).join(", ");
            let _ = writeln!(text, "task t{at} = A .. F with {keys} without {without}");
        }
        text += "relabel {\n";
        for rule in relabels {
            let [what, before, after, becomes] = *rule;
            let [what, before, after] = [what, before, after].map(|label| self.any(&[label], rule));
            let _ = writeln!(text, "  {what}+ between {before} and {after} becomes {}", TREE[becomes]);
        }
        text + "}\n"
    }
}

/// A log of one hand at 100 Hz with these speeds, each for 50 ms.
fn log(rules: &Rules, speeds: &[f64]) -> Frames {
    let values: Vec<f64> = speeds.iter().flat_map(|speed| [*speed; 5]).collect();
    let len = values.len();
    let key = ColumnKey { channel: 0, side: Some(Side::Right), slot: 0, component: 0 };
    let hand =
        HandLayout { side: Side::Right, fingers: vec![Finger::Thumb], contacts: Vec::new(), knows_distance: false };
    assert_eq!(rules.channels[0].name, "speed");
    Frames {
        layout: Layout { rate_hz: 100.0, hands: vec![hand] },
        channels: rules.channels.clone(),
        columns: BTreeMap::from([(key, values)]),
        len,
        time: (0..len).map(|frame| frame as f64 / 100.0).collect(),
        stretches: std::iter::once(0..len).collect(),
        ..Frames::default()
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, failure_persistence: None, ..ProptestConfig::default() })]

    /// Any rules with kinds do what the same rules do in which every list is written out by hand: in both evaluators, relabeled, and in tasks.
    #[test]
    fn kinds_are_lists_written_out(
        // A parent stands before its kinds, so there is no circle; the first and the last label are the ends of tasks.
        parents in prop::collection::vec(prop::option::of(0..6_usize), 6..7),
        from in prop::collection::vec(prop::collection::vec(0..6_usize, 1..4), 0..6),
        tasks in prop::collection::vec((0..6_usize, 0..6_usize), 0..3),
        relabels in prop::collection::vec(prop::array::uniform4(0..6_usize), 0..4),
        speeds in prop::collection::vec(0..12_u32, 1..60),
    ) {
        let parents: Vec<Option<usize>> =
            parents.iter().enumerate().map(|(at, parent)| parent.filter(|parent| *parent < at)).collect();
        let speeds: Vec<f64> = speeds.into_iter().map(|speed| f64::from(speed) / 2.0 + 0.2).collect();
        let [short, long] = [false, true].map(|expands| {
            // What a task begins and ends with is one label, so in the written-out rules kinds of A and F would be missing there.
            let ends = |parent: &usize| *parent != 0 && *parent != 5;
            let parents = parents.iter().map(|parent| parent.filter(|parent| tasks.is_empty() || ends(parent))).collect();
            let rules = rules(&KindRules { parents, expands }.text(&from, &tasks, &relabels));
            let frames = log(&rules, &speeds);
            let literal = reference::evaluate(&rules, &frames).unwrap();
            assert_eq!(evaluate(&lower(&rules), &frames).unwrap(), literal);
            let analysis = analyze(&rules, &frames, &literal);
            let track = analysis.tracks.into_iter().next().unwrap();
            let names = |segments: &[teachtree_analysis::Segment]| -> Vec<_> {
                segments.iter().map(|one| (one.primitive.clone(), one.frames.clone())).collect()
            };
            let tasks: Vec<_> = track.tasks.iter().map(|task| (task.task.clone(), task.secondary.clone(), task.frames.clone())).collect();
            (literal, names(&track.segments), names(&track.relabeled), tasks)
        });
        prop_assert_eq!(short, long);
    }
}
