//! `teachtree demo`: the chapter's experiment with one hand (section 3.2) or with both (section 4.3), from the virtual environment to the report.

use super::analyze::{analyse, timeline};
use super::rules::{RuleArgs, load};
use super::teach::record;
use super::{Failure, output};
use crate::analysis::json::json;
use crate::report;
use crate::stream::{self, OpenRequest, csv};
use std::path::PathBuf;

/// The chapter's box of section 3.2; the hand-over of section 4.3. Each is a scene and its operator.
const ONE_HAND: &str = "paper_box";
const BOTH_HANDS: &str = "hand_over_left_to_right";

/// Options of `demo`.
#[derive(clap::Args)]
pub struct Args {
    /// The left hand picks up a box and passes it to the right hand, which puts it down
    #[arg(long)]
    both_hands: bool,
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
    let shown = if args.both_hands { BOTH_HANDS } else { ONE_HAND };
    csv::write(&record(shown, shown, args.seed)?, &log)?;
    // The log is opened as anybody would open it: what is analysed is what was written.
    let opened = stream::open(&OpenRequest { log, ..OpenRequest::default() })?;
    let rules = load(&RuleArgs::default(), &opened)?;
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
