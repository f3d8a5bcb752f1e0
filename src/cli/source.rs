//! How a log is read: the options that commands on logs have in common.

use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;
use teachtree_base::yaml;
use teachtree_frames::bind::BindingFile;
use teachtree_logs::read::csv;
use teachtree_logs::read::text;
use teachtree_session::{Error, Log, LogOptions};

/// Options for reading a log.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct SourceArgs {
    /// How the columns of foreign logs become channels
    #[arg(long, value_name = "FILE")]
    pub binding: Option<PathBuf>,
    /// A scene instead of the one that each log carries
    #[arg(long, value_name = "FILE")]
    pub scene: Option<PathBuf>,
}

impl SourceArgs {
    /// How a log is opened.
    pub fn options(&self) -> LogOptions {
        let options = Log::options();
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

    /// Opens a log.
    pub fn open(&self, log: &Path) -> Result<Log, Error> {
        self.options().open(log)
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
