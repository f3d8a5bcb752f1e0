//! `teachtree analyze`: recordings in, named tasks out.

use super::rules::{RuleArgs, load, read_by};
use super::source::{SourceArgs, recordings};
use super::{Failure, flowing, live, output, printable, tellable};
use crate::analysis::{self, Analysis, explain, json::Meta};
use crate::base::error::InputError;
use crate::engine::evaluator::evaluate;
use crate::engine::runs::Leaves;
use crate::graph::lower;
use crate::language::Rules;
use crate::report::{self, Style};
use crate::stream::binding::{BindingFile, Pattern};
use crate::stream::{self, OpenRequest, Opened, frames::Frames};
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
}

/// Forms of an analysis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// A timeline for people
    Text,
    /// `teachtree.analysis/1`; one document after another when there are several recordings
    Json,
    /// A table of segments and tasks
    Csv,
}

/// An analysed recording.
pub struct Analysed {
    /// What the rules read.
    pub frames: Frames,
    /// What the trees gave.
    pub leaves: Vec<Leaves>,
    /// What was found.
    pub analysis: Analysis,
    /// What was analysed, by which rules.
    pub meta: Meta,
}

impl Analysed {
    /// The same with its rules, to be explained.
    pub fn explained<'a>(&'a self, rules: &'a Rules) -> explain::Analysed<'a> {
        explain::Analysed { rules, frames: &self.frames, leaves: &self.leaves, analysis: &self.analysis }
    }
}

/// Runs `analyze`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let logs = recordings(&args.logs, args.source.binding.as_deref())?;
    if args.report.is_some() && logs.len() > 1 {
        return Err(InputError::new("--report", "a report is of one recording, found several").into());
    }
    let outputs: Vec<&Path> = args.out.iter().chain(&args.report).map(PathBuf::as_path).collect();
    output::refuse_one_for_two(&outputs)?;
    let files = if outputs.is_empty() { Vec::new() } else { read_by(&args.source, &args.rules) };
    let inputs: Vec<&Path> = logs.iter().chain(&files).map(PathBuf::as_path).collect();
    outputs.iter().try_for_each(|place| output::refuse_inputs(place, &inputs))?;
    let mut out = String::new();
    let mut failures = Vec::new();
    // All cores share the recordings; what is found comes in the order in which they were named.
    let found: Vec<Result<Told, Failure>> = logs.par_iter().map(|log| one(args, log, &inputs)).collect();
    for found in found {
        match found {
            // A table has one header.
            Ok(Told { text, warning }) => {
                let header = if args.format == Format::Csv && !out.is_empty() {
                    text.find('\n').map_or(0, |at| at + 1)
                } else {
                    0
                };
                out.push_str(&text[header..]);
                if let Some(warning) = warning {
                    eprintln!("warning: {}", printable(&warning));
                }
            }
            // The other recordings are worth having all the same.
            Err(failure) => failures.push(failure),
        }
    }
    match &args.out {
        Some(_) if out.is_empty() => {}
        Some(path) => output::write(path, &out, &inputs)?,
        None => output::print(&out)?,
    }
    Failure::all(failures)
}

/// What is said about a recording: for whoever reads the output, and for whoever started the program.
struct Told {
    text: String,
    warning: Option<String>,
}

/// Analyses one recording: what is to be said about it.
fn one(args: &Args, log: &Path, inputs: &[&Path]) -> Result<Told, Failure> {
    let request = args.source.request(log);
    if args.report.is_none()
        && let Some((rules, analysis)) = flowing::analyse(&args.rules, &request)
    {
        let meta = meta(&rules, log, None, args.rules.set.clone());
        return written(&analysis, &meta, args.format, args.out.is_none());
    }
    let opened = if log == Path::new("-") && args.format == Format::Text && args.out.is_none() {
        live(args, &request)?
    } else {
        stream::open(&request)?
    };
    let rules = load(&args.rules, &opened)?;
    let binding = args.source.binding.as_ref().map(|path| path.display().to_string());
    let params = opened.params.iter().chain(&args.rules.set).cloned().collect();
    let analysed = analyse(&rules, &opened, binding, params)?;
    if let Some(path) = &args.report {
        let page = report::html(&analysed.explained(&rules), &opened.recording, &analysed.meta)?;
        output::write(path, &page, inputs)?;
    }
    written(&analysed.analysis, &analysed.meta, args.format, args.out.is_none())
}

/// Reads a recording from standard input and prints its segments as they close.
fn live(args: &Args, request: &OpenRequest) -> Result<Opened, Failure> {
    // The rules are the same each time; they are known when the binding, if there is one, has named its hand file.
    let mut rules = None;
    let mut analysis_of = |source| {
        let opened = stream::open_source(source, request)?;
        if rules.is_none() {
            rules = Some(load(&args.rules, &opened)?);
        }
        match &rules {
            Some(rules) => Ok(analyse(rules, &opened, None, vec![])?.analysis),
            None => Ok(Analysis::default()),
        }
    };
    let time = match &args.source.binding {
        Some(binding) => BindingFile::read(binding)?.binding.time,
        None => Pattern::parse("time").map_err(|message| InputError::new("time", message))?,
    };
    let source = live::read(std::io::stdin().lock(), &time, &mut analysis_of, &mut live::say)?;
    Ok(stream::open_source(source, request)?)
}

/// Runs the rules over an opened recording.
pub fn analyse(
    rules: &Rules,
    opened: &Opened,
    binding: Option<String>,
    params: Vec<(String, String)>,
) -> Result<Analysed, Failure> {
    let frames = opened.frames(&report::channels(rules))?;
    analysis::check_rate(rules, frames.layout.rate_hz)?;
    let graph = lower(rules);
    let leaves = evaluate(&graph, &frames)?;
    let mut analysis = analysis::analyse(rules, &frames, &leaves);
    if binding.is_some() {
        // Logs of other people measure what they measure.
        analysis.issues.extend(tellable::issues(&graph, &frames));
    }
    let meta = meta(rules, &opened.log, binding, params);
    Ok(Analysed { frames, leaves, analysis, meta })
}

fn meta(rules: &Rules, log: &Path, binding: Option<String>, params: Vec<(String, String)>) -> Meta {
    Meta {
        log: log.display().to_string(),
        binding,
        rules: rules.sources.files.iter().map(|file| file.name.clone()).collect(),
        digest: rules.digest(),
        params,
    }
}

fn written(analysis: &Analysis, meta: &Meta, format: Format, to_terminal: bool) -> Result<Told, Failure> {
    let text = match format {
        Format::Text => drawn(analysis, meta, to_terminal),
        Format::Json => analysis::json::json(analysis, meta),
        Format::Csv => analysis::csv::csv(analysis, meta)?,
    };
    let untold = format == Format::Csv && !analysis.issues.is_empty();
    Ok(Told { text, warning: untold.then(|| issues(analysis, meta)) })
}

/// The issues of a log, for a table that has no place for them.
fn issues(analysis: &Analysis, meta: &Meta) -> String {
    let mut kinds: BTreeMap<&str, usize> = BTreeMap::new();
    for issue in &analysis.issues {
        *kinds.entry(&issue.kind).or_default() += 1;
    }
    let kinds: Vec<String> = kinds.iter().map(|(kind, count)| format!("{kind} {count}")).collect();
    format!("{}: has issues that the table does not tell, `--format text` does: {}", meta.log, kinds.join(", "))
}

/// The timeline, in colour where the terminal wants it.
pub fn timeline(analysed: &Analysed, to_terminal: bool) -> String {
    drawn(&analysed.analysis, &analysed.meta, to_terminal)
}

fn drawn(analysis: &Analysis, meta: &Meta, to_terminal: bool) -> String {
    let style = Style { color: to_terminal && output::color(), unicode: true, width: output::width() };
    report::text(analysis, meta, style)
}
