//! Contacts made and lost, as events.

use super::series::debounce;
use super::world_state::WorldState;
use teachtree_base::recording::Event;
use teachtree_base::scene::Scene;

/// The minimum duration of a contact or of its loss that is an event, ms.
const BLIP: usize = 20;

/// Contacts made and lost, between fingertips and bodies and between bodies.
pub(crate) fn contact_events(scene: &Scene, moments: &[WorldState]) -> Vec<Event> {
    let names: Vec<&String> = scene.bodies.keys().collect();
    let mut events = Vec::new();
    let mut watch = |subjects: Vec<String>, touching: &dyn Fn(&WorldState) -> bool| {
        let mut states: Vec<bool> = moments.iter().map(touching).collect();
        debounce(&mut states, BLIP, BLIP);
        let mut before = false;
        for (index, &state) in states.iter().enumerate() {
            if state != before {
                let kind = if state { "contact_made" } else { "contact_lost" };
                events.push(Event { time_s: index as f64 / 1000.0, kind: kind.into(), subjects: subjects.clone() });
                before = state;
            }
        }
    };
    for (hand, (side, fingers)) in scene.hands.iter().enumerate() {
        for (index, finger) in fingers.fingers.iter().enumerate() {
            for (body, name) in names.iter().enumerate() {
                let subjects = vec![format!("{side}.{finger}"), (*name).clone()];
                watch(subjects, &|moment| moment.hands[hand][index].force_on(body).is_some());
            }
        }
    }
    for (pair, contact) in moments.first().map_or(&[][..], |moment| &moment.contacts).iter().enumerate() {
        let subjects = vec![names[contact.body].clone(), names[contact.other].clone()];
        watch(subjects, &|moment| moment.contacts[pair].touching);
    }
    events
}
