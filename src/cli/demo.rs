//! `teachtree demo`: the chapter's experiment (section 3.2), from the virtual environment to the report.

use super::analyze::{analyse, timeline};
use super::rules::{RuleArgs, load};
use super::teach::record;
use super::{Failure, output};
use crate::analysis::json::json;
use crate::report;
use crate::stream::{self, OpenRequest, csv};
use std::path::PathBuf;

/// The chapter's box, and its operator of section 3.2.
const SCENE: &str = "paper_box";
const OPERATOR: &str = "paper_box";

/// Options of `demo`.
#[derive(clap::Args)]
pub struct Args {
    /// The folder to write
    #[arg(long, value_name = "DIR", default_value = "teachtree-demo")]
    out: PathBuf,
    /// The person who teaches
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Runs `demo`.
pub fn run(args: &Args) -> Result<(), Failure> {
    output::make_folder(&args.out)?;
    let log = args.out.join("demonstration.csv");
    csv::write(&record(SCENE, OPERATOR, args.seed)?, &log)?;
    // The log is opened as anybody would open it: what is analysed is what was written.
    let opened = stream::open(&OpenRequest { log, ..OpenRequest::default() })?;
    let rules = load(&RuleArgs::default(), None, &[])?;
    let analysed = analyse(&rules, &opened, None, Vec::new())?;
    let analysis = args.out.join("analysis.json");
    output::write(&analysis, &json(&analysed.analysis, &analysed.meta), &[])?;
    let report = args.out.join("report.html");
    let page = report::html(&analysed.analysis, &analysed.frames, &analysed.meta);
    output::write(&report, &page, &[])?;
    output::print(&timeline(&analysed, true))?;
    output::print(&format!("\nwritten: {}, {}, {}\n", opened.log.display(), analysis.display(), report.display()))?;
    Ok(())
}
