//! An audit as JSON, schema `teachtree.audit/1` (docs/formats.md).

use super::Audit;
use serde_json::{Map, Value, json};
use teachtree_analysis::audit::Facts;
use teachtree_analysis::json::{Meta, VERSION, issue, printed};

/// The name and version of the schema.
const SCHEMA: &str = "teachtree.audit/1";

/// Writes an audit by the rules of `meta`, or without rules.
pub fn json(audit: &Audit, meta: Option<&Meta>) -> String {
    let recordings: Vec<Value> = audit.recordings.iter().map(|(name, facts)| recording(audit, name, facts)).collect();
    let failed: Vec<Value> = audit.failed.iter().map(|(log, why)| json!({ "log": log, "message": why })).collect();
    let counts: Map<String, Value> =
        audit.counts().into_iter().map(|(kind, count)| (kind.name().into(), json!(count))).collect();
    let allowed: Vec<&str> = audit.allowed.iter().map(|kind| kind.name()).collect();
    let rules = meta.map(|meta| {
        let params: Map<String, Value> = meta.params.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
        json!({ "files": meta.rules, "digest": meta.digest, "params": params })
    });
    printed(&json!({ "schema": SCHEMA, "version": VERSION,
        "rules": rules,
        "good": audit.good(), "allowed": allowed, "counts": counts, "tasks": audit.tasks,
        "failures": audit.failures, "usual": audit.usual, "unchecked": audit.unchecked,
        "recordings": recordings,
        "failed": failed }))
}

fn recording(audit: &Audit, name: &str, facts: &Facts) -> Value {
    let findings: Vec<Value> = facts
        .findings
        .iter()
        .map(|finding| {
            let mut value = Map::new();
            value.insert("kind".into(), json!(finding.kind.name()));
            value.extend(finding.track.map(|track| ("track".into(), json!(track))));
            value.extend(finding.column.as_ref().map(|column| ("column".into(), json!(column))));
            if let Some([start, end]) = finding.span_s {
                value.insert("start_s".into(), json!(start));
                value.insert("end_s".into(), json!(end));
            }
            value.extend(finding.value.map(|number| ("value".into(), json!(number))));
            value.insert("message".into(), json!(finding.message));
            Value::Object(value)
        })
        .collect();
    let issues: Vec<Value> = facts.issues.iter().map(issue).collect();
    let tasks: Vec<&str> = facts.tasks().collect();
    json!({ "log": name, "good": audit.is_good(facts), "start_s": facts.start_s, "duration_s": facts.duration_s(),
        "idle_share": facts.idle_share(), "tasks": tasks, "findings": findings, "issues": issues })
}
