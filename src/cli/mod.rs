//! The command line: one file a command. Only here is anything printed, and only here and in the loaders are files opened.
//!
//! Exit status: 0 fine, 1 the answer is no (a failed check), 2 bad usage or input, 3 bad input of some recordings, the others are done; 4 and more, classes of
//! faults of a robot's execution.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "the only module that prints")]

mod agree;
mod analysis;
mod analyze;
mod annotate;
mod audit;
mod batch;
mod browser;
mod certify;
mod check;
mod color;
mod config;
mod demo;
mod diff;
mod explain;
mod export;
mod fail_on;
mod fit;
mod fmt;
mod graph;
mod groups;
mod help;
mod init;
mod inputs;
mod inspect;
mod junit;
mod learn;
mod list;
mod live;
mod lsp;
mod misplaced_files;
mod output;
mod output_args;
mod parallel;
mod print_args;
mod progress;
mod prove;
mod retarget;
mod robot_program;
mod rules;
mod score;
mod simulate;
mod source;
mod studio;
mod teach;
mod test;
mod truth;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use print_args::PrintArgs;
use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;
use std::sync::{Mutex, Once, PoisonError};
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_logs::atomic_write;
use teachtree_session::Error;
use teachtree_session::ErrorInternals;

/// Turns a recorded demonstration into named tasks and primitives, by rules that are text.
#[derive(Parser)]
#[command(name = "teachtree", version, about, propagate_version = true, max_term_width = 120)]
struct Cli {
    #[command(flatten)]
    printed: PrintArgs,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run the full pipeline on built-in example files; writes a folder
    Demo(demo::Args),
    /// Report all errors and likely mistakes of rule files, and their cost at run time
    Check(check::Args),
    /// Guess the binding and the scene of a log, write them with a project file, and analyze it
    Init(init::Args),
    /// List the columns of a log and the primitives that can be detected in it
    Inspect(inspect::Args),
    /// Print the settings of a log and the source of each: options, `teachtree.yaml`, the binding
    Config(config::Args),
    /// Segment recordings into primitives and name their tasks
    Analyze(analyze::Args),
    /// Label a copy of a data set: words for LeRobot, signals for MimicGen
    Annotate(annotate::Args),
    /// Convert bags to a data set: episodes, at one rate, with labels, tasks and success
    #[command(subcommand)]
    Export(export::Target),
    /// Report recordings of a set that are unfit for training, with the reasons
    Audit(audit::Args),
    /// Label a log while it is recorded: segments and tasks as they close
    Live(live::Args),
    /// Explain the labels of a recording at a time, and why others were not given
    Explain(explain::Args),
    /// Open a local page to view recordings, correct labels and tune rules
    Studio(studio::Args),
    /// Compare recordings with their expectation files; coverage and mutation of the rules
    Test(test::Args),
    /// Score the analysis of recordings against labels
    Score(score::Args),
    /// Compare the labels of two people: Cohen's kappa over frames, distances of boundaries
    Agree(agree::Args),
    /// Fit parameters to labeled recordings, validate on held-out ones, print a patch
    Fit(fit::Args),
    /// Learn a rule file from labeled recordings, validate on held-out groups of them
    Learn(learn::Args),
    /// Record a simulated demonstration
    Teach(teach::Args),
    /// Turn a recording into commands for a robot: trajectories, forces and grasps
    #[command(alias = "command")]
    Retarget(retarget::Args),
    /// Execute commands by a simulated robot in a scene, and record it
    Simulate(simulate::Args),
    /// Find how much a real cell may differ from the scene while the program still succeeds, with a statistical bound
    Certify(certify::Args),
    /// Prove that rules only add to others
    Prove(prove::Args),
    /// Compare two rule sets: the cases in which they differ, and their results on recordings
    Diff(diff::Args),
    /// Format rule files
    Fmt(fmt::Args),
    /// Draw the trees of rule files, or the transitions between primitives; mark the path of a recording
    Graph(graph::Args),
    /// Run the language server for editors: diagnostics, hover, names, completion
    Lsp(lsp::Args),
    /// List the shipped rules, scenes, operators, robots and bindings
    List(list::ListArgs),
    /// Print a shipped file
    Show(list::ShowArgs),
    /// Print the completion script of a shell
    Completions(help::CompletionsArgs),
    /// Print the manual page of a command
    Man(help::ManArgs),
}

/// The result of a command.
#[derive(PartialEq)]
enum Failure {
    /// The answer is no; it has been printed.
    Negative,
    /// The input cannot be used.
    Input(InputError),
    /// The input cannot be used; the reason has been printed.
    Unusable,
    /// The answer is no, with the exit status of its class.
    Fault(u8),
    /// The input cannot be used, and the whole text of why is here.
    Text(String),
    /// Several of them.
    Several(Vec<Failure>),
    /// The same, while other recordings of the command could be used.
    Partial(Vec<Failure>),
}

/// The exit status where some recordings could be used and others could not.
const PARTIAL: u8 = 3;

impl Failure {
    /// Succeeds for an empty list.
    fn all(failures: Vec<Self>) -> Result<(), Self> {
        if failures.is_empty() { Ok(()) } else { Err(Self::Several(failures)) }
    }

    /// As [`all`](Self::all); the failures are partial where some recordings, `done` of them, could be used.
    fn some(failures: Vec<Self>, done: usize) -> Result<(), Self> {
        match Self::all(failures) {
            Err(Self::Several(failures)) if done > 0 => Err(Self::Partial(failures)),
            all => all,
        }
    }

    /// The same with the name of the recording, where the failure does not say which one of several it is about.
    fn of_log(self, log: &Path) -> Self {
        let name = log.display().to_string();
        match self {
            Self::Input(error) if !error.place.contains(&name) => {
                let place = format!("{name}: {}", error.place);
                Self::Input(InputError { place, ..error })
            }
            other => other,
        }
    }

    /// The same, found while something was read that named the cause.
    fn named_in(self, file: &str) -> Self {
        match self {
            Self::Text(text) => Self::Text(format!("{file}: a file that it names cannot be used\n{text}")),
            other => other,
        }
    }

    /// What it is about, of several failures the first; `None` if it has been printed.
    fn kind(&self) -> Option<ErrorKind> {
        match self {
            Self::Negative | Self::Unusable | Self::Fault(_) => None,
            Self::Input(error) => Some(error.kind.unwrap_or(ErrorKind::Argument)),
            Self::Text(_) => Some(ErrorKind::Rules),
            Self::Several(failures) | Self::Partial(failures) => failures.iter().find_map(Self::kind),
        }
    }

    /// Prints the failure and returns the exit status.
    fn report(&self) -> u8 {
        // The Python package asks for the kind, which is the class of its exception.
        if let (Some(kind), Some(_)) = (self.kind(), std::env::var_os("TEACHTREE_ERROR_KIND")) {
            output::complain(&format!("kind: {}", format!("{kind:?}").to_lowercase()));
        }
        match self {
            Self::Negative => return 1,
            Self::Unusable => return 2,
            Self::Fault(status) => return *status,
            Self::Input(error) => output::complain(&format!("error: {error}")),
            Self::Text(text) => output::complain(text.strip_suffix('\n').unwrap_or(text)),
            Self::Several(failures) | Self::Partial(failures) => {
                parallel::texts(failures)
                    .iter()
                    .for_each(|text| output::complain(text.strip_suffix('\n').unwrap_or(text)));
                let answers = failures.iter().all(|failure| matches!(failure, Self::Negative));
                return match self {
                    Self::Partial(_) => PARTIAL,
                    _ if answers => 1,
                    _ => 2,
                };
            }
        }
        2
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        if error.kind() == ErrorKind::Rules {
            return Self::Text(error.rendered(output::color_on_stderr()));
        }
        Self::Input(error.into_input())
    }
}

impl From<InputError> for Failure {
    fn from(error: InputError) -> Self {
        Self::Input(error)
    }
}

/// The command line as clap knows it.
fn command() -> clap::Command {
    help::grouped(Cli::command())
}

/// Installs handlers that remove temporary files when Ctrl-C or a termination signal ends the program.
fn interruptible() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        // Without the handler, the next run removes the files.
        let _ = ctrlc::set_handler(|| interrupted(|| std::process::exit(INTERRUPTED)));
        #[cfg(unix)]
        terminable();
    });
}

/// Installs the same handler for SIGTERM, which service managers send, and SIGHUP, which a closed terminal sends. The program then ends with the
/// status of that signal.
#[cfg(unix)]
fn terminable() {
    use signal_hook::consts::{SIGHUP, SIGTERM};
    let taken = [SIGTERM, SIGHUP].into_iter().filter(|signal| !is_ignored(*signal));
    let Ok(mut signals) = signal_hook::iterator::Signals::new(taken) else { return };
    std::thread::spawn(move || {
        for signal in signals.forever() {
            interrupted(|| {
                let _ = signal_hook::low_level::emulate_default_handler(signal);
                std::process::exit(128 + signal)
            });
        }
    });
}

/// Whether a signal was ignored when the program started: `nohup` uses this to keep programs running after their terminal is closed. The state is
/// available on Linux only.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| (mask >> (signal - 1)) & 1 == 1)
}

fn interrupted(end: impl FnOnce()) {
    // The value behind a poisoned lock is complete.
    let stop = ON_INTERRUPT.lock().unwrap_or_else(PoisonError::into_inner).take();
    if let Some(stop) = stop {
        return stop();
    }
    let _nothing_is_written = atomic_write::abort_writes();
    end();
}

/// The action that the first termination signal runs instead of ending the program.
static ON_INTERRUPT: Mutex<Option<Box<dyn FnOnce() + Send>>> = Mutex::new(None);

/// Runs `stop` on the first Ctrl-C, SIGTERM or SIGHUP instead of ending the program. The second signal ends it.
fn on_interrupt(stop: impl FnOnce() + Send + 'static) {
    *ON_INTERRUPT.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(stop));
}

/// The exit status of an interrupted program, by the convention of shells.
const INTERRUPTED: i32 = 130;

/// Prints help, the version, or what is wrong with the command line.
fn usage(error: &clap::Error) -> u8 {
    let color = if error.use_stderr() { output::color_on_stderr() } else { output::color() };
    let text = if color { error.render().ansi().to_string() } else { error.render().to_string() };
    if error.use_stderr() {
        output::complain(text.trim_end());
    } else if let Err(error) = output::print(&text) {
        output::complain(&format!("error: {error}"));
        return 2;
    }
    u8::try_from(error.exit_code()).unwrap_or(2)
}

/// What is shown while a command works that may take long; nothing with `--quiet`, and where the command prints as it goes.
fn activity_label(matches: &clap::ArgMatches) -> Option<String> {
    let (name, of) = matches.subcommand()?;
    let is_quiet = of.try_get_one::<bool>("quiet").ok().flatten() == Some(&true);
    let is_live = of.try_get_one::<bool>("live").ok().flatten() == Some(&true);
    (!is_quiet && !is_live && !matches!(name, "live" | "lsp" | "studio")).then(|| name.to_string())
}

/// Runs the command line of this process.
pub fn main() -> ExitCode {
    ExitCode::from(run(std::env::args_os()))
}

/// Runs a command line, whose first word is the name of the program; returns the exit status.
pub fn run(words: impl IntoIterator<Item = OsString>) -> u8 {
    interruptible();
    let read = command().try_get_matches_from(words);
    let read = read.and_then(|matches| Cli::from_arg_matches(&matches).map(|cli| (cli, matches)));
    let (cli, matches) = match read {
        Ok(read) => read,
        Err(error) => return usage(&error),
    };
    cli.printed.apply();
    if let Err(error) = misplaced_files::check(&command(), &matches) {
        return Failure::Input(error).report();
    }
    let label = activity_label(&matches);
    let working = label.map(|label| progress::ActivityIndicator::new(&label));
    let outcome = match &cli.command {
        Command::Demo(args) => demo::run(args),
        Command::Check(args) => check::run(args),
        Command::Init(args) => init::run(args),
        Command::Inspect(args) => inspect::run(args),
        Command::Config(args) => config::run(args),
        Command::Analyze(args) => analyze::run(args),
        Command::Annotate(args) => annotate::run(args),
        Command::Export(target) => export::run(target),
        Command::Audit(args) => audit::run(args),
        Command::Live(args) => live::run(args),
        Command::Explain(args) => explain::run(args),
        Command::Test(args) => test::run(args),
        Command::Score(args) => score::run(args),
        Command::Agree(args) => agree::run(args),
        Command::Studio(args) => studio::run(args),
        Command::Fit(args) => fit::run(args),
        Command::Learn(args) => learn::run(args),
        Command::Teach(args) => teach::run(args),
        Command::Retarget(args) => retarget::run(args),
        Command::Simulate(args) => simulate::run(args),
        Command::Certify(args) => certify::run(args),
        Command::Prove(args) => prove::run(args),
        Command::Diff(args) => diff::run(args),
        Command::Fmt(args) => fmt::run(args),
        Command::Graph(args) => graph::run(args),
        Command::Lsp(args) => lsp::run(args),
        Command::List(args) => list::list(args),
        Command::Show(args) => list::show(args),
        Command::Completions(args) => help::completions(args, command()),
        Command::Man(args) => help::man(args, command()),
    };
    drop(working);
    match outcome {
        Ok(()) => 0,
        Err(failure) => failure.report(),
    }
}
