//! `teachtree inspect`: the columns of a log, and the primitives that can be detected in it.

use super::analysis::AnalysisArgs;
use super::output_args::FormatArg;
use super::{Failure, output};
use serde::Serialize;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;
use teachtree_frames::bind::BindingFile;
use teachtree_frames::inspect::{ColumnReport, Inspection, SheetReport, ValueKind, inspect};
use teachtree_logs::issue::Issue;
use teachtree_logs::names;
use teachtree_logs::read::date_time;
use teachtree_logs::read::first_stamp::{SINCE_1970_S, in_recording};
use teachtree_logs::read::formats;
use teachtree_logs::read::table::SEEN;
use teachtree_session::{Calibration, Error, Observability, TrackObservability};

/// Options of `inspect`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree inspect log.mcap\n  teachtree inspect log.csv --binding lab.binding.yaml --format json"
)]
pub struct Args {
    /// Recordings of any format, or folders of them; `set#0..9` or `set#*` for several episodes
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    #[command(flatten)]
    analysis: AnalysisArgs,
    /// Replaced by `init`
    #[arg(long, value_name = "FILE", hide = true)]
    skeleton: Option<PathBuf>,
    /// Write the calibration of rate and sensors, for `live --calibration`
    #[arg(long, value_name = "FILE.json")]
    calibrate: Option<PathBuf>,
    #[command(flatten)]
    form: FormatArg<Format>,
}

/// Forms of an inspection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// Tables for the terminal
    Text,
    /// `teachtree.inspection/1`
    Json,
}

/// An inspection as JSON has it.
#[derive(Serialize)]
struct Document<'a> {
    schema: &'static str,
    #[serde(flatten)]
    log: &'a Inspection,
    recognition: &'a Recognition,
}

/// What the rules can detect.
#[derive(Debug, Serialize)]
struct Recognition {
    /// Why nothing can be detected, if so.
    error: Option<String>,
    /// The hand model for the log, and why it is loaded.
    #[serde(skip_serializing_if = "Option::is_none")]
    hand_model: Option<String>,
    tracks: Vec<TrackObservability>,
    /// What was found wrong with the channels.
    issues: Vec<Issue>,
}

/// Runs `inspect`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let logs = args.analysis.logs(&args.logs)?;
    if args.skeleton.is_some() {
        let error = InputError::new("--skeleton", "is replaced by `teachtree init`, which also guesses the channels");
        return Err(error.help("`teachtree init LOG -o DIR` writes a binding, a scene and a project file").into());
    }
    if let Some(path) = &args.calibrate {
        if logs.len() > 1 {
            return Err(
                InputError::new("--calibrate", "a calibration is learned from one recording, found several").into()
            );
        }
        if path.extension().is_none_or(|ending| ending != "json") {
            let message = "expected a name that ends with `.json`";
            return Err(InputError::new(format!("--calibrate {}", path.display()), message).into());
        }
    }
    let alone = logs.len() == 1;
    let (mut done, mut failures) = (0, Vec::new());
    for log in &logs {
        match one(args, log, alone) {
            Ok(text) => {
                let apart = if done > 0 && args.form.format == Format::Text { "\n" } else { "" };
                args.form.print(&format!("{apart}{text}"))?;
                done += 1;
            }
            // The results of the other recordings are still useful.
            Err(failure) if alone => failures.push(failure),
            Err(failure) => failures.push(failure.of_log(log)),
        }
    }
    Failure::some(failures, done)
}

/// Inspects a recording, the only one or one of several, which take a line of JSON each.
fn one(args: &Args, log: &Path, alone: bool) -> Result<String, Failure> {
    if log == Path::new("-") {
        return Err(InputError::new("-", "a stream cannot be inspected, expected a file").into());
    }
    let binding = args.analysis.source.binding_of(log)?;
    let binding = binding.as_deref().map(BindingFile::read).transpose()?.map(|file| file.binding);
    let source = formats::open(log)?;
    let canonical = source.header().iter().any(|title| names::meaning(names::split_unit(title).0).is_some());
    let time = binding.as_ref().map(|binding| &binding.time);
    let rate = binding.as_ref().and_then(|binding| binding.rate).map(|rate| rate.0);
    let inspected = inspect(source, time, rate)?;
    let inputs = || args.analysis.inputs(&[log.into()]);
    if let Some(path) = &args.calibrate {
        let opened = args.analysis.source.open(log)?;
        let calibration = Calibration::of(&opened, &args.analysis.rules.load(&opened)?)?;
        output::write(path, &calibration.text()?, &inputs())?;
    }
    let recognition = if binding.is_some() || canonical { recognition(args, log)? } else { Recognition::foreign() };
    if args.form.format == Format::Text {
        return Ok(text(&inspected, &recognition));
    }
    let document = Document { schema: "teachtree.inspection/1", log: &inspected, recognition: &recognition };
    let json = if alone { serde_json::to_string_pretty(&document) } else { serde_json::to_string(&document) };
    Ok(json.map_err(|error| InputError::new("JSON", error.to_string()))? + "\n")
}

/// What the rules can detect in the log.
fn recognition(args: &Args, log: &Path) -> Result<Recognition, Failure> {
    let log = match args.analysis.read(log) {
        Ok(log) => log,
        Err(error) => return Ok(Recognition::impossible(&error)),
    };
    let rules = args.analysis.rules.load(&log)?;
    let hand_model = rules.hand_model();
    match rules.observability(&log) {
        Ok(Observability { tracks, issues }) => Ok(Recognition { error: None, hand_model, tracks, issues }),
        Err(error) => Ok(Recognition { hand_model, ..Recognition::impossible(&error) }),
    }
}

impl Recognition {
    fn impossible(error: &Error) -> Self {
        Self { error: Some(error.to_string()), hand_model: None, tracks: vec![], issues: vec![] }
    }

    fn foreign() -> Self {
        let why = "no column has a canonical name; name the column of each channel in a binding (`teachtree init LOG` writes one)";
        Self { error: Some(why.into()), hand_model: None, tracks: vec![], issues: vec![] }
    }
}

fn text(log: &Inspection, recognition: &Recognition) -> String {
    let mut text = format!("{}\n", log.log);
    for sheet in &log.sheets {
        sheet_text(&mut text, sheet);
    }
    for (name, why) in &log.refused {
        let _ = writeln!(text, "\n{name}\n  cannot be read: {why}");
    }
    text.push_str("\nrecognition\n");
    if let Some(hand_model) = &recognition.hand_model {
        let _ = writeln!(text, "  hand model: {hand_model}");
    }
    if let Some(error) = &recognition.error {
        let _ = writeln!(text, "  nothing can be detected: {error}");
    }
    for track in &recognition.tracks {
        let relabeled = track.relabeled.iter().map(|name| format!("{name} (by relabeling)"));
        let names: Vec<String> = track.detectable.iter().cloned().chain(relabeled).collect();
        let _ = writeln!(text, "  {:<6} can be detected: {}", track.track.name(), names.join(", "));
        for lack in &track.undetectable {
            let _ = writeln!(text, "         {}: {} cannot be detected", lack.reason, lack.primitives.join(", "));
        }
    }
    let issues: Vec<&Issue> = log.issues.iter().chain(&recognition.issues).collect();
    if !issues.is_empty() {
        text.push_str("\nissues\n");
    }
    let mut printed = BTreeSet::new();
    // Those of the columns have the stamps of the log.
    let zero_s = log.sheets.iter().map(|sheet| sheet.start_s).fold(f64::INFINITY, f64::min);
    for issue in issues {
        let line = format!(
            "  {} {}, {:.3} – {:.3} s: {}",
            issue.kind,
            issue.channel,
            in_recording(issue.start_s, zero_s),
            in_recording(issue.end_s, zero_s),
            issue.message
        );
        if printed.insert(line.clone()) {
            let _ = writeln!(text, "{}", line.replace(" , ", ", "));
        }
    }
    text
}

fn sheet_text(text: &mut String, sheet: &SheetReport) {
    let _ = writeln!(text, "\n{}", if sheet.name.is_empty() { "columns" } else { &sheet.name });
    match &sheet.time {
        Some(time) => {
            let _ = write!(
                text,
                "  {} rows in {}, {} at {} Hz",
                sheet.rows,
                unit(sheet.duration_s, "s"),
                quoted(time),
                short(sheet.rate_hz)
            );
            if sheet.start_s >= SINCE_1970_S {
                let _ = write!(text, ", from {}", date_time::written(sheet.start_s));
            }
        }
        None => {
            let _ = write!(text, "  {} rows without stamps", sheet.rows);
        }
    }
    if sheet.gaps > 0 {
        let gaps = if sheet.gaps == 1 { "gap" } else { "gaps" };
        let _ = write!(text, ", {} {gaps}, the longest {}", sheet.gaps, unit(sheet.longest_step_s, "s"));
    }
    if sheet.uneven > 0.0 {
        let _ = write!(text, ", {:.1} % of the steps uneven", sheet.uneven * 100.0);
    }
    text.push('\n');
    let width = sheet.columns.iter().map(|column| column.name.chars().count()).max().unwrap_or(0).min(60);
    for column in &sheet.columns {
        let _ = writeln!(text, "  {:<width$}  {}", column.name, column_text(column));
    }
}

fn column_text(column: &ColumnReport) -> String {
    let mut text = match column.kind {
        ValueKind::Text if column.texts.is_empty() => return "empty".into(),
        ValueKind::Text => {
            let more = if column.texts.len() == SEEN { ", …" } else { "" };
            return format!("text: {}{more}", column.texts.join(", "));
        }
        ValueKind::Constant => format!("always {}", unit(column.min, &column.unit)),
        ValueKind::Flag => "flag".into(),
        ValueKind::Number => format!(
            "{} … {}, noise {}",
            short(column.min),
            unit(column.max, &column.unit),
            unit(column.noise, &column.unit)
        ),
    };
    if column.missing > 0.0 {
        let _ = write!(text, ", {:.1} % not measured", column.missing * 100.0);
    }
    if column.repeated_s > 0.0 {
        let _ = write!(text, ", one value for {}", unit(column.repeated_s, "s"));
    }
    text
}

fn quoted(name: &str) -> String {
    format!("`{name}`")
}

fn unit(value: f64, unit: &str) -> String {
    if unit.is_empty() { short(value) } else { format!("{} {unit}", short(value)) }
}

/// A number with four digits that count.
fn short(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let digits = 3 - value.abs().log10().floor() as i32;
    if !(-3..=9).contains(&digits) {
        return format!("{value:.2e}");
    }
    let text = format!("{value:.*}", usize::try_from(digits.max(0)).unwrap_or(0));
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text }
}
