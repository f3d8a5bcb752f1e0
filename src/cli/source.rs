//! How a log is read: the options that commands on logs have in common.

use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;
use teachtree_base::yaml;
use teachtree_frames::bind::BindingFile;
use teachtree_logs::read::csv;
use teachtree_logs::read::formats;
use teachtree_logs::read::text;
use teachtree_session::project_file::ProjectSettings;
use teachtree_session::{Error, ErrorInternals, Log, LogOptions};

/// The option `--each` of earlier versions, which has no effect: a folder of tables with equal columns is a folder of recordings.
pub fn each() -> clap::Arg {
    clap::Arg::new("each").long("each").action(clap::ArgAction::SetTrue).hide(true)
}

/// Options for reading a log.
#[derive(clap::Args, Clone, Debug, Default)]
#[command(arg(each()))]
pub struct SourceArgs {
    /// Binding file that maps the columns of foreign logs to channels
    #[arg(long, value_name = "FILE")]
    pub binding: Option<PathBuf>,
    /// Scene file; replaces the scene of each log
    #[arg(long, value_name = "FILE")]
    pub scene: Option<PathBuf>,
    /// Whether `teachtree.yaml` is left out: these options are all that there is.
    #[arg(skip)]
    pub is_alone: bool,
}

impl SourceArgs {
    /// How a log is opened: what these options leave open is taken from `teachtree.yaml`.
    pub fn options(&self) -> LogOptions {
        let options = if self.is_alone { Log::options() } else { Log::options().by_project() };
        let options = self.binding.iter().fold(options, |options, binding| options.binding(binding));
        self.scene.iter().fold(options, |options, scene| options.scene(scene))
    }

    /// Reads the binding and the scene of several recordings once: what is wrong with them is not said for each recording.
    ///
    /// # Errors
    /// When one of them cannot be read.
    pub fn check(&self, logs: usize) -> Result<(), InputError> {
        if logs > 1 {
            self.binding.iter().try_for_each(|binding| BindingFile::read(binding).map(drop))?;
            self.scene.iter().try_for_each(|scene| csv::read_scene(scene).map(drop))?;
        }
        Ok(())
    }

    /// The settings of `teachtree.yaml` for a log. A binding of these options replaces what belongs to that of the file.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn settings(&self, log: &Path) -> Result<ProjectSettings, InputError> {
        if self.is_alone {
            return Ok(ProjectSettings::default());
        }
        let settings = ProjectSettings::of(log)?;
        Ok(if self.binding.is_some() { settings.without_binding() } else { settings })
    }

    /// The binding of a log: of these options, else of `teachtree.yaml`.
    ///
    /// # Errors
    /// When that file cannot be read.
    pub fn binding_of(&self, log: &Path) -> Result<Option<PathBuf>, InputError> {
        match &self.binding {
            Some(binding) => Ok(Some(binding.clone())),
            None => Ok(self.settings(log)?.binding.map(|binding| binding.value)),
        }
    }

    /// Opens a log.
    pub fn open(&self, log: &Path) -> Result<Log, Error> {
        self.options().open(log).map_err(|error| self.in_parts(log, error))
    }

    /// An error about a folder that was read as one recording in parts, with what else it may be.
    fn in_parts(&self, log: &Path, error: Error) -> Error {
        let is_parts = log.is_dir() && !formats::is_set(log) && !formats::is_zarr(log) && !formats::is_bag(log);
        if !is_parts || !self.binding_of(log).is_ok_and(|binding| binding.is_some()) {
            return error;
        }
        let kind = error.kind();
        let error = error.into_input();
        let is = format!(
            "the folder was read as one recording in parts, since its tables have different columns; name the tables to read each as a recording: {}",
            log.join("*.csv").display()
        );
        let help = error.help.as_ref().map_or_else(|| is.clone(), |help| format!("{help}; {is}"));
        Error::new(error.help(help), kind)
    }
}

/// Whether a name is a path to a YAML file rather than the name of something shipped.
pub fn is_yaml(name: &str) -> bool {
    yaml::is_yaml(Path::new(name))
}

/// An error about a scene of this name, or in this file, at its line there: where no file is known its place is keys, `bodies.cube.mass`.
pub fn in_scene(name: &str, error: InputError) -> InputError {
    let of_scene = ["bodies", "hands"].contains(&error.place.split('.').next().unwrap_or_default());
    of_scene.then(|| in_yaml(name, &error)).flatten().unwrap_or(error)
}

/// An error about the operator of this name, or in this file, at its line there: "operator `lift`, hands.right.steps.3".
pub fn in_operator(name: &str, error: InputError) -> InputError {
    let keys = error.place.strip_prefix("operator `").and_then(|place| place.split_once("`, "));
    let at_keys = keys.map(|(_, keys)| InputError { place: keys.into(), ..error.clone() });
    at_keys.and_then(|error| in_yaml(name, &error)).unwrap_or(error)
}

/// An error whose place is keys, at its line in this file; `None` where there is no file.
fn in_yaml(name: &str, error: &InputError) -> Option<InputError> {
    let text = is_yaml(name).then(|| text::read(Path::new(name), yaml::MAX_BYTES as u64).ok()).flatten()?;
    Some(yaml::located(error.clone(), &text, name))
}
