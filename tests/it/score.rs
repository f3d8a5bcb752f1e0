//! Tests of `analysis::score`, of label files and of the command.

#[cfg(feature = "cli")]
mod agree;
mod build;
#[cfg(feature = "world")]
mod command;
mod labels;
mod measures;
mod names;
mod property;
#[cfg(all(feature = "cli", feature = "parquet"))]
mod round_trips;
mod tasks;
mod written;
