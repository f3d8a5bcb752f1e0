//! Several kinds of contact: a jam is a stronger one than a touch. The level is that of the weakest kind that the rules take for a contact.
//!
//! Readings without contact, of a touch and of a jam are three groups, and the split into two of them is between touch and jam if the jam is strong enough.
//! The readings below a split are therefore split again. Where the first split is not clear, the strongest readings are left out first.
//!
//! A weaker group may also be that of a tool that moves, as against one that rests. Only a group that exceeds the least force of the rules is taken for one
//! of contact; a group that comes near that force is reported.
//!
//! Contacts of every force below a jam are not a group of their own. They are then in the group without contact, whose forces are too large for that: such
//! readings have no level, and the least force of the rules applies.

use super::contact_level::{
    ContactLevel, FEWEST, LearnedLevel, OtherKind, TwoGroups, distances, groups_from, mixed, of_far, quantile, split,
    two_groups,
};
use nalgebra::Vector3;

/// The most kinds of contact.
const KINDS: usize = 3;
/// The share of all readings that a weaker kind of contact has: fewer are those at which a force rises.
const ENOUGH: f64 = 0.05;
/// A weaker kind of contact counts where its level is below this share of the stronger one's.
const WEAKER: f64 = 0.5;
/// If a tenth of the readings without contact exceed this multiple of the least force of the rules, they include contacts. At 5 N the limit is 50 N, the change
/// of force of a tool of 2.5 kg that is turned over.
const TOO_BROAD: f64 = 10.0;
/// The share of the least force of the rules from which on a weaker group is reported.
const NEAR_LEAST: f64 = 0.5;

/// Returns the level that the readings of a sensor show; `far` are those that are known to be without contact, where the log says where the sensor is.
/// `least` is the least force that the rules take for a contact, if they do: weaker kinds of contact are motion.
pub fn learned(readings: &[Vector3<f64>], far: Option<&[Vector3<f64>]>, least: Option<f64>) -> LearnedLevel {
    let level = match (far, least) {
        (Some(far), _) => of_far(readings, far),
        (None, Some(least)) => weakest(readings, least),
        (None, None) => two_groups(readings).map(|groups| groups.level),
    };
    level.map_or_else(|| mixed(readings), LearnedLevel::Level)
}

/// The level of the weakest kind of contact that readings in the order of time show; `least` is the least force that the rules take for a contact.
fn weakest(readings: &[Vector3<f64>], least: f64) -> Option<ContactLevel> {
    let is_kind = |groups: &TwoGroups| groups.contact.len() as f64 >= ENOUGH * readings.len() as f64;
    let is_contact = |groups: &TwoGroups| is_kind(groups) && groups.level.usual > least;
    let (mut found, mut stronger) = match two_groups(readings) {
        Some(groups) => (groups, None),
        None => {
            let (groups, stronger) = without_strongest(readings, is_contact)?;
            (groups, Some(stronger))
        }
    };
    let mut near = None;
    for _ in 1..KINDS {
        let Some(weaker) = two_groups(&found.free).filter(is_kind) else { break };
        if is_contact(&weaker) && weaker.level.begins < WEAKER * found.level.begins {
            stronger.get_or_insert(found.contact);
            found = weaker;
        } else {
            let ContactLevel { begins, usual, .. } = weaker.level;
            near = (usual > NEAR_LEAST * least && usual <= least).then_some(OtherKind { usual, begins });
            break;
        }
    }
    if found.level.scatter > TOO_BROAD * least {
        return None;
    }
    let other = stronger.map(|stronger| stronger_kind(&found.level, &stronger)).or(near);
    Some(ContactLevel { other, ..found.level })
}

/// The kind of contact of stronger readings than those of a level.
fn stronger_kind(level: &ContactLevel, readings: &[Vector3<f64>]) -> OtherKind {
    let usual = quantile(&distances(readings.iter().copied(), &level.rest), 0.5);
    // Midway between both kinds on the scale of ratios.
    OtherKind { usual, begins: (level.usual * usual).sqrt() }
}

/// Two clear groups of the readings that are left without the strongest ones, and these.
fn without_strongest(
    readings: &[Vector3<f64>],
    is_contact: impl Fn(&TwoGroups) -> bool,
) -> Option<(TwoGroups, Vec<Vector3<f64>>)> {
    let mut within = readings.to_vec();
    for _ in 0..KINDS {
        let cut = groups_from(&within, Vector3::zeros())?;
        if let Some(found) = two_groups(&cut.free).filter(&is_contact) {
            return Some((found, cut.contact));
        }
        let rest = cut.level.rest;
        let forces = distances(cut.contact.iter().copied(), &rest);
        let (weaker, strongest) = forces.split_at_checked(split(&forces)?.count)?;
        if strongest.len() < FEWEST {
            return None;
        }
        let border = quantile(weaker, 1.0);
        let (weaker, strongest): (Vec<_>, Vec<_>) =
            within.into_iter().partition(|force| (force - rest).norm() <= border);
        if let Some(found) = two_groups(&weaker).filter(&is_contact) {
            return Some((found, strongest));
        }
        within = weaker;
    }
    None
}
