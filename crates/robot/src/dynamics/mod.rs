//! Dynamics: the motion of a robot under torques.

pub mod motion;
