//! Robots that the program simulates.

mod causes;
mod certified;
mod collisions;
mod falls;
mod files;
mod forces;
mod goals;
mod gripper;
mod passing;
mod recognized;
mod refused;
mod searching;
mod two_hands;
mod varied;

use teachtree_robot::{self as robot, Robot};

fn shipped(name: &str) -> Robot {
    robot::open(name, &|part| panic!("{part} is not shipped")).unwrap()
}
