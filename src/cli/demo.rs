//! `teachtree demo`: the chapter's experiment (section 3.2): taught, analysed, commanded, carried out by a robot, and reported.

use super::analyze::{analyse, timeline};
use super::command::{open_robot, summary};
use super::rules::{RuleArgs, load};
use super::simulate::{perform, told};
use super::teach::record;
use super::{Failure, output};
use crate::analysis::Analysis;
use crate::analysis::json::json;
use crate::command;
use crate::report;
use crate::robot;
use crate::stream::{self, OpenRequest, csv};
use std::path::PathBuf;

/// The chapter's box, and its operator of section 3.2.
const SCENE: &str = "paper_box";
const OPERATOR: &str = "paper_box";
/// Who carries it out.
const ROBOT: &str = "both_hands";

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

    // From what was done to a robot that does it.
    let robot = open_robot(ROBOT)?;
    let scene = &opened.recording.scene;
    let mut commands = command::commands(&opened.recording, &analysed.analysis, &analysed.meta.log)?;
    robot::map(&mut commands, &robot, scene)?;
    let commanded = args.out.join("commands.json");
    output::write(&commanded, &commands.json()?, &[])?;
    output::print(&format!("\ncommands for the robot `{ROBOT}`\n{}", summary(&commands)))?;
    let (recording, outcomes) = perform(&commands, &robot, scene)?;
    let performed = args.out.join("robot.csv");
    csv::write(&recording, &performed)?;
    output::print(&format!("\nthe robot\n{}", told(&outcomes)))?;
    let opened_again = stream::open(&OpenRequest { log: performed, ..OpenRequest::default() })?;
    let again = analyse(&rules, &opened_again, None, Vec::new())?;
    let tasks = |analysis: &Analysis| -> Vec<String> {
        analysis.tracks.iter().flat_map(|track| &track.tasks).map(|task| task.task.clone()).collect()
    };
    let (taught, performed) = (tasks(&analysed.analysis), tasks(&again.analysis));
    let same = if taught == performed { "the same tasks" } else { "other tasks" };
    output::print(&format!("its recording has {same} by the same rules: {}\n", performed.join(", ")))?;

    let files = [&opened.log, &analysis, &report, &commanded, &opened_again.log].map(|path| path.display().to_string());
    output::print(&format!("\nwritten: {}\n", files.join(", ")))?;
    Ok(())
}
