//! The shapes of objects of hands without grippers: by the fingertips that carry them, else by their markers.

use super::Survey;
use super::bodies::Body;
use super::rounded_yaml::{boxed, numbers, point_mm};
use nalgebra::{UnitQuaternion, Vector3};

/// A fingertip holds this much of an object below and above itself, m.
const AROUND_M: f64 = 0.01;
/// The least edge of a body by its markers, m.
const THIN_M: f64 = 0.02;
/// A cylinder that is turned by less stands upright in the frame of its body, rad.
const TURNED: f64 = 0.1;

/// How far a body extends along each axis of the log from its origin by its markers at the beginning, m; `None` of a single marker.
fn extents(survey: &Survey, body: &Body) -> Option<[[f64; 2]; 3]> {
    let points: Vec<Vector3<f64>> = body
        .positions
        .iter()
        .filter_map(|part| (0..part.rows()).find_map(|row| part.position(row)))
        .map(|at| Vector3::from(survey.upright(at)))
        .collect();
    // A log with y up has the first marker as the origin.
    let origin = match survey.is_y_up() {
        true => points.first().copied()?,
        false => points.iter().sum::<Vector3<f64>>() / points.len() as f64,
    };
    let of_axis = |axis: usize| {
        let along = points.iter().map(|point| point[axis] - origin[axis]);
        along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)])
    };
    (points.len() > 1).then(|| [0, 1, 2].map(of_axis))
}

/// The lowest and the highest point of a body above its origin while it rests, m, where its fingertips or its markers show them.
pub fn heights_m(survey: &Survey, body: &Body) -> Option<[f64; 2]> {
    let of_markers = extents(survey, body).map(|[.., heights]| heights);
    let of_hold = survey.held_shapes.get(&body.name).map(|held| {
        let [low, high] = held.heights_m;
        [low - AROUND_M, high + AROUND_M]
    });
    match (of_markers, of_hold) {
        (Some([low, high]), Some([least, most])) => Some([low.min(least), high.max(most)]),
        (Some([low, high]), None) => Some([low.min(high - THIN_M), high]),
        (None, of_hold) => of_hold,
    }
}

/// A part with the shape of a body as a scene has it, and the reason: a cylinder where fingertips hold it, else a box about its markers, or with this edge, m;
/// `heights_m` as above.
pub fn part(survey: &Survey, body: &Body, [low, high]: [f64; 2], edge_m: f64) -> (String, &'static str) {
    if let Some(held) = survey.held_shapes.get(&body.name) {
        let up = Vector3::from(held.up);
        let middle = Vector3::from(held.middle);
        let at = middle + up * (f64::midpoint(low, high) - middle.dot(&up));
        let size = [held.radius_m, high - low].map(|length| format!("{} mm", (length * 1e3).round()));
        let turn = UnitQuaternion::rotation_between(&Vector3::z(), &up).filter(|turn| turn.angle() > TURNED);
        let turned =
            turn.map_or(String::new(), |turn| format!(", turned: [{}]", numbers([turn.w, turn.i, turn.j, turn.k])));
        let part = format!("{{cylinder: [{}], at: {}{turned}}}", size.join(", "), point_mm(at.into()));
        return (part, "as wide as the fingertips hold it, and as high as they and its markers show");
    }
    let half_m = edge_m / 2.0;
    let (sides, why) = match extents(survey, body) {
        Some([x, y, _]) => ([x, y], "as large as its markers are apart"),
        None => ([[-half_m, half_m]; 2], "its size is not in the log"),
    };
    let edge = |[low, high]: [f64; 2]| (high - low).max(THIN_M);
    let at = [sides[0], sides[1], [low, high]].map(|[low, high]| f64::midpoint(low, high));
    let size = boxed([edge(sides[0]), edge(sides[1]), high - low]);
    (format!("{}, at: {}}}", size.trim_end_matches('}'), point_mm(at)), why)
}
