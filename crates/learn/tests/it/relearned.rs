//! Written rule files whose guards are learned again.

use crate::synthetic::{RATE_HZ, Synthetic};
use proptest::prelude::*;
use rayon::ThreadPoolBuilder;
use teachtree_engine::evaluator::evaluate;
use teachtree_engine::runs::settle;
use teachtree_language::format::format;
use teachtree_language::graph::lower;
use teachtree_language::guard_sites::guard_sites;
use teachtree_language::rules::{Rules, TreeScope};
use teachtree_language::{Request, load};
use teachtree_learn::{Demonstration, LabeledSpan, MOST_RUNS, RelearnedRules, relearn};

pub const NAME: &str = "written.rules";

pub fn names() -> Vec<String> {
    ["Wait", "Hold", "PickUp"].map(String::from).to_vec()
}

/// A file with these choices.
pub fn written(choices: &str) -> String {
    format!(
        "use \"stream.rules\"\n\nparam pause = 100 ms in 20 ms .. 1 s\nparam held  = 1 s    in 100 ms .. 9 s\n\nstream {{ for each hand {{ gripper.closed : bool }} }}\n\n\
         for each hand {{\n  signal closed = gripper.closed\n  signal high   = place_z > 40 mm    // not checked\n  \
         latch  taken set (closed) for held clear not closed\n}}\n\nprimitive Wait, Hold, PickUp\n\n\
         tree skills for each hand, settle pause {{\n{choices}}}\n"
    )
    .replace("place_z", "mean(fingers.position).z")
}

pub fn loaded(text: &str) -> Option<Rules> {
    load(&Request { texts: vec![(NAME.into(), text.into())], needs_tree: true, ..Request::default() }).rules
}

fn labels(text: &str, recordings: &[Synthetic]) -> Option<Vec<Vec<Vec<LabeledSpan>>>> {
    let rules = loaded(text)?;
    let graph = lower(&rules);
    let settle_s = rules.tree(TreeScope::EachHand)?.settle.as_ref().map_or(0.0, |it| it.value);
    let of_recording = |recording: &Synthetic| {
        let side = recording.who.side()?;
        let mut spans = Vec::new();
        for leaves in evaluate(&graph, &recording.frames(&rules.channels)).ok()? {
            let settled = settle(&leaves.hands[&side], (settle_s * RATE_HZ).round() as usize);
            spans.extend(settled.iter().filter_map(|run| {
                let name = &rules.primitives[run.label?.primitive.index()].name;
                let label = names().iter().position(|known| known == name)?;
                Some(LabeledSpan { label, start_s: run.start as f64 / RATE_HZ, end_s: run.end as f64 / RATE_HZ })
            }));
        }
        Some(vec![spans])
    };
    recordings.iter().map(of_recording).collect()
}

fn relearned(text: &str, recordings: &[Synthetic]) -> RelearnedRules {
    let rules = loaded(text).unwrap_or_else(|| panic!("{text}"));
    let file = rules.sources.files.iter().position(|file| file.name == NAME).unwrap() as u32;
    let demonstrations: Vec<Demonstration> = recordings.iter().map(Synthetic::demonstration).collect();
    relearn(&demonstrations, &names(), (&rules, file), (&|text| labels(text, recordings), MOST_RUNS), &|_| ()).unwrap()
}

pub fn cycles(groups: usize) -> Vec<Synthetic> {
    (0..2 * groups).map(|at| Synthetic::cycles(at as u64, at / 2)).collect()
}

/// The number in the second guard is far too great; what else is written is right.
#[test]
fn one_bad_guard_is_healed_and_the_others_stay() {
    let recordings = cycles(4);
    let text = written(
        "  not closed                       => Wait    // open\n  closed and mean(fingers.position).z > 700 mm => PickUp\n  else => Hold\n",
    );
    let healed = relearned(&text, &recordings);
    assert_eq!(healed.changes.len(), 1, "{healed:#?}");
    let [before, after] = &healed.candidates;
    assert!(before.f1 < 0.9 && after.f1 > 0.99, "{healed:#?}");
    let [without, with] = healed.changes[0].held_out;
    assert!(without[0] < 0.9 && with[0] > 0.99, "{healed:#?}");
    let line = healed.changes[0].line;
    for ((at, old), new) in (1..).zip(text.lines()).zip(healed.text.lines()) {
        if at == line {
            assert!(new.contains("=> PickUp    // learned: held out in 4 groups: F1@50 "), "{new}");
        } else {
            assert_eq!(old, new);
        }
    }
    let found = labels(&healed.text, &recordings).unwrap();
    let again = relearned(&healed.text, &recordings);
    assert!(again.changes.is_empty() && again.text == healed.text, "{again:#?}\n{found:?}");
}

/// A number of a signal, whose line has a comment already.
#[test]
fn a_number_of_a_signal_is_learned_again_and_its_comment_stays() {
    let text =
        written("  not closed => Wait\n  high       => PickUp\n  else       => Hold\n").replace("40 mm", "400 mm");
    let healed = relearned(&text, &cycles(4));
    assert_eq!(healed.changes.len(), 1, "{healed:#?}");
    assert_eq!(healed.changes[0].texts[0], "400 mm");
    assert!(healed.candidates[1].f1 > 0.99, "{healed:#?}");
    let line = healed.text.lines().find(|line| line.contains("signal high")).unwrap();
    assert!(line.contains("    // not checked    // learned: held out in 4 groups"), "{line}");
    let renewed = relearned(&healed.text.replace(&healed.changes[0].texts[1], "400 mm"), &cycles(4));
    assert_eq!(renewed.text, healed.text);
}

/// What a guard lacks is declared.
#[test]
fn a_condition_of_an_undeclared_quantity_is_learned_with_its_declaration() {
    let text = written("  not closed => Wait\n  closed     => PickUp\n  else       => Hold\n")
        .lines()
        .filter(|line| !line.contains("signal high"))
        .fold(String::new(), |text, line| text + line + "\n");
    let healed = relearned(&text, &cycles(4));
    assert!(healed.candidates[1].f1 > 0.99, "{healed:#?}");
    assert!(healed.text.contains("signal height = place.z"), "{}", healed.text);
    assert!(loaded(&healed.text).is_some(), "{}", healed.text);
}

/// The columns of its choices are aligned, another line is not as `fmt` writes it.
#[test]
fn a_file_that_is_not_formatted_keeps_its_columns() {
    let text = written(
        "  not closed                                   => Wait    // open\n  closed and mean(fingers.position).z > 700 mm => PickUp\n  else                                         => Hold\n",
    )
    .replace("Wait, Hold, PickUp", "Wait,Hold,PickUp");
    assert_ne!(format(&text).unwrap(), text);
    let healed = relearned(&text, &cycles(4));
    assert_eq!(healed.changes.len(), 1, "{healed:#?}");
    let [old, new] = &healed.changes[0].texts;
    assert!(new.len() < old.len(), "{healed:#?}");
    let columns = |text: &str| -> Vec<usize> { text.lines().filter_map(|line| line.find("=> ")).collect() };
    assert_eq!(columns(&healed.text), columns(&text), "{}", healed.text);
    for line in text.lines().filter(|line| !line.contains("=> PickUp")) {
        assert!(healed.text.lines().any(|new| new == line), "{line}\n{}", healed.text);
    }
    assert!(loaded(&healed.text).is_some(), "{}", healed.text);
}

/// Signals of the file have the names of quantities, and other values.
#[test]
fn a_learned_quantity_whose_name_is_taken_gets_another_name() {
    let wrong = written("  high => PickUp\n  closed => Hold\n  else => Wait\n")
        .replace("signal closed = gripper.closed", "signal closed = mean(fingers.position).z > 5 m");
    let healed = relearned(&wrong, &cycles(4));
    assert!(healed.candidates[1].f1 > 0.99, "{healed:#?}");
    // The channel keeps its name.
    assert!(healed.text.contains("signal closed_2 = gripper.closed\n"), "{}", healed.text);
    assert!(healed.text.contains("closed_2 => Hold"), "{}", healed.text);
    assert!(healed.text.contains("signal closed = mean(fingers.position).z > 5 m"), "{}", healed.text);
    let lacking = written("  not closed => Wait\n  closed     => PickUp\n  else       => Hold\n")
        .replace("signal high   = mean(fingers.position).z > 40 mm", "signal place  = 5.0");
    let healed = relearned(&lacking, &cycles(4));
    assert!(healed.candidates[1].f1 > 0.99, "{healed:#?}");
    for declaration in
        ["signal place  = 5.0", "signal place_2 = mean(fingers.position)\n", "signal height = place_2.z\n"]
    {
        assert!(healed.text.contains(declaration), "{declaration}\n{}", healed.text);
    }
    assert!(loaded(&healed.text).is_some(), "{}", healed.text);
}

#[test]
fn nothing_changes_without_a_gain() {
    let right = written("  not closed => Wait\n  high       => PickUp\n  else       => Hold\n");
    let noise: Vec<Synthetic> = (0..8).map(|at| Synthetic::of_noise_of_one_hand(at, at as usize / 2)).collect();
    let bad = right.replace("40 mm", "400 mm");
    for (text, recordings) in [(&right, cycles(4)), (&bad, noise)] {
        let same = relearned(text, &recordings);
        assert!(same.changes.is_empty(), "{same:#?}");
        assert_eq!(same.text, *text);
        assert_eq!(
            (same.candidates[0].f1, same.candidates[0].accuracy),
            (same.candidates[1].f1, same.candidates[1].accuracy)
        );
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let text =
        written("  not closed => Wait\n  high       => PickUp\n  else       => Hold\n").replace("40 mm", "400 mm");
    let recordings = cycles(3);
    let with = |threads: usize| {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| relearned(&text, &recordings))
    };
    assert_eq!(with(1), with(4));
}

#[test]
fn a_file_without_choices_is_refused() {
    let text = written("  not closed => Wait\n  high       => PickUp\n  else       => Hold\n");
    let rules = loaded(&text).unwrap();
    let recordings = cycles(2);
    let demonstrations: Vec<Demonstration> = recordings.iter().map(Synthetic::demonstration).collect();
    let stream = rules.sources.files.iter().position(|file| file.name != NAME).unwrap() as u32;
    let run = |text: &str| labels(text, &recordings);
    let refused = relearn(&demonstrations, &names(), (&rules, stream), (&run, MOST_RUNS), &|_| ());
    let refused = refused.unwrap_err().to_string();
    assert!(refused.contains("has no tree and no `extend`, expected a file with choices"), "{refused}");
}

/// What may not change: the branches, their labels, `from`, `stay`, latches and settling.
fn shape(text: &str) -> Vec<String> {
    let rules = loaded(text).unwrap_or_else(|| panic!("{text}"));
    let file = rules.sources.files.iter().position(|file| file.name == NAME).unwrap() as u32;
    let tree = rules.tree(TreeScope::EachHand).unwrap();
    let thens = tree.root.choices.iter().map(|choice| format!("{:?} {:?}", choice.name, choice.then));
    let guards = guard_sites(&rules, file).guards;
    let froms = guards.iter().map(|guard| format!("{:?} {:?}", guard.after, guard.leaves));
    let memory =
        |conjunct: &teachtree_language::guard_sites::Conjunct| conjunct.reads_memory.then(|| conjunct.text.clone());
    let memories = guards.iter().flat_map(|guard| guard.conjuncts.iter().filter_map(memory));
    let latches =
        rules.latches.iter().map(|it| [it.name.clone(), rules.text_of(&it.set), rules.text_of(&it.clear)].join(" "));
    // The tree settles by one param, and the latch reads the other one.
    let params = rules.params.iter().map(|it| format!("{} {}", it.name, it.value));
    thens.chain(froms).chain(memories).chain(latches).chain(params).collect()
}

const CONDITIONS: [&str; 7] = [
    "not closed",
    "high",
    "closed and mean(fingers.position).z > 300 mm",
    "(rises(closed)) within last 5 s",
    "taken and high",
    "(high or not closed) and (closed) for 2 s",
    "(high) within next 4 s",
];
const FROMS: [&str; 4] = ["", "from(Wait, Hold) and ", "not from(PickUp) and ", "from(PickUp, none) and "];

proptest! {
    // A case learns from six recordings.
    #![proptest_config(ProptestConfig { cases: 8, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_shape_of_the_tree_is_unchanged(
        choices in prop::collection::vec((0..CONDITIONS.len(), 0..FROMS.len(), 0..3_usize), 1..4),
        stays in any::<bool>(),
        seed in any::<u32>(),
    ) {
        let name = |label: &usize| names()[*label].clone();
        let lines: String = choices.iter().map(|(condition, from, label)| {
            format!("  {}{} => {}\n", FROMS[*from], CONDITIONS[*condition], name(label))
        }).collect();
        let last = if stays { "  from(none) => Wait\n  else => stay\n" } else { "  else => Hold\n" };
        let text = written(&format!("{lines}{last}"));
        let recordings: Vec<Synthetic> = (0..6).map(|at| Synthetic::cycles(u64::from(seed) + at as u64, at / 2)).collect();
        let learned = relearned(&text, &recordings);
        prop_assert_eq!(shape(&learned.text), shape(&text), "{}", learned.text);
        prop_assert_eq!(learned.changes.is_empty(), learned.text == text);
    }
}

/// A guard over several lines in a branch, with one wrong condition and a comment behind each condition.
#[test]
fn comments_of_a_guard_stay_and_a_branch_is_healed() {
    let of_branch = "  up: mean(fingers.position).z > 700 mm    // off the table\n      and closed    // and held\n  {\n    \
                     closed => PickUp\n    else   => Wait\n  }\n  not closed => Wait\n  else => Hold\n";
    let of_leaf = "  not closed => Wait\n  closed and mean(fingers.position).z > 1 mm    // at least a bit\n      \
                   and mean(fingers.position).z > 700 mm    // off the table\n    => PickUp\n  else => Hold\n";
    for (choices, comments) in
        [(of_branch, ["// off the table", "// and held"]), (of_leaf, ["// at least a bit", "// off the table"])]
    {
        let text = written(choices);
        let healed = relearned(&text, &cycles(4));
        assert!(healed.candidates[1].f1 > 0.99, "{healed:#?}");
        for comment in comments {
            assert_eq!(healed.text.matches(comment).count(), 1, "{}", healed.text);
        }
        assert!(loaded(&healed.text).is_some(), "{}", healed.text);
        for text in healed.changes.iter().flat_map(|change| &change.texts) {
            assert!(!text.contains('\n') && !text.contains("//"), "{text}");
        }
    }
}

/// Comments stay where a condition is removed.
#[test]
fn a_condition_is_removed_without_its_comment() {
    for (guard, left) in [
        ("closed    // first\n      and not closed    // second\n      and high", "closed    // first\n"),
        ("not closed    // first\n      and closed    // second\n      and high", "// first\n"),
    ] {
        let text = written(&format!("  not closed => Wait\n  {guard}    // third\n    => PickUp\n  else => Hold\n"));
        let healed = relearned(&text, &cycles(3));
        assert!(healed.candidates[1].f1 > 0.99 && loaded(&healed.text).is_some(), "{healed:#?}");
        assert_eq!(healed.changes[0].texts[1], "closed and high");
        assert!(healed.text.contains(left), "{}", healed.text);
        for comment in ["// first", "// second", "// third"] {
            assert_eq!(healed.text.matches(comment).count(), 1, "{}", healed.text);
        }
    }
}

/// Declarations are inserted before a tree that begins behind another item.
#[test]
fn a_tree_on_the_line_of_another_item_is_healed() {
    let text = written("  not closed => Wait\n  closed => PickUp\n  else => Hold\n")
        .lines()
        .filter(|line| !line.contains("signal high"))
        .fold(String::new(), |text, line| text + line + "\n")
        .replace("PickUp\n\ntree", "PickUp tree");
    assert!(text.contains("primitive Wait, Hold, PickUp tree skills"), "{text}");
    let healed = relearned(&text, &cycles(4));
    assert!(healed.candidates[1].f1 > 0.99, "{healed:#?}");
    assert!(loaded(&healed.text).is_some(), "{}", healed.text);
}
