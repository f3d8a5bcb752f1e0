//! `teachtree audit`: the recordings of a set that should not be trained on, with the reasons.

mod signals;

use super::analysis::{AnalysisArgs, ExpectArg};
use super::output_args::{FormatArg, OutArg};
use super::parallel::{Issues, LogResults, ParallelArgs, counts, named_failures};
use super::{Failure, output};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use teachtree_analysis::audit::{Facts, FindingKind, compare, failure_counts, task_counts, unchecked};
use teachtree_analysis::json::{Meta, VERSION};
use teachtree_base::error::InputError;
use teachtree_base::hands::TrackId;
use teachtree_logs::atomic_write::Files;
use teachtree_logs::read::formats;
use teachtree_report::audit::{self as report, Audit};
use teachtree_session::{AnalysisInternals, LogInternals};

/// Options of `audit`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree audit recordings/\n  teachtree audit my_set bags/*.mcap\n  teachtree audit my_set --binding arm.binding.yaml --page audit.html --keep keep.json\n  teachtree audit my_set --binding arm.binding.yaml --rules my_failures.rules --expect 'peg_in_hole x 2' --fail-on failure\n  teachtree audit demos.hdf5 --binding sim.binding.yaml --mask masked.hdf5\n  teachtree audit recordings/ --allow unlike --fail-on idle,cut_off --format csv -o findings.csv\nWithout a binding, recordings with foreign columns are audited by their stamps, values and images.\nExit status: 0 fine, 1 a recording has what --fail-on names, 2 bad usage or input, 3 some recordings failed and the others are audited."
)]
pub struct Args {
    /// Recordings, folders of them, LeRobot sets, HDF5 files; `set#0..9` for some episodes
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    #[command(flatten)]
    analysis: AnalysisArgs,
    #[command(flatten)]
    expect: ExpectArg,
    #[command(flatten)]
    form: FormatArg<Format>,
    #[command(flatten)]
    out: OutArg,
    /// Also write a page for browsers, with the segments of each recording
    #[arg(long, value_name = "FILE.html")]
    page: Option<PathBuf>,
    /// Also write a list of the good recordings: episode numbers of a LeRobot set, else names; JSON if the name ends in .json, else one a line
    #[arg(long, value_name = "FILE")]
    keep: Option<PathBuf>,
    /// One HDF5 file: also write a copy of it with the names of the good recordings in `mask/teachtree_audit`
    #[arg(long, value_name = "COPY.hdf5")]
    mask: Option<PathBuf>,
    /// Findings that a good recording may have
    #[arg(long, value_enum, value_name = "KIND,…", value_delimiter = ',')]
    allow: Vec<KindArg>,
    /// Findings with which the exit status is 1
    #[arg(long, value_enum, value_name = "KIND,…", value_delimiter = ',')]
    fail_on: Vec<KindArg>,
    /// Minimum time without motion that counts as a rest, s
    #[arg(long, value_name = "SECONDS", default_value = "3", value_parser = seconds)]
    rest: f64,
    #[command(flatten)]
    many: ParallelArgs,
}

/// Forms of an audit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// A table for the terminal
    Text,
    /// `teachtree.audit/1` (docs/formats.md)
    Json,
    /// A table with a row for each finding, and one for each recording without
    Csv,
}

/// What may be wrong with a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
#[value(rename_all = "snake_case")]
enum KindArg {
    /// The binding, the scene or a sensor contradicts the recording
    Setup,
    /// A task failed, and no later attempt succeeded
    Failure,
    /// Nothing is handled, or nothing moves for long
    Idle,
    /// It begins or ends in the middle of something
    CutOff,
    /// A hand let go of an object without having moved it
    FailedGrasp,
    /// The recording lacks a task that is expected, or that most recordings have
    LacksTask,
    /// Its steps are in another order than those of most
    OutOfOrder,
    /// It has other steps than most, or takes much longer or shorter
    Unlike,
    /// Frames are missing between others, or at the end of a video
    MissingFrames,
    /// Steps between stamps differ, or are not those of the rate
    UnevenStamps,
    /// Rows or messages have one stamp
    EqualStamps,
    /// Stamps go back
    StampsBack,
    /// Samples are far away from all others and from their neighbors
    Spike,
    /// A camera gives the same picture while things move
    FrozenCamera,
}

impl KindArg {
    const fn kind(self) -> FindingKind {
        match self {
            Self::Setup => FindingKind::Setup,
            Self::Failure => FindingKind::Failure,
            Self::Idle => FindingKind::Idle,
            Self::CutOff => FindingKind::CutOff,
            Self::FailedGrasp => FindingKind::FailedGrasp,
            Self::LacksTask => FindingKind::LacksTask,
            Self::OutOfOrder => FindingKind::OutOfOrder,
            Self::Unlike => FindingKind::Outlier,
            Self::MissingFrames => FindingKind::MissingFrames,
            Self::UnevenStamps => FindingKind::UnevenStamps,
            Self::EqualStamps => FindingKind::EqualStamps,
            Self::StampsBack => FindingKind::StampsBack,
            Self::Spike => FindingKind::Spike,
            Self::FrozenCamera => FindingKind::FrozenCamera,
        }
    }
}

/// Reads a time in s.
pub(super) fn seconds(text: &str) -> Result<f64, String> {
    let number = text.trim().strip_suffix('s').unwrap_or(text).trim();
    let value: Option<f64> = number.parse().ok().filter(|value: &f64| value.is_finite() && *value > 0.0);
    value.ok_or_else(|| "expected a time in s greater than 0, such as `2.5`".into())
}

/// Runs `audit`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let logs = logs(args)?;
    let inputs = args.analysis.checked_inputs(&logs, &outputs(args))?;
    check_mask(args)?;
    args.analysis.source.check(logs.len())?;
    if signals::is_for(args, &logs)? {
        return signals::run(args, &logs, &inputs);
    }
    let LogResults { done, failed } = args.many.each_log("auditing", &logs, |log| {
        // Both the rules and the rests need it in memory.
        let opened = args.analysis.read(log)?;
        let analysis = args.expect.analyze(&args.analysis, &opened)?;
        let carries = analysis.carries()?;
        let can_carry = |who: TrackId| carries.contains(&who);
        let (found, opened) = (analysis.found(), opened.opened()?);
        let (of_columns, unchecked) =
            signals::of_columns(args.analysis.source.binding_of(log)?.as_deref(), opened, [found.start_s, found.end_s]);
        let facts = Facts::new(found, &opened.recording, of_columns, args.rest, &can_carry);
        Ok((facts, analysis.meta().clone(), unchecked))
    })?;
    let meta = done.first().map(|(_, (_, meta, _))| meta.clone());
    let unchecked = done.iter().flat_map(|(_, (.., unchecked))| unchecked.iter().cloned()).collect();
    let done = done.into_iter().map(|(log, (facts, ..))| (log, facts)).collect();
    finish(args, done, failed, Checks { meta: meta.as_ref(), inputs: &inputs, unchecked })
}

/// How recordings were checked.
struct Checks<'a> {
    /// By which rules; nothing where there were none.
    meta: Option<&'a Meta>,
    inputs: &'a [PathBuf],
    /// Checks of columns that were left out.
    unchecked: BTreeSet<String>,
}

/// Compares the recordings and writes the audit.
fn finish(
    args: &Args,
    done: Vec<(&PathBuf, Facts)>,
    failed: Vec<(&PathBuf, Failure)>,
    checks: Checks,
) -> Result<(), Failure> {
    let names: Vec<String> = failed.iter().map(|(log, _)| log.display().to_string()).collect();
    let failures = named_failures(failed);
    let failed: Vec<(String, String)> = names.into_iter().zip(failures.iter().map(why)).collect();
    if done.is_empty() {
        return Failure::some(failures, 0);
    }
    let (audited, mut all): (Vec<&PathBuf>, Vec<Facts>) = done.into_iter().unzip();
    // Recordings are compared by what rules find.
    let usual = checks.meta.map_or(Vec::new(), |_| compare(&mut all));
    let unchecked: Vec<String> = unchecked(&all).into_iter().chain(checks.unchecked).collect();
    let (tasks, failures_by_task) = (task_counts(&all), failure_counts(&all));
    let recordings: Vec<(String, Facts)> = audited.iter().map(|log| log.display().to_string()).zip(all).collect();
    let allowed: Vec<FindingKind> = args.allow.iter().map(|kind| kind.kind()).collect();
    let audit = Audit {
        recordings: &recordings,
        failed: &failed,
        tasks: &tasks,
        failures: &failures_by_task,
        usual: &usual,
        unchecked: &unchecked,
        allowed: &allowed,
    };
    write(args, &audit, &audited, checks.meta, checks.inputs)?;
    let mut issues = Issues::default();
    audited.iter().zip(&recordings).for_each(|(log, (_, facts))| issues.add(log, &counts(facts.other_issues())));
    issues.summary().iter().for_each(|summary| output::note(summary));
    Failure::some(failures, recordings.len())?;
    let fails = |(_, facts): &(String, Facts)| {
        facts.findings.iter().any(|finding| args.fail_on.iter().any(|kind| kind.kind() == finding.kind))
    };
    if recordings.iter().any(fails) { Err(Failure::Negative) } else { Ok(()) }
}

/// Why a recording is not audited.
fn why(failure: &Failure) -> String {
    match failure {
        Failure::Input(error) => format!("{}: {}", error.place, error.message),
        Failure::Text(text) => text.lines().next().unwrap_or_default().to_string(),
        _ => String::new(),
    }
}

/// The recordings: all episodes of a set that is named.
fn logs(args: &Args) -> Result<Vec<PathBuf>, InputError> {
    let mut paths = Vec::new();
    for path in &args.logs {
        // `set#0..9` are chosen ones, `set` are all.
        let found = match formats::recording_of(path) {
            Some(_) => formats::chosen(path)?,
            None => formats::all_of(path)?,
        };
        paths.extend(found.unwrap_or_else(|| vec![path.clone()]));
    }
    args.analysis.logs(&paths)
}

fn outputs(args: &Args) -> Vec<&Path> {
    let outputs = args.out.file.iter().chain(&args.page).chain(&args.keep).chain(&args.mask);
    outputs.map(PathBuf::as_path).collect()
}

/// Refuses a mask of other recordings than those of one file, and one that is there, before the work is done.
fn check_mask(args: &Args) -> Result<(), InputError> {
    if let Some(mask) = &args.mask {
        let is_file = matches!(args.logs.as_slice(), [file] if file.is_file() && formats::is_hdf5(file)?);
        if !is_file || formats::all_of(first(args))?.is_none() {
            let message = "a mask needs one HDF5 file with several recordings, found another input";
            return Err(InputError::new("--mask", message).help("name that file alone, or write --keep FILE"));
        }
        output::refuse_existing(mask)?;
    }
    Ok(())
}

fn first(args: &Args) -> &Path {
    args.logs.first().map_or(Path::new(""), PathBuf::as_path)
}

fn write(
    args: &Args,
    audit: &Audit,
    audited: &[&PathBuf],
    meta: Option<&Meta>,
    inputs: &[PathBuf],
) -> Result<(), InputError> {
    let mut written = Files::default();
    let text = match args.form.format {
        Format::Text => report::text(audit, output::width()),
        Format::Json => report::json(audit, meta),
        Format::Csv => report::csv(audit)?,
    };
    if let Some(path) = &args.page {
        output::add(&mut written, path, &report::page(audit, meta), inputs)?;
    }
    if let Some(path) = &args.keep {
        output::add(&mut written, path, &keep(path, audit, audited), inputs)?;
    }
    args.out.add(&mut written, &text, inputs)?;
    if let Some(copy) = &args.mask {
        mask(first(args), copy, audit, audited, meta)?;
    }
    written.commit_anew()?;
    args.out.print(&args.form, &text)
}

/// The good recordings.
fn good<'a>(audit: &'a Audit, audited: &'a [&PathBuf]) -> impl Iterator<Item = &'a PathBuf> {
    let pairs = audited.iter().zip(audit.recordings);
    pairs.filter(|(_, (_, facts))| audit.is_good(facts)).map(|(log, _)| *log)
}

/// The list of good recordings. Those of a LeRobot set are numbers, as its loader takes them.
fn keep(path: &Path, audit: &Audit, audited: &[&PathBuf]) -> String {
    let is_episode = |log: &Path| formats::is_set(&formats::without_episode(log));
    let of_one_set = audited.iter().all(|log| is_episode(log))
        && audited.windows(2).all(|pair| match pair {
            [one, other] => formats::without_episode(one) == formats::without_episode(other),
            _ => true,
        });
    let value = |log: &PathBuf| -> Value {
        let name = formats::recording_of(log);
        let number = name.as_ref().and_then(|name| name.parse::<u64>().ok()).filter(|_| of_one_set);
        number.map_or_else(|| json!(log.display().to_string()), |number| json!(number))
    };
    let values: Vec<Value> = good(audit, audited).map(value).collect();
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json")) {
        return format!("{}\n", Value::from(values));
    }
    values.iter().map(|value| value.as_str().map_or_else(|| value.to_string(), str::to_string) + "\n").collect()
}

/// Writes a copy of a file with the names of the good recordings, as robomimic's filter keys.
fn mask(file: &Path, copy: &Path, audit: &Audit, audited: &[&PathBuf], meta: Option<&Meta>) -> Result<(), InputError> {
    use teachtree_logs::read::formats::hdf5::annotate::{AUDITED, Request, annotate};
    let names: Vec<String> = good(audit, audited).filter_map(|log| formats::recording_of(log)).collect();
    let rules = meta.map(|meta| json!({ "files": meta.rules, "digest": meta.digest }));
    let provenance = json!({ "version": VERSION, "rules": rules }).to_string();
    let lists = std::collections::BTreeMap::from([(AUDITED, names)]);
    let request = Request {
        layout: None,
        signals: &Default::default(),
        lists: &lists,
        successes: &Default::default(),
        provenance: &provenance,
        replace: true,
    };
    annotate(file, copy, &request)
}
