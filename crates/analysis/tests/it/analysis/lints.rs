//! What is reported about tasks and relabeling rules is so: on any leaves that the trees can give, nothing shows a case against it, and what is
//! shown to go round does.

use super::build::*;
use super::property::{any_label, any_labels, any_leaves, any_rules};
use proptest::prelude::*;
use std::collections::BTreeSet;
use teachtree_analysis::{Analysis, Segment, analyze};
use teachtree_base::diagnostic::{Diagnostic, Span};
use teachtree_base::hands::Side;
use teachtree_engine::runs::{Leaves, Run};
use teachtree_language::codes;
use teachtree_language::lints::cyclic_rewrites::cyclic_rewrites;
use teachtree_language::lints::labels::missing_labels;
use teachtree_language::lints::tasks::hidden_tasks;
use teachtree_language::rules::*;

/// Gives the trees the leaves that are found in a recording, and every rule, task and key a place of its own.
fn fitted(mut rules: Rules, leaves: &Leaves) -> Rules {
    let choice =
        |label| Choice { name: None, condition: None, then: Consequent::Primitive(label), span: Span::default() };
    let given = |runs: &mut dyn Iterator<Item = &Run>| -> Vec<Choice> {
        let labels: BTreeSet<Label> = runs.filter_map(|run| run.label).collect();
        labels.into_iter().map(choice).collect()
    };
    for tree in &mut rules.trees {
        tree.root.choices = match tree.scope {
            TreeScope::EachHand => given(&mut leaves.hands.values().flatten()),
            TreeScope::BothHands => given(&mut leaves.both.iter()),
        };
    }
    let mut next = 0;
    let mut place = || {
        next += 1;
        Span { file: 0, start: next, end: next }
    };
    rules.relabels.iter_mut().for_each(|rule| rule.span = place());
    for task in &mut rules.tasks {
        task.span = place();
        task.keys.iter_mut().for_each(|key| key.span = place());
    }
    rules
}

fn run_leaves(rules: &Rules, leaves: &Leaves) -> Analysis {
    analyze(rules, &moving(std::slice::from_ref(&leaves.frames)), std::slice::from_ref(leaves))
}

fn printed(findings: &[Diagnostic], code: &str) -> BTreeSet<Span> {
    findings.iter().filter(|finding| finding.code == code).filter_map(Diagnostic::place).collect()
}

fn relabeled(analysis: &Analysis) -> impl Iterator<Item = &Segment> {
    analysis
        .tracks
        .iter()
        .flat_map(|track| track.relabeled.iter().chain(track.tasks.iter().flat_map(|task| &task.segments)))
}

/// What is reported about labels of a rule set, held against leaves; how much there was to hold against them.
fn hold_labels(rules: Rules, leaves: &Leaves) -> [usize; 2] {
    let rules = fitted(rules, leaves);
    let (findings, _) = missing_labels(&rules, &BTreeSet::from([0]));
    let analysis = run_leaves(&rules, leaves);
    let idle = printed(&findings, codes::IDLE_RELABEL);
    for rule in rules.relabels.iter().filter(|rule| idle.contains(&rule.span)) {
        assert!(!relabeled(&analysis).any(|segment| segment.by.contains(&rule.text)), "{rule:?}");
        assert!(!analysis.issues.iter().any(|issue| issue.message.contains(&format!("`{}`", rule.text))), "{rule:?}");
    }
    // When tasks are recognized the rules of tasks have not been applied yet.
    let missing = printed(&findings, codes::MISSING_LABEL);
    let mut before = rules.clone();
    before.relabels.retain(|rule| rule.task.is_none());
    let before = run_leaves(&before, leaves);
    for key in rules.tasks.iter().flat_map(|task| &task.keys).filter(|key| missing.contains(&key.span)) {
        let name = rules.label_name(key.label.label);
        let is = |segment: &Segment| segment.primitive == name || segment.primitive.starts_with(&format!("{name}("));
        assert!(!relabeled(&before).any(is), "{name}");
    }
    [idle.len(), missing.len()]
}

/// Pairs of rules that are reported to undo each other do, on the segments that are shown; how many pairs were run.
fn hold_undoing(rules: Rules, leaves: &Leaves) -> usize {
    let rules = fitted(rules, leaves);
    let mut run = 0;
    for undoing in cyclic_rewrites(&rules, &BTreeSet::from([0])) {
        let pair = undoing.pair.map(|at| RelabelRule { task: None, ..rules.relabels[at].clone() });
        let texts = pair.clone().map(|rule| rule.text);
        let alone = Rules { relabels: pair.to_vec(), ..rules.clone() };
        let (least, less) = undoing.lasting_s;
        let lasting = ((least * RATE_HZ).round() as usize).max(1);
        if (less * RATE_HZ).round() as usize <= lasting {
            // At this rate there is nothing between the two.
            continue;
        }
        let run_of =
            |(label, at): (&Label, usize)| Run { start: at * lasting, end: (at + 1) * lasting, label: Some(*label) };
        let runs: Vec<Run> = undoing.segments.iter().zip(0..).map(run_of).collect();
        let frames = 0..runs.len() * lasting;
        let shown = Leaves { frames, hands: [(Side::Right, runs)].into_iter().collect(), both: Vec::new() };
        let analysis = run_leaves(&alone, &shown);
        let stopped = analysis.issues.iter().any(|issue| {
            issue.kind == "relabeling_stopped" && texts.iter().all(|text| issue.message.contains(text.as_str()))
        });
        assert!(stopped, "{:?}: {undoing:?}", analysis.issues);
        run += 1;
    }
    run
}

fn any_tasks() -> impl Strategy<Value = Vec<Task>> {
    let limit = |values: &'static [f64]| prop::option::weighted(0.3, prop::sample::select(values).prop_map(seconds));
    let key = (any_label(), any::<bool>(), limit(&[0.02, 0.05]), limit(&[0.002, 0.006]), limit(&[0.03, 0.1])).prop_map(
        |(label, whole, lasting, travelling, turning)| {
            let label = if whole { Label { side: None, ..label } } else { label };
            Key { label: Pattern::of(label), lasting, travelling, turning, span: Span::default() }
        },
    );
    let task = (
        prop::collection::vec(key, 1..4),
        any::<(bool, bool)>(),
        prop::collection::vec(any_label(), 0..2),
        prop::option::weighted(0.2, any_labels()),
    )
        .prop_map(|(keys, (all_keys, joined), without, ends)| {
            let label = |at| Label { primitive: PrimitiveId(at), side: None };
            let ends = ends.unwrap_or_else(|| vec![label(0), label(7)]);
            let (first, last) = (Pattern::of(ends[0]), Pattern::of(ends[ends.len() - 1]));
            let (name, span) = (String::new(), Span::default());
            let joined = joined && all_keys;
            Task { name, first, last, keys, all_keys, without, joined, failure: false, span }
        });
    prop::collection::vec(task, 1..6)
}

/// Tasks that are reported to be hidden name nothing; how many there were.
fn hold_hidden(mut rules: Rules, mut tasks: Vec<Task>, leaves: &Leaves) -> usize {
    tasks.iter_mut().zip(0..).for_each(|(task, at)| task.name = format!("task {at}"));
    rules.tasks = tasks;
    rules.relabels.retain(|rule| rule.task.is_none());
    let rules = fitted(rules, leaves);
    let hidden = printed(&hidden_tasks(&rules, &BTreeSet::from([0])), codes::HIDDEN_TASK);
    let analysis = run_leaves(&rules, leaves);
    for task in rules.tasks.iter().filter(|task| hidden.contains(&task.span)) {
        let named = analysis.tracks.iter().flat_map(|track| &track.tasks).any(|span| span.task == task.name);
        assert!(!named, "{task:?} in {:?}", rules.tasks);
    }
    hidden.len()
}

proptest! {
    // PROPTEST_CASES asks for more than the usual 256.
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_is_reported_never_to_come_never_comes(rules in any_rules(), leaves in any_leaves(0)) {
        hold_labels(rules, &leaves);
    }

    #[test]
    fn rules_that_undo_each_other_go_round(rules in any_rules(), leaves in any_leaves(0)) {
        hold_undoing(rules, &leaves);
    }

    #[test]
    fn hidden_tasks_name_nothing(rules in any_rules(), tasks in any_tasks(), leaves in any_leaves(0)) {
        hold_hidden(rules, tasks, &leaves);
    }
}

/// The random cases have much to tell, of every kind.
#[test]
fn random_tasks_and_rules_are_worth_telling() {
    use proptest::strategy::ValueTree;
    use proptest::test_runner::TestRunner;
    let mut runner = TestRunner::deterministic();
    let mut counts = [0; 4];
    for _ in 0..2500 {
        let (rules, tasks, leaves) = (any_rules(), any_tasks(), any_leaves(0)).new_tree(&mut runner).unwrap().current();
        let [idle, missing] = hold_labels(rules.clone(), &leaves);
        let undoing = hold_undoing(rules.clone(), &leaves);
        let hidden = hold_hidden(rules, tasks, &leaves);
        counts.iter_mut().zip([idle, missing, undoing, hidden]).for_each(|(count, new)| *count += new);
    }
    assert!(counts.iter().zip([100, 100, 5, 20]).all(|(count, least)| *count >= least), "{counts:?}");
}
