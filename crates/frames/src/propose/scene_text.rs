//! The text of a proposed scene: the bodies of a log, with sizes and a table that fit its values.

use super::Survey;
use super::bearings::FoundBearing;
use super::bodies::{Body, edge};
use super::body_shapes;
use super::hold_points::Kind;
use super::rounded_yaml::{boxed, edges, numbers, plain, point_mm};
use super::sockets::{Evidence, FoundSocket};
use super::supports::{Supports, THICK_M};
use super::words::is_support;
use super::yaml_scalar::scalar;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Writes the scene.
pub fn scene(survey: &Survey) -> String {
    let mut text =
        String::from("# Guessed by `teachtree init`: objects and their supports (docs/scenes.md).\nbodies:\n");
    let is_measured = survey.contacts.are_of_bodies();
    let has_gripper = !survey.grippers.is_empty() || survey.contacts.are_of_fingers();
    let shows_shapes = !is_measured && !has_gripper && shows_shapes(survey);
    let has_shape = shows_shapes || !is_measured && has_gripper;
    let held_m = survey.grippers.values().find_map(|gripper| gripper.held_m).or(survey.contacts.held_m);
    let (edge_m, why) = edge(held_m);
    let heights: BTreeMap<String, [f64; 2]> = match shows_shapes {
        true => survey
            .bodies
            .iter()
            .filter_map(|body| Some((body.name.clone(), body_shapes::heights_m(survey, body)?)))
            .collect(),
        false => BTreeMap::new(),
    };
    let below = heights.iter().map(|(body, [low, _])| (body.clone(), -low)).collect();
    let supports = Supports::new(survey, edge_m, &below);
    let shape = Shape { edge_m, why, supports: &supports, shows_shapes, heights_m: &heights };
    for body in &survey.bodies {
        let is_own = |of: &Option<String>| of.as_ref() == Some(&body.name);
        let own: Vec<&FoundSocket> = survey.sockets.iter().filter(|socket| is_own(&socket.of)).collect();
        if let Some(turning) = survey.bearings.iter().find(|bearing| is_own(&bearing.of)) {
            let _ = writeln!(text, "  {}: {}", scalar(&body.name), of_bearing(turning));
            continue;
        }
        let line = match (survey.fixed.get(&body.name), &own[..]) {
            (Some(side), _) => {
                let radius_mm = radius(survey, body).0 * 1e3;
                format!(
                    "{{role: object, radius: {radius_mm:.0} mm, fixed_to: {side}}}    # it keeps its distance from the hand"
                )
            }
            (None, []) => of_body(survey, body, &shape, has_shape),
            (None, [first, ..]) => format!("{{role: socket, sockets: {{{}}}}}    # {}", holes(&own), reason(first)),
        };
        let _ = writeln!(text, "  {}: {line}", scalar(&body.name));
    }
    text.push_str(&unnamed(survey));
    if survey.is_fixed_tool() {
        for side in survey.hands.keys().take(1) {
            let _ = writeln!(
                text,
                "  tool: {{role: object, radius: 50 mm, fixed_to: {side}}}    # its size is not in the log"
            );
        }
    } else if survey.bodies.is_empty() && survey.grippers.len() == 1 {
        let size = boxed([edge_m; 3]);
        let _ = writeln!(
            text,
            "  object: {{role: object, parts: [{size}]}}    # the log has no pose of it: it moves with the gripper that holds it"
        );
    } else if survey.bodies.is_empty() {
        return "# Guessed by `teachtree init`: nothing in the log shows where an object is (docs/scenes.md).\nbodies: {}\n".into();
    }
    for support in &survey.contacts.supports {
        let _ = writeln!(text, "  {}: {{role: support}}    # it carries the objects that touch it", scalar(support));
    }
    if !is_measured && !survey.bodies.is_empty() {
        text.push_str(&tables(survey, &supports, has_shape));
    }
    for bearing in survey.bearings.iter().filter(|bearing| bearing.of.is_none()).take(1) {
        let _ = write!(
            text,
            "  frame:    # what {0} turns in\n    role: socket\n    position: {1}\n    sockets: {{bearing: {{rim: [0 m, 0 m, 0 m], axis: [{2}], radius: 10 mm, depth: 40 mm, pitch: 0 mm}}}}\n",
            bearing.object,
            point_mm(bearing.rim),
            numbers(bearing.axis)
        );
    }
    if survey.mechanism.is_some() {
        text.push_str("  frame:    # what the mechanism turns in\n    role: socket\n    sockets: {bearing: {rim: [0 m, 0 m, 0 m], axis: [0, 1, 0], radius: 10 mm, depth: 20 mm, pitch: 0 mm}}\n");
    }
    text
}

/// Whether hands without grippers show the shapes of bodies: fingertips that hold them, or a tool that pushes a box. A body that is fixed to a hand or turns in its
/// place shows none.
fn shows_shapes(survey: &Survey) -> bool {
    let has_fingers = survey.hands.values().any(|hand| hand.tips.len() > 1);
    let has_shown = !survey.held_shapes.is_empty() || !survey.pushed_shapes.is_empty();
    let is_shown = if has_fingers { has_shown } else { survey.has_point() };
    is_shown && survey.fixed.is_empty() && survey.bearings.is_empty() && survey.mechanism.is_none()
}

/// The bodies of sockets that the log does not name.
fn unnamed(survey: &Survey) -> String {
    let of_none: Vec<&FoundSocket> = survey.sockets.iter().filter(|socket| socket.of.is_none()).collect();
    let mut text = String::new();
    for (number, socket) in of_none.iter().enumerate() {
        let name = if of_none.len() > 1 { format!("socket{}", number + 1) } else { "socket".into() };
        let name = survey.free_name(&name);
        let _ = write!(
            text,
            "  {name}:    # {}\n    role: socket\n    position: {}\n    sockets: {{{}}}\n",
            reason(socket),
            point_mm(socket.rim),
            holes(&[&FoundSocket { rim: [0.0; 3], ..(*socket).clone() }]),
        );
    }
    text
}

/// A body in which another one turns.
fn of_bearing(bearing: &FoundBearing) -> String {
    let axis = numbers(bearing.axis);
    let rim = point_mm(bearing.rim);
    format!(
        "{{role: socket, sockets: {{bearing: {{rim: {rim}, axis: [{axis}], radius: 10 mm, depth: 40 mm, pitch: 0 mm}}}}}}    # {} turns in its place there",
        bearing.object
    )
}

/// Why there is a socket, and what to correct.
fn reason(socket: &FoundSocket) -> String {
    let object = &socket.object;
    let rim = format!(
        "the rim is where the origin of {object} enters: with the edge of the hole instead, set `plug` of {object} to its lower end; the radius is how far that point may be beside the axis"
    );
    match socket.evidence {
        Evidence::Contact => format!(
            "{object} moves straight on from a contact there; {rim}; radius and depth are at least those of its path"
        ),
        Evidence::Name => format!("by its name, and {object} begins or comes to rest there; {rim}"),
        Evidence::Inside | Evidence::Above => {
            format!("{object} begins or comes to rest on its axis, below its origin; {rim}; else `role: support`")
        }
    }
}

/// Sockets of one body as entries.
fn holes(sockets: &[&FoundSocket]) -> String {
    let entry = |(number, socket): (usize, &&FoundSocket)| {
        let name = if sockets.len() > 1 { format!("hole{}", number + 1) } else { "hole".into() };
        let (rim, axis) = (point_mm(socket.rim), numbers(socket.axis));
        let [radius, depth] = [socket.radius_m, socket.depth_m].map(|length| plain(length * 1e3));
        format!("{name}: {{rim: {rim}, axis: [{axis}], radius: {radius} mm, depth: {depth} mm}}")
    };
    sockets.iter().enumerate().map(entry).collect::<Vec<_>>().join(", ")
}

/// What is known of the shapes of bodies.
struct Shape<'a> {
    edge_m: f64,
    why: &'a str,
    supports: &'a Supports,
    /// Whether hands without grippers show the shapes of bodies.
    shows_shapes: bool,
    /// The lowest and the highest point of their bodies above their origins, m, where fingertips or markers show them.
    heights_m: &'a BTreeMap<String, [f64; 2]>,
}

fn of_body(survey: &Survey, body: &Body, shape: &Shape, has_shape: bool) -> String {
    if let Some(surface) = shape.supports.of_bodies.get(&body.name).filter(|_| has_shape || is_support(&body.name)) {
        let [width, top] = [surface.width_m, surface.top[2].abs()].map(|length| plain(length * 1e3));
        let side = if surface.top[2] < 0.0 { "below" } else { "above" };
        let at = point_mm([0.0, 0.0, surface.top[2] - THICK_M / 2.0]);
        let size = edges([surface.width_m, surface.width_m, THICK_M]);
        let maybe: Vec<&FoundSocket> =
            survey.maybe_sockets.iter().filter(|socket| socket.of.as_ref() == Some(&body.name)).collect();
        let else_object = match &maybe[..] {
            _ if is_support(&body.name) => String::new(),
            [] => "; else `role: object`".into(),
            [first, ..] => {
                format!(
                    "; else `role: object`, or if {} is in a hole there: `{{role: socket, sockets: {{{}}}}}`",
                    first.object,
                    holes(&maybe)
                )
            }
        };
        return format!(
            "{{role: support, parts: [{{box: {size}, at: {at}}}]}}    # it never moves, and {0} rests on it: its top is {top} mm {side} its origin if the lowest point of {0} is {1} mm below the origin of {0}; the width of {width} mm is a guess{else_object}",
            surface.carries,
            plain(surface.below_m * 1e3)
        );
    }
    if is_support(&body.name) && !body.moves() {
        let size = boxed([0.3, 0.3, THICK_M]);
        return format!("{{role: support, parts: [{size}]}}    # it never moves; its size is not in the log");
    }
    let still = match () {
        () if body.moves() => "",
        () if survey
            .hold_points
            .values()
            .any(|hold| hold.object.as_ref() == Some(&body.name) && hold.kind == Kind::Kept) =>
        {
            "; a hand keeps it in place"
        }
        () => "; it never moves: `role: support`, `wall` or `socket`, if it is one",
    };
    let still = |reach_m: f64| format!("{still}{}", untouched(survey, body, reach_m));
    let below_m = shape.supports.below_m.get(&body.name);
    let higher = if below_m.is_some() { "; as high as it stands above its support" } else { "" };
    if let Some(heights_m) = heights(body, shape).filter(|_| has_shape) {
        let (part, why) = body_shapes::part(survey, body, heights_m, shape.edge_m);
        let still = still(body_shapes::reach_m(survey, body).unwrap_or(shape.edge_m));
        return format!("{{role: object, parts: [{part}]}}    # {why}{higher}{still}");
    }
    if has_shape {
        let height_m = below_m.map_or(shape.edge_m, |below_m| 2.0 * below_m);
        let (edge_m, why) = width(survey, body, shape);
        let size = boxed([edge_m, edge_m, height_m]);
        let still = still(edge_m.max(height_m));
        return format!("{{role: object, parts: [{size}]}}    # {why}{higher}{still}");
    }
    let (radius_m, why) = radius(survey, body);
    format!("{{role: object, radius: {:.0} mm}}    # {why}{}", radius_m * 1e3, still(radius_m))
}

/// The remark that no hand reaches a body that moves and is never lifted, of which no hand shows the shape and that extends this far from its origin, m; empty
/// otherwise.
fn untouched(survey: &Survey, body: &Body, reach_m: f64) -> String {
    /// `push_near` of the rules.
    const NEAR_M: f64 = 0.02;
    let is_shown = survey.held_shapes.contains_key(&body.name) || survey.pushed_shapes.contains_key(&body.name);
    let is_far = survey.reached_m.get(&body.name).is_some_and(|reached_m| *reached_m > reach_m + NEAR_M);
    match is_far && body.moves() && !is_shown {
        true => format!("; nothing touches {} with this size while it moves: write its size", body.name),
        false => String::new(),
    }
}

/// The lowest and the highest point of a body of hands without grippers above its origin, m: what never moves stands on the table.
fn heights(body: &Body, shape: &Shape) -> Option<[f64; 2]> {
    let shown = shape.heights_m.get(&body.name);
    let on_table = shape.supports.standing_m.get(&body.name).filter(|_| shape.shows_shapes && !body.moves());
    let below_m = on_table.or_else(|| shape.supports.below_m.get(&body.name));
    match (shown, below_m) {
        (Some([low, high]), _) => Some([below_m.map_or(*low, |below_m| -below_m), *high]),
        (None, Some(below_m)) if on_table.is_some() => Some([-below_m, below_m.min(shape.edge_m / 2.0)]),
        (None, _) => None,
    }
}

/// The horizontal edge of a body, m, and why: that of the shape, unless the gripper holds the body farther from its origin, such as a bowl by its rim.
fn width<'a>(survey: &Survey, body: &Body, shape: &Shape<'a>) -> (f64, &'a str) {
    /// A tool point that is farther away is the flange.
    const FARTHEST_M: f64 = 0.08;
    const CENTERED_M: f64 = 0.015;
    let far = |beside_m: &f64| (shape.edge_m / 2.0 + CENTERED_M..FARTHEST_M).contains(beside_m);
    match survey.held_beside_m.get(&body.name).copied().filter(far) {
        Some(beside_m) => (2.0 * beside_m, "twice the distance from its origin at which the gripper holds it"),
        None if body.moves() => (shape.edge_m, shape.why),
        None => (shape.edge_m, "its size is not in the log"),
    }
}

/// The radius of a body, m, and why: how far fingertips that touch it are from its origin, else half of the largest distance of its markers and a tenth more.
fn radius(survey: &Survey, body: &Body) -> (f64, &'static str) {
    let in_cm = |length: f64| (length * 100.0).ceil() / 100.0;
    if let Some(touched_at_m) = survey.contacts.touched_at_m.get(&body.name) {
        return (in_cm(touched_at_m.max(0.01)), "distance of touching fingertips from its origin");
    }
    let starts: Vec<[f64; 3]> =
        body.positions.iter().filter_map(|part| (0..part.rows()).find_map(|row| part.position(row))).collect();
    let distances = starts.iter().flat_map(|one| starts.iter().map(|other| super::parts::distance(*one, *other)));
    let largest = distances.fold(0.0, f64::max);
    (if largest > 0.0 { in_cm(largest * 0.55) } else { 0.05 }, "its size is not in the log")
}

/// A table below what rests lowest, and what else things rest on that the log lacks.
fn tables(survey: &Survey, supports: &Supports, has_shape: bool) -> String {
    let is_named = survey.bodies.iter().any(|body| is_support(&body.name));
    if !has_shape || supports.table.is_none() && supports.others.is_empty() {
        return if is_named { String::new() } else { "  table: {role: support}\n".into() };
    }
    let mut text = String::new();
    let mut named = |name: &str, position: [f64; 3], size: [f64; 3], why: &str| {
        let _ = writeln!(
            text,
            "  {}: {{role: support, position: {}, parts: [{}]}}    # {why}",
            survey.free_name(name),
            point_mm(position),
            boxed(size)
        );
    };
    if let Some(table) = &supports.table {
        let starts: Vec<[f64; 3]> =
            survey.bodies.iter().filter(|body| body.moves()).filter_map(|body| survey.at(&body.name)).collect();
        let middle = |axis: usize| starts.iter().map(|start| start[axis]).sum::<f64>() / starts.len().max(1) as f64;
        let top = plain(table.top[2] * 1e3);
        let position = [middle(0), middle(1), top * 1e-3 - THICK_M / 2.0];
        let why = format!("its top at {top} mm, below the lowest place where an object rests");
        named("table", position, [table.width_m, table.width_m, THICK_M], &why);
    }
    for (number, surface) in supports.others.iter().enumerate() {
        let [x, y, z] = surface.top;
        let name = if number == 0 { "support".to_string() } else { format!("support{}", number + 1) };
        let above = supports
            .table
            .as_ref()
            .map_or(String::new(), |table| format!(", {} mm above the table", plain((z - table.top[2]) * 1e3)));
        let why = format!("{} rests here{above}: something that the log lacks carries it", surface.carries);
        named(&name, [x, y, z - THICK_M / 2.0], [surface.width_m, surface.width_m, THICK_M], &why);
    }
    text
}
