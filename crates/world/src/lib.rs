//! The virtual environment: scenes, rigid bodies, fingertip contact, operators, and the recording they make.
//!
//! A [`base::scene::Scene`](teachtree_base::scene::Scene) goes in, and step by step the targets of the fingertips; forces, poses and contacts come out
//! ([`World`]). Nothing here knows a rule or a file.

mod bodies;
mod by_hand;
mod convert;
mod moving;
mod operator;
mod recorder;
mod rolling;
mod shapes;
pub mod shipped;
mod simulation;
mod sockets;
mod teach;
mod thread;
mod touch;
mod truth;

pub use bodies::BodyContact;
pub use by_hand::{ByHand, FARTHEST_M, HandInput, MOST_FORCE_N, MOST_STEPS, Taken, WATCHDOG_STEPS};
pub use operator::schema as operator_schema;
pub use operator::{
    Along, Bring, Carry, Close, ForceNoise, Goal, Grip, Insert, Measured, Occasions, Open, Operator, Perturbation,
    Press, Reach, Script, Slip, Step, Together, Tremor, Turn, Until, Variation, Withdraw,
};
pub use recorder::recorded;
pub use shipped::{operator, scene};
pub use simulation::{
    BodyState, Coupling, Fingertips, HandMover, HandState, HandTarget, MovedHand, MovedTip, Mover, Observation, Pushed,
    STEP_S, TipState, TipTouch, World,
};
pub use teach::{teach, teach_with_progress};
pub use touch::TouchLaw;
pub use truth::{lets_go, sets_out};
