//! The fault of a failed simulation: its kind, its time, and the link and cause.

use super::observers::arm_clearance::ACCEPTED_M;
use super::run::Performance;

/// Kinds of faults.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FaultKind {
    /// An object is not where the demonstration left it.
    NotDone,
    /// A link penetrated something by more than [`ACCEPTED_M`].
    Collisions,
    /// The rules do not find a task in the robot's recording.
    NotRecognized,
    /// Forces are outside of their profile.
    Forces,
    /// The robot cannot execute the commands in this cell.
    Refused,
}

impl FaultKind {
    /// Returns the name in text and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::NotDone => "not_done",
            Self::Collisions => "collisions",
            Self::NotRecognized => "not_recognized",
            Self::Forces => "forces",
            Self::Refused => "refused",
        }
    }
}

/// A fault.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// The kind.
    pub kind: FaultKind,
    /// The time at which it began, s of the robot's recording; `None` if it has no time of its own.
    pub time_s: Option<f64>,
    /// The link.
    pub link: Option<String>,
    /// The body or link that the link touches or should touch.
    pub contact: Option<String>,
    /// The message.
    pub text: String,
}

impl Fault {
    /// Returns a fault without a place.
    pub fn new(kind: FaultKind, text: String) -> Self {
        Self { kind, time_s: None, link: None, contact: None, text }
    }

    /// Returns the first fault of a kind in a simulation, if it has one. Recognition is not part of a simulation.
    pub fn first(kind: FaultKind, performed: &Performance) -> Option<Self> {
        match kind {
            FaultKind::NotDone => not_done(performed),
            FaultKind::Collisions => collision(performed),
            FaultKind::Forces => forces(performed),
            FaultKind::NotRecognized | FaultKind::Refused => None,
        }
    }
}

fn not_done(performed: &Performance) -> Option<Fault> {
    let outcome = performed.outcomes.iter().find(|outcome| !outcome.done)?;
    let (task, object) = (&outcome.task, &outcome.object);
    let end = outcome.fell_s.map_or_else(
        || format!("is {:.1} mm and {:.1} degrees off", outcome.off * 1e3, outcome.turned.to_degrees()),
        |fell_s| format!("fell off after {fell_s:.1} s"),
    );
    let text = format!("{task}: `{object}` {end}");
    let Some(first) = outcome.causes.first() else { return Some(Fault::new(FaultKind::NotDone, text)) };
    Some(Fault {
        kind: FaultKind::NotDone,
        time_s: Some(first.time_s),
        link: first.place.link.clone(),
        contact: first.place.contact.clone(),
        text: format!("{text}; {first}"),
    })
}

fn collision(performed: &Performance) -> Option<Fault> {
    if !performed.outcomes.iter().any(|outcome| outcome.collides()) {
        return None;
    }
    let arms = performed.nearest.arms.as_ref().filter(|arms| arms.depth_m() > ACCEPTED_M);
    let arms = arms.map(|arms| (arms.time_s, &arms.links[0], &arms.links[1], arms.depth_m()));
    let met = performed.collisions.iter().filter(|met| met.depth_m > ACCEPTED_M);
    let met = met.map(|met| (met.time_s, &met.link, &met.with, met.depth_m));
    let first = met.chain(arms).min_by(|one, other| one.0.total_cmp(&other.0));
    let Some((time_s, link, with, depth_m)) = first else {
        return Some(Fault::new(FaultKind::Collisions, "a link penetrated something".into()));
    };
    Some(Fault {
        kind: FaultKind::Collisions,
        time_s: Some(time_s),
        link: Some(link.clone()),
        contact: Some(with.clone()),
        text: format!("after {time_s:.2} s, `{link}` is {:.1} mm inside `{with}`", depth_m * 1e3),
    })
}

fn forces(performed: &Performance) -> Option<Fault> {
    let outcome = performed.outcomes.iter().find(|outcome| !outcome.forces.kept())?;
    let faults = outcome.forces.faults().join("; ");
    Some(Fault::new(FaultKind::Forces, format!("{}: forces outside their profile: {faults}", outcome.task)))
}
