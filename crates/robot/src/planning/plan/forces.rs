//! The forces of a plan: the commanded ones, and the ones that the operator exerted.

use super::segments::{firmest, has_closed};
use super::{Phase, Plan, Role, Target, pace};
use crate::planning::interpolation::between;
use nalgebra::Vector3;
use teachtree_base::hands::Finger;
use teachtree_base::meaning::Meaning;
use teachtree_command::Segment;

/// The force of a fingertip on the object at one time of a plan, in the object's frame, N.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlannedForce {
    /// The finger.
    pub finger: Finger,
    /// The commanded force; while the hand closes or releases, the planned share of it.
    pub commanded: Vector3<f64>,
    /// The demonstrated force; `None` if it was not measured.
    pub demonstrated: Option<Vector3<f64>>,
}

impl Phase<'_> {
    /// Whether the phase closes the hand before a push; it takes place at the start of the push.
    fn waits(&self) -> bool {
        self.role == Role::Close && self.segment.does != Meaning::Close
    }
}

impl Plan<'_> {
    /// Returns the completed share of a phase (0 to 1) after a time, s.
    pub(super) fn share(&self, phase: &Phase<'_>, local: f64) -> f64 {
        let share = local / phase.duration;
        match (phase.role, phase.segment.does) {
            (Role::Hold, Meaning::Insert) => pace::eased(share),
            (Role::Hold, _) => pace::beside(share, phase.demonstrated, &self.insertions),
            _ => share,
        }
    }

    /// Returns the index of the segment at a time (s) at which the planned forces equal the commanded ones: the hand has closed and is not letting go.
    pub(crate) fn commands_forces(&self, time: f64) -> Option<usize> {
        let local = time - self.transfer;
        let phase = &self.phases[self.index_at(local)];
        let changes_grip = matches!(phase.segment.does, Meaning::Close | Meaning::Open);
        let holds = matches!(phase.role, Role::Hold | Role::Steady) && !changes_grip;
        let number = || self.task.segments.iter().position(|segment| std::ptr::eq(segment, phase.segment));
        (local >= 0.0 && holds).then(number)?
    }

    /// Returns the forces of the participating fingertips at a time, s. `target` is the hand's target at that time.
    pub(crate) fn forces(&self, time: f64, target: &Target) -> Vec<PlannedForce> {
        let local = time - self.transfer;
        let phase = &self.phases[self.index_at(local)];
        let share = self.share(phase, (local - phase.start).clamp(0.0, phase.duration));
        let share = if phase.waits() || phase.role == Role::Steady { 0.0 } else { share };
        let touches = local >= 0.0 && !matches!(phase.role, Role::Free | Role::Over);
        let demonstrated = |finger: Finger| {
            if touches { force_at(phase.segment, finger, share, true) } else { Some(Vector3::zeros()) }
        };
        let forces = target.tips.iter().map(|(finger, _, force)| PlannedForce {
            finger: *finger,
            commanded: target.object.inverse_transform_vector(force),
            demonstrated: demonstrated(*finger),
        });
        forces.collect()
    }

    /// Returns the commanded force of a finger at a share of a phase, frame of the object. Motion after a closing keeps the force at the end of the closing.
    pub(super) fn commanded_force(&self, index: usize, at: f64, finger: Finger) -> Vector3<f64> {
        let phase = &self.phases[index];
        let segment = phase.segment;
        let (segment, share) = match phase.role {
            Role::Close if phase.waits() => (segment, 0.0),
            Role::Close => (segment, self.final_share(index)),
            Role::Hold if has_closed(&self.phases, segment) => (segment, 1.0),
            Role::Hold | Role::Steady if segment.does != Meaning::Open => (segment, at),
            Role::Hold | Role::Steady | Role::Leave => {
                // The force at the end of the phase before a release.
                let holds = |before: &Phase<'_>| matches!(before.role, Role::Close | Role::Hold);
                let Some(before) = self.phases[..index].iter().rposition(holds) else { return Vector3::zeros() };
                (self.phases[before].segment, self.final_share(before))
            }
            Role::Free | Role::Over => return Vector3::zeros(),
        };
        force_at(segment, finger, share, false).unwrap_or_default()
    }

    /// Returns the share of a segment whose force applies at the end of a phase in which a hand closes or holds: the last one. For an object that is released at once,
    /// it is the share with the operator's largest force.
    fn final_share(&self, index: usize) -> f64 {
        let (phase, next) = (&self.phases[index], self.phases.get(index + 1));
        let only_closes = phase.role == Role::Close && next.is_some_and(|next| next.role == Role::Leave);
        if only_closes { firmest(phase.segment) } else { 1.0 }
    }
}

/// Returns the commanded or demonstrated force of a finger at a share of a segment, in the object's frame.
fn force_at(segment: &Segment, finger: Finger, share: f64, demonstrated: bool) -> Option<Vector3<f64>> {
    let tip = segment.tips.iter().find(|tip| tip.finger == finger)?;
    let forces = if demonstrated { &tip.demonstrated_force } else { &tip.force };
    let (index, t) = between(forces, share)?;
    let at = |index: usize| Vector3::from(forces[index.min(forces.len() - 1)]);
    Some(at(index).lerp(&at(index + 1), t))
}
