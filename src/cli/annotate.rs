//! `teachtree annotate`: the labels of all recordings of a data set, in a copy of it that people train with.

mod hdf5;
mod lerobot;
mod outcomes;
mod task_spec;

pub(super) use lerobot::phrasing;

use super::analysis::{AnalysisArgs, ExpectArg};
use super::output_args::FormatArg;
use super::parallel::ParallelArgs;
use super::print_args::is_quiet;
use super::{Failure, output};
use hdf5::Hdf5;
use lerobot::LeRobot;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use teachtree_analysis::json::{VERSION, printed};
use teachtree_analysis::outcome::OutcomeKind;
use teachtree_base::error::InputError;
use teachtree_logs::read::{file, formats};
use teachtree_session::Analysis;
use teachtree_session::{AnalysisInternals, Log};

/// Options of `annotate`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree annotate my_set -o my_set_labeled --binding arm.binding.yaml\n  teachtree annotate my_set -o labeled --binding arm.binding.yaml --words '{name} the {object}' --words Translate='carry the {object}'\n  teachtree annotate my_set -o labeled --binding arm.binding.yaml --legacy --sarm\n  teachtree annotate my_set -o labeled --binding arm.binding.yaml --rules my_failures.rules --failures write\n  teachtree annotate demos.hdf5 -o prepared.hdf5 --binding sim.binding.yaml --signal grasp='start of Grasp of nut' --signal insert='end of Insert of nut into peg'\n  teachtree annotate demos.hdf5 -o prepared.hdf5 --binding with_signals.binding.yaml --task-spec task.json\nThe set itself is never changed. Recordings that are failures are left out unless --failures write. With --expect or rules with failures, success fields are written too. Existing labels are kept; existing labels of a style to be written are an error unless --replace.\nExit status: 0 fine, 2 bad usage or input, 3 some recordings failed and have no labels in the copy."
)]
pub struct Args {
    /// A LeRobot set of version 2.0 to 3.0, or an HDF5 file of many recordings
    #[arg(value_name = "SET")]
    data: PathBuf,
    /// Path of the copy, which must not exist
    #[arg(long, short, value_name = "COPY")]
    out: PathBuf,
    #[command(flatten)]
    analysis: AnalysisArgs,
    #[command(flatten)]
    expect: ExpectArg,
    /// Recordings that are failures: leave them out, or write their labels and signals like those of others
    #[arg(long, value_enum, value_name = "HOW", default_value = "skip")]
    failures: FailuresArg,
    #[command(flatten)]
    lerobot: LeRobot,
    #[command(flatten)]
    hdf5: Hdf5,
    /// Replace existing labels of the written styles, signals of the written names, and success fields in the copy
    #[arg(long)]
    replace: bool,
    #[command(flatten)]
    form: FormatArg<Format>,
    #[command(flatten)]
    many: ParallelArgs,
}

/// Forms of the summary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// Tables for the terminal
    Text,
    /// `teachtree.annotation/1`
    Json,
}

/// What was written into a copy.
struct Summary<'a> {
    /// The tables of what was written, for people.
    text: String,
    /// The recordings of the set, with or without labels.
    recordings: usize,
    labeled: Vec<String>,
    /// Failures, which get no labels.
    left_out: Vec<String>,
    /// For each recording whose outcome is known, whether it is a success.
    successes: Vec<bool>,
    /// How often each label was written, by style and words.
    labels: BTreeMap<(&'a str, &'a str), usize>,
    /// The row of each signal by recording; null where the recording lacks it.
    signals: Vec<Value>,
}

impl Summary<'_> {
    fn print(&self, args: &Args) -> Result<(), InputError> {
        match args.form.format {
            Format::Text if is_quiet() => Ok(()),
            Format::Text => args.form.print(&format!("{}{}", self.text, Args::left_out(&self.left_out))),
            Format::Json => args.form.print(&printed(&self.document(args))),
        }
    }

    /// The summary as `teachtree.annotation/1` (docs/formats.md).
    fn document(&self, args: &Args) -> Value {
        let labels = self.labels.iter();
        let labels = labels.map(|((style, text), count)| json!({"style": style, "text": text, "count": count}));
        let count = |wanted: bool| self.successes.iter().filter(|success| **success == wanted).count();
        json!({
            "schema": "teachtree.annotation/1",
            "version": VERSION,
            "set": args.data.display().to_string(),
            "copy": args.out.display().to_string(),
            "recordings": self.recordings,
            "labeled": self.labeled,
            "left_out": self.left_out,
            "outcomes": {
                "success": count(true),
                "failure": count(false),
                "unknown": self.recordings - self.successes.len(),
            },
            "labels": labels.collect::<Vec<_>>(),
            "signals": self.signals,
        })
    }
}

/// What is done with recordings that are failures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum FailuresArg {
    /// They get no labels or signals, and are in no list of recordings
    Skip,
    /// They get labels or signals as the others
    Write,
}

/// A kind of data sets that labels are written into, with the options that only it has.
trait Destination {
    /// Whether a data set is of this kind.
    fn is_kind_of(&self, data: &Path) -> Result<bool, InputError>;

    /// The message to users of other data sets, if an option of this kind is given.
    fn given(&self) -> Option<&'static str>;

    /// Writes the copy with labels.
    fn annotate(&self, args: &Args) -> Result<(), Failure>;
}

impl Args {
    /// The table of destinations.
    fn destinations(&self) -> [&dyn Destination; 2] {
        [&self.lerobot, &self.hdf5]
    }

    /// Analyzes a recording, which is expected to contain what `--expect` names. Fields that are to be replaced do not decide its outcome.
    fn analyzed(&self, log: &Log) -> Result<Analysis, Failure> {
        let analysis = self.expect.analyze(&self.analysis, log)?;
        Ok(if self.replace { analysis.without_success_fields() } else { analysis })
    }

    /// Whether a recording is left out because it is a failure.
    fn leaves_out(&self, analysis: &Analysis) -> bool {
        self.failures == FailuresArg::Skip && analysis.outcome().result == OutcomeKind::Failure
    }

    /// The line about recordings that are left out.
    fn left_out(names: &[String]) -> String {
        match names {
            [] => String::new(),
            names => {
                format!("failed recordings are not labeled: {}; `--failures write` labels them\n", names.join(", "))
            }
        }
    }

    /// The error that no recording is left.
    fn refuse_failures(&self, count: usize) -> InputError {
        let message = format!("all {count} analyzed recordings are failures, found none to label");
        InputError::new(self.data.display().to_string(), message).help("`--failures write` labels them")
    }
}

/// Runs `annotate`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let place = args.data.display().to_string();
    refuse_place(args)?;
    for (at, destination) in args.destinations().into_iter().enumerate() {
        if destination.is_kind_of(&args.data)? {
            refuse_others(args, at)?;
            return destination.annotate(args);
        }
    }
    if args.data.symlink_metadata().is_err() {
        let set = formats::without_episode(&args.data);
        if set.symlink_metadata().is_ok() {
            let message = "is one recording, expected a whole set: labels are written into a copy of all of it";
            return Err(InputError::new(place, message).help(format!("name the set: {}", set.display())).into());
        }
        return Err(InputError::unreadable(place, &std::io::ErrorKind::NotFound.into()).into());
    }
    if file::is_there(&args.data) {
        file::open(&args.data)?;
    }
    Err(InputError::new(place, "is not a data set, expected the folder of a LeRobot set, or an HDF5 file").into())
}

/// Refuses options of other destinations than the one at a place of the table.
fn refuse_others(args: &Args, own: usize) -> Result<(), InputError> {
    let others = args.destinations().into_iter().enumerate().filter(|(at, _)| *at != own);
    let given = others.filter_map(|(_, other)| other.given()).next();
    given
        .map_or(Ok(()), |message| Err(InputError::new(args.data.display().to_string(), message).help("leave them out")))
}

/// Refuses a place for the copy where something is, or that is in the set.
fn refuse_place(args: &Args) -> Result<(), InputError> {
    let place = args.out.display().to_string();
    output::refuse_existing(&args.out)?;
    let above = folder_above(&args.out)?;
    if std::fs::canonicalize(&args.data).is_ok_and(|set| above.starts_with(set)) {
        return Err(InputError::new(place, format!("is in {}, which is copied", args.data.display()))
            .help("name a place beside it"));
    }
    output::refuse_inputs(&args.out, &args.analysis.files(std::slice::from_ref(&args.data)))
}

/// The folder that a new file or folder is to be in.
fn folder_above(place: &Path) -> Result<PathBuf, InputError> {
    let above = place.parent().filter(|above| !above.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::canonicalize(above).map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => InputError::new(above.display().to_string(), "there is no such folder"),
        _ => InputError::unreadable(above.display().to_string(), &error),
    })
}

/// What the labels were made by: the rules of each analysis once, binding, expected tasks and version.
pub(super) fn provenance<'a>(binding: Option<&Path>, analyses: impl IntoIterator<Item = &'a Analysis>) -> Value {
    let (mut rules, mut expected): (Vec<Value>, _) = (Vec::new(), None);
    for analysis in analyses {
        expected = expected.or_else(|| analysis.outcome().expected);
        let meta = analysis.meta();
        let params: serde_json::Map<String, Value> =
            meta.params.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
        let of = json!({ "files": meta.rules, "digest": meta.digest, "params": params });
        if !rules.contains(&of) {
            rules.push(of);
        }
    }
    let mut provenance_json = json!({ "version": VERSION, "rules": rules });
    if let (Some(binding), Some(provenance_json)) = (binding, provenance_json.as_object_mut()) {
        provenance_json.insert("binding".into(), json!(binding.display().to_string()));
    }
    if let (Some(tasks), Some(provenance_json)) = (expected, provenance_json.as_object_mut()) {
        provenance_json.insert("expect".into(), json!(tasks));
    }
    provenance_json
}
