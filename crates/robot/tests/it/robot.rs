//! Tests of `robot`: files, kinematics against finite differences and round trips.

mod certifying;
mod clearance;
mod clock;
mod files;
mod gaps;
mod grasp_quality;
mod grasping;
mod gripper;
mod kinematics;
mod meshes;
mod motion;
mod passing;
mod recorded_joints;
mod searching;
mod steps;
mod timing;
mod two_hands;
mod urdf;
mod varied;
