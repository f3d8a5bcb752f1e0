//! The inputs of the shipped rules as rows: all values of a frame are adjacent in memory, in 32 bits.

use teachtree_base::hands::{Finger, Side};
use teachtree_frames::frames::{ColumnKey, Frames};

/// A frame with five fingers and `CONTACTS` bodies that the target may touch; a missing body has zero force.
#[derive(Clone)]
pub struct Row<const CONTACTS: usize> {
    /// x, y, z of each fingertip.
    pub tips: [[f32; 5]; 3],
    /// Force of each fingertip on the object.
    pub forces: [[f32; 5]; 3],
    /// Whether each fingertip touches an object.
    pub touch: [f32; 5],
    /// Index of the target.
    pub target: f32,
    pub position: [f32; 3],
    pub velocity: [f32; 3],
    pub radius: f32,
    pub spin: f32,
    pub depth: f32,
    pub sinking: f32,
    pub over_socket: f32,
    pub in_plain_socket: f32,
    /// Upward force of the fingers on the object.
    pub push_up: f32,
    /// For each body that the target may touch: its force on the target,
    pub contact_forces: [[f32; CONTACTS]; 3],
    /// the normal of the contact,
    pub normals: [[f32; CONTACTS]; 3],
    /// its velocity, and whether the other hand touches it.
    pub velocities: [[f32; CONTACTS]; 3],
    pub handled: [f32; CONTACTS],
}

/// Returns the rows of a log with one right hand; `None` if its target may touch more bodies.
pub fn rows<const CONTACTS: usize>(frames: &Frames) -> Option<Vec<Row<CONTACTS>>> {
    let [hand] = frames.layout.hands.as_slice() else { panic!("one hand is expected") };
    let fingers = [Finger::Thumb, Finger::Index, Finger::Middle, Finger::Ring, Finger::Little];
    assert!(hand.side == Side::Right && hand.fingers == fingers, "a right hand with five fingers is expected");
    assert!(frames.stretches.len() == 1, "one stretch is expected");
    if hand.contacts.len() > CONTACTS {
        return None;
    }
    let column = |name: &str, slot: usize, component: usize| -> &[f64] {
        let channel = frames.channel(name).unwrap_or_else(|| panic!("no channel {name}"));
        let key = ColumnKey { channel, side: Some(Side::Right), slot: slot as u32, component: component as u32 };
        frames.column(key).unwrap_or_else(|| panic!("no column {name}"))
    };
    let one = |name: &str| column(name, 0, 0);
    let vector = |name: &str| [0, 1, 2].map(|part| column(name, 0, part));
    let fingers = |name: &str| [0, 1, 2].map(|part| [0, 1, 2, 3, 4].map(|slot| column(name, slot, part)));
    let contact = |name: &str, slot: usize, part: usize| {
        if slot < hand.contacts.len() { column(name, slot, part) } else { &[] }
    };
    let contacts = |name: &str| -> [[&[f64]; CONTACTS]; 3] {
        [0, 1, 2].map(|part| std::array::from_fn(|slot| contact(name, slot, part)))
    };
    let (tips, forces) = (fingers("fingers.position"), fingers("fingers.force"));
    let touch = [0, 1, 2, 3, 4].map(|slot| column("fingers.contact", slot, 0));
    let (target, radius, spin, depth) = (one("target"), one("target.radius"), one("target.spin"), one("target.depth"));
    let (sinking, over, plain) = (one("target.sinking"), one("target.over_socket"), one("target.in_plain_socket"));
    let (position, velocity, push) = (vector("target.position"), vector("target.velocity"), vector("push"));
    let (contact_forces, normals) = (contacts("contacts.force"), contacts("contacts.normal"));
    let velocities = contacts("contacts.velocity");
    let handled: [&[f64]; CONTACTS] = std::array::from_fn(|slot| contact("contacts.handled", slot, 0));
    let row = |frame: usize| {
        let at = |values: &[f64]| values.get(frame).copied().unwrap_or_default() as f32;
        Row {
            tips: tips.map(|parts| parts.map(at)),
            forces: forces.map(|parts| parts.map(at)),
            touch: touch.map(at),
            target: at(target),
            position: position.map(at),
            velocity: velocity.map(at),
            radius: at(radius),
            spin: at(spin),
            depth: at(depth),
            sinking: at(sinking),
            over_socket: at(over),
            in_plain_socket: at(plain),
            push_up: at(push[2]),
            contact_forces: contact_forces.map(|parts| parts.map(at)),
            normals: normals.map(|parts| parts.map(at)),
            velocities: velocities.map(|parts| parts.map(at)),
            handled: handled.map(at),
        }
    };
    Some((0..frames.len).map(row).collect())
}
