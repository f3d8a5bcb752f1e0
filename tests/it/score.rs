//! Tests of `analysis::score`, of label files and of the command.

mod agree;
mod build;
mod command;
mod labels;
mod measures;
mod names;
mod property;
mod round_trips;
mod tasks;
mod written;
