//! `teachtree audit`: the recordings of a set that should not be trained on, with the reasons.

use super::parallel::ParallelArgs;
use super::rules::{RuleArgs, read_by};
use super::source::SourceArgs;
use super::{Failure, output};
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};
use teachtree_analysis::audit::{Facts, FindingKind, compare, task_counts, unchecked};
use teachtree_analysis::json::{Meta, VERSION, printed};
use teachtree_base::error::InputError;
use teachtree_base::hands::TrackId;
use teachtree_logs::atomic_write::Files;
use teachtree_logs::read::formats;
use teachtree_report::audit::{Audit, page, text};
use teachtree_session::files::recordings;
use teachtree_session::{AnalysisInternals, LogInternals};

/// The schema of the JSON document.
const SCHEMA: &str = "teachtree.audit/1";

/// Options of `audit`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree audit recordings/\n  teachtree audit my_set --binding arm.binding.yaml --page audit.html --keep keep.json\n  teachtree audit demos.hdf5 --binding sim.binding.yaml --mask masked.hdf5\n  teachtree audit recordings/ --allow unlike --fail-on idle,cut_off --format csv -o findings.csv\nExit status: 0 fine, 1 a recording has what --fail-on names, 2 bad usage or input, 3 some recordings failed and the others are audited."
)]
pub struct Args {
    /// Recordings, folders of them, LeRobot sets, HDF5 files; `set#0..9` for some episodes
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
    /// Also write a page for browsers, with the segments of each recording
    #[arg(long, value_name = "FILE.html")]
    page: Option<PathBuf>,
    /// Also write a list of the good recordings: numbers of episodes of a LeRobot set, names of others; JSON if the name ends in .json, else a line each
    #[arg(long, value_name = "FILE")]
    keep: Option<PathBuf>,
    /// One HDF5 file: also write a copy of it with the names of the good recordings in `mask/teachtree_audit`
    #[arg(long, value_name = "COPY.hdf5")]
    mask: Option<PathBuf>,
    /// Findings that do not keep a recording from being good
    #[arg(long, value_enum, value_name = "KIND,…", value_delimiter = ',')]
    allow: Vec<KindArg>,
    /// Findings with which the exit status is 1
    #[arg(long, value_enum, value_name = "KIND,…", value_delimiter = ',')]
    fail_on: Vec<KindArg>,
    /// The shortest time without motion that counts as a rest, s
    #[arg(long, value_name = "SECONDS", default_value = "3", value_parser = seconds)]
    rest: f64,
    /// Treat each file in a folder as a recording; otherwise, with a binding, a folder with tables of text is one recording in parts
    #[arg(long)]
    each: bool,
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
    /// Nothing is handled, or nothing moves for long
    Idle,
    /// It begins or ends in the middle of something
    CutOff,
    /// A hand let go of an object without having moved it
    FailedGrasp,
    /// The recording lacks a task that most recordings have
    LacksTask,
    /// Its steps are in another order than those of most
    OutOfOrder,
    /// It has other steps than most, or takes much longer or shorter
    Unlike,
}

impl KindArg {
    const fn kind(self) -> FindingKind {
        match self {
            Self::Idle => FindingKind::Idle,
            Self::CutOff => FindingKind::CutOff,
            Self::FailedGrasp => FindingKind::FailedGrasp,
            Self::LacksTask => FindingKind::LacksTask,
            Self::OutOfOrder => FindingKind::OutOfOrder,
            Self::Unlike => FindingKind::Outlier,
        }
    }
}

/// Reads a time in s.
fn seconds(text: &str) -> Result<f64, String> {
    let number = text.trim().strip_suffix('s').unwrap_or(text).trim();
    let value: Option<f64> = number.parse().ok().filter(|value: &f64| value.is_finite() && *value > 0.0);
    value.ok_or_else(|| "expected a time in s greater than 0, such as `2.5`".into())
}

/// A recording that was audited.
struct AuditedRecording {
    log: PathBuf,
    name: String,
}

/// Runs `audit`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let logs = logs(args)?;
    check_places(args, &logs)?;
    args.source.check(logs.len())?;
    let found = args.many.each("auditing", &logs, |log| {
        let opened = args.source.open(log)?;
        // Both the rules and the rests need it.
        opened.read()?;
        let analysis = args.rules.load(&opened)?.analyze(&opened)?;
        let carries = analysis.carries()?;
        let can_carry = |who: TrackId| carries.contains(&who);
        let facts = Facts::new(analysis.found(), &opened.opened()?.recording, args.rest, &can_carry);
        Ok::<_, Failure>((facts, analysis.meta().clone()))
    })?;
    let (mut audited, mut all, mut meta, mut failed, mut failures) = (vec![], vec![], None, vec![], vec![]);
    for (log, found) in logs.iter().zip(found) {
        match found {
            Ok((facts, of_log)) => {
                audited.push(AuditedRecording { log: log.clone(), name: log.display().to_string() });
                all.push(facts);
                meta.get_or_insert(of_log);
            }
            Err(failure) => {
                let failure = failure.of_log(log);
                failed.push((log.display().to_string(), why(&failure)));
                failures.push(failure);
            }
        }
    }
    let Some(meta) = meta else { return Failure::some(failures, 0) };
    let (usual, unchecked, tasks) = (compare(&mut all), unchecked(&all), task_counts(&all));
    let recordings: Vec<(String, Facts)> = audited.iter().map(|it| it.name.clone()).zip(all).collect();
    let allowed: Vec<FindingKind> = args.allow.iter().map(|kind| kind.kind()).collect();
    let audit = Audit {
        recordings: &recordings,
        failed: &failed,
        tasks: &tasks,
        usual: &usual,
        unchecked: &unchecked,
        allowed: &allowed,
    };
    write(args, &audit, &audited, &meta, &logs)?;
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
    Ok(recordings(&paths, args.source.binding.as_deref(), args.each)?.into_iter().map(|found| found.log).collect())
}

fn outputs(args: &Args) -> Vec<&Path> {
    let outputs = args.out.iter().chain(&args.page).chain(&args.keep);
    let outputs = outputs.chain(&args.mask);
    outputs.map(PathBuf::as_path).collect()
}

/// Refuses places that would replace an input or each other, before the work is done.
fn check_places(args: &Args, logs: &[PathBuf]) -> Result<(), InputError> {
    let outputs = outputs(args);
    output::refuse_one_for_two(&outputs)?;
    let files = if outputs.is_empty() { Vec::new() } else { read_by(&args.source, &args.rules) };
    let inputs: Vec<&Path> = logs.iter().chain(&files).map(PathBuf::as_path).collect();
    outputs.iter().try_for_each(|place| output::refuse_inputs(place, &inputs))?;
    if let Some(mask) = &args.mask {
        let is_file = matches!(args.logs.as_slice(), [file] if file.is_file() && formats::is_hdf5(file)?);
        if !is_file || formats::all_of(first(args))?.is_none() {
            let message = "a mask is of one HDF5 file with several recordings, found another input";
            return Err(InputError::new("--mask", message).help("name that file alone, or write --keep FILE"));
        }
        if mask.symlink_metadata().is_ok() {
            let error =
                InputError::new(mask.display().to_string(), "is there already, expected the name of a new copy");
            return Err(error.help("name another one, or delete it first"));
        }
    }
    Ok(())
}

fn first(args: &Args) -> &Path {
    args.logs.first().map_or(Path::new(""), PathBuf::as_path)
}

fn write(
    args: &Args,
    audit: &Audit,
    audited: &[AuditedRecording],
    meta: &Meta,
    logs: &[PathBuf],
) -> Result<(), InputError> {
    let files = read_by(&args.source, &args.rules);
    let inputs: Vec<&Path> = logs.iter().chain(&files).map(PathBuf::as_path).collect();
    let mut written = Files::default();
    let text = match args.format {
        Format::Text => text(audit, output::width()),
        Format::Json => printed(&document(audit, meta)),
        Format::Csv => csv(audit)?,
    };
    if let Some(path) = &args.page {
        output::add(&mut written, path, &page(audit, meta), &inputs)?;
    }
    if let Some(path) = &args.keep {
        output::add(&mut written, path, &keep(path, audit, audited), &inputs)?;
    }
    if let Some(path) = &args.out {
        output::add(&mut written, path, &text, &inputs)?;
    }
    if let Some(copy) = &args.mask {
        mask(first(args), copy, audit, audited, meta)?;
    }
    written.commit_anew()?;
    match (&args.out, args.format) {
        (Some(_), _) => Ok(()),
        (None, Format::Text) => output::print(&text),
        (None, Format::Json) => output::print_json(&text),
        (None, Format::Csv) => output::print_data(&text),
    }
}

/// The good recordings.
fn good<'a>(audit: &'a Audit, audited: &'a [AuditedRecording]) -> impl Iterator<Item = &'a AuditedRecording> {
    let pairs = audited.iter().zip(audit.recordings);
    pairs.filter(|(_, (_, facts))| audit.is_good(facts)).map(|(audited, _)| audited)
}

/// The list of good recordings. Those of a LeRobot set are numbers, as its loader takes them.
fn keep(path: &Path, audit: &Audit, audited: &[AuditedRecording]) -> String {
    let is_episode = |log: &Path| formats::is_set(&formats::without_episode(log));
    let of_one_set = audited.iter().all(|it| is_episode(&it.log))
        && audited.windows(2).all(|pair| match pair {
            [one, other] => formats::without_episode(&one.log) == formats::without_episode(&other.log),
            _ => true,
        });
    let value = |it: &AuditedRecording| -> Value {
        let name = formats::recording_of(&it.log);
        let number = name.as_ref().and_then(|name| name.parse::<u64>().ok()).filter(|_| of_one_set);
        number.map_or_else(|| json!(it.name), |number| json!(number))
    };
    let values: Vec<Value> = good(audit, audited).map(value).collect();
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json")) {
        return format!("{}\n", Value::from(values));
    }
    values.iter().map(|value| value.as_str().map_or_else(|| value.to_string(), str::to_string) + "\n").collect()
}

/// Writes a copy of a file with the names of the good recordings, as robomimic's filter keys.
fn mask(file: &Path, copy: &Path, audit: &Audit, audited: &[AuditedRecording], meta: &Meta) -> Result<(), InputError> {
    use teachtree_logs::read::formats::hdf5::annotate::{AUDITED, Request, annotate};
    let names: Vec<String> = good(audit, audited).filter_map(|it| formats::recording_of(&it.log)).collect();
    let provenance = json!({ "version": VERSION, "rules": { "files": meta.rules, "digest": meta.digest } }).to_string();
    let signals = std::collections::BTreeMap::new();
    let request = Request {
        layout: None,
        signals: &signals,
        mask: AUDITED,
        complete: &names,
        provenance: &provenance,
        replace: true,
    };
    annotate(file, copy, &request)
}

/// `teachtree.audit/1`.
fn document(audit: &Audit, meta: &Meta) -> Value {
    let recordings: Vec<Value> = audit.recordings.iter().map(|(name, facts)| recording(audit, name, facts)).collect();
    let failed: Vec<Value> = audit.failed.iter().map(|(log, why)| json!({ "log": log, "message": why })).collect();
    let counts: Map<String, Value> =
        audit.counts().into_iter().map(|(kind, count)| (kind.name().into(), json!(count))).collect();
    let allowed: Vec<&str> = audit.allowed.iter().map(|kind| kind.name()).collect();
    let params: Map<String, Value> = meta.params.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
    json!({ "schema": SCHEMA, "version": VERSION,
        "rules": { "files": meta.rules, "digest": meta.digest, "params": params },
        "good": audit.good(), "allowed": allowed, "counts": counts, "tasks": audit.tasks, "usual": audit.usual, "unchecked": audit.unchecked,
        "recordings": recordings,
        "failed": failed })
}

fn recording(audit: &Audit, name: &str, facts: &Facts) -> Value {
    let findings: Vec<Value> = facts
        .findings
        .iter()
        .map(|finding| {
            let mut value = Map::new();
            value.insert("kind".into(), json!(finding.kind.name()));
            value.extend(finding.track.map(|track| ("track".into(), json!(track))));
            if let Some([start, end]) = finding.span_s {
                value.insert("start_s".into(), json!(start));
                value.insert("end_s".into(), json!(end));
            }
            value.insert("message".into(), json!(finding.message));
            Value::Object(value)
        })
        .collect();
    let tasks: Vec<&str> = facts.tasks().collect();
    json!({ "log": name, "good": audit.is_good(facts), "start_s": facts.start_s, "duration_s": facts.duration_s(),
        "tasks": tasks, "findings": findings })
}

/// A row for each finding, and one for each recording without.
fn csv(audit: &Audit) -> Result<String, InputError> {
    let failed = |error: &dyn std::fmt::Display| InputError::new("the table", format!("cannot be written: {error}"));
    let mut writer = ::csv::Writer::from_writer(Vec::new());
    let mut row = |cells: [String; 7]| writer.write_record(cells).map_err(|error| failed(&error));
    row(["log", "good", "kind", "track", "start_s", "end_s", "message"].map(str::to_string))?;
    let number = teachtree_analysis::number::number;
    for (name, facts) in audit.recordings {
        let good = u8::from(audit.is_good(facts)).to_string();
        if facts.findings.is_empty() {
            let none = String::new;
            row([name.clone(), good, none(), none(), none(), none(), none()])?;
            continue;
        }
        for finding in &facts.findings {
            let track = finding.track.map_or(String::new(), |track| track.to_string());
            let [start, end] =
                finding.span_s.map_or_else(|| [String::new(), String::new()], |span_s| span_s.map(number));
            row([name.clone(), good.clone(), finding.kind.name().into(), track, start, end, finding.message.clone()])?;
        }
    }
    let bytes = writer.into_inner().map_err(|error| failed(&error))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}
