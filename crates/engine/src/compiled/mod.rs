//! The compiled evaluator: a graph is instantiated for the slots of a log (`instantiate`), which gives a `plan`; `columns` evaluates its numbers and
//! conditions a block of frames at a time, `machine` its stateful nodes and trees.

pub mod bits;
mod buffers;
pub mod columns;
pub mod evaluator;
pub mod instantiate;
mod kernels;
pub mod machine;
pub mod plan;
