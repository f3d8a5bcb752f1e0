//! The virtual environment as the program uses it.

mod by_hand;
#[path = "../../crates/world/tests/it/world/person.rs"]
#[allow(dead_code, reason = "the tests of `world` use all of it")]
mod person;
mod scaling;
