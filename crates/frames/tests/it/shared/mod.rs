//! What the tests of the program use too.

pub mod bags;
pub mod files;
pub mod folders;
pub mod recordings;
pub mod samples;
