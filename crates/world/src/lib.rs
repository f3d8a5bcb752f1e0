//! The virtual environment: scenes, rigid bodies, fingertip contact, operators, and the recording they make.
//!
//! A [`base::scene::Scene`](teachtree_base::scene::Scene) goes in, and step by step the targets of the fingertips; forces, poses and contacts come out
//! ([`World`]). Nothing here knows a rule or a file.

mod bodies;
mod body_dynamics;
mod conversion;
mod demonstration;
mod operator;
mod recorder;
mod rolling_contact;
mod screw_thread;
mod shapes;
pub mod shipped;
mod simulation;
mod sockets;
mod teleop;
mod touch;
mod truth;

pub use bodies::BodyContact;
pub use demonstration::{teach, teach_with_progress};
pub use operator::schema as operator_schema;
pub use operator::{
    Bring, Carry, Close, Collide, Cooperation, Failure, FailurePlan, ForceNoise, Goal, Grip, Insert, Jam,
    MeasurementSpec, Occasions, Open, Operator, Perturbation, Press, Reach, Script, Slip, Step, StopContact, Tremor,
    Turn, Variation, WallPress, Withdraw,
};
pub use recorder::recorded;
pub use shipped::{operator, scene};
pub use simulation::{
    BodyState, Coupling, Fingertips, HandMotion, HandMover, HandState, HandTarget, Mover, Observation, STEP_S,
    TipMotion, TipState, TipTouch, TipWrench, World,
};
pub use teleop::{FARTHEST_M, HandInput, MOST_FORCE_N, MOST_STEPS, RawRecording, TeleopWorld, WATCHDOG_STEPS};
pub use touch::TouchLaw;
pub use truth::{ends_task, sets_out};
