//! `teachtree demo`: the paper's experiment with one hand (section 3.2) or with both (section 4.3): demonstrated, analyzed, reported, and carried out by
//! a robot.

use super::analyze::timeline;
use super::retarget::{open_robot, summary, touch_forces};
use super::simulate::perform;
use super::teach::record;
use super::{Failure, output};
use std::path::{Path, PathBuf};
use teachtree_base::recording::Recording;
use teachtree_command as command;
use teachtree_frames::OpenRequest;
use teachtree_logs::atomic_write::Files;
use teachtree_logs::read::csv;
use teachtree_robot as robot;
use teachtree_robot::simulation::CellVariation;
use teachtree_robot_report::{format_performance, page};
use teachtree_session::{Analysis, Log, Rules, Track};
use teachtree_session::{AnalysisInternals, LogInternals};

/// The paper's box of section 3.2; the hand-over of section 4.3. Each is a scene and its operator.
const ONE_HAND: &str = "paper_box";
const BOTH_HANDS: &str = "hand_over_left_to_right";
/// Who carries it out.
const ROBOT: &str = "both_hands";

#[derive(clap::Args)]
pub struct Args {
    /// The left hand picks up a box and passes it to the right hand, which puts it down
    #[arg(long)]
    both_hands: bool,
    /// Output folder; by default `teachtree-demo`, or `teachtree-demo-both-hands`
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
    // All files of the folder belong together, and are put there together.
    let mut files = Files::default();
    let opened = add(&mut files, &record(shown, shown, args.seed)?, &log)?;
    let analysis = Rules::for_log(&opened)?.analyze(&opened)?;
    let document = folder.join("analysis.json");
    output::add(&mut files, &document, &analysis.json(), &[])?;
    let report = folder.join("report.html");
    output::add(&mut files, &report, &analysis.html()?, &[])?;
    output::print(&timeline(&analysis, true))?;

    let mut written = vec![log, document, report];
    written.extend(carry_out(&mut files, folder, &analysis)?);
    files.commit()?;
    let written: Vec<String> = written.iter().map(|path| path.display().to_string()).collect();
    output::print(&format!("\nwritten: {}\n", written.join(", ")))?;
    Ok(())
}

/// Adds a recording to the files, and opens it as its log will be read.
fn add(files: &mut Files, recording: &Recording, log: &Path) -> Result<Log, Failure> {
    csv::add(files, recording, log)?;
    let request = OpenRequest { log: log.to_path_buf(), ..OpenRequest::default() };
    Ok(Log::open_source(csv::source(recording, log)?, &request)?)
}

/// From what was done to a robot that does it; the files that were written.
fn carry_out(files: &mut Files, folder: &Path, analysis: &Analysis) -> Result<[PathBuf; 3], Failure> {
    let (robot, _) = open_robot(ROBOT)?;
    let opened = analysis.log().opened()?;
    let scene = &opened.recording.scene;
    let touch = touch_forces(analysis.rules());
    let mut commands = command::commands(&opened.trusted()?, analysis.found(), touch, &analysis.log().name())?;
    robot::map(&mut commands, &robot, scene)?;
    let commanded = folder.join("commands.json");
    output::add(files, &commanded, &commands.json()?, &[])?;
    output::print(&format!("\ncommands for the robot `{ROBOT}`\n{}", summary(&commands)))?;
    let performed = perform(&commands, &robot, scene, &CellVariation::default())?;
    let recording = folder.join("robot.csv");
    let performed_log = add(files, &performed.recording, &recording)?;
    let replay = folder.join("robot.html");
    output::add(files, &replay, &page(&commands, &performed), &[])?;
    output::print(&format!("\nthe robot\n{}", format_performance(&performed)))?;
    let again = analysis.rules().analyze(&performed_log)?;
    let tasks = |analysis: &Analysis| -> Vec<String> {
        analysis.tracks().flat_map(Track::tasks).map(|task| task.name().to_string()).collect()
    };
    let (demonstrated, found) = (tasks(analysis), tasks(&again));
    let same = if demonstrated == found { "the same tasks" } else { "other tasks" };
    output::print(&format!("its recording has {same} by the same rules: {}\n", found.join(", ")))?;
    Ok([commanded, recording, replay])
}
