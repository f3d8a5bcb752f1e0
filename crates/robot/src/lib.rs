//! Robots: their files, their kinematics, and how their hands take hold of what the operator held.
//!
//! A robot file becomes a [`Robot`], a tree of links with hands on it. Nothing here knows a rule, and nothing opens a file:
//! callers pass the texts of robot files in.
//!
//! The directories are layers, and each names only those before it:
//! [`kinematics`], [`model`], [`dynamics`], [`grasp`], [`planning`], [`control`], [`simulation`], [`certificate`].

pub mod certificate;
pub mod control;
pub mod dynamics;
pub mod grasp;
pub mod kinematics;
pub mod model;
mod parallel;
pub mod planning;
pub mod simulation;

pub use grasp::{GraspCandidate, GraspPlanner};
pub use kinematics::finger::{FingerModel, FingerPose};
pub use kinematics::joint_positions::{IkSolution, JointPositions, MAX_DOFS, REACHED_M};
pub use model::file::read;
pub use model::file::schema;
pub use model::file::{MAX_BYTES, open, open_with_meshes};
pub use model::gripper::{Jaw, Jaws};
pub use model::hand::HandModel;
pub use model::mesh::MAX_BYTES as MAX_MESH_BYTES;
pub use model::robot::Robot;
pub use model::shipped::{names, texts};
pub use planning::handover_grasps::{map, map_by};
pub use planning::rollout::{Conflicts, Crossing, Unreachable};
pub use planning::validation::validate;
pub use teachtree_description::mesh::Mesh;
pub use teachtree_description::polytope::Polytope;
pub use teachtree_description::shape::CollisionShape;
pub use teachtree_description::tree::{Dof, Joint, JointKind, KinematicTree, Link};
pub use teachtree_description::urdf::Oddity;
