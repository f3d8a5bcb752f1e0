//! When a fingertip touches: by the recording's flags, else by its force.

use super::series::vectors;
use crate::base::hands::{Finger, Side};
use crate::base::recording::Recording;

/// A finger touches from this force on, N (as the rules' `touch_on`), and until it falls below the other.
const ON_N: f64 = 0.05;
const OFF_N: f64 = 0.02;
/// Interruptions of up to this many samples are bridged.
const BRIDGED: usize = 4;

/// Whether a finger touches, at these rows.
pub(super) fn touching(recording: &Recording, side: Side, finger: Finger, rows: &[usize]) -> Vec<bool> {
    let mut touches: Vec<bool> = match recording.columns.get(&format!("{side}.{finger}.contact")) {
        Some(flags) => rows.iter().map(|&row| flags.values.get(row).is_some_and(|flag| *flag > 0.5)).collect(),
        None => {
            let mut on = false;
            let forces = vectors(recording, &format!("{side}.{finger}.force"), rows).unwrap_or_default();
            forces
                .iter()
                .map(|force| {
                    on = force.norm() >= if on { OFF_N } else { ON_N };
                    on
                })
                .collect()
        }
    };
    let mut last_on: Option<usize> = None;
    for at in 0..touches.len() {
        if touches[at] {
            if let Some(before) = last_on.filter(|before| at - before <= BRIDGED) {
                touches[before..at].fill(true);
            }
            last_on = Some(at);
        }
    }
    touches
}
