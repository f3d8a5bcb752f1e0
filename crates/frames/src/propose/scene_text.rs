//! The text of a proposed scene: the bodies of a log, with sizes and a table that fit its values.

use super::Survey;
use super::bodies::{Body, edge};
use super::yaml_scalar::scalar;
use std::fmt::Write as _;

/// Words for bodies that carry others.
const SUPPORTS: [&str; 9] = ["table", "tray", "bin", "shelf", "plate", "surface", "ground", "floor", "desk"];

/// Writes the scene.
pub fn scene(survey: &Survey) -> String {
    let mut text = String::from(
        "# Guessed by `teachtree init`: what is handled, and what carries it (docs/scenes.md).\nbodies:\n",
    );
    let is_measured = !survey.contacts.lines.is_empty();
    let has_gripper = !survey.grippers.is_empty();
    let (edge_m, why) = edge(survey.grippers.values().find_map(|gripper| gripper.held_m));
    for body in &survey.bodies {
        let _ = writeln!(text, "  {}: {}", scalar(&body.name), of_body(body, edge_m, why, has_gripper && !is_measured));
    }
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
        let _ = writeln!(text, "  {}: {{role: support}}    # what touches it is carried by it", scalar(support));
    }
    let names_support = survey.bodies.iter().any(is_support);
    if !is_measured && !names_support && !survey.bodies.is_empty() {
        text.push_str(&table(survey, edge_m, has_gripper));
    }
    if survey.mechanism.is_some() {
        text.push_str("  frame:    # what the mechanism turns in\n    role: socket\n    sockets: {bearing: {rim: [0 m, 0 m, 0 m], axis: [0, 1, 0], radius: 10 mm, depth: 20 mm, pitch: 0 mm}}\n");
    }
    text
}

fn of_body(body: &Body, edge_m: f64, why: &str, has_shape: bool) -> String {
    if is_support(body) && !body.moves() {
        return format!("{{role: support, parts: [{}]}}    # it never moves; its size is not in the log", boxed(0.3));
    }
    let still = if body.moves() { "" } else { "; it never moves: `role: support`, `wall` or `socket`, if it is one" };
    if has_shape {
        return format!("{{role: object, parts: [{}]}}    # {why}{still}", boxed(edge_m));
    }
    let radius_mm = radius_m(body) * 1e3;
    format!("{{role: object, radius: {radius_mm:.0} mm}}    # its size is not in the log{still}")
}

/// Half of the largest distance of markers, and a tenth more; else 50 mm.
fn radius_m(body: &Body) -> f64 {
    let starts: Vec<[f64; 3]> =
        body.positions.iter().filter_map(|part| (0..part.rows()).find_map(|row| part.position(row))).collect();
    let distances = starts.iter().flat_map(|one| starts.iter().map(|other| super::bodies::distance(*one, *other)));
    let largest = distances.fold(0.0, f64::max);
    if largest > 0.0 { (largest * 0.55 * 100.0).ceil() / 100.0 } else { 0.05 }
}

fn boxed(edge_m: f64) -> String {
    let edge = edge_m * 1e3;
    format!("{{box: [{edge} mm, {edge} mm, {edge} mm]}}")
}

fn is_support(body: &Body) -> bool {
    let words = super::words::words(&body.name);
    super::words::has(&words, &SUPPORTS)
}

/// A table below where the objects begin.
fn table(survey: &Survey, edge_m: f64, has_shape: bool) -> String {
    let starts: Vec<[f64; 3]> = survey
        .bodies
        .iter()
        .filter(|body| body.moves())
        .filter_map(Body::start)
        .map(|start| survey.upright(start))
        .collect();
    if !has_shape || starts.is_empty() {
        return "  table: {role: support}\n".into();
    }
    let mm = |value: f64| (value * 1e3).round();
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
