//! Bodies whose shapes overlap while they rest: a table that the scene has too high, an object of another size, a point that is not the body's origin.

use super::rests::{SCENE_ERROR, gap, objects, rests};
use super::survey::Survey;
use super::{in_scene, median, mm};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use teachtree_base::scene::{Role, Scene};
use teachtree_logs::issue::{Issue, IssueKind};

/// The depths of overlaps of one cause differ by less than this, m.
const ALIKE: f64 = 5e-3;

/// An object that overlaps another body whenever it rests near that.
struct Overlap {
    object: usize,
    /// How deep, m.
    depth: f64,
    /// Unit vector from the other body to the object, reference frame.
    normal: Vector3<f64>,
    /// When, s.
    span: [f64; 2],
}

/// The bodies that overlap at rest.
pub fn issues(scene: &Scene, survey: &Survey) -> Vec<Issue> {
    let mut overlaps: BTreeMap<usize, Vec<Overlap>> = BTreeMap::new();
    let mut touching: BTreeMap<usize, usize> = BTreeMap::new();
    for object in objects(scene, survey) {
        let rests = rests(survey, object, |_| true);
        for other in (0..scene.bodies.len()).filter(|other| may_overlap(scene, survey, object, *other)) {
            let near = rests.iter().filter_map(|rest| {
                let gap = gap(scene, survey, object, other, rest)?;
                (gap.width < SCENE_ERROR && is_still(survey, other, rest)).then_some((gap, survey.span_of(rest)))
            });
            let near: Vec<_> = near.collect();
            let [Some((_, [start, _])), Some((_, [_, end]))] = [near.first(), near.last()] else { continue };
            if near.iter().any(|(gap, _)| gap.width > -SCENE_ERROR) {
                *touching.entry(other).or_default() += 1;
                continue;
            }
            let Some(depth) = median(near.iter().map(|(gap, _)| -gap.width).collect()) else { continue };
            let Some((deepest, _)) = near.iter().min_by(|(a, _), (b, _)| a.width.total_cmp(&b.width)) else { continue };
            let overlap = Overlap { object, depth, normal: deepest.normal, span: [*start, *end] };
            overlaps.entry(other).or_default().push(overlap);
        }
    }
    let rests_right = |other: usize| touching.get(&other).is_some_and(|objects| *objects > 0);
    overlaps
        .iter()
        .flat_map(|(other, overlaps)| of_body(scene, survey, *other, overlaps, rests_right(*other)))
        .collect()
}

/// Whether an object is compared with another body: two objects are compared once, and a body may be in a hole that the shapes lack.
fn may_overlap(scene: &Scene, survey: &Survey, object: usize, other: usize) -> bool {
    let Some(((name, _), (its, body))) = scene.bodies.get_index(object).zip(scene.bodies.get_index(other)) else {
        return false;
    };
    let logged = |index: usize| survey.bodies.get(index).is_some_and(|body| body.is_logged);
    let is_object = body.role == Role::Object && logged(other);
    let takes = body.sockets.values().any(|socket| socket.takes(name));
    let is_taken = scene.bodies.get(name).is_some_and(|it| it.sockets.values().any(|socket| socket.takes(its)));
    other != object && (!is_object || other > object) && !body.parts.is_empty() && !takes && !is_taken
}

/// Whether a body stands still in a rest of another one.
fn is_still(survey: &Survey, body: usize, rest: &std::ops::Range<usize>) -> bool {
    survey
        .bodies
        .get(body)
        .and_then(|body| body.is_still.get(rest.clone()))
        .is_some_and(|still| !still.contains(&false))
        && !rest.clone().any(|sample| survey.is_touched(body, sample))
}

/// What is wrong with a body that objects overlap; `rests_right` if others rest on it.
fn of_body(scene: &Scene, survey: &Survey, other: usize, overlaps: &[Overlap], rests_right: bool) -> Vec<Issue> {
    let name = |body: usize| scene.bodies.get_index(body).map_or("", |(name, _)| name.as_str());
    let Some((its, body)) = scene.bodies.get_index(other) else { return vec![] };
    let logged = survey.bodies.get(other).is_some_and(|body| body.is_logged);
    let alike = |one: &Overlap| overlaps.iter().all(|it| (it.depth - one.depth).abs() < ALIKE);
    let common = overlaps.first().filter(|one| !rests_right && alike(one));
    if let Some(first) = common {
        let objects: Vec<String> = overlaps.iter().map(|overlap| format!("`{}`", name(overlap.object))).collect();
        let (Some(depth), true) = (median(overlaps.iter().map(|it| it.depth).collect()), !objects.is_empty()) else {
            return vec![];
        };
        let found = body.position.map(|length| length.0);
        let moved = Vector3::from(found) - first.normal * depth;
        let is_or_are = if objects.len() > 1 { "rest" } else { "rests" };
        let cause = if logged {
            "its position in the log is wrong by this distance, or the `parts` of a body are wrong".to_string()
        } else {
            format!(
                "`{its}` is misplaced in the scene (`position: {}` instead of `{}`), or its `parts` fill a cavity, or the `parts` or the tracked point of {} are wrong",
                in_scene(moved.into()),
                in_scene(found),
                objects.join(" and ")
            )
        };
        let message = format!("{} {is_or_are} {} mm inside it: {cause}", objects.join(" and "), mm(depth));
        return vec![issue(overlaps, its, message)];
    }
    let single = overlaps.iter().map(|overlap| {
        let object = name(overlap.object);
        let message = format!(
            "it rests {} mm inside `{its}`, on which other objects rest correctly: the `parts` of `{object}` are too large, or its tracked point is not the origin \
             of its `parts`",
            mm(overlap.depth)
        );
        issue(std::slice::from_ref(overlap), object, message)
    });
    single.collect()
}

fn issue(overlaps: &[Overlap], body: &str, message: String) -> Issue {
    let start_s = overlaps.iter().map(|it| it.span[0]).fold(f64::INFINITY, f64::min);
    let end_s = overlaps.iter().map(|it| it.span[1]).fold(f64::NEG_INFINITY, f64::max);
    Issue { kind: IssueKind::OVERLAPPING_BODIES, start_s, end_s, channel: format!("{body}.position"), message }
}
