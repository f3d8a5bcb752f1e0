//! `teachtree inspect`: what a log holds, what could be recognised from it, and a binding to fill in.

use super::rules::{RuleArgs, load};
use super::{Failure, output};
use crate::base::channels::Absent;
use crate::base::error::InputError;
use crate::base::hands::Side;
use crate::graph::{Graph, Known, Leaf, Target, lower, possible};
use crate::language::rules::{Hand, Label, TreeScope};
use crate::stream::binding::BindingFile;
use crate::stream::frames::{ColumnKey, Frames, Issue};
use crate::stream::inspect::{ColumnReport, Inspection, Kind, SheetReport, inspect};
use crate::stream::skeleton::skeleton;
use crate::stream::table::SEEN;
use crate::stream::{self, OpenRequest, formats, names};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Options of `inspect`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree inspect log.mcap\n  teachtree inspect log.csv --skeleton lab.binding.yaml\n  teachtree inspect log.csv --binding lab.binding.yaml --format json"
)]
pub struct Args {
    /// A recording of any format
    log: PathBuf,
    #[command(flatten)]
    rules: RuleArgs,
    /// How the columns of a foreign log become channels
    #[arg(long, value_name = "FILE")]
    binding: Option<PathBuf>,
    /// A scene instead of the one that the log carries
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// Write a binding to fill in
    #[arg(long, value_name = "FILE")]
    skeleton: Option<PathBuf>,
    /// What to write
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

/// Forms of an inspection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// Tables for people
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

/// What the rules could tell.
#[derive(Debug, Serialize)]
struct Recognition {
    /// Why nothing can be told, if so.
    error: Option<String>,
    tracks: Vec<Track>,
    /// What was found wrong with the channels.
    issues: Vec<Issue>,
}

/// What the rules could tell of a hand, or of both.
#[derive(Debug, Serialize)]
struct Track {
    track: String,
    can: Vec<String>,
    cannot: Vec<Lack>,
}

/// Primitives that cannot be told, and for lack of what.
#[derive(Debug, Serialize)]
struct Lack {
    of: String,
    primitives: Vec<String>,
}

/// Runs `inspect`.
pub fn run(args: &Args) -> Result<(), Failure> {
    if args.log == Path::new("-") {
        return Err(InputError::new("-", "a stream cannot be inspected, wanted a file").into());
    }
    let binding = args.binding.as_deref().map(BindingFile::read).transpose()?.map(|file| file.binding);
    let source = formats::open(&args.log)?;
    let canonical = source.header().iter().any(|title| names::meaning(names::split_unit(title).0).is_some());
    let time = binding.as_ref().map(|binding| &binding.time);
    let rate = binding.as_ref().and_then(|binding| binding.rate).map(|rate| rate.0);
    let log = inspect(source, time, rate)?;
    if let Some(path) = &args.skeleton {
        let inputs = [Some(&args.log), args.binding.as_ref(), args.scene.as_ref()].into_iter().flatten();
        let inputs: Vec<&Path> = inputs.chain(&args.rules.rules).map(PathBuf::as_path).collect();
        output::write(path, &skeleton(&log), &inputs)?;
    }
    let recognition = if binding.is_some() || canonical { recognition(args)? } else { Recognition::foreign() };
    let text = match args.format {
        Format::Text => text(&log, &recognition),
        Format::Json => {
            let document = Document { schema: "teachtree.inspection/1", log: &log, recognition: &recognition };
            let json = serde_json::to_string_pretty(&document);
            json.map_err(|error| InputError::new("JSON", error.to_string()))? + "\n"
        }
    };
    Ok(output::print(&text)?)
}

/// What the rules could tell of the log.
fn recognition(args: &Args) -> Result<Recognition, Failure> {
    let request = OpenRequest { log: args.log.clone(), binding: args.binding.clone(), scene: args.scene.clone() };
    let opened = match stream::open(&request) {
        Ok(opened) => opened,
        Err(error) => return Ok(Recognition::impossible(&error)),
    };
    let rules = load(&args.rules, opened.hand_file.as_deref(), &opened.params)?;
    let graph = lower(&rules);
    let frames = match opened.frames(&rules.channels) {
        Ok(frames) => frames,
        Err(error) => return Ok(Recognition::impossible(&error)),
    };
    let sides: Vec<Side> = frames.layout.hands.iter().map(|hand| hand.side).collect();
    let mut tracks: Vec<Track> =
        sides.iter().map(|side| track(&graph, &frames, TreeScope::EachHand, Some(*side))).collect();
    if sides.len() > 1 && graph.trees.iter().any(|tree| tree.scope == TreeScope::BothHands) {
        tracks.push(track(&graph, &frames, TreeScope::BothHands, None));
    }
    Ok(Recognition { error: None, tracks, issues: frames.issues })
}

impl Recognition {
    fn impossible(error: &InputError) -> Self {
        Self { error: Some(error.to_string()), tracks: vec![], issues: vec![] }
    }

    fn foreign() -> Self {
        let why = "no column has a canonical name; say which column is which channel in a binding (--skeleton writes one to fill in)";
        Self { error: Some(why.into()), tracks: vec![], issues: vec![] }
    }
}

/// What a tree could tell: with each channel that says nothing silenced, together and one by one.
fn track(graph: &Graph, frames: &Frames, scope: TreeScope, side: Option<Side>) -> Track {
    let silent = silent(frames);
    let known = |silenced: &dyn Fn(&str) -> bool| {
        possible(graph, scope, |channel, hand| {
            let side = match hand {
                Hand::This => side,
                Hand::Named(side) => Some(side),
                Hand::Nobody => None,
            };
            let found = silent.get(&(channel.0, side));
            found.filter(|(of, _)| silenced(of)).map_or(Known::Unknown, |(_, known)| *known)
        })
    };
    let all = possible(graph, scope, |_, _| Known::Unknown);
    let can = known(&|_| true);
    let reasons: BTreeSet<&str> = silent.values().map(|(of, _)| of.as_str()).collect();
    let mut left: BTreeSet<Label> = all.difference(&can).copied().collect();
    let mut cannot = vec![];
    let names = |labels: &BTreeSet<Label>| labels.iter().map(|label| graph.label_name(*label).to_string()).collect();
    for of in &reasons {
        let lost: BTreeSet<Label> = left.difference(&known(&|other| other == *of)).copied().collect();
        if !lost.is_empty() {
            left.retain(|label| !lost.contains(label));
            cannot.push(Lack { of: (*of).to_string(), primitives: names(&lost) });
        }
    }
    // What no single lack explains: as few together as do.
    let mut together: BTreeMap<Vec<&str>, BTreeSet<Label>> = BTreeMap::new();
    for label in left {
        let mut needed: Vec<&str> = reasons.iter().copied().collect();
        for of in &reasons {
            let fewer: Vec<&str> = needed.iter().copied().filter(|other| other != of).collect();
            if !known(&|other| fewer.contains(&other)).contains(&label) {
                needed = fewer;
            }
        }
        together.entry(needed).or_default().insert(label);
    }
    // What stands in the tree, but asks for what the hand file says is never so.
    let never: BTreeSet<Label> = leaves(graph, scope).difference(&all).copied().collect();
    if !never.is_empty() {
        cannot.push(Lack { of: "the hand file says that nothing measures it".into(), primitives: names(&never) });
    }
    cannot.extend(together.into_iter().map(|(of, labels)| Lack { of: of.join(" and "), primitives: names(&labels) }));
    Track { track: side.map_or("both", Side::name).to_string(), can: names(&can), cannot }
}

/// The labels that stand in the trees.
fn leaves(graph: &Graph, scope: TreeScope) -> BTreeSet<Label> {
    let trees = graph.trees.iter().filter(|tree| tree.scope == scope);
    let targets = trees
        .flat_map(|tree| tree.decision.tests.iter().flat_map(|test| [test.yes, test.no]).chain([tree.decision.root]));
    let label = |target| match target {
        Target::Leaf(Leaf::Primitive(label)) => Some(label),
        _ => None,
    };
    targets.filter_map(label).collect()
}

/// The channels that say nothing in this log, with what is to be told about them.
fn silent(frames: &Frames) -> BTreeMap<(u32, Option<Side>), (String, Known)> {
    let mut silent = BTreeMap::new();
    let sides = frames.layout.hands.iter().map(|hand| Some(hand.side)).chain([None]);
    for side in sides {
        for (index, channel) in (0_u32..).zip(&frames.channels) {
            if channel.per_hand != side.is_some() {
                continue;
            }
            let first = ColumnKey { channel: index, side, slot: 0, component: 0 };
            let last = ColumnKey { slot: u32::MAX, component: u32::MAX, ..first };
            let mut columns = frames.columns.range(first..=last).map(|(_, values)| values).peekable();
            if columns.peek().is_none() {
                if let (Some(_), Some((family, _))) = (channel.axis, channel.name.split_once('.')) {
                    silent.insert((index, side), (format!("the log has no {family}"), Known::Empty));
                }
                continue;
            }
            let mut values = columns.flatten();
            let Some(first) = values.next().copied() else { continue };
            // What is measured may stand still by chance; a number that is worked out from the scene does not.
            let fixed = first == 0.0 || channel.absent == Absent::Derived && channel.shape.components().len() == 1;
            if fixed && values.all(|value| *value == first) {
                let told = if first == 0.0 { "zero" } else { "constant" };
                silent
                    .insert((index, side), (format!("`{}` is {told} all along", channel.name), Known::Constant(first)));
            }
        }
    }
    silent
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
    if let Some(error) = &recognition.error {
        let _ = writeln!(text, "  nothing can be told: {error}");
    }
    for track in &recognition.tracks {
        let _ = writeln!(text, "  {:<6} can be told: {}", track.track, track.can.join(", "));
        for lack in &track.cannot {
            let _ = writeln!(text, "         {}: {} cannot be told", lack.of, lack.primitives.join(", "));
        }
    }
    let issues: Vec<&Issue> = log.issues.iter().chain(&recognition.issues).collect();
    if !issues.is_empty() {
        text.push_str("\nissues\n");
    }
    let mut told = BTreeSet::new();
    for issue in issues {
        let line = format!(
            "  {} {}, {:.3} – {:.3} s: {}",
            issue.kind, issue.channel, issue.start_s, issue.end_s, issue.message
        );
        if told.insert(line.clone()) {
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
        Kind::Text if column.texts.is_empty() => return "empty".into(),
        Kind::Text => {
            let more = if column.texts.len() == SEEN { ", …" } else { "" };
            return format!("text: {}{more}", column.texts.join(", "));
        }
        Kind::Constant => format!("always {}", unit(column.min, &column.unit)),
        Kind::Flag => "flag".into(),
        Kind::Number => format!(
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
