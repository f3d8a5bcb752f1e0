//! Contact levels: from which force on a sensor is in contact, learned from the log itself.
//!
//! Forces without contact and forces of contact are two groups. Where the log shows that the fingertip is far from every object, those readings
//! are the first group; where no distance is known, the force is split where the two groups are farthest apart (Otsu's threshold, of the
//! square root of the force, since a larger force scatters more). The rest is the median of the first group, and forces count from there.
//!
//! A surface that bears a part of a tool's weight makes the reading of a biased sensor smaller, and the groups change places. A recording begins and ends
//! without contact: if an end is in the group of contact, and the rest is more than a small part of its force, the split is repeated from the ends' readings.
//!
//! The split is not a threshold if the groups are not [clear](crate::otsu::OtsuSplit::is_clear). Where there are several kinds of contact, the weakest
//! one decides ([`contact_kinds`](super::contact_kinds)).

use crate::otsu::{self, OtsuSplit};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// The fewest samples of a group.
pub(super) const FEWEST: usize = 20;
/// The share of a recording that is its beginning, and its end.
const END: f64 = 0.02;
/// A rest that is a larger share of the usual force of contact may be that of contact.
const LARGE_REST: f64 = 0.2;
/// Number of iterations between the split and the rest: on all logs that we have they converge at once.
const ROUNDS: usize = 4;
/// Contact begins at no less than this share of the force of the usual contact.
const SHARE: f64 = 0.1;
/// The share of the readings without contact that a level lies above.
const MOST: f64 = 0.9;
/// This value if those readings are known, and the ratio of the level to that reading.
const NEARLY_ALL: f64 = 0.99;
const ABOVE_FAR: f64 = 1.5;
/// The share of the level at which contact ends, for groups and for known readings without contact.
const ENDS_AT: f64 = 0.6;
const ENDS_AT_FAR: f64 = 0.8;

/// The force level at which a sensor is in contact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactLevel {
    /// The reading of the sensor without contact, N.
    #[serde(with = "vector_as_list")]
    pub rest: Vector3<f64>,
    /// The distance from that reading that most readings without contact do not exceed, N.
    pub scatter: f64,
    /// The distance from the rest at which contact begins, N.
    pub begins: f64,
    /// The distance at which contact ends, N.
    pub ends: f64,
    /// The usual distance of readings with contact from the rest, N.
    pub usual: f64,
    /// Another group of readings that may be the one of contact.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub other: Option<OtherKind>,
}

/// A group of readings that is not the one that the level was learned from, but may be the one of the weakest contact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OtherKind {
    /// The usual distance of its readings from the rest, N.
    pub usual: f64,
    /// The level if it is the one of the weakest contact, N.
    pub begins: f64,
}

/// The contact level that the readings of a sensor show.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LearnedLevel {
    /// The readings have a contact level.
    Level(ContactLevel),
    /// The readings do not fall into two groups; 99 % of them are above the first force, N, and the largest is the second.
    Mixed {
        #[serde(default)]
        weakest: f64,
        strongest: f64,
    },
}

/// Statistics of readings without a level.
pub(super) fn mixed(readings: &[Vector3<f64>]) -> LearnedLevel {
    let forces = distances(readings.iter().copied(), &Vector3::zeros());
    LearnedLevel::Mixed { weakest: quantile(&forces, 1.0 - NEARLY_ALL), strongest: quantile(&forces, 1.0) }
}

/// Readings in two groups: without contact, and of contact.
pub struct TwoGroups {
    /// The level between them.
    pub level: ContactLevel,
    /// The readings without contact, in the order of time.
    pub free: Vec<Vector3<f64>>,
    /// The readings of contact.
    pub contact: Vec<Vector3<f64>>,
    /// Whether there are two groups, and not one that was cut.
    pub is_clear: bool,
}

/// The clear groups of readings in the order of time.
pub fn two_groups(readings: &[Vector3<f64>]) -> Option<TwoGroups> {
    let clear_groups = |rest| groups_from(readings, rest).filter(|groups| groups.is_clear);
    let found = clear_groups(Vector3::zeros())?;
    let ends = ends(readings);
    let begin_and_end_free = |groups: &TwoGroups| {
        let reads = |end: &&[Vector3<f64>]| quantile(&distances(end.iter().copied(), &groups.level.rest), 0.5);
        ends.iter().all(|end| reads(end) < groups.level.begins)
    };
    if begin_and_end_free(&found) || found.level.rest.norm() < LARGE_REST * found.level.usual {
        return Some(found);
    }
    let other = median_vector(ends.iter().copied().flatten()).and_then(clear_groups);
    other.filter(begin_and_end_free).or(Some(found))
}

/// The beginning and the end of readings.
fn ends(readings: &[Vector3<f64>]) -> [&[Vector3<f64>]; 2] {
    let count = ((readings.len() as f64 * END) as usize).max(1).min(readings.len());
    [&readings[..count], &readings[readings.len() - count..]]
}

/// Two groups of readings, looked for from a rest.
pub(super) fn groups_from(readings: &[Vector3<f64>], mut rest: Vector3<f64>) -> Option<TwoGroups> {
    for _ in 1..ROUNDS {
        let forces = distances(readings.iter().copied(), &rest);
        let count = split(&forces)?.count;
        let border = *forces.get(count.checked_sub(1)?)?;
        rest = median_vector(readings.iter().filter(|force| (*force - rest).norm() <= border))?;
    }
    let forces = distances(readings.iter().copied(), &rest);
    let split = split(&forces)?;
    let (free, contact) = forces.split_at_checked(split.count)?;
    if free.len() < FEWEST || contact.len() < FEWEST {
        return None;
    }
    let (scatter, usual, border) = (quantile(free, MOST), quantile(contact, 0.5), quantile(free, 1.0));
    // Midway between the groups on the scale of ratios.
    let midway = (quantile(free, 0.5) * usual).sqrt();
    let begins = midway.max(SHARE * usual).max(scatter);
    let level = ContactLevel { rest, scatter, begins, ends: (ENDS_AT * begins).max(scatter), usual, other: None };
    let (free, contact) = readings.iter().copied().partition(|force| (force - rest).norm() <= border);
    Some(TwoGroups { level, free, contact, is_clear: split.is_clear() })
}

/// The level of a sensor of which it is known when it is without contact.
pub(super) fn of_far(readings: &[Vector3<f64>], far: &[Vector3<f64>]) -> Option<ContactLevel> {
    if far.len() < FEWEST {
        return None;
    }
    let rest = median_vector(far.iter())?;
    let free = distances(far.iter().copied(), &rest);
    let begins = ABOVE_FAR * quantile(&free, NEARLY_ALL);
    let all = distances(readings.iter().copied(), &rest);
    let contact = all.get(all.partition_point(|force| *force < begins)..).unwrap_or_default();
    if contact.len() < FEWEST {
        return None;
    }
    let usual = quantile(contact, 0.5);
    let begins = begins.max(SHARE * usual);
    let scatter = quantile(&free, MOST);
    (begins < usual).then_some(ContactLevel { rest, scatter, begins, ends: ENDS_AT_FAR * begins, usual, other: None })
}

/// The two groups of forces in rising order; their roots scatter evenly.
pub(super) fn split(forces: &[f64]) -> Option<OtsuSplit> {
    otsu::split(&forces.iter().map(|force| force.sqrt()).collect::<Vec<_>>())
}

/// Returns the distances of forces from a rest, in rising order.
pub fn distances(forces: impl IntoIterator<Item = Vector3<f64>>, rest: &Vector3<f64>) -> Vec<f64> {
    let mut distances: Vec<f64> = forces.into_iter().map(|force| (force - rest).norm()).collect();
    distances.sort_by(f64::total_cmp);
    distances
}

/// A quantile of values in rising order; 0 of none.
pub fn quantile(values: &[f64], share: f64) -> f64 {
    let last = values.len().saturating_sub(1);
    values.get((share * last as f64).round() as usize).copied().unwrap_or_default()
}

/// The median of each component.
pub fn median_vector<'a>(forces: impl Iterator<Item = &'a Vector3<f64>> + Clone) -> Option<Vector3<f64>> {
    let median = |axis: usize| {
        let mut parts: Vec<f64> = forces.clone().filter_map(|force| force.get(axis).copied()).collect();
        parts.sort_by(f64::total_cmp);
        parts.get(parts.len() / 2).copied()
    };
    Some(Vector3::new(median(0)?, median(1)?, median(2)?))
}

/// Vectors as lists of three numbers in files.
pub mod vector_as_list {
    use nalgebra::Vector3;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    /// Writes a vector.
    pub fn serialize<S: Serializer>(vector: &Vector3<f64>, serializer: S) -> Result<S::Ok, S::Error> {
        [vector.x, vector.y, vector.z].serialize(serializer)
    }

    /// Reads a vector.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vector3<f64>, D::Error> {
        <[f64; 3]>::deserialize(deserializer).map(Vector3::from)
    }
}
