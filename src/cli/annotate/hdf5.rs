//! `annotate` of an HDF5 file: step signals by which MimicGen, Isaac Lab Mimic and AutoData divide demonstrations, and what each of them lacks.

use super::super::{Failure, output};
use super::task_spec::{Demonstration, TaskSpec};
use super::{Args, LayoutArg, provenance};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::PathBuf;
use teachtree_analysis::steps::{SignalError, values};
use teachtree_base::error::InputError;
use teachtree_logs::atomic_write::Files;
use teachtree_logs::read::formats;
use teachtree_logs::read::formats::hdf5::annotate::{Layout, MASK, Request, Signals, annotate};
use teachtree_session::Analysis;
use teachtree_session::signals::{Signal, of_binding};
use teachtree_session::{AnalysisInternals, LogInternals};

/// A recording with the row of each signal.
struct Row {
    name: String,
    rows: Vec<Result<usize, SignalError>>,
    signals: Signals,
}

/// Writes the copy of a file with signals.
pub fn run(args: &Args) -> Result<(), Failure> {
    let place = args.data.display().to_string();
    let wanted = wanted(args)?;
    let Some(logs) = formats::all_of(&args.data)? else {
        let message = "is one recording, expected a file with several, as robomimic writes them: `data/demo_0`, …";
        return Err(InputError::new(place, message).into());
    };
    check_names(args, &wanted, &logs)?;
    let spec = args.task_spec.as_deref().map(|path| TaskSpec::new(args, path, &wanted)).transpose()?;
    args.source.check(logs.len())?;
    let found = args.many.each("analyzing", &logs, |log| {
        let log = args.source.open(log)?;
        Ok::<_, Failure>(args.rules.load(&log)?.analyze(&log)?)
    })?;
    let (mut analyses, mut failures) = (Vec::new(), Vec::new());
    for (log, found) in logs.iter().zip(found) {
        match found {
            Ok(analysis) => analyses.push((formats::recording_of(log).unwrap_or_default(), analysis)),
            Err(failure) => failures.push(failure.of_log(log)),
        }
    }
    if analyses.is_empty() {
        return Failure::some(failures, 0);
    }
    let rows: Vec<Row> = analyses.iter().map(|(name, analysis)| row(name, analysis, &wanted)).collect();
    let complete: Vec<String> =
        rows.iter().filter(|row| row.rows.iter().all(Result::is_ok)).map(|row| row.name.clone()).collect();
    let provenance_json = provenance(args, analyses.iter().map(|(_, analysis)| analysis)).to_string();
    let signals: BTreeMap<String, Signals> = rows.iter().map(|row| (row.name.clone(), row.signals.clone())).collect();
    let layout = args.layout.map(|layout| match layout {
        LayoutArg::Mimicgen => Layout::MimicGen,
        LayoutArg::Isaac => Layout::Isaac,
    });
    let request = Request {
        layout,
        signals: &signals,
        mask: MASK,
        complete: &complete,
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
    if !args.many.quiet {
        output::print(&table(args, &wanted, &rows, complete.len()))?;
    }
    Failure::some(failures, analyses.len())
}

/// The signals of the command line; of each kind that it names none of, those of the binding. Those that end parts come first.
fn wanted(args: &Args) -> Result<Vec<Signal>, InputError> {
    let mut wanted: Vec<Signal> = Vec::new();
    for (option, texts, starts) in [("--signal", &args.signal, false), ("--start-signal", &args.start_signal, true)] {
        for text in texts {
            let wrong = |message: String| InputError::new(option, message);
            let (name, step) = text.split_once('=').ok_or_else(|| {
                wrong(format!("found `{text}`, expected NAME=STEP, such as `grasp=start of Grasp of cube`"))
            })?;
            let signal = Signal::read(option.into(), name.trim(), step.trim(), starts)?;
            if wanted.iter().any(|known| known.name == signal.name && known.starts == starts) {
                return Err(wrong(format!("the signal `{}` is there twice", signal.name)));
            }
            wanted.push(signal);
        }
    }
    if let Some(binding) = &args.source.binding {
        let is_named = |starts: bool| if starts { !args.start_signal.is_empty() } else { !args.signal.is_empty() };
        wanted.extend(of_binding(binding)?.into_iter().filter(|signal| !is_named(signal.starts)));
        wanted.sort_by_key(|signal| signal.starts);
    }
    if wanted.is_empty() {
        return Err(InputError::new(args.data.display().to_string(), "an HDF5 file gets signals, found none to write")
            .help("name them in the binding, `signals: {grasp: start of Grasp of cube}`, or by --signal grasp='start of Grasp of cube'"));
    }
    Ok(wanted)
}

/// Refuses signals of primitives, tasks and bodies that there are none of, by the first recording that can be read.
fn check_names(args: &Args, wanted: &[Signal], logs: &[PathBuf]) -> Result<(), Failure> {
    let Some(log) = logs.iter().find_map(|log| args.source.open(log).ok()) else { return Ok(()) };
    let bodies: BTreeSet<String> = log.opened()?.recording.scene.bodies.keys().cloned().collect();
    let rules = args.rules.load(&log)?;
    wanted.iter().try_for_each(|signal| signal.check(&rules, &bodies))?;
    Ok(())
}

fn row(name: &str, analysis: &Analysis, wanted: &[Signal]) -> Row {
    let found = analysis.found();
    let mut row = Row { name: name.into(), rows: Vec::new(), signals: Signals::default() };
    for Signal { name, step, starts, .. } in wanted {
        let at = step.row(found);
        // A signal that does not rise is there all the same, as of a demonstration that failed.
        let values = values(*at.as_ref().unwrap_or(&found.rows), found.rows);
        let signals = if *starts { &mut row.signals.start } else { &mut row.signals.term };
        signals.insert(name.clone(), values);
        row.rows.push(at);
    }
    row
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
