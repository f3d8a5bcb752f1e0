//! Tests of the commands `score` and `agree`.

mod agree;
mod command;
mod round_trips;
