//! Precedence of paths: a hand follows a path without the object before or after the simultaneous motion of the other hand, if both cannot pass at once. The paths
//! are unchanged, and contacts with objects keep their times: path coordination (O'Donnell and Lozano-Pérez 1989; LaValle, *Planning Algorithms*, 7.2.2) with one
//! choice of an order for each path.

use std::ops::Range;
use teachtree_base::meaning::Meaning;
use teachtree_base::scene::Scene;
use teachtree_command::{Precedence, Segment, Task};

/// Returns the paths of a task whose precedence may change. With `shared`, the other hand handles the same object, or one that is inserted into it or contains it:
/// the times at which a hand reaches or releases such an object are fixed, since the other hand depends on them.
pub(super) fn orders(task: &Task, shared: bool) -> Vec<(Range<usize>, Precedence)> {
    let segments = &task.segments;
    let is_way = |segment: &Segment| !segment.touching || segment.does == Meaning::Open && !shared;
    let mut found = Vec::new();
    let mut from = 0;
    while from < segments.len() {
        if !is_way(&segments[from]) {
            from += 1;
            continue;
        }
        let touches = (from + 1..segments.len()).find(|at| segments[*at].touching);
        let way = from..touches.unwrap_or(segments.len());
        for precedence in [Precedence::First, Precedence::Last] {
            let may = !shared || touches.is_none() || precedence == Precedence::Last;
            let is_new = segments[way.clone()].iter().any(|segment| segment.precedence != Some(precedence));
            if may && is_new {
                found.push((way.clone(), precedence));
            }
        }
        from = way.end;
    }
    found
}

/// Whether two objects are the same, or one has a hole for the other: an inserted object moves with its hole.
pub(super) fn belong_together(scene: &Scene, one: &str, other: &str) -> bool {
    let takes = |body: &str, object: &str| {
        scene.bodies.get(body).is_some_and(|body| body.sockets.values().any(|socket| socket.takes(object)))
    };
    one == other || takes(one, other) || takes(other, one)
}
