//! The outputs of the program conform to the schemas in `schemas`.

use crate::learn::learning_document;
use crate::program::{all_said, demonstrate, python_with, said, teachtree, teachtree_in};
use serde_json::Value;
use std::collections::BTreeSet;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::{LazyLock, Mutex};

/// The schemas of outputs: those of the files that people write have no version in their name.
pub fn schemas() -> Vec<(String, Value)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("schemas");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let read = |file: &PathBuf| serde_json::from_str::<Value>(&std::fs::read_to_string(file).unwrap()).unwrap();
    files.retain(|file| {
        file.to_str().unwrap().trim_end_matches(".schema.json").ends_with(|last: char| last.is_ascii_digit())
    });
    files.iter().map(|file| (file.file_name().unwrap().to_str().unwrap().to_string(), read(file))).collect()
}

/// A Python process that validates the documents of all tests and ends with them.
struct Validator {
    pairs: ChildStdin,
    verdicts: BufReader<ChildStdout>,
    _process: Child,
}

impl Validator {
    fn start() -> Option<Self> {
        const SCRIPT: &str = "
import json, sys
import jsonschema
print(flush=True)
for line in sys.stdin:
    errors = []
    for schema, document in json.loads(line):
        jsonschema.Draft202012Validator.check_schema(schema)
        for error in jsonschema.Draft202012Validator(schema).iter_errors(document):
            errors.append(f\"{schema['title']} {error.json_path}: {error.message[:300]}\")
    print(json.dumps(errors), flush=True)
";
        let python = python_with("jsonschema", "jsonschema")?;
        let mut command = Command::new(python);
        let mut child = command.args(["-c", SCRIPT]).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let (pairs, verdicts) = (child.stdin.take().unwrap(), BufReader::new(child.stdout.take().unwrap()));
        let mut validator = Self { pairs, verdicts, _process: child };
        validator.answer();
        Some(validator)
    }

    fn answer(&mut self) -> String {
        let mut line = String::new();
        assert!(self.verdicts.read_line(&mut line).unwrap() > 0, "the validator has ended");
        line
    }
}

/// Validates documents with Python's `jsonschema`. Returns false, with a message, if it is not installed.
pub fn validated(pairs: &[(Value, Value)]) -> bool {
    static VALIDATOR: LazyLock<Option<Mutex<Validator>>> = LazyLock::new(|| Validator::start().map(Mutex::new));
    let Some(validator) = &*VALIDATOR else { return false };
    let mut validator = validator.lock().unwrap();
    writeln!(validator.pairs, "{}", serde_json::to_string(pairs).unwrap()).unwrap();
    let errors = validator.answer();
    drop(validator);
    assert_eq!(errors.trim_end(), "[]");
    true
}

fn parsed(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

#[test]
fn the_outputs_of_all_commands_keep_to_their_schemas() {
    let folder = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| {
        let output = teachtree_in(folder.path(), args);
        assert!(matches!(output.status.code(), Some(0 | 1 | 4)), "{args:?}: {}", all_said(&output));
        said(&output)
    };
    demonstrate("hold_and_insert", &["--seed", "3"], folder.path().join("two.csv"));
    demonstrate("push_and_trace", &[], folder.path().join("one.csv"));
    // A task that is cut off, and issues.
    let text = std::fs::read_to_string(folder.path().join("one.csv")).unwrap();
    let cut: Vec<&str> = text.lines().take(4000).collect();
    std::fs::write(folder.path().join("cut.csv"), cut.join("\n")).unwrap();
    std::fs::copy(folder.path().join("one.scene.yaml"), folder.path().join("cut.scene.yaml")).unwrap();
    run(&["retarget", "one.csv", "-o", "commands.json"]);
    // Hands that do not meet are mapped at once.
    demonstrate("independent", &[], folder.path().join("apart.csv"));
    run(&["retarget", "apart.csv", "--robot", "both_hands", "-o", "mapped.json"]);
    // What is too heavy to be pushed is not done, and says why.
    let scene = include_str!("../../scenes/push_and_trace.yaml").replace("mass: 50 g", "mass: 3 kg");
    assert!(scene.contains("3 kg"));
    std::fs::write(folder.path().join("heavy.yaml"), scene).unwrap();
    let heavy = ["simulate", "commands.json", "--scene", "heavy.yaml", "-o", "robot.csv", "--format", "json"];
    std::fs::write(folder.path().join("outcome.json"), run(&heavy)).unwrap();
    std::fs::write(folder.path().join("wrong.rules"), "param a = 1 m\nparam a = 2 q\nsignal b = c\n").unwrap();

    let tour = "use \"contact.rules\"\ntask traced = Move .. Release with Trace is failure before push_and_trace\n\
                task tour = traced+ is failure\n";
    std::fs::write(folder.path().join("tour.rules"), tour).unwrap();

    std::fs::write(folder.path().join("mika.csv"), "label,start_s,end_s\nA,0,1\nB,1,3\n").unwrap();
    std::fs::write(folder.path().join("noor.csv"), "label,start_s,end_s\nA,0,1.5\nB,1.5,2\n").unwrap();
    std::fs::write(folder.path().join("met.expect"), "log: one.csv\n").unwrap();
    std::fs::write(folder.path().join("unmet.expect"), "log: one.csv\n\ntrack right\n  Grasp 0 .. 1\n").unwrap();
    let mut documents = vec![
        run(&["analyze", "two.csv", "--format", "json"]),
        run(&["analyze", "cut.csv", "--format", "json"]),
        run(&["analyze", "cut.csv", "--confidence", "--format", "json"]),
        run(&["explain", "one.csv", "--at", "2s..6s", "--why-not", "Follow", "--format", "json"]),
        run(&["explain", "two.csv", "--at", "6s..8s", "--format", "json"]),
        run(&["analyze", "one.csv", "--rules", "tour.rules", "--format", "json"]),
        run(&["explain", "one.csv", "--rules", "tour.rules", "--at", "5s", "--format", "json"]),
        run(&["inspect", "two.csv", "--format", "json"]),
        run(&["config", "one.csv", "--expect", "push_and_trace", "--format", "json"]),
        run(&["score", "one.csv", "two.csv", "--format", "json"]),
        run(&["agree", "mika.csv", "noor.csv", "one.csv", "--format", "json"]),
        run(&["fit", "one.csv", "cut.csv", "--params", "press_on", "--anyway", "--format", "json"]),
        run(&["check", "wrong.rules", "--format", "json"]),
        run(&["test", "met.expect", "unmet.expect", "--coverage", "--format", "json"]),
        std::fs::read_to_string(folder.path().join("commands.json")).unwrap(),
        std::fs::read_to_string(folder.path().join("outcome.json")).unwrap(),
        std::fs::read_to_string(folder.path().join("mapped.json")).unwrap(),
    ];
    // Several recordings are one document per line.
    let lines = run(&["analyze", "one.csv", "two.csv", "--format", "json"]);
    assert_eq!(lines.lines().count(), 2);
    documents.extend(lines.lines().map(str::to_string));
    run(&["analyze", "one.csv", "two.csv", "--format", "json", "--out-dir", "out"]);
    let manifest = std::fs::read_to_string(folder.path().join("out/manifest.jsonl")).unwrap();
    documents.extend(manifest.lines().map(str::to_string));
    run(&["analyze", "two.csv", "--trace", "trace.json", "--signals", "near,squeeze"]);
    documents.push(std::fs::read_to_string(folder.path().join("trace.json")).unwrap());
    documents.push(run(&["audit", "cut.csv", "one.csv", "two.csv", "--format", "json"]));
    let live = run(&["live", "one.csv", "--rules", "tour.rules", "--format", "json"]);
    assert!(live.contains("\"event\": \"composite\""), "{live}");
    documents.extend(live.lines().map(str::to_string));
    documents.extend(run(&["live", "cut.csv", "--format", "json"]).lines().map(str::to_string));
    documents.push(run(&["analyze", "cut.csv", "--rules", "tour.rules", "--format", "json"]));
    let log = "demos/robosuite/BaxterPegInHole_demo_1.csv";
    let binding = "demos/robosuite/baxter_peg_in_hole.binding.yaml";
    let foreign = ["analyze", log, "--binding", binding, "--format", "json"];
    documents.push(said(&teachtree(&foreign)));
    documents.push(said(&teachtree(&["inspect", log, "--format", "json"])));
    documents.push(run(&["prove", "additive", "contact.rules", "bimanual.rules", "--format", "json"]));
    documents.push(run(&["prove", "additive", "contact.rules", "tour.rules", "--format", "json"]));
    let compared = run(&["diff", "single_hand.rules", "contact.rules", "one.csv", "--format", "json"]);
    assert!(parsed(&compared)["recordings"][0]["changes"].as_array().is_some_and(|changes| !changes.is_empty()));
    documents.push(compared);
    let certify = ["certify", "commands.json", "--scene", "push_and_trace", "--runs", "1", "--format", "json"];
    documents.push(run(&certify));
    documents.push(run(&["list", "--format", "json"]));
    documents.push(learning_document());
    documents.push(run(&["fmt", "--check", "tour.rules", "--format", "json"]));
    let robosuite = Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite");
    let (set, binding) = (robosuite.join("lift.hdf5"), robosuite.join("lift_hdf5.binding.yaml"));
    let (set, binding) = (set.to_str().unwrap(), binding.to_str().unwrap());
    let signal = "grasp=start of Grasp of cube";
    let annotated =
        ["annotate", set, "-o", "copy.hdf5", "--binding", binding, "--signal", signal, "--format", "json", "-q"];
    let annotated = run(&annotated);
    assert!(parsed(&annotated)["signals"][0]["signals"][0]["row"].as_u64().is_some_and(|row| row > 0), "{annotated}");
    documents.push(annotated);

    let schemas = schemas();
    let mut seen = BTreeSet::new();
    let pair = |text: &String| {
        let document = parsed(text);
        let name = document["schema"].as_str().unwrap().to_string();
        let (_, schema) = schemas.iter().find(|(_, schema)| schema["title"] == name.as_str()).unwrap();
        seen.insert(name);
        (schema.clone(), document)
    };
    let pairs: Vec<(Value, Value)> = documents.iter().map(pair).collect();
    let all: BTreeSet<String> =
        schemas.iter().map(|(_, schema)| schema["title"].as_str().unwrap().to_string()).collect();
    assert_eq!(seen, all, "each schema has an output");
    validated(&pairs);
}

#[test]
fn the_page_of_formats_describes_every_column_of_segments() {
    let page = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/formats.md")).unwrap();
    let (_, table) = page.split_once("\n## The table of segments\n").unwrap();
    let table = table.split("\n## ").next().unwrap();
    for column in teachtree_analysis::csv::COLUMNS.iter().chain(&teachtree_analysis::csv::CONFIDENCE) {
        assert!(table.contains(&format!("`{column}`")), "docs/formats.md does not describe the column `{column}`");
    }
}
