//! `teachtree simulate`: commands in, the recording of the robot that carried them out.

use super::output_args::FormatArg;
use super::progress::Progress;
use super::robot_program::{FailOn, Program, ProgramArgs};
use super::{Failure, output};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use teachtree_analysis::UNKNOWN;
use teachtree_base::error::InputError;
use teachtree_base::scene::Scene;
use teachtree_command::{Commands, Task};
use teachtree_logs::atomic_write::Files;
use teachtree_logs::read::formats;
use teachtree_logs::read::text;
use teachtree_robot::Robot;
use teachtree_robot::planning::goal::{goals, gripper_files};
use teachtree_robot::planning::gripper_goal::GripperGoal;
use teachtree_robot::planning::posture::Posture;
use teachtree_robot::planning::trajectory::{JointTrajectory, Slowdown, trajectory};
use teachtree_robot::simulation::{CellVariation, Performance, simulate_varied};
use teachtree_robot_report::{format_clearance, format_outcomes, json, page};
use teachtree_session::Analysis;

/// Options of `simulate`.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  teachtree simulate commands.json --robot both_hands --scene paper_box -o robot.csv
  teachtree simulate commands.json --robot both_hands --scene paper_box --rules my.rules -o robot.csv

  teachtree simulate commands.json --robot both_hands --scene paper_box --fail-on not_done,forces -o robot.csv

Exit status: 0 every object is where the demonstration left it, no link penetrated something by more than 3 mm, and with `--rules` every task is recognized; 1 the commands are refused; 2 bad input; of the faults that --fail-on names the first of 4 not done, 5 collisions, 6 not recognized, 7 forces outside of their profile.")]
pub struct Args {
    #[command(flatten)]
    program: ProgramArgs,
    /// A YAML file with the differences of a real cell from the scene: places of objects, errors of measured poses, friction, mass, motor delay, contact stiffness
    #[arg(long, value_name = "FILE")]
    variation: Option<PathBuf>,
    /// Output file of the recording; its scene is written beside it
    #[arg(long, short, value_name = "LOG")]
    out: PathBuf,
    /// Output file of the joint trajectory within the limits of the robot, with the fields of trajectory_msgs/JointTrajectory
    #[arg(long, value_name = "FILE")]
    trajectory: Option<PathBuf>,
    /// Output folder of the same trajectory as goals for `ros2 action send_goal --stdin`, one for each arm and hand
    #[arg(long, value_name = "FOLDER")]
    goals: Option<PathBuf>,
    /// The posture at which the trajectory and the goals begin, as `ros2 topic echo --once /joint_states` prints it
    #[arg(long, value_name = "FILE")]
    posture: Option<PathBuf>,
    /// Output file of a page that replays the execution: pictures, forces, joints, manipulability
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    #[command(flatten)]
    form: FormatArg<Format>,
}

/// Forms of what came of the tasks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// Lines for the terminal
    Text,
    /// `teachtree.outcome/1`
    Json,
}

/// The largest file of a posture that is read, bytes.
const MAX_POSTURE: u64 = 1 << 20;
/// The largest file with a variation that is read, bytes.
const MAX_VARIATION: u64 = 1 << 20;

/// Runs `simulate`. The exit status is that of the fault, if a task has one that `--fail-on` names.
pub fn run(args: &Args) -> Result<(), Failure> {
    let mut program = args.program.open()?;
    let read = |path: &PathBuf| CellVariation::read(&text::read(path, MAX_VARIATION)?, &path.display().to_string());
    let variation = args.variation.as_ref().map(read).transpose()?;
    let present =
        args.posture.as_ref().map(|path| Posture::read(&text::read(path, MAX_POSTURE)?, &path.display().to_string()));
    let present = present.transpose()?;
    if present.is_some() && args.trajectory.is_none() && args.goals.is_none() {
        let message = "is the start of a trajectory, found no output for one";
        return Err(InputError::new("--posture", message).help("give `--trajectory` or `--goals`").into());
    }
    program.inputs.extend(args.posture.iter().chain(&args.variation).cloned());
    let inputs = &program.inputs;
    output::may_record(&args.out, inputs)?;
    let more: Vec<&Path> = args.report.iter().chain(&args.trajectory).map(PathBuf::as_path).collect();
    more.iter().try_for_each(|place| output::refuse_inputs(place, inputs))?;
    let recorded = output::of_recording(&args.out);
    output::refuse_one_for_two(&recorded.iter().map(PathBuf::as_path).chain(more).collect::<Vec<_>>())?;
    program.refuse_infeasible()?;
    let Program { commands, robot, scene, analysis, .. } = &program;
    let wanted = args.trajectory.is_some() || args.goals.is_some();
    let joints = wanted.then(|| trajectory(commands, robot, scene, present.as_ref())).transpose();
    let in_its_files = |error| program.in_its_files(error);
    let joints = joints.map_err(in_its_files)?;
    let cell = variation.clone().unwrap_or_default();
    let performed = perform(commands, robot, scene, &cell).map_err(in_its_files)?;
    let Performance { recording, outcomes, nearest, collisions, .. } = &performed;
    let mut files = Files::default();
    let mut said = String::new();
    if let (Some(place), Some(made)) = (&args.trajectory, &joints) {
        output::add(&mut files, place, &made.json()?, inputs)?;
        said = summary(place, made);
    }
    if let (Some(folder), Some(made)) = (&args.goals, &joints) {
        output::make_folder(folder)?;
        for (name, text) in goals(made) {
            let place = folder.join(format!("{name}.yaml"));
            output::add(&mut files, &place, &text, inputs)?;
            let _ = writeln!(said, "{}: a goal for the controller of the {}", place.display(), name.replace('_', " "));
        }
        for (name, text) in gripper_files(made) {
            output::add(&mut files, &folder.join(format!("{name}.yaml")), &text, inputs)?;
        }
        for GripperGoal { controller, time_s, joints, .. } in made.grippers.iter().filter(|goal| goal.closes) {
            let effort = joints.iter().map(|joint| joint.effort).fold(0.0, f64::max);
            let hand = controller.replace('_', " ");
            let _ = writeln!(
                said,
                "  the {hand} closes after {time_s:.2} s with an effort of {effort:.2}: `gripper_command` beside them"
            );
        }
    }
    if let Some(place) = &args.report {
        output::add(&mut files, place, &page(commands, &performed), inputs)?;
    }
    formats::add(&mut files, recording, &args.out)?;
    files.commit()?;
    let duration = recording.time.last().copied().unwrap_or_default();
    if args.form.format == Format::Text {
        output::print(&said)?;
        output::print(&format_outcomes(outcomes))?;
    }
    let analyzed = || analysis.analyze(&analysis.source.open(&args.out)?);
    let again = program.has_rules.then(analyzed).transpose()?;
    let recognized = again.as_ref().map(|again| program.recognized(again));
    let counts = |kind: &FailOn| args.program.fail_on.contains(kind) && kind.is_found(outcomes, recognized.as_deref());
    let fault = FailOn::ALL.into_iter().find(counts);
    let result = || fault.map_or(Ok(()), |fault| Err(Failure::Fault(fault.status())));
    if args.form.format == Format::Json {
        let variation = variation.as_ref();
        let text = json(commands, outcomes, recognized.as_deref(), nearest, collisions, duration, variation);
        output::print_json(&text)?;
        return result();
    }
    if let (Some(again), Some(recognized)) = (&again, &recognized) {
        output::print(&format_recognized(commands, recognized, again))?;
    }
    output::print(&format_clearance(nearest, collisions))?;
    output::print(&format!("{}: {} frames, {duration:.1} s\n", args.out.display(), recording.time.len()))?;
    result()
}

/// Which commanded tasks are found in the robot's recording, and what is found where some are not.
fn format_recognized(commands: &Commands, recognized: &[Option<bool>], again: &Analysis) -> String {
    let of = |wanted: bool| {
        let those = commands.tasks.iter().zip(recognized).filter(move |(_, found)| **found == Some(wanted));
        those.map(|(task, _)| format!("{} {}", task.track, task.task)).collect::<Vec<_>>().join(", ")
    };
    let (known, missing) = (of(true), of(false));
    let mut text = String::new();
    if !known.is_empty() {
        let _ = writeln!(text, "recognized in the robot's recording: {known}");
    }
    if !missing.is_empty() {
        let found: Vec<String> =
            again.tasks().iter().map(|task| format!("{} {}", task.track().name(), task.name())).collect();
        let found = if found.is_empty() { "no task".into() } else { found.join(", ") };
        let _ = writeln!(text, "not recognized in the robot's recording: {missing}; the rules find {found}");
        let declares = |task: &Task| again.rules().tasks().any(|name| name == task.task);
        let mut unknown: Vec<&str> = commands
            .tasks
            .iter()
            .filter(|task| !declares(task) && task.task != UNKNOWN)
            .map(|task| task.task.as_str())
            .collect();
        unknown.dedup();
        if !unknown.is_empty() {
            let _ = writeln!(text, "  these rules declare no task {}", unknown.join(", "));
        }
    }
    text
}

/// What the joints are to do.
fn summary(place: &Path, made: &JointTrajectory) -> String {
    let last = made.points.last().map_or(0.0, |point| point.time_from_start.seconds());
    let mut text =
        format!("{}: {} joints, {} points, {last:.1} s\n", place.display(), made.joint_names.len(), made.points.len());
    for Slowdown { tasks, times, joint } in &made.slowed {
        if *times < 1.005 {
            continue;
        }
        let why = joint
            .as_ref()
            .map_or_else(|| "for the joints' limits".into(), |joint| format!("`{joint}` is at its limit"));
        let numbers: Vec<String> = tasks.iter().map(|number| (number + 1).to_string()).collect();
        let which = if tasks.len() > 1 { "tasks" } else { "task" };
        let are = if tasks.len() > 1 { "are" } else { "is" };
        let _ = writeln!(text, "  {which} {} {are} {times:.2} times slower: {why}", numbers.join(", "));
    }
    text
}

/// Simulates in a varied cell, with a progress bar.
pub fn perform(
    commands: &Commands,
    robot: &Robot,
    scene: &Scene,
    variation: &CellVariation,
) -> Result<Performance, InputError> {
    let progress = Progress::new("simulating");
    simulate_varied(commands, robot, scene, variation, &mut |part| progress.set(part))
}
