//! Advice that the program prints is executed: a command prints it, the files or the command are changed as it says, and it is gone.
//!
//! The cases are in tests/fixtures/advice. A case begins with `# title`; the steps before the first case are done in each of them. Names are those of files in a
//! new folder.
//!
//! | step | meaning |
//! |---|---|
//! | `advice TEXT` | what the first command prints and no later one does |
//! | `run ARGUMENTS` | runs the program |
//! | `prepare ARGUMENTS` | runs it before, for its files |
//! | `file NAME` | writes the indented lines that follow |
//! | `copy FROM TO` | copies a file or a folder of the new folder, else of the project |
//! | `demo SCENE NAME` | copies a shipped demonstration |
//! | `edit NAME: FROM => TO` | replaces a text; `\n` is the end of a line |
//! | `join NAME OTHER`, `move NAME OTHER`, `drop NAME` | appends another file; renames; deletes |
//! | `utf16 NAME`, `archive NAME` | encodes a file; writes an empty archive |

mod sources;

use crate::ROOT;
use crate::program::{all_said, demonstrate, teachtree_in};
use crate::shared::folders;
use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::Path;

/// A step: its line, and the indented lines below.
type Step = (String, String);

/// The steps of every case, and the cases by title.
fn read(text: &str) -> (Vec<Step>, Vec<(String, Vec<Step>)>) {
    let (mut prelude, mut cases): (Vec<Step>, Vec<(String, Vec<Step>)>) = (vec![], vec![]);
    for line in text.lines().skip(1) {
        let steps = cases.last_mut().map_or(&mut prelude, |(_, steps)| steps);
        match (line.strip_prefix("# "), line.strip_prefix("  ")) {
            (Some(title), _) => cases.push((title.to_string(), vec![])),
            (None, Some(body)) => writeln!(steps.last_mut().unwrap().1, "{body}").unwrap(),
            // An empty line of a file, or one between cases.
            _ if line.is_empty() => steps.last_mut().into_iter().for_each(|(_, body)| body.push('\n')),
            _ => steps.push((line.to_string(), String::new())),
        }
    }
    (prelude, cases)
}

/// The words of a command line; quotes join words.
fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    for (at, part) in line.split('\'').enumerate() {
        let mut pieces = part.split(' ').map(String::from);
        if at % 2 == 1 {
            words.last_mut().unwrap().push_str(part);
            continue;
        }
        words.last_mut().unwrap().push_str(&pieces.next().unwrap());
        words.extend(pieces);
    }
    words.retain(|word| !word.is_empty());
    words
}

/// Changes files as a step says.
fn change(folder: &Path, kind: &str, rest: &str, body: &str) {
    let path = |name: &str| folder.join(name);
    let two = || rest.split_once(' ').unwrap();
    match kind {
        "file" => {
            fs::create_dir_all(path(rest).parent().unwrap()).unwrap();
            fs::write(path(rest), format!("{}\n", body.trim_end())).unwrap();
        }
        "copy" => {
            let (from, to) = two();
            let from = if path(from).exists() { path(from) } else { Path::new(ROOT).join(from) };
            fs::create_dir_all(path(to).parent().unwrap()).unwrap();
            if from.is_dir() {
                folders::copy(&from, &path(to));
            } else {
                fs::write(path(to), fs::read(&from).unwrap()).unwrap();
            }
        }
        "demo" => demonstrate(two().0, &[], path(two().1)),
        "edit" => {
            let (name, change) = rest.split_once(": ").unwrap();
            let (from, to) = change.split_once(" => ").unwrap();
            let [from, to] = [from, to].map(|text| text.replace("\\n", "\n"));
            let text = fs::read_to_string(path(name)).unwrap();
            assert!(text.contains(&from), "{name} lacks {from}");
            fs::write(path(name), text.replace(&from, &to)).unwrap();
        }
        "join" => {
            let more = fs::read(path(two().1)).unwrap();
            fs::OpenOptions::new().append(true).open(path(two().0)).unwrap().write_all(&more).unwrap();
        }
        "move" => fs::rename(path(two().0), path(two().1)).unwrap(),
        "drop" => fs::remove_file(path(rest)).unwrap(),
        "utf16" => {
            let text = fs::read_to_string(path(rest)).unwrap();
            let units = std::iter::once(0xfeff).chain(text.encode_utf16());
            fs::write(path(rest), units.flat_map(u16::to_le_bytes).collect::<Vec<u8>>()).unwrap();
        }
        // The record that ends an archive, which holds nothing.
        "archive" => fs::write(path(rest), [&b"PK\x05\x06"[..], &[0; 18]].concat()).unwrap(),
        _ => panic!("no step is called `{kind}`"),
    }
}

/// What is wrong with a case.
fn fault(steps: &[&Step]) -> Option<String> {
    let folder = tempfile::tempdir().unwrap();
    let (mut advice, mut runs) = ("", 0);
    for (line, body) in steps {
        let (kind, rest) = line.split_once(' ').unwrap();
        if kind == "advice" {
            advice = rest;
            continue;
        }
        if kind == "prepare" {
            let args = words(rest);
            let output = teachtree_in(folder.path(), &args.iter().map(String::as_str).collect::<Vec<_>>());
            assert!(matches!(output.status.code(), Some(0 | 1)), "{rest}: {}", all_said(&output));
            continue;
        }
        if kind != "run" {
            change(folder.path(), kind, rest, body);
            continue;
        }
        let args = words(rest);
        let output = teachtree_in(folder.path(), &args.iter().map(String::as_str).collect::<Vec<_>>());
        let (printed, status) = (all_said(&output), output.status.code());
        runs += 1;
        let is_printed = printed.contains(advice);
        match (runs, is_printed, status) {
            (1, true, _) | (2.., false, Some(0 | 1)) => {}
            (1, ..) => return Some(format!("`{rest}` does not print `{advice}`:\n{printed}")),
            _ => return Some(format!("`{rest}` after `{advice}` ends with {status:?}:\n{printed}")),
        }
    }
    (advice.is_empty() || runs < 2).then(|| "a case prints advice and does what it says".to_string())
}

fn check(name: &str) {
    let text = fs::read_to_string(Path::new(ROOT).join("tests/fixtures/advice").join(name)).unwrap();
    let (prelude, cases) = read(&text);
    assert!(!cases.is_empty());
    let faults = cases.iter().filter_map(|(title, steps)| {
        let steps: Vec<&Step> = prelude.iter().chain(steps).collect();
        Some(format!("{title}: {}", fault(&steps)?))
    });
    let faults: Vec<String> = faults.collect();
    assert!(faults.is_empty(), "{} of {} in {name}:\n{}", faults.len(), cases.len(), faults.join("\n"));
}

#[test]
fn advice_about_logs() {
    check("logs.txt");
}

#[test]
fn advice_about_yaml() {
    check("yaml.txt");
}

#[test]
fn advice_about_bindings() {
    check("bindings.txt");
}

#[test]
fn advice_about_labels() {
    check("labels.txt");
}

#[test]
fn advice_about_commands() {
    check("commands.txt");
}

#[test]
fn advice_about_sets() {
    check("sets.txt");
}

#[test]
fn advice_about_robots() {
    check("robots.txt");
}

#[test]
fn advice_about_setups() {
    check("issues.txt");
}

#[test]
fn advice_about_learned_rules() {
    check("learn.txt");
}
