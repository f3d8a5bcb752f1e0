//! Findings for other programs: JSON, workflow commands of GitHub, and JUnit.

use super::finding::{CheckedInput, Finding, Place, distinct};
use crate::cli::junit::{Case, Outcome, Suite, xml};
use serde_json::{Value, json};
use teachtree_base::diagnostic::Severity;

/// `teachtree.check/1`.
pub fn as_json(checked: &[CheckedInput]) -> String {
    let findings: Vec<Value> = distinct(checked).into_iter().map(finding).collect();
    format!("{:#}\n", json!({ "schema": "teachtree.check/1", "findings": findings }))
}

fn finding(found: &Finding) -> Value {
    let at = |place: &Place| {
        let position = |(line, column): (usize, usize)| json!({ "line": line, "column": column });
        json!({ "file": place.file, "start": position(place.start), "end": position(place.end) })
    };
    json!({
        "code": found.code,
        "severity": found.severity,
        "message": found.message,
        "labels": found.labels.iter().map(|(place, text)| json!({ "at": at(place), "text": text })).collect::<Vec<_>>(),
        "notes": found.notes,
        "help": found.help,
        "fix": found.fix.as_ref().map(|(place, replacement)| json!({ "at": at(place), "replacement": replacement })),
    })
}

/// Workflow commands, `::error file=…,line=…,col=…,title=E101::message`, a line each.
pub fn as_github(checked: &[CheckedInput]) -> String {
    distinct(checked).into_iter().map(annotation).collect()
}

fn annotation(found: &Finding) -> String {
    let kind = if found.severity == Severity::Error { "error" } else { "warning" };
    let place = found.place().map_or(String::new(), |Place { file, start, end }| {
        let end = match start == end {
            true => String::new(),
            false => format!("endLine={},endColumn={},", end.0, end.1),
        };
        format!("file={},line={},col={},{end}", property(file), start.0, start.1)
    });
    format!("::{kind} {place}title={}::{}\n", found.code, escaped(&found.lines()))
}

/// A text in a workflow command.
fn escaped(text: &str) -> String {
    text.replace('%', "%25").replace('\r', "%0D").replace('\n', "%0A")
}

/// The value of a property of a workflow command.
fn property(text: &str) -> String {
    escaped(text).replace(':', "%3A").replace(',', "%2C")
}

/// JUnit: a suite for each input and a case for each finding in it. Warnings pass, with their text.
pub fn as_junit(checked: &[CheckedInput]) -> String {
    let suites: Vec<Suite> = checked
        .iter()
        .map(|input| {
            let mut cases: Vec<Case> = input.findings.iter().map(|found| case(&input.name, found)).collect();
            if cases.is_empty() {
                let (name, outcome) = ("check".into(), Outcome::Passed(String::new()));
                cases.push(Case { name, class: input.name.clone(), outcome });
            }
            Suite { name: input.name.clone(), cases }
        })
        .collect();
    xml("teachtree check", &suites)
}

fn case(input: &str, found: &Finding) -> Case {
    // CI systems merge cases of one name.
    let (class, name, at) = match found.place() {
        Some(Place { file, start: (line, column), .. }) => {
            (file.clone(), format!("{} {line}:{column}", found.code), format!("{file}:{line}:{column}: "))
        }
        None => (input.to_string(), found.code.clone(), String::new()),
    };
    let text = format!("{at}{}", found.lines());
    let outcome = match found.severity {
        Severity::Error => Outcome::Failed(found.message.clone(), text),
        _ => Outcome::Passed(text),
    };
    Case { name, class, outcome }
}
