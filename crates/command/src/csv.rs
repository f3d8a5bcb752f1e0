//! Commands as a table: one row a sample of each segment.

use super::schema::Commands;
use std::collections::BTreeMap;
use teachtree_analysis::number::number;
use teachtree_base::error::InputError;
use teachtree_base::hands::Finger;

/// Writes the commands; columns of fingers that a segment does not have are empty.
///
/// # Errors
/// When the table cannot be written.
pub fn csv(commands: &Commands) -> Result<String, InputError> {
    let failed = |error: &dyn std::fmt::Display| InputError::new("commands", format!("cannot be written: {error}"));
    // By name, as the columns of a table are sorted.
    let segments = commands.tasks.iter().flat_map(|task| &task.segments);
    let fingers: BTreeMap<&str, Finger> =
        segments.flat_map(|segment| &segment.tips).map(|tip| (tip.finger.name(), tip.finger)).collect();
    let mut header: Vec<String> =
        ["track", "task", "primitive", "time [s]"].iter().map(|name| (*name).to_string()).collect();
    header.extend(["x", "y", "z"].map(|part| format!("object.position.{part} [m]")));
    header.extend(["w", "x", "y", "z"].map(|part| format!("object.rotation.{part}")));
    for finger in fingers.values() {
        header.extend(["x", "y", "z"].map(|part| format!("{finger}.position_in_object.{part} [m]")));
        header.extend(["x", "y", "z"].map(|part| format!("{finger}.force_in_object.{part} [N]")));
    }
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(&header).map_err(|error| failed(&error))?;
    let mut task_start = 0.0;
    for task in &commands.tasks {
        for segment in &task.segments {
            for (at, object) in segment.object.iter().enumerate() {
                let time = task_start + segment.start_s + at as f64 / commands.rate_hz;
                let mut row = vec![task.track.to_string(), task.task.clone(), segment.primitive.clone(), number(time)];
                row.extend(object.iter().map(|value| number(*value)));
                for finger in fingers.values() {
                    let tip = segment.tips.iter().find(|tip| tip.finger == *finger);
                    for values in [tip.and_then(|tip| tip.position.get(at)), tip.and_then(|tip| tip.force.get(at))] {
                        row.extend((0..3).map(|part| values.map_or_else(String::new, |values| number(values[part]))));
                    }
                }
                writer.write_record(&row).map_err(|error| failed(&error))?;
            }
        }
        task_start += task.duration_s();
    }
    let bytes = writer.into_inner().map_err(|error| failed(&error))?;
    String::from_utf8(bytes).map_err(|error| failed(&error))
}
