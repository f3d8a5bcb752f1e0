//! Certificates: a box of cell variations in which a robot program succeeds, with a statistical bound on its success rate.
//!
//! Nothing here simulates: the caller runs variations ([`Runner`]).

pub mod binomial;
pub mod cell_box;
pub mod quantities;
pub mod search;

pub use cell_box::{CellBox, Face};
pub use quantities::{CellQuantity, QUANTITIES};
pub use search::{Certificate, CertificationFailure, FaceReport, Limits, Runner, Stop, certify};
