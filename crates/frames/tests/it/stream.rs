//! Tests of `logs` and `frames`: logs in, frames out.

mod arm_models;
mod bad_logs;
mod bindings;
mod carrying;
mod closed_grippers;
mod constants;
mod contact_kinds;
mod convex;
mod derived;
mod distances;
mod element_names;
mod field_names;
mod fingertips;
mod flagged_supports;
mod formats;
mod frames;
mod hand_models;
mod held_forces;
mod held_poses;
mod implausible;
mod jumps;
mod learned;
mod live_rows;
mod lost_bodies;
mod never_panics;
mod pads;
mod robosuite;
mod robots;
mod round_trip;
mod setup;
mod targets;
mod touch;
mod turning_weight;
mod unplaced;

use teachtree_base::channels::{Axis, ChannelSpec, Fallback, Shape, derived};
use teachtree_base::hands::Side;
use teachtree_base::units::Dimension;
use teachtree_frames::frames::{ColumnKey, Frames};

/// A derived channel as the rules ask for it.
fn ask(name: &str) -> ChannelSpec {
    let known = derived(name).unwrap();
    ChannelSpec {
        name: name.into(),
        per_hand: known.per_hand,
        axis: known.axis,
        shape: known.shape,
        dimension: known.dimension,
        absent: Fallback::Derived,
    }
}

/// `fingers.contact` with the default of the paper's hands.
fn ask_contact() -> ChannelSpec {
    ChannelSpec {
        absent: Fallback::NormAbove { channel: "fingers.force".into(), on: 0.05, off: 0.02, needed: true },
        ..ask_fingers("contact", Shape::Bool, Dimension::NONE)
    }
}

/// A channel over fingers that the log must have.
fn ask_fingers(quantity: &str, shape: Shape, dimension: Dimension) -> ChannelSpec {
    ChannelSpec {
        name: format!("fingers.{quantity}"),
        per_hand: true,
        axis: Some(Axis::Fingers),
        shape,
        dimension,
        absent: Fallback::Refused,
    }
}

/// A component of a channel of the right hand, or of the recording.
fn column<'f>(frames: &'f Frames, name: &str, slot: u32, component: u32) -> &'f [f64] {
    let channel = frames.channel(name).unwrap();
    let side = frames.channels[channel as usize].per_hand.then_some(Side::Right);
    frames.column(ColumnKey { channel, side, slot, component }).unwrap()
}
