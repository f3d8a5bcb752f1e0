//! Logs that the program reads.

mod bindings;
mod formats;
mod gripper_wrist;
mod jumps;
mod learned;
mod levels;
mod untuned;
