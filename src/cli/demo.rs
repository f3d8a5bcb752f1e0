//! `teachtree demo`: the chapter's experiment with one hand (section 3.2) or with both (section 4.3): taught, analysed, reported, and carried out by
//! a robot.

use super::analyze::timeline;
use super::retarget::{open_robot, summary, touch_forces};
use super::simulate::{perform, told, told_nearest};
use super::teach::record;
use super::{Failure, output};
use crate::command;
use crate::report;
use crate::robot;
use crate::robot::simulation::Performance;
use crate::session::{Analysis, Log, Rules, Track};
use crate::stream::csv;
use std::path::{Path, PathBuf};

/// The chapter's box of section 3.2; the hand-over of section 4.3. Each is a scene and its operator.
const ONE_HAND: &str = "paper_box";
const BOTH_HANDS: &str = "hand_over_left_to_right";
/// Who carries it out.
const ROBOT: &str = "both_hands";

#[derive(clap::Args)]
pub struct Args {
    /// The left hand picks up a box and passes it to the right hand, which puts it down
    #[arg(long)]
    both_hands: bool,
    /// The folder to write; `teachtree-demo`, or `teachtree-demo-both-hands`, when left out
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Random seed of the simulated operator
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let usual = if args.both_hands { "teachtree-demo-both-hands" } else { "teachtree-demo" };
    let folder = args.out.as_deref().unwrap_or(Path::new(usual));
    output::make_folder(folder)?;
    let log = folder.join("demonstration.csv");
    let shown = if args.both_hands { BOTH_HANDS } else { ONE_HAND };
    csv::write(&record(shown, shown, args.seed)?, &log)?;
    // The log is opened as anybody would open it: what is analysed is what was written.
    let opened = Log::open(&log)?;
    opened.read()?;
    let analysis = Rules::for_log(&opened)?.analyze(&opened)?;
    let document = folder.join("analysis.json");
    output::write(&document, &analysis.json(), &[])?;
    let report = folder.join("report.html");
    output::write(&report, &analysis.html()?, &[])?;
    output::print(&timeline(&analysis, true))?;

    let mut files = vec![log, document, report];
    files.extend(carry_out(folder, &analysis)?);
    let files: Vec<String> = files.iter().map(|path| path.display().to_string()).collect();
    output::print(&format!("\nwritten: {}\n", files.join(", ")))?;
    Ok(())
}

/// From what was done to a robot that does it; the files that were written.
fn carry_out(folder: &Path, analysis: &Analysis) -> Result<[PathBuf; 3], Failure> {
    let (robot, _) = open_robot(ROBOT)?;
    let opened = analysis.log().opened()?;
    let scene = &opened.recording.scene;
    let touch = touch_forces(analysis.rules());
    let mut commands = command::commands(&opened.trusted()?, analysis.found(), touch, &analysis.log().name())?;
    robot::map(&mut commands, &robot, scene)?;
    let commanded = folder.join("commands.json");
    output::write(&commanded, &commands.json()?, &[])?;
    output::print(&format!("\ncommands for the robot `{ROBOT}`\n{}", summary(&commands)))?;
    let Performance { recording, outcomes, nearest, trace } = perform(&commands, &robot, scene)?;
    let performed = folder.join("robot.csv");
    csv::write(&recording, &performed)?;
    let page = folder.join("robot.html");
    output::write(&page, &report::robot::page(&commands, &trace, &outcomes), &[])?;
    output::print(&format!("\nthe robot\n{}{}", told(&outcomes), told_nearest(nearest.as_ref())))?;
    let again = analysis.rules().analyze(&Log::open(&performed)?)?;
    let tasks = |analysis: &Analysis| -> Vec<String> {
        analysis.tracks().flat_map(Track::tasks).map(|task| task.name().to_string()).collect()
    };
    let (taught, found) = (tasks(analysis), tasks(&again));
    let same = if taught == found { "the same tasks" } else { "other tasks" };
    output::print(&format!("its recording has {same} by the same rules: {}\n", found.join(", ")))?;
    Ok([commanded, performed, page])
}
