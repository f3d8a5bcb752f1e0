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
        ("contact.rules", "bimanual.rules", "EqualGrasp, MainGrasp, Pass, Fit"),
        ("contact.rules", "examples/tap.rules", "Tap"),
        ("contact.rules", "examples/hold.rules", "Hold"),
    ] {
        let (status, printed) = prove(base, extended);
        assert_eq!(status, Some(0), "{printed}");
        assert!(printed.contains(&format!("new primitives: {new}")), "{printed}");
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
}

#[test]
fn what_can_not_hold_together_is_no_difference() {
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
    assert!(diff("contact.rules", "pigeons.rules").contains("not all pairs of ways were looked through"));
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
    assert!(github.status.success(), "warnings are no errors");
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
