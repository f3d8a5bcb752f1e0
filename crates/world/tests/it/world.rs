//! Tests of `world`: physics against closed forms, then the demonstrations that come out of it.

mod bodies;
mod by_hand;
mod demonstration;
mod failures;
mod insertion;
mod person;
mod scaling;
mod scripts;
mod support;
mod touch;
