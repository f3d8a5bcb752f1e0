//! Frames: what the rules read, in columns on an even time base.

use std::collections::BTreeMap;
use std::ops::Range;
use teachtree_base::channels::ChannelSpec;
use teachtree_base::hands::{Finger, Side};
use teachtree_logs::issue::Issue;

/// Which slots the arrays have; fixed when a log is opened.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layout {
    /// Frames per second.
    pub rate_hz: f64,
    /// The hands of the log, left first.
    pub hands: Vec<HandLayout>,
}

/// The slots of one hand.
#[derive(Clone, Debug, PartialEq)]
pub struct HandLayout {
    /// Which hand.
    pub side: Side,
    /// The slots of `fingers`.
    pub fingers: Vec<Finger>,
    /// The slots of `contacts`: the bodies that the target may touch.
    pub contacts: Vec<String>,
    /// The channel [`DISTANCE_KNOWN`](teachtree_base::channels::DISTANCE_KNOWN), which is constant over a log.
    pub knows_distance: bool,
}

impl Layout {
    /// The layout of a hand, if the log has it.
    pub fn hand(&self, side: Side) -> Option<&HandLayout> {
        self.hands.iter().find(|hand| hand.side == side)
    }
}

/// Which column: a component of a slot of a channel of a hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ColumnKey {
    /// Position of the channel in the list that the frames were made for (`Rules::channels`).
    pub channel: u32,
    /// The hand, for a channel per hand.
    pub side: Option<Side>,
    /// The slot of an array, else 0.
    pub slot: u32,
    /// The component, else 0.
    pub component: u32,
}

/// A whole log as the rules see it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frames {
    /// The slots.
    pub layout: Layout,
    /// The channels, in the order that `ColumnKey::channel` counts.
    pub channels: Vec<ChannelSpec>,
    /// The columns, each with `len` values, SI; bools are 0.0 and 1.0, objects their index in `objects` or -1.0. No NaN inside a stretch.
    pub columns: BTreeMap<ColumnKey, Vec<f64>>,
    /// Number of frames.
    pub len: usize,
    /// Start time of each frame, s. Within a stretch the step is `1 / rate_hz`.
    pub time: Vec<f64>,
    /// Gap-free stretches of frames, in order; everything restarts at the beginning of each.
    pub stretches: Vec<Range<usize>>,
    /// Frames in which a hand involves a body that was lost, by hand, in order: the hand has no labels there.
    pub unseen: BTreeMap<Side, Vec<Range<usize>>>,
    /// Names of the objects that `target` may be.
    pub objects: Vec<String>,
    /// Names of all bodies of the scene, in its order.
    pub bodies: Vec<String>,
    /// Names of the bodies that are fixed to a hand during the whole recording.
    pub attached: Vec<String>,
    /// When each row of the log was, s, also of those that were left out; empty when each row is a frame.
    pub row_time: Vec<f64>,
    /// What was found wrong with the log and how it was treated.
    pub issues: Vec<Issue>,
}

impl Frames {
    /// A column by its key.
    pub fn column(&self, key: ColumnKey) -> Option<&[f64]> {
        self.columns.get(&key).map(Vec::as_slice)
    }

    /// The position of a channel by name.
    pub fn channel(&self, name: &str) -> Option<u32> {
        self.channels.iter().position(|channel| channel.name == name).and_then(|at| u32::try_from(at).ok())
    }

    /// The rows of the log that some frames of one stretch were made from. Frames that were resampled have the rows from their time on.
    pub fn rows(&self, frames: &Range<usize>) -> Range<usize> {
        if self.row_time.is_empty() {
            return frames.clone();
        }
        let before = |time: f64| self.row_time.partition_point(|row| *row < time);
        let time = |frame: usize| self.time.get(frame).copied();
        let ends = self.stretches.iter().any(|stretch| stretch.end == frames.end);
        let start = time(frames.start).map_or(self.row_time.len(), before);
        let end = match (time(frames.end), frames.end.checked_sub(1).and_then(time)) {
            (Some(next), _) if !ends => before(next),
            // Frames after a stretch are not part of it.
            (_, Some(last)) => self.row_time.partition_point(|row| *row <= last),
            _ => start,
        };
        start..end.max(start)
    }

    /// When a frame ends, s.
    pub fn end_of(&self, frame: usize) -> f64 {
        self.time.get(frame).copied().unwrap_or_default() + 1.0 / self.layout.rate_hz
    }
}
