//! Specifications of MimicGen: JSON, `task.task_spec.subtask_1`.

use super::{Demonstration, Format, Hands, TaskSpec};
use serde_json::{Map, json};
use teachtree_base::error::InputError;

pub(super) const FORMAT: Format = Format { program: "MimicGen", endings: &["json"], text };

fn text(spec: &TaskSpec, hands: &Hands, found: &[Demonstration]) -> Result<String, InputError> {
    if hands.len() > 1 {
        let message = "the signals are of both hands, and a specification of MimicGen has one arm";
        return Err(spec.wrong(message.into()).help("name a file that ends in `.yaml`, for AutoData"));
    }
    let mut all = Map::new();
    for parts in hands.values() {
        for (subtask, number) in spec.subtasks(parts, found)?.into_iter().zip(1..) {
            all.insert(format!("subtask_{number}"), subtask.into());
        }
    }
    let text = serde_json::to_string_pretty(&json!({ "task": { "task_spec": all } }));
    text.map(|text| text + "\n").map_err(|error| spec.wrong(format!("cannot be made: {error}")))
}
