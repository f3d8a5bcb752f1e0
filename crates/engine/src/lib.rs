//! The evaluators: frames in, leaves out. They read no clock and no file.
//!
//! `reference` follows the meaning of a run literally and is the definition; `compiled` evaluates whole logs block by block; `live` takes one frame at a
//! time. `inspect` gives the value of any expression after a run. Their common parts are in `semantics` and `runs`.

pub mod compiled;
pub mod inspect;
pub mod live;
pub mod reference;
pub mod runs;
pub mod semantics;
pub mod summary;
pub mod temporal_state;

pub use compiled::evaluator;
