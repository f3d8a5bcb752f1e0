//! The text of a proposed scene: the bodies of a log, with sizes and a table that fit its values.

use super::Survey;
use super::bearings::FoundBearing;
use super::bodies::{Body, edge};
use super::sockets::FoundSocket;
use super::words::is_support;
use super::yaml_scalar::scalar;
use std::fmt::Write as _;

/// Writes the scene.
pub fn scene(survey: &Survey) -> String {
    let mut text =
        String::from("# Guessed by `teachtree init`: objects and their supports (docs/scenes.md).\nbodies:\n");
    let is_measured = survey.contacts.are_of_bodies();
    let has_gripper = !survey.grippers.is_empty() || survey.contacts.are_of_fingers();
    let held_m = survey.grippers.values().find_map(|gripper| gripper.held_m).or(survey.contacts.held_m);
    let (edge_m, why) = edge(held_m);
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
            (None, []) => of_body(survey, body, edge_m, why, has_gripper && !is_measured),
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
        let size = boxed(edge_m);
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
    let names_support = survey.bodies.iter().any(|body| is_support(&body.name));
    if !is_measured && !names_support && !survey.bodies.is_empty() {
        text.push_str(&table(survey, edge_m, has_gripper));
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

/// The bodies of sockets that the log does not name.
fn unnamed(survey: &Survey) -> String {
    let of_none: Vec<&FoundSocket> = survey.sockets.iter().filter(|socket| socket.of.is_none()).collect();
    let is_taken = |name: &str| survey.bodies.iter().any(|body| body.name == name);
    let mut text = String::new();
    for (number, socket) in of_none.iter().enumerate() {
        let mut name = if of_none.len() > 1 { format!("socket{}", number + 1) } else { "socket".into() };
        while is_taken(&name) {
            name.push('_');
        }
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

/// Numbers with four digits.
fn numbers(vector: [f64; 3]) -> String {
    vector.map(|part| (plain(part * 1e4) / 1e4).to_string()).join(", ")
}

/// Why there is a socket, and what to correct.
fn reason(socket: &FoundSocket) -> String {
    let object = &socket.object;
    if socket.is_by_name {
        return format!("by its name, and {object} comes to rest there: give the true rim");
    }
    format!("{object} moves straight on from a contact there; radius and depth are at least those of its path")
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

/// A point in mm.
fn point_mm(point: [f64; 3]) -> String {
    let parts = point.map(|part| format!("{} mm", plain(part * 1e3)));
    format!("[{}]", parts.join(", "))
}

/// A whole number; zero has no sign.
fn plain(value: f64) -> f64 {
    value.round() + 0.0
}

fn of_body(survey: &Survey, body: &Body, edge_m: f64, why: &str, has_shape: bool) -> String {
    if is_support(&body.name) && !body.moves() {
        return format!("{{role: support, parts: [{}]}}    # it never moves; its size is not in the log", boxed(0.3));
    }
    let still = if body.moves() { "" } else { "; it never moves: `role: support`, `wall` or `socket`, if it is one" };
    if has_shape {
        return format!("{{role: object, parts: [{}]}}    # {why}{still}", boxed(edge_m));
    }
    let (radius_m, why) = radius(survey, body);
    format!("{{role: object, radius: {:.0} mm}}    # {why}{still}", radius_m * 1e3)
}

/// The radius of a body, m, and why: how far fingertips that touch it are from its origin, else half of the largest distance of its markers and a tenth more.
fn radius(survey: &Survey, body: &Body) -> (f64, &'static str) {
    let in_cm = |length: f64| (length * 100.0).ceil() / 100.0;
    if let Some(touched_at_m) = survey.contacts.touched_at_m.get(&body.name) {
        return (in_cm(touched_at_m.max(0.01)), "fingertips that touch it are so far from its origin");
    }
    let starts: Vec<[f64; 3]> =
        body.positions.iter().filter_map(|part| (0..part.rows()).find_map(|row| part.position(row))).collect();
    let distances = starts.iter().flat_map(|one| starts.iter().map(|other| super::parts::distance(*one, *other)));
    let largest = distances.fold(0.0, f64::max);
    (if largest > 0.0 { in_cm(largest * 0.55) } else { 0.05 }, "its size is not in the log")
}

fn boxed(edge_m: f64) -> String {
    let edge = edge_m * 1e3;
    format!("{{box: [{edge} mm, {edge} mm, {edge} mm]}}")
}

/// A table below where the objects begin.
fn table(survey: &Survey, edge_m: f64, has_shape: bool) -> String {
    let moving = survey.bodies.iter().filter(|body| body.moves());
    let start = |body: &Body| survey.starts.get(&body.name).copied().or_else(|| Some(survey.upright(body.start()?)));
    let starts: Vec<[f64; 3]> = moving.filter_map(start).collect();
    if !has_shape || starts.is_empty() {
        return "  table: {role: support}\n".into();
    }
    let mm = |value: f64| plain(value * 1e3);
    let count = starts.len() as f64;
    let middle = |axis: usize| starts.iter().filter_map(|start| start.get(axis)).sum::<f64>() / count;
    let lowest = starts.iter().map(|start| start[2]).fold(f64::INFINITY, f64::min);
    let top = mm(lowest - edge_m / 2.0);
    format!(
        "  table: {{role: support, position: [{} mm, {} mm, {} mm], parts: [{{box: [2 m, 2 m, 20 mm]}}]}}    # its top at {top} mm, below the lowest object at the beginning\n",
        mm(middle(0)),
        mm(middle(1)),
        top - 10.0
    )
}
