//! `teachtree demo`: the chapter's experiment with one hand (section 3.2) or with both (section 4.3): taught, analysed, reported, and carried out by
//! a robot.

use super::analyze::{Analysed, analyse, timeline};
use super::command::{open_robot, summary};
use super::rules::{RuleArgs, load};
use super::simulate::{perform, told, told_nearest};
use super::teach::record;
use super::{Failure, output};
use crate::analysis::Analysis;
use crate::analysis::json::json;
use crate::command;
use crate::language::Rules;
use crate::report;
use crate::robot;
use crate::robot::simulate::Performance;
use crate::stream::{self, OpenRequest, Opened, csv};
use std::path::PathBuf;

/// The chapter's box of section 3.2; the hand-over of section 4.3. Each is a scene and its operator.
const ONE_HAND: &str = "paper_box";
const BOTH_HANDS: &str = "hand_over_left_to_right";
/// Who carries it out.
const ROBOT: &str = "both_hands";

/// Options of `demo`.
#[derive(clap::Args)]
pub struct Args {
    /// The left hand picks up a box and passes it to the right hand, which puts it down
    #[arg(long)]
    both_hands: bool,
    /// The folder to write
    #[arg(long, short, value_name = "DIR", default_value = "teachtree-demo")]
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
    let page = report::html(&analysed.explained(&rules), &opened.recording, &analysed.meta)?;
    output::write(&report, &page, &[])?;
    output::print(&timeline(&analysed, true))?;

    let mut files = vec![opened.log.clone(), analysis, report];
    files.extend(carry_out(args, &opened, &rules, &analysed)?);
    let files: Vec<String> = files.iter().map(|path| path.display().to_string()).collect();
    output::print(&format!("\nwritten: {}\n", files.join(", ")))?;
    Ok(())
}

/// From what was done to a robot that does it; the files that were written.
fn carry_out(args: &Args, opened: &Opened, rules: &Rules, analysed: &Analysed) -> Result<[PathBuf; 3], Failure> {
    let (robot, _) = open_robot(ROBOT)?;
    let scene = &opened.recording.scene;
    let mut commands = command::commands(&opened.trusted()?, &analysed.analysis, &analysed.meta.log)?;
    robot::map(&mut commands, &robot, scene)?;
    let commanded = args.out.join("commands.json");
    output::write(&commanded, &commands.json()?, &[])?;
    output::print(&format!("\ncommands for the robot `{ROBOT}`\n{}", summary(&commands)))?;
    let Performance { recording, outcomes, nearest, trace } = perform(&commands, &robot, scene)?;
    let performed = args.out.join("robot.csv");
    csv::write(&recording, &performed)?;
    let page = args.out.join("robot.html");
    output::write(&page, &report::robot::page(&commands, &trace, &outcomes), &[])?;
    output::print(&format!("\nthe robot\n{}{}", told(&outcomes), told_nearest(nearest.as_ref())))?;
    let opened = stream::open(&OpenRequest { log: performed, ..OpenRequest::default() })?;
    let again = analyse(rules, &opened, None, Vec::new())?;
    let tasks = |analysis: &Analysis| -> Vec<String> {
        analysis.tracks.iter().flat_map(|track| &track.tasks).map(|task| task.task.clone()).collect()
    };
    let (taught, performed) = (tasks(&analysed.analysis), tasks(&again.analysis));
    let same = if taught == performed { "the same tasks" } else { "other tasks" };
    output::print(&format!("its recording has {same} by the same rules: {}\n", performed.join(", ")))?;
    Ok([commanded, opened.log, page])
}
