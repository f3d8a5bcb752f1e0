//! Files in the place of other ones, and logs of foreign columns: the message names what was found, and the option that takes it.

use crate::program::{complained, teachtree};

const LOG: &str = "demos/robosuite/lift_demo_1.csv";
const BINDING: &str = "demos/robosuite/panda_lift.binding.yaml";
const SCENE: &str = "demos/robosuite/panda_lift.scene.yaml";
const RULES: &str = "examples/hold.rules";

fn refused(args: &[&str]) -> String {
    let output = teachtree(args);
    assert_eq!(output.status.code(), Some(2), "{args:?}: {}", complained(&output));
    complained(&output)
}

#[test]
fn files_in_the_place_of_others_are_named() {
    let swapped = format!("LOG and --binding are swapped: `{LOG} --binding {BINDING}`");
    let by_rules = format!("name it with `--rules {RULES}`, or check it");
    let by_scene = format!("name it with `--scene {SCENE}`");
    let by_binding = format!("name it with `--binding {BINDING}`");
    let by_analyze = format!("`teachtree analyze {LOG}` reads it");
    for (args, message, help) in [
        (&["analyze", BINDING, "--binding", LOG][..], "found a binding, expected a log", swapped.as_str()),
        (&["analyze", BINDING], "found a binding, expected a log", &by_binding),
        (&["inspect", SCENE], "found a scene, expected a log", &by_scene),
        (&["analyze", RULES], "found a rule file, expected a log", &by_rules),
        (&["analyze", LOG, "--binding", SCENE], "found a scene, expected a binding", &by_scene),
        (&["analyze", LOG, "--binding", RULES], "found a rule file, expected a binding", &by_rules),
        (&["analyze", LOG, "--binding", LOG], "found a log, expected a binding", &by_analyze),
        (&["analyze", LOG, "--scene", BINDING], "found a binding, expected a scene", &by_binding),
        (&["analyze", LOG, "--binding", BINDING, "--rules", SCENE], "found a scene, expected a rule file", &by_scene),
        (&["analyze", LOG, "--binding", BINDING, "--hand", SCENE], "found a scene, expected a rule file", &by_scene),
        (&["check", LOG], "found a log, expected a rule file", &by_analyze),
    ] {
        let said = refused(args);
        assert!(said.contains(message) && said.contains(help), "{args:?}: {said}");
    }
}

/// All commands check the files of their arguments before they run, and name the option.
#[test]
fn every_command_names_the_argument_that_has_another_file() {
    let rules = format!("--rules {BINDING}: found a binding, expected a rule file");
    let hand = format!("--hand {BINDING}: found a binding, expected a rule file");
    let labels = format!("--labels {RULES}: found a rule file, expected a file of labels");
    let swapped = format!("and --binding are swapped: `{LOG} --binding {BINDING}`");
    let retarget = format!("help: `teachtree retarget {LOG} -o commands.json` writes them");
    let dropped = format!("{BINDING}: found a binding, expected a log");
    let names = "--robot and --scene are swapped: `--robot both_hands --scene pick_and_place`";
    for (args, wanted) in [
        (&["analyze", LOG, "--rules", BINDING][..], rules.as_str()),
        (&["analyze", LOG, "--hand", BINDING], &hand),
        (&["live", BINDING, "--binding", LOG], &swapped),
        (&["annotate", BINDING, "--binding", LOG, "-o", "none"], &swapped),
        (&["studio", BINDING, "--binding", LOG], &swapped),
        (&["inspect", BINDING, LOG], &dropped),
        (&["score", LOG, "--binding", BINDING, "--labels", RULES], &labels),
        (&["simulate", LOG, "--scene", "pick_and_place", "-o", "none.csv"], &retarget),
        (&["simulate", "c.json", "--robot", "pick_and_place", "--scene", "both_hands", "-o", "none.csv"], names),
    ] {
        let said = refused(args);
        assert!(said.contains(wanted), "{args:?}: {said}");
    }
}

/// A file that is not there is reported as missing, whatever its name says.
#[test]
fn a_missing_file_is_missing() {
    for args in [&["analyze", "none.rules"][..], &["analyze", LOG, "--binding", "none.scene.yaml"]] {
        let said = refused(args);
        assert!(said.contains("there is no such file"), "{said}");
    }
}

#[test]
fn a_log_of_foreign_columns_needs_a_binding() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("foreign.csv");
    std::fs::write(&log, "stamp,ee_x,ee_y,ee_z,gripper,force\n0,0,0,0,1,0\n0.01,0,0,0,1,0\n").unwrap();
    for input in [log.as_path(), folder.path()] {
        let said = refused(&["analyze", input.to_str().unwrap()]);
        assert!(
            said.contains("no column has the name of a channel, expected names such as `right.tcp.position.x`; found "),
            "{said}"
        );
        assert!(said.contains("stamp`, ") && said.contains("ee_z` and 2 more"), "{said}");
        assert!(said.contains("help: describe the columns in a binding and name it with --binding"), "{said}");
        assert!(!said.contains("scene"), "{said}");
    }
}
