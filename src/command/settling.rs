//! What the operator lets fall a little is put down where it came to rest: let go above its place, or askew. How it falls is chance, and a robot that lets it
//! fall as well has another one (the paper, section 2.1: such error is inadvertent).

use super::series::{Episode, Series};
use crate::base::easing::smooth_step;
use crate::base::meaning::Meaning;
use crate::base::recording::Recording;
use nalgebra::{Isometry3, Translation3};

/// It fell when it came to rest farther than this from where it was let go, m and rad; farther than the others it was dropped, and that is left as it was.
const FELL: (f64, f64) = (0.002, 0.035);
const DROPPED: (f64, f64) = (0.040, 0.6);
/// What was dropped from no higher than this, m, and came to rest the same way up is put down as well, from when on it was no farther than this from where it was
/// let go, m.
const LOWERED_M: f64 = 0.150;
const THERE_M: f64 = 0.030;
/// It is brought there within this share of the time that it was held.
const SHARE: f64 = 0.5;

/// Brings the object in the end of each episode to where it came to rest.
pub(super) fn put_down(series: &mut Series, recording: &Recording, object: &str, episodes: &[Episode]) {
    for (number, episode) in episodes.iter().enumerate() {
        let grasped = episode.pieces.iter().any(|piece| piece.does == Meaning::Close);
        let inserted = episode.pieces.iter().any(|piece| piece.does == Meaning::Insert);
        let held = episode.pieces.iter().filter(|piece| piece.touching && piece.does != Meaning::Open);
        let held: Vec<usize> =
            held.filter(|piece| piece.does != Meaning::Close).flat_map(|piece| piece.samples.iter().copied()).collect();
        let let_go = episode.pieces.last().filter(|piece| piece.does == Meaning::Open);
        let (Some(&first), Some(&last), Some(_)) = (held.first(), held.last(), let_go) else { continue };
        if !grasped {
            continue;
        }
        let touched_again = episodes.iter().skip(number + 1).flat_map(|later| &later.pieces).find(|it| it.touching);
        let rests = touched_again.map_or(series.len() - 1, |piece| piece.samples[0]);
        let rested = touched_again.is_none().then(|| series.at_rest(recording, object)).flatten();
        if inserted {
            // What is let go in a hole falls along it.
            if let (Some(rested), Some(wanted)) = (rested, series.wanted.last_mut()) {
                *wanted = rested;
            }
            continue;
        }
        let (from, to) = (series.object[last], rested.unwrap_or(series.object[rests]));
        let (way, turn) = apart(&from, &to);
        if (way < FELL.0 && turn < FELL.1) || way > LOWERED_M || turn > DROPPED.1 {
            continue;
        }
        let there = |at: &&usize| apart(&series.object[**at], &from).0 < THERE_M;
        let begins = if way > DROPPED.0 {
            held.iter().rev().take_while(there).last().copied().unwrap_or(last)
        } else {
            last - ((last - first) as f64 * SHARE) as usize
        };
        let turned = to.rotation * from.rotation.inverse();
        let moved = to.translation.vector - from.translation.vector;
        for at in held.into_iter().filter(|at| *at >= begins) {
            let share = smooth_step((at - begins) as f64 / (last - begins).max(1) as f64);
            let demonstrated = series.object[at];
            let place = Translation3::from(demonstrated.translation.vector + moved * share);
            series.wanted[at] = Isometry3::from_parts(place, turned.powf(share) * demonstrated.rotation);
        }
        for at in last + 1..series.len().min(rests + 1) {
            series.wanted[at] = to;
        }
    }
}

/// How far two poses are apart, m and rad.
fn apart(one: &Isometry3<f64>, other: &Isometry3<f64>) -> (f64, f64) {
    let way = one.translation.vector - other.translation.vector;
    (way.norm(), one.rotation.angle_to(&other.rotation))
}
