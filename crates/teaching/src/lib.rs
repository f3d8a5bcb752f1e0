//! Teaching by hand: a page on this machine in which a person moves hands in the virtual environment, and an interface for haptic devices.
//!
//! `servo` steps the world at 1 kHz of real time in a thread of its own, and is the only file of this crate that reads a clock. `socket` takes what hands
//! are asked for and sends what is felt and seen, in the messages of `protocol`; `labels` runs the rules on what is being recorded; `take_jobs` writes recordings
//! and lets the robot perform them; `routes` has the files of the page, and `camera` those that find hands in pictures.
//!
//! Invariants: the servo does not wait for other threads, and nothing that comes from a socket makes memory grow: a later message replaces an earlier one.

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
