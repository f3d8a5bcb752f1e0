//! Detects contacts of fingertips: by the recording's flags, else by the force, else by the flag of the closed gripper.

use super::columns::vectors;
use teachtree_base::contact_threshold;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::log_channel::{FingerPart, LogChannel};
use teachtree_base::recording::{Column, Recording};

/// The hysteresis of the force for contacts of fingertips.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchForces {
    /// The force at which a contact begins, N.
    pub on_n: f64,
    /// The force below which a contact ends, N.
    pub off_n: f64,
}

impl Default for TouchForces {
    /// The thresholds for rules without the params `touch_on` and `touch_off`.
    fn default() -> Self {
        Self { on_n: contact_threshold::ON_N, off_n: contact_threshold::OFF_N }
    }
}

/// Interruptions of up to this many samples are bridged.
const BRIDGED: usize = 4;

/// Returns the contact flags of a finger: with the object, else with any body, else those of its gripper.
pub(super) fn flags<'r>(recording: &'r Recording, (side, finger): (Side, Finger), object: &str) -> Option<&'r Column> {
    let of_object = recording.columns.get(&LogChannel::Touch(side, finger, object).to_string());
    let of_finger =
        of_object.or_else(|| recording.columns.get(&LogChannel::Finger(side, finger, FingerPart::Contact).to_string()));
    of_finger.or_else(|| of_gripper(recording, (side, finger)))
}

/// Returns the gripper's flags of a finger without a force.
fn of_gripper(recording: &Recording, (side, finger): (Side, Finger)) -> Option<&Column> {
    let feels = recording.columns.contains_key(&format!("{}.x", LogChannel::Finger(side, finger, FingerPart::Force)));
    recording.columns.get(&LogChannel::GripperClosed(side).to_string()).filter(|_| !feels)
}

/// Whether the contacts of a finger are those of its gripper, which closes before its pads touch an object.
pub(super) fn are_of_gripper(recording: &Recording, finger: (Side, Finger), object: &str) -> bool {
    let of_gripper = of_gripper(recording, finger);
    of_gripper.is_some_and(|closed| flags(recording, finger, object).is_some_and(|flags| std::ptr::eq(flags, closed)))
}

/// Returns whether a finger has contact at these rows: with the object, if the recording has contacts by body.
pub(super) fn touching(
    recording: &Recording,
    (side, finger): (Side, Finger),
    object: &str,
    rows: &[usize],
    forces_n: TouchForces,
) -> Vec<bool> {
    let channel = |part| LogChannel::Finger(side, finger, part);
    let mut touches: Vec<bool> = match flags(recording, (side, finger), object) {
        Some(flags) => rows.iter().map(|&row| flags.values.get(row).is_some_and(|flag| *flag > 0.5)).collect(),
        None => {
            let mut on = false;
            let forces = vectors(recording, &channel(FingerPart::Force), rows).unwrap_or_default();
            forces
                .iter()
                .map(|force| {
                    on = force.norm() >= if on { forces_n.off_n } else { forces_n.on_n };
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
