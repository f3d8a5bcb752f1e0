//! `teachtree analyze`: recordings in, named tasks out.

mod sinks;
mod writers;

use super::analysis::{AnalysisArgs, ExpectArg};
use super::fail_on::FailOnArg;
use super::output_args::{FormatArg, OutArg};
use super::parallel::{Issues, ParallelArgs, counts};
use super::{Failure, batch, output};
use sinks::{Content, SinkArgs};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use teachtree_analysis::Subject;
use teachtree_base::error::ErrorKind;
use teachtree_logs::atomic_write::Files;
use teachtree_logs::issue::IssueKind;
use teachtree_report::Style;
use teachtree_session::ErrorInternals;
use teachtree_session::{Analysis, ClosedSegment, Error};
use writers::{Format, Usage};

/// Options of `analyze`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree analyze demonstration.csv\n  teachtree analyze log.csv --binding lab.binding.yaml --format json\n  teachtree analyze log.csv --expect 'peg_in_hole x 2, turn_screw'\n  teachtree analyze log.csv --fail-on failure,implausible_unit\n  teachtree analyze demonstration.csv --rules tap.rules --report report.html\n  teachtree analyze 'set#*' --binding lab.binding.yaml --format json --out-dir analyses --resume\nExit status: 0 fine whatever the outcome, 1 a recording lacks what --expect names or has what --fail-on names, 2 bad usage or input, 3 some recordings failed and the others are written."
)]
pub struct Args {
    /// Recordings of any format, or folders of them; `set#3`, `set#0..9`, `set#*` for episodes; `-` reads JSON lines and prints segments as they close
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<PathBuf>,
    #[command(flatten)]
    pub analysis: AnalysisArgs,
    #[command(flatten)]
    pub expect: ExpectArg,
    #[command(flatten)]
    pub fail_on: FailOnArg,
    #[command(flatten)]
    pub form: FormatArg<Format>,
    /// Also report the confidence of boundaries and the stability of tasks, from variations of params and log
    #[arg(long)]
    pub confidence: bool,
    #[command(flatten)]
    out: OutArg,
    /// Write a file for each recording, named like the recording, into this folder
    #[arg(long, value_name = "FOLDER", conflicts_with = "out", conflicts_with_all = SinkArgs::files())]
    pub out_dir: Option<PathBuf>,
    /// Skip recordings whose file in `--out-dir` was made from the same log, rules, params and version
    #[arg(long, requires = "out_dir", conflicts_with_all = ["expect", "fail_on"])]
    pub resume: bool,
    /// Analyze the I-th of N parts of the recordings, counted from 1: for array jobs that share a folder
    #[arg(long, value_name = "I/N", value_parser = shard)]
    pub shard: Option<Shard>,
    #[command(flatten)]
    pub many: ParallelArgs,
    #[command(flatten)]
    sinks: SinkArgs,
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
    let found = args.analysis.recordings(&args.logs)?;
    if let Some(folder) = &args.out_dir {
        return batch::run(args, folder, &found);
    }
    let mine = |place: usize| args.shard.is_none_or(|shard| shard.has(place));
    let found = found.into_iter().enumerate().filter(|(place, _)| mine(*place));
    let logs: Vec<PathBuf> = found.map(|(_, found)| found.log).collect();
    let writer = args.form.format.writer();
    (writer.check)(logs.len())?;
    args.sinks.check(&logs)?;
    let places = args.sinks.places();
    let outputs: Vec<&Path> = args.out.file.iter().chain(&places).map(PathBuf::as_path).collect();
    let inputs = args.analysis.checked_inputs(&logs, &outputs)?;
    // Parts write alike, whatever is in them.
    let alone = logs.len() == 1 && args.shard.is_none();
    args.analysis.source.check(logs.len())?;
    let found = args.many.each("analyzing", &logs, |log| one(args, log, alone))?;
    let (mut out, mut files, mut issues) = (String::new(), Vec::new(), Issues::default());
    let (mut done, mut failures, mut is_accepted) = (0, Vec::new(), true);
    for (log, found) in logs.iter().zip(found) {
        match found {
            Ok(Output { text, kinds, files: of_log, is_accepted: it }) => {
                done += 1;
                is_accepted &= it;
                files.extend(of_log);
                (writer.join)(&mut out, &text);
                if writer.omits_issues && alone && !kinds.is_empty() {
                    output::warn(&omitted(log, &kinds));
                } else if writer.omits_issues {
                    issues.add(log, &kinds);
                }
            }
            // The results of the other recordings are still useful.
            Err(failure) if alone => failures.push(failure),
            Err(failure) => failures.push(failure.of_log(log)),
        }
    }
    // The files belong to one analysis, so either all of them are written or none.
    let mut written = Files::default();
    files.into_iter().try_for_each(|add| add(&mut written, &inputs))?;
    if !out.is_empty() {
        args.out.add(&mut written, &out, &inputs)?;
    }
    written.commit_anew()?;
    args.out.print(&args.form, &out)?;
    issues.summary().iter().for_each(|summary| output::note(summary));
    Failure::some(failures, done)?;
    if is_accepted { Ok(()) } else { Err(Failure::Negative) }
}

/// The output of a recording, and its warnings.
pub struct Output<'a> {
    pub text: String,
    /// The kinds of its issues, each with how many there are.
    pub kinds: BTreeMap<IssueKind, usize>,
    files: Vec<Content<'a>>,
    /// Whether it contains what `--expect` names, and nothing that `--fail-on` names.
    pub is_accepted: bool,
}

/// Analyzes a recording, the only one or one of several, and returns its output.
pub fn one<'a>(args: &'a Args, log: &Path, alone: bool) -> Result<Output<'a>, Failure> {
    let is_printed = args.out.file.is_none() && args.out_dir.is_none();
    let analysis = if log == Path::new("-") && args.form.format == Format::Text && is_printed {
        args.expect.of(live(args)?)?
    } else {
        let log = args.analysis.source.open(log)?;
        if args.sinks.needs_log() {
            log.read()?;
        }
        args.expect.analyze(&args.analysis, &log)?
    };
    let is_as_expected = args.expect.expect.is_none() || analysis.outcome().is_as_expected == Some(true);
    let is_accepted = is_as_expected && !args.fail_on.is_found(&analysis);
    let analysis = if args.confidence { analysis.with_confidence()? } else { analysis };
    let text = (args.form.format.writer().text)(&analysis, Usage { alone, is_printed })?;
    let kinds = counts(analysis.issues());
    Ok(Output { text, kinds, files: args.sinks.contents(log, &analysis)?, is_accepted })
}

/// Reads a recording from standard input and prints its segments as they close.
fn live(args: &Args) -> Result<Analysis, Error> {
    let input = std::io::stdin().lock();
    args.analysis.source.options().follow(
        input,
        &args.analysis.rules.options(),
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

/// The timeline, in color where the terminal wants it.
pub fn timeline(analysis: &Analysis, to_terminal: bool) -> String {
    analysis.text(Style { color: to_terminal && output::color(), unicode: true, width: output::width() })
}
