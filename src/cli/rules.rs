//! Which rules a command runs: the options that name them.

use super::source::SourceArgs;
use std::path::{Path, PathBuf};
use teachtree_frames::bind::BindingFile;
use teachtree_frames::hand_file_of;
use teachtree_language::{self as language, Request};
use teachtree_session::{Error, Log, Rules, RulesOptions};

/// Options that name rules.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct RuleArgs {
    /// Rule files; when left out the shipped `contact.rules`, for logs of two hands `bimanual.rules`
    #[arg(long = "rules", value_name = "FILE")]
    pub rules: Vec<PathBuf>,
    /// The hand file that implements the abstract signals, such as `hand_flags.rules`; overrides the binding's
    #[arg(long, value_name = "FILE")]
    pub hand: Option<String>,
    /// Override a param, such as `touch_on=0.1N`; may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = name_and_value)]
    pub set: Vec<(String, String)>,
}

/// Reads `NAME=VALUE`.
pub fn name_and_value(text: &str) -> Result<(String, String), String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE, such as `touch_on=0.1N`")?;
    Ok((name.trim().to_string(), value.trim().to_string()))
}

impl RuleArgs {
    /// What is loaded.
    pub fn options(&self) -> RulesOptions {
        let mut options = Rules::options();
        for file in &self.rules {
            options = options.file(file);
        }
        if let Some(hand) = &self.hand {
            options = options.hand_file(hand);
        }
        self.set.iter().fold(options, |options, (name, value)| options.param(name, value))
    }

    /// Loads rules for a log; what the command line says wins over what the binding says. Warnings are left to `check`.
    pub fn load(&self, log: &Log) -> Result<Rules, Error> {
        self.options().for_log(log)
    }
}

/// The files that these options have a command read, those that rules use too: nothing is written over them.
pub fn read_by(source: &SourceArgs, rules: &RuleArgs) -> Vec<PathBuf> {
    let of_binding = |binding: &Path| Some(hand_file_of(binding, BindingFile::read(binding).ok()?.binding.hand_file?));
    let hand_file = rules.hand.clone().or_else(|| source.binding.as_deref().and_then(of_binding));
    let mut files: Vec<PathBuf> = source.binding.iter().chain(&source.scene).chain(&rules.rules).cloned().collect();
    if !rules.rules.is_empty() || hand_file.is_some() {
        let loaded = language::load(&Request { files: rules.rules.clone(), hand_file, ..Request::default() });
        files.extend(loaded.sources.files.iter().map(|file| PathBuf::from(&file.name)));
    }
    files
}

/// Loads the rules of these files, without a log; a hand file may be named.
pub fn load_files(files: &[PathBuf], hand: Option<&str>) -> Result<Rules, Error> {
    RuleArgs { rules: files.to_vec(), hand: hand.map(str::to_string), set: Vec::new() }.options().load()
}
