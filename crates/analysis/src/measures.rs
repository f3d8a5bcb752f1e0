//! The demands of a key beyond its primitive: duration, distance and rotation (`lasting`, `travelling`, `turning`).

use super::interval_labels::samples;
use super::labeled_span::LabeledSpan;
use std::ops::Range;
use teachtree_base::channels::{ChannelSpec, DerivedChannel, HANDLING, derived, handling};
use teachtree_base::hands::Side;
use teachtree_frames::frames::{ColumnKey, Frames};
use teachtree_frames::spilled_columns::Series;
use teachtree_language::rules::{Key, Rules};

/// The channels to make frames with, so that the keys of the tasks can be judged and the objects of segments are known: those of the rules
/// first, in their order.
pub fn channels(rules: &Rules) -> Vec<ChannelSpec> {
    let mut channels = rules.channels.clone();
    let keys = || rules.tasks.iter().flat_map(|task| &task.keys);
    let asked = [
        (TARGET, true),
        (POSITION, asks_distance(rules)),
        (SPIN, keys().any(|key| asks(key, SPIN))),
        (ROTATION, asks_distance(rules)),
        (RADIUS, asks_distance(rules)),
    ];
    for (name, _) in asked.into_iter().filter(|(_, asked)| *asked) {
        if !channels.iter().any(|channel| channel.name == name) {
            channels.extend(derived(name).map(DerivedChannel::spec));
        }
    }
    channels.extend(HANDLING.map(handling));
    channels
}

/// The object that the hand handles.
pub(super) const TARGET: &str = "target";
/// Its position, m, reference frame.
pub(super) const POSITION: &str = "target.position";
/// Its angular speed, rad/s.
pub(super) const SPIN: &str = "target.spin";

/// Its rotation, reference frame.
const ROTATION: &str = "target.rotation";
/// The radius of the ball about it, m.
const RADIUS: &str = "target.radius";

/// Whether a key cannot be judged without a channel.
pub(super) fn asks(key: &Key, channel: &str) -> bool {
    match channel {
        POSITION => key.travelling.is_some(),
        SPIN => key.turning.is_some(),
        _ => false,
    }
}

/// Whether a channel is read after the trees have run: for the objects of segments, or by the keys of the tasks.
pub fn reads_later(rules: &Rules, channel: &str) -> bool {
    let keys = || rules.tasks.iter().flat_map(|task| &task.keys);
    let of_way = [POSITION, ROTATION, RADIUS].contains(&channel) && asks_distance(rules);
    channel == TARGET || HANDLING.contains(&channel) || of_way || keys().any(|key| asks(key, channel))
}

/// Whether a key or a relabeling rule asks how far the target goes.
fn asks_distance(rules: &Rules) -> bool {
    let keys = rules.tasks.iter().flat_map(|task| &task.keys);
    { keys }.any(|key| asks(key, POSITION)) || rules.relabels.iter().any(|rule| rule.kind.shorter_way().is_some())
}

/// Number of frames in a group.
const TOGETHER: usize = 4096;

/// The columns of one hand's target.
pub(super) struct Measures<'a> {
    rate_hz: f64,
    series: &'a dyn Series,
    target: Option<ColumnKey>,
    position: Option<[ColumnKey; 3]>,
    spin: Option<ColumnKey>,
    rotation: Option<[ColumnKey; 4]>,
    radius: Option<ColumnKey>,
}

impl<'a> Measures<'a> {
    /// Finds the columns of a hand.
    pub fn new(frames: &'a Frames, series: &'a dyn Series, side: Side) -> Self {
        let column = |name: &str, component: u32| {
            let channel = frames.channel(name)?;
            let key = ColumnKey { channel, side: Some(side), slot: 0, component };
            series.has(key).then_some(key)
        };
        let axis = |component| column(POSITION, component);
        let rotation = || {
            let part = |component| column(ROTATION, component);
            Some([part(0)?, part(1)?, part(2)?, part(3)?])
        };
        Self {
            rate_hz: frames.layout.rate_hz,
            series,
            target: column(TARGET, 0),
            position: axis(0).zip(axis(1)).zip(axis(2)).map(|((x, y), z)| [x, y, z]),
            spin: column(SPIN, 0),
            rotation: rotation(),
            radius: column(RADIUS, 0),
        }
    }

    /// Frames per second.
    pub const fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Whether a channel that keys ask for is there.
    pub fn has(&self, channel: &str) -> bool {
        match channel {
            TARGET => self.target.is_some(),
            POSITION => self.position.is_some(),
            _ => self.spin.is_some(),
        }
    }

    /// The target at a frame, as its number among the objects; `None` when the log does not say.
    pub fn target(&self, frame: usize) -> Option<i64> {
        // Objects are numbered in column form; the cast cannot lose anything that matters.
        self.series.part(self.target?, frame..frame + 1).first().map(|target| *target as i64)
    }

    /// Whether a key is found among pieces: its primitive lasts and travels far enough in one piece,
    /// and turns far enough over all those pieces. A condition that the log cannot decide does not hold.
    pub fn found(&self, key: &Key, pieces: &[LabeledSpan]) -> bool {
        let asked = pieces.iter().filter(|piece| {
            key.label.covers(piece.label)
                && key.lasting.as_ref().is_none_or(|least| piece.frames.len() >= samples(least.value, self.rate_hz))
                && key.travelling.as_ref().is_none_or(|least| self.travelled(&piece.frames) >= least.value)
        });
        let pieces: Vec<&LabeledSpan> = asked.collect();
        !pieces.is_empty() && key.turning.as_ref().is_none_or(|least| self.turned(&pieces) >= least.value)
    }

    /// How far the target got within frames from where it was at the first of them, at most, m: the distance of its origin, or the way about it of what is half
    /// its radius from it, where that is longer.
    pub fn travelled(&self, frames: &Range<usize>) -> f64 {
        let Some(axes) = self.position else { return 0.0 };
        let (mut origin, mut turn) = (None, None);
        let mut farthest = 0.0_f64;
        for frames in together(frames) {
            let parts = axes.map(|axis| self.series.part(axis, frames.clone()));
            let turns = self.rotation.map(|parts| parts.map(|part| self.series.part(part, frames.clone())));
            let radii = self.radius.map(|radius| self.series.part(radius, frames.clone()));
            let at = |frame: usize| parts.each_ref().map(|axis| axis.get(frame).copied().unwrap_or(f64::NAN));
            for frame in 0..frames.len() {
                let [x, y, z] = at(frame);
                let [from_x, from_y, from_z] = *origin.get_or_insert([x, y, z]);
                let [x, y, z] = [x - from_x, y - from_y, z - from_z];
                farthest = farthest.max((x * x + y * y + z * z).sqrt());
                let radius = radii.as_ref().and_then(|radii| radii.get(frame)).copied().unwrap_or(0.0);
                if let Some(turns) = &turns {
                    let now = turns.each_ref().map(|part| part.get(frame).copied().unwrap_or(f64::NAN));
                    let from: [f64; 4] = *turn.get_or_insert(now);
                    // The cosine of half the angle.
                    let cosine = now.iter().zip(from).map(|(now, from)| now * from).sum::<f64>().abs();
                    farthest = farthest.max(radius * cosine.min(1.0).acos());
                }
            }
        }
        farthest
    }

    /// The greatest angle by which the target was turned from the beginning of the first piece, within the pieces, rad.
    pub fn turned(&self, pieces: &[&LabeledSpan]) -> f64 {
        let Some(spin) = self.spin else { return 0.0 };
        let (mut angle, mut greatest) = (0.0, 0.0_f64);
        for frames in pieces.iter().flat_map(|piece| together(&piece.frames)) {
            for rate in self.series.part(spin, frames).iter() {
                angle += rate / self.rate_hz;
                greatest = greatest.max(f64::abs(angle));
            }
        }
        greatest
    }
}

/// Returns the frames in groups.
pub(super) fn together(frames: &Range<usize>) -> impl Iterator<Item = Range<usize>> {
    let end = frames.end;
    frames.clone().step_by(TOGETHER).map(move |start| start..(start + TOGETHER).min(end))
}
