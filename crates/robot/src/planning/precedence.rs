//! Ways without the object that a hand may go before or after what the other hand does meanwhile: one hand waits where both cannot pass. The ways themselves stay
//! as they are, and what hands do with objects stays at the same time: path coordination (O'Donnell and Lozano-Pérez 1989; LaValle, *Planning Algorithms*, 7.2.2)
//! with one choice of an order for each way.

use std::ops::Range;
use teachtree_base::meaning::Meaning;
use teachtree_command::{Precedence, Segment, Task};

/// The ways of a task that may have another precedence than now. `shared` says that the other hand handles the object too, or one that goes into it or has a hole for
/// it: a hand does not let go of that earlier or later, since the other one would have to hold all of it, and does not come to it before it has been brought there.
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
