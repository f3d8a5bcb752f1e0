//! Mistakes of a setup that a whole recording shows: units, places of the scene, flags and sensors that contradict the motion of hands and bodies.
//!
//! A recording is sampled at most 50 times a second ([`survey`]). Each check compares samples with each other, and changes nothing; docs/logs.md has a
//! table of them. A wrong unit contradicts everything else, so it is reported alone.

mod co_motion;
mod force_offsets;
mod gripper_flags;
mod hanging;
mod holds;
mod insertions;
mod overlaps;
pub mod placement;
mod plug_points;
mod rests;
mod survey;
mod tool_points;
mod turns;
mod units;

pub use rests::SCENE_ERROR;
pub use survey::{Survey, grips};

use teachtree_base::scene::Scene;
use teachtree_logs::issue::Issue;

/// The mistakes that the samples of a whole recording show.
pub fn issues(scene: &Scene, survey: &Survey) -> Vec<Issue> {
    let units = units::issues(scene, survey);
    if !units.is_empty() {
        return units;
    }
    let mut issues = gripper_flags::issues(scene, survey);
    issues.extend(holds::issues(scene, survey));
    issues.extend(tool_points::issues(scene, survey));
    issues.extend(turns::issues(scene, survey));
    issues.extend(insertions::issues(scene, survey));
    issues.extend(plug_points::issues(scene, survey));
    issues.extend(overlaps::issues(scene, survey));
    issues.extend(hanging::issues(scene, survey));
    issues.extend(force_offsets::issues(scene, survey));
    issues
}

/// The median of some numbers.
fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// A position as a scene has it: `[0 mm, 20 mm, -30 mm]`.
fn in_scene(position: [f64; 3]) -> String {
    // Zero has no sign.
    let [x, y, z] = position.map(|part| (part * 1e3).round() + 0.0);
    format!("[{x} mm, {y} mm, {z} mm]")
}

/// A length in whole millimeters.
fn mm(length: f64) -> f64 {
    (length * 1e3).round() + 0.0
}
