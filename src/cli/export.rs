//! `teachtree export`: recordings as a data set of another program.

mod bag;
mod cut;
mod lerobot;

use super::Failure;

/// The data sets that can be written.
#[derive(clap::Subcommand)]
pub enum Target {
    /// A LeRobot set of version 3.0, from bags of ROS 1 and ROS 2 and MCAP files
    Lerobot(lerobot::Args),
}

/// Runs `export`.
pub fn run(target: &Target) -> Result<(), Failure> {
    match target {
        Target::Lerobot(args) => lerobot::run(args),
    }
}
