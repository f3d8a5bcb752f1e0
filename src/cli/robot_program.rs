//! A robot program: commands with their robot, their scene and the rules that must recognize them; and the faults of its execution.

use super::analysis::AnalysisArgs;
use super::retarget::{open_robot, open_scene};
use super::rules::RuleArgs;
use super::source::{SourceArgs, in_scene, is_yaml};
use super::{Failure, output};
use std::fmt::Write;
use std::path::PathBuf;
use teachtree_analysis::{TrackId, UNKNOWN};
use teachtree_base::error::InputError;
use teachtree_base::scene::Scene;
use teachtree_command::{Commands, Task, in_file};
use teachtree_logs::read::text;
use teachtree_robot::Robot;
use teachtree_robot::simulation::{FaultKind, TaskOutcome};
use teachtree_session::Analysis;

/// Options that name a robot program and the faults of its execution.
#[derive(clap::Args)]
pub struct ProgramArgs {
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
    /// Faults with which the exit status is not 0
    #[arg(long, value_enum, value_name = "KIND,…", value_delimiter = ',', default_values_t = [FailOn::NotDone, FailOn::Collisions, FailOn::NotRecognized])]
    pub fail_on: Vec<FailOn>,
}

/// A robot program that has been read.
pub struct Program {
    /// The name of the file of the commands.
    file: String,
    /// The name of the scene, as it was given.
    scene_name: String,
    pub commands: Commands,
    pub robot: Robot,
    pub scene: Scene,
    /// The rules that recognize tasks, and how the robot's recording is read.
    pub analysis: AnalysisArgs,
    /// Whether rules were given.
    pub has_rules: bool,
    /// All files that were read.
    pub inputs: Vec<PathBuf>,
}

/// A possible fault of the robot's execution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
#[value(rename_all = "snake_case")]
pub enum FailOn {
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
    pub const ALL: [Self; 4] = [Self::NotDone, Self::Collisions, Self::NotRecognized, Self::Forces];

    /// The exit status of this class.
    pub fn status(self) -> u8 {
        match self {
            Self::NotDone => 4,
            Self::Collisions => 5,
            Self::NotRecognized => 6,
            Self::Forces => 7,
        }
    }

    /// The same kind of the simulation.
    pub fn kind(self) -> FaultKind {
        match self {
            Self::NotDone => FaultKind::NotDone,
            Self::Collisions => FaultKind::Collisions,
            Self::NotRecognized => FaultKind::NotRecognized,
            Self::Forces => FaultKind::Forces,
        }
    }

    /// Whether any of these tasks has the fault.
    pub fn is_found(self, outcomes: &[TaskOutcome], recognized: Option<&[Option<bool>]>) -> bool {
        match self {
            Self::NotDone => outcomes.iter().any(|outcome| !outcome.done),
            Self::Collisions => outcomes.iter().any(TaskOutcome::collides),
            Self::NotRecognized => recognized.is_some_and(|all| all.contains(&Some(false))),
            Self::Forces => outcomes.iter().any(|outcome| !outcome.forces.kept()),
        }
    }
}

/// The largest file of commands that is read, bytes.
const MAX_COMMANDS: u64 = 256 << 20;

impl ProgramArgs {
    /// Reads the program, and warns if the commands are of another scene.
    pub fn open(&self) -> Result<Program, Failure> {
        let file = self.commands.display().to_string();
        let commands = Commands::read(&text::read(&self.commands, MAX_COMMANDS)?, &file)?;
        let ((robot, parts), scene) = (open_robot(&self.robot)?, open_scene(&self.scene)?);
        if !commands.scene.is_empty() && !scene.name.is_empty() && commands.scene != scene.name {
            output::warn(&format!("{file} is of the scene `{}`, and this one is `{}`", commands.scene, scene.name));
        }
        // The robot's own recording has canonical names.
        let source = SourceArgs { is_alone: true, ..SourceArgs::default() };
        let analysis = AnalysisArgs { rules: RuleArgs::of_files(&self.rules, None), source };
        let has_rules = !self.rules.is_empty();
        if has_rules {
            // A mistake in them is reported before the robot begins.
            analysis.rules.options().load()?;
        }
        let mut inputs = analysis.inputs(std::slice::from_ref(&self.commands));
        inputs.extend(parts.into_iter().chain(is_yaml(&self.scene).then(|| PathBuf::from(&self.scene))));
        Ok(Program { file, scene_name: self.scene.clone(), commands, robot, scene, analysis, has_rules, inputs })
    }
}

impl Program {
    /// Prints the grasps that are infeasible for the robot's hand, from the result of `retarget`.
    ///
    /// # Errors
    /// An infeasible grasp.
    pub fn refuse_infeasible(&self) -> Result<(), Failure> {
        let mut text = String::new();
        for (number, task) in self.commands.tasks.iter().enumerate() {
            for why in task.grasps.iter().filter_map(|grasp| grasp.infeasible.as_ref()) {
                let _ = writeln!(text, "refused  task {} ({} {}): no grasp, {why}", number + 1, task.track, task.task);
            }
        }
        if text.is_empty() {
            return Ok(());
        }
        output::print(&text)?;
        Err(Failure::Negative)
    }

    /// Returns an error of the execution with the names of the files.
    pub fn in_its_files(&self, error: InputError) -> InputError {
        in_scene(&self.scene_name, in_file(&self.file, error))
    }

    /// For each commanded task, whether one of that name and hand is found in the robot's recording; each one found counts once. Tasks that no rule names have
    /// nothing to be recognized by.
    pub fn recognized(&self, again: &Analysis) -> Vec<Option<bool>> {
        let mut found: Vec<(TrackId, String)> =
            again.tasks().iter().map(|task| (task.track(), task.name().to_string())).collect();
        let mut take = |task: &Task| {
            let wanted = (TrackId::Hand(task.track), task.task.clone());
            found.iter().position(|one| *one == wanted).map(|at| found.swap_remove(at)).is_some()
        };
        self.commands.tasks.iter().map(|task| (task.task != UNKNOWN).then(|| take(task))).collect()
    }
}
