//! Variations of a log: fingertips elsewhere, other contact levels of the force sensors, and half of the rows.

use teachtree_base::log_channel::{FingerPart, LogChannel};
use teachtree_base::recording::Recording;
use teachtree_frames::OpenedLog;
use teachtree_frames::frames::Frames;

/// The offset of the fingertips along each axis, m.
const OFFSET_M: f64 = 0.01;
/// The corners of a tetrahedron: no direction is preferred.
const CORNERS: [[f64; 3]; 4] = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
/// The channel of the contact levels, and their factors.
const LEVEL: &str = "fingers.level";
const LEVELS: [f64; 2] = [2.0 / 3.0, 1.5];

/// A difference to the log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LogVariation {
    /// All fingertips are moved by this vector in the reference frame, m: another object may become the target.
    Fingertips([f64; 3]),
    /// The contact levels of all force sensors are multiplied by this factor.
    Levels(f64),
    /// Only every second row remains, from the row with this number on.
    Rows { first: usize },
}

impl LogVariation {
    /// The variations that change a log; `frames` are those of the log.
    pub fn all(opened: &OpenedLog, frames: &Frames) -> Vec<Self> {
        let mut variations = vec![Self::Rows { first: 0 }, Self::Rows { first: 1 }];
        if opened.recording.columns.keys().any(|name| is_finger_position(name)) {
            variations.extend(CORNERS.map(|corner| Self::Fingertips(corner.map(|sign| sign * OFFSET_M))));
        }
        if frames.channel(LEVEL).is_some() {
            variations.extend(LEVELS.map(Self::Levels));
        }
        variations
    }

    /// The frames of the varied log, with the channels of `frames`, which are those of the log; `None` if they cannot be derived.
    pub fn frames(self, opened: &OpenedLog, frames: &Frames) -> Option<Frames> {
        if let Self::Levels(factor) = self {
            let level = frames.channel(LEVEL)?;
            let mut varied = frames.clone();
            let columns = varied.columns.iter_mut().filter(|(key, _)| key.channel == level);
            columns.flat_map(|(_, values)| values).for_each(|value| *value *= factor);
            return Some(varied);
        }
        let mut varied = opened.clone();
        self.change(&mut varied.recording);
        varied.frames(&frames.channels).ok()
    }

    fn change(self, recording: &mut Recording) {
        match self {
            Self::Fingertips(offset) => {
                for (axis, offset) in [".x", ".y", ".z"].iter().zip(offset) {
                    let columns = recording.columns.iter_mut();
                    let moved = columns.filter(|(name, _)| name.ends_with(axis) && is_finger_position(name));
                    moved.flat_map(|(_, column)| &mut column.values).for_each(|value| *value += offset);
                }
            }
            Self::Rows { first } => {
                recording.time = every_other(&recording.time, first);
                recording.columns.values_mut().for_each(|column| column.values = every_other(&column.values, first));
                recording.labels.values_mut().for_each(|texts| *texts = every_other(texts, first));
            }
            Self::Levels(_) => {}
        }
    }
}

/// Whether a column is a component of the position of a finger or of the palm.
fn is_finger_position(column: &str) -> bool {
    let stem = column.rsplit_once('.').map_or(column, |(stem, _)| stem);
    matches!(LogChannel::parse(stem), Some(LogChannel::Finger(_, _, FingerPart::Position)))
}

fn every_other<T: Clone>(values: &[T], first: usize) -> Vec<T> {
    values.iter().skip(first).step_by(2).cloned().collect()
}
