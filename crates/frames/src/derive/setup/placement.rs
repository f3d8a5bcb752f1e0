//! Bodies that a scene places wrongly before anything moves: an object that begins inside another body, or a body out of reach of all others.

use super::rests::SCENE_ERROR;
use super::{in_scene, mm};
use crate::derive::convex_gap::gaps;
use nalgebra::{Isometry3, Vector3};
use teachtree_base::geometry::pose;
use teachtree_base::scene::{Body, Role, Scene};

/// A body that is farther than this from every other body is in no reach, m: arms reach 1 to 2 m.
const OUT_OF_REACH: f64 = 5.0;

/// A body with a wrong position, and the message about it, which has the position to write where one follows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Misplacement {
    /// The body.
    pub body: String,
    /// What is wrong.
    pub message: String,
}

/// The bodies that a scene places wrongly. Objects in the origin have no place of their own, and bodies that a hand holds move with it.
pub fn misplacements(scene: &Scene) -> Vec<Misplacement> {
    let placed: Vec<(&str, &Body, Isometry3<f64>)> = scene
        .bodies
        .iter()
        .filter(|(_, body)| body.fixed_to.is_none() && (body.role != Role::Object || is_placed(body)))
        .map(|(name, body)| (name.as_str(), body, pose(body.position.map(|length| length.0), body.rotation)))
        .collect();
    let mut found = vec![];
    for (at, (name, body, here)) in placed.iter().enumerate() {
        let others = || placed.iter().enumerate().filter(|(other, _)| *other != at).map(|(_, other)| other);
        let reach = others().map(|(_, other, there)| distance((body, here), (other, there))).reduce(f64::min);
        let message = match reach.filter(|reach| *reach > OUT_OF_REACH && is_placed(body)) {
            Some(reach) => Some(out_of_reach(body, reach)),
            None if body.role == Role::Object => {
                // Two objects are compared once.
                let later =
                    placed.iter().enumerate().filter(|(other, (_, it, _))| *other > at || it.role != Role::Object);
                inside((name, body, here), later.filter(|(other, _)| *other != at).map(|(_, other)| other))
            }
            None => None,
        };
        found.extend(message.map(|message| Misplacement { body: (*name).to_string(), message }));
    }
    found
}

fn is_placed(body: &Body) -> bool {
    body.position.iter().any(|length| length.0 != 0.0)
}

/// How far the bounding balls of two bodies are apart, m.
fn distance((body, here): (&Body, &Isometry3<f64>), (other, there): (&Body, &Isometry3<f64>)) -> f64 {
    let between = (here.translation.vector - there.translation.vector).norm();
    between - body.bounding_radius() - other.bounding_radius()
}

fn out_of_reach(body: &Body, reach: f64) -> String {
    let position = body.position.map(|length| length.0);
    format!(
        "it is {:.1} m from every other body, out of reach of a hand; if the numbers are mm, write `position: {}`",
        reach,
        in_scene(position.map(|length| length / 1e3))
    )
}

/// The message about an object that is inside another body: the deepest one.
fn inside<'a>(
    (name, body, here): (&str, &Body, &Isometry3<f64>),
    others: impl Iterator<Item = &'a (&'a str, &'a Body, Isometry3<f64>)>,
) -> Option<String> {
    let takes = |holder: &Body, taken: &str| holder.sockets.values().any(|socket| socket.takes(taken));
    let overlaps = others.filter_map(|(its, other, there)| {
        let all = gaps((body, here), (other, there), 0.0);
        let gap = all.into_iter().min_by(|one, next| one.width.total_cmp(&next.width))?;
        let is_wrong = gap.width < -SCENE_ERROR && !takes(other, name) && !takes(body, its);
        is_wrong.then_some((*its, gap))
    });
    let (its, gap) = overlaps.min_by(|(_, one), (_, next)| one.width.total_cmp(&next.width))?;
    let moved: Vector3<f64> = here.translation.vector - gap.normal * gap.width;
    Some(format!(
        "it begins {} mm inside `{its}`; `position: {}` places it on the surface",
        mm(-gap.width),
        in_scene(moved.into())
    ))
}
