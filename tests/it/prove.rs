//! `prove additive` and `diff`: what is proved, and what refutes.

use crate::program::{all_said, teachtree_in};
use std::path::Path;

fn prove(base: &str, extended: &str) -> (Option<i32>, String) {
    let output = teachtree_in(Path::new(env!("CARGO_MANIFEST_DIR")), &["prove", "additive", base, extended]);
    (output.status.code(), all_said(&output))
}

#[test]
fn the_shipped_extensions_only_add() {
    for (base, extended, new) in [
        ("single_hand.rules", "contact.rules", "Press, Follow, Push, Trace"),
        ("contact.rules", "examples/tap.rules", "Tap"),
        ("contact.rules", "examples/hold.rules", "Hold"),
    ] {
        let (status, printed) = prove(base, extended);
        assert_eq!(status, Some(0), "{printed}");
        assert!(printed.contains(&format!("new primitives: {new}")), "{printed}");
        assert!(
            printed.contains("with the hand model hand_force.rules and the declared values of params"),
            "{printed}"
        );
    }
}

/// A tree over both hands that uses a primitive of one hand replaces the labels of each hand.
#[test]
fn a_tree_over_both_hands_with_old_leaves_adds_to_recordings_of_one_hand() {
    let (status, printed) = prove("contact.rules", "bimanual.rules");
    assert_eq!(status, Some(1), "{printed}");
    let told =
        "the tree `both_hands` is new, and its `Translate` replaces the labels of both hands   rules/bimanual.rules:";
    assert!(printed.contains(told), "{printed}");
    assert!(printed.ends_with("  for recordings of one hand, it is proved\n"), "{printed}");
    let new_leaves = "primitive Share does share\ntree both for left, right { both.grasped and left.target == right.target => Share  else => separate }";
    let (status, printed) = compared(CONTACT, &format!("{CONTACT}{new_leaves}"));
    assert_eq!(status, Some(0), "{printed}");
}

const CONTACT: &str = "use \"contact.rules\"\n";
/// A primitive that never occurs, which a proof cannot use.
const EXTRA: &str = "primitive Extra is Translate\nfor each hand { signal never_so = load > 900 N }\n\
                     extend single_hand first { never_so and not from(none) => Extra }\n";

/// Runs `prove additive` on two texts, `base.rules` and `mine.rules`.
fn compared(base: &str, extended: &str) -> (Option<i32>, String) {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("base.rules", base), ("mine.rules", extended)] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let output = teachtree_in(folder.path(), &["prove", "additive", "base.rules", "mine.rules"]);
    let diff = all_said(&teachtree_in(folder.path(), &["diff", "base.rules", "mine.rules"]));
    let said = all_said(&output);
    // A declaration that may change labels is a difference, too.
    let says_nothing = diff.lines().all(|line| line.contains("the same leaf on every frame"));
    assert!(output.status.success() || !says_nothing, "{said}\n{diff}");
    (output.status.code(), said)
}

/// Declarations other than trees that can change the analysis of a recording (docs/proving.md): none is accepted.
#[test]
fn declarations_that_may_change_labels_without_a_new_primitive_refute() {
    let use_base = "use \"base.rules\"\n";
    let two_rules = "Slide between Grasp and Place becomes Place\nPlace between Grasp and Translate becomes Grasp";
    let swapped = "Place between Grasp and Translate becomes Grasp\nSlide between Grasp and Place becomes Place";
    let flag = |default: &str| {
        format!(
            "use \"stream.rules\"\nprimitive A does free, B does close\nstream {{ for each hand {{ optional lamp.on : bool = {default} }} }}\n\
             tree t for each hand {{ lamp.on => B  else => A }}\ntask u = A .. B with B\n"
        )
    };
    let bounded = format!(
        "{CONTACT}relabel {{ (Grasp or Translate)+ shorter than 500 ms between Approach and (Translate or Place) becomes Slide }}"
    );
    let cases: &[(&str, &str, &str)] = &[
        // Ends of tasks.
        (CONTACT, "task extra = Move .. Approach with Extra", "the task `extra` runs from Move to Approach: "),
        (CONTACT, "task extra = Extra .. Grasp with Extra", "the task `extra` runs from Extra to Grasp: "),
        (
            CONTACT,
            "task extra = Approach .. Release with Extra before turn_screw",
            "`extra` runs from Approach to Release",
        ),
        // A new first or last primitive is not a key.
        (CONTACT, "task extra = Extra .. Release with Translate", "the task `extra` needs no new primitive"),
        (CONTACT, "task extra = Move .. Extra with Translate or Extra", "the task `extra` needs no new primitive"),
        // Rules that another rule only seems to cover.
        (&bounded, "relabel { Grasp shorter than 500 ms between Approach and Translate becomes Slide }", "may act"),
        (CONTACT, "relabel { Approach, Extra become Move }", "the rule `Approach, Extra become Move` may act"),
        (CONTACT, "relabel { Grasp between Approach and Translate becomes Extra }", "may act without a new primitive"),
        (CONTACT, "relabel pick_and_place { Place between Translate and Release becomes Release }", "may act"),
        (CONTACT, "relabel { sequence Approach, Extra*, Grasp becomes Grasp }", "may act without a new primitive"),
        // Tasks that are made of tasks, keys, and their order.
        (CONTACT, "task tour = pick_and_place, push", "the task `tour`, made of tasks, needs no new primitive"),
        (CONTACT, "extend task slide with Place", "the task `slide` has other keys"),
        // Data of a recording: rows in which a channel is not measured, and the contact channel.
        (
            CONTACT,
            "stream { for each hand { optional lamp.on : bool = false } }\nextend single_hand.held before Press { lamp.on => Extra }",
            "the channel `lamp.on`, which the base does not read, leaves out rows in which it is not measured   mine.rules:6:",
        ),
        // Touch of a body is read of a scene without that body only if a rule names it.
        (
            CONTACT,
            "stream { for each hand { optional fingers.contact.ghost : bool per finger = false } }\nextend single_hand.held before Press { any(fingers.contact.ghost) => Extra }",
            "the channel `fingers.contact.ghost`, which the base does not read, leaves out rows in which it is not measured",
        ),
        // Trees that the base does not have.
        (
            CONTACT,
            "tree both for left, right { both.grasped => Extra  either.grasped => Grasp  else => separate }",
            "the tree `both` is new, and its `Grasp` replaces the labels of both hands",
        ),
        // Memory and hand models.
        (CONTACT, "use \"hand_flags.rules\"", "the signal `grasped` means something else"),
    ];
    for (base, more, told) in cases {
        let (status, printed) = compared(base, &format!("{use_base}{EXTRA}{more}\n"));
        assert!(status == Some(1) && printed.contains(told), "{more}\n{printed}");
    }
    // Without declarations other than those about a new primitive, the same rules only add.
    for more in [
        "task extra = Move .. Release with Extra",
        "relabel { (Slide or Extra)+ between Approach and Grasp becomes Grasp }",
        "relabel { sequence Approach, Extra, Grasp becomes Extra }",
        "relabel pick_and_place { (Slide or Extra)+ between Place and Release becomes Place }",
        "task extra = Move .. Release with Extra and Translate before pick_and_place\ntask tour = extra, push",
        "extend task slide with Extra",
    ] {
        let (status, printed) = compared(CONTACT, &format!("{use_base}{EXTRA}{more}\n"));
        assert_eq!(status, Some(0), "{more}\n{printed}");
    }
    // Files that repeat the base instead of using it.
    let whole = |rules: &str| format!("{CONTACT}relabel {{\n{rules}\n}}\n");
    for (base, extended, told) in [
        (whole(two_rules), whole(swapped), "is gone, does something else or comes elsewhere"),
        (flag("false"), flag("true"), "the channel `lamp.on` means something else"),
        (flag("false"), flag("false").replace("A does free", "A does carry"), "the primitive `A` means something else"),
        (flag("false"), flag("false").replace("hand { lamp", "hand, settle 50 ms { lamp"), "the settling of `t` means"),
        (flag("false"), flag("false").replace("with B", "with A"), "`u` has other keys"),
    ] {
        let (status, printed) = compared(&base, &extended);
        assert!(status == Some(1) && printed.contains(told), "{told}\n{printed}");
    }
}

/// What the base names stands for kinds of it too, and that changes nothing where no kind occurs.
#[test]
fn kinds_only_add() {
    let folder = tempfile::tempdir().unwrap();
    let mine = "use \"contact.rules\"\nprimitive Lift is Translate, Wait is Approach\n\
                for each hand { signal rising = target.velocity.z > 50 mm/s }\n\
                extend single_hand before carried { rising and grasped and not supported and not walled => Lift }\n\
                extend single_hand.apart first { rising and near and from(Approach) => Wait }\n";
    let text = |more: &str| std::fs::write(folder.path().join("mine.rules"), format!("{mine}{more}")).unwrap();
    let run = || {
        let output = teachtree_in(folder.path(), &["prove", "additive", "contact.rules", "mine.rules"]);
        (output.status.code(), all_said(&output))
    };
    text("");
    let (status, printed) = run();
    assert_eq!(status, Some(0), "{printed}");
    assert!(printed.contains("new primitives: Lift, Wait"), "{printed}");
    // `from(none, Move, Approach)` holds after Wait, so there is nothing to warn of.
    let checked = all_said(&teachtree_in(folder.path(), &["check", "mine.rules"]));
    assert!(checked.contains("0 errors in"), "{checked}");
    // Neither does one that is made of tasks, unless one of them asks for a kind.
    text("task rest = Approach .. Release with Wait before pick_and_place\ntask tour = rest, push\n");
    assert_eq!(run().0, Some(0), "{}", run().1);
    text("task tour = push, slide\n");
    let (status, printed) = run();
    assert!(status == Some(1) && printed.contains("`tour`, made of tasks, needs no new primitive"), "{printed}");
    // A task that asks for the parent needs no kind.
    text("task rise = Move .. Release with Translate lasting 9 s before pick_and_place\n");
    assert_eq!(run().0, Some(1));
}

/// An extension of the single hand: its text, and what refutes it.
fn refuted(extension: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("mine.rules"), format!("use \"single_hand.rules\"\n{extension}\n")).unwrap();
    let output = teachtree_in(folder.path(), &["prove", "additive", "single_hand.rules", "mine.rules"]);
    assert_eq!(output.status.code(), Some(1), "{}", all_said(&output));
    all_said(&output)
}

#[test]
fn a_broken_extension_is_refuted_with_a_case() {
    insta::assert_snapshot!(refuted("extend single_hand.held first { moving and lifted => Translate }"));
}

#[test]
fn tasks_and_rules_that_act_without_a_new_primitive_refute() {
    let printed = refuted(
        "primitive Wait\nextend single_hand.held first { moving and not moving => Wait }\nrelabel { Slide between Grasp and Place becomes Place }",
    );
    assert!(
        printed.contains("the rule `Slide between Grasp and Place becomes Place` may act without a new primitive"),
        "{printed}"
    );
    let printed = refuted("task slide_far = Move .. Release with Slide travelling 90 mm before slide");
    assert!(printed.contains("the task `slide_far` needs no new primitive"), "{printed}");
    let printed = refuted("task lost = Move .. Release with Slide travelling 90 mm is failure before slide");
    assert!(printed.contains("the task `lost` needs no new primitive"), "{printed}");
}

/// The outcome of a task is part of its meaning; a new failure is a new task.
#[test]
fn outcomes_of_tasks_are_compared() {
    let jam = |task: &str, row: &str| {
        format!("{CONTACT}task jam = Move .. Release with Press and Grasp{task}\ntask row = jam+{row}\n")
    };
    let (plain, failed) = (jam("", ""), jam(" is failure", " is failure"));
    assert_eq!(compared(&failed, &failed).0, Some(0));
    for (base, extended, found) in [
        (&plain, &jam(" is failure", ""), "the task `jam` is a failure now"),
        (&plain, &jam("", " is failure"), "the task `row` is a failure now"),
        (&failed, &jam("", " is failure"), "the task `jam` is a success now"),
    ] {
        let (status, printed) = compared(base, extended);
        assert!(status == Some(1) && printed.contains(found), "{printed}");
    }
    let lift = "primitive Lift is Translate\nfor each hand { signal rising = target.velocity.z > 50 mm/s }\n\
                extend single_hand before carried { rising and grasped and not supported and not walled => Lift }\n";
    let mine = format!("{CONTACT}{lift}task overshot = Move .. Release with Lift is failure before pick_and_place\n");
    let (status, printed) = compared(CONTACT, &mine);
    assert_eq!(status, Some(0), "{printed}");
}

#[test]
fn what_can_not_hold_together_is_not_a_difference() {
    let folder = tempfile::tempdir().unwrap();
    // The base gives Insert above 5 mm/s: what is added lies within, or gives what the base gives.
    let rules =
        "use \"single_hand.rules\"\nextend single_hand.inside before Pullout { target.sinking > 8 mm/s => Pullout }\n";
    std::fs::write(folder.path().join("mine.rules"), rules).unwrap();
    let output = teachtree_in(folder.path(), &["prove", "additive", "single_hand.rules", "mine.rules"]);
    assert_eq!(output.status.code(), Some(0), "{}", all_said(&output));
    std::fs::write(folder.path().join("mine.rules"), rules.replace("8 mm/s", "2 mm/s")).unwrap();
    let output = teachtree_in(folder.path(), &["prove", "additive", "single_hand.rules", "mine.rules"]);
    assert_eq!(output.status.code(), Some(1), "{}", all_said(&output));
}

#[test]
fn diff_tells_cases_and_intervals() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let args = [
        "diff",
        "single_hand.rules",
        "contact.rules",
        "demos/robosuite/SawyerLift_demo_1.csv",
        "--binding",
        "demos/robosuite/sawyer_lift.binding.yaml",
    ];
    let printed = all_said(&teachtree_in(root, &args));
    assert!(printed.contains("becomes Follow   rules/contact.rules:"), "{printed}");
    assert!(printed.contains("  right 10.844 – 10.874 s: Approach becomes Grasp\n"), "{printed}");
    // Its primitive is a kind of what `push` must not have.
    let own = all_said(&teachtree_in(root, &["diff", "contact.rules", "examples/primitives/shake/shake.rules"]));
    assert!(own.contains("the task `push` differs only in new primitives\n"), "{own}");
    let same = all_said(&teachtree_in(root, &["diff", "contact.rules", "contact.rules"]));
    assert!(same.contains("single_hand: the same leaf on every frame"), "{same}");
}

#[test]
fn diff_tells_of_rules_and_ends_when_there_is_too_much_to_look_through() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: String| std::fs::write(folder.path().join(name), text).unwrap();
    let rule = "Slide shorter than 80 ms between Grasp and Grasp becomes Grasp";
    write("one.rules", format!("use \"contact.rules\"\nrelabel {{ {rule} }}\n"));
    write("other.rules", "use \"contact.rules\"\n".into());
    let diff = |one: &str, other: &str| all_said(&teachtree_in(folder.path(), &["diff", one, other]));
    assert!(diff("one.rules", "other.rules").starts_with(&format!("in other.rules the rule `{rule}` is gone\n")));
    assert!(diff("other.rules", "one.rules").starts_with(&format!("in one.rules the rule `{rule}` is new\n")));
    // Six pigeons in five holes: it never holds, but nothing short of trying says so.
    let hole = |pigeon: usize, hole: usize| format!("p{}", pigeon * 5 + hole);
    let signal = |at: usize| format!("  signal p{at} = rate(load, {0} ms) > {0} N/s\n", at + 1);
    let signals: String = (0..30).map(signal).collect();
    let all_somewhere = (0..6).map(|pigeon| {
        let holes: Vec<String> = (0..5).map(|at| hole(pigeon, at)).collect();
        format!("({})", holes.join(" or "))
    });
    let pairs = (0..6).flat_map(|one| (one + 1..6).map(move |other| (one, other)));
    let none_together =
        pairs.flat_map(|(one, other)| (0..5).map(move |at| format!("not ({} and {})", hole(one, at), hole(other, at))));
    let condition = all_somewhere.chain(none_together).collect::<Vec<_>>().join(" and ");
    let rules = format!(
        "use \"contact.rules\"\nfor each hand {{\n{signals}}}\nextend single_hand before carried {{ {condition} => Slide }}\n"
    );
    write("pigeons.rules", rules);
    let output = teachtree_in(folder.path(), &["prove", "additive", "contact.rules", "pigeons.rules"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(all_said(&output).contains("undecided"), "{}", all_said(&output));
    assert!(diff("contact.rules", "pigeons.rules").contains("the comparison reached its limit of paths"));
}

#[test]
fn check_tells_programs_and_explains_codes() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let rules = "tests/fixtures/diagnostics/after_else.rules";
    let json = teachtree_in(root, &["check", rules, "--format", "json"]);
    assert_eq!(json.status.code(), Some(1));
    let document: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    let finding = &document["findings"][0];
    assert_eq!(
        (finding["code"].as_str(), finding["labels"][0]["at"]["start"]["line"].as_u64()),
        (Some("E402"), Some(7))
    );
    let github = all_said(&teachtree_in(root, &["check", rules, "--format", "github"]));
    let wanted = format!(
        "::error file={rules},line=7,col=3,endLine=7,endColumn=24,title=E402::this choice is never reached%0Amove it up\n"
    );
    assert_eq!(github, wanted);
    // A frame that shows what is meant goes along.
    let rules = "tests/fixtures/diagnostics/falls_through.rules";
    let json = teachtree_in(root, &["check", rules, "--format", "json"]);
    let document: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    let note = document["findings"][0]["notes"][0].as_str().unwrap();
    assert!(note.starts_with("for instance on a frame where ") && note.contains("`load` is 1.5 N"), "{note}");
    let github = all_said(&teachtree_in(root, &["check", rules, "--format", "github"]));
    let first = github.lines().next().unwrap();
    assert!(
        first.starts_with("::error file=")
            && first.contains(&format!("title=E401::this branch leaves frames without a choice%0A{note}%0A")),
        "{first}"
    );
    let rules = "tests/fixtures/diagnostics/undoing_rules.rules";
    let github = teachtree_in(root, &["check", rules, "--format", "github"]);
    assert!(github.status.success(), "warnings are not errors");
    assert!(
        all_said(&github).contains("title=W409::two rules undo each other%0Afor instance "),
        "{}",
        all_said(&github)
    );
    let page = teachtree_in(root, &["check", "--explain", "e402"]);
    assert!(
        page.status.success() && all_said(&page).starts_with("E402\n\nA choice follows `else`."),
        "{}",
        all_said(&page)
    );
    assert_eq!(teachtree_in(root, &["check", "--explain", "E999"]).status.code(), Some(2));
}
