//! Tests of `analysis::score` and of the agreement of two people.

mod agree;
mod build;
mod measures;
mod names;
mod property;
mod tasks;
