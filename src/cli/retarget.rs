//! `teachtree retarget`: a recording in, commands for a robot out.

use super::analysis::AnalysisArgs;
use super::inputs::massless;
use super::progress::Progress;
use super::source::is_yaml;
use super::{Failure, output};
use nalgebra::Vector3;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;
use teachtree_base::hands::Finger;
use teachtree_base::recording::Recording;
use teachtree_base::scene::{Role, Scene};
use teachtree_command::{self as command, Commands, GraspCriterion, MappedFinger, MappedGrasp, TouchForces};
use teachtree_logs::read::text;
use teachtree_robot::{self as robot, Crossing, Robot, Unreachable};
use teachtree_session::Rules;
use teachtree_session::{AnalysisInternals, LogInternals, RulesInternals};

#[derive(clap::Args)]
#[command(after_help = "Examples:
  teachtree retarget demonstration.csv --robot both_hands -o commands.json
  teachtree retarget demonstration.csv --robot gifu_hand_iii_right --format csv -o commands.csv

Exit status: 0 commands for every task are written; 1 no task is recognized and nothing is written, or the robot cannot take a grasp or follow a path: the reason is printed, and `simulate` refuses such commands; 2 bad input.")]
pub struct Args {
    /// A recording of any format
    #[arg(value_name = "LOG")]
    log: PathBuf,
    /// A shipped robot by name, or a robot file
    #[arg(long, value_name = "ROBOT", default_value = "both_hands")]
    robot: String,
    /// The measure by which grasps of a hand are ranked; grippers have their own measure
    #[arg(long, value_enum, default_value_t = Grasps::Quality)]
    grasps: Grasps,
    #[command(flatten)]
    analysis: AnalysisArgs,
    /// Output format
    #[arg(long, value_enum, default_value_t = Format::Json)]
    format: Format,
    /// Output file of the commands
    #[arg(long, short, value_name = "FILE")]
    out: PathBuf,
}

/// Criteria of grasps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Grasps {
    /// Manipulability, distance from joint limits, alignment of the pads with the surface, and the margin of friction
    Quality,
    /// Manipulability and distance from joint limits
    Manipulability,
}

impl Grasps {
    fn criterion(self) -> GraspCriterion {
        match self {
            Self::Quality => GraspCriterion::Quality,
            Self::Manipulability => GraspCriterion::Manipulability,
        }
    }
}

/// Forms of commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// `teachtree.commands/1`
    Json,
    /// A table, a row a sample
    Csv,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let (robot, parts) = open_robot(&args.robot)?;
    let mut inputs = args.analysis.inputs(std::slice::from_ref(&args.log));
    inputs.extend(parts);
    output::refuse_inputs(&args.out, &inputs)?;
    let log = args.analysis.source.open(&args.log)?;
    let opened = log.opened()?;
    let analysis = args.analysis.rules.options().without_failures().for_log(&log)?.analyze(&log)?;
    let mut commands =
        command::commands(&opened.trusted()?, analysis.found(), touch_forces(analysis.rules()), &log.name())?;
    if commands.tasks.is_empty() {
        output::print("found no task with an object that fingers touch: no commands are written\n")?;
        output::print(&without_shape(&opened.recording.scene))?;
        return Err(Failure::Negative);
    }
    // Jaws are not asked for more than they give; the missing force is reported.
    let too_hard = too_hard(&commands, &robot);
    let (scene, criterion) = (&opened.recording.scene, args.grasps.criterion());
    let conflicts = {
        let progress = Progress::new("mapping to the robot");
        robot::map_by(&mut commands, &robot, scene, criterion, &mut |part| progress.set(part))?
    };
    if let Err(error) = commands.check() {
        output::print(&summary(&commands))?;
        output::print(&refused(&error))?;
        output::print("nothing is written: the commands are invalid\n")?;
        return Err(Failure::Negative);
    }
    let text = match args.format {
        Format::Json => commands.json()?,
        Format::Csv => command::csv::csv(&commands)?,
    };
    output::write(&args.out, &text, &inputs)?;
    output::print(&summary(&commands))?;
    output::print(&too_hard)?;
    output::print(&conflicts.crossings.iter().map(crosses).collect::<String>())?;
    output::print(&conflicts.unreachable.iter().map(falls_short).collect::<String>())?;
    output::print(&format!("written: {}\n", args.out.display()))?;
    if commands.tasks.iter().flat_map(|task| &task.grasps).any(|grasp| grasp.infeasible.is_some()) {
        output::print("  The grasp is impossible for this hand, so `simulate` refuses these commands\n")?;
        output::print(without_pads(&commands, &opened.recording))?;
        return Err(Failure::Negative);
    }
    if let Err(error) = robot::validate(&commands, &robot, &opened.recording.scene) {
        output::print(&refused(&error))?;
        output::print("  `simulate` refuses these commands for this robot and scene\n")?;
        return Err(Failure::Negative);
    }
    Ok(())
}

/// Formats the reason why the robot cannot execute the commands.
fn refused(error: &InputError) -> String {
    format!("refused  {error}\n")
}

/// Returns the forces from and until which a fingertip touches, by the params `touch_on` and `touch_off` where the rules have them.
pub fn touch_forces(rules: &Rules) -> TouchForces {
    let value = |name: &str, default: f64| rules.set().param(name).map_or(default, |param| param.value);
    let TouchForces { on_n, off_n } = TouchForces::default();
    TouchForces { on_n: value("touch_on", on_n), off_n: value("touch_off", off_n) }
}

/// Objects of which it is not known where fingers touch them.
fn without_shape(scene: &Scene) -> String {
    let shapeless = scene.bodies.iter().filter(|(_, body)| body.role == Role::Object && body.parts.is_empty());
    let names: Vec<String> = shapeless.map(|(name, _)| format!("`{name}`")).collect();
    if names.is_empty() {
        return String::new();
    }
    format!("  help: the shape of {} is not known; give a scene that has it with `--scene`\n", names.join(", "))
}

/// The `pads:` that give both jaws contacts, for a gripper with only tool point and opening.
fn without_pads(commands: &Commands, recording: &Recording) -> &'static str {
    let has = |name: &str| recording.columns.keys().any(|column| column.starts_with(name));
    let is_point = |task: &command::Task| {
        let is_refused = task.grasps.iter().any(|grasp| grasp.infeasible.is_some() && grasp.contacts.len() == 1);
        let hand = task.track;
        is_refused && has(&format!("{hand}.gripper.opening")) && !has(&format!("{hand}.index.position"))
    };
    if commands.tasks.iter().any(is_point) {
        "  help: only the tool point touches the object; bind `pads: {of: tcp, opening: gripper, axis: y}`, with the axis of the tool along which the jaws move (docs/bindings.md)\n"
    } else {
        ""
    }
}

/// Formats the warning that hands or arms go through each other.
fn crosses(crossing: &Crossing) -> String {
    let tasks: Vec<String> = crossing.tasks.iter().map(|task| (task + 1).to_string()).collect();
    let (depth, tasks) = (crossing.depth_m * 1e3, tasks.join(" and "));
    format!(
        "warning: hands or arms go through each other by {depth:.1} mm in tasks {tasks}: no grasps and paths that keep them apart were found\n"
    )
}

/// Formats the warning that an arm cannot follow its tasks.
fn falls_short(Unreachable { side, why }: &Unreachable) -> String {
    format!("warning: the {side} arm cannot follow its tasks, so the hands are not kept apart: {why}\n")
}

/// Fingers of which the operator's forces ask more than they give.
fn too_hard(commands: &Commands, robot: &Robot) -> String {
    let mut text = String::new();
    for (number, task) in commands.tasks.iter().enumerate() {
        let Some(hand) = robot.hands.get(&task.track) else { continue };
        let mut asked: BTreeMap<Finger, f64> = BTreeMap::new();
        for tip in task.segments.iter().filter(|segment| segment.touching).flat_map(|segment| &segment.tips) {
            let hardest = tip.force.iter().map(|force| Vector3::from(*force).norm()).fold(0.0, f64::max);
            let most = asked.entry(tip.finger).or_default();
            *most = most.max(hardest);
        }
        for (finger, asked) in asked {
            let gives = hand.finger(finger).map(|finger| finger.force);
            if let Some(gives) = gives.filter(|gives| asked > *gives) {
                let task = format!("task {} ({} {})", number + 1, task.track, task.task);
                let of = format!("{task} requires {asked:.2} N of the {finger}");
                let _ = writeln!(text, "warning: {of}, which gives {gives:.2} N at most");
            }
        }
    }
    text
}

/// The robot of this name, or in this file, with all the files that it was read from.
pub fn open_robot(name: &str) -> Result<(Robot, Vec<PathBuf>), InputError> {
    let files = RefCell::new(Vec::new());
    let text_of = |file: &str| {
        files.borrow_mut().push(PathBuf::from(file));
        text::read(Path::new(file), robot::MAX_BYTES)
    };
    let bytes_of = |file: &Path| {
        let bytes = text::bytes(file, robot::MAX_MESH_BYTES)?;
        if bytes.is_some() {
            files.borrow_mut().push(file.into());
        }
        Ok(bytes)
    };
    let robot = robot::open_with_meshes(name, &text_of, &bytes_of)?;
    if let Some(text) = massless(&robot) {
        output::warn(&format!("{name}: {text}"));
    }
    Ok((robot, files.into_inner()))
}

/// The scene of this name, or in this file.
pub fn open_scene(name: &str) -> Result<Scene, InputError> {
    if is_yaml(name) { teachtree_logs::read::csv::read_scene(Path::new(name)) } else { teachtree_world::scene(name) }
}

/// Formats the factors of a grasp's measure by finger.
fn quality(mapped: &MappedGrasp) -> String {
    let each = |of: &dyn Fn(&MappedFinger) -> f64, digits: usize| {
        mapped.fingers.iter().map(|finger| format!("{:.digits$}", of(finger))).collect::<Vec<String>>().join(", ")
    };
    let mut parts = Vec::new();
    if mapped.opening.is_none() {
        parts.push(format!("manipulability {}", each(&|finger| finger.manipulability, 2)));
    }
    parts.push(format!("freedom from joint limits {}", each(&|finger| finger.freedom, 2)));
    parts.push(format!("pads {} degrees from the normal", each(&|finger| finger.pad_angle_deg, 0)));
    parts.extend(mapped.friction_margin.zip(mapped.friction_margin_percent()).map(|margin| match margin {
        (0.0, _) => "the contacts can push the object but not hold it".into(),
        (_, percent) => format!("holds with up to {percent:.0} % less friction"),
    }));
    parts.join("; ")
}

/// What is commanded.
pub fn summary(commands: &Commands) -> String {
    let mut text = String::new();
    for task in &commands.tasks {
        let _ = writeln!(
            text,
            "{} {} of `{}`: {} segments, {:.1} s (demonstrated in {:.1} s)",
            task.track,
            task.task,
            task.object,
            task.segments.len(),
            task.duration_s(),
            task.end_s - task.start_s
        );
        for grasp in &task.grasps {
            let fingers: Vec<&str> = grasp.contacts.iter().map(|contact| contact.finger.name()).collect();
            let fingers = fingers.join(", ");
            if let Some(mapped) = &grasp.mapped {
                let beside = match (mapped.opening, mapped.copied_measure) {
                    (Some(opening), _) => format!("jaws open by {:.1} mm", opening * 1e3),
                    (None, Some(copied)) => format!("{copied:.3} where the palm copies the demonstrated one"),
                    (None, None) => "out of reach where the palm copies the demonstrated one".into(),
                };
                let _ = writeln!(text, "  {fingers}: measure {:.3}, {beside}", mapped.measure);
                let _ = writeln!(text, "    {}", quality(mapped));
            }
            if let Some(why) = &grasp.infeasible {
                let _ = writeln!(text, "  {fingers}: no grasp, {why}");
            }
            for finger in &grasp.brief {
                let _ = writeln!(text, "  the {finger} touches too briefly to take part");
            }
        }
        let (before, after) = task
            .segments
            .iter()
            .fold((0.0_f64, 0.0_f64), |(a, b), it| (a.max(it.quality.jerk_before), b.max(it.quality.jerk_after)));
        let _ = writeln!(text, "  largest jerk {before:.0} m/s^3 demonstrated, {after:.0} m/s^3 commanded");
        for left in &task.left_out {
            let _ = writeln!(
                text,
                "  left out: {} {:.2} – {:.2} s, {}",
                left.primitives.join(" "),
                left.start_s,
                left.end_s,
                left.why
            );
        }
    }
    text
}
