//! The evaluators: frames in, labels out. They read no clock and no file.

pub mod bits;
mod buffers;
pub mod columns;
pub mod evaluator;
mod kernels;
pub mod machine;
pub mod open;
pub mod plan;
pub mod probe;
mod ranks;
pub mod reference;
pub mod runs;
pub mod stepper;
pub mod width;
