//! The balance of forces on an object: what its contacts must bear, since its mass, its motion and the fingers on it are known.
//!
//! `m (a - g) = F_fingers + F_contacts`. The fingers' forces are those of the hands that touch it. Everything is averaged over [`HALF_WINDOW_SECS`] before and after.

use super::hands::HandTrack;
use super::motion::{Motion, vector};
use crate::base::hands::Finger;
use crate::stream::clean::preprocess::CleanLog;
use nalgebra::Vector3;

/// Half the window of the average, s.
const HALF_WINDOW_SECS: f64 = 0.025;
/// The balance is believed when its error is less than this share of the weight.
const BELIEVED: f64 = 0.25;
/// How many standard deviations of its noise a force must have to be one.
const ABOVE_NOISE: f64 = 4.0;

/// What the contacts of an object bear together, over the whole log.
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
        let (name, it) = measured.scene.bodies.get_index(body)?;
        let (mass, motion) = (it.mass?.0, motions.get(body)?);
        let gravity = Vector3::from(measured.scene.gravity.map(|part| part.0));
        let holds = |track: &HandTrack, frame: usize| {
            track.touching.get(frame) == Some(&true) && track.target.get(frame) == Some(&Some(body))
        };
        let hands: Vec<(&HandTrack, Vec<Sensor>)> = tracks
            .iter()
            .filter(|track| (0..measured.len()).any(|frame| holds(track, frame)))
            .map(|track| (track, sensors(measured, track)))
            .collect();
        if hands.iter().any(|(_, sensors)| sensors.is_empty()) {
            return None;
        }
        let acceleration = motion.acceleration(measured, name);
        let one = |frame: usize| {
            let fingers: Vector3<f64> = hands
                .iter()
                .filter(|(track, _)| holds(track, frame))
                .flat_map(|(_, sensors)| sensors.iter().map(|sensor| vector(&sensor.force, frame)))
                .sum();
            (vector(&acceleration, frame) - gravity) * mass - fingers
        };
        let reach = (HALF_WINDOW_SECS * measured.rate_hz).round() as usize;
        let force = moving_average(measured, reach, one);
        let variance: f64 =
            hands.iter().map(|(_, sensors)| sensors.iter().map(|it| it.variance).sum::<f64>()).fold(0.0, f64::max);
        let noise = ABOVE_NOISE * (variance / (2 * reach + 1) as f64).sqrt();
        let weight = mass * gravity.norm();
        let in_air: Vec<f64> = (0..measured.len())
            .filter(|frame| clear(*frame) && hands.iter().any(|(track, _)| holds(track, *frame)))
            .filter_map(|frame| force.get(frame).map(Vector3::norm))
            .collect();
        let error = if in_air.is_empty() { 0.0 } else { in_air.iter().sum::<f64>() / in_air.len() as f64 };
        (noise.max(error) <= BELIEVED * weight).then_some(Self { force, noise: noise.max(2.0 * error) })
    }

    /// Force of all contacts on the object, reference frame, N.
    pub fn force(&self, frame: usize) -> Vector3<f64> {
        self.force.get(frame).copied().unwrap_or_default()
    }
}

/// The force sensor of a finger.
struct Sensor<'a> {
    force: [&'a [f64]; 3],
    /// Of its noise, the vector's components together, N²; 0 where it is not known.
    variance: f64,
}

fn sensors<'a>(measured: &'a CleanLog, track: &HandTrack) -> Vec<Sensor<'a>> {
    let sensor = |finger: &Finger| {
        let channel = format!("{}.{finger}.force", track.side);
        let variance = measured.noise.get(&channel).map_or(0.0, |noise| noise.variance);
        Some(Sensor { force: measured.vec3(&channel)?, variance })
    };
    Finger::ALL.iter().filter_map(sensor).collect()
}

/// The mean over `reach` frames before and after each frame, within its stretch.
fn moving_average(measured: &CleanLog, reach: usize, value: impl Fn(usize) -> Vector3<f64>) -> Vec<Vector3<f64>> {
    let mut means = Vec::with_capacity(measured.len());
    for stretch in &measured.stretches {
        let values: Vec<Vector3<f64>> = stretch.clone().map(&value).collect();
        let mut sums = vec![Vector3::zeros()];
        for value in &values {
            sums.push(sums.last().copied().unwrap_or_default() + value);
        }
        let sum = |end: usize| sums.get(end).copied().unwrap_or_default();
        means.extend((0..values.len()).map(|at| {
            let (from, to) = (at.saturating_sub(reach), (at + reach + 1).min(values.len()));
            (sum(to) - sum(from)) / (to - from) as f64
        }));
    }
    means
}
