//! Insertions that only the position of a gripper shows: the object has no position, and neither a force nor a contact distinguishes the hole from its surroundings.

use super::sockets::{SEARCH_BELOW, logged};
use super::targets::Derivation;
use super::unplaced::is_unplaced;
use teachtree_base::hands::{Finger, Side};
use teachtree_logs::issue::{Issue, IssueKind};

/// Returns an issue for each object that a hand brings into a socket, or out of it, in such a log.
pub fn issues(derivation: &Derivation, objects: &[usize]) -> Vec<Issue> {
    let measured = derivation.measured;
    let feels =
        |side: Side| Finger::ALL.iter().any(|finger| measured.vec3(&format!("{side}.{finger}.force")).is_some());
    let issue = |object: &usize| {
        let (name, _) = measured.scene.bodies.get_index(*object)?;
        let has_contact = derivation.contacts.keys().any(|(one, _)| one == object);
        if !is_unplaced(measured, *object) || has_contact {
            return None;
        }
        let plugged = derivation.plugged.get(object)?;
        let is_in = |frame: &usize| {
            plugged.depth.get(*frame).is_some_and(|depth| *depth > SEARCH_BELOW)
                && derivation.is_touched(*object, *frame)
                && !derivation.touching(*object, *frame).any(feels)
        };
        let mut frames = (0..measured.len()).filter(is_in);
        let first = frames.next()?;
        let last = frames.next_back().unwrap_or(first);
        let socket = derivation
            .socket(first, Some(plugged))
            .filter(|socket| logged(measured, name, "depth", socket).is_none())?;
        let (holder, _) = measured.scene.bodies.get_index(socket.body)?;
        let at = |frame: usize| measured.time.get(frame).copied().unwrap_or_default();
        let message = format!(
            "`{name}` counts as in `{}` of `{holder}` by the place of the gripper: the log has neither its position nor a force, so that it may also stand on \
             `{holder}`; expected `{name}.position` or the force at the wrist in the log",
            socket.name
        );
        Some(Issue {
            kind: IssueKind::ASSUMED_INSERTION,
            start_s: at(first),
            end_s: at(last),
            channel: format!("{name}.position"),
            message,
        })
    };
    objects.iter().filter_map(issue).collect()
}
