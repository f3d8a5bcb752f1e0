//! Findings in the form of SARIF 2.1.0, which code scanning of GitHub and editors read.

use super::finding::{CheckedInput, Finding, Place, distinct};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use teachtree_base::diagnostic::Severity;
use teachtree_language::codes;

/// The schema of SARIF 2.1.0.
const SCHEMA: &str = "https://json.schemastore.org/sarif-2.1.0.json";

/// The meaning of the code of YAML files.
const YAML_ERROR: &str = "A scene, an operator script, a binding or a robot file cannot be read.";

/// A log with one run.
pub fn as_sarif(checked: &[CheckedInput]) -> String {
    let findings = distinct(checked);
    let used: Vec<&str> =
        findings.iter().map(|found| found.code.as_str()).collect::<BTreeSet<_>>().into_iter().collect();
    let results: Vec<Value> = findings.iter().map(|found| result(found, &used)).collect();
    let log = json!({
        "$schema": SCHEMA,
        "version": "2.1.0",
        "runs": [{
            "tool": { "driver": {
                "name": "teachtree",
                "version": env!("CARGO_PKG_VERSION"),
                "semanticVersion": env!("CARGO_PKG_VERSION"),
                "rules": used.iter().map(|code| rule(code)).collect::<Vec<_>>(),
            } },
            // Columns are counted in characters, not in units of UTF-16.
            "columnKind": "unicodeCodePoints",
            "results": results,
        }],
    });
    format!("{log:#}\n")
}

/// A code with its page.
fn rule(code: &str) -> Value {
    let title = codes::ALL.iter().find(|(known, _)| *known == code).map_or(YAML_ERROR, |(_, title)| title.trim());
    let page = codes::page(code).unwrap_or(title);
    json!({
        "id": code,
        "shortDescription": { "text": title },
        "help": { "text": page, "markdown": page },
    })
}

fn result(found: &Finding, codes: &[&str]) -> Value {
    let mut result = json!({
        "ruleId": found.code,
        "ruleIndex": codes.iter().position(|code| *code == found.code),
        "level": if found.severity == Severity::Error { "error" } else { "warning" },
        "message": { "text": found.lines() },
        "locations": found.labels.iter().take(1).map(|label| location(label, None)).collect::<Vec<_>>(),
    });
    let related: Vec<Value> =
        found.labels.iter().enumerate().skip(1).map(|(at, label)| location(label, Some(at))).collect();
    if !related.is_empty() {
        result["relatedLocations"] = related.into();
    }
    if let Some((place, replacement)) = &found.fix {
        result["fixes"] = json!([{
            "description": { "text": found.help.first().map_or("replace it", String::as_str) },
            "artifactChanges": [{
                "artifactLocation": artifact(place),
                "replacements": [{
                    "deletedRegion": region(place),
                    "insertedContent": { "text": replacement },
                }],
            }],
        }]);
    }
    result
}

fn location((place, text): &(Place, String), id: Option<usize>) -> Value {
    let mut location = json!({
        "physicalLocation": { "artifactLocation": artifact(place), "region": region(place) },
    });
    if let Some(id) = id {
        location["id"] = id.into();
    }
    if !text.is_empty() {
        location["message"] = json!({ "text": text });
    }
    location
}

fn region(place: &Place) -> Value {
    json!({
        "startLine": place.start.0,
        "startColumn": place.start.1,
        "endLine": place.end.0,
        "endColumn": place.end.1,
    })
}

/// A file as a URI: relative where its name is.
fn artifact(place: &Place) -> Value {
    let mut uri = String::new();
    let name = place.file.replace('\\', "/");
    let is_drive = name.as_bytes().get(1) == Some(&b':');
    if is_drive || name.starts_with('/') {
        uri.push_str(if is_drive { "file:///" } else { "file://" });
    }
    for (at, byte) in name.bytes().enumerate() {
        if byte.is_ascii_alphanumeric() || b"/-._~".contains(&byte) || (is_drive && at == 1) {
            uri.push(char::from(byte));
        } else {
            uri.push_str(&format!("%{byte:02X}"));
        }
    }
    json!({ "uri": uri })
}
