//! Specifications of AutoData: YAML, `subtasks` by end effector.

use super::{Demonstration, Format, Hands, TaskSpec};
use serde_json::{Map, Value, json};
use teachtree_base::error::InputError;
use teachtree_base::yaml;
use teachtree_session::signals::Signal;

pub(super) const FORMAT: Format = Format { program: "AutoData", endings: &["yaml", "yml"], text };

fn text(spec: &TaskSpec, hands: &Hands, found: &[Demonstration]) -> Result<String, InputError> {
    let starts: Vec<&Signal> = spec.wanted.iter().filter(|signal| signal.starts).collect();
    let algo = match (starts.is_empty(), hands.len()) {
        (false, _) => "skillgen",
        (_, 0 | 1) => "mimicgen",
        _ => "dexmimicgen",
    };
    let mut subtasks = Map::new();
    for (hand, parts) in hands {
        let mut all = vec![];
        for (number, mut subtask) in spec.subtasks(parts, found)?.into_iter().enumerate() {
            let start = if hands.len() == 1 { starts.get(number) } else { None };
            if let Some(start) = start {
                subtask.insert("subtask_start_signal".into(), json!(start.name));
            }
            let described = parts.get(number).map(|part| part.signal.step.to_string());
            subtask.insert("description".into(), json!(described));
            all.push(Value::Object(subtask));
        }
        subtasks.insert(hand.to_string(), all.into());
    }
    let name = spec.path.file_stem().map(|name| name.to_string_lossy().into_owned());
    let about = format!("written by teachtree {} from {}", env!("CARGO_PKG_VERSION"), spec.args.data.display());
    yaml::write(&json!({ "name": name, "description": about, "algo": algo, "subtasks": subtasks, "constraints": [] }))
}
