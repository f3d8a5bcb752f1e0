//! Tests of `robot`: files, kinematics against finite differences and round trips.

mod files;
mod grasping;
mod kinematics;
mod motion;
