//! Tests of `robot`: files, kinematics against finite differences and round trips.

mod causes;
mod clock;
mod collisions;
mod falls;
mod files;
mod forces;
mod goals;
mod grasping;
mod gripper;
mod kinematics;
mod meshes;
mod motion;
mod passing;
mod recognized;
mod refused;
mod searching;
mod steps;
mod timing;
mod two_hands;
