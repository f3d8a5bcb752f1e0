//! The result of a fit as JSON, schema `teachtree.fit/2`; numbers by one printer.
//!
//! ```json
//! {"schema":"teachtree.fit/2","rules":[],"recordings":[],"verdict":"gain"|"nothing_to_gain"|"not_borne_out"|"too_few","tolerance_s",
//!  "before":OBJECTIVE,"after":OBJECTIVE,
//!  "params":[{"param","unit","before","after","low","high","idle"}],
//!  "held_out":{"before":OBJECTIVE,"after":OBJECTIVE,"gain","at_least","p_value","folds":[{"values":{},"recordings":[{"log","before":OBJECTIVE,"after":OBJECTIVE}]}]},
//!  "patch"}
//! ```
//!
//! OBJECTIVE is `{"objective","accuracy","f1","boundaries"}`, each from 0 to 1. Values are in the unit in which they are written; `values` holds those that
//! a fold changed. `held_out` is `null` without held-out recordings, and `patch` without changes.

use super::{Fit, Fold};
use crate::json::printed;
use serde_json::{Map, Value, json};

/// The name and version of the schema.
pub const SCHEMA: &str = "teachtree.fit/2";

/// Writes it; `rules` are the files, `patch` the patch if there is one.
pub fn json(fit: &Fit, rules: &[String], patch: Option<&str>) -> String {
    let params = fit.space.params.iter().zip(&fit.point).enumerate().map(|(at, (param, value))| {
        let (low, high) = param.range;
        json!({
            "param": param.name, "unit": param.unit, "before": param.value, "after": value, "low": low, "high": high,
            "idle": fit.idle.contains(&at),
        })
    });
    let held_out = fit.held_out.as_ref().map(|held| {
        json!({
            "before": held.before, "after": held.after, "gain": held.gain, "at_least": held.at_least, "p_value": held.p_value,
            "folds": held.folds.iter().map(|one| fold(fit, one)).collect::<Vec<_>>(),
        })
    });
    printed(&json!({
        "schema": SCHEMA,
        "rules": rules,
        "recordings": fit.logs,
        "verdict": fit.verdict,
        "tolerance_s": fit.tolerance_s,
        "before": fit.before,
        "after": fit.after,
        "params": params.collect::<Vec<_>>(),
        "held_out": held_out,
        "patch": patch,
    }))
}

fn fold(fit: &Fit, fold: &Fold) -> Value {
    let params = fit.space.params.iter().zip(&fold.point);
    let changed = params.filter(|(param, value)| param.value.to_bits() != value.to_bits());
    let values: Map<String, Value> = changed.map(|(param, value)| (param.name.clone(), json!(value))).collect();
    let recordings = fold
        .logs
        .iter()
        .zip(fold.before.iter().zip(&fold.after))
        .map(|(log, (before, after))| json!({ "log": fit.logs.get(*log), "before": before, "after": after }));
    json!({ "values": values, "recordings": recordings.collect::<Vec<_>>() })
}
