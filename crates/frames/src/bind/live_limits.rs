//! The keys of a binding that a live log does not support.

use super::{BindingFile, ToolMass};
use teachtree_base::error::InputError;

/// The longest step that is bridged, s: its rows come at once.
const MAX_BRIDGE_S: f64 = 60.0;
/// Maximum time for which rows wait for the readings of channels at rest, s.
const MAX_TARE_S: f64 = 60.0;

/// Refuses keys that need the whole log.
///
/// # Errors
/// A key that needs the whole log, or a time that is too long to wait, at `file:line:column`.
pub fn check(file: &BindingFile) -> Result<(), InputError> {
    let binding = &file.binding;
    let whole = |key: &str, fix: &str| {
        Err(file.error(key, format!("`{key}` needs the whole log, and a live log is bound row by row")).help(fix))
    };
    if binding.rate.is_some() {
        return whole("rate", "send a stamp with each row, and name its column as `time`");
    }
    if binding.resample.is_some() && binding.bridge.0 > MAX_BRIDGE_S {
        let message = format!("found {} s, expected at most {MAX_BRIDGE_S} s in a live log", binding.bridge.0);
        return Err(file.error("bridge", message));
    }
    if let Some(tare) = binding.tare.as_ref().filter(|tare| tare.to.0 > MAX_TARE_S) {
        let message = format!(
            "`to`: found {} s, expected at most {MAX_TARE_S} s, for which the rows of a live log wait",
            tare.to.0
        );
        return Err(file.error("tare", message));
    }
    if !binding.places.is_empty() {
        return whole("places", "give the bodies their positions in the scene");
    }
    for (channel, sensor) in &binding.sensors {
        if matches!(sensor.tool, Some(ToolMass::Learned(_))) {
            return whole(channel, "give the mass of the tool, such as `tool: 430 g`");
        }
    }
    Ok(())
}
