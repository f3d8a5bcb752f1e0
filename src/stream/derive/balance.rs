//! The balance of forces on an object: what its contacts must bear, since its mass, its motion and the fingers on it are known.
//!
//! `m (a - g) = F_fingers + F_contacts`. The fingers' forces are those of the hands that touch it; what a finger reads while it is far from every
//! object is its bias and its noise. Everything is averaged over [`HALF_WINDOW_SECS`] before and after.

use super::hands::HandTrack;
use super::motion::{Motion, slopes, vector};
use crate::base::hands::Finger;
use crate::stream::geometry::surface_distance;
use crate::stream::measured::Measured;
use nalgebra::{Point3, Vector3};

/// Half the window of the average, s.
const HALF_WINDOW_SECS: f64 = 0.025;
/// A fingertip this far from every object feels nothing, m.
const FAR: f64 = 0.030;
/// How many of the samples are looked at to learn what a finger reads at rest.
const LOOKED_AT: usize = 2000;
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
        measured: &Measured,
        motions: &[Motion],
        tracks: &[HandTrack],
        body: usize,
        clear: impl Fn(usize) -> bool,
    ) -> Option<Self> {
        let (_, it) = measured.scene.bodies.get_index(body)?;
        let (mass, motion) = (it.mass?.0, motions.get(body)?);
        let gravity = Vector3::from(measured.scene.gravity.map(|part| part.0));
        let holds = |track: &HandTrack, frame: usize| {
            track.touching.get(frame) == Some(&true) && track.target.get(frame) == Some(&Some(body))
        };
        let hands: Vec<(&HandTrack, Vec<Sensor>)> = tracks
            .iter()
            .filter(|track| (0..measured.len()).any(|frame| holds(track, frame)))
            .map(|track| (track, sensors(measured, motions, track)))
            .collect();
        if hands.iter().any(|(_, sensors)| sensors.is_empty()) {
            return None;
        }
        let velocity: [Vec<f64>; 3] = super::motion::columns(measured, |frame| motion.velocity(frame));
        let acceleration = slopes(measured, velocity.each_ref().map(Vec::as_slice));
        let one = |frame: usize| {
            let fingers: Vector3<f64> = hands
                .iter()
                .filter(|(track, _)| holds(track, frame))
                .flat_map(|(_, sensors)| sensors.iter().map(|sensor| vector(&sensor.force, frame) - sensor.bias))
                .sum();
            (vector(&acceleration, frame) - gravity) * mass - fingers
        };
        let reach = (HALF_WINDOW_SECS * measured.rate_hz).round() as usize;
        let force = averaged(measured, reach, one);
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

/// The force sensor of a finger, with what it reads at rest.
struct Sensor<'a> {
    force: [&'a [f64]; 3],
    bias: Vector3<f64>,
    /// Of the vector's components together, N².
    variance: f64,
}

fn sensors<'a>(measured: &'a Measured, motions: &[Motion], track: &HandTrack) -> Vec<Sensor<'a>> {
    let objects = super::objects(measured.scene);
    let far = |tip: &[&[f64]; 3], frame: usize| {
        let tip: Point3<f64> = vector(tip, frame).into();
        objects.iter().all(|object| {
            let body = measured.scene.bodies.get_index(*object).zip(motions.get(*object));
            body.is_none_or(|((_, body), motion)| {
                surface_distance(body, &motion.pose(frame).inverse_transform_point(&tip)) > FAR
            })
        })
    };
    let stride = measured.len().div_ceil(LOOKED_AT).max(1);
    let sensor = |finger: &Finger| {
        let force = measured.vec3(&format!("{}.{finger}.force", track.side))?;
        let tip = measured.vec3(&format!("{}.{finger}.position", track.side));
        let rest: Vec<Vector3<f64>> = tip.map_or(vec![], |tip| {
            (0..measured.len())
                .step_by(stride)
                .filter(|frame| far(&tip, *frame))
                .map(|frame| vector(&force, frame))
                .collect()
        });
        let n = rest.len().max(1) as f64;
        let bias = rest.iter().sum::<Vector3<f64>>() / n;
        let variance = rest.iter().map(|force| (force - bias).norm_squared()).sum::<f64>() / n;
        Some(Sensor { force, bias, variance })
    };
    Finger::ALL.iter().filter_map(sensor).collect()
}

/// The mean over `reach` frames before and after each frame, within its stretch.
fn averaged(measured: &Measured, reach: usize, value: impl Fn(usize) -> Vector3<f64>) -> Vec<Vector3<f64>> {
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
