//! The model of a robot: its tree of links with hands and grippers, and the files that describe them.

pub(crate) mod file;
pub mod gripper;
pub mod hand;
mod massless;
pub(crate) mod mesh;
pub mod robot;
pub(crate) mod shipped;
mod subchain;
