//! The body that a hand's target is in or against, frame by frame: what the analysis names beside the object of a segment.

use super::contacts::Contact;
use super::hands::HandTrack;
use super::targets::{CARRIES, Derivation};
use teachtree_base::scene::Role;

/// A body that a target is in or against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Partner {
    /// Its index in the scene.
    pub body: usize,
    /// Whether the target is in a socket of it.
    pub inside: bool,
}

impl Derivation<'_> {
    /// The partner of a hand's target at each frame, in order; none while the hand does not touch the target. The first that there is of:
    /// the body whose socket it is in, the object of the other hand, the body that presses most from the side, an object that carries it.
    pub(super) fn partner(&self, track: &HandTrack, each: &mut dyn FnMut(Option<Partner>)) {
        let other = self.tracks.iter().find(|other| other.side != track.side);
        for (frames, target) in &track.runs {
            let Some(body) = *target else {
                frames.clone().for_each(|_| each(None));
                continue;
            };
            let plugged = self.plugged.get(&body);
            let contacts: Vec<(usize, &Contact)> = (self.partners.iter())
                .filter_map(|partner| Some((*partner, self.contacts.get(&(body, *partner))?)))
                .collect();
            for frame in frames.clone() {
                if track.touching.get(frame) != Some(&true) {
                    each(None);
                    continue;
                }
                let socket = self.socket(frame, plugged).map(|socket| Partner { body: socket.body, inside: true });
                let against = || {
                    let other = self.of_other_hand(other, frame, body);
                    other.or_else(|| self.against(&contacts, frame)).map(|body| Partner { body, inside: false })
                };
                each(socket.or_else(against));
            }
        }
    }

    /// The object of the other hand, where it touches the target or is in a socket of it.
    fn of_other_hand(&self, other: Option<&HandTrack>, frame: usize, body: usize) -> Option<usize> {
        let other = other.filter(|other| other.touching.get(frame) == Some(&true))?;
        let its = other.target.get(frame).copied().flatten().filter(|its| *its != body)?;
        let touches = self.contacts.get(&(body, its)).is_some_and(|contact| contact.touching(frame, true));
        let is_in = || self.socket(frame, self.plugged.get(&its)).is_some_and(|socket| socket.body == body);
        (touches || is_in()).then_some(its)
    }

    /// The body that presses most from the side, else the object that carries it.
    fn against(&self, contacts: &[(usize, &Contact)], frame: usize) -> Option<usize> {
        let role = |body: usize| self.measured.scene.bodies.get_index(body).map(|(_, body)| body.role);
        let touching = || contacts.iter().filter(|(_, contact)| contact.touching(frame, true));
        let strongest = |is: &dyn Fn(usize, &Contact) -> bool| {
            touching()
                .filter(|(body, contact)| is(*body, contact))
                .max_by(|(_, a), (_, b)| a.force(frame).norm().total_cmp(&b.force(frame).norm()))
                .map(|(body, _)| *body)
        };
        let carries = |contact: &Contact| contact.normal(frame).z >= CARRIES;
        strongest(&|_, contact| !carries(contact))
            .or_else(|| strongest(&|body, _| matches!(role(body), Some(Role::Object | Role::Socket))))
    }
}
