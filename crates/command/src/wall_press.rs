//! Shifts pushed objects into the wall. An operator who pushes an object along a wall presses it only lightly and loses contact briefly (the paper, section
//! 3.2: a fluctuation). A robot that repeats this path with an error of a tenth of a millimeter may lose the wall, so it keeps the smallest distance of the
//! demonstration minus a small offset.

use super::RATE_HZ;
use super::series::{Episode, Series};
use nalgebra::{Translation3, Vector3};
use teachtree_base::easing::smooth_step;
use teachtree_base::meaning::Meaning;
use teachtree_base::recording::Recording;

/// The offset into the wall, m: a light press of fingers with the robot's stiffness.
const INTO_M: f64 = 0.0006;
/// Maximum shift from the demonstrated position, m.
const FARTHEST_M: f64 = 0.0015;
/// The time over which the shift is applied, s.
const LEANS_S: f64 = 0.1;
/// Maximum vertical component of a wall's normal; a steeper one is that of a support.
const UPWARDS: f64 = 0.5;

/// Shifts the object into the wall along which it is pushed.
pub(super) fn press_against_wall(series: &mut Series, recording: &Recording, object: &str, episodes: &[Episode]) {
    let others: Vec<Vec<Vector3<f64>>> = recording
        .scene
        .bodies
        .keys()
        .filter(|body| *body != object)
        .filter_map(|body| series.normals(recording, object, body))
        .collect();
    let traces = episodes.iter().flat_map(|episode| &episode.pieces).filter(|piece| piece.does == Meaning::Trace);
    for piece in traces {
        let walls = others.iter().map(|normals| {
            let upright = |normal: &&Vector3<f64>| **normal != Vector3::zeros() && normal.z.abs() < UPWARDS;
            let touched: Vec<Vector3<f64>> =
                piece.samples.iter().filter_map(|&at| normals.get(at)).filter(upright).copied().collect();
            (touched.len(), touched.iter().sum::<Vector3<f64>>())
        });
        let Some((1.., sum)) = walls.max_by_key(|(touched, _)| *touched) else { continue };
        let Some(normal) = sum.try_normalize(1e-6) else { continue };
        let beside = |series: &Series, at: usize| series.wanted[at].translation.vector.dot(&normal);
        let wall = piece.samples.iter().map(|&at| beside(series, at)).fold(f64::INFINITY, f64::min) - INTO_M;
        for (number, &at) in piece.samples.iter().enumerate() {
            let share = smooth_step(number as f64 / (LEANS_S * RATE_HZ));
            let way = normal * ((wall - beside(series, at)).max(-FARTHEST_M) * share);
            series.wanted[at] = Translation3::from(way) * series.wanted[at];
        }
    }
}
