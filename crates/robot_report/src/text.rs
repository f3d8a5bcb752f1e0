//! What came of commands as lines for terminals.

use std::fmt::Write;
use teachtree_base::short_number::ShortNumber;
use teachtree_robot::simulation::arm_clearance::{ACCEPTED_M, Collision, MinDistances};
use teachtree_robot::simulation::force_tolerance::Forces;
use teachtree_robot::simulation::warnings::warnings;
use teachtree_robot::simulation::{Performance, TaskOutcome};

/// Objects that lean by more than the first are reported to lean, by more than the second to have fallen over, rad; objects faster than the third, m/s, still move.
const LEANING_RAD: f64 = 0.05;
const FALLEN_RAD: f64 = 0.8;
const MOVING_M_S: f64 = 0.01;

/// What came of the tasks, and the clearance of the arms.
pub fn format_performance(performed: &Performance) -> String {
    format_outcomes(&performed.outcomes) + &format_clearance(&performed.nearest, &performed.collisions)
}

/// What came of the tasks.
pub fn format_outcomes(outcomes: &[TaskOutcome]) -> String {
    let mut text = String::new();
    let both = outcomes.iter().any(|outcome| outcome.side != outcomes[0].side);
    for outcome in outcomes {
        let hand = if both { format!("{} ", outcome.side) } else { String::new() };
        let _ = write!(text, "{:8} {hand}{}: `{}` ", outcome.verdict().name(), outcome.task, outcome.object);
        let _ = match outcome.fell_s {
            Some(fell_s) => writeln!(text, "fell off after {fell_s:.1} s"),
            None => writeln!(
                text,
                "is {:.1} mm and {:.1} degrees from where the demonstration left it{}",
                ShortNumber(outcome.off * 1e3),
                outcome.turned.to_degrees(),
                format_object_state(outcome)
            ),
        };
        for cause in &outcome.causes {
            let _ = writeln!(text, "         {cause}");
        }
        if outcome.collides() {
            let (deep, accepted) = (outcome.collision_m * 1e3, ACCEPTED_M * 1e3);
            let _ = writeln!(
                text,
                "         links penetrated something by up to {deep:.1} mm, at most {accepted:.0} mm are accepted"
            );
        }
        let _ = writeln!(
            text,
            "         palm within {:.1} mm of its path, forces {:.2} N off the commanded ones on average, {:.2} N at most",
            outcome.palm_error * 1e3,
            outcome.forces.error,
            outcome.largest_force
        );
        if let Some((demonstrated, commanded, exerted)) = outcome.forces.means() {
            let demonstrated = demonstrated.map_or_else(String::new, |mean| format!("{mean:.2} N demonstrated, "));
            let _ = writeln!(
                text,
                "         fingertips on average: {demonstrated}{commanded:.2} N commanded, {exerted:.2} N exerted"
            );
        }
        for change in outcome.forces.grip_changes() {
            let _ = writeln!(text, "         {change}");
        }
        if let Some(searched) = &outcome.searched {
            let _ = writeln!(text, "         {searched}");
        }
        text += &format_forces(&outcome.forces);
    }
    text
}

/// How an object is that is not where the operator left it.
fn format_object_state(outcome: &TaskOutcome) -> String {
    if outcome.done {
        return String::new();
    }
    let mut text = String::new();
    if outcome.leaning > FALLEN_RAD {
        text += ", fallen over";
    } else if outcome.leaning > LEANING_RAD {
        let _ = write!(text, ", leaning by {:.0} degrees", outcome.leaning.to_degrees());
    }
    if outcome.speed > MOVING_M_S {
        let _ = write!(text, ", still moving at {:.0} mm/s", outcome.speed * 1e3);
    }
    text
}

/// The least gaps over the whole motion, and what arms went through.
pub fn format_clearance(nearest: &MinDistances, collisions: &[Collision]) -> String {
    let mut text = String::new();
    let MinDistances { arms, scene, handled } = nearest;
    if let Some(nearest) = arms.as_ref().filter(|nearest| !nearest.passes_through()) {
        let (gap, time_s, [one, other]) = (nearest.gap * 1e3, nearest.time_s, &nearest.links);
        let _ = writeln!(text, "smallest gap of the arms: {gap:.1} mm, `{one}` and `{other}`, after {time_s:.1} s");
    }
    for (what, nearest) in [("other bodies", scene), ("handled objects", handled)] {
        // A penetration is a warning.
        if let Some(nearest) = nearest.as_ref().filter(|nearest| !nearest.passes_through()) {
            let (gap, time_s, [link, body]) = (nearest.gap * 1e3, nearest.time_s, &nearest.links);
            let _ = writeln!(text, "smallest gap to {what}: {gap:.1} mm, `{link}` and `{body}`, after {time_s:.1} s");
        }
    }
    for warning in warnings(nearest, collisions) {
        let _ = writeln!(text, "warning: {}", warning.message);
    }
    text
}

/// Forces that are not within their profile; nothing for those that are.
fn format_forces(forces: &Forces) -> String {
    let faults = forces.faults();
    if faults.is_empty() {
        String::new()
    } else {
        format!("         forces outside their profile: {}\n", faults.join("; "))
    }
}
