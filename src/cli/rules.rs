//! Which rules a command runs: the options that name them.

use std::path::PathBuf;
use teachtree_session::{Error, Log, Rules, RulesOptions};

/// The hand model.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct HandArg {
    /// The hand model that implements the abstract signals, such as `hand_flags.rules`; overrides the binding's
    #[arg(long = "hand", id = "hand", value_name = "FILE")]
    pub file: Option<String>,
}

/// Values of params.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct SetArg {
    /// Override a param, such as `touch_on=0.1N`; may be repeated
    #[arg(long = "set", id = "set", value_name = "NAME=VALUE", value_parser = name_and_value)]
    pub values: Vec<(String, String)>,
}

/// Options that name rules.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct RuleArgs {
    /// Rule files; by default the shipped `contact.rules`, or `bimanual.rules` for logs of two hands, and `failures.rules`
    #[arg(long = "rules", value_name = "FILE")]
    pub rules: Vec<PathBuf>,
    #[command(flatten)]
    pub hand: HandArg,
    #[command(flatten)]
    pub set: SetArg,
}

/// Reads `NAME=VALUE`.
pub fn name_and_value(text: &str) -> Result<(String, String), String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE, such as `touch_on=0.1N`")?;
    Ok((name.trim().to_string(), value.trim().to_string()))
}

impl RuleArgs {
    /// The rules of files, which a hand model may implement.
    pub fn of_files(files: &[PathBuf], hand: Option<&str>) -> Self {
        let hand = HandArg { file: hand.map(str::to_string) };
        Self { rules: files.to_vec(), hand, set: SetArg::default() }
    }

    /// What is loaded.
    pub fn options(&self) -> RulesOptions {
        let options = self.rules.iter().fold(Rules::options(), |options, file| options.file(file));
        let options = self.hand.file.iter().fold(options, |options, hand| options.hand_file(hand));
        self.set.values.iter().fold(options, |options, (name, value)| options.param(name, value))
    }

    /// Loads rules for a log; what the command line says wins over what the binding says. Warnings are left to `check`.
    pub fn load(&self, log: &Log) -> Result<Rules, Error> {
        self.options().for_log(log)
    }
}

/// Loads the rules of these files, without a log; a hand model may be named.
pub fn load_files(files: &[PathBuf], hand: Option<&str>) -> Result<Rules, Error> {
    RuleArgs::of_files(files, hand).options().load()
}
