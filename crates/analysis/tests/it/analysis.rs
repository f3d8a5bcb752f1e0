//! Tests of `analysis`: leaves in, named tasks and what operators see of them out.

mod both_hands;
pub mod build;
mod lints;
mod one_hand;
mod property;
mod relabeling;
