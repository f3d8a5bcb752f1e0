//! Motions in a recording, and the rests between them.

use super::samples::{Samples, quantile};
use super::{Finding, FindingKind, short};
use teachtree_frames::raw_log::RawLog;

/// The columns of measurements and commands in data sets. Other columns count only in recordings without them.
const OF_SETS: [&str; 2] = ["observation.state", "action"];
/// Words in the names of columns that say where something is.
const PLACES: [&str; 4] = ["position", "orientation", "rotation", "translation"];
/// A column moves where it leaves its value by this share of its range, this many standard deviations of its noise, and more than this many of its
/// smallest steps.
const OF_RANGE: f64 = 0.01;
const OF_NOISE: f64 = 6.0;
const QUANTA: f64 = 2.5;
const NEARLY_ALL: f64 = 0.99;
/// The share of steps in which a measured column changes at least.
const CHANGING: f64 = 0.1;
/// Columns with a longer step, s, in the median, have goals or events: anything may move between two of them.
const LONGEST_STEP_S: f64 = 0.2;

/// The motion in a recording.
pub(super) struct Motion {
    /// The stamps at which something has moved, s, in order.
    events: Vec<f64>,
}

impl Motion {
    /// The motion in a log; `None` if no column shows any.
    pub fn of(log: &RawLog) -> Option<Self> {
        let is_sampled = |samples: &Samples| samples.time.len() > 2 && step(samples) <= LONGEST_STEP_S;
        let all: Vec<Samples> = log.tables.iter().flat_map(Samples::of).filter(is_sampled).collect();
        let named = |words: &[&str], is_named: &dyn Fn(&str, &str) -> bool| {
            all.iter().any(|it| words.iter().any(|word| is_named(&it.title, word)))
        };
        let is_of_set = |title: &str, word: &str| title.starts_with(word);
        let is_place = |title: &str, word: &str| title.split(['.', '/', '[', '_']).any(|part| part == word);
        let is_set = log.tables.iter().any(|table| !table.is_topic) && named(&OF_SETS, &is_of_set);
        let is_bag = log.tables.iter().all(|table| table.is_topic);
        let has_places = !is_set && is_bag && named(&PLACES, &is_place);
        let counts = |title: &str| match (is_set, has_places) {
            (true, _) => OF_SETS.iter().any(|word| is_of_set(title, word)),
            (false, true) => PLACES.iter().any(|word| is_place(title, word)),
            (false, false) => true,
        };
        // The columns of a data set are known to be measured; elsewhere a column that never changes may be a setting.
        let moving: Vec<&Samples> =
            all.iter().filter(|it| counts(&it.title) && (is_set || it.changing() >= CHANGING)).collect();
        if moving.is_empty() {
            return None;
        }
        let mut events: Vec<f64> = moving.into_iter().flat_map(events).collect();
        events.sort_by(f64::total_cmp);
        events.dedup();
        Some(Self { events })
    }

    /// Whether something moves between two times.
    pub fn is_between(&self, [start_s, end_s]: [f64; 2]) -> bool {
        let at = self.events.partition_point(|event| *event <= start_s);
        self.events.get(at).is_some_and(|event| *event < end_s)
    }

    /// The times between `start_s` and `end_s` in which nothing moves for at least `least_s`.
    pub fn still(&self, [start_s, end_s]: [f64; 2], least_s: f64) -> Vec<[f64; 2]> {
        let edges = std::iter::once(start_s).chain(self.events.iter().copied()).chain([end_s]);
        let ends = self.events.iter().copied().chain([end_s]);
        edges.zip(ends).map(|(from, to)| [from, to]).filter(|[from, to]| to - from >= least_s).collect()
    }

    /// The rests as findings.
    pub fn rests(&self, whole: [f64; 2], least_s: f64) -> Vec<Finding> {
        let [start_s, end_s] = whole;
        let finding = |[from, to]: [f64; 2]| {
            let (length, part) = (to - from, (to - from) / (end_s - start_s).max(f64::MIN_POSITIVE));
            let message = format!("nothing moves for {} s ({:.0} % of the recording)", short(length), part * 100.0);
            Finding { span_s: Some([from, to]), value: Some(length), ..Finding::new(FindingKind::Idle, message) }
        };
        self.still(whole, least_s).into_iter().map(finding).collect()
    }
}

/// The median of the steps between samples, s.
fn step(samples: &Samples) -> f64 {
    let steps: Vec<f64> = samples.time.iter().zip(samples.time.iter().skip(1)).map(|(at, next)| next - at).collect();
    quantile(&steps, 0.5)
}

/// Returns the times at which a column leaves its resting value.
fn events(samples: &Samples) -> Vec<f64> {
    const MEDIAN_OF_NORMAL: f64 = 0.6745;
    // The middle of two neighbors has half of their variance: a bend is √1.5 times as wide as the noise.
    let noise = quantile(&samples.bends(), 0.5) / MEDIAN_OF_NORMAL / 1.5_f64.sqrt();
    // A spike does not make the range larger.
    let range = quantile(&samples.values, NEARLY_ALL) - quantile(&samples.values, 1.0 - NEARLY_ALL);
    let least = (OF_RANGE * range).max(OF_NOISE * noise).max(QUANTA * samples.quantum());
    let mut events = Vec::new();
    let mut anchor = samples.values.first().copied().unwrap_or_default();
    for (time, value) in samples.time.iter().zip(&samples.values) {
        if (value - anchor).abs() > least {
            events.push(*time);
            anchor = *value;
        }
    }
    events
}

/// The rests of a log, s, each of at least `least_s`; `None` if no column shows motion.
pub fn rests(log: &RawLog, whole: [f64; 2], least_s: f64) -> Option<Vec<[f64; 2]>> {
    Motion::of(log).map(|motion| motion.still(whole, least_s))
}
