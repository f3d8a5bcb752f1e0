//! The score as JSON, schema `teachtree.score/1`: keys in a fixed order, numbers by one printer.
//!
//! ```json
//! {"schema":"teachtree.score/1","rules":{"files":[],"digest","params":{}},"recordings",
//!  "results":[{"result":"relabeled"|"raw",
//!    "all":{"scored_s","accuracy","f1":{"10","25","50"},"edit","sequences":SHARE,
//!           "boundaries":{"all":ERRORS,"contact":ERRORS},
//!           "tasks":{"found":SHARE,"sequences":SHARE,"false","each":[{"task","found":SHARE,"named":SHARE,"sequences":SHARE}],
//!                    "confusion":[{"true","result","count"}]},
//!           "primitives":[{"primitive","true_s","result_s","precision","recall","segments":{"true","result","f1":{}},"boundaries":ERRORS}],
//!           "confusion":[{"true","result","time_s"}]},
//!    "rows":[{"log","track","scored_s","accuracy","f1","edit","sequences","boundaries",
//!             "tasks":[{"true","result","start_s","end_s","true_sequence":[],"sequence":[]}]}]}]}
//! ```
//!
//! SHARE is `{"right","of","rate","low","high"}` with 95 % bounds, ERRORS is `{"found","of","median_ms","p95_ms"}`.
//! An undefined number (a rate of nothing) is `null`; `tasks` is `null` if the truth has no tasks.

use super::{BoundaryErrors, Row, Score, Share, Tally};
use crate::json::{Meta, printed};
use serde_json::{Map, Value, json};

/// The name and version of the schema.
pub const SCHEMA: &str = "teachtree.score/1";

/// Writes scores of the same recordings; `meta` says by which rules.
pub fn json(scores: &[Score], meta: &Meta) -> String {
    let params: Map<String, Value> = meta.params.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
    let results: Vec<Value> = scores
        .iter()
        .map(|score| {
            json!({
                "result": score.stage.to_string(),
                "all": all(&score.all),
                "rows": score.rows.iter().map(row).collect::<Vec<_>>(),
            })
        })
        .collect();
    printed(&json!({
        "schema": SCHEMA,
        "rules": { "files": meta.rules, "digest": meta.digest, "params": params },
        "recordings": scores.first().map_or(0, Score::recordings),
        "results": results,
    }))
}

fn all(tally: &Tally) -> Value {
    let mut value = brief(tally);
    let tasks = tally.tasks.is_some().then(|| tasks(tally));
    value.insert("tasks".into(), json!(tasks));
    let primitives = tally.primitives().into_iter().map(|name| primitive(tally, name)).collect();
    value.insert("primitives".into(), primitives);
    let confusion =
        tally.time_s.iter().map(|((truth, result), time)| json!({"true": truth, "result": result, "time_s": time}));
    value.insert("confusion".into(), confusion.collect());
    Value::Object(value)
}

/// The measures that a row has too.
fn brief(tally: &Tally) -> Map<String, Value> {
    let mut value = Map::new();
    value.insert("scored_s".into(), json!(tally.scored_s()));
    value.insert("accuracy".into(), json!(tally.accuracy()));
    value.insert("f1".into(), f1(tally.f1()));
    value.insert("edit".into(), json!(tally.edit()));
    value.insert("sequences".into(), share(tally.sequences));
    let boundaries = json!({"all": errors(&tally.boundary_errors()), "contact": errors(&tally.contact_errors())});
    value.insert("boundaries".into(), boundaries);
    value
}

fn tasks(tally: &Tally) -> Value {
    let each = tally.task_measures().into_iter().map(|(task, measures)| {
        json!({
            "task": task,
            "found": share(measures.found),
            "named": share(measures.named),
            "sequences": share(measures.sequences),
        })
    });
    let confusion = tally.task_confusion().into_iter();
    let confusion = confusion.map(|((truth, result), count)| json!({"true": truth, "result": result, "count": count}));
    json!({
        "found": share(tally.tasks_found()),
        "sequences": share(tally.task_sequences()),
        "false": tally.false_tasks(),
        "each": each.collect::<Vec<_>>(),
        "confusion": confusion.collect::<Vec<_>>(),
    })
}

fn primitive(tally: &Tally, name: &str) -> Value {
    let segments = tally.segments.get(name).copied().unwrap_or_default();
    json!({
        "primitive": name,
        "true_s": tally.true_s(name),
        "result_s": tally.result_s(name),
        "precision": tally.precision(name),
        "recall": tally.recall(name),
        "segments": { "true": segments.truths, "result": segments.results, "f1": f1(segments.f1()) },
        "boundaries": errors(&tally.errors_of(name)),
    })
}

fn row(row: &Row) -> Value {
    let mut value = Map::new();
    value.insert("log".into(), json!(row.log));
    value.insert("track".into(), json!(row.who.to_string()));
    value.append(&mut brief(&row.tally));
    let tasks = row.tally.tasks.as_ref().map(|pairs| {
        let pair = pairs.iter().map(|pair| {
            json!({
                "true": pair.truth,
                "result": pair.result,
                "start_s": pair.time_s.0,
                "end_s": pair.time_s.1,
                "true_sequence": pair.true_sequence,
                "sequence": pair.sequence,
            })
        });
        pair.collect::<Vec<_>>()
    });
    value.insert("tasks".into(), json!(tasks));
    Value::Object(value)
}

fn share(share: Share) -> Value {
    let bounds = share.bounds();
    json!({
        "right": share.right,
        "of": share.of,
        "rate": share.rate(),
        "low": bounds.map(|(low, _)| low),
        "high": bounds.map(|(_, high)| high),
    })
}

fn errors(errors: &BoundaryErrors) -> Value {
    json!({
        "found": errors.found.right,
        "of": errors.found.of,
        "median_ms": errors.median_s().map(|median| median * 1e3),
        "p95_ms": errors.p95_s().map(|p95| p95 * 1e3),
    })
}

fn f1([ten, quarter, half]: [Option<f64>; 3]) -> Value {
    json!({"10": ten, "25": quarter, "50": half})
}
