//! Samples that cannot be: out and back within one or two of them, faster than anything moves, turns or presses.
//!
//! A marker that is taken for another, a bit that tips on the way: one such sample would be a fingertip elsewhere, a blow or a turn. It is
//! made unmeasured where a log is opened, before anything is computed from its neighbours, and goes the way of every other drop-out. So are the
//! first one or two of a log and the last ones, where a device tells zeros before it sees anything. What changes amid a log and stays is no such
//! sample, nor is a blow that lasts: those were measured.

use super::dropouts::{self, LARGEST, NO_ROTATION};
use super::frames::Issue;
use super::names;
use super::strangers::Stranger;
use crate::base::channels::Shape;
use crate::base::recording::Recording;
use crate::base::shown::Shown;
use crate::base::units::Dimension;

/// The most samples in a row that are taken out.
const LASTS: usize = 2;
/// The sample after may be farther from the one before by this share of the jump: hands go on meanwhile.
const AGREES: f64 = 0.2;
/// What a jump of a position is at least, m, and the acceleration that it takes, m/s²: no hand and nothing in it has half as much.
const PLACE: (f64, f64) = (0.020, 500.0);
/// What a jump of a rotation is at least, rad, and the acceleration that it takes, rad/s².
const TURN: (f64, f64) = (std::f64::consts::FRAC_PI_3, 5000.0);
/// What a jump of a fingertip's force is at least, N, and by how much more that grows with the square of the time, N/s²: a blow takes milliseconds, and
/// between samples that are farther apart it may come and go.
const PRESS: (f64, f64) = (100.0, 1e8);

/// How many rows are looked at together.
const CHUNK: usize = 1024;

/// What a channel measures, of those that are looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Place,
    Turn,
    Press,
}

impl Kind {
    /// Fingertips, palms and bodies are looked at. Forces between bodies are not: those are simulated, and the steps of a simulation are blows.
    fn of(shape: Shape, dimension: Dimension, bodies: [Option<&str>; 2]) -> Option<Self> {
        match (shape, dimension) {
            (Shape::Vec3, Dimension::LENGTH) => Some(Self::Place),
            (Shape::Vec3, Dimension::FORCE) if bodies == [None, None] => Some(Self::Press),
            (Shape::Rotation, _) => Some(Self::Turn),
            _ => None,
        }
    }

    /// What a jump is at least, and what it takes for the square of the time.
    const fn limits(self) -> (f64, f64) {
        match self {
            Self::Place => PLACE,
            Self::Turn => TURN,
            Self::Press => PRESS,
        }
    }

    /// How far samples are apart: m, rad or N.
    fn apart(self, a: &Sample, b: &Sample) -> f64 {
        let pairs = || a.value.iter().zip(&b.value);
        match self {
            Self::Turn => {
                // Either sign of a quaternion is the same rotation.
                let [along, against] =
                    [1.0, -1.0].map(|sign: f64| pairs().map(|(a, b)| (a - sign * b) * (a - sign * b)).sum::<f64>());
                4.0 * (along.min(against).sqrt() / 2.0).min(1.0).asin()
            }
            Self::Place | Self::Press => pairs().map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt(),
        }
    }

    /// Whether nothing gets from one sample to the next.
    fn cannot(self, a: &Sample, b: &Sample) -> bool {
        let (apart, secs) = (self.apart(a, b), b.time - a.time);
        let (least, rate) = self.limits();
        apart >= least && apart > rate * secs * secs
    }

    /// How far off samples are when they are out and back.
    fn jump(self, before: &Sample, out: &[Sample], after: &Sample) -> Option<f64> {
        let (first, last) = (out.first()?, out.last()?);
        let far = |sample: &Sample| self.apart(before, sample).min(self.apart(sample, after));
        let least = out.iter().map(far).fold(f64::INFINITY, f64::min);
        let is_one = self.cannot(before, first) && self.cannot(last, after);
        let (enough, _) = self.limits();
        (is_one && least >= enough && self.apart(before, after) <= AGREES * least).then_some(least)
    }
}

/// A sample of a channel; the fourth component of a vector is zero.
#[derive(Clone, Copy, Debug)]
struct Sample {
    row: usize,
    time: f64,
    value: [f64; 4],
}

/// Looks at the samples of a channel one after the other, with no more than four in mind: the last one that was good, those that may be out,
/// and the one after them.
pub struct Jumps {
    kind: Kind,
    recent: Vec<Sample>,
    rows: usize,
    /// The first samples but those in mind; `None` once they are known to be good, or told.
    first: Option<Vec<Sample>>,
    /// Whether the sample before those in mind is as near to the first of them as it has to be.
    settled: bool,
}

/// Samples that cannot be.
struct Out {
    samples: Vec<Sample>,
    jump: f64,
}

impl Jumps {
    /// Of a channel that is looked at.
    pub fn of(channel: &str) -> Option<Self> {
        let (shape, dimension, bodies) = names::channel(channel)?;
        Kind::of(shape, dimension, bodies).map(|kind| Self {
            kind,
            recent: vec![],
            rows: 0,
            first: Some(vec![]),
            settled: false,
        })
    }

    /// Looks at more rows of a channel's components; whether none of them is out.
    pub fn look(&mut self, time: &[f64], parts: &[&[f64]]) -> bool {
        self.find(time, parts).is_empty()
    }

    /// The same, and which are.
    fn find(&mut self, time: &[f64], parts: &[&[f64]]) -> Vec<Out> {
        let mut found = vec![];
        for start in (0..time.len()).step_by(CHUNK) {
            let rows = start..(start + CHUNK).min(time.len());
            let time = time.get(rows.clone()).unwrap_or_default();
            let parts: Vec<&[f64]> = parts.iter().map(|part| part.get(rows.clone()).unwrap_or_default()).collect();
            // Almost all of a log is calm, and that is soon seen.
            let mut first = 0;
            if self.is_calm(&parts, rows.len()) {
                first = rows.len() - 1;
                self.recent.clear();
                (self.first, self.settled) = (None, true);
            }
            for (at, time) in time.iter().enumerate().skip(first) {
                found.extend(self.sample(self.rows + at, *time, &parts, at).and_then(|sample| self.take(sample)));
            }
            self.rows += rows.len();
        }
        found
    }

    /// Whether the last rows that it looked at, when they were the last of all, are not out either.
    pub fn finish(&self) -> bool {
        self.at_the_end().is_none()
    }

    /// The last samples, when nothing comes after their jump that would bear them out.
    fn at_the_end(&self) -> Option<Out> {
        let (before, out) = self.recent.split_first()?;
        let next = out.first()?;
        let is_out = self.first.is_none() && self.settled && self.kind.cannot(before, next);
        is_out.then(|| Out { samples: out.to_vec(), jump: self.kind.apart(before, next) })
    }

    /// Whether no component changes so much from row to row that a sample could be out, and all are measured.
    fn is_calm(&self, parts: &[&[f64]], rows: usize) -> bool {
        let before = match self.recent.as_slice() {
            [] => None,
            [before] => Some(before),
            _ => return false,
        };
        let most = match self.kind {
            // Each of three components may have its part in a jump.
            Kind::Place => PLACE.0 / 2.0,
            Kind::Press => PRESS.0 / 2.0,
            // The change of a unit quaternion is 0.5 at least, and its components are four; lengths differ a little.
            Kind::Turn => 0.1,
        };
        let is_calm = |(component, part): (usize, &&[f64])| {
            let Some(first) = part.first().filter(|first| part.len() == rows && first.abs() < LARGEST / 2.0) else {
                return false;
            };
            let was = before.and_then(|before| before.value.get(component)).unwrap_or(first);
            let pairs = part.iter().zip(part.iter().skip(1));
            (first - was).abs() < most && pairs.fold(true, |calm, (one, next)| calm & ((next - one).abs() < most))
        };
        let are_rotations = || match parts {
            [w, x, y, z] => dropouts::are_rotations([w, x, y, z]),
            _ => true,
        };
        parts.iter().enumerate().all(is_calm) && are_rotations()
    }

    /// A sample of some components; `None` of what is not measured, or cannot be by itself: that is no neighbour.
    fn sample(&self, row: usize, time: f64, parts: &[&[f64]], at: usize) -> Option<Sample> {
        let mut value = [0.0; 4];
        for (component, part) in value.iter_mut().zip(parts) {
            *component = part.get(at).copied().filter(|value| value.abs() <= LARGEST)?;
        }
        if self.kind == Kind::Turn {
            let length = value.iter().map(|component| component * component).sum::<f64>().sqrt();
            if length < NO_ROTATION {
                return None;
            }
            value.iter_mut().for_each(|component| *component /= length);
        }
        Some(Sample { row, time, value })
    }

    fn take(&mut self, sample: Sample) -> Option<Out> {
        self.recent.push(sample);
        while let [before, next, ..] = self.recent.as_slice() {
            let mut began_out = None;
            if self.kind.cannot(before, next) {
                let last = self.recent.len() - 1;
                let out = self.recent.get(1..last).unwrap_or_default();
                if let Some(jump) = self.kind.jump(before, out, &sample) {
                    let samples = out.to_vec();
                    self.recent.drain(..last);
                    (self.first, self.settled) = (None, true);
                    return Some(Out { samples, jump });
                }
                if out.len() < LASTS {
                    return None;
                }
                began_out = self.at_the_beginning();
            }
            self.pass();
            if began_out.is_some() {
                self.first = None;
                return began_out;
            }
        }
        None
    }

    /// The samples up to a jump, when they are the first ones and what comes after it stays.
    fn at_the_beginning(&self) -> Option<Out> {
        let ([before, after @ ..], Some(first)) = (self.recent.as_slice(), &self.first) else { return None };
        let stays = after.windows(2).all(|pair| matches!(pair, [a, b] if !self.kind.cannot(a, b)));
        let samples: Vec<Sample> = first.iter().chain([before]).copied().collect();
        let jump = self.kind.apart(before, after.first()?);
        (stays && samples.len() <= LASTS).then_some(Out { samples, jump })
    }

    /// Goes on by a sample.
    fn pass(&mut self) {
        let passed = self.recent.remove(0);
        self.settled = self.recent.first().is_some_and(|next| !self.kind.cannot(&passed, next));
        self.first = self.first.take().filter(|first| first.len() < LASTS).map(|mut first| {
            first.push(passed);
            first
        });
    }
}

/// Makes unmeasured what is out in a recording; an issue for each channel that has such samples.
pub fn take_out(recording: &mut Recording) -> Vec<Issue> {
    let first = |name: &String| {
        names::meaning(name).filter(|meaning| meaning.component == 0).map(|meaning| meaning.channel.to_string())
    };
    // What the scene does not know is read by nobody.
    let known = recording.columns.keys().filter(|name| Stranger::of(name, &recording.scene).is_none());
    let channels: Vec<String> = known.filter_map(first).collect();
    let mut issues = vec![];
    for channel in channels {
        let Some(mut jumps) = Jumps::of(&channel) else { continue };
        let Some((shape, ..)) = names::channel(&channel) else { continue };
        let columns: Vec<String> = shape.components().iter().map(|letter| format!("{channel}.{letter}")).collect();
        let parts: Vec<&[f64]> = columns
            .iter()
            .filter_map(|name| recording.columns.get(name))
            .map(|column| column.values.as_slice())
            .filter(|values| values.len() == recording.time.len())
            .collect();
        if parts.len() < columns.len() {
            continue;
        }
        let mut found = jumps.find(&recording.time, &parts);
        found.extend(jumps.at_the_end());
        let Some(worst) = found.iter().reduce(|worst, out| if out.jump > worst.jump { out } else { worst }) else {
            continue;
        };
        let samples: Vec<Sample> = found.iter().flat_map(|out| &out.samples).copied().collect();
        issues.extend(told(&channel, jumps.kind, &samples, worst));
        for name in &columns {
            let Some(column) = recording.columns.get_mut(name) else { continue };
            for sample in &samples {
                if let Some(value) = column.values.get_mut(sample.row) {
                    *value = f64::NAN;
                }
            }
        }
    }
    issues
}

fn told(channel: &str, kind: Kind, samples: &[Sample], worst: &Out) -> Option<Issue> {
    let (first, last, shown) = (samples.first()?, samples.last()?, worst.samples.first()?);
    let rounded = |value: f64| Shown((value * 1e4).round() / 1e4);
    let [a, b, c, d] = shown.value.map(rounded);
    let (jump, value) = match kind {
        Kind::Place => (format!("{} mm", Shown((worst.jump * 1e3).round())), format!("({a}, {b}, {c}) m")),
        Kind::Press => (format!("{} N", Shown(worst.jump.round())), format!("({a}, {b}, {c}) N")),
        Kind::Turn => (format!("{}°", Shown(worst.jump.to_degrees().round())), format!("({a}, {b}, {c}, {d})")),
    };
    let at_s = rounded(shown.time);
    let (cannot, are) = match samples.len() {
        1 => (format!("1 sample cannot be: {value} at {at_s} s"), "it is"),
        many => (format!("{many} samples cannot be: the farthest, {value} at {at_s} s,"), "they are"),
    };
    let message = format!("{cannot} is {jump} from the samples about it; {are} taken as not measured");
    let (kind, channel) = ("impossible_jump".into(), channel.into());
    Some(Issue { kind, start_s: first.time, end_s: last.time, channel, message })
}
