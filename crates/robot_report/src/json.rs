//! What came of commands as `teachtree.outcome/1`.

use serde_json::{Value, json};
use teachtree_analysis::number::number;
use teachtree_command::Commands;
use teachtree_robot::JointKind;
use teachtree_robot::control::behavior::SearchResult;
use teachtree_robot::simulation::arm_clearance::{Collision, MinDistance, MinDistances};
use teachtree_robot::simulation::cause::{Cause, FailureCause};
use teachtree_robot::simulation::force_tolerance::{MeanForce, SegmentForces};
use teachtree_robot::simulation::{CellVariation, TaskOutcome};

/// Writes the document; `duration_s` is that of the robot's recording, `recognized` says for each outcome whether rules find its task there, and `variation`
/// is the variation of the cell, if one was given.
pub fn json(
    commands: &Commands,
    outcomes: &[TaskOutcome],
    recognized: Option<&[Option<bool>]>,
    nearest: &MinDistances,
    collisions: &[Collision],
    duration_s: f64,
    variation: Option<&CellVariation>,
) -> String {
    let arms = nearest.arms.as_ref().map(|nearest| {
        json!({ "gap_m": exact(nearest.gap), "time_s": exact(nearest.time_s), "links": nearest.links,
            "pass_through": nearest.passes_through() })
    });
    let to_body = |nearest: &MinDistance| {
        let [link, body] = &nearest.links;
        json!({ "gap_m": exact(nearest.gap), "time_s": exact(nearest.time_s), "link": link, "body": body })
    };
    let document = json!({
        "schema": "teachtree.outcome/1",
        "log": commands.log,
        "robot": commands.robot,
        "duration_s": exact(duration_s),
        "variation": variation,
        "tasks": outcomes.iter().enumerate().map(|(at, it)| outcome(it, recognized.and_then(|all| *all.get(at)?))).collect::<Vec<_>>(),
        "nearest": arms,
        "nearest_body": nearest.scene.as_ref().map(to_body),
        "nearest_handled": nearest.handled.as_ref().map(to_body),
        "collisions": collisions.iter().map(collision).collect::<Vec<_>>(),
    });
    format!("{document}\n")
}

fn collision(Collision { link, with, time_s, depth_m, lasts_s }: &Collision) -> Value {
    let [time_s, depth_m, lasts_s] = [time_s, depth_m, lasts_s].map(|value| exact(*value));
    json!({ "link": link, "with": with, "time_s": time_s, "depth_m": depth_m, "lasts_s": lasts_s })
}

/// A number as all that are written.
pub(crate) fn exact(value: f64) -> Value {
    serde_json::from_str(&number(value)).unwrap_or(Value::Null)
}

fn outcome(outcome: &TaskOutcome, recognized: Option<bool>) -> Value {
    let hole = outcome.searched.map(|searched| match searched {
        SearchResult::Found(off) => json!({ "found": true, "off_m": exact(off) }),
        SearchResult::NotWithin(within) => json!({ "found": false, "within_m": exact(within) }),
    });
    json!({
        "task": outcome.task,
        "track": outcome.side.name(),
        "object": outcome.object,
        "done": outcome.done,
        "verdict": outcome.verdict().name(),
        "collision_m": exact(outcome.collision_m),
        "recognized": recognized,
        "off_m": exact(outcome.off),
        "turned_rad": exact(outcome.turned),
        "leaning_rad": exact(outcome.leaning),
        "speed_m_s": exact(outcome.speed),
        "fell_s": outcome.fell_s.map(exact),
        "hole": hole,
        "palm_error_m": exact(outcome.palm_error),
        "force_error_n": exact(outcome.forces.error),
        "largest_force_n": exact(outcome.largest_force),
        "forces_kept": outcome.forces.kept(),
        "segments": outcome.forces.segments.iter().map(segment).collect::<Vec<_>>(),
        "causes": outcome.causes.iter().map(cause).collect::<Vec<_>>(),
    })
}

fn segment(segment: &SegmentForces) -> Value {
    let finger = |MeanForce { finger, demonstrated, commanded, exerted }: &MeanForce| {
        json!({ "finger": finger.name(), "demonstrated_n": demonstrated.map(exact), "commanded_n": exact(*commanded),
            "exerted_n": exact(*exerted) })
    };
    json!({
        "segment": segment.segment,
        "primitive": segment.primitive,
        "start_s": exact(segment.start_s),
        "duration_s": exact(segment.lasts_s),
        "grip_raised": exact(segment.raised()),
        "fingers": segment.fingers.iter().map(finger).collect::<Vec<_>>(),
    })
}

fn cause(cause: &Cause) -> Value {
    let mut written = json!({
        "cause": cause.why.name(),
        "time_s": exact(cause.time_s),
        "track": cause.side.name(),
        "primitive": cause.primitive,
        "link": cause.place.link,
        "contact": cause.place.contact,
        "text": cause.to_string(),
    });
    let more = match &cause.why {
        FailureCause::JointAtLimit(joint, None, m, rad) => {
            json!({ "joint": joint, "off_m": exact(*m), "off_rad": exact(*rad) })
        }
        FailureCause::JointAtLimit(joint, Some(finger), m, _) => {
            json!({ "joint": joint, "finger": finger.name(), "off_m": exact(*m) })
        }
        FailureCause::TorqueMissing(joint, missing, JointKind::Revolute) => {
            json!({ "joint": joint, "missing_n_m": exact(*missing) })
        }
        FailureCause::TorqueMissing(joint, missing, JointKind::Prismatic) => {
            json!({ "joint": joint, "missing_n": exact(*missing) })
        }
        FailureCause::ContactSlipped(finger, by) => json!({ "finger": finger.name(), "off_m": exact(*by) }),
        FailureCause::ContactLost(finger) => json!({ "finger": finger.name() }),
        FailureCause::Dropped => json!({}),
        FailureCause::HoleMissed(within) => json!({ "within_m": exact(*within) }),
        FailureCause::LeftWay(m, rad) => json!({ "off_m": exact(*m), "off_rad": exact(*rad) }),
    };
    if let (Some(written), Value::Object(more)) = (written.as_object_mut(), more) {
        written.extend(more);
    }
    written
}
