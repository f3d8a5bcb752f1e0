//! The output of a command: its form, and the file that it is written to.

use super::output;
use clap::ValueEnum;
use clap::builder::PossibleValue;
use std::path::PathBuf;
use teachtree_base::error::InputError;
use teachtree_logs::atomic_write::Files;

/// The form of an output, among those of the command.
#[derive(clap::Args, Clone, Debug)]
pub struct FormatArg<F: ValueEnum + Send + Sync + 'static> {
    /// Output format
    #[arg(long, value_enum, default_value = "text")]
    pub format: F,
}

impl<F: ValueEnum + Send + Sync + 'static> FormatArg<F> {
    /// Prints an output of this form. Names of forms mean the same in all commands: `text` is for people, and all others but `json` are data.
    pub fn print(&self, text: &str) -> Result<(), InputError> {
        match self.format.to_possible_value().as_ref().map(PossibleValue::get_name) {
            Some("text") => output::print(text),
            Some("json") => output::print_json(text),
            _ => output::print_data(text),
        }
    }
}

/// The file of an output.
#[derive(clap::Args, Clone, Debug)]
pub struct OutArg {
    /// Output file; by default standard output
    #[arg(long = "out", short = 'o', id = "out", value_name = "FILE")]
    pub file: Option<PathBuf>,
}

impl OutArg {
    /// Adds an output to the files that are written together, if it has a file.
    pub fn add(&self, files: &mut Files, text: &str, inputs: &[PathBuf]) -> Result<(), InputError> {
        self.file.iter().try_for_each(|path| output::add(files, path, text, inputs))
    }

    /// Prints an output unless it has a file.
    pub fn print<F: ValueEnum + Send + Sync>(&self, form: &FormatArg<F>, text: &str) -> Result<(), InputError> {
        if self.file.is_some() { Ok(()) } else { form.print(text) }
    }
}
