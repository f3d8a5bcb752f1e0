//! Grasp mapping: demonstrated contact points in, palm pose and finger angles of a robot hand out.
//!
//! Over the pose of the palm in the frame of the object, the quality of the grasp is maximized (docs/sources.md, Grasp mapping; section 2.6 of Kawasaki et al. (2014)
//! only says that the pose maximizes manipulability at the demonstrated contact points):
//!
//! ```text
//! W(T) = (Π_i w_i / L_i³ · p_i · a_i)^(1/n) · (1 - μ / μ₀)
//! ```
//!
//! with Yoshikawa's manipulability w, the length L of the finger, its freedom p from joint limits, the alignment a of its pad with the surface, and the friction μ
//! that the contacts need of the assumed one μ₀. All factors are dimensionless and have the exponent 1. The last factor depends on the contacts alone, so the search
//! leaves it out.
//!
//! Every fingertip ball touches its contact point. Hand, object and obstacles must be clear of each other, fingers must not cross, and pads must face the surface. A
//! violation costs its square and a missing distance is linear, so the cost has a gradient everywhere. The result is checked on the exact shapes. A gripper, whose
//! jaws have no manipulability, is mapped in closed form (`two_finger`).

mod bimanual_grasp;
mod candidate;
mod clearance;
mod clearance_field;
mod cost;
mod friction_margin;
mod gradient;
mod grasp_planner;
mod grasp_request;
mod gripper_contacts;
mod hand_obstacles;
pub(crate) mod held_path;
mod no_grasp;
mod obstacles;
pub(crate) mod opening;
mod pad_alignment;
mod penalty;
mod search;
mod seeds;
mod spheres;
pub(crate) mod task_grasps;
mod two_finger;

pub use candidate::{FingerPlacement, GraspCandidate, Reach};
pub use clearance::Clearance;
pub use cost::SearchEffort;
pub use friction_margin::{friction_margin, friction_needed};
pub use grasp_planner::GraspPlanner;
pub use grasp_request::{CLEAR_M, Contact, GraspRequest, LARGEST_PAD_ANGLE, LARGEST_PUSHING_ANGLE, Obstacle};
pub use no_grasp::NoGrasp;
pub use pad_alignment::pad_alignment;
