//! The model of a robot: links, joints, hands and grippers, and the files that describe them.

pub(crate) mod file;
pub mod gripper;
pub mod hand;
pub(crate) mod limits;
pub mod robot;
pub(crate) mod shipped;
mod subchain;
mod urdf;
