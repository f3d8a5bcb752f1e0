//! `test`: recordings against what is expected of them, with the program alone, outside the repository.

use crate::program::{all_said, teachtree_in};
use std::path::Path;

/// A folder with two recordings and a binding, and expectations of what they give.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let demos = Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite");
    for file in ["SawyerLift_demo_1.csv", "sawyer_lift.binding.yaml"] {
        std::fs::copy(demos.join(file), folder.path().join(file)).unwrap();
    }
    let update = teachtree_in(folder.path(), &["test", "--update", "--binding", "sawyer_lift.binding.yaml"]);
    assert!(update.status.success(), "{}", all_said(&update));
    folder
}

const EXPECT: &str = "SawyerLift_demo_1.expect";

#[test]
fn what_was_accepted_is_expected() {
    let folder = folder();
    let text = std::fs::read_to_string(folder.path().join(EXPECT)).unwrap();
    insta::assert_snapshot!(text);
    let again = teachtree_in(folder.path(), &["test"]);
    assert_eq!(again.status.code(), Some(0), "{}", all_said(&again));
    assert!(all_said(&again).contains("1 recording: 1 as expected, 0 not"), "{}", all_said(&again));
}

#[test]
fn a_difference_is_reported_with_line_and_time() {
    let folder = folder();
    let path = folder.path().join(EXPECT);
    let text = std::fs::read_to_string(&path).unwrap();
    let moved = text.replace("10.984 .. 11.684", "10.934 .. 11.684").replace("  Grasp ", "  Trace ");
    assert_ne!(moved, text);
    std::fs::write(&path, &moved).unwrap();
    let output = teachtree_in(folder.path(), &["test", "."]);
    assert_eq!(output.status.code(), Some(1));
    insta::assert_snapshot!(all_said(&output));
    // Wider tolerances, and acceptance.
    std::fs::write(&path, moved.replace("  Trace ", "  Grasp ").replace("tolerance: 20 ms", "tolerance: 60 ms"))
        .unwrap();
    assert_eq!(teachtree_in(folder.path(), &["test", EXPECT]).status.code(), Some(0));
    std::fs::write(&path, format!("# why it is here\n{moved}")).unwrap();
    let accepted = teachtree_in(folder.path(), &["test", EXPECT, "--update", "--replace"]);
    assert!(accepted.status.success(), "{}", all_said(&accepted));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), format!("# why it is here\n{text}"));
}

/// What an operator corrected stays: `--update` adds what no line expects, `--replace` replaces lines that are not pinned.
#[test]
fn what_a_person_wrote_is_not_replaced_unasked() {
    let folder = folder();
    let path = folder.path().join(EXPECT);
    let text = std::fs::read_to_string(&path).unwrap();
    let run = |args: &[&str]| teachtree_in(folder.path(), &[&["test", EXPECT][..], args].concat());
    // One line is missing, one was corrected and has a comment, and there is a comment of its own.
    let grasp = text.lines().find(|line| line.trim_start().starts_with("Grasp ")).unwrap();
    let corrected = text
        .replace("10.984 .. 11.684", "10.934 .. 11.684  # seen in the video")
        .replace(&format!("{grasp}\n"), "  # the fingers close here\n");
    std::fs::write(&path, &corrected).unwrap();
    let added = run(&["--update"]);
    assert_eq!(added.status.code(), Some(1), "{}", all_said(&added));
    let printed = all_said(&added);
    assert!(
        printed.contains("added to ") && printed.contains("expected 10.934 s") && printed.contains("--replace"),
        "{printed}"
    );
    let now = std::fs::read_to_string(&path).unwrap();
    let mut lines: Vec<&str> = now.lines().collect();
    lines.retain(|line| *line != grasp);
    assert_eq!(lines, corrected.lines().collect::<Vec<_>>(), "nothing but the missing line is new");
    assert!(now.contains(grasp));
    // Once more there is nothing to add.
    assert_eq!(run(&["--update"]).status.code(), Some(1));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), now);
    // Pinned, it stays whatever is asked for; without the mark it is replaced, and comments stay.
    let pinned = now.replace("10.934 .. 11.684  #", "10.934 .. 11.684  pinned  #");
    std::fs::write(&path, &pinned).unwrap();
    let output = run(&["--update", "--replace"]);
    assert_eq!(output.status.code(), Some(1), "{}", all_said(&output));
    assert!(all_said(&output).contains("pinned lines are not replaced"), "{}", all_said(&output));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), pinned);
    std::fs::write(&path, &now).unwrap();
    let output = run(&["--update", "--replace"]);
    assert_eq!(output.status.code(), Some(0), "{}", all_said(&output));
    let accepted = std::fs::read_to_string(&path).unwrap();
    assert!(accepted.contains("10.984 .. 11.684\n") && accepted.contains("  # the fingers close here\n"), "{accepted}");
    assert_eq!(run(&[]).status.code(), Some(0));
    // A track without expectations is added as a whole.
    let (head, _) = text.split_once("\ntrack").unwrap();
    std::fs::write(&path, head).unwrap();
    assert_eq!(run(&["--update"]).status.code(), Some(0));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
}

/// A folder of recordings can be moved, and checked out elsewhere: no path of this machine is written.
#[test]
fn expectations_name_files_relative_to_themselves() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    std::fs::create_dir_all(path("rules")).unwrap();
    std::fs::create_dir_all(path("logs/monday")).unwrap();
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("rules");
    for name in ["contact.rules", "single_hand.rules", "hand_force.rules", "stream.rules"] {
        std::fs::copy(shipped.join(name), path("rules").join(name)).unwrap();
    }
    std::fs::rename(path("SawyerLift_demo_1.csv"), path("logs/monday/SawyerLift_demo_1.csv")).unwrap();
    std::fs::remove_file(path(EXPECT)).unwrap();
    let rules = path("rules/single_hand.rules");
    let args = [
        "test",
        "logs/monday",
        "--update",
        "--binding",
        "sawyer_lift.binding.yaml",
        "--rules",
        rules.to_str().unwrap(),
    ];
    let update = teachtree_in(folder.path(), &args);
    assert!(update.status.success(), "{}", all_said(&update));
    let text = std::fs::read_to_string(path("logs/monday").join(EXPECT)).unwrap();
    assert!(text.contains("\nbinding: ../../sawyer_lift.binding.yaml\n"), "{text}");
    assert!(text.contains("\nrules: ../../rules/single_hand.rules\n"), "{text}");
    // All of it moves, and is met from any folder.
    let moved = folder.path().join("elsewhere");
    std::fs::create_dir(&moved).unwrap();
    for name in ["logs", "rules", "sawyer_lift.binding.yaml"] {
        std::fs::rename(path(name), moved.join(name)).unwrap();
    }
    for at in [folder.path(), &moved, &moved.join("logs")] {
        let output = teachtree_in(at, &["test"]);
        assert!(output.status.success(), "{}", all_said(&output));
    }
}

/// `NAME.expect.new` is read, and accepted, by the code that `cargo insta review` runs.
#[test]
fn what_was_found_instead_can_be_reviewed_with_cargo_insta() {
    let folder = folder();
    let path = folder.path().join(EXPECT);
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replace("10.984 .. 11.684", "10.934 .. 11.684")).unwrap();
    let pending = folder.path().join(format!("{EXPECT}.new"));
    assert_eq!(teachtree_in(folder.path(), &["test"]).status.code(), Some(1));
    assert!(!pending.exists(), "nothing is written that was not asked for");
    let output = teachtree_in(folder.path(), &["test", "--pending"]);
    assert_eq!(output.status.code(), Some(1), "{}", all_said(&output));
    assert!(all_said(&output).contains("cargo insta review"), "{}", all_said(&output));
    let new = insta::Snapshot::from_file(&pending).unwrap();
    assert_eq!(new.metadata().source(), Some("SawyerLift_demo_1.csv"));
    new.save(&path).unwrap();
    let accepted = std::fs::read_to_string(&path).unwrap();
    assert!(
        accepted.starts_with("---\n") && accepted.ends_with(text.trim_end_matches('\n')) || accepted.contains(&text),
        "{accepted}"
    );
    // It is met now, nothing is pending any more, and the header stays.
    let met = teachtree_in(folder.path(), &["test", "--pending"]);
    assert_eq!(met.status.code(), Some(0), "{}", all_said(&met));
    assert!(!pending.exists());
    std::fs::write(&path, accepted.replace("10.984 .. 11.684", "10.934 .. 11.684")).unwrap();
    let printed = all_said(&teachtree_in(folder.path(), &["test"]));
    let line = 1 + accepted.lines().position(|line| line.contains("10.984 .. 11.684")).unwrap();
    assert!(printed.contains(&format!("{EXPECT}:{line}: ")), "{printed}");
    assert!(teachtree_in(folder.path(), &["test", "--update", "--replace"]).status.success());
    assert_eq!(std::fs::read_to_string(&path).unwrap(), accepted);
}

#[test]
fn coverage_says_what_no_recording_shows() {
    let folder = folder();
    let output = teachtree_in(folder.path(), &["test", "--coverage", "--min-coverage", "99"]);
    assert_eq!(output.status.code(), Some(1));
    let printed = all_said(&output);
    assert!(printed.contains("FAILED   coverage is"), "{printed}");
    // The lift is not an insertion, and its object is carried.
    assert!(printed.contains("never true  inserted   rules/single_hand.rules:"), "{printed}");
    assert!(printed.contains("never taken screwing => Turn   rules/single_hand.rules:"), "{printed}");
    assert!(!printed.contains("carried: not supported and not walled => Translate"), "{printed}");
    assert_eq!(teachtree_in(folder.path(), &["test", "--min-coverage", "10"]).status.code(), Some(0));
}

#[test]
fn mutation_says_which_changes_nothing_notices() {
    let folder = folder();
    let output = teachtree_in(folder.path(), &["test", "--mutate"]);
    assert_eq!(output.status.code(), Some(0), "{}", all_said(&output));
    let printed = all_said(&output);
    let place = |name: &str| {
        let rules = Path::new(env!("CARGO_MANIFEST_DIR")).join("rules/single_hand.rules");
        let text = std::fs::read_to_string(rules).unwrap();
        1 + text.lines().position(|line| line.contains(name)).unwrap()
    };
    let line = |name: &str, change: &str| {
        let at = format!("rules/single_hand.rules:{}:", place(name));
        printed.lines().any(|line| line.contains(&at) && line.contains(change))
    };
    // Without an insertion, another depth changes nothing; without `touching` everything changes.
    assert!(line("signal past_rim", "the thresholds halved"), "{printed}");
    assert!(!line("signal touching", "the comparison reversed"), "{printed}");
    // Each of them is followed by the kind of recording that would notice it.
    let lines: Vec<&str> = printed.lines().collect();
    let unnoticed = lines.windows(2).filter(|pair| pair[0].starts_with("  not noticed: "));
    let witnesses: Vec<&str> = unnoticed.map(|pair| pair[1]).collect();
    assert!(witnesses.len() > 10, "{printed}");
    for witness in witnesses {
        assert!(witness.starts_with("    a recording ") && witness.ends_with(" would notice it"), "{witness}");
    }
    assert!(
        printed.contains("in which `target.depth` peaks or settles between 1 mm and 2 mm would notice it"),
        "{printed}"
    );
}

#[test]
fn broken_expectations_are_bad_input() {
    let folder = tempfile::tempdir().unwrap();
    let nothing = teachtree_in(folder.path(), &["test"]);
    assert_eq!(nothing.status.code(), Some(2));
    assert!(all_said(&nothing).contains("there are no expectations"), "{}", all_said(&nothing));
    for (text, wanted) in [
        ("tolerance: 20 ms\n", "names no log"),
        ("log: a.csv\ntolerance: wide\n", "a.expect:2: `wide` is not a tolerance"),
        ("log: a.csv\ntrack right\n  Grasp 1\n", "a.expect:3: expected a segment"),
        ("log: a.csv\ntrack upper\n", "a.expect:2: there is no track `upper`"),
        ("log: a.csv\ncolour: red\n", "a.expect:2: there is no setting `colour`"),
        ("log: a.csv\ntrack right\n  Grasp 2 .. 1\n", "a.expect:3: `Grasp 2 .. 1` ends before it begins"),
    ] {
        std::fs::write(folder.path().join("a.expect"), text).unwrap();
        let output = teachtree_in(folder.path(), &["test"]);
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(all_said(&output).contains(wanted), "{text}: {}", all_said(&output));
    }
}

/// What an expectation names is looked up before it is compared, and errors say which expectation it was.
#[test]
fn names_in_expectations_are_those_of_the_rules() {
    let folder = folder();
    let path = folder.path().join(EXPECT);
    let text = std::fs::read_to_string(&path).unwrap();
    for (from, to, wanted) in [
        ("  Grasp ", "  Grsap ", "there is no primitive"),
        ("task pick_and_place", "task pick_and_plaec", "there is no task"),
        ("tolerance: 20 ms", "tolerance: 20 ms\nset: nope = 3 mm", "a file that it names cannot be used"),
    ] {
        let wrong = text.replace(from, to);
        assert_ne!(wrong, text, "{from}");
        std::fs::write(&path, wrong).unwrap();
        let output = teachtree_in(folder.path(), &["test"]);
        assert_eq!(output.status.code(), Some(2), "{to}: {}", all_said(&output));
        let wanted = wanted.replace("there is", "the rules have");
        assert!(all_said(&output).contains(&wanted) && all_said(&output).contains(EXPECT), "{}", all_said(&output));
    }
    std::fs::write(&path, text.replace("  Grasp ", "  Grsap ")).unwrap();
    assert!(all_said(&teachtree_in(folder.path(), &["test"])).contains("did you mean `Grasp`?"));
}

#[test]
fn options_that_would_not_count_are_refused() {
    let folder = folder();
    let output = teachtree_in(folder.path(), &["test", "--set", "touch_on=0.1N"]);
    assert_eq!(output.status.code(), Some(2), "{}", all_said(&output));
    // A new expectation that cannot be made leaves nothing behind.
    std::fs::remove_file(folder.path().join(EXPECT)).unwrap();
    std::fs::write(folder.path().join("bad.rules"), "signal a = (").unwrap();
    let output = teachtree_in(folder.path(), &["test", "--update", "--rules", "bad.rules"]);
    assert_eq!(output.status.code(), Some(2), "{}", all_said(&output));
    assert!(!folder.path().join(EXPECT).exists());
}

#[test]
fn coverage_and_mutation_can_be_of_one_rule_file() {
    let folder = folder();
    let hold = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/hold.rules");
    std::fs::copy(hold, folder.path().join("hold.rules")).unwrap();
    std::fs::remove_file(folder.path().join(EXPECT)).unwrap();
    let options = ["--rules", "hold.rules", "--binding", "sawyer_lift.binding.yaml"];
    assert!(teachtree_in(folder.path(), &[&["test", "--update"][..], &options].concat()).status.success());
    let only = teachtree_in(folder.path(), &["test", "--coverage", "--mutate", "--only", "hold.rules"]);
    assert!(only.status.success(), "{}", all_said(&only));
    insta::assert_snapshot!(all_said(&only));
    let unknown = teachtree_in(folder.path(), &["test", "--coverage", "--only", "tap.rules"]);
    assert_eq!(unknown.status.code(), Some(2));
    let said = all_said(&unknown);
    assert!(
        said.contains("tap.rules: no expectation uses this rule file; found ") && said.contains("hold.rules"),
        "{said}"
    );
}

#[test]
fn a_log_is_not_an_expectation() {
    let folder = folder();
    let refused = |name: &str| {
        let output = teachtree_in(folder.path(), &["test", name]);
        assert_eq!(output.status.code(), Some(2));
        all_said(&output)
    };
    insta::assert_snapshot!(refused("SawyerLift_demo_1.csv"));
    std::fs::remove_file(folder.path().join(EXPECT)).unwrap();
    insta::assert_snapshot!(refused("SawyerLift_demo_1.csv"));
}

/// `=> P(side)` is a choice of the left and one of the right hand; each of them is taken, or is not.
#[test]
fn a_choice_of_either_hand_is_two_choices() {
    const RULES: &str = "stream { for each hand { grip : scalar N } }
primitive Idle, Both, Main(side)
tree hand for each hand { else => Idle }
tree both for left, right {
  grip > 2 * other.grip => Main(side)
  else                  => Both
}
";
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("grip.rules"), RULES).unwrap();
    let rows: String = (0..200).map(|row| format!("{},{},1\n", f64::from(row) / 100.0, 1 + row / 100 * 4)).collect();
    std::fs::write(folder.path().join("log.csv"), format!("time[s],left.grip[N],right.grip[N]\n{rows}")).unwrap();
    let scene = "bodies: {}\nhands: {left: {fingers: [thumb], tip_radius: 8 mm}, right: {fingers: [thumb], tip_radius: 8 mm}}\n";
    std::fs::write(folder.path().join("log.scene.yaml"), scene).unwrap();
    let shown = all_said(&teachtree_in(folder.path(), &["graph", "grip.rules"]));
    let lines: Vec<_> = shown.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")).collect();
    assert!(lines.contains(&"left.grip > 2 * right.grip => Main(left)".to_string()), "{shown}");
    assert!(lines.contains(&"right.grip > 2 * left.grip => Main(right)".to_string()), "{shown}");
    let update = teachtree_in(folder.path(), &["test", ".", "--update", "--rules", "grip.rules"]);
    assert!(update.status.success(), "{}", all_said(&update));
    let printed = all_said(&teachtree_in(folder.path(), &["test", "--coverage"]));
    assert!(printed.contains("never taken right.grip > 2 * left.grip => Main(right)"), "{printed}");
    assert!(!printed.contains("=> Main(left)"), "{printed}");
}
