//! The files that `analyze` writes of one recording beside its output: the table of their options. Each kind of file has a file here.

mod frames;
mod mcap;
mod report;
mod trace;

use super::super::Failure;
use clap::{Args, ValueHint};
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;
use teachtree_logs::atomic_write::Files;
use teachtree_session::Analysis;

/// Options of the files.
#[derive(clap::Args)]
pub struct SinkArgs {
    /// Also write a page for browsers (one recording only)
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Also write labels, tasks and objects of each frame as a table, `.csv` or `.parquet` (one recording only)
    #[arg(long, value_name = "FILE")]
    frames: Option<PathBuf>,
    /// Signals, latches and channels of the rules whose values are added to the files of `--frames`, `--mcap` and `--trace`
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    signals: Vec<String>,
    /// Also write labels, signals and poses for viewers, and a layout for Foxglove beside the file (one recording only)
    #[arg(long, value_name = "FILE.mcap")]
    mcap: Option<PathBuf>,
    /// Also copy all messages of the log, an MCAP file, into the file of `--mcap`, which can then replace the log
    #[arg(long, requires = "mcap")]
    into: bool,
    /// Also write segments and tasks as events for Perfetto or `about:tracing`, a thread for each track (one recording only)
    #[arg(long, value_name = "FILE.json")]
    trace: Option<PathBuf>,
}

/// A kind of files about one recording.
struct Sink {
    /// The option.
    option: &'static str,
    /// What it writes, with an article.
    noun: &'static str,
    /// Refuses the name of a file, or recordings.
    check: fn(&SinkArgs, &Path, &[PathBuf]) -> Result<(), InputError>,
    /// The files that are written.
    places: fn(&Path) -> Vec<PathBuf>,
    /// Whether the values of signals are in it.
    has_signals: bool,
    /// Whether the log has to be in memory.
    needs_log: fn(&SinkArgs) -> bool,
    /// Makes the content of the file.
    content: for<'a> fn(&SinkArgs, &'a Path, &Path, &Analysis) -> Result<Content<'a>, Failure>,
}

/// Adds a file to those that are written together and replace no input.
pub type Content<'a> = Box<dyn FnOnce(&mut Files, &[PathBuf]) -> Result<(), InputError> + Send + 'a>;

impl Sink {
    /// A kind of files that need the log in memory.
    const fn new(
        [option, noun]: [&'static str; 2],
        content: for<'a> fn(&SinkArgs, &'a Path, &Path, &Analysis) -> Result<Content<'a>, Failure>,
    ) -> Self {
        let places = |path: &Path| vec![path.to_path_buf()];
        Self { option, noun, check: |_, _, _| Ok(()), places, has_signals: true, needs_log: |_| true, content }
    }
}

impl SinkArgs {
    /// The table of sinks that are given, in the order in which the files are written.
    fn given(&self) -> impl Iterator<Item = (&Path, Sink)> {
        let table = [
            (&self.report, report::SINK),
            (&self.frames, frames::SINK),
            (&self.trace, trace::SINK),
            (&self.mcap, mcap::SINK),
        ];
        table.into_iter().filter_map(|(path, sink)| Some((path.as_deref()?, sink)))
    }

    /// The options that name a file.
    pub fn files() -> Vec<clap::Id> {
        let command = Self::augment_args(clap::Command::default());
        let files = command.get_arguments().filter(|option| option.get_value_hint() == ValueHint::AnyPath);
        files.map(|option| option.get_id().clone()).collect()
    }

    /// Refuses several recordings, names of files, and signals that are in none of them.
    pub fn check(&self, logs: &[PathBuf]) -> Result<(), InputError> {
        for (path, Sink { option, noun, check, .. }) in self.given() {
            if logs.len() > 1 {
                return Err(InputError::new(option, format!("{noun} is written for one recording, found several")));
            }
            check(self, path, logs)?;
        }
        if self.signals.is_empty() || self.given().any(|(_, sink)| sink.has_signals) {
            return Ok(());
        }
        Err(InputError::new("--signals", "no output of this command contains values of signals")
            .help("name one: --frames FILE, --mcap FILE.mcap, or --trace FILE.json"))
    }

    /// The files that are written.
    pub fn places(&self) -> Vec<PathBuf> {
        self.given().flat_map(|(path, sink)| (sink.places)(path)).collect()
    }

    /// Whether the log has to be in memory.
    pub fn needs_log(&self) -> bool {
        self.given().any(|(_, sink)| (sink.needs_log)(self))
    }

    /// Makes the contents of the files.
    pub fn contents(&self, log: &Path, analysis: &Analysis) -> Result<Vec<Content<'_>>, Failure> {
        self.given().map(|(path, sink)| (sink.content)(self, path, log, analysis)).collect()
    }

    /// The signals whose values are asked for.
    fn signals(&self) -> Vec<&str> {
        self.signals.iter().map(String::as_str).collect()
    }
}
