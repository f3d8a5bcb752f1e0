//! The agreement of two people as JSON, schema `teachtree.agreement/1` (docs/formats.md): keys in a fixed order, numbers by one printer.

use super::{Agreement, Boundaries};
use crate::json::printed;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use teachtree_logs::read::labels::LabelKind;

/// The name and version of the schema.
pub const SCHEMA: &str = "teachtree.agreement/1";

/// The agreement of two annotators on recordings, by kind of label.
pub type AgreementByKind = BTreeMap<LabelKind, Agreement>;

/// Writes the agreement of two people over `all` recordings and in each of `rows`, which are named as on the command line.
pub fn json(people: &[String; 2], rows: &[(String, AgreementByKind)], all: &AgreementByKind) -> String {
    let of = |kind: LabelKind| all.get(&kind).map(|agreement| of_kind(kind, agreement, rows));
    printed(&json!({
        "schema": SCHEMA,
        "people": people,
        "recordings": rows.len(),
        "primitives": of(LabelKind::Primitive),
        "tasks": of(LabelKind::Task),
    }))
}

fn of_kind(kind: LabelKind, agreement: &Agreement, rows: &[(String, AgreementByKind)]) -> Value {
    let labels = agreement.labels().into_iter();
    let labels = labels.map(|label| named("label", label, &agreement.of_label(label)));
    let confusion = agreement.frames.iter();
    let confusion = confusion.map(|((one, other), count)| json!({"first": one, "second": other, "frames": count}));
    let rows = rows.iter().filter_map(|(log, kinds)| Some(named("log", log, kinds.get(&kind)?)));
    json!({
        "all": measures(agreement),
        "labels": labels.collect::<Vec<_>>(),
        "confusion": confusion.collect::<Vec<_>>(),
        "rows": rows.collect::<Vec<_>>(),
    })
}

fn named(key: &str, name: &str, agreement: &Agreement) -> Value {
    let mut value = Map::from_iter([(key.to_string(), json!(name))]);
    value.append(&mut measures(agreement));
    Value::Object(value)
}

fn measures(agreement: &Agreement) -> Map<String, Value> {
    let mut value = Map::new();
    value.insert("kappa".into(), json!(agreement.kappa()));
    value.insert("share".into(), json!(agreement.share()));
    value.insert("frames".into(), json!(agreement.both()));
    value.insert("same_frames".into(), json!(agreement.same()));
    value.insert("alone_frames".into(), json!(agreement.alone));
    value.insert("boundaries".into(), boundaries(&agreement.all_boundaries()));
    value
}

fn boundaries(boundaries: &Boundaries) -> Value {
    let ms = |q: f64| boundaries.quantile_s(q).map(|distance_s| distance_s * 1e3);
    json!({
        "pairs": boundaries.distances_s.len(),
        "alone": boundaries.alone,
        "median_ms": ms(0.5),
        "p90_ms": ms(0.9),
    })
}
