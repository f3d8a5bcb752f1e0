//! Tests of `analysis`: leaves in, named tasks and what people see of them out.

mod both_hands;
mod build;
mod one_hand;
mod relabelling;
mod written;
