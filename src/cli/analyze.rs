//! `teachtree analyze`: recordings in, named tasks out.

use super::mcap;
use super::parallel::{Issues, ParallelArgs};
use super::rules::{RuleArgs, read_by};
use super::source::SourceArgs;
use super::{Failure, batch, output, trace};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use teachtree_analysis::Subject;
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_logs::atomic_write::Files;
use teachtree_logs::issue::IssueKind;
use teachtree_logs::read::formats;
use teachtree_logs::read::formats::mcap::copy::file_of;
use teachtree_report::Style;
use teachtree_session::files::recordings;
use teachtree_session::{Analysis, ClosedSegment, Error, FrameTable};
use teachtree_session::{ErrorInternals, FrameTableInternals};

/// Options of `analyze`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree analyze demonstration.csv\n  teachtree analyze log.csv --binding lab.binding.yaml --format json\n  teachtree analyze demonstration.csv --rules tap.rules --report report.html\n  teachtree analyze 'set#*' --binding lab.binding.yaml --format json --out-dir analyses --resume\nExit status: 0 fine, 2 bad usage or input, 3 some recordings failed and the others are written."
)]
pub struct Args {
    /// Recordings of any format, or folders of them; `set#3`, `set#0..9`, `set#*` for episodes; `-` reads JSON lines and prints segments as they close
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<PathBuf>,
    #[command(flatten)]
    pub rules: RuleArgs,
    #[command(flatten)]
    pub source: SourceArgs,
    /// What to write
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
    /// Also report the confidence of boundaries and tasks, from runs with params a fifth smaller and larger
    #[arg(long)]
    pub confidence: bool,
    /// Where to write it; standard output when left out
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write a file for each recording into this folder, named as the recording
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["out", "report", "frames", "mcap", "trace"])]
    pub out_dir: Option<PathBuf>,
    /// Skip recordings whose file in `--out-dir` exists and was made from the same log, rules, params and version
    #[arg(long, requires = "out_dir")]
    pub resume: bool,
    /// Treat each file in a folder as a recording; otherwise, with a binding, a folder with tables of text is one recording in parts
    #[arg(long)]
    each: bool,
    /// Analyze the I-th of N parts of the recordings, counted from 1: for array jobs that share a folder
    #[arg(long, value_name = "I/N", value_parser = shard)]
    pub shard: Option<Shard>,
    #[command(flatten)]
    pub many: ParallelArgs,
    /// Also write a page for browsers (one recording only)
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Also write labels, tasks and objects of each frame as a table, `.csv` or `.parquet` (one recording only)
    #[arg(long, value_name = "FILE")]
    frames: Option<PathBuf>,
    /// Signals, latches and channels of the rules whose values are added to the files of `--frames`, `--mcap` and `--trace`
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    signals: Vec<String>,
    /// Also write labels, signals and poses for viewers, and beside it a layout for Foxglove (one recording only)
    #[arg(long, value_name = "FILE.mcap")]
    mcap: Option<PathBuf>,
    /// Also copy all messages of the log, an MCAP file, into the file of `--mcap`, so that it can replace the log
    #[arg(long, requires = "mcap")]
    into: bool,
    /// Also write segments and tasks as events for Perfetto or `about:tracing`, a thread for each track (one recording only)
    #[arg(long, value_name = "FILE.json")]
    trace: Option<PathBuf>,
}

/// Forms of an analysis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// A timeline for the terminal
    Text,
    /// `teachtree.analysis/2` (docs/formats.md); a document per line when there are several recordings
    Json,
    /// A table of segments and tasks, which `score --labels` reads too
    Csv,
    /// A file of ELAN, which `score --labels` reads too (one recording only, or with `--out-dir`)
    Eaf,
}

/// A part of the recordings: every `of`-th one, so that all parts have large and small ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Which part, from 1.
    pub at: usize,
    /// Number of parts.
    pub of: usize,
}

impl Shard {
    /// Whether the recording at a place of the list, from 0, is in this part.
    pub fn has(self, place: usize) -> bool {
        place % self.of == self.at - 1
    }
}

/// Reads `I/N`.
fn shard(text: &str) -> Result<Shard, String> {
    let parts = text.split_once('/').and_then(|(at, of)| Some((at.trim().parse().ok()?, of.trim().parse().ok()?)));
    match parts {
        Some((at, of)) if (1..=of).contains(&at) => Ok(Shard { at, of }),
        _ => Err("expected I/N with I from 1 to N, such as `3/16`".into()),
    }
}

/// Runs `analyze`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let found = recordings(&args.logs, args.source.binding.as_deref(), args.each)?;
    if let Some(folder) = &args.out_dir {
        return batch::run(args, folder, &found);
    }
    let mine = |place: usize| args.shard.is_none_or(|shard| shard.has(place));
    let found = found.into_iter().enumerate().filter(|(place, _)| mine(*place));
    let logs: Vec<PathBuf> = found.map(|(_, found)| found.log).collect();
    if args.report.is_some() && logs.len() > 1 {
        return Err(InputError::new("--report", "a report is of one recording, found several").into());
    }
    if args.format == Format::Eaf && logs.len() > 1 {
        return Err(InputError::new("--format", "a file of ELAN is of one recording, found several")
            .help("name a folder with --out-dir, which gets a file for each")
            .into());
    }
    if args.frames.is_some() && logs.len() > 1 {
        return Err(InputError::new("--frames", "a table of frames is of one recording, found several").into());
    }
    if let Some(path) = &args.frames {
        formats::check_name(path)?;
    }
    if let Some(path) = &args.trace
        && path.extension().is_some_and(|ending| !ending.eq_ignore_ascii_case("json"))
    {
        let message = "expected a name that ends in .json, which a trace is";
        return Err(InputError::new(path.display().to_string(), message).into());
    }
    if args.trace.is_some() && logs.len() > 1 {
        return Err(InputError::new("--trace", "a trace is of one recording, found several").into());
    }
    let views = views(args);
    if !args.signals.is_empty() && args.frames.is_none() && args.trace.is_none() && views.is_empty() {
        return Err(InputError::new("--signals", "the values of signals are in no output of this command")
            .help("name one: --frames FILE, --mcap FILE.mcap, or --trace FILE.json")
            .into());
    }
    if let Some(path) = &args.mcap {
        mcap::check_name(path)?;
        if logs.len() > 1 {
            return Err(InputError::new("--mcap", "a file for viewers is of one recording, found several").into());
        }
        if args.into {
            logs.iter().try_for_each(|log| file_of(log).map(drop))?;
        }
    }
    let outputs = args.out.iter().chain(&args.report).chain(&args.frames).chain(&args.trace).chain(&views);
    let outputs: Vec<&Path> = outputs.map(PathBuf::as_path).collect();
    output::refuse_one_for_two(&outputs)?;
    let files = if outputs.is_empty() { Vec::new() } else { read_by(&args.source, &args.rules) };
    let inputs: Vec<&Path> = logs.iter().chain(&files).map(PathBuf::as_path).collect();
    outputs.iter().try_for_each(|place| output::refuse_inputs(place, &inputs))?;
    let mut out = String::new();
    let mut failures = Vec::new();
    let (mut pages, mut tables, mut traces) = (Vec::new(), Vec::new(), Vec::new());
    let mut lanes = Vec::new();
    let mut issues = Issues::default();
    let mut done = 0;
    // Parts write alike, whatever is in them.
    let alone = logs.len() == 1 && args.shard.is_none();
    args.source.check(logs.len())?;
    let found = args.many.each("analyzing", &logs, |log| one(args, log, alone))?;
    for (log, found) in logs.iter().zip(found) {
        match found {
            // A table has one header.
            Ok(Output { text, kinds, page, frames, trace, lanes: of_log }) => {
                done += 1;
                pages.extend(page);
                tables.extend(frames);
                traces.extend(trace);
                lanes.extend(of_log);
                let header = if args.format == Format::Csv && !out.is_empty() {
                    text.find('\n').map_or(0, |at| at + 1)
                } else {
                    0
                };
                out.push_str(&text[header..]);
                // Only tables and files of ELAN have no place for them.
                let has_no_place = matches!(args.format, Format::Csv | Format::Eaf);
                if has_no_place && alone && !kinds.is_empty() {
                    args.many.warn(&omitted(log, &kinds));
                } else if has_no_place {
                    let each = kinds.iter().flat_map(|(kind, count)| std::iter::repeat_n(kind.name(), *count));
                    issues.add(&log.display().to_string(), each);
                }
            }
            // The other recordings are worth having all the same.
            Err(failure) if alone => failures.push(failure),
            Err(failure) => failures.push(failure.of_log(log)),
        }
    }
    // The files belong to one analysis, so either all of them are written or none.
    let mut written = Files::default();
    for (path, page) in args.report.iter().zip(&pages) {
        output::add(&mut written, path, page, &inputs)?;
    }
    for (path, table) in args.frames.iter().zip(&tables) {
        table.add(&mut written, path)?;
    }
    for (path, trace) in args.trace.iter().zip(&traces) {
        output::add(&mut written, path, trace, &inputs)?;
    }
    for (path, lanes) in args.mcap.iter().zip(&lanes) {
        written.add(path, |out| lanes.write(out))?;
        output::add(&mut written, &mcap::layout_of(path), &lanes.layout(), &inputs)?;
    }
    if let Some(path) = args.out.as_ref().filter(|_| !out.is_empty()) {
        output::add(&mut written, path, &out, &inputs)?;
    }
    written.commit_anew()?;
    match &args.out {
        Some(_) => {}
        None if args.format == Format::Text => output::print(&out)?,
        None if args.format == Format::Json => output::print_json(&out)?,
        None => output::print_data(&out)?,
    }
    issues.summary().filter(|_| !args.many.quiet).iter().for_each(|summary| output::complain(summary));
    Failure::some(failures, done)
}

/// The output of a recording, and its warnings.
pub struct Output {
    pub text: String,
    /// The kinds of its issues, each with how many there are.
    pub kinds: BTreeMap<IssueKind, usize>,
    page: Option<String>,
    frames: Option<FrameTable>,
    trace: Option<String>,
    lanes: Option<mcap::McapContent>,
}

/// The files for viewers.
fn views(args: &Args) -> Vec<PathBuf> {
    args.mcap.iter().flat_map(|path| [path.clone(), mcap::layout_of(path)]).collect()
}

/// What is written for viewers.
fn lanes(args: &Args, log: &Path, analysis: &Analysis) -> Result<Option<mcap::McapContent>, Failure> {
    if args.mcap.is_none() {
        return Ok(None);
    }
    let into = args.into.then(|| mcap::OriginalBag::of(log, analysis.log())).transpose()?;
    mcap::McapContent::new(analysis, &args.signals, into).map(Some)
}

/// Analyzes a recording, the only one or one of several, and returns its output.
pub fn one(args: &Args, log: &Path, alone: bool) -> Result<Output, Failure> {
    let prints = args.out.is_none() && args.out_dir.is_none();
    let analysis = if log == Path::new("-") && args.format == Format::Text && prints {
        live(args)?
    } else {
        let log = args.source.open(log).map_err(|error| in_parts(args, log, error))?;
        let reads_signals = args.trace.is_some() && !args.signals.is_empty();
        if args.report.is_some() || args.frames.is_some() || reads_signals || !views(args).is_empty() {
            log.read()?;
        }
        args.rules.load(&log)?.analyze(&log)?
    };
    let analysis = if args.confidence { analysis.with_confidence()? } else { analysis };
    let page = args.report.as_ref().map(|_| analysis.html()).transpose()?;
    let signals: Vec<&str> = args.signals.iter().map(String::as_str).collect();
    let frames = args.frames.as_ref().map(|_| analysis.frames(&signals)).transpose()?;
    let text = match args.format {
        Format::Text => timeline(&analysis, prints),
        Format::Json if alone => analysis.json(),
        Format::Json => analysis.json_line(),
        Format::Csv => analysis.csv()?,
        Format::Eaf => analysis.eaf(),
    };
    let mut kinds = BTreeMap::new();
    for issue in analysis.issues() {
        *kinds.entry(issue.kind).or_default() += 1;
    }
    let trace = args.trace.as_ref().map(|_| trace::trace(&analysis, &args.signals)).transpose()?;
    Ok(Output { text, kinds, page, frames, trace, lanes: lanes(args, log, &analysis)? })
}

/// An error about a folder that was taken for one recording in parts, with what else it may be.
fn in_parts(args: &Args, log: &Path, error: Error) -> Failure {
    let is_parts = log.is_dir() && !formats::is_set(log) && !formats::is_zarr(log) && !formats::is_bag(log);
    match Failure::from(error) {
        Failure::Input(error) if is_parts && args.source.binding.is_some() => {
            let is = "the folder was read as one recording in parts, a table each; with --each every file in it is one";
            let help = error.help.as_ref().map_or_else(|| is.to_string(), |help| format!("{help}; {is}"));
            Failure::Input(error.help(help))
        }
        other => other,
    }
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
fn omitted(log: &Path, kinds: &BTreeMap<IssueKind, usize>) -> String {
    let kinds: Vec<String> = kinds.iter().map(|(kind, count)| format!("{kind} {count}")).collect();
    format!("{}: the table omits issues, `--format text` prints them: {}", log.display(), kinds.join(", "))
}

/// The timeline, in colour where the terminal wants it.
pub fn timeline(analysis: &Analysis, to_terminal: bool) -> String {
    analysis.text(Style { color: to_terminal && output::color(), unicode: true, width: output::width() })
}
