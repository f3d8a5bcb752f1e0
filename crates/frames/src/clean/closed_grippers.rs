//! Finds when a gripper is closed if the log has its opening and no flag. The limit is the middle between the two groups of openings.

use crate::clean::preprocess::over_all;
use crate::otsu;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::log_channel::{FingerPart, LogChannel};
use teachtree_base::recording::{Column, Recording};
use teachtree_base::units::Dimension;
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::names;

/// Whether the flag of a gripper is learned: the log has its opening, but neither a flag nor sensors of fingertips.
pub fn is_learned<'a>(side: Side, columns: impl Iterator<Item = &'a str>) -> bool {
    let mut is_open = false;
    for column in columns {
        match names::meaning(column).and_then(|meaning| LogChannel::parse(meaning.channel)) {
            Some(LogChannel::GripperOpening(of)) if of == side => is_open = true,
            Some(LogChannel::GripperClosed(of)) if of == side => return false,
            Some(
                LogChannel::Finger(of, finger, FingerPart::Force | FingerPart::Contact)
                | LogChannel::Touch(of, finger, _),
            ) if of == side && finger != Finger::Palm => {
                return false;
            }
            _ => {}
        }
    }
    is_open
}

/// The opening below which a gripper counts as closed, m: the middle between its two usual openings.
pub struct ClosingLimit {
    /// The usual openings, m.
    means: [f64; 2],
}

impl ClosingLimit {
    /// The limit that openings show, m; `None` if they do not fall into two groups.
    pub fn of(openings: &[f64]) -> Option<Self> {
        let measured = openings.iter().copied().filter(|opening| opening.is_finite()).collect();
        otsu::clear_means(measured).map(|means| Self { means })
    }

    /// The limit, m.
    pub const fn opening_m(&self) -> f64 {
        f64::midpoint(self.means[0], self.means[1])
    }
}

/// Adds the flags of closed grippers that are learned.
pub fn learn(recording: &mut Recording) -> Vec<Issue> {
    let mut issues = vec![];
    for side in Side::BOTH {
        if !is_learned(side, recording.columns.keys().map(String::as_str)) {
            continue;
        }
        let [closed, opening] = [LogChannel::GripperClosed(side), LogChannel::GripperOpening(side)];
        let Some(openings) = recording.columns.get(&opening.to_string()) else { continue };
        let (limit, message) = match ClosingLimit::of(&openings.values) {
            Some(learned) => {
                let ([low, high], limit) = (learned.means, learned.opening_m());
                let [limit_mm, low, high] = [limit, low, high].map(|opening| opening * 1e3);
                let message = format!(
                    "the gripper counts as closed below {limit_mm:.1} mm, in the middle between its usual openings of {low:.1} mm and {high:.1} mm; bind \
                     `{closed}` with another limit if it holds an object at a larger opening"
                );
                (limit, message)
            }
            None => {
                let message = format!(
                    "the openings do not fall into two groups, so the gripper counts as open throughout; bind `{closed}`, such as `opening [mm] < 30 mm`"
                );
                (f64::NEG_INFINITY, message)
            }
        };
        let flag = |opening: &f64| if opening.is_nan() { f64::NAN } else { f64::from(u8::from(*opening < limit)) };
        let values = openings.values.iter().map(flag).collect();
        recording.columns.insert(closed.to_string(), Column { dimension: Dimension::NONE, values });
        issues.push(over_all(&recording.time, IssueKind::LEARNED_CLOSING, &opening.to_string(), message));
    }
    issues
}
