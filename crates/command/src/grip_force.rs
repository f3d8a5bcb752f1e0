//! The force of a grasp that a log does not tell. The flags of a gripper say that its jaws touch; how hard they press is often not measured, or comes from a
//! solver that reports nothing in most frames. A robot nevertheless needs a force that holds the object with a margin.

use super::FRICTION;
use super::schema::Contact;
use super::series::{Episode, Series};
use nalgebra::Vector3;
use teachtree_base::hands::Finger;
use teachtree_base::meaning::Meaning;
use teachtree_base::recording::Recording;
use teachtree_base::scene::Body;
use teachtree_description::shape::{CollisionShape, solids};

/// A touch with less than this is one without a force, N.
const NOTHING_N: f64 = 0.05;
/// A finger of which this share of the touch is without a force does not measure it.
const UNMEASURED: f64 = 0.25;
/// How many times what friction needs to carry the object, and the least that the thumb presses with, N.
const MARGIN: f64 = 4.0;
const LEAST_N: f64 = 2.0;
/// How many times what two pads need to carry it beside its middle: a pad is taken for a disc of 10 mm, whose friction turns at two thirds of that, m.
const MARGIN_OF_TURN: f64 = 1.5;
const TURN_M: f64 = 0.010 * 2.0 / 3.0;

/// The middle of a body whose parts have one density, its frame, m.
fn mass_center(body: &Body) -> Vector3<f64> {
    let parts = solids(body);
    let parts = parts.iter().map(CollisionShape::mass_properties);
    let (volume, sum) = parts
        .fold((0.0, Vector3::zeros()), |(volume, sum), (own, center, _)| (volume + own, sum + center.coords * own));
    if volume > 0.0 { sum / volume } else { sum }
}

/// How far a point is from the line between two contacts, m.
fn lever(point: &Vector3<f64>, one: &Contact, other: &Contact) -> f64 {
    let (from, to) = (Vector3::from(one.point), Vector3::from(other.point));
    let along = (to - from).try_normalize(1e-9).unwrap_or_default();
    (point - from).cross(&along).norm()
}

/// Gives the fingers that hold an object, and of which no force is known, one that holds it: the thumb presses against all others together.
pub(super) fn with_forces(series: &mut Series, recording: &Recording, body: &Body, episodes: &[Episode]) {
    let held = |meaning: Meaning| !meaning.is_free() && !meaning.pushes();
    let pieces = episodes.iter().flat_map(|episode| &episode.pieces).filter(|piece| held(piece.does));
    let samples: Vec<usize> = pieces.flat_map(|piece| piece.samples.iter().copied()).collect();
    let touching: Vec<(usize, Finger)> = (series.fingers.iter().enumerate())
        .filter(|(_, finger)| samples.iter().any(|at| finger.touches[*at]))
        .map(|(at, finger)| (at, finger.finger))
        .collect();
    let others = touching.iter().filter(|(_, finger)| *finger != Finger::Thumb).count();
    // Only a grasp is held: a thumb and something opposite to it.
    if others == 0 || others == touching.len() {
        return;
    }
    let unmeasured = touching.iter().all(|(at, _)| {
        let finger = &series.fingers[*at];
        let touched: Vec<usize> = samples.iter().copied().filter(|at| finger.touches[*at]).collect();
        let without = touched.iter().filter(|at| finger.force[**at].norm() < NOTHING_N).count();
        without as f64 > UNMEASURED * touched.len() as f64
    });
    if !unmeasured {
        return;
    }
    let weight = body.mass.map_or(0.0, |mass| mass.0 * recording.scene.gravity().norm());
    let needed = (MARGIN * weight / (2.0 * FRICTION)).max(LEAST_N);
    let middle = mass_center(body);
    for episode in episodes {
        let pieces = episode.pieces.iter().filter(|piece| held(piece.does));
        let samples: Vec<usize> = pieces.flat_map(|piece| piece.samples.iter().copied()).collect();
        let contacts = series.contacts(body, episode).contacts;
        let needed = match &contacts[..] {
            // Two pads keep it from turning about the line between them.
            [one, other] => {
                needed.max(MARGIN_OF_TURN * weight * lever(&middle, one, other) / (2.0 * TURN_M * FRICTION))
            }
            _ => needed,
        };
        for contact in contacts {
            let force = if contact.finger == Finger::Thumb { needed } else { needed / others as f64 };
            series.press(&contact, force, &samples);
        }
    }
}
