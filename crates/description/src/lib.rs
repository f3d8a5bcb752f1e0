//! Robot descriptions: trees of links and joints with their forward kinematics, and URDF, the format that describes them.

mod box_gap;
pub mod limits;
pub mod mesh;
pub mod polytope;
pub mod shape;
pub mod tree;
pub mod urdf;
