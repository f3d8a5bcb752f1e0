//! `teachtree graph`: the decision graph as text.

use super::rules::load_files;
use super::{Failure, output};
use crate::graph::{lower, text};
use std::path::PathBuf;

/// Options of `graph`.
#[derive(clap::Args)]
pub struct Args {
    /// Rule files; the shipped `contact.rules` when left out
    files: Vec<PathBuf>,
}

/// Runs `graph`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let rules = load_files(&args.files, None)?;
    output::print(&text(&lower(&rules)))?;
    Ok(())
}
