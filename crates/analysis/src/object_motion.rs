//! How objects moved where that explains an outcome: how far one fell in a failed task, and how far one moved that no hand touched.

use super::measures::{POSITION, TARGET, together};
use super::{Analysis, TaskSpan, TrackId, UNKNOWN};
use std::borrow::Cow;
use std::ops::Range;
use teachtree_base::channels::TARGET_TOUCHED;
use teachtree_base::hands::{FingerPick, Side};
use teachtree_frames::frames::{ColumnKey, Frames};
use teachtree_frames::spilled_columns::Series;
use teachtree_language::rules::Rules;

/// Whether a gripper is closed.
const CLOSED: &str = "gripper.closed";
/// The opening of a gripper, m; constant if it is not known.
const OPENING: &str = "gripper.opening";
/// The standard deviation of the noise of the target's position along each axis, m.
const NOISE: &str = "target.noise";
/// The distance of each fingertip from the target, m.
const DISTANCE: &str = "fingers.distance";
/// Where each finger is, m.
const FINGERS: &str = "fingers.position";
/// The primitive of an object that falls out of the hand.
const DROP: &str = "Drop";
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
/// A fall begins where the object leaves the hand at this speed, m/s.
const FALLING: f64 = 0.01;
/// An object that falls leaves the hand by this way within [`FALL_S`], m; a shorter fall is not mentioned.
const LEAST_FALL_M: f64 = 0.01;
/// At the end of this way an object has begun to fall, m.
const BEGUN_M: f64 = 2e-3;
/// A shorter way of an object that no hand touched is not mentioned, m.
const LEAST_WAY_M: f64 = 0.03;
/// A shorter way that an object goes on is not mentioned, as a multiple of the noise of its position.
const LEAST_NOISES: f64 = 8.0;
/// Places within this time, s, are one.
const PLACE_S: f64 = 0.1;
/// A step of an object that noise does not make, m, and as a multiple of the noise of its position.
const MOVED_M: f64 = 5e-3;
const MOVED_NOISES: f64 = 2.0;
/// A tracker that jumps makes a step that is this much longer than those before and after it.
const JUMPS: f64 = 4.0;

/// The fall of an object out of a hand, in a failed task with a Drop.
#[derive(Clone, Debug, PartialEq)]
pub struct Fall {
    /// The hand of the task.
    pub track: TrackId,
    /// The first frame of the Drop.
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
    /// The least distance from its surface of a fingertip of the hands whose target it is, m; `None` if the rules do not measure it.
    pub distance_m: Option<f64>,
}

/// Whether [`explain_by_motion`] reads a channel.
pub fn reads_motion(channel: &str) -> bool {
    [TARGET, POSITION, TARGET_TOUCHED, NOISE, CLOSED, OPENING, DISTANCE, FINGERS].contains(&channel)
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
    noise: Option<ColumnKey>,
    closed: Option<ColumnKey>,
    opening: Option<ColumnKey>,
    /// For each finger.
    distances: Vec<ColumnKey>,
    /// The height of each fingertip.
    tips: Vec<ColumnKey>,
}

impl<'a> HandColumns<'a> {
    /// The columns of a hand; `None` if the frames lack those of its target.
    fn new(frames: &'a Frames, series: &'a dyn Series, side: Side) -> Option<Self> {
        let column = |name: &str, slot: u32, component: u32| {
            let key = ColumnKey { channel: frames.channel(name)?, side: Some(side), slot, component };
            series.has(key).then_some(key)
        };
        let axis = |component| column(POSITION, 0, component);
        let fingers = frames.layout.hand(side).map_or(&[][..], |hand| &hand.fingers[..]);
        let tips = (0..).zip(fingers).filter(|(_, finger)| FingerPick::Tips.picks(**finger));
        Some(Self {
            side,
            frames,
            series,
            target: column(TARGET, 0, 0)?,
            touched: column(TARGET_TOUCHED, 0, 0)?,
            position: [axis(0)?, axis(1)?, axis(2)?],
            noise: column(NOISE, 0, 0),
            closed: column(CLOSED, 0, 0),
            opening: column(OPENING, 0, 0),
            distances: (0..).map_while(|slot| column(DISTANCE, slot, 0)).collect(),
            tips: tips.filter_map(|(slot, _)| column(FINGERS, slot, 2)).collect(),
        })
    }

    /// The fall in the Drop of a task. It counts from where the object leaves the hand: a hand that lowers it does not drop it.
    fn fall(&self, task: &TaskSpan, rules: &Rules) -> Option<Fall> {
        let drop = task.segments.iter().find(|segment| segment.primitive == DROP)?;
        let rate_hz = self.frames.layout.rate_hz;
        let within = |seconds: f64| (seconds * rate_hz).round() as usize;
        let [.., height] = self.position;
        let nearby = self.one_target(drop.frames.start, within(BEGUN_S), within(LONGEST_FALL_S));
        let heights = self.series.part(height, nearby.clone());
        let above = self.tips_above(&heights, &nearby);
        let last = heights.len().checked_sub(1)?;
        // How far the object sinks and leaves the hand.
        let leaves = |from: usize, to: usize| (heights[from] - heights[to]).min(above[to] - above[from]);
        let window = within(FALL_S).max(1);
        let soon = |from: usize| (from + window).min(last);
        let first = (0..last).find(|from| leaves(*from, soon(*from)) >= LEAST_FALL_M)?;
        let begun = (first..soon(first)).rev().find(|at| leaves(first, *at) < BEGUN_M)?;
        let start = begun - (0..begun).rev().take_while(|at| leaves(*at, at + 1) > FALLING / rate_hz).count();
        // A hand that takes the object again comes near or raises it.
        let (mut lowest, mut farthest) = (f64::INFINITY, f64::NEG_INFINITY);
        let falling = heights.iter().zip(&above).skip(start).take_while(|(z, above)| {
            (lowest, farthest) = (lowest.min(**z), farthest.max(**above));
            **z < lowest + MOVED_M && **above > farthest - MOVED_M
        });
        let falling: Vec<f64> = falling.map(|(z, _)| *z).collect();
        let top = falling.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let height_m = top - falling.iter().copied().fold(f64::INFINITY, f64::min);
        let is_left_behind = farthest - above[start] > height_m / 2.0;
        if !(is_left_behind && height_m >= LEAST_FALL_M && height_m.is_finite()) {
            return None;
        }
        let halfway = falling.iter().position(|z| *z < top - height_m / 2.0)?;
        let fastest = (start..start + falling.len()).map(|at| leaves(at, soon(at))).fold(0.0, f64::max);
        let start = nearby.start + start;
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
        let advised = (fastest.min(height_m) * 1.1 / STEP_M).ceil() * STEP_M;
        let param = rules.params.iter().find(|param| param.name == DROP_WAY && is_from_open_jaws);
        let can_be = |value: f64, range: Option<(f64, f64)>| range.is_none_or(|(_, most)| value <= most);
        let drop_way_m = param.filter(|param| advised > param.value && can_be(advised, param.range)).map(|_| advised);
        let start_s = *self.frames.time.get(start)?;
        let track = TrackId::Hand(self.side);
        Some(Fall { track, frame: drop.frames.start, start_s, height_m, is_from_open_jaws, drop_way_m })
    }

    /// The frames around one, at most as many before and after it, in which the hand has the same target as there.
    fn one_target(&self, frame: usize, before: usize, after: usize) -> Range<usize> {
        let (begin, end) = (frame.saturating_sub(before), (frame + after).min(self.frames.len));
        let (earlier, later) = (self.series.part(self.target, begin..frame), self.series.part(self.target, frame..end));
        let is_same = |target: &&f64| later.first() == Some(*target);
        let (before, after) =
            (earlier.iter().rev().take_while(is_same).count(), later.iter().take_while(is_same).count());
        frame - before..frame + after
    }

    /// How high the middle of the fingertips is above the target, m; NaN where no fingertip is known.
    fn tips_above(&self, heights: &[f64], frames: &Range<usize>) -> Vec<f64> {
        let tips: Vec<Cow<[f64]>> = self.tips.iter().map(|key| self.series.part(*key, frames.clone())).collect();
        let above = |(at, z): (usize, &f64)| {
            let known = tips.iter().filter_map(|tip| tip.get(at).copied()).filter(|tip| tip.is_finite());
            let (sum, count) = known.fold((0.0, 0.0), |(sum, count), tip| (sum + tip, count + 1.0));
            sum / count - z
        };
        heights.iter().enumerate().map(above).collect()
    }

    /// The least distance of a fingertip from an object in the frames in which it is the target, m; `None` if it is not known.
    fn least_distance(&self, object: i64, frames: &Range<usize>) -> Option<f64> {
        let mut least = None;
        for part in together(frames) {
            let targets = self.series.part(self.target, part.clone());
            for key in &self.distances {
                let distances = self.series.part(*key, part.clone());
                let of_object = distances.iter().zip(targets.iter()).filter(|(_, target)| **target as i64 == object);
                least = of_object.map(|(distance, _)| *distance).chain(least).reduce(f64::min);
            }
        }
        least
    }

    /// Whether the hand has an object as its target in any of the frames.
    fn has_target(&self, object: i64, frames: &Range<usize>) -> bool {
        together(frames).any(|part| self.series.part(self.target, part).iter().any(|target| *target as i64 == object))
    }
}

/// The places of a hand's target while no hand touches it.
struct Places {
    object: i64,
    noise_m: f64,
    /// The frames of a place.
    together: usize,
    /// The first frame.
    start: usize,
    samples: [Vec<f64>; 3],
    /// Each is the median of its frames.
    places: Vec<[f64; 3]>,
}

impl Places {
    /// Adds a sample; one that is not a number is left out.
    fn take(&mut self, place: [f64; 3]) {
        if place.iter().any(|value| !value.is_finite()) {
            return;
        }
        self.samples.iter_mut().zip(place).for_each(|(samples, value)| samples.push(value));
        if self.samples[0].len() == self.together {
            self.places.push(self.samples.each_mut().map(|samples| {
                let middle = *samples.select_nth_unstable_by(self.together / 2, f64::total_cmp).1;
                samples.clear();
                middle
            }));
        }
    }

    /// The steps between the places. Of three places the one in the middle counts, and what a tracker jumps does not.
    fn steps(&self) -> Vec<[f64; 3]> {
        let middle = |[a, b, c]: [f64; 3]| a.min(b).max(a.max(b).min(c));
        let of_three = self.places.windows(3).filter_map(|three| <&[[f64; 3]; 3]>::try_from(three).ok());
        let smooth: Vec<[f64; 3]> =
            of_three.map(|[a, b, c]| [0, 1, 2].map(|axis| middle([a[axis], b[axis], c[axis]]))).collect();
        let between = smooth.iter().zip(smooth.iter().skip(1));
        let steps: Vec<[f64; 3]> = between.map(|(from, to)| [0, 1, 2].map(|axis| to[axis] - from[axis])).collect();
        let length = |at: Option<usize>| at.and_then(|at| steps.get(at)).map_or(0.0, |step| norm(*step));
        let jumps = |at: usize| {
            let beside = length(at.checked_sub(1)).max(length(Some(at + 1)));
            length(Some(at)) > self.moved_m() && length(Some(at)) > JUMPS * beside
        };
        (0..).zip(&steps).map(|(at, step)| if jumps(at) { [0.0; 3] } else { *step }).collect()
    }

    /// The least distance of two places between which the object moved, m.
    fn moved_m(&self) -> f64 {
        MOVED_M.max(MOVED_NOISES * self.noise_m)
    }

    /// The motion, if it is far enough to be mentioned.
    fn motion(&self) -> Option<Motion> {
        let (mut place, mut last) = ([0.0; 3], [0.0; 3]);
        let (mut farthest_m, mut moved) = (0.0_f64, None::<Range<usize>>);
        for (at, step) in self.steps().into_iter().enumerate() {
            place = [0, 1, 2].map(|axis| place[axis] + step[axis]);
            farthest_m = farthest_m.max(norm(place));
            if norm([0, 1, 2].map(|axis| place[axis] - last[axis])) > self.moved_m() {
                last = place;
                // The first place is the one in the middle of three.
                moved = Some(moved.map_or(at + 1, |moved| moved.start)..at + 3);
            }
        }
        let frames =
            |places: Range<usize>| self.start + places.start * self.together..self.start + places.end * self.together;
        let least_m = LEAST_WAY_M.max(LEAST_NOISES * self.noise_m);
        moved.filter(|_| farthest_m > least_m).map(|moved| Motion {
            object: self.object,
            farthest_m,
            frames: frames(moved),
        })
    }
}

/// A motion of a hand's target while no hand touches it.
struct Motion {
    object: i64,
    farthest_m: f64,
    frames: Range<usize>,
}

fn norm(vector: [f64; 3]) -> f64 {
    vector.iter().map(|value| value.powi(2)).sum::<f64>().sqrt()
}

/// The motion over the greatest distance of an object that no hand touched.
fn untouched(frames: &Frames, hands: &[HandColumns]) -> Vec<UntouchedMotion> {
    let mut farthest: Option<Motion> = None;
    let mut keep = |places: Option<Places>| {
        let motion = places.and_then(|places| places.motion());
        let least_m = farthest.as_ref().map_or(0.0, |farthest| farthest.farthest_m);
        if let Some(motion) = motion.filter(|motion| motion.farthest_m > least_m) {
            farthest = Some(motion);
        }
    };
    let together_rows = ((PLACE_S * frames.layout.rate_hz) as usize).max(1);
    for hand in hands {
        for stretch in &frames.stretches {
            let mut untouched: Option<Places> = None;
            for part in together(stretch) {
                let read = |key: ColumnKey| hand.series.part(key, part.clone());
                let (targets, places) = (read(hand.target), hand.position.map(read));
                let noises = hand.noise.map(read);
                let touches: Vec<_> = hands.iter().map(|other| (read(other.target), read(other.touched))).collect();
                for (at, target) in targets.iter().enumerate() {
                    let is_touched = touches.iter().any(|(targets, touched)| {
                        targets.get(at) == Some(target) && touched.get(at).is_some_and(|flag| *flag > 0.5)
                    });
                    let object = *target as i64;
                    let is_same = untouched.as_ref().is_some_and(|places| places.object == object);
                    let ends = object < 0 || is_touched;
                    if ends || !is_same {
                        keep(untouched.take());
                    }
                    if ends {
                        continue;
                    }
                    let new = || Places {
                        object,
                        noise_m: noises.as_ref().and_then(|noises| noises.get(at).copied()).unwrap_or(0.0),
                        together: together_rows,
                        start: part.start + at,
                        samples: Default::default(),
                        places: Vec::new(),
                    };
                    let place = places.each_ref().map(|axis| axis.get(at).copied().unwrap_or(f64::NAN));
                    untouched.get_or_insert_with(new).take(place);
                }
            }
            keep(untouched.take());
        }
    }
    let described = |motion: Motion| {
        let span = motion.frames.clone();
        let start_s = *frames.time.get(span.start)?;
        // The distance of a hand that the rules do not measure may be the least.
        let distances = { hands.iter() }.filter(|hand| hand.has_target(motion.object, &span));
        let distances: Option<Vec<f64>> = distances.map(|hand| hand.least_distance(motion.object, &span)).collect();
        Some(UntouchedMotion {
            object: frames.objects.get(usize::try_from(motion.object).ok()?)?.clone(),
            way_m: motion.farthest_m,
            span_s: [start_s, frames.end_of(span.end - 1)],
            distance_m: distances.into_iter().flatten().reduce(f64::min),
        })
    };
    farthest.and_then(described).into_iter().collect()
}
