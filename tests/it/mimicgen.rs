//! What MimicGen, Isaac Lab Mimic and AutoData need of demonstrations: signals of a binding, the specification of the task, and ends of parts that are
//! near those of the conditions that MimicGen's environments compute.

use crate::program::{all_said, complained, said, teachtree, teachtree_in};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

fn demos() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite")
}

/// A folder with robosuite's recordings, `lift.hdf5`, and their binding with these lines behind it, `b.yaml`.
fn with_signals(lines: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(demos().join("lift.hdf5"), folder.path().join("lift.hdf5")).unwrap();
    let binding = std::fs::read_to_string(demos().join("lift_hdf5.binding.yaml")).unwrap();
    std::fs::write(folder.path().join("b.yaml"), format!("{binding}{lines}")).unwrap();
    folder
}

fn annotate(folder: &Path, out: &str, more: &[&str]) -> std::process::Output {
    teachtree_in(folder, &[&["annotate", "lift.hdf5", "-o", out, "--binding", "b.yaml"], more].concat())
}

const SIGNALS: &str = "signals:\n  grasp: start of Grasp of cube\n  lifted: last start of Translate of cube\n";

/// The rows of the table that `annotate` prints.
fn table(text: &str) -> Vec<Vec<String>> {
    text.lines().map(|line| line.split_whitespace().map(str::to_string).collect()).collect()
}

#[test]
fn signals_of_the_binding_are_written_where_the_command_line_names_none() {
    let folder = with_signals(SIGNALS);
    let of_binding = annotate(folder.path(), "a.hdf5", &[]);
    assert!(of_binding.status.success(), "{}", all_said(&of_binding));
    assert_eq!(table(&said(&of_binding))[0], ["recording", "grasp", "lifted"]);
    let named = ["--signal", "grasp=start of Grasp of cube", "--signal", "lifted=last start of Translate of cube"];
    let of_line = annotate(folder.path(), "b.hdf5", &named);
    assert_eq!(said(&of_line).replace("b.hdf5", "a.hdf5"), said(&of_binding));
    let other = annotate(folder.path(), "c.hdf5", &["--signal", "other=end of Grasp of cube"]);
    assert_eq!(table(&said(&other))[0], ["recording", "other"]);
    // Those of the other kind are kept.
    let start = annotate(folder.path(), "d.hdf5", &["--start-signal", "begin=start of Approach"]);
    assert_eq!(table(&said(&start))[0], ["recording", "grasp", "lifted", "begin"]);
}

/// The error has the line of the binding, in every command that reads it with rules, and nothing was analyzed or written before.
#[test]
fn recordings_that_are_failures_get_no_signals() {
    let folder = with_signals("signals: {grasp: start of Grasp of cube}");
    let failed = annotate(folder.path(), "new.hdf5", &["--expect", "pick_and_place x 9"]);
    assert_eq!(failed.status.code(), Some(2));
    assert!(all_said(&failed).contains("analyzed recordings are failures"), "{}", all_said(&failed));
    assert!(!folder.path().join("new.hdf5").exists());
    let all = annotate(folder.path(), "new.hdf5", &["--expect", "pick_and_place x 9", "--failures", "write"]);
    assert!(all.status.success(), "{}", all_said(&all));
    // Without an expectation their outcomes are unknown: they end while the cube is carried.
    let plain = said(&annotate(folder.path(), "other.hdf5", &[])).replace("other.hdf5", "new.hdf5");
    assert!(!plain.contains("outcomes:"), "{plain}");
    assert!(said(&all).contains("outcomes: 0 successes, 2 failures"), "{}", said(&all));
    assert!(said(&all).contains(plain.lines().next().unwrap()), "{}", said(&all));
}

/// The file has two recordings. By these rules the one whose approach takes longer is a failure.
#[test]
fn a_failure_among_successes_gets_no_signals_and_loses_old_ones() {
    let folder = with_signals("signals: {grasp: start of Grasp of cube}");
    let rules = "use \"contact.rules\"\ntask hesitated = Move .. Release with Approach lasting 4 s  is failure  before pick_and_place\n";
    std::fs::write(folder.path().join("slow.rules"), rules).unwrap();
    let names = |file: &str| {
        let file = hdf5_pure::File::open(folder.path().join(file)).unwrap();
        let has = |name: &str| file.dataset(&format!("data/{name}/datagen_info/subtask_term_signals/grasp")).is_ok();
        let mask = file.dataset("mask/teachtree_ok").unwrap().read_string().unwrap();
        (mask, [has("demo_1"), has("demo_3")])
    };
    let all = annotate(folder.path(), "all.hdf5", &[]);
    assert!(all.status.success(), "{}", all_said(&all));
    assert_eq!(names("all.hdf5"), (vec!["demo_1".to_string(), "demo_3".into()], [true, true]));
    let some = annotate(folder.path(), "some.hdf5", &["--rules", "slow.rules"]);
    assert!(
        all_said(&some).contains("failed recordings are not labeled: demo_1; `--failures write`"),
        "{}",
        all_said(&some)
    );
    assert_eq!(names("some.hdf5"), (vec!["demo_3".to_string()], [false, true]));
    let args =
        ["annotate", "all.hdf5", "-o", "again.hdf5", "--binding", "b.yaml", "--rules", "slow.rules", "--replace"];
    let again = teachtree_in(folder.path(), &args);
    assert!(again.status.success(), "{}", all_said(&again));
    assert_eq!(names("again.hdf5"), names("some.hdf5"));
}

#[test]
fn faulty_signals_of_a_binding_are_refused_at_their_line() {
    let mut messages = vec![];
    for lines in [
        "signals:\n  a: start of Grasp of cube\n  b: start of Grsp of cube\n",
        "signals: {a: start of Grasp of cub}\n",
        "signals: {a: end of Place of cube on tabel}\n",
        "signals:\n  a: begin of Grasp\n",
        "signals: {a/b: start of Grasp}\n",
        "start_signals: {a: start of Grasp with cube}\n",
        "signals: start of Grasp\n",
        "signals: {a: start of Grasp of cube, a: end of Grasp of cube}\n",
    ] {
        let folder = with_signals(lines);
        let refused = annotate(folder.path(), "new.hdf5", &[]);
        assert_eq!(refused.status.code(), Some(2), "{lines}: {}", all_said(&refused));
        assert!(!folder.path().join("new.hdf5").exists(), "{lines}");
        messages.push(complained(&refused));
        let analyzed = teachtree_in(folder.path(), &["analyze", "lift.hdf5#1", "--binding", "b.yaml"]);
        assert_eq!(complained(&analyzed), complained(&refused), "{lines}");
    }
    insta::assert_snapshot!(messages.join("\n"));
}

fn read(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// The structure that MimicGen's templates have: numbered parts, the last one without a signal, each with the body that it
/// is relative to, and offsets for which its assertion `end + max offset < next end + min offset` holds.
#[test]
fn a_specification_for_mimicgen_is_as_its_templates() {
    let folder = with_signals(SIGNALS);
    let output = annotate(folder.path(), "new.hdf5", &["--task-spec", "task.json"]);
    assert!(output.status.success(), "{}", all_said(&output));
    let spec = read(&folder.path().join("task.json"));
    let parts = spec["task"]["task_spec"].as_object().unwrap();
    assert_eq!(parts.keys().collect::<Vec<_>>(), ["subtask_1", "subtask_2"]);
    let keys = [
        "object_ref",
        "subtask_term_signal",
        "subtask_term_offset_range",
        "selection_strategy",
        "selection_strategy_kwargs",
        "action_noise",
        "num_interpolation_steps",
        "num_fixed_steps",
        "apply_noise_during_interpolation",
    ];
    for part in parts.values() {
        assert_eq!(part.as_object().unwrap().keys().collect::<Vec<_>>(), keys);
        assert_eq!(part["object_ref"], "cube");
    }
    assert_eq!(parts["subtask_1"]["subtask_term_signal"], "grasp");
    assert_eq!(parts["subtask_2"]["subtask_term_signal"], Value::Null);
    assert_eq!(parts["subtask_2"]["subtask_term_offset_range"], Value::Null);
    let range: Vec<u64> = parts["subtask_1"]["subtask_term_offset_range"]
        .as_array()
        .unwrap()
        .iter()
        .map(|at| at.as_u64().unwrap())
        .collect();
    assert!(range.len() == 2 && range[0] <= range[1], "{range:?}");
    for row in table(&said(&output)).iter().filter(|row| row[0].starts_with("demo_")) {
        let end: u64 = row[1].parse().unwrap();
        let rows = columns(folder.path(), &format!("lift.hdf5#{}", row[0])).len() as u64;
        assert!(end + range[1] < rows, "{row:?} {range:?} {rows}");
    }
}

/// The stamps of a recording.
fn columns(folder: &Path, log: &str) -> Vec<f64> {
    let output = teachtree_in(
        folder,
        &["analyze", log, "--binding", "b.yaml", "--frames", "f.csv", "--signals", "right.gripper.closed"],
    );
    assert!(output.status.success(), "{}", all_said(&output));
    let text = std::fs::read_to_string(folder.join("f.csv")).unwrap();
    text.lines().skip(1).map(|line| line.split(',').next().unwrap().parse().unwrap()).collect()
}

#[test]
fn a_specification_for_autodata_is_as_its_descriptors() {
    let folder = with_signals(&format!("{SIGNALS}start_signals: {{begin: start of Approach of cube}}\n"));
    let output = annotate(folder.path(), "new.hdf5", &["--task-spec", "stack.yaml"]);
    assert!(output.status.success(), "{}", all_said(&output));
    insta::assert_snapshot!(
        std::fs::read_to_string(folder.path().join("stack.yaml"))
            .unwrap()
            .replace(env!("CARGO_PKG_VERSION"), "VERSION")
    );
}

#[test]
fn specifications_that_cannot_be_made_are_refused_and_nothing_is_written() {
    let without = with_signals("");
    let start = ["--task-spec", "task.json", "--start-signal", "a=start of Grasp"];
    let refused = annotate(without.path(), "new.hdf5", &start);
    assert!(complained(&refused).contains("no signal ends a part of the task"), "{}", complained(&refused));
    let folder = with_signals(SIGNALS);
    std::fs::write(folder.path().join("old.json"), "{\"edited\": true}").unwrap();
    let before = crate::shared::folders::all_files(folder.path());
    for (more, message) in [
        (&["--task-spec", "task.txt"][..], "ends in `.txt`, expected `.json` for MimicGen or `.yaml` for AutoData"),
        (&["--task-spec", "b.yaml"], "b.yaml"),
        (&["--task-spec", "no/task.json"], "no"),
        (&["--task-spec", "old.json"], "old.json: exists already, expected the name of a new file"),
        (
            &[
                "--task-spec",
                "task.json",
                "--signal",
                "b=last end of Grasp of cube",
                "--signal",
                "a=start of Grasp of cube",
                "--signal",
                "c=end of Grasp",
            ],
            "no demonstration has the signals one after the other: `b` does not rise before `a` in demo_1",
        ),
        (
            &["--task-spec", "task.json", "--signal", "a=end of Place of cube on table", "--signal", "b=end of Grasp"],
            "none has all of them",
        ),
    ] {
        let refused = annotate(folder.path(), "new.hdf5", more);
        assert_eq!(refused.status.code(), Some(2), "{more:?}: {}", all_said(&refused));
        assert!(complained(&refused).contains(message), "{more:?}: {}", complained(&refused));
        assert!(crate::shared::folders::all_files(folder.path()) == before, "{more:?}");
    }
}

/// MimicGen divides a demonstration by this rule, written here from its documentation: a part ends at the first index at which its signal, an integer,
/// changes from 0 to 1, plus 1, exclusive; and not before the part in front of it.
fn end(signal: &[f64]) -> Option<usize> {
    let changes = signal.windows(2).map(|pair| pair[1] as i64 - pair[0] as i64);
    changes.enumerate().find(|(_, change)| *change == 1).map(|(at, _)| at + 1 + 1)
}

#[test]
fn mimicgens_rule_of_ends_gives_our_boundaries() {
    let folder = with_signals(SIGNALS);
    let output = annotate(folder.path(), "new.hdf5", &[]);
    let table = table(&said(&output));
    for demo in ["demo_1", "demo_3"] {
        let row = table.iter().find(|row| row[0] == demo).unwrap();
        let source = teachtree_logs::read::formats::open(&folder.path().join(format!("new.hdf5#{demo}"))).unwrap();
        let all = crate::shared::files::columns(source);
        let mut before = 0;
        for (name, row) in ["grasp", "lifted"].iter().zip(&row[1..]) {
            let end = end(&all[&format!("datagen_info/subtask_term_signals/{name}")]).unwrap();
            // The row on which the signal rises is the last one of the part.
            assert_eq!(end, row.parse::<usize>().unwrap() + 1, "{demo} {name}");
            assert!(end > before, "{demo} {name}");
            before = end;
        }
    }
}

/// A recording of robosuite as a table.
struct RobosuiteTable(BTreeMap<String, Vec<f64>>);

impl RobosuiteTable {
    fn read(log: &str) -> Self {
        let text = std::fs::read_to_string(demos().join(log)).unwrap();
        let mut lines = text.lines().map(|line| line.split(','));
        let mut columns: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        let names: Vec<String> = lines.next().unwrap().map(str::to_string).collect();
        for line in lines {
            for (name, value) in names.iter().zip(line) {
                columns.entry(name.clone()).or_default().push(value.parse().unwrap());
            }
        }
        Self(columns)
    }

    fn at(&self, name: &str, row: usize) -> f64 {
        self.0[name][row]
    }

    /// The stamps at which a condition begins to hold.
    fn rises(&self, holds: impl Fn(usize) -> bool) -> Vec<f64> {
        (1..self.0["t"].len()).filter(|row| holds(*row) && !holds(row - 1)).map(|row| self.at("t", row)).collect()
    }

    /// `_check_grasp` of robosuite: both fingers touch the object.
    fn grasped(&self, object: &str, row: usize) -> bool {
        ["f1", "f2"].iter().all(|finger| self.at(&format!("C_R_{finger}_{object}"), row) > 0.5)
    }

    /// `on_peg` of NutAssembly: within 30 mm of the peg, and lower than 50 mm above the table, whose height is 0.82 m.
    fn on_peg(&self, nut: &str, peg: [f64; 2], row: usize) -> bool {
        let near = |axis: &str, of: f64| (self.at(&format!("{nut}_p{axis}"), row) - of).abs() < 0.03;
        near("x", peg[0]) && near("y", peg[1]) && self.at(&format!("{nut}_pz"), row) < 0.87
    }

    /// As Stack of robosuite: the cubes touch each other, and the upper one is not grasped and 20 mm above where it began.
    fn stacked(&self, row: usize) -> bool {
        let lifted = self.at("cubeA_pz", row) > self.at("cubeA_pz", 0) + 0.02;
        self.at("C_cubeA_cubeB", row) > 0.5 && !self.grasped("cubeA", row) && lifted
    }
}

/// The stamp at which the first segment of a primitive with an object, and a partner if one is given, begins or ends.
fn boundary(log: &str, binding: &str, step: &str) -> f64 {
    let (log, binding) = (format!("demos/robosuite/{log}"), format!("demos/robosuite/{binding}.binding.yaml"));
    let output = teachtree(&["analyze", &log, "--binding", &binding, "--format", "json"]);
    let document: Value = serde_json::from_str(&said(&output)).unwrap_or_else(|_| panic!("{}", all_said(&output)));
    let words: Vec<&str> = step.split(' ').collect();
    let fits = |segment: &&Value| {
        segment["primitive"] == words[2]
            && segment["object"] == words[4]
            && words.get(6).is_none_or(|partner| segment["partner"] == *partner)
    };
    let segments = document["tracks"][0]["relabeled"].as_array().unwrap();
    let found = segments.iter().find(fits).unwrap_or_else(|| panic!("{log}: no {step}: {segments:?}"));
    found[if words[0] == "start" { "start_s" } else { "end_s" }].as_f64().unwrap()
}

/// The signals of robosuite's recordings beside the conditions of MimicGen's environments, evaluated on the recorded contacts and poses. At 20 Hz, two
/// frames are 100 ms. Two are farther away, for the reasons in docs/measurements/signals.md.
#[test]
fn signals_are_near_the_conditions_of_mimicgens_environments() {
    let mut rows = vec![];
    let mut compare = |log: &str, binding: &str, step: &str, condition: &str, rises: Vec<f64>| {
        let ours = boundary(log, binding, step);
        let theirs = *rises.first().unwrap_or_else(|| panic!("{log}: `{condition}` never holds"));
        rows.push((
            format!("| `{log}` | `{step}` | {ours:.3} | {condition} | {theirs:.3} | {:.0} |", 1e3 * (theirs - ours)),
            theirs - ours,
        ));
    };
    for (log, binding) in [("SawyerLift_demo_1.csv", "sawyer_lift"), ("lift_demo_1.csv", "panda_lift")] {
        let recorded = RobosuiteTable::read(log);
        compare(
            log,
            binding,
            "start of Grasp of cube",
            "both fingers touch",
            recorded.rises(|row| recorded.grasped("cube", row)),
        );
    }
    for (log, binding) in [("SawyerStack_demo_1.csv", "sawyer_stack"), ("stack_panda_demo_1.csv", "panda_stack")] {
        let recorded = RobosuiteTable::read(log);
        compare(
            log,
            binding,
            "start of Grasp of cubeA",
            "both fingers touch",
            recorded.rises(|row| recorded.grasped("cubeA", row)),
        );
        compare(log, binding, "start of Release of cubeA", "stacked", recorded.rises(|row| recorded.stacked(row)));
    }
    for (log, binding, nut, peg, at) in [
        ("SawyerNutAssembly_demo_1.csv", "sawyer_nut_assembly", "SquareNut0", "peg1", [0.73, 0.1]),
        ("SawyerNutAssembly_demo_1.csv", "sawyer_nut_assembly", "RoundNut0", "peg2", [0.73, -0.1]),
        ("nut_assembly_panda_demo_1.csv", "panda_nut_assembly", "RoundNut0", "peg2", [0.23, -0.1]),
    ] {
        let recorded = RobosuiteTable::read(log);
        compare(
            log,
            binding,
            &format!("start of Grasp of {nut}"),
            "both fingers touch",
            recorded.rises(|row| recorded.grasped(nut, row)),
        );
        compare(
            log,
            binding,
            &format!("end of Insert of {nut} into {peg}"),
            "on its peg",
            recorded.rises(|row| recorded.on_peg(nut, at, row)),
        );
    }
    let page =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/measurements/signals.md")).unwrap();
    let table: Vec<&str> = rows.iter().map(|(row, _)| row.as_str()).collect();
    assert!(
        page.contains(&table.join("\n")),
        "docs/measurements/signals.md has another table than\n{}",
        table.join("\n")
    );
    let far: Vec<&str> = rows.iter().filter(|(_, apart)| apart.abs() > 0.1001).map(|(row, _)| row.as_str()).collect();
    assert_eq!((rows.len(), far.len()), (12, 2), "{far:#?}");
    assert_eq!(json!(rows.iter().filter(|(_, apart)| apart.abs() < 0.0501).count()), json!(8));
}

/// A recording in a table, as a demonstration of an HDF5 file with a data set for each column, in which MimicGen's `object_poses` name some bodies.
fn as_hdf5(log: &str, bodies: &[&str], path: &Path) {
    let table = RobosuiteTable::read(log);
    let rows = table.0["t"].len();
    let mut builder = hdf5_pure::FileBuilder::new();
    let mut data = builder.create_group("data");
    let mut demo = data.create_group("demo_1");
    for (name, values) in &table.0 {
        demo.create_dataset(name).with_f64_data(values);
    }
    if !bodies.is_empty() {
        let mut info = demo.create_group("datagen_info");
        let mut poses = info.create_group("object_poses");
        for name in bodies {
            poses.create_dataset(name).with_f64_data(&vec![0.0; rows * 16]).with_shape(&[rows as u64, 4, 4]);
        }
        info.add_group(poses.finish());
        demo.add_group(info.finish());
    }
    data.add_group(demo.finish());
    builder.add_group(data.finish());
    std::fs::write(path, builder.finish().unwrap()).unwrap();
}

fn annotate_table(folder: &Path, log: &str, bodies: &[&str], binding: &str, more: &[&str]) -> std::process::Output {
    as_hdf5(log, bodies, &folder.join("demos.hdf5"));
    let binding = demos().join(binding);
    let args = ["annotate", "demos.hdf5", "-o", "new.hdf5", "--binding", binding.to_str().unwrap()];
    teachtree_in(folder, &[&args, more].concat())
}

/// The parts of each hand are in a list of its own; MimicGen's form, which has one arm, is refused and nothing is written.
#[test]
fn a_specification_for_two_hands_has_the_parts_of_each() {
    let folder = tempfile::tempdir().unwrap();
    let [log, binding] = ["handover_panda_panda_demo_5.csv", "handover.binding.yaml"];
    let signals = ["--signal", "lift=end of Grasp by right", "--signal", "taken=start of Pass by left"];
    let signals = [&signals[..], &["--signal", "given=end of Pass by right"]].concat();
    let refused =
        annotate_table(folder.path(), log, &[], binding, &[&signals[..], &["--task-spec", "a.json"]].concat());
    assert_eq!(refused.status.code(), Some(2), "{}", all_said(&refused));
    assert!(
        complained(&refused).contains("both hands, and a specification of MimicGen has one arm"),
        "{}",
        complained(&refused)
    );
    let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|file| file.unwrap().file_name()).collect();
    assert_eq!(left, ["demos.hdf5"]);
    let output = annotate_table(folder.path(), log, &[], binding, &[&signals[..], &["--task-spec", "a.yaml"]].concat());
    assert!(output.status.success(), "{}", all_said(&output));
    let text = std::fs::read_to_string(folder.path().join("a.yaml")).unwrap();
    let spec: Value = serde_yaml::from_str(&text).unwrap();
    assert_eq!(spec["algo"], "dexmimicgen");
    let parts = |hand: &str| {
        let all = spec["subtasks"][hand].as_array().unwrap_or_else(|| panic!("{text}"));
        let of = |part: &Value| format!("{} {}", part["object_ref"].as_str().unwrap(), part["subtask_term_signal"]);
        all.iter().map(of).collect::<Vec<_>>()
    };
    assert_eq!(parts("right"), ["hammer \"lift\"", "hammer null"]);
    assert_eq!(parts("left"), ["hammer null"]);
}

/// An insertion is relative to what the object goes into; the file may call that otherwise.
#[test]
fn a_part_is_relative_to_the_partner_by_the_name_of_the_file() {
    let [log, binding] = ["nut_assembly_panda_demo_1.csv", "panda_nut_assembly.binding.yaml"];
    let signals = ["--signal", "grasp=end of Grasp of RoundNut0", "--signal", "on=end of Insert of RoundNut0"];
    let with = |bodies: &[&str], more: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        let args = [&signals[..], &["--task-spec", "a.json"], more].concat();
        let output = annotate_table(folder.path(), log, bodies, binding, &args);
        (output, folder)
    };
    let references = |folder: &Path| {
        let spec = read(&folder.join("a.json"));
        let parts = spec["task"]["task_spec"].as_object().unwrap().clone();
        parts.values().map(|part| part["object_ref"].as_str().unwrap().to_string()).collect::<Vec<_>>()
    };
    let (output, folder) = with(&[], &[]);
    assert!(output.status.success(), "{}", all_said(&output));
    assert_eq!(references(folder.path()), ["RoundNut0", "peg2"]);
    let (refused, folder) = with(&["RoundNut0", "round_peg"], &[]);
    assert_eq!(refused.status.code(), Some(2), "{}", all_said(&refused));
    for part in ["the file has no poses of `peg2`", "`RoundNut0`, `round_peg`", "--object-ref peg2=NAME"] {
        assert!(complained(&refused).contains(part), "{}", complained(&refused));
    }
    assert!(!folder.path().join("new.hdf5").exists() && !folder.path().join("a.json").exists());
    let (output, folder) = with(&["RoundNut0", "round_peg"], &["--object-ref", "peg2=round_peg"]);
    assert!(output.status.success(), "{}", all_said(&output));
    assert_eq!(references(folder.path()), ["RoundNut0", "round_peg"]);
}

/// Soft and external links have no object that is copied: a copy without them would not be the file. Each fixture stores its link in another way.
#[test]
fn a_file_with_links_is_not_copied_without_them() {
    use teachtree_logs::read::formats::hdf5::annotate::{MASK, Request, annotate};
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/formats/links");
    let folder = tempfile::tempdir().unwrap();
    let copied = |name: &str| {
        let request = Request {
            layout: None,
            signals: &BTreeMap::new(),
            lists: &BTreeMap::from([(MASK, vec![])]),
            successes: &BTreeMap::new(),
            provenance: "{}",
            replace: false,
        };
        annotate(&fixtures.join(name), &folder.path().join(name), &request).map_err(|error| error.message)
    };
    for (name, link) in [
        ("external.hdf5", "the external link `linked` to `/actions` in `other.hdf5`"),
        ("soft_compact.hdf5", "the soft link `linked` to `/data/demo_0/actions`"),
        ("external_dense.hdf5", "the external link `linked` to `/actions` in `other.hdf5`"),
    ] {
        assert_eq!(copied(name), Err(format!("has {link}, which a copy would lack")), "{name}");
        assert!(!folder.path().join(name).exists(), "{name}");
    }
    assert_eq!(copied("none_dense.hdf5"), Ok(()));
    // In a group of the first version it cannot even be read.
    assert_eq!(copied("soft.hdf5"), Err("has a soft link, which is not read here".into()));
}

/// `h5py` and MimicGen's merged files may keep each recording in a file of its own; left out without a word, a set would be smaller than people think.
#[test]
fn a_recording_that_is_a_link_is_not_left_out() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/formats/links/recording.hdf5");
    let refused = teachtree(&["analyze", &format!("{}#*", file.display())]);
    assert_eq!(refused.status.code(), Some(2));
    let wanted = "has the external link `demo_1` to `/data/demo_1` in `other.hdf5`, which is not read here";
    assert!(complained(&refused).contains(wanted), "{}", complained(&refused));
    // Neither is it where the file stands for all, or one is chosen.
    for log in [file.display().to_string(), format!("{}#1", file.display())] {
        let refused = teachtree(&["analyze", &log]);
        assert!(complained(&refused).contains(wanted), "{log}: {}", complained(&refused));
    }
}

#[test]
fn a_list_of_complete_recordings_is_replaced_only_when_asked() {
    let folder = with_signals("");
    let again = |copy: &str, of: &str, more: &[&str]| {
        let signal = ["--signal", "lifted=last start of Translate of cube"];
        let args = ["annotate", of, "-o", copy, "--binding", "b.yaml"];
        teachtree_in(folder.path(), &[&args[..], &signal, more].concat())
    };
    assert!(annotate(folder.path(), "a.hdf5", &["--signal", "grasp=start of Grasp of cube"]).status.success());
    let refused = again("b.hdf5", "a.hdf5", &[]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(complained(&refused).contains("has the list `mask/teachtree_ok` already"), "{}", complained(&refused));
    assert!(!folder.path().join("b.hdf5").exists());
    let replaced = again("b.hdf5", "a.hdf5", &["--replace"]);
    assert!(replaced.status.success(), "{}", all_said(&replaced));
}
