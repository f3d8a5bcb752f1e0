//! The command line: one file a command. Only here is anything printed, and only here and in the loaders are files opened.
//!
//! Exit status: 0 fine, 1 the answer is no (a failed check), 2 bad usage or input.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "this is the floor that prints")]

mod analyze;
mod check;
#[cfg(feature = "world")]
mod command;
#[cfg(feature = "world")]
mod demo;
mod explain;
mod fit;
mod flowing;
mod fmt;
mod graph;
mod inspect;
mod live;
#[cfg(feature = "lsp")]
mod lsp;
mod output;
mod progress;
mod prove;
mod rules;
mod score;
#[cfg(feature = "world")]
mod simulate;
mod source;
#[cfg(feature = "world")]
mod teach;
mod tellable;
mod test;
mod truth;

use crate::base::error::InputError;
use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Turn a recorded demonstration into named tasks and primitive motions, by rules that are text.
#[derive(Parser)]
#[command(name = "teachtree", version, about, propagate_version = true, max_term_width = 120)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    #[cfg(feature = "world")]
    /// The whole story on embedded files: teach, analyse, report; writes a folder
    Demo(demo::Args),
    /// Report every mistake of rule files, and what running them costs
    Check(check::Args),
    /// Show what a log holds and what could be recognised from it; write a binding to fill in
    Inspect(inspect::Args),
    /// Segment recordings into primitive motions and name their tasks
    Analyze(analyze::Args),
    /// Say why a recording has its labels at a time, and why not others
    Explain(explain::Args),
    /// Hold recordings against what is expected of them; coverage and mutation of the rules
    Test(test::Args),
    /// Compare what is found in recordings with what is true
    Score(score::Args),
    /// Learn params from labelled recordings, and see whether others bear them out; print a patch
    Fit(fit::Args),
    #[cfg(feature = "world")]
    /// Let an operator script teach a task in the virtual environment, and record it
    Teach(teach::Args),
    #[cfg(feature = "world")]
    /// Turn a recording into commands for a robot: trajectories, forces and grasps
    #[command(name = "command")]
    Instruct(command::Args),
    #[cfg(feature = "world")]
    /// Let a robot carry out commands in a scene, and record it
    Simulate(simulate::Args),
    /// Prove that rules only add to others
    Prove(prove::ProveArgs),
    /// Show where two rule sets differ: in which cases, and in recordings
    Diff(prove::DiffArgs),
    /// Write rule files in one style
    Fmt(fmt::Args),
    /// Draw the trees of rule files, and what can follow what; mark what a recording took
    Graph(graph::Args),
    #[cfg(feature = "lsp")]
    /// Serve an editor: diagnostics, hover, names, completion, over the Language Server Protocol
    Lsp(lsp::Args),
}

/// How a command ended.
#[derive(PartialEq)]
enum Failure {
    /// The answer is no; it has been said.
    No,
    /// The input cannot be used.
    Input(InputError),
    /// The input cannot be used, and the whole text of why is here.
    Text(String),
    /// Several of them.
    Several(Vec<Failure>),
}

impl Failure {
    /// No failure when there is none.
    fn all(failures: Vec<Self>) -> Result<(), Self> {
        if failures.is_empty() { Ok(()) } else { Err(Self::Several(failures)) }
    }

    /// The same, found while something was read that named the cause.
    fn named_in(self, file: &str) -> Self {
        match self {
            Self::Text(text) => Self::Text(format!("{file}: what it names cannot be used\n{text}")),
            other => other,
        }
    }

    /// Says what went wrong; how the program is to exit.
    fn say(&self) -> u8 {
        match self {
            Self::No => return 1,
            Self::Input(error) => eprintln!("error: {}", printable(&error.to_string())),
            Self::Text(text) => eprint!("{text}"),
            Self::Several(failures) => return failures.iter().map(Self::say).max().unwrap_or(0),
        }
        2
    }
}

/// A text that may quote anything, for a terminal: what would steer it is shown.
fn printable(text: &str) -> String {
    let shown = |letter: char| match letter {
        '\n' | '\t' => letter.to_string(),
        letter if letter.is_control() => letter.escape_default().to_string(),
        letter => letter.to_string(),
    };
    text.chars().map(shown).collect()
}

impl From<InputError> for Failure {
    fn from(error: InputError) -> Self {
        Self::Input(error)
    }
}

/// Runs the command line.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    let outcome = match &cli.command {
        #[cfg(feature = "world")]
        Command::Demo(args) => demo::run(args),
        Command::Check(args) => check::run(args),
        Command::Inspect(args) => inspect::run(args),
        Command::Analyze(args) => analyze::run(args),
        Command::Explain(args) => explain::run(args),
        Command::Test(args) => test::run(args),
        Command::Score(args) => score::run(args),
        Command::Fit(args) => fit::run(args),
        #[cfg(feature = "world")]
        Command::Teach(args) => teach::run(args),
        #[cfg(feature = "world")]
        Command::Instruct(args) => command::run(args),
        #[cfg(feature = "world")]
        Command::Simulate(args) => simulate::run(args),
        Command::Prove(args) => prove::prove(args),
        Command::Diff(args) => prove::diff(args),
        Command::Fmt(args) => fmt::run(args),
        Command::Graph(args) => graph::run(args),
        #[cfg(feature = "lsp")]
        Command::Lsp(args) => lsp::run(args),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => ExitCode::from(failure.say()),
    }
}
