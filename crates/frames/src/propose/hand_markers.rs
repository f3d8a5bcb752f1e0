//! Markers on a hand beside its fingertips, by their subject or by their motion: they are not objects.

use super::parts::{Part, Quantity, distances};
use super::quantiles::quantile;
use std::collections::BTreeMap;
use teachtree_base::hands::Finger;

/// The largest distance of two markers of a hand, m, …
const HAND_M: f64 = 0.25;
/// … and how far it varies as the fingers and the wrist bend, m.
const BENDS_M: f64 = 0.06;

/// Leaves out markers that stay near the fingertips of a person and have their subject, or keep their distance from them all the time. What is held does so only
/// for a time; where nothing else moves, the log may consist of one hold.
pub fn leave_out<'a, 'b: 'a>(rest: &mut [Part], hands: impl Iterator<Item = &'a BTreeMap<Finger, Part<'b>>>) {
    for tips in hands.filter(|tips| tips.len() > 1) {
        let Some(tip) = tips.values().next() else { continue };
        let is_marker = |part: &&mut Part| part.quantity == Quantity::Position && !part.is_constant();
        let has_subject = |part: &Part| subject(part).is_some() && subject(part) == subject(tip);
        // One subject may be that of the whole log.
        let is_of_hand = rest.iter().any(|part| part.quantity == Quantity::Position && !has_subject(part));
        let stays =
            |part: &Part| spread(part, tip).is_some_and(|[least, most]| most < HAND_M && most - least < BENDS_M);
        let has_others = rest.iter_mut().filter(is_marker).any(|part| part.extent() > HAND_M / 2.0 && !stays(part));
        let is_hand = |part: &Part| has_others && tip.extent() > HAND_M && stays(part);
        for part in rest.iter_mut().filter(is_marker) {
            if is_of_hand && has_subject(part) && is_near(part, tip) || is_hand(part) {
                part.quantity = Quantity::Other;
                part.left_out = Some("a marker of the hand: it stays near the fingertips".into());
            }
        }
    }
}

/// What stands before a colon in a name, as Vicon writes it.
fn subject<'a>(part: &'a Part<'_>) -> Option<&'a str> {
    part.name.split_once(':').map(|(subject, _)| subject)
}

/// Whether two points mostly stay within the size of a hand from each other.
pub fn is_near(one: &Part, other: &Part) -> bool {
    spread(one, other).is_some_and(|[_, most]| most < HAND_M)
}

/// Within what two points mostly stay from each other, m.
fn spread(one: &Part, other: &Part) -> Option<[f64; 2]> {
    let distances = distances(one, other);
    Some([quantile(distances.clone(), 0.1)?, quantile(distances, 0.9)?])
}
