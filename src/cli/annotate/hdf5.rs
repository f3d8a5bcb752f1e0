//! `annotate` of an HDF5 file: step signals by which MimicGen, Isaac Lab Mimic and AutoData divide demonstrations, what each of them lacks, and success
//! fields.

use super::super::Failure;
use super::super::parallel::{LogResults, named_failures};
use super::super::rules::name_and_value;
use super::task_spec::{Demonstration, TaskSpec};
use super::{Args, Destination, Summary, outcomes, provenance};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use teachtree_analysis::steps::{SignalError, values};
use teachtree_base::error::InputError;
use teachtree_logs::atomic_write::Files;
use teachtree_logs::read::formats;
use teachtree_logs::read::formats::hdf5::annotate::{Layout, MASK, Request, Signals, annotate, success};
use teachtree_session::Analysis;
use teachtree_session::signals::{Signal, of_binding};
use teachtree_session::{AnalysisInternals, LogInternals};

/// Options of HDF5 files.
#[derive(clap::Args)]
pub struct Hdf5 {
    /// HDF5: a signal that ends a subtask: 0 until the start or the end of a primitive or task, 1 from then on; may be repeated; by default the `signals` of
    /// the binding
    #[arg(long, value_name = "NAME=STEP")]
    signal: Vec<String>,
    /// HDF5: a signal that starts a subtask, in the layout of Isaac Lab Mimic; may be repeated; by default the `start_signals` of the binding
    #[arg(long, value_name = "NAME=STEP")]
    start_signal: Vec<String>,
    /// HDF5: write the specification of the task for a data generator: `.json` for MimicGen, `.yaml` for AutoData
    #[arg(long, value_name = "FILE")]
    task_spec: Option<PathBuf>,
    /// HDF5: the name of a body of the scene in the file, for --task-spec; may be repeated
    #[arg(long, value_name = "BODY=NAME", value_parser = name_and_value)]
    pub(super) object_ref: Vec<(String, String)>,
    /// HDF5: the layout of the signals; by default that of the file, else MimicGen's
    #[arg(long, value_enum)]
    layout: Option<LayoutArg>,
}

/// Where signals are in an HDF5 file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum LayoutArg {
    /// In `datagen_info`, as of MimicGen
    Mimicgen,
    /// In `obs/datagen_info`, as of Isaac Lab Mimic and AutoData
    Isaac,
}

impl Destination for Hdf5 {
    fn is_kind_of(&self, data: &Path) -> Result<bool, InputError> {
        Ok(data.is_file() && formats::is_hdf5(data)?)
    }

    fn given(&self) -> Option<&'static str> {
        let signals = !self.signal.is_empty() || !self.start_signal.is_empty() || self.layout.is_some();
        let is_given = signals || self.task_spec.is_some() || !self.object_ref.is_empty();
        is_given.then_some("--signal, --start-signal, --task-spec, --object-ref and --layout are of HDF5 files")
    }

    fn annotate(&self, args: &Args) -> Result<(), Failure> {
        let place = args.data.display().to_string();
        let wanted = wanted(self, args)?;
        let Some(logs) = formats::all_of(&args.data)? else {
            let message = "is one recording, expected a file with several, as robomimic writes them: `data/demo_0`, …";
            return Err(InputError::new(place, message).into());
        };
        check_names(args, &wanted, &logs)?;
        let spec = self.task_spec.as_deref().map(|path| TaskSpec::new(args, path, &wanted)).transpose()?;
        args.analysis.source.check(logs.len())?;
        let analyze = |log: &Path| args.analyzed(&args.analysis.source.open(log)?);
        let LogResults { done, failed } = args.many.each_log("analyzing", &logs, analyze)?;
        let mut failures = named_failures(failed);
        let name = |log: &PathBuf| formats::recording_of(log).unwrap_or_default();
        let named: Vec<(String, Analysis)> = done.into_iter().map(|(log, analysis)| (name(log), analysis)).collect();
        let success = |(name, analysis): &(String, Analysis)| Some((name.clone(), outcomes::success_rows(analysis)?));
        let successes: BTreeMap<String, Vec<bool>> = named.iter().filter_map(success).collect();
        let count = named.len();
        let (left_out, analyses): (Vec<_>, Vec<_>) =
            named.into_iter().partition(|(_, analysis)| args.leaves_out(analysis));
        let left_out: Vec<String> = left_out.into_iter().map(|(name, _)| name).collect();
        if analyses.is_empty() && !left_out.is_empty() {
            failures.push(args.refuse_failures(left_out.len()).into());
        }
        if analyses.is_empty() {
            return Failure::some(failures, 0);
        }
        let rows: Vec<Row> = analyses.iter().map(|(name, analysis)| row(name, analysis, &wanted)).collect();
        let lists = lists(&wanted, &rows, &successes);
        if lists.is_empty() {
            let message = "found nothing to write: there are no signals, and all outcomes are unknown";
            return Err(InputError::new(place, message).help("`teachtree analyze` prints the reasons").into());
        }
        let success_lines = success_lines(args, &successes, count)?;
        let binding = args.analysis.source.binding_of(&args.data)?;
        let provenance_json = provenance(binding.as_deref(), analyses.iter().map(|(_, analysis)| analysis)).to_string();
        let signals: BTreeMap<String, Signals> =
            rows.iter().map(|row| (row.name.clone(), row.signals.clone())).collect();
        let layout = self.layout.map(|layout| match layout {
            LayoutArg::Mimicgen => Layout::MimicGen,
            LayoutArg::Isaac => Layout::Isaac,
        });
        let request = Request {
            layout,
            signals: &signals,
            lists: &lists,
            successes: &successes,
            provenance: &provenance_json,
            replace: args.replace,
        };
        let found: Vec<Demonstration> = analyses
            .iter()
            .zip(&rows)
            .map(|((name, analysis), row)| Demonstration { name, analysis: analysis.found(), rows: &row.rows })
            .collect();
        // All of the specification but its name is on the disk before the copy gets its own.
        let mut files = Files::default();
        if let Some(spec) = &spec {
            spec.add(&mut files, &found)?;
        }
        annotate(&args.data, &args.out, &request)?;
        files.commit()?;
        let complete = lists.get(MASK).map_or_else(String::new, |names| table(args, &wanted, &rows, names.len()));
        let summary = Summary {
            text: complete + &success_lines,
            recordings: logs.len(),
            labeled: analyses.iter().map(|(name, _)| name.clone()).collect(),
            left_out,
            successes: successes.values().map(|rows| rows.contains(&true)).collect(),
            labels: BTreeMap::new(),
            signals: rows.iter().map(|row| signal_rows(row, &wanted)).collect(),
        };
        summary.print(args)?;
        Failure::some(failures, analyses.len())
    }
}

/// A recording with the row of each signal.
struct Row {
    name: String,
    rows: Vec<Result<usize, SignalError>>,
    signals: Signals,
}

/// The signals of the command line; of each kind that it names none of, those of the binding. Those that end parts come first.
fn wanted(own: &Hdf5, args: &Args) -> Result<Vec<Signal>, InputError> {
    let mut wanted: Vec<Signal> = Vec::new();
    for (option, texts, starts) in [("--signal", &own.signal, false), ("--start-signal", &own.start_signal, true)] {
        for text in texts {
            let wrong = |message: String| InputError::new(option, message);
            let (name, step) = text.split_once('=').ok_or_else(|| {
                wrong(format!("found `{text}`, expected NAME=STEP, such as `grasp=start of Grasp of cube`"))
            })?;
            let signal = Signal::read(option.into(), name.trim(), step.trim(), starts)?;
            if wanted.iter().any(|known| known.name == signal.name && known.starts == starts) {
                return Err(wrong(format!("the signal `{}` occurs twice", signal.name)));
            }
            wanted.push(signal);
        }
    }
    if let Some(binding) = &args.analysis.source.binding_of(&args.data)? {
        let is_named = |starts: bool| if starts { !own.start_signal.is_empty() } else { !own.signal.is_empty() };
        wanted.extend(of_binding(binding)?.into_iter().filter(|signal| !is_named(signal.starts)));
        wanted.sort_by_key(|signal| signal.starts);
    }
    if wanted.is_empty() && args.expect.expect.is_none() {
        return Err(InputError::new(args.data.display().to_string(), "an HDF5 file gets signals, found none to write")
            .help("name them in the binding, `signals: {grasp: start of Grasp of cube}`, or by --signal grasp='start of Grasp of cube'; --expect writes success fields without signals"));
    }
    Ok(wanted)
}

/// Refuses signals of primitives, tasks and bodies that there are none of, by the first recording that can be read.
fn check_names(args: &Args, wanted: &[Signal], logs: &[PathBuf]) -> Result<(), Failure> {
    let Some(log) = logs.iter().find_map(|log| args.analysis.source.open(log).ok()) else { return Ok(()) };
    let bodies: BTreeSet<String> = log.opened()?.recording.scene.bodies.keys().cloned().collect();
    let rules = args.analysis.rules.load(&log)?;
    wanted.iter().try_for_each(|signal| signal.check(&rules, &bodies))?;
    Ok(())
}

/// The lists of recordings: those that have all signals, where there are signals; successes and failures, where there are some.
fn lists(
    wanted: &[Signal],
    rows: &[Row],
    successes: &BTreeMap<String, Vec<bool>>,
) -> BTreeMap<&'static str, Vec<String>> {
    let mut lists = BTreeMap::new();
    if !wanted.is_empty() {
        let complete = rows.iter().filter(|row| row.rows.iter().all(Result::is_ok));
        lists.insert(MASK, complete.map(|row| row.name.clone()).collect());
    }
    if !successes.is_empty() {
        let of = |wanted: bool| {
            let has_outcome = successes.iter().filter(move |(_, rows)| rows.contains(&true) == wanted);
            has_outcome.map(|(name, _)| name.clone()).collect()
        };
        lists.extend([(success::SUCCESSES, of(true)), (success::FAILURES, of(false))]);
    }
    lists
}

/// The lines about success fields of some of these recordings.
fn success_lines(
    args: &Args,
    successes: &BTreeMap<String, Vec<bool>>,
    recordings: usize,
) -> Result<String, InputError> {
    if successes.is_empty() {
        return Ok(String::new());
    }
    let mut text = String::new();
    for (field, names) in success::contradictions(&args.data, successes)? {
        let what = match (field, args.replace) {
            (success::ATTRIBUTE, true) => "it is replaced",
            (success::ATTRIBUTE, false) => "it is kept, `--replace` replaces it",
            _ => "it is kept",
        };
        text += &outcomes::contradictions(field, &names, successes, what);
    }
    let unknown = match recordings - successes.len() {
        0 => String::new(),
        unknown => format!(", {unknown} unknown"),
    };
    let (one, other) = (success::SUCCESSES, success::FAILURES);
    let _ = writeln!(text, "outcomes: {}{unknown}, listed in `{one}` and `{other}`", outcomes::counts(successes));
    Ok(text)
}

fn row(name: &str, analysis: &Analysis, wanted: &[Signal]) -> Row {
    let found = analysis.found();
    let mut row = Row { name: name.into(), rows: Vec::new(), signals: Signals::default() };
    for Signal { name, step, starts, .. } in wanted {
        let at = step.row(found);
        // A signal that does not rise is written too, for example for a failed demonstration.
        let values = values(*at.as_ref().unwrap_or(&found.rows), found.rows);
        let signals = if *starts { &mut row.signals.start } else { &mut row.signals.term };
        signals.insert(name.clone(), values);
        row.rows.push(at);
    }
    row
}

/// The row of each signal of a recording, by name.
fn signal_rows(row: &Row, wanted: &[Signal]) -> Value {
    let signals = wanted.iter().zip(&row.rows).map(|(Signal { name, starts, .. }, row)| {
        let part = if *starts { "start" } else { "end" };
        json!({"name": name, "of": part, "row": row.as_ref().ok()})
    });
    json!({"recording": row.name, "signals": signals.collect::<Vec<_>>()})
}

/// The row of each signal, and what is lacking.
fn table(args: &Args, wanted: &[Signal], rows: &[Row], complete: usize) -> String {
    let width = rows.iter().map(|row| row.name.chars().count()).max().unwrap_or(0).max(9);
    let mut text = format!("{:<width$}", "recording");
    for Signal { name, .. } in wanted {
        let _ = write!(text, "  {name:>6}");
    }
    text.push('\n');
    for Row { name, rows, .. } in rows {
        let _ = write!(text, "{name:<width$}");
        for (wanted, row) in wanted.iter().zip(rows) {
            let width = wanted.name.chars().count().max(6);
            let row = row.as_ref().map_or("-".to_string(), ToString::to_string);
            let _ = write!(text, "  {row:>width$}");
        }
        let lacks: Vec<String> = rows.iter().filter_map(|row| row.as_ref().err()).map(ToString::to_string).collect();
        let _ = writeln!(text, "  {}", lacks.join("; "));
    }
    let text: String = text.lines().map(|line| format!("{}\n", line.trim_end())).collect();
    format!(
        "{text}{}: {complete} of {} recordings have all signals, listed in `{MASK}`\n",
        args.out.display(),
        rows.len()
    )
}
