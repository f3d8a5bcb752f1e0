//! `teachtree check`: every mistake at once, and what running the rules costs.

use super::fmt::all_rules;
use super::output_args::FormatArg;
use super::rules::SetArg;
use super::{Failure, inputs, output};
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use teachtree_analysis as analysis;
use teachtree_base::diagnostic::{Diagnostic, Severity, Sources, Span, render};
use teachtree_base::error::InputError;
use teachtree_base::file_kind::FileKind;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::yaml::is_yaml;
use teachtree_engine::compiled::instantiate::instantiate;
use teachtree_engine::compiled::plan::Cost;
use teachtree_frames::averaging_lag;
use teachtree_frames::frames::{HandLayout, Layout};
use teachtree_language::graph::{RequiredChannels, lower, required_channels};
use teachtree_language::rules::TreeScope;
use teachtree_language::{self as language, LoadedRules, Request, Rules, codes};

/// Options of `check`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree check                          the shipped rules\n  teachtree check tap.rules                your own file and all that it uses\n  teachtree check tap.rules --hand hand_flags.rules\n  teachtree check rules/                   every rule file of a folder\n  teachtree check cell.scene.yaml lab.binding.yaml\n  teachtree check --explain E401          the page of a code\n  teachtree check tap.rules --format github    annotations for a workflow of GitHub"
)]
pub struct Args {
    /// Rule files, read together; folders, whose rule files are checked one by one; scenes, operator scripts, bindings and robot files (YAML); the
    /// shipped `contact.rules` and `failures.rules` when left out
    files: Vec<PathBuf>,
    /// The hand file that implements the abstract signals
    #[arg(long, value_name = "FILE")]
    hand: Option<String>,
    #[command(flatten)]
    set: SetArg,
    #[command(flatten)]
    form: FormatArg<Format>,
    /// Print the page of a code instead
    #[arg(long, value_name = "CODE", exclusive = true)]
    explain: Option<String>,
}

/// Forms of findings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// Text, with what the rules cost
    Text,
    /// `teachtree.check/1`: a list of findings
    Json,
    /// One line a finding, as workflows of GitHub show beside the code
    Github,
}

/// Runs `check`.
pub fn run(args: &Args) -> Result<(), Failure> {
    if let Some(code) = &args.explain {
        return page(code);
    }
    let mut failures = Vec::new();
    let mut findings = Vec::new();
    let (others, rules): (Vec<PathBuf>, Vec<PathBuf>) = args.files.iter().cloned().partition(|file| is_yaml(file));
    for file in &others {
        match other(file) {
            Ok(fine) if args.form.format == Format::Text => output::print(&fine)?,
            Ok(_) => {}
            Err(error) if args.form.format == Format::Text => failures.push(error.into()),
            Err(error) => {
                findings.push(of_other(&error, args.form.format));
                failures.push(Failure::Negative);
            }
        }
    }
    let sets = if rules.is_empty() && !others.is_empty() { vec![] } else { sets(&rules)? };
    for files in sets {
        let (hand_file, overrides) = (args.hand.clone(), args.set.values.clone());
        let loaded = language::load(&Request { files, hand_file, overrides, ..Request::default() });
        if args.form.format == Format::Text {
            failures.extend(report(&loaded).err());
            continue;
        }
        // Files that several sets use are reported once.
        for found in &loaded.diagnostics {
            let found = match args.form.format {
                Format::Github => annotation(found, &loaded.sources).into(),
                _ => json(found, &loaded.sources),
            };
            if !findings.contains(&found) {
                findings.push(found);
            }
        }
        failures.extend(loaded.rules.is_none().then_some(Failure::Negative));
    }
    match args.form.format {
        Format::Text => {}
        Format::Json => {
            output::print_json(&format!("{:#}\n", json!({ "schema": "teachtree.check/1", "findings": findings })))?
        }
        Format::Github => output::print(&findings.iter().filter_map(Value::as_str).collect::<String>())?,
    }
    Failure::all(failures)
}

/// Checks a YAML file; returns what it is.
fn other(file: &Path) -> Result<String, InputError> {
    let (place, text) = (file.display().to_string(), inputs::text(file)?);
    let Some(kind) = FileKind::of(file, &text) else {
        let message = "found none of the keys of a scene, an operator script, a binding or a robot file";
        return Err(InputError::new(place, message)
            .help("name it `NAME.scene.yaml`, `NAME.operator.yaml`, `NAME.binding.yaml` or `NAME.robot.yaml`"));
    };
    let more = inputs::read(kind, file, &text)?;
    Ok(format!("{place}: {}{more}, without errors\n", kind.name()))
}

/// What is wrong with a YAML file as a finding: at its line, to the end of it.
fn of_other(error: &InputError, format: Format) -> Value {
    let (file, line, column) = error.file_line_column();
    let (line, column) = (line.unwrap_or(1), column.unwrap_or(1));
    let at =
        json!({ "file": file, "start": { "line": line, "column": column }, "end": { "line": line, "column": column } });
    let finding = json!({
        "code": "input",
        "severity": "error",
        "message": error.message,
        "labels": [{ "at": at, "text": "" }],
        "notes": [],
        "help": error.help.iter().collect::<Vec<_>>(),
        "fix": null,
    });
    if format != Format::Github {
        return finding;
    }
    let text: Vec<&str> = std::iter::once(&error.message).chain(&error.help).map(String::as_str).collect();
    format!("::error file={},line={line},col={column},title=input::{}\n", property(file), escaped(&text.join("\n")))
        .into()
}

/// The rule sets to check: the files that are named are one, each file of a folder is one by itself.
fn sets(named: &[PathBuf]) -> Result<Vec<Vec<PathBuf>>, InputError> {
    let (folders, files): (Vec<&PathBuf>, Vec<&PathBuf>) = named.iter().partition(|path| path.is_dir());
    let mut sets = Vec::new();
    if !files.is_empty() || folders.is_empty() {
        sets.push(files.into_iter().cloned().collect());
    }
    for folder in folders {
        let found = all_rules(std::slice::from_ref(folder))?;
        if found.is_empty() {
            return Err(InputError::new(folder.display().to_string(), "the folder has no `.rules` file"));
        }
        sets.extend(found.into_iter().map(|file| vec![file]));
    }
    Ok(sets)
}

/// Prints the diagnostics of a rule set, and its cost.
fn report(loaded: &LoadedRules) -> Result<(), Failure> {
    if loaded.root_unreadable {
        return Err(Failure::Text(render(&loaded.diagnostics, &loaded.sources, output::color_on_stderr())));
    }
    let count = |severity| loaded.diagnostics.iter().filter(|found| found.severity == severity).count();
    let (errors, warnings) = (count(Severity::Error), count(Severity::Warning));
    output::print(&render(&loaded.diagnostics, &loaded.sources, output::color()))?;
    let plural = |count: usize, word: &str| format!("{count} {word}{}", if count == 1 { "" } else { "s" });
    let files: Vec<&str> = loaded.sources.files.iter().map(|file| file.name.as_str()).collect();
    let mut out = String::new();
    let _ = writeln!(out, "{} in {}: {}", plural(errors, "error"), plural(files.len(), "file"), files.join(", "));
    if warnings > 0 {
        let _ = writeln!(out, "{}", plural(warnings, "warning"));
    }
    if let Some(rules) = &loaded.rules {
        out.push_str(&cost(rules)?);
        out.push_str(&channels_of_failures(rules));
    }
    output::print(&out)?;
    if errors > 0 || loaded.rules.is_none() { Err(Failure::Negative) } else { Ok(()) }
}

/// Prints the page of a code.
fn page(code: &str) -> Result<(), Failure> {
    let upper = code.to_uppercase();
    match codes::page(&upper) {
        Some(page) => Ok(output::print(&format!("{upper}\n\n{page}\n"))?),
        None => {
            let known: Vec<&str> = codes::ALL.iter().map(|(code, _)| *code).collect();
            let error = InputError::new("--explain", format!("there is no code `{code}`"));
            Err(error.help(format!("codes are {}", known.join(", "))).into())
        }
    }
}

/// A finding as JSON: places with lines and columns counted from 1, columns in characters.
fn json(found: &Diagnostic, sources: &Sources) -> Value {
    let place = |span: Span| {
        let (start, end) = sources.lines_and_columns(span);
        json!({
            "file": sources.files.get(span.file as usize).map_or("", |file| file.name.as_str()),
            "start": { "line": start.0, "column": start.1 },
            "end": { "line": end.0, "column": end.1 },
        })
    };
    json!({
        "code": found.code,
        "severity": found.severity,
        "message": found.message,
        "labels": found.labels.iter().map(|label| json!({ "at": place(label.span), "text": label.text })).collect::<Vec<_>>(),
        "notes": found.notes,
        "help": found.help,
        "fix": found.fix.as_ref().map(|fix| json!({ "at": place(fix.span), "replacement": fix.replacement })),
    })
}

/// A text in a workflow command.
fn escaped(text: &str) -> String {
    text.replace('%', "%25").replace('\r', "%0D").replace('\n', "%0A")
}

/// The value of a property of a workflow command.
fn property(text: &str) -> String {
    escaped(text).replace(':', "%3A").replace(',', "%2C")
}

/// A finding as a workflow command: `::error file=…,line=…,col=…,title=E101::message`.
fn annotation(found: &Diagnostic, sources: &Sources) -> String {
    let kind = if found.severity == Severity::Error { "error" } else { "warning" };
    let place = found.labels.first().map_or(String::new(), |label| {
        let ((line, column), (end_line, end_column)) = sources.lines_and_columns(label.span);
        let file = sources.files.get(label.span.file as usize).map_or("", |file| file.name.as_str());
        format!("file={},line={line},col={column},endLine={end_line},endColumn={end_column},", property(file))
    });
    let text: Vec<&str> =
        std::iter::once(&found.message).chain(&found.notes).chain(&found.help).map(String::as_str).collect();
    format!("::{kind} {place}title={}::{}\n", found.code, escaped(&text.join("\n")))
}

/// The log for which the cost is said.
fn usual_layout(sides: &[Side], knows_distance: bool) -> Layout {
    let fingers = vec![Finger::Thumb, Finger::Index, Finger::Middle, Finger::Ring, Finger::Little];
    let contacts = (1..=6).map(|at| format!("body {at}")).collect::<Vec<_>>();
    let hand =
        |side: &Side| HandLayout { side: *side, fingers: fingers.clone(), contacts: contacts.clone(), knows_distance };
    Layout { rate_hz: 1000.0, hands: sides.iter().map(hand).collect() }
}

/// A number with what it counts: `1 tree`, `0 latches`.
fn counted(count: usize, one: &str, several: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { several })
}

fn cost(rules: &Rules) -> Result<String, Failure> {
    let graph = lower(rules);
    let mut out = String::new();
    let of_tasks = match rules.composites.len() {
        0 => String::new(),
        count => format!(" and {count} made of tasks"),
    };
    let failures = rules.tasks.iter().filter(|task| task.failure).count()
        + rules.composites.iter().filter(|task| task.failure).count();
    let failures = match failures {
        0 => String::new(),
        1 => " (1 is a failure)".to_string(),
        count => format!(" ({count} are failures)"),
    };
    let _ = writeln!(
        out,
        "\n{}, {}, {}, {}, {}, {}; {}, {}",
        counted(rules.primitives.len(), "primitive", "primitives"),
        counted(rules.signals.len(), "signal", "signals"),
        counted(rules.latches.len(), "latch", "latches"),
        counted(rules.trees.len(), "tree", "trees"),
        counted(rules.tasks.len(), "task", "tasks") + &of_tasks + &failures,
        counted(rules.relabels.len(), "relabeling rule", "relabeling rules"),
        counted(graph.values.len(), "shared value", "shared values"),
        counted(graph.trees.iter().map(|tree| tree.decision.tests.len()).sum(), "test", "tests"),
    );
    let settle =
        rules.trees.iter().filter_map(|tree| tree.settle.as_ref()).map(|settle| settle.value).fold(0.0, f64::max);
    let cost_of = |sides: &[Side], knows_distance: bool| -> Result<Cost, Failure> {
        Ok(instantiate(&graph, &usual_layout(sides, knows_distance))?.cost())
    };
    // One frame is 1 ms at 1 kHz.
    let milliseconds = |cost: &Cost| f64::from(cost.look_ahead_frames);
    let _ = writeln!(out, "at 1 kHz with five fingers a hand and six bodies to touch:");
    for (name, sides) in [("one hand", &[Side::Right][..]), ("two hands", &Side::BOTH[..])] {
        let cost = cost_of(sides, true)?;
        let look_ahead = milliseconds(&cost);
        let _ = writeln!(
            out,
            "  {name:<10} {:>4} numbers, {:>4} conditions, {:>3} stateful nodes a frame; at most {:>3} tests; {:>6} bytes of state; look-ahead {look_ahead:.0} ms, settling {:.0} ms",
            cost.numbers,
            cost.conditions,
            cost.stateful,
            cost.tests,
            cost.state_bytes,
            settle * 1e3,
        );
    }
    let without_distance = milliseconds(&cost_of(&[Side::Right], false)?);
    if without_distance > milliseconds(&cost_of(&[Side::Right], true)?) {
        let _ =
            writeln!(out, "  for logs without positions of fingertips or objects: look-ahead {without_distance:.0} ms");
    }
    let averaging = averaging_lag(&analysis::channels(rules), 1000.0);
    let _ = writeln!(
        out,
        "  labels of a live log are final after look-ahead, settling and {averaging} ms of averages about a frame"
    );
    Ok(out)
}

/// The channels that detect each primitive by which a failure is recognized.
fn channels_of_failures(rules: &Rules) -> String {
    let graph = lower(rules);
    let mut out = String::new();
    for task in rules.tasks.iter().filter(|task| task.failure) {
        let labels = task.keys.iter().flat_map(|key| key.label.labels());
        let scopes = [TreeScope::EachHand, TreeScope::BothHands];
        for (label, scope) in labels.flat_map(|label| scopes.map(|scope| (label, scope))) {
            let Some(RequiredChannels { all, any }) = required_channels(&graph, scope, label) else { continue };
            let one_of = match any.as_slice() {
                [] => None,
                [alone] => Some(alone.clone()),
                [others @ .., last] => Some(format!("{} or {last}", others.join(", "))),
            };
            let channels: Vec<String> = all.into_iter().chain(one_of).collect();
            let of_both = if scope == TreeScope::BothHands { " of both hands" } else { "" };
            let _ = writeln!(out, "  {}, {}{of_both}: {}", task.name, rules.label_name(label), channels.join("; "));
        }
    }
    if out.is_empty() { out } else { format!("failures are detected by these channels:\n{out}") }
}
