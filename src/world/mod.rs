//! The virtual environment: scenes, rigid bodies, fingertip contact, operators, and the recording they make.
//!
//! A [`base::scene::Scene`](crate::base::scene::Scene) goes in, and step by step the targets of the fingertips; forces, poses and contacts come out
//! ([`World`]). Nothing here knows a rule or a file.

mod bodies;
mod convert;
mod shapes;
mod simulation;
mod touch;

pub use bodies::BodyContact;
pub use simulation::{
    BodyState, Coupling, Fingertips, HandState, HandTarget, Observation, STEP_S, TipState, TipTouch, World,
};
pub use touch::TouchLaw;
