//! `teachtree simulate`: commands in, the recording of the robot that carried them out.

use super::analysis::AnalysisArgs;
use super::output_args::FormatArg;
use super::progress::Progress;
use super::retarget::{open_robot, open_scene};
use super::rules::RuleArgs;
use super::source::SourceArgs;
use super::source::{in_scene, is_yaml};
use super::{Failure, output};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use teachtree_analysis::{TrackId, UNKNOWN};
use teachtree_base::error::InputError;
use teachtree_base::scene::Scene;
use teachtree_command::{Commands, Task, in_file};
use teachtree_logs::atomic_write::Files;
use teachtree_logs::read::formats;
use teachtree_logs::read::text;
use teachtree_robot::Robot;
use teachtree_robot::planning::goal::{goals, gripper_files};
use teachtree_robot::planning::gripper_goal::GripperGoal;
use teachtree_robot::planning::posture::Posture;
use teachtree_robot::planning::trajectory::{JointTrajectory, Slowdown, trajectory};
use teachtree_robot::simulation::{Performance, TaskOutcome, simulate};
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
    /// The commands that `teachtree retarget` wrote
    #[arg(value_name = "COMMANDS")]
    commands: PathBuf,
    /// A shipped robot by name, or a robot file; must be the robot of the commands
    #[arg(long, value_name = "ROBOT", default_value = "both_hands")]
    robot: String,
    /// A shipped scene by name, or a scene file; objects may stand elsewhere than in the demonstration
    #[arg(long, value_name = "SCENE")]
    scene: String,
    /// Rule files that must recognize the commanded tasks in the robot's recording
    #[arg(long, value_name = "FILE")]
    rules: Vec<PathBuf>,
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
    /// Faults with which the exit status is not 0
    #[arg(long, value_enum, value_name = "KIND,…", value_delimiter = ',', default_values_t = [FailOn::NotDone, FailOn::Collisions, FailOn::NotRecognized])]
    fail_on: Vec<FailOn>,
    #[command(flatten)]
    form: FormatArg<Format>,
}

/// A possible fault of the robot's execution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
#[value(rename_all = "snake_case")]
enum FailOn {
    /// An object is not where the demonstration left it
    NotDone,
    /// A link penetrated something by more than 3 mm
    Collisions,
    /// The rules of `--rules` do not find a task in the robot's recording
    NotRecognized,
    /// Forces are outside of their profile
    Forces,
}

impl FailOn {
    /// All faults, the one first that decides the exit status where several are found.
    const ALL: [Self; 4] = [Self::NotDone, Self::Collisions, Self::NotRecognized, Self::Forces];

    /// The exit status of this class.
    fn status(self) -> u8 {
        match self {
            Self::NotDone => 4,
            Self::Collisions => 5,
            Self::NotRecognized => 6,
            Self::Forces => 7,
        }
    }

    /// Whether any of these tasks has the fault.
    fn is_found(self, outcomes: &[TaskOutcome], recognized: Option<&[Option<bool>]>) -> bool {
        match self {
            Self::NotDone => outcomes.iter().any(|outcome| !outcome.done),
            Self::Collisions => outcomes.iter().any(TaskOutcome::collides),
            Self::NotRecognized => recognized.is_some_and(|all| all.contains(&Some(false))),
            Self::Forces => outcomes.iter().any(|outcome| !outcome.forces.kept()),
        }
    }
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
/// The largest file of commands that is read, bytes.
const MAX_COMMANDS: u64 = 256 << 20;

/// Runs `simulate`. The exit status is that of the fault, if a task has one that `--fail-on` names.
pub fn run(args: &Args) -> Result<(), Failure> {
    let file = args.commands.display().to_string();
    let text = text::read(&args.commands, MAX_COMMANDS)?;
    let commands = Commands::read(&text, &file)?;
    let ((robot, parts), scene) = (open_robot(&args.robot)?, open_scene(&args.scene)?);
    let scene_file = is_yaml(&args.scene).then(|| PathBuf::from(&args.scene));
    if !commands.scene.is_empty() && !scene.name.is_empty() && commands.scene != scene.name {
        output::warn(&format!("{file} is of the scene `{}`, and this one is `{}`", commands.scene, scene.name));
    }
    let present =
        args.posture.as_ref().map(|path| Posture::read(&text::read(path, MAX_POSTURE)?, &path.display().to_string()));
    let present = present.transpose()?;
    if present.is_some() && args.trajectory.is_none() && args.goals.is_none() {
        let message = "is the start of a trajectory, found no output for one";
        return Err(InputError::new("--posture", message).help("give `--trajectory` or `--goals`").into());
    }
    // The robot's own recording has canonical names.
    let source = SourceArgs { is_alone: true, ..SourceArgs::default() };
    let analysis = AnalysisArgs { rules: RuleArgs::of_files(&args.rules, None), source };
    if !args.rules.is_empty() {
        // A mistake in them is reported before the robot begins.
        analysis.rules.options().load()?;
    }
    let mut inputs = analysis.inputs(std::slice::from_ref(&args.commands));
    inputs.extend(args.posture.iter().cloned().chain(parts).chain(scene_file));
    output::may_record(&args.out, &inputs)?;
    let more: Vec<&Path> = args.report.iter().chain(&args.trajectory).map(PathBuf::as_path).collect();
    more.iter().try_for_each(|place| output::refuse_inputs(place, &inputs))?;
    let recorded = output::of_recording(&args.out);
    output::refuse_one_for_two(&recorded.iter().map(PathBuf::as_path).chain(more).collect::<Vec<_>>())?;
    let infeasible = format_infeasible(&commands);
    if !infeasible.is_empty() {
        output::print(&infeasible)?;
        return Err(Failure::Negative);
    }
    let wanted = args.trajectory.is_some() || args.goals.is_some();
    let joints = wanted.then(|| trajectory(&commands, &robot, &scene, present.as_ref())).transpose();
    let in_its_file = |error| in_scene(&args.scene, in_file(&file, error));
    let joints = joints.map_err(in_its_file)?;
    let performed = perform(&commands, &robot, &scene).map_err(in_its_file)?;
    let Performance { recording, outcomes, nearest, collisions, .. } = &performed;
    let mut files = Files::default();
    let mut said = String::new();
    if let (Some(place), Some(made)) = (&args.trajectory, &joints) {
        output::add(&mut files, place, &made.json()?, &inputs)?;
        said = summary(place, made);
    }
    if let (Some(folder), Some(made)) = (&args.goals, &joints) {
        output::make_folder(folder)?;
        for (name, text) in goals(made) {
            let place = folder.join(format!("{name}.yaml"));
            output::add(&mut files, &place, &text, &inputs)?;
            let _ = writeln!(said, "{}: a goal for the controller of the {}", place.display(), name.replace('_', " "));
        }
        for (name, text) in gripper_files(made) {
            output::add(&mut files, &folder.join(format!("{name}.yaml")), &text, &inputs)?;
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
        output::add(&mut files, place, &page(&commands, &performed), &inputs)?;
    }
    formats::add(&mut files, recording, &args.out)?;
    files.commit()?;
    let duration = recording.time.last().copied().unwrap_or_default();
    if args.form.format == Format::Text {
        output::print(&said)?;
        output::print(&format_outcomes(outcomes))?;
    }
    let analyzed = || analysis.analyze(&analysis.source.open(&args.out)?);
    let again = (!args.rules.is_empty()).then(analyzed).transpose()?;
    let recognized = again.as_ref().map(|again| recognized(&commands, again));
    let counts = |kind: &FailOn| args.fail_on.contains(kind) && kind.is_found(outcomes, recognized.as_deref());
    let fault = FailOn::ALL.into_iter().find(counts);
    let result = || fault.map_or(Ok(()), |fault| Err(Failure::Fault(fault.status())));
    if args.form.format == Format::Json {
        output::print_json(&json(&commands, outcomes, recognized.as_deref(), nearest, collisions, duration))?;
        return result();
    }
    if let (Some(again), Some(recognized)) = (&again, &recognized) {
        output::print(&format_recognized(&commands, recognized, again))?;
    }
    output::print(&format_clearance(nearest, collisions))?;
    output::print(&format!("{}: {} frames, {duration:.1} s\n", args.out.display(), recording.time.len()))?;
    result()
}

/// For each commanded task, whether one of that name and hand is found in the robot's recording; each one found counts once. Tasks that no rule names have
/// nothing to be recognized by.
fn recognized(commands: &Commands, again: &Analysis) -> Vec<Option<bool>> {
    let mut found: Vec<(TrackId, String)> =
        again.tasks().iter().map(|task| (task.track(), task.name().to_string())).collect();
    let mut take = |task: &Task| {
        let wanted = (TrackId::Hand(task.track), task.task.clone());
        found.iter().position(|one| *one == wanted).map(|at| found.swap_remove(at)).is_some()
    };
    commands.tasks.iter().map(|task| (task.task != UNKNOWN).then(|| take(task))).collect()
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

/// Formats the grasps that are infeasible for the robot's hand, from the result of `retarget`; empty if all are feasible.
fn format_infeasible(commands: &Commands) -> String {
    let mut text = String::new();
    for (number, task) in commands.tasks.iter().enumerate() {
        for why in task.grasps.iter().filter_map(|grasp| grasp.infeasible.as_ref()) {
            let _ = writeln!(text, "refused  task {} ({} {}): no grasp, {why}", number + 1, task.track, task.task);
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

/// Simulates with a progress bar.
pub fn perform(commands: &Commands, robot: &Robot, scene: &Scene) -> Result<Performance, InputError> {
    let progress = Progress::new("simulating");
    simulate(commands, robot, scene, &mut |part| progress.set(part))
}
