//! Tests of `robot`: files, kinematics against finite differences and round trips.

mod files;
mod kinematics;
mod motion;
