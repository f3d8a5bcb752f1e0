//! Teleoperation: a page on this machine in which a person moves hands in the virtual environment, and an interface for haptic devices.
//!
//! `servo` steps the world at 1 kHz of real time in its own thread, and is the only file of this crate that reads a clock. `socket` receives inputs of hands
//! and sends forces and states, in the messages of `protocol`; `labels` runs the rules on the current recording; `take_jobs` writes recordings and runs the
//! robot on them; `routes` has the files of the page, and `camera` those of the hand tracker.
//!
//! Invariants: the servo does not wait for other threads. Messages from a socket do not make memory grow: a later message replaces an earlier one.

mod camera;
mod input;
mod labels;
mod options;
mod protocol;
mod punctuality;
mod routes;
mod servo;
mod shared_state;
mod socket;
mod take_jobs;
mod takes;
mod threads;
mod tracks;

pub use camera::HandFinder;
pub use options::Options;
pub use punctuality::Punctuality;
pub use routes::TeachingPage;
pub use shared_state::Teaching;
pub use takes::RobotResult;
pub use threads::begin;
