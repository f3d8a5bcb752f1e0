//! `teachtree annotate`: the labels of all recordings of a data set, in a copy of it that people train with.

mod hdf5;
mod lerobot;
mod task_spec;

use super::parallel::ParallelArgs;
use super::rules::{RuleArgs, read_by};
use super::source::SourceArgs;
use super::{Failure, output};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use teachtree_analysis::json::VERSION;
use teachtree_base::error::InputError;
use teachtree_logs::read::{file, formats};
use teachtree_session::Analysis;
use teachtree_session::AnalysisInternals;

/// Options of `annotate`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree annotate my_set -o my_set_labeled --binding arm.binding.yaml\n  teachtree annotate my_set -o labeled --binding arm.binding.yaml --words '{name} the {object}' --words Translate='carry the {object}'\n  teachtree annotate my_set -o labeled --binding arm.binding.yaml --legacy --sarm\n  teachtree annotate demos.hdf5 -o prepared.hdf5 --binding sim.binding.yaml --signal grasp='start of Grasp of nut' --signal insert='end of Insert of nut into peg'\n  teachtree annotate demos.hdf5 -o prepared.hdf5 --binding with_signals.binding.yaml --task-spec task.json\nThe set itself is never changed. Labels that it has are kept; those of a style that is to be written make an error unless --replace.\nExit status: 0 fine, 2 bad usage or input, 3 some recordings failed and have no labels in the copy."
)]
pub struct Args {
    /// A LeRobot set of version 2.0 to 3.0, or an HDF5 file of many recordings
    #[arg(value_name = "SET")]
    data: PathBuf,
    /// Where to write the copy: a new name
    #[arg(long, short, value_name = "COPY")]
    out: PathBuf,
    #[command(flatten)]
    rules: RuleArgs,
    #[command(flatten)]
    source: SourceArgs,
    /// LeRobot: the labels to write, both when left out
    #[arg(long, value_enum, value_name = "STYLE")]
    style: Vec<StyleArg>,
    /// LeRobot: how labels are worded, `{name}[ {object}][ ({partner})]` when left out, `{hand}` for the hand; `NAME=TEMPLATE` for one primitive, task or body; may be repeated
    #[arg(long, value_name = "TEMPLATE")]
    words: Vec<String>,
    /// LeRobot: write `language_persistent`, as when no other form is named
    #[arg(long)]
    language: bool,
    /// LeRobot: write `meta/subtasks.parquet` and the column `subtask_index`, as lerobot 0.4.4 to 0.5 reads them: the tasks, or the primitives with `--style motion`
    #[arg(long)]
    legacy: bool,
    /// LeRobot: write the stages of SARM into `meta/episodes`: the tasks as `sparse_…`, the primitives as `dense_…`
    #[arg(long)]
    sarm: bool,
    /// LeRobot 2.0 and 2.1: write columns `annotation.teachtree.…`, `meta/tasks.jsonl` and `meta/modality.json`, as GR00T reads them
    #[arg(long)]
    gr00t: bool,
    /// LeRobot: write `meta/lerobot_annotations.json`, which the annotation tab of LeRobot's visualizer opens and `score --labels` reads
    #[arg(long)]
    prelabels: bool,
    /// HDF5: a signal by which a part of a demonstration ends: 0 until the start or the end of a primitive or task, 1 from then on; may be repeated; the `signals` of the binding when left out
    #[arg(long, value_name = "NAME=STEP")]
    signal: Vec<String>,
    /// HDF5: a signal by which a part begins, in the layout of Isaac Lab Mimic; may be repeated; the `start_signals` of the binding when left out
    #[arg(long, value_name = "NAME=STEP")]
    start_signal: Vec<String>,
    /// HDF5: write the specification of the task for a data generator: `.json` for MimicGen, `.yaml` for AutoData
    #[arg(long, value_name = "FILE")]
    task_spec: Option<PathBuf>,
    /// HDF5: the name of a body of the scene in the file, for --task-spec; may be repeated
    #[arg(long, value_name = "BODY=NAME", value_parser = super::rules::name_and_value)]
    object_ref: Vec<(String, String)>,
    /// HDF5: the layout of the signals; when left out the one of the file, else MimicGen's
    #[arg(long, value_enum)]
    layout: Option<LayoutArg>,
    /// Leave existing labels of the written styles, or signals of the written names, out of the copy
    #[arg(long)]
    replace: bool,
    #[command(flatten)]
    many: ParallelArgs,
}

/// Labels by the name that LeRobot gives them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum StyleArg {
    /// The primitives
    Motion,
    /// The tasks
    Subtask,
}

/// Where signals are in an HDF5 file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum LayoutArg {
    /// In `datagen_info`, as of MimicGen
    Mimicgen,
    /// In `obs/datagen_info`, as of Isaac Lab Mimic and AutoData
    Isaac,
}

/// Runs `annotate`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let place = args.data.display().to_string();
    refuse_place(args)?;
    if args.data.is_dir() && formats::is_set(&args.data) {
        let signals = !args.signal.is_empty() || !args.start_signal.is_empty() || args.layout.is_some();
        let signals = signals || args.task_spec.is_some() || !args.object_ref.is_empty();
        let message = "--signal, --start-signal, --task-spec, --object-ref and --layout are of HDF5 files";
        refuse_options(args, signals, message)?;
        return lerobot::run(args);
    }
    if args.data.is_file() && formats::is_hdf5(&args.data)? {
        let forms = args.language || args.legacy || args.sarm || args.gr00t || args.prelabels;
        let words = forms || !args.words.is_empty() || !args.style.is_empty();
        refuse_options(args, words, "--words, --style and the forms of labels are of LeRobot sets")?;
        return hdf5::run(args);
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
    Err(InputError::new(place, "is no data set, expected the folder of a LeRobot set, or an HDF5 file").into())
}

/// Refuses options that say nothing about a set of this kind.
fn refuse_options(args: &Args, given: bool, message: &str) -> Result<(), InputError> {
    if given { Err(InputError::new(args.data.display().to_string(), message).help("leave them out")) } else { Ok(()) }
}

/// Refuses a place for the copy where something is, or that is in the set.
fn refuse_place(args: &Args) -> Result<(), InputError> {
    let place = args.out.display().to_string();
    if args.out.symlink_metadata().is_ok() {
        return Err(InputError::new(place, "is there already, expected the name of a new copy")
            .help("name another one, or delete it first"));
    }
    let above = folder_above(&args.out)?;
    if std::fs::canonicalize(&args.data).is_ok_and(|set| above.starts_with(set)) {
        return Err(InputError::new(place, format!("is in {}, which is copied", args.data.display()))
            .help("name a place beside it"));
    }
    let inputs = read_by(&args.source, &args.rules);
    output::refuse_inputs(&args.out, &inputs.iter().map(PathBuf::as_path).collect::<Vec<_>>())
}

/// The folder that a new file or folder is to be in.
fn folder_above(place: &Path) -> Result<PathBuf, InputError> {
    let above = place.parent().filter(|above| !above.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::canonicalize(above).map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => InputError::new(above.display().to_string(), "there is no such folder"),
        _ => InputError::unreadable(above.display().to_string(), &error),
    })
}

/// What the labels were made by: the rules of each analysis once, binding and version.
fn provenance<'a>(args: &Args, analyses: impl IntoIterator<Item = &'a Analysis>) -> Value {
    let mut rules: Vec<Value> = Vec::new();
    for analysis in analyses {
        let meta = analysis.meta();
        let params: serde_json::Map<String, Value> =
            meta.params.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
        let of = json!({ "files": meta.rules, "digest": meta.digest, "params": params });
        if !rules.contains(&of) {
            rules.push(of);
        }
    }
    let mut provenance_json = json!({ "version": VERSION, "rules": rules });
    if let (Some(binding), Some(provenance_json)) = (&args.source.binding, provenance_json.as_object_mut()) {
        provenance_json.insert("binding".into(), json!(binding.display().to_string()));
    }
    provenance_json
}
