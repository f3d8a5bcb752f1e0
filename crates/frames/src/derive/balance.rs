//! The balance of forces on an object: what its contacts must bear, since its mass, its motion and the fingers on it are known.
//!
//! `m (a - g) = F_fingers + F_contacts`. The fingers' forces are those of the hands that touch it. Everything is averaged over [`HALF_WINDOW_SECS`] before and
//! after.

use super::hands::{HandTrack, feels};
use super::motion::{Motion, moving_average, vector};
use crate::clean::preprocess::CleanLog;
use nalgebra::Vector3;
use teachtree_base::hands::Finger;

/// Half the window of the average, s.
const HALF_WINDOW_SECS: f64 = 0.025;
/// The balance is believed when its error is less than this share of the weight.
const BELIEVED: f64 = 0.25;
/// Minimum force of a contact, in standard deviations of its noise.
const ABOVE_NOISE: f64 = 4.0;

/// The balance of an object's contact forces over the whole log.
pub struct Balance {
    /// Force of all contacts on the object, reference frame, N.
    force: Vec<Vector3<f64>>,
    /// A force less than this may be noise, N.
    pub noise: f64,
}

impl Balance {
    /// The balance of an object; `None` when its mass or the fingers' forces are not known, or when it does not come out: while the object is
    /// `clear` of everything, the contacts must bear nothing.
    pub fn of(
        measured: &CleanLog,
        motions: &[Motion],
        tracks: &[HandTrack],
        body: usize,
        clear: impl Fn(usize) -> bool,
    ) -> Option<Self> {
        let (hands, weight) = (hands(measured, tracks, body)?, weight(measured, body)?);
        let force = unborne(measured, motions, &hands, body)?;
        let variance: f64 =
            hands.iter().map(|(_, sensors)| sensors.iter().map(|it| it.variance).sum::<f64>()).fold(0.0, f64::max);
        let noise = ABOVE_NOISE * (variance / (2 * balanced(measured.rate_hz) + 1) as f64).sqrt();
        let in_air: Vec<f64> = (0..measured.len())
            .filter(|frame| clear(*frame) && hands.iter().any(|(track, _)| holds(track, body, *frame)))
            .filter_map(|frame| force.get(frame).map(Vector3::norm))
            .collect();
        let error = if in_air.is_empty() { 0.0 } else { in_air.iter().sum::<f64>() / in_air.len() as f64 };
        (noise.max(error) <= BELIEVED * weight).then_some(Self { force, noise: noise.max(2.0 * error) })
    }

    /// Returns the balance in a window of a log whose forces are known to balance, with this noise, N.
    pub fn known(
        measured: &CleanLog,
        motions: &[Motion],
        tracks: &[HandTrack],
        body: usize,
        noise: f64,
    ) -> Option<Self> {
        let force = unborne(measured, motions, &hands(measured, tracks, body)?, body)?;
        Some(Self { force, noise })
    }

    /// Force of all contacts on the object, reference frame, N.
    pub fn force(&self, frame: usize) -> Vector3<f64> {
        self.force.get(frame).copied().unwrap_or_default()
    }
}

/// The force sensor of a finger.
struct Sensor<'a> {
    force: [&'a [f64]; 3],
    /// The variance of its noise, summed over the vector's components, N²; 0 if unknown.
    variance: f64,
}

/// A hand that holds an object, with the force sensors of its fingers.
type HoldingHand<'a, 'm> = (&'a HandTrack, Vec<Sensor<'m>>);

fn holds(track: &HandTrack, body: usize, frame: usize) -> bool {
    track.touching.get(frame) == Some(&true) && track.target.get(frame) == Some(&Some(body))
}

/// The hands that hold a body at some time; `None` when one of them has no sensors, or no channel shows what a hand holds.
fn hands<'a, 'm>(measured: &'m CleanLog, tracks: &'a [HandTrack], body: usize) -> Option<Vec<HoldingHand<'a, 'm>>> {
    if !tracks.iter().all(|track| feels(track.side, measured.columns.keys().copied())) {
        return None;
    }
    let holding = tracks.iter().filter(|track| (0..measured.len()).any(|frame| holds(track, body, frame)));
    let hands: Vec<HoldingHand> = holding.map(|track| (track, sensors(measured, track))).collect();
    (!hands.iter().any(|(_, sensors)| sensors.is_empty())).then_some(hands)
}

/// The weight of a body, N, where its mass is known.
fn weight(measured: &CleanLog, body: usize) -> Option<f64> {
    let gravity = Vector3::from(measured.scene.gravity.map(|part| part.0));
    measured.scene.bodies.get_index(body)?.1.mass.map(|mass| mass.0 * gravity.norm())
}

/// Number of frames before and after over which forces are averaged.
pub fn balanced(rate_hz: f64) -> usize {
    (HALF_WINDOW_SECS * rate_hz).round() as usize
}

/// Returns the required sum of contact forces at each frame, reference frame, N.
fn unborne(measured: &CleanLog, motions: &[Motion], hands: &[HoldingHand], body: usize) -> Option<Vec<Vector3<f64>>> {
    let (name, it) = measured.scene.bodies.get_index(body)?;
    let (mass, motion) = (it.mass?.0, motions.get(body)?);
    let gravity = Vector3::from(measured.scene.gravity.map(|part| part.0));
    let acceleration = motion.acceleration(measured, name);
    let one = |frame: usize| {
        let fingers: Vector3<f64> = hands
            .iter()
            .filter(|(track, _)| holds(track, body, frame))
            .flat_map(|(_, sensors)| sensors.iter().map(|sensor| vector(&sensor.force, frame)))
            .sum();
        (vector(&acceleration, frame) - gravity) * mass - fingers
    };
    let each: Vec<Vector3<f64>> = (0..measured.len()).map(one).collect();
    let axis = |axis: usize| {
        moving_average(
            measured,
            &each.iter().map(|force| force[axis]).collect::<Vec<f64>>(),
            balanced(measured.rate_hz),
        )
    };
    let means = [axis(0), axis(1), axis(2)];
    Some((0..measured.len()).map(|frame| vector(&means, frame)).collect())
}

fn sensors<'a>(measured: &'a CleanLog, track: &HandTrack) -> Vec<Sensor<'a>> {
    let sensor = |finger: &Finger| {
        let channel = format!("{}.{finger}.force", track.side);
        let variance = measured.noise.get(&channel).map_or(0.0, |noise| noise.variance);
        Some(Sensor { force: measured.vec3(&channel)?, variance })
    };
    Finger::ALL.iter().filter_map(sensor).collect()
}
