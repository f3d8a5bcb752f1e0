//! Contact levels of fingertip sensors: the reading without contact and the threshold of contact, learned from the readings alone.
//!
//! The readings without contact are a group about the least forces. It grows from the least readings, or from those that are known to be far from every
//! object, while a reading is within a few times the usual distance of the group from its median. Readings of contact may be spread as wide as they
//! like: the group ends at the first gap. A palm's sensor bears a tool and has a [level of two groups](super::contact_level) instead.
//!
//! The rest of a sensor that drifts is the median of the group in intervals of [`KNOT_SECS`] and longer, on straight lines in between. Group and rest are
//! determined from each other.

use super::contact_level::{distances, median_vector, quantile, vector_as_list};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// The fewest readings of a group.
const FEWEST: usize = 20;
/// The share of the readings with the least forces from which the group grows.
const SEED: f64 = 0.05;
/// The group includes readings up to this many times its usual distance from its median, before and after its drift is known.
const GROWS_FIRST_BY: f64 = 4.0;
const GROWS_BY: f64 = 3.0;
/// The group includes all readings within this distance of its median, N: no rule counts such a force as a contact.
const LEAST_REACH: f64 = 0.02;
/// Rounds in which the group grows, and in which group and rest are determined from each other; they settle after a few.
const ROUNDS: usize = 40;
const REST_ROUNDS: usize = 4;
/// The change from one sample to the next that nine of ten do not exceed, as a multiple of the usual distance of white noise from its median.
const CHANGE: f64 = 2.3;
/// Contact begins at this many times the distance that nine of ten readings without contact do not exceed, and ends at a part of that.
const ABOVE_REST: f64 = 2.2;
const MOST: f64 = 0.9;
pub const ENDS_AT: f64 = 0.8;
/// The usual contact is at least this many times the force at which contact begins.
const CLEAR: f64 = 1.3;
/// The largest force of a sensor without contact, N.
const LARGEST: f64 = 0.5;
/// The largest force of a sensor of which no reading is in contact, N: a stronger one may be a grip that lasts.
const LARGEST_ALONE: f64 = 0.3;
/// The largest usual distance of readings that are all without contact, N.
const STEADY: f64 = 0.05;
/// The shortest interval in which a rest is determined, s, the largest number of them, and the fewest readings of each.
const KNOT_SECS: f64 = 2.5;
const KNOTS: f64 = 100.0;
const IN_KNOT: usize = 8;
/// A smaller change of the rest is not drift, in N and as a multiple of the standard error of a rest.
const DRIFT: f64 = 0.02;
const SIGNIFICANT: f64 = 6.0;
/// The share of readings below the force that is reported where no level is found.
const WEAK: f64 = 0.1;

/// A reading of a sensor.
#[derive(Clone, Copy, Debug)]
pub struct Reading {
    /// Its stamp, s.
    pub time_s: f64,
    /// The force, N.
    pub force: Vector3<f64>,
    /// The force of the next sample, N.
    pub next: Vector3<f64>,
    /// Whether the fingertip is known to be far from every object.
    pub is_far: bool,
}

/// The result for the readings of a fingertip's sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FingertipLevel {
    /// The readings without contact are a group.
    Level(RestLevel),
    /// They are not; 90 % of all readings are above this force, N.
    Unclear(f64),
}

/// The reading of a sensor without contact, and the forces at which contact begins and ends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RestLevel {
    /// In order of time; one of a sensor that does not drift.
    pub rest: Vec<Rest>,
    /// The distance from the rest at which contact begins, N.
    pub begins: f64,
    /// The distance at which contact ends, N.
    pub ends: f64,
}

/// The reading without contact at a time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rest {
    /// s.
    pub time_s: f64,
    /// N.
    #[serde(with = "vector_as_list")]
    pub force: Vector3<f64>,
}

impl RestLevel {
    /// The reading without contact at a time, N.
    pub fn rest_at(&self, time_s: f64) -> Vector3<f64> {
        at(&self.rest, time_s)
    }

    /// The largest difference of the rest from its first value, N.
    pub fn drift(&self) -> f64 {
        let first = self.rest.first().map_or_else(Vector3::zeros, |rest| rest.force);
        self.rest.iter().map(|rest| (rest.force - first).norm()).fold(0.0, f64::max)
    }
}

/// Learns the level of a sensor from readings in order of time; without `may_drift` its rest is one value.
pub fn learned(readings: &[Reading], may_drift: bool) -> FingertipLevel {
    let level = of_group(readings, may_drift);
    level.map_or_else(
        || FingertipLevel::Unclear(quantile(&distances(readings.iter().map(|it| it.force), &Vector3::zeros()), WEAK)),
        FingertipLevel::Level,
    )
}

/// Whether readings far from every object show a drift.
pub fn drifts(readings: &[Reading]) -> bool {
    let far: Vec<bool> = readings.iter().map(|reading| reading.is_far).collect();
    drifting(readings, &far).is_some()
}

fn of_group(readings: &[Reading], may_drift: bool) -> Option<RestLevel> {
    let mut group = grown(readings, &[], seed(readings)?, GROWS_FIRST_BY)?;
    let mut rest = vec![];
    for _ in 0..REST_ROUNDS {
        let drifting = if may_drift { drifting(readings, &group) } else { None };
        rest = drifting.or_else(|| Some(vec![median(&members(readings, &group))?]))?;
        let next = grown(readings, &rest, group.clone(), GROWS_BY)?;
        if next == group {
            break;
        }
        group = next;
    }
    let bias = median_vector(rest.iter().map(|rest| &rest.force))?;
    let sorted = |of_group: bool| {
        let of = readings.iter().zip(&group).filter(|(_, member)| **member == of_group);
        let mut found: Vec<f64> = of.map(|(reading, _)| (reading.force - at(&rest, reading.time_s)).norm()).collect();
        found.sort_by(f64::total_cmp);
        found
    };
    let (free, contact) = (sorted(true), sorted(false));
    let begins = ABOVE_REST * quantile(&free, MOST);
    let usual = quantile(&free, 0.5);
    // A sensor that repeats one value in the whole log is not at rest, but simulated.
    let is_rest = match contact.len() < FEWEST {
        true => 0.0 < usual && usual <= STEADY && bias.norm() <= LARGEST_ALONE,
        false => quantile(&contact, 0.5) > CLEAR * begins,
    };
    (is_rest && bias.norm() <= LARGEST).then_some(RestLevel { rest, begins, ends: ENDS_AT * begins })
}

/// The readings from which the group grows: those far from every object unless these are nearly all, else the least forces.
fn seed(readings: &[Reading]) -> Option<Vec<bool>> {
    let far = readings.iter().filter(|reading| reading.is_far).count();
    if far >= FEWEST && far as f64 <= (1.0 - SEED) * readings.len() as f64 {
        return Some(readings.iter().map(|reading| reading.is_far).collect());
    }
    let forces = distances(readings.iter().map(|reading| reading.force), &Vector3::zeros());
    let count = FEWEST.max((SEED * readings.len() as f64) as usize);
    let most = *forces.get(count.checked_sub(1)?)?;
    Some(readings.iter().map(|reading| reading.force.norm() <= most).collect())
}

/// The readings of a group.
fn members<'a>(readings: &'a [Reading], group: &[bool]) -> Vec<&'a Reading> {
    readings.iter().zip(group).filter(|(_, member)| **member).map(|(reading, _)| reading).collect()
}

/// The group about a rest that grows from some readings; `None` where it has too few.
fn grown(readings: &[Reading], rest: &[Rest], mut group: Vec<bool>, grows_by: f64) -> Option<Vec<bool>> {
    let forces: Vec<Vector3<f64>> = readings.iter().map(|reading| reading.force - at(rest, reading.time_s)).collect();
    for _ in 0..ROUNDS {
        let of_group = forces.iter().zip(&group).filter(|(_, member)| **member).map(|(force, _)| force);
        let center = median_vector(of_group.clone())?;
        let usual = quantile(&distances(of_group.copied(), &center), 0.5);
        let changes = members(readings, &group).into_iter().map(|reading| reading.next - reading.force);
        let change = quantile(&distances(changes, &Vector3::zeros()), MOST);
        let reach = LEAST_REACH.max(grows_by * usual.max(change / CHANGE));
        let wider: Vec<bool> = forces.iter().map(|force| (force - center).norm() <= reach).collect();
        if wider == group {
            break;
        }
        group = wider;
    }
    (group.iter().filter(|member| **member).count() >= FEWEST).then_some(group)
}

/// The medians of a group in intervals of time; `None` where they hardly differ, or are too few.
fn drifting(readings: &[Reading], group: &[bool]) -> Option<Vec<Rest>> {
    let (first, last) = (readings.first()?.time_s, readings.last()?.time_s);
    let width = KNOT_SECS.max((last - first) / KNOTS);
    let interval = |reading: &Reading| ((reading.time_s - first) / width) as usize;
    let members = members(readings, group);
    let chunks = members.chunk_by(|one, next| interval(one) == interval(next));
    let (mut rest, mut error) = (vec![], 0.0_f64);
    for chunk in chunks.filter(|chunk| chunk.len() >= IN_KNOT) {
        let middle = median(chunk)?;
        let usual = quantile(&distances(chunk.iter().map(|reading| reading.force), &middle.force), 0.5);
        error = error.max(usual / (chunk.len() as f64).sqrt());
        rest.push(middle);
    }
    // A contact that fills an interval is not a rest: the middle one of three neighbors counts.
    let middle = |around: &[Rest]| median_vector(around.iter().map(|rest| &rest.force));
    let middles: Vec<Vector3<f64>> = rest.windows(3).filter_map(middle).collect();
    rest.iter_mut().skip(1).zip(middles).for_each(|(rest, middle)| rest.force = middle);
    let first = rest.first()?.force;
    let drift = rest.iter().map(|rest| (rest.force - first).norm()).fold(0.0, f64::max);
    (rest.len() > 2 && drift > DRIFT.max(SIGNIFICANT * error)).then_some(rest)
}

/// The median of readings, at their mean time.
fn median(readings: &[&Reading]) -> Option<Rest> {
    let forces: Vec<Vector3<f64>> = readings.iter().map(|reading| reading.force).collect();
    let time_s = readings.iter().map(|reading| reading.time_s).sum::<f64>() / readings.len() as f64;
    Some(Rest { time_s, force: median_vector(forces.iter())? })
}

/// The rest at a time, on a straight line between the values before and after; zero of none.
fn at(rest: &[Rest], time_s: f64) -> Vector3<f64> {
    let next = rest.partition_point(|rest| rest.time_s <= time_s);
    match (next.checked_sub(1).and_then(|before| rest.get(before)), rest.get(next)) {
        (Some(before), Some(after)) => {
            before.force + (after.force - before.force) * ((time_s - before.time_s) / (after.time_s - before.time_s))
        }
        (Some(only), None) | (None, Some(only)) => only.force,
        (None, None) => Vector3::zeros(),
    }
}
