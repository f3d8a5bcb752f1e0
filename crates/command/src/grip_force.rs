//! The force of a grasp without measured forces. Logs of grippers often contain contact flags only, or forces of a solver that are zero in most frames. A
//! robot needs a force that holds the object with a margin.

use super::FRICTION;
use super::schema::Contact;
use super::series::{Episode, Series};
use nalgebra::Vector3;
use teachtree_base::hands::Finger;
use teachtree_base::meaning::Meaning;
use teachtree_base::recording::Recording;
use teachtree_base::scene::Body;
use teachtree_description::shape::{CollisionShape, solids};

/// A contact with a smaller force counts as one without a measured force, N.
const NOTHING_N: f64 = 0.05;
/// Minimum share of contact time without a measured force for a finger without a force sensor.
const UNMEASURED: f64 = 0.25;
/// The force as a multiple of the force that friction needs to carry the object, and the minimum force of the thumb, N.
const MARGIN: f64 = 4.0;
const LEAST_N: f64 = 2.0;
/// The force as a multiple of the force that two pads need to carry the object off its center of mass. A pad counts as a disc of 10 mm; the lever of its
/// friction is two thirds of that, m.
const MARGIN_OF_TURN: f64 = 1.5;
const TURN_M: f64 = 0.010 * 2.0 / 3.0;

/// Returns the center of mass of a body of uniform density, frame of the body, m.
fn mass_center(body: &Body) -> Vector3<f64> {
    let parts = solids(body);
    let parts = parts.iter().map(CollisionShape::mass_properties);
    let (volume, sum) = parts
        .fold((0.0, Vector3::zeros()), |(volume, sum), (own, center, _)| (volume + own, sum + center.coords * own));
    if volume > 0.0 { sum / volume } else { sum }
}

/// Returns the distance of a point from the line between two contacts, m.
fn lever(point: &Vector3<f64>, one: &Contact, other: &Contact) -> f64 {
    let (from, to) = (Vector3::from(one.point), Vector3::from(other.point));
    let along = (to - from).try_normalize(1e-9).unwrap_or_default();
    (point - from).cross(&along).norm()
}

/// Sets a holding force for the holding fingers without known forces: the thumb opposes all others together.
pub(super) fn with_forces(series: &mut Series, recording: &Recording, body: &Body, episodes: &[Episode]) {
    let held = |meaning: Meaning| !meaning.is_free() && !meaning.pushes();
    let pieces = episodes.iter().flat_map(|episode| &episode.pieces).filter(|piece| held(piece.does));
    let samples: Vec<usize> = pieces.flat_map(|piece| piece.samples.iter().copied()).collect();
    let touching: Vec<(usize, Finger)> = (series.fingers.iter().enumerate())
        .filter(|(_, finger)| samples.iter().any(|at| finger.touches[*at]))
        .map(|(at, finger)| (at, finger.finger))
        .collect();
    let others = touching.iter().filter(|(_, finger)| *finger != Finger::Thumb).count();
    // A grasp needs a thumb and an opposing finger.
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
            // Two pads prevent rotation about the line between them.
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
