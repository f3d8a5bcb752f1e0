//! How objects moved where that explains an outcome: how far one fell in a failed task, and how far one moved that no hand touched.

use super::measures::{POSITION, TARGET, together};
use super::{Analysis, TaskSpan, TrackId, UNKNOWN};
use std::borrow::Cow;
use std::ops::Range;
use teachtree_base::channels::TARGET_TOUCHED;
use teachtree_base::hands::Side;
use teachtree_base::meaning::Meaning;
use teachtree_frames::frames::{ColumnKey, Frames};
use teachtree_frames::spilled_columns::Series;
use teachtree_language::rules::Rules;

/// Whether a gripper is closed.
const CLOSED: &str = "gripper.closed";
/// The opening of a gripper, m; constant if it is not known.
const OPENING: &str = "gripper.opening";
/// The distance of each fingertip from the target, m.
const DISTANCE: &str = "fingers.distance";
/// The param that a fall must exceed within [`FALL_S`].
const DROP_WAY: &str = "drop_way";
/// The interval of that fall, s.
const FALL_S: f64 = 0.1;
/// The steps of a value that is advised for that param, m.
const STEP_M: f64 = 0.01;
/// A fall is over after this time, s: 4.9 m.
const LONGEST_FALL_S: f64 = 1.0;
/// Jaws that are opened this long before a fall, s, let the object go.
const OPENED_S: f64 = 0.5;
/// By this opening, m.
const OPENED_M: f64 = 1e-3;
/// A fall has begun at most this long before its label, s.
const BEGUN_S: f64 = 0.3;
/// A slower object does not fall, m/s.
const FALLING: f64 = 0.01;
/// A shorter way of an object is not mentioned, m.
const LEAST_FALL_M: f64 = 0.01;
/// A shorter way of an object that no hand touched is not mentioned, m.
const LEAST_WAY_M: f64 = 0.03;
/// A shorter motion is not mentioned, s: a camera that corrects a pose makes a jump.
const LEAST_S: f64 = 0.1;
/// A step of an object that noise does not make, m.
const MOVED_M: f64 = 5e-3;

/// The fall of an object in a failed task.
#[derive(Clone, Debug, PartialEq)]
pub struct Fall {
    /// The hand of the task.
    pub track: TrackId,
    /// The first frame of the segment that lets the object go.
    pub frame: usize,
    /// When the fall begins, s.
    pub start_s: f64,
    /// The height of the fall, m.
    pub height_m: f64,
    /// Whether the gripper was opened before.
    pub is_from_open_jaws: bool,
    /// The value of `drop_way` with which the fall is a release, m; `None` if no value does that, or if the jaws did not open.
    pub drop_way_m: Option<f64>,
}

/// A motion of an object while no hand touched it.
#[derive(Clone, Debug, PartialEq)]
pub struct UntouchedMotion {
    /// Its name.
    pub object: String,
    /// The greatest distance from where it began, m.
    pub way_m: f64,
    /// Start and end, s.
    pub span_s: [f64; 2],
    /// The least distance of a fingertip from its surface during the motion, m; `None` if the rules do not measure it.
    pub distance_m: Option<f64>,
}

/// Whether [`explain_by_motion`] reads a channel.
pub fn reads_motion(channel: &str) -> bool {
    [TARGET, POSITION, TARGET_TOUCHED, CLOSED, OPENING, DISTANCE].contains(&channel)
}

/// Adds to an analysis the falls of objects in its failed tasks. If no task has a name, adds the object that moved farthest while no hand touched it.
/// `series` has the columns of the channels that [`reads_motion`] names.
pub fn explain_by_motion(found: &mut Analysis, rules: &Rules, frames: &Frames, series: &dyn Series) {
    let hands: Vec<HandColumns> =
        found.tracks.iter().filter_map(|track| HandColumns::new(frames, series, track.who.side()?)).collect();
    let mut falls = Vec::new();
    for track in &found.tracks {
        let Some(hand) = hands.iter().find(|hand| Some(hand.side) == track.who.side()) else { continue };
        let failed = track.tasks.iter().filter(|task| task.failure);
        falls.extend(failed.filter_map(|task| hand.fall(task, rules)));
    }
    found.falls = falls;
    let mut tasks = found.tracks.iter().flat_map(|track| &track.tasks);
    if tasks.all(|task| task.task == UNKNOWN) {
        found.untouched = untouched(frames, &hands);
    }
}

/// The columns of a hand and its target.
struct HandColumns<'a> {
    side: Side,
    frames: &'a Frames,
    series: &'a dyn Series,
    target: ColumnKey,
    touched: ColumnKey,
    position: [ColumnKey; 3],
    closed: Option<ColumnKey>,
    opening: Option<ColumnKey>,
    /// For each finger.
    distances: Vec<ColumnKey>,
}

impl<'a> HandColumns<'a> {
    /// The columns of a hand; `None` if the frames lack those of its target.
    fn new(frames: &'a Frames, series: &'a dyn Series, side: Side) -> Option<Self> {
        let column = |name: &str, slot: u32, component: u32| {
            let key = ColumnKey { channel: frames.channel(name)?, side: Some(side), slot, component };
            series.has(key).then_some(key)
        };
        let axis = |component| column(POSITION, 0, component);
        Some(Self {
            side,
            frames,
            series,
            target: column(TARGET, 0, 0)?,
            touched: column(TARGET_TOUCHED, 0, 0)?,
            position: [axis(0)?, axis(1)?, axis(2)?],
            closed: column(CLOSED, 0, 0),
            opening: column(OPENING, 0, 0),
            distances: (0..).map_while(|slot| column(DISTANCE, slot, 0)).collect(),
        })
    }

    /// The fall in the segment of a task that lets the object go.
    fn fall(&self, task: &TaskSpan, rules: &Rules) -> Option<Fall> {
        let lets_go = |does: Option<Meaning>| does == Some(Meaning::Open);
        let pairs = task.segments.iter().zip(task.segments.iter().skip(1));
        let (_, segment) = { pairs }.find(|(before, segment)| lets_go(segment.does) && !lets_go(before.does))?;
        let rate_hz = self.frames.layout.rate_hz;
        let within = |seconds: f64| (seconds * rate_hz).round() as usize;
        let [.., height] = self.position;
        let begun = segment.frames.start.saturating_sub(within(BEGUN_S));
        let heights = self.series.part(height, begun..segment.frames.start + 1);
        let sinks = heights.iter().zip(heights.iter().skip(1)).rev();
        let start = segment.frames.start - sinks.take_while(|(z, next)| *z - *next > FALLING / rate_hz).count();
        let end = (start + within(LONGEST_FALL_S)).min(self.frames.len);
        let (targets, heights) = (self.series.part(self.target, start..end), self.series.part(height, start..end));
        let first = targets.first()?;
        // A hand that takes the object again raises it.
        let mut lowest = f64::INFINITY;
        let falling = heights.iter().zip(targets.iter()).take_while(|(z, target)| {
            lowest = lowest.min(**z);
            *target == first && **z < lowest + MOVED_M
        });
        let falling: Vec<f64> = falling.map(|(z, _)| *z).collect();
        let top = falling.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let height_m = top - falling.iter().copied().fold(f64::INFINITY, f64::min);
        if !(height_m >= LEAST_FALL_M && height_m.is_finite()) {
            return None;
        }
        let halfway = falling.iter().position(|z| *z < top - height_m / 2.0)?;
        let before = start.saturating_sub(within(OPENED_S));
        let before_half = |key: ColumnKey| self.series.part(key, before..start + halfway + 1);
        let is_opened = self
            .closed
            .map(before_half)
            .is_some_and(|flags| flags.iter().any(|flag| *flag > 0.5) && flags.last().is_some_and(|flag| *flag < 0.5));
        let opens = self.opening.map(before_half).is_some_and(|openings| {
            let least = openings.iter().copied().fold(f64::INFINITY, f64::min);
            openings.last().is_some_and(|last| last - least > OPENED_M)
        });
        let is_from_open_jaws = is_opened || opens;
        let steps = falling.iter().zip(falling.iter().skip(within(FALL_S).max(1)));
        let fastest = steps.map(|(above, below)| above - below).fold(height_m.min(LEAST_FALL_M), f64::max);
        let advised = (fastest.min(height_m) * 1.1 / STEP_M).ceil() * STEP_M;
        let param = rules.params.iter().find(|param| param.name == DROP_WAY && is_from_open_jaws);
        let can_be = |value: f64, range: Option<(f64, f64)>| range.is_none_or(|(_, most)| value <= most);
        let drop_way_m = param.filter(|param| advised > param.value && can_be(advised, param.range)).map(|_| advised);
        let start_s = *self.frames.time.get(start)?;
        let track = TrackId::Hand(self.side);
        Some(Fall { track, frame: segment.frames.start, start_s, height_m, is_from_open_jaws, drop_way_m })
    }

    /// The least distance of a fingertip from the target in frames, m.
    fn least_distance(&self, frames: &Range<usize>) -> Option<f64> {
        let parts = self.distances.iter().flat_map(|key| together(frames).map(|part| self.series.part(*key, part)));
        parts.flat_map(|part| part.iter().copied().reduce(f64::min)).reduce(f64::min)
    }
}

/// A motion of a hand's target while no hand touches it.
struct Motion {
    object: i64,
    from: [f64; 3],
    /// Where it was when it last had moved.
    last: [f64; 3],
    farthest_m: f64,
    frames: Option<Range<usize>>,
}

impl Motion {
    fn take(&mut self, frame: usize, place: [f64; 3]) {
        let way = |from: [f64; 3]| from.iter().zip(place).map(|(from, to)| (to - from).powi(2)).sum::<f64>().sqrt();
        self.farthest_m = self.farthest_m.max(way(self.from));
        if way(self.last) > MOVED_M {
            self.last = place;
            let start = self.frames.as_ref().map_or(frame, |frames| frames.start);
            self.frames = Some(start..frame + 1);
        }
    }
}

/// The motion over the greatest distance of an object that no hand touched.
fn untouched(frames: &Frames, hands: &[HandColumns]) -> Vec<UntouchedMotion> {
    let mut farthest: Option<(Motion, &HandColumns)> = None;
    for hand in hands {
        for stretch in &frames.stretches {
            let mut motion: Option<Motion> = None;
            for part in together(stretch) {
                let read = |key: ColumnKey| hand.series.part(key, part.clone());
                let (targets, places) = (read(hand.target), hand.position.map(read));
                let touches: Vec<(Cow<[f64]>, Cow<[f64]>)> =
                    hands.iter().map(|other| (read(other.target), read(other.touched))).collect();
                for (at, target) in targets.iter().enumerate() {
                    let is_touched = touches.iter().any(|(targets, touched)| {
                        targets.get(at) == Some(target) && touched.get(at).is_some_and(|flag| *flag > 0.5)
                    });
                    let object = *target as i64;
                    let is_same = motion.as_ref().is_some_and(|motion| motion.object == object);
                    let ends = object < 0 || is_touched;
                    if ends || !is_same {
                        keep(&mut farthest, motion.take(), hand);
                    }
                    if ends {
                        continue;
                    }
                    let place = places.each_ref().map(|axis| axis.get(at).copied().unwrap_or(f64::NAN));
                    let new = || Motion { object, from: place, last: place, farthest_m: 0.0, frames: None };
                    motion.get_or_insert_with(new).take(part.start + at, place);
                }
            }
            keep(&mut farthest, motion.take(), hand);
        }
    }
    let described = |(motion, hand): (Motion, &HandColumns)| {
        let span = motion.frames?;
        let start_s = *frames.time.get(span.start)?;
        Some(UntouchedMotion {
            object: frames.objects.get(usize::try_from(motion.object).ok()?)?.clone(),
            way_m: motion.farthest_m,
            span_s: [start_s, frames.end_of(span.end - 1)],
            distance_m: hand.least_distance(&span),
        })
    };
    farthest.and_then(described).into_iter().collect()
}

/// Keeps a motion that is no jump and goes farther than the one before.
fn keep<'a, 'b>(
    farthest: &mut Option<(Motion, &'b HandColumns<'a>)>,
    motion: Option<Motion>,
    hand: &'b HandColumns<'a>,
) {
    let least_m = farthest.as_ref().map_or(LEAST_WAY_M, |(farthest, _)| farthest.farthest_m);
    let least_frames = (LEAST_S * hand.frames.layout.rate_hz).max(1.0) as usize;
    let lasts = |motion: &Motion| motion.frames.as_ref().is_some_and(|frames| frames.len() > least_frames);
    if let Some(motion) = motion.filter(|motion| motion.farthest_m > least_m && lasts(motion)) {
        *farthest = Some((motion, hand));
    }
}
