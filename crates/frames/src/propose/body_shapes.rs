//! The shapes of objects of hands without grippers: by the fingertips that carry or push them, else by their markers.

use super::Survey;
use super::bodies::Body;
use super::pushed_shapes::PushedShape;
use super::rounded_yaml::{boxed, numbers, point_mm};
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_2;

/// A fingertip holds this much of an object below and above itself, m.
const AROUND_M: f64 = 0.01;
/// The least edge of a body by its markers, m.
const THIN_M: f64 = 0.02;
/// A cylinder that is turned by less stands upright in the frame of its body, rad.
const TURNED: f64 = 0.1;
/// A face that is turned by less about the vertical is that of a box along the axes of the log, rad.
const ASKEW: f64 = 0.25;
/// The point of a fingertip that is tracked is this far from the face that it pushes, m: half of `touch_near` of the rules.
const SKIN_M: f64 = 0.006;

/// How far a body extends from its origin by its markers at the beginning, along each axis of the log turned by `turn`, m; `None` of a single marker.
fn extents(survey: &Survey, body: &Body, turn: &UnitQuaternion<f64>) -> Option<[[f64; 2]; 3]> {
    let points: Vec<Vector3<f64>> = body
        .positions
        .iter()
        .filter_map(|part| (0..part.rows()).find_map(|row| part.position(row)))
        .map(|at| turn.inverse() * Vector3::from(survey.upright(at)))
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

/// How far a body extends from its origin by its markers, m; `None` of a single marker.
pub fn reach_m(survey: &Survey, body: &Body) -> Option<f64> {
    let sides = extents(survey, body, &UnitQuaternion::identity())?;
    Some(sides.iter().map(|[low, high]| low.abs().max(high.abs()).powi(2)).sum::<f64>().sqrt())
}

/// The lowest and the highest point of a body above its origin while it rests, m, where its fingertips or its markers show them.
pub fn heights_m(survey: &Survey, body: &Body) -> Option<[f64; 2]> {
    let of_markers = extents(survey, body, &UnitQuaternion::identity()).map(|[.., heights]| heights);
    let of_hold = survey.held_shapes.get(&body.name).map(|held| held.heights_m);
    let of_push = || {
        let heights = survey.pushed_shapes.get(&body.name)?.faces.iter().map(|face| [face.tip[2]; 2]);
        // The origin is inside.
        Some(heights.fold([0.0; 2], |[low, high]: [f64; 2], [one, other]| [low.min(one), high.max(other)]))
    };
    let of_hold = of_hold.or_else(of_push).map(|[low, high]| [low - AROUND_M, high + AROUND_M]);
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
        let why = match extents(survey, body, &UnitQuaternion::identity()) {
            Some(_) => "as wide as the fingertips hold it, and as high as they and its markers show",
            None => "as wide as the fingertips hold it; its height is a guess, since the log has no markers of it",
        };
        return (part, why);
    }
    if let Some(pushed) = survey.pushed_shapes.get(&body.name) {
        let why = match extents(survey, body, &UnitQuaternion::identity()) {
            Some(_) => "as large as the distance of what pushes it and its markers show",
            None => {
                "the log has no markers of it: only the distance of what pushes it is measured; the size is a guess from it"
            }
        };
        return (pushed_box(survey, body, pushed, [low, high]), why);
    }
    let half_m = edge_m / 2.0;
    let (sides, why) = match extents(survey, body, &UnitQuaternion::identity()) {
        Some([x, y, _]) => ([x, y], "as large as its markers are apart"),
        None => ([[-half_m, half_m]; 2], "its size is not in the log"),
    };
    let edge = |[low, high]: [f64; 2]| (high - low).max(THIN_M);
    let at = [sides[0], sides[1], [low, high]].map(|[low, high]| f64::midpoint(low, high));
    let size = boxed([edge(sides[0]), edge(sides[1]), high - low]);
    (format!("{}, at: {}}}", size.trim_end_matches('}'), point_mm(at)), why)
}

/// A box whose faces are in front of what pushes them, m; as wide as it is deep where it has no markers.
fn pushed_box(survey: &Survey, body: &Body, pushed: &PushedShape, heights_m: [f64; 2]) -> String {
    let [x, y, _] = pushed.faces.first().map_or([1.0, 0.0, 0.0], |face| face.along);
    let quarter = FRAC_PI_2 * (y.atan2(x) / FRAC_PI_2).round();
    let yaw = Some(y.atan2(x) - quarter).filter(|yaw| yaw.abs() > ASKEW).unwrap_or_default();
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw);
    let faces = pushed.faces.iter().map(|face| {
        let [along, tip] = [face.along, face.tip].map(|vector| turn.inverse() * Vector3::from(vector));
        let axis = usize::from(along.y.abs() > along.x.abs());
        (axis, along[axis].signum(), tip)
    });
    let faces: Vec<(usize, f64, Vector3<f64>)> = faces.collect();
    let deep_m = faces.iter().map(|(axis, _, tip)| tip[*axis].abs() - SKIN_M).fold(f64::INFINITY, f64::min);
    let mut sides = match extents(survey, body, &turn) {
        Some([x, y, _]) => [x, y],
        None => [[-deep_m, deep_m]; 2],
    };
    for (axis, sign, tip) in faces {
        let side = |at: usize| tip[at] + sign * SKIN_M;
        let [low, high] = sides[axis];
        sides[axis] = match sign > 0.0 {
            true => [side(axis), high.max(side(axis) + THIN_M)],
            false => [low.min(side(axis) - THIN_M), side(axis)],
        };
        let [left, right] = sides[1 - axis];
        sides[1 - axis] = [left.min(tip[1 - axis] - AROUND_M), right.max(tip[1 - axis] + AROUND_M)];
    }
    let all = [sides[0], sides[1], heights_m];
    let size = boxed(all.map(|[low, high]| (high - low).max(THIN_M)));
    let middle = Vector3::from(all.map(|[low, high]| f64::midpoint(low, high)));
    let to_body = pushed.turn.inverse() * turn;
    let turned = match to_body.angle() > TURNED {
        true => format!(", turned: [{}]", numbers([to_body.w, to_body.i, to_body.j, to_body.k])),
        false => String::new(),
    };
    format!("{}, at: {}{turned}}}", size.trim_end_matches('}'), point_mm((to_body * middle).into()))
}
