//! The evaluators: frames in, labels out. They read no clock and no file.

pub mod runs;
