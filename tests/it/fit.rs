//! `fit`: what is wrong is found, what is right stays, and what may be chance is said to be.

use crate::program::{all_said, said, teachtree_in};
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;
use std::process::{Command, Output};

/// Rules of a belt; `on` and `off` are its thresholds.
fn belt(on: &str, off: &str) -> String {
    format!(
        "// Which belt runs, and when.\n\
         stream {{ belt.speed : scalar m/s }}\n\n\
         param run_on     = {on:<10}   in 20 mm/s .. 800 mm/s    // it begins to run\n\
         param run_off    = {off:<10}   in 10 mm/s .. 700 mm/s    // it stops\n\
         param brief      = 40 ms        in 20 ms .. 100 ms\n\
         param twice      = 2 * run_on\n\n\
         signal running = belt.speed above run_on until below run_off\n\
         signal racing  = belt.speed > 100 * twice\n\
         primitive Rest, Run\n\n\
         tree belt for each hand, settle brief {{\n  running or racing => Run\n  else              => Rest\n}}\n"
    )
}

/// Numbers from 0 to 1, the same every time.
struct SplitMix64(u64);

impl SplitMix64 {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f64 / (1_u64 << 24) as f64
    }
}

/// A recording of a belt that speeds up and slows down; it runs from 100 mm/s on until below 60 mm/s, or as `label` says.
fn recording(seed: u64, label: Option<&str>) -> String {
    let mut chance = SplitMix64(seed.wrapping_mul(7919) + 1);
    let mut text = String::from(
        "time [s],right.thumb.position.x,right.thumb.position.y,right.thumb.position.z,belt.speed [m/s],right.label\n",
    );
    let mut runs = false;
    let mut row = 0;
    while row < 900 {
        let peak = 0.14 + 0.4 * chance.next();
        let (rest, up, flat) = (30.0 + 50.0 * chance.next(), 30.0 + 30.0 * chance.next(), 40.0 + 60.0 * chance.next());
        let (rest, up, flat) = (rest as usize, up as usize, flat as usize);
        for step in 0..rest + 2 * up + flat {
            let part = match step {
                step if step < rest => 0.0,
                step if step < rest + up => (step - rest) as f64 / up as f64,
                step if step < rest + up + flat => 1.0,
                step => (rest + 2 * up + flat - step) as f64 / up as f64,
            };
            let speed = 0.02 + (peak - 0.02) * part;
            runs = if runs { speed >= 0.06 } else { speed > 0.1 };
            let label = label.unwrap_or(if runs { "Run" } else { "Rest" });
            let _ = writeln!(
                text,
                "{:.2},0,0,{:.4},{speed:.4},{label}",
                row as f64 * 0.01,
                0.3 + 0.0001 * (row % 7) as f64
            );
            row += 1;
        }
    }
    text
}

/// A folder with rules, a scene and recordings.
fn folder(rules: &str, recordings: &[String]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("belt.rules", rules);
    write("scene.yaml", "bodies: {cube: {role: object, radius: 60 mm}}\nhands: {right: {fingers: [thumb]}}\n");
    std::fs::create_dir(folder.path().join("logs")).unwrap();
    for (number, text) in recordings.iter().enumerate() {
        write(&format!("logs/{number}.csv"), text);
    }
    folder
}

fn recordings(count: u64) -> Vec<String> {
    (0..count).map(|seed| recording(seed, None)).collect()
}

fn fit(folder: &Path, args: &[&str]) -> Output {
    teachtree_in(folder, &[&["fit", "logs", "--rules", "belt.rules", "--scene", "scene.yaml"], args].concat())
}

fn json(output: &Output) -> Value {
    serde_json::from_str(&said(output)).unwrap_or_else(|_| panic!("{}", all_said(output)))
}

/// The rules with a patch laid on by hand: each line that goes is the one that comes.
fn patched(rules: &str, diff: &str) -> String {
    let lines = |sign: char| {
        diff.lines().filter(move |line| line.starts_with(sign) && !line.starts_with(&sign.to_string().repeat(3)))
    };
    lines('-').zip(lines('+')).fold(rules.to_string(), |rules, (old, new)| {
        assert_eq!(rules.matches(&old[1..]).count(), 1, "{old}");
        rules.replace(&old[1..], &new[1..])
    })
}

#[test]
fn a_wrong_param_is_found_and_held_out_recordings_are_better() {
    let rules = belt("300 mm/s", "250 mm/s");
    let folder = folder(&rules, &recordings(5));
    let output = fit(folder.path(), &["--format", "json", "-o", "belt.patch"]);
    assert_eq!(output.status.code(), Some(0), "{}", all_said(&output));
    let found = json(&output);
    assert_eq!((found["schema"].as_str(), found["verdict"].as_str()), (Some("teachtree.fit/2"), Some("gain")));
    let param =
        |name: &str| found["params"].as_array().unwrap().iter().find(|one| one["param"] == name).unwrap().clone();
    let value = |name: &str| param(name)["after"].as_f64().unwrap();
    assert!((80.0..=115.0).contains(&value("run_on")), "{found}");
    assert!((45.0..=70.0).contains(&value("run_off")), "{found}");
    // What is computed from others is not a number to be changed.
    assert!(!found["params"].as_array().unwrap().iter().any(|one| one["param"] == "twice"));
    for one in found["params"].as_array().unwrap() {
        let of = |key: &str| one[key].as_f64().unwrap();
        assert!((of("low")..=of("high")).contains(&of("after")), "{one}");
    }
    // Each recording is better while the others are fitted.
    assert!(found["held_out"]["gain"].as_f64().unwrap() > 0.1, "{found}");
    for fold in found["held_out"]["folds"].as_array().unwrap() {
        for one in fold["recordings"].as_array().unwrap() {
            assert!(one["after"]["objective"].as_f64() > one["before"]["objective"].as_f64(), "{one}");
        }
    }
    // The patch changes two numbers, in the unit in which they were written, and nothing else.
    let diff = std::fs::read_to_string(folder.path().join("belt.patch")).unwrap();
    assert_eq!(found["patch"].as_str(), Some(diff.as_str()));
    let after = patched(&rules, &diff);
    assert_ne!(after, rules);
    for line in ["// Which belt runs, and when.", "   in 20 mm/s .. 800 mm/s    // it begins to run"] {
        assert!(after.contains(line), "{after}");
    }
    assert_eq!(std::fs::read_to_string(folder.path().join("belt.rules")).unwrap(), rules, "rules are never written");
    // Git takes it, where there is one; else it is laid on by hand.
    let git = Command::new("git").args(["apply", "-p0", "belt.patch"]).current_dir(folder.path()).output();
    match git {
        Ok(applied) => assert!(applied.status.success(), "{}", all_said(&applied)),
        Err(_) => std::fs::write(folder.path().join("belt.rules"), &after).unwrap(),
    }
    assert_eq!(std::fs::read_to_string(folder.path().join("belt.rules")).unwrap(), after);
    let checked = teachtree_in(folder.path(), &["check", "belt.rules"]);
    assert_eq!(checked.status.code(), Some(0), "{}", all_said(&checked));
    // Then nothing is left to be gained, and that is said.
    let again = fit(folder.path(), &[]);
    assert_eq!(again.status.code(), Some(1), "{}", all_said(&again));
    assert!(said(&again).contains("nothing to gain") && !said(&again).contains("@@"), "{}", said(&again));
}

#[test]
fn what_is_found_is_reported_and_is_the_same_every_time() {
    let folder = folder(&belt("300 mm/s", "250 mm/s"), &recordings(4));
    let args = ["--params", "run_on,run_off", "--hold-out", "2"];
    let output = fit(folder.path(), &args);
    insta::assert_snapshot!(all_said(&output));
    let mut alone = crate::program::program(
        folder.path(),
        &[&["fit", "logs", "--rules", "belt.rules", "--scene", "scene.yaml"], &args[..]].concat(),
    );
    assert_eq!(said(&output), said(&alone.env("RAYON_NUM_THREADS", "1").output().unwrap()), "threads change nothing");
}

/// The recordings of a person are held out together, and their gains are one.
#[test]
fn groups_are_held_out_by_their_names() {
    let folder = folder(&belt("300 mm/s", "250 mm/s"), &[]);
    for (name, text) in ["ann_1", "ann_2", "bob_1", "bob_2", "eve_1"].iter().zip(recordings(5)) {
        std::fs::write(folder.path().join(format!("logs/{name}.csv")), text).unwrap();
    }
    let args = ["--params", "run_on,run_off", "--group-by", "^([a-z]+)_"];
    let output = fit(folder.path(), &args);
    assert_eq!(output.status.code(), Some(0), "{}", all_said(&output));
    let text = said(&output);
    assert!(text.contains("gain on held-out groups") && text.contains("t test over 3 groups, p = 0.0"), "{text}");
    let found = json(&fit(folder.path(), &[&args[..], &["--format", "json"]].concat()));
    let held = |fold: &Value| {
        let names = fold["recordings"].as_array().unwrap().iter().map(|one| one["log"].as_str().unwrap().to_string());
        names.collect::<Vec<_>>()
    };
    let folds: Vec<Vec<String>> = found["held_out"]["folds"].as_array().unwrap().iter().map(held).collect();
    assert_eq!(
        folds,
        [vec!["logs/ann_1.csv", "logs/ann_2.csv"], vec!["logs/bob_1.csv", "logs/bob_2.csv"], vec!["logs/eve_1.csv"]]
    );
    for (args, wanted) in [
        (&["--group-by", "_"][..], "puts all recordings into 1 group, expected at least 2"),
        (&["--group-by", "^([a-z]+)_", "--hold-out", "4"], "4 folds of 3 groups"),
        (&["--group-by", "z"], "--group-by: `z` does not match `ann_1`"),
    ] {
        let output = fit(folder.path(), args);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", all_said(&output));
        assert!(all_said(&output).contains(wanted), "{args:?}: {}", all_said(&output));
    }
}

#[test]
fn thresholds_keep_their_order_and_params_their_ranges() {
    // The truth lies below both ranges: the best that may be is their lower end, one below the other.
    let rules = belt("300 mm/s", "250 mm/s").replace("20 mm/s ..", "150 mm/s ..").replace("10 mm/s ..", "150 mm/s ..");
    let folder = folder(&rules, &recordings(4));
    let found = json(&fit(folder.path(), &["--format", "json"]));
    let value = |at: usize| found["params"][at]["after"].as_f64().unwrap();
    assert!(value(0) >= 150.0 && value(1) >= 150.0 && value(1) <= value(0), "{found}");
    assert!(value(0) < 200.0, "{found}");
}

#[test]
fn what_may_be_chance_is_not_a_patch_unless_it_is_asked_for() {
    // The label has nothing to do with the speed: of seven recordings four are one, three the other.
    let labels = ["Rest", "Run", "Rest", "Run", "Rest", "Run", "Rest"];
    let texts: Vec<String> = labels.iter().zip(0..).map(|(label, seed)| recording(seed, Some(label))).collect();
    let folder = folder(&belt("100 mm/s", "60 mm/s"), &texts);
    let output = fit(folder.path(), &["-o", "belt.patch"]);
    assert_eq!(output.status.code(), Some(1), "{}", all_said(&output));
    assert!(said(&output).contains("not confirmed"), "{}", said(&output));
    assert!(!said(&output).contains("@@") && !folder.path().join("belt.patch").exists());
    let anyway = fit(folder.path(), &["--anyway"]);
    assert_eq!(anyway.status.code(), Some(0), "{}", all_said(&anyway));
    assert!(said(&anyway).contains("not confirmed") && said(&anyway).contains("@@"), "{}", said(&anyway));
}

#[test]
fn too_few_recordings_are_said_to_be_too_few() {
    let folder = folder(&belt("300 mm/s", "250 mm/s"), &recordings(3));
    let output = fit(folder.path(), &[]);
    assert_eq!(output.status.code(), Some(1), "{}", all_said(&output));
    assert!(said(&output).contains("too few recordings: 3"), "{}", said(&output));
    let anyway = fit(folder.path(), &["--anyway", "--params", "run_on"]);
    assert_eq!(anyway.status.code(), Some(0), "{}", all_said(&anyway));
    assert!(said(&anyway).contains("too few recordings: 3") && said(&anyway).contains("@@"), "{}", said(&anyway));
}

#[test]
fn what_cannot_be_fitted_is_bad_input() {
    let folder = folder(&belt("300 mm/s", "250 mm/s"), &recordings(2));
    for (args, wanted) in [
        (&["--params", "run_onn"][..], "did you mean `run_on`?"),
        (&["--params", "twice"], "`twice` has no range"),
        (&["--params", "run_on", "--set", "run_on=400mm/s"], "is set by the binding or by --set"),
        (&["--hold-out", "1"], "1 groups of 2 recordings"),
        (&["--hold-out", "3"], "3 groups of 2 recordings"),
        (&["--labels", "belt.rules"], "found a rule file, expected a file of labels"),
    ] {
        let output = fit(folder.path(), args);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", all_said(&output));
        assert!(all_said(&output).contains(wanted), "{args:?}: {}", all_said(&output));
    }
    let unlabeled = recordings(1)[0].replace(",right.label", ",other.note");
    std::fs::write(folder.path().join("logs/2.csv"), unlabeled).unwrap();
    let output = fit(folder.path(), &[]);
    assert_eq!(output.status.code(), Some(2), "{}", all_said(&output));
    assert!(all_said(&output).contains("2.csv"), "{}", all_said(&output));
}
