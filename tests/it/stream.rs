//! Tests of `logs` and `frames`: logs in, frames out.

mod bad_logs;
mod bindings;
mod campaign;
mod channel_names;
mod constants;
mod convex;
mod derived;
pub mod formats;
mod gripper_wrist;
mod implausible;
mod jumps;
mod learned;
mod levels;
mod live_rows;
mod never_panics;
mod robosuite;
mod robots;
mod round_trip;
mod targets;
mod touch;

use teachtree_base::channels::{Axis, ChannelSpec, Fallback, Shape, derived};
use teachtree_base::hands::Side;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::units::Dimension;
use teachtree_base::yaml;
use teachtree_frames::frames::{ColumnKey, Frames};
use teachtree_logs::names;

/// A recording of `rows` samples at `rate` Hz in this scene; columns by canonical name, each a function of time.
fn recording(scene: &str, rate: f64, rows: usize, columns: &[(&str, &dyn Fn(f64) -> f64)]) -> Recording {
    let time: Vec<f64> = (0..rows).map(|row| row as f64 / rate).collect();
    let column = |(name, value): &(&str, &dyn Fn(f64) -> f64)| {
        let dimension = names::meaning(name).map_or(Dimension::NONE, |meaning| meaning.dimension);
        ((*name).to_string(), Column { dimension, values: time.iter().map(|t| value(*t)).collect() })
    };
    Recording {
        columns: columns.iter().map(column).collect(),
        scene: yaml::read(scene, "scene").unwrap(),
        time,
        ..Recording::default()
    }
}

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

/// A component of a channel of the right hand, or of nobody.
fn column<'f>(frames: &'f Frames, name: &str, slot: u32, component: u32) -> &'f [f64] {
    let channel = frames.channel(name).unwrap();
    let side = frames.channels[channel as usize].per_hand.then_some(Side::Right);
    frames.column(ColumnKey { channel, side, slot, component }).unwrap()
}
