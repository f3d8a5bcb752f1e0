//! `teachtree analyze`: recordings in, named tasks out.

use super::rules::{RuleArgs, read_by};
use super::source::SourceArgs;
use super::{Failure, output};
use crate::analysis::Subject;
use crate::base::error::{ErrorKind, InputError};
use crate::report::Style;
use crate::session::files::recordings;
use crate::session::{Analysis, ClosedSegment, Error};
use crate::stream::atomic_write::Files;
use crate::stream::read::formats;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Options of `analyze`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree analyze demonstration.csv\n  teachtree analyze log.csv --binding lab.binding.yaml --format json\n  teachtree analyze demonstration.csv --rules tap.rules --report report.html"
)]
pub struct Args {
    /// Recordings of any format, or folders of them, `set#3` for an episode; `-` reads JSON lines and prints segments as they close
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    #[command(flatten)]
    rules: RuleArgs,
    #[command(flatten)]
    source: SourceArgs,
    /// What to write
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Where to write it; standard output when left out
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Also write a page for browsers (one recording only)
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Also write labels, tasks and objects of each frame as a table, `.csv` or `.parquet` (one recording only)
    #[arg(long, value_name = "FILE")]
    frames: Option<PathBuf>,
    /// Signals, latches and channels of the rules whose values the table of `--frames` has too
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', requires = "frames")]
    signals: Vec<String>,
}

/// Forms of an analysis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// A timeline for the terminal
    Text,
    /// `teachtree.analysis/2` (docs/formats.md); a document per line when there are several recordings
    Json,
    /// A table of segments and tasks
    Csv,
}

/// Runs `analyze`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let logs = recordings(&args.logs, args.source.binding.as_deref())?;
    if args.report.is_some() && logs.len() > 1 {
        return Err(InputError::new("--report", "a report is of one recording, found several").into());
    }
    if args.frames.is_some() && logs.len() > 1 {
        return Err(InputError::new("--frames", "a table of frames is of one recording, found several").into());
    }
    if let Some(path) = &args.frames {
        formats::check_name(path)?;
    }
    let outputs: Vec<&Path> = args.out.iter().chain(&args.report).chain(&args.frames).map(PathBuf::as_path).collect();
    output::refuse_one_for_two(&outputs)?;
    let files = if outputs.is_empty() { Vec::new() } else { read_by(&args.source, &args.rules) };
    let inputs: Vec<&Path> = logs.iter().chain(&files).map(PathBuf::as_path).collect();
    outputs.iter().try_for_each(|place| output::refuse_inputs(place, &inputs))?;
    let mut out = String::new();
    let mut failures = Vec::new();
    let mut pages = Vec::new();
    // All cores share the recordings; what is found comes in the order in which they were named.
    let found: Vec<Result<Told, Failure>> = logs.par_iter().map(|log| one(args, log, logs.len() == 1)).collect();
    for found in found {
        match found {
            // A table has one header.
            Ok(Told { text, warning, page }) => {
                pages.extend(page);
                let header = if args.format == Format::Csv && !out.is_empty() {
                    text.find('\n').map_or(0, |at| at + 1)
                } else {
                    0
                };
                out.push_str(&text[header..]);
                if let Some(warning) = warning {
                    output::complain(&format!("warning: {warning}"));
                }
            }
            // The other recordings are worth having all the same.
            Err(failure) => failures.push(failure),
        }
    }
    // The page and the text are of one analysis: both are written or neither.
    let mut written = Files::default();
    for (path, page) in args.report.iter().zip(&pages) {
        output::add(&mut written, path, page, &inputs)?;
    }
    if let Some(path) = args.out.as_ref().filter(|_| !out.is_empty()) {
        output::add(&mut written, path, &out, &inputs)?;
    }
    written.commit()?;
    match &args.out {
        Some(_) => {}
        None if args.format == Format::Text => output::print(&out)?,
        None if args.format == Format::Json => output::print_json(&out)?,
        None => output::print_data(&out)?,
    }
    Failure::all(failures)
}

/// What is said about a recording: for whoever reads the output, and for whoever started the program.
struct Told {
    text: String,
    warning: Option<String>,
    page: Option<String>,
}

/// Analyzes a recording, the only one or one of several: what is to be said about it.
fn one(args: &Args, log: &Path, alone: bool) -> Result<Told, Failure> {
    let analysis = if log == Path::new("-") && args.format == Format::Text && args.out.is_none() {
        live(args)?
    } else {
        let log = args.source.open(log)?;
        if args.report.is_some() || args.frames.is_some() {
            log.read()?;
        }
        args.rules.load(&log)?.analyze(&log)?
    };
    let page = args.report.as_ref().map(|_| analysis.html()).transpose()?;
    if let Some(path) = &args.frames {
        analysis.frames(&args.signals)?.write(path)?;
    }
    let text = match args.format {
        Format::Text => timeline(&analysis, args.out.is_none()),
        Format::Json if alone => analysis.json(),
        Format::Json => analysis.json_line(),
        Format::Csv => analysis.csv()?,
    };
    let untold = args.format == Format::Csv && !analysis.issues().is_empty();
    Ok(Told { text, warning: untold.then(|| issues(&analysis)), page })
}

/// Reads a recording from standard input and prints its segments as they close.
fn live(args: &Args) -> Result<Analysis, Error> {
    let input = std::io::stdin().lock();
    args.source.options().follow(
        input,
        &args.rules.options(),
        &mut |ClosedSegment { track, primitive, object, partner, start_s, end_s, .. }| {
            let subject = Subject { object: object.clone(), partner: partner.clone() };
            let name = format!("{primitive}{}", subject.suffix());
            let line = format!("{track:<6} {name:<24} {start_s:8.3} – {end_s:8.3} s\n");
            output::print(&line).map_err(|error| Error::new(error, ErrorKind::Io))
        },
    )
}

/// The issues of a log, for a table that has no place for them.
fn issues(analysis: &Analysis) -> String {
    let mut kinds: BTreeMap<&str, usize> = BTreeMap::new();
    for issue in analysis.issues() {
        *kinds.entry(&issue.kind).or_default() += 1;
    }
    let kinds: Vec<String> = kinds.iter().map(|(kind, count)| format!("{kind} {count}")).collect();
    format!("{}: the table omits issues, `--format text` prints them: {}", analysis.log(), kinds.join(", "))
}

/// The timeline, in colour where the terminal wants it.
pub fn timeline(analysis: &Analysis, to_terminal: bool) -> String {
    analysis.text(Style { color: to_terminal && output::color(), unicode: true, width: output::width() })
}
