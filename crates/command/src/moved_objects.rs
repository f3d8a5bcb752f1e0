//! Finds objects that a hand moves besides the object of its task. The robot does not move them, and the commands list them.

use super::Omission;
use super::series::Series;
use nalgebra::Isometry3;
use teachtree_analysis::TaskSpan;
use teachtree_base::scene::Body;

/// Minimum displacement (m) and rotation (rad) of a moved object since the first touch of the hand. They equal the tolerance of a completed task.
const MOVED: (f64, f64) = (0.005, 0.052);
/// Time after the last touch at which its pose is compared, s; the end of the task if that is earlier.
const RESTS_S: f64 = 0.2;

/// Returns omissions for the other objects that only this hand moved in a task and that did not move with the object of the task. `by_another` returns whether
/// another hand touches an object between two times, s of the recording.
pub(super) fn moved_objects(
    span: &TaskSpan,
    own: &Series,
    touched: &[(&String, &Body, Series)],
    by_another: impl Fn(&str, &Body, [f64; 2]) -> bool,
) -> Vec<Omission> {
    let moved = touched.iter().filter_map(|(name, body, series)| {
        let (first, last) = series.touched(body)?;
        let [start_s, end_s] = [first, last].map(|at| series.time_s(at));
        let [from, to] = [start_s, end_s + RESTS_S].map(|time_s| series.sample(time_s));
        let beside = |at: usize| own.object[at].inv_mul(&series.object[at]);
        let stays = is_same(&series.object[from], &series.object[to]) || is_same(&beside(from), &beside(to));
        if stays || by_another(name, body, [start_s, end_s]) {
            return None;
        }
        let meanwhile = span.segments.iter().filter(|segment| segment.start_s <= end_s && segment.end_s > start_s);
        let primitives = meanwhile.map(|segment| segment.primitive.clone()).collect();
        Some(Omission { primitives, start_s, end_s, why: format!("moves `{name}`") })
    });
    moved.collect()
}

/// Whether a pose is nearly another one.
fn is_same(one: &Isometry3<f64>, other: &Isometry3<f64>) -> bool {
    let moved = one.inv_mul(other);
    moved.translation.vector.norm() < MOVED.0 && moved.rotation.angle() < MOVED.1
}
