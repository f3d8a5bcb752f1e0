//! Grasp mapping: demonstrated contact points in, palm pose and finger angles of a robot hand out.
//!
//! Over the pose of the palm in the frame of the object, the geometric mean of the fingers' measures is made as large as possible
//! (docs/sources.md, Grasp mapping; the paper's section 2.6 only says that the pose maximises manipulability at the demonstrated contact points):
//!
//! ```text
//! W(T) = (Π_i w_i / L_i³ · p_i)^(1/n)        w: Yoshikawa's manipulability, L: length of the finger, p: freedom from joint limits
//! ```
//!
//! with every fingertip ball touching its contact point. Hand, object and obstacles must be clear of each other, fingers uncrossed and pads
//! turned to the surface; what is violated costs its square, and what is out of reach costs its distance, so that the search has a slope
//! everywhere. At the end all of it is checked on the exact shapes. A gripper, whose jaws have no manipulability, is mapped in closed form (`two_finger`).

mod bimanual_grasp;
mod candidate;
mod clearance;
mod clearance_field;
mod cost;
mod gradient;
mod grasp_planner;
mod grasp_request;
mod gripper_contacts;
mod hand_obstacles;
pub(crate) mod held_path;
mod no_grasp;
mod obstacles;
mod penalty;
mod search;
mod seeds;
mod spheres;
pub(crate) mod task_grasps;
mod two_finger;

pub use candidate::{FingerPlacement, GraspCandidate, Reach};
pub use clearance::Clearance;
pub use cost::SearchEffort;
pub use grasp_planner::GraspPlanner;
pub use grasp_request::{CLEAR_M, Contact, GraspRequest, LARGEST_PAD_ANGLE, LARGEST_PUSHING_ANGLE, Obstacle};
pub use no_grasp::NoGrasp;
