//! `annotate` of an HDF5 file: step signals by which MimicGen, Isaac Lab Mimic and AutoData divide demonstrations, and what each of them lacks.

use super::super::{Failure, output};
use super::{Args, LayoutArg, provenance};
use crate::analysis::steps::{Lack, Step, values};
use crate::base::error::InputError;
use crate::base::nearest::nearest;
use crate::session::Analysis;
use crate::stream::read::formats;
use crate::stream::read::formats::hdf5::annotate::{Layout, MASK, Request, Signals, annotate};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

/// A signal that is asked for.
struct Wanted {
    name: String,
    step: Step,
    /// Whether a part begins by it, not ends.
    starts: bool,
}

/// A recording with the row of each signal.
struct Row {
    name: String,
    rows: Vec<Result<usize, Lack>>,
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
    let found = args.many.each("analyzing", &logs, |log| {
        let log = args.source.open(log)?;
        let bodies: BTreeSet<String> = log.opened()?.recording.scene.bodies.keys().cloned().collect();
        Ok::<_, Failure>((args.rules.load(&log)?.analyze(&log)?, bodies))
    })?;
    let (mut analyses, mut failures) = (Vec::new(), Vec::new());
    let mut bodies = BTreeSet::new();
    for (log, found) in logs.iter().zip(found) {
        match found {
            Ok((analysis, more)) => {
                bodies.extend(more);
                analyses.push((formats::recording_of(log).unwrap_or_default(), analysis));
            }
            Err(failure) => failures.push(failure.of_log(log)),
        }
    }
    if analyses.is_empty() {
        return Failure::some(failures, 0);
    }
    check_names(&wanted, analyses.iter().map(|(_, analysis)| analysis), &bodies)?;
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
    annotate(&args.data, &args.out, &request)?;
    if !args.many.quiet {
        output::print(&table(args, &wanted, &rows, complete.len()))?;
    }
    Failure::some(failures, analyses.len())
}

/// The signals of the command line.
fn wanted(args: &Args) -> Result<Vec<Wanted>, InputError> {
    let mut wanted: Vec<Wanted> = Vec::new();
    for (option, texts, starts) in [("--signal", &args.signal, false), ("--start-signal", &args.start_signal, true)] {
        for text in texts {
            let wrong = |message: String| InputError::new(option, message);
            let (name, step) = text.split_once('=').ok_or_else(|| {
                wrong(format!("found `{text}`, expected NAME=STEP, such as `grasp=start of Grasp of cube`"))
            })?;
            let (name, step) = (name.trim(), step.trim());
            if name.is_empty() || !name.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '-')) {
                return Err(wrong(format!(
                    "found `{name}` before `=`, expected the name of a signal: letters, digits, `_`, `-`"
                )));
            }
            if wanted.iter().any(|known| known.name == name && known.starts == starts) {
                return Err(wrong(format!("the signal `{name}` is there twice")));
            }
            wanted.push(Wanted { name: name.into(), step: Step::read(step).map_err(wrong)?, starts });
        }
    }
    if wanted.is_empty() {
        return Err(InputError::new(args.data.display().to_string(), "an HDF5 file gets signals, found none to write")
            .help("name them: --signal grasp='start of Grasp of cube'"));
    }
    Ok(wanted)
}

/// Refuses signals of primitives, tasks and bodies that there are none of.
fn check_names<'a>(
    wanted: &[Wanted],
    analyses: impl Iterator<Item = &'a Analysis>,
    bodies: &BTreeSet<String>,
) -> Result<(), InputError> {
    let mut names = BTreeSet::new();
    for analysis in analyses {
        names.extend(analysis.rules().primitives().chain(analysis.rules().tasks()).map(str::to_string));
        names.extend(analysis.rules().set().label_names());
    }
    for Wanted { name, step, starts } in wanted {
        let option = if *starts { "--start-signal" } else { "--signal" };
        let subject = step.subject.object.iter().chain(&step.subject.partner).map(|body| (body, bodies, "body"));
        for (word, known, what) in std::iter::once((&step.name, &names, "primitive or task")).chain(subject) {
            if known.contains(word) {
                continue;
            }
            let error = InputError::new(option, format!("`{name}`: there is no {what} `{word}`"));
            return Err(match nearest(word, known.iter().map(String::as_str)) {
                Some(near) => error.help(format!("did you mean `{near}`?")),
                None => error.help(format!("there are {}", known.iter().cloned().collect::<Vec<_>>().join(", "))),
            });
        }
    }
    Ok(())
}

fn row(name: &str, analysis: &Analysis, wanted: &[Wanted]) -> Row {
    let found = analysis.found();
    let mut row = Row { name: name.into(), rows: Vec::new(), signals: Signals::default() };
    for Wanted { name, step, starts } in wanted {
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
fn table(args: &Args, wanted: &[Wanted], rows: &[Row], complete: usize) -> String {
    let width = rows.iter().map(|row| row.name.chars().count()).max().unwrap_or(0).max(9);
    let mut text = format!("{:<width$}", "recording");
    for Wanted { name, .. } in wanted {
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
