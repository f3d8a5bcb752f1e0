//! Frames in, channels of the rules out, window by window: each frame once no later frame can change what is derived of it, and, on request, the frames
//! after that as if the log ended with them.

use super::Calibration;
use crate::clean::closed_grippers::is_learned;
use crate::clean::held_poses::HeldPose;
use crate::clean::preprocess::{CleanLog, Hold, State, Window};
use crate::derive::{self, ANCHOR, Findings, fingertip_bias};
use crate::frames::Frames;
use nalgebra::Vector3;
use std::borrow::Cow;
use std::cell::RefCell;
use std::collections::{BTreeMap, VecDeque};
use std::ops::Range;
use teachtree_base::channels::ChannelSpec;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_base::log_channel::LogChannel;
use teachtree_base::scene::Scene;
use teachtree_base::units::Dimension;

/// Adds the columns of the flags of grippers that rows with these columns lack and a calibration has learned. Returns the columns of the openings, each with
/// its limit, m.
fn add_closed_flags(calibration: &Calibration, columns: &mut Vec<(String, Dimension)>) -> Vec<(usize, f64)> {
    let mut limits = vec![];
    for side in Side::BOTH {
        let opening = LogChannel::GripperOpening(side).to_string();
        let at = columns.iter().position(|(name, _)| *name == opening);
        if let Some((at, limit)) = at.zip(calibration.closing_limits.get(&opening))
            && is_learned(side, columns.iter().map(|(name, _)| name.as_str()))
        {
            limits.push((at, *limit));
            columns.push((LogChannel::GripperClosed(side).to_string(), Dimension::NONE));
        }
    }
    limits
}

/// The poses that rows with these columns repeat, each with its columns.
fn held_poses(calibration: &Calibration, columns: &[(String, Dimension)]) -> Vec<(Vec<usize>, HeldPose)> {
    let place = |name: String| columns.iter().position(|(column, _)| *column == name);
    let of_channel = |(channel, rows): (&String, &usize)| {
        let parts: Option<_> = LogChannel::parse(channel)?.columns().into_iter().map(place).collect();
        Some((parts?, HeldPose::new(*rows)))
    };
    calibration.held.iter().filter_map(of_channel).collect()
}

/// Derives the channels of rules.
pub struct Derivation {
    scene: Scene,
    channels: Vec<ChannelSpec>,
    calibration: Calibration,
    columns: Vec<(String, Dimension)>,
    /// Of each gripper whose flag the rows lack: the column of its opening, and the opening below which it is closed, m. Their flags are the last columns.
    closing_limits: Vec<(usize, f64)>,
    /// The poses that the rows repeat, each with its columns.
    held: Vec<(Vec<usize>, HeldPose)>,
    /// Frames on which later ones have a part in what is derived of a frame.
    ahead: usize,
    /// And earlier ones.
    behind: usize,
    /// Stamps and columns of the frames that are held.
    time: Vec<f64>,
    values: Vec<Vec<f64>>,
    /// The first frame that is held, the first of the stretch, and the first that was not given out, all counted from the beginning of the log.
    first: usize,
    stretch: usize,
    next: usize,
    /// On how many frames before and after a frame depend the contacts that are computed from shapes.
    margin: usize,
    /// What was so before some frames, for what depends on the frame before: the oldest is needed next.
    states: VecDeque<(usize, FollowedState)>,
    /// What was so before the stretch: objects stay where they are while nothing is measured.
    at_stretch: FollowedState,
    /// Where objects that the log does not show were in the frames that are held, as far as it is known for good, by object, m.
    places: BTreeMap<usize, Vec<Vector3<f64>>>,
    /// Whether there are such objects.
    continues_paths: bool,
    /// What was so at the last frame that was given out, for what depends on averages of that.
    averaged: BTreeMap<String, State>,
}

/// What depends on the frame before.
#[derive(Default)]
struct FollowedState {
    /// By what is followed.
    states: BTreeMap<String, State>,
    /// By object.
    holds: BTreeMap<usize, Hold>,
}

/// What was followed from frame to frame.
struct CarriedState {
    /// From this frame, and up to that.
    frames: Range<usize>,
    /// What was so at the end.
    state: FollowedState,
    /// Where objects that the log does not show were in these frames.
    places: BTreeMap<usize, Vec<Vector3<f64>>>,
    /// What was so at the last frame that was given out, of averages.
    averaged: BTreeMap<String, State>,
}

/// Frames with their channels.
pub struct LiveChunk<'a> {
    /// The columns; some of their frames belong to the windows before and after.
    pub frames: &'a Frames,
    /// The frames of the columns that no later one changes.
    pub core: Range<usize>,
    /// The frames after `core`, as if the log ended with them.
    pub newest: Range<usize>,
    /// Stamps of the frames that no later one changes, s.
    pub time: &'a [f64],
}

impl Derivation {
    /// Frames with these columns, for rules with these channels.
    pub fn new(
        scene: Scene,
        channels: Vec<ChannelSpec>,
        calibration: Calibration,
        mut columns: Vec<(String, Dimension)>,
    ) -> Self {
        let closing_limits = add_closed_flags(&calibration, &mut columns);
        let rate_hz = calibration.rate_hz;
        // Contacts from shapes depend on velocities, and so do the targets of hands whose touch no channel shows.
        let from_shapes = calibration.touches.values().any(|touches| !touches.pairs.is_empty());
        let targets_move = derive::targets_move(&scene, columns.iter().map(|(name, _)| name.as_str()));
        let ahead = if from_shapes || targets_move {
            derive::averaged(rate_hz)
        } else {
            derive::averaging_lag(&channels, rate_hz)
        };
        let behind = ahead.next_multiple_of(ANCHOR);
        let margin = if from_shapes { derive::balanced(rate_hz) } else { 0 };
        let continues_paths = derive::continues_paths(&scene, |name| columns.iter().any(|(column, _)| column == name));
        let held = held_poses(&calibration, &columns);
        let values = vec![vec![]; columns.len()];
        let (time, states, averaged) = (vec![], VecDeque::new(), BTreeMap::new());
        Self {
            scene,
            channels,
            calibration,
            columns,
            closing_limits,
            held,
            ahead,
            behind,
            time,
            values,
            first: 0,
            stretch: 0,
            next: 0,
            margin,
            states,
            at_stretch: FollowedState::default(),
            places: BTreeMap::new(),
            continues_paths,
            averaged,
        }
    }

    /// By how many frames what is given out lags behind.
    pub fn lag(&self) -> usize {
        self.ahead + self.margin + self.held_lag()
    }

    /// How many of the newest frames have poses that may still be interpolated.
    fn held_lag(&self) -> usize {
        self.held.iter().map(|(_, pose)| pose.lag()).max().unwrap_or(0)
    }

    /// Takes a frame: its stamp, s, and its values, SI, of the columns of the rows.
    pub fn push(&mut self, time_s: f64, values: &[f64]) {
        self.time.push(time_s);
        // Without an opening, the gripper is neither open nor closed.
        let closed = |(at, limit): &(usize, f64)| match values.get(*at) {
            Some(opening) if !opening.is_nan() => f64::from(u8::from(opening < limit)),
            _ => f64::NAN,
        };
        let flags = self.closing_limits.iter().map(closed);
        self.values.iter_mut().zip(values.iter().copied().chain(flags)).for_each(|(column, value)| column.push(value));
        let (row, at) = (self.first + self.time.len() - 1, self.time.len() - 1);
        for (places, pose) in &mut self.held {
            let parts: Vec<&[f64]> =
                places.iter().map(|place| self.values.get(*place).map_or(&[][..], Vec::as_slice)).collect();
            let Some(ramp) = pose.take(row, &parts, at) else { continue };
            for (component, place) in places.iter().enumerate() {
                for row in ramp.rows() {
                    let at = row.saturating_sub(self.first);
                    if let Some(value) = self.values.get_mut(*place).and_then(|column| column.get_mut(at)) {
                        *value = ramp.value(row, component);
                    }
                }
            }
        }
    }

    /// How many frames were taken.
    pub fn taken(&self) -> usize {
        self.first + self.time.len()
    }

    /// Derives the frames that no later one can change, and gives them to `each`; with `newest` also those after them, as if the log ended with
    /// them. With `ends` no later one comes: all frames are given, and the next stretch begins.
    ///
    /// # Errors
    /// As [`crate::frames()`], and what `each` returns.
    pub fn settle(
        &mut self,
        ends: bool,
        newest: bool,
        each: &mut dyn FnMut(LiveChunk) -> Result<(), InputError>,
    ) -> Result<(), InputError> {
        let taken = self.taken();
        let end = if ends { taken } else { taken.saturating_sub(self.lag()).max(self.next) };
        // A pose that is still held looks as if its body had stopped.
        let known = if ends { taken } else { taken.saturating_sub(self.held_lag()).max(self.next) };
        let last = if newest { known } else { end };
        if last > self.next {
            let CarriedState { frames, state, places, averaged } = self.derive(self.next..end, last, known, each)?;
            if end > self.next {
                for (object, places) in places {
                    let known = self.places.entry(object).or_default();
                    known.truncate(frames.start - self.first);
                    known.extend(places);
                }
                self.states.push_back((frames.end, state));
                self.averaged = averaged;
                self.next = end;
            }
            while self.states.get(1).is_some_and(|(frame, _)| frame + self.margin <= self.next) {
                self.states.pop_front();
            }
        }
        if ends {
            (self.first, self.stretch, self.next) = (taken, taken, taken);
            self.time.clear();
            self.values.iter_mut().for_each(Vec::clear);
            self.places.clear();
            self.held.iter_mut().for_each(|(_, pose)| pose.begin());
            if let Some((_, FollowedState { holds, .. })) = self.states.pop_back() {
                self.at_stretch.holds = holds;
            }
            self.states.clear();
            self.averaged.clear();
        } else {
            let needed = self.states.front().map_or(self.stretch, |(frame, _)| *frame);
            let forgotten = self.seen_from(needed) - self.first;
            // Moving what is held takes as long as deriving it: it is not done for a few frames.
            if forgotten >= ANCHOR {
                self.first += forgotten;
                self.time.drain(..forgotten);
                self.values.iter_mut().for_each(|column| drop(column.drain(..forgotten)));
                self.places.values_mut().for_each(|places| drop(places.drain(..forgotten.min(places.len()))));
            }
        }
        Ok(())
    }

    /// The first frame that has a part in what is derived of a frame. Sums begin at every [`ANCHOR`]th frame of a stretch.
    fn seen_from(&self, frame: usize) -> usize {
        let before = frame.saturating_sub(self.behind).max(self.stretch) - self.stretch;
        (self.stretch + before / ANCHOR * ANCHOR).max(self.first)
    }

    /// Derives frames for good, and those after them up to `last` for now; follows what depends on the frame before. Nothing after `known` counts.
    fn derive(
        &self,
        core: Range<usize>,
        last: usize,
        known: usize,
        each: &mut dyn FnMut(LiveChunk) -> Result<(), InputError>,
    ) -> Result<CarriedState, InputError> {
        let (from, before) = match self.states.front() {
            Some((from, state)) if from + self.margin <= core.start => (*from, state),
            _ => (self.stretch, &self.at_stretch),
        };
        let kept = (core.end + self.margin).min(known);
        let until = last.max(kept);
        let seen = self.seen_from(from)..(until + self.ahead).min(known);
        let held = seen.start - self.first..seen.end - self.first;
        let [next, end, last] = [core.start, core.end, last].map(|frame| frame - seen.start);
        let (after, averaged_after) = (RefCell::new(BTreeMap::new()), RefCell::new(BTreeMap::new()));
        let (places_after, holds_after) = (RefCell::new(BTreeMap::new()), RefCell::new(BTreeMap::new()));
        let past = held.start..from - self.first;
        let past = |places: &Vec<Vector3<f64>>| places.get(past.clone()).unwrap_or_default().to_vec();
        let places_before = self.places.iter().map(|(object, places)| (*object, past(places))).collect();
        // The velocity of a held object is an average of places after the frames that are given out.
        let followed = if self.continues_paths { seen.end } else { until };
        let window = Window {
            core: from - seen.start..followed - seen.start,
            averaged: next..last,
            is_first: from == self.stretch,
            before: &before.states,
            after: &after,
            kept: kept - seen.start,
            averaged_before: &self.averaged,
            averaged_after: &averaged_after,
            averaged_kept: end,
            touches: &self.calibration.touches,
            places_before: &places_before,
            places_after: &places_after,
            holds_before: &before.holds,
            holds_after: &holds_after,
        };
        let columns = self.columns.iter().zip(&self.values).map(|((name, dimension), values)| {
            (name.as_str(), (*dimension, Cow::Borrowed(values.get(held.clone()).unwrap_or_default())))
        });
        let time = self.time.get(held.clone()).unwrap_or_default();
        let mut measured = CleanLog {
            scene: &self.scene,
            time: time.to_vec(),
            rate_hz: self.calibration.rate_hz,
            stretches: std::iter::once(0..seen.len()).collect(),
            unseen: BTreeMap::new(),
            issues: vec![],
            noise: BTreeMap::new(),
            levels: BTreeMap::new(),
            fingertips: BTreeMap::new(),
            positions: BTreeMap::new(),
            held: BTreeMap::new(),
            span: [0.0; 2],
            window: Some(window),
            columns: columns.collect(),
        };
        fingertip_bias::correct(&mut measured, &self.calibration.sensors);
        let frames = derive::derived_frames(&measured, &self.channels, &mut Findings::unasked())?;
        each(LiveChunk {
            frames: &frames,
            time: time.get(next..end).unwrap_or_default(),
            core: next..end,
            newest: end..last,
        })?;
        drop(measured);
        let state = FollowedState { states: after.into_inner(), holds: holds_after.into_inner() };
        let (places, averaged) = (places_after.into_inner(), averaged_after.into_inner());
        Ok(CarriedState { frames: from..kept, state, places, averaged })
    }
}
