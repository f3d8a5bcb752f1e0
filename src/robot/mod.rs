//! Robots: their files, their kinematics, and how their hands take hold of what a person held.
//!
//! A robot file becomes a [`Robot`], a tree of links with hands on it. Nothing here knows a rule, and nothing opens a file:
//! whoever reads robots hands their texts in.

pub mod arm;
mod around;
pub mod clock;
mod closed;
pub mod control;
mod curves;
mod doer;
pub mod dynamics;
pub mod executor;
mod falls;
pub mod file;
mod firmness;
pub mod grasp;
mod grip;
pub mod hand;
pub mod jaws;
mod limb;
mod log;
mod mapping;
mod others;
mod pair;
pub mod passing;
pub mod plan;
pub mod profile;
mod righting;
pub mod searching;
mod shipped;
pub mod simulate;
pub mod spiral;
mod stage;
pub mod timing;
pub mod trace;
pub mod trajectory;
pub mod tree;
mod urdf;

pub use file::{MAX_BYTES, open, read};
pub use grasp::{Grasp, Mapper};
pub use hand::{Angles, FingerModel, HandModel, MAX_DOFS, Posture, REACHED_M, Reached};
pub use jaws::{Jaw, Jaws};
pub use mapping::map;
pub use shipped::names;
pub use tree::{Dof, Joint, Kind, Link, Robot, Solid};
