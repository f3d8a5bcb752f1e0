//! `teachtree check`: every mistake at once, and what running the rules costs.

mod finding;
mod formats;
mod sarif;

use super::fmt::all_rules;
use super::output_args::FormatArg;
use super::print_args::is_quiet;
use super::rules::SetArg;
use super::{Failure, inputs, output};
use finding::{CheckedInput, Finding};
use formats::{as_github, as_json, as_junit};
use sarif::as_sarif;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use teachtree_analysis as analysis;
use teachtree_base::diagnostic::{Severity, render};
use teachtree_base::error::InputError;
use teachtree_base::file_kind::FileKind;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::spelling::nearest;
use teachtree_base::yaml::is_yaml;
use teachtree_engine::compiled::instantiate::instantiate;
use teachtree_engine::compiled::plan::Cost;
use teachtree_frames::averaging_lag;
use teachtree_frames::frames::{HandLayout, Layout};
use teachtree_language::graph::{RequiredChannels, lower, required_channels};
use teachtree_language::rules::TreeScope;
use teachtree_language::{self as language, LoadedRules, Request, Rules, codes};
use teachtree_logs::issue::IssueKind;
use teachtree_session::RulesOptions;

/// Options of `check`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree check                          the shipped rules\n  teachtree check tap.rules                your own file and all that it uses\n  teachtree check tap.rules --hand hand_flags.rules\n  teachtree check rules/                   every rule file of a folder\n  teachtree check cell.scene.yaml lab.binding.yaml\n  teachtree check --explain E401          the page of a code\n  teachtree check --explain misplaced_socket\n  teachtree check tap.rules --format github    annotations for a workflow of GitHub\n  teachtree check rules/ --format sarif > teachtree.sarif"
)]
pub struct Args {
    /// Rule files, read together; folders, whose rule files are checked one by one; scenes, operator scripts, bindings and robot files (YAML); by default the
    /// shipped `contact.rules` and `failures.rules`
    files: Vec<PathBuf>,
    /// The hand model that implements the abstract signals
    #[arg(long, value_name = "FILE")]
    hand: Option<String>,
    #[command(flatten)]
    set: SetArg,
    #[command(flatten)]
    form: FormatArg<Format>,
    /// Also print the cost of a frame, the size of the state and the look-ahead
    #[arg(long, short)]
    verbose: bool,
    /// Print the page of a code, or what a kind of issues is, instead
    #[arg(long, value_name = "CODE", exclusive = true)]
    explain: Option<String>,
}

/// Forms of findings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// Text
    Text,
    /// `teachtree.check/1`: a list of findings
    Json,
    /// One line a finding, as workflows of GitHub show beside the code
    Github,
    /// SARIF 2.1.0, for code scanning and editors
    Sarif,
    /// JUnit, for CI systems: an error is a failure
    Junit,
}

/// Runs `check`.
pub fn run(args: &Args) -> Result<(), Failure> {
    if let Some(code) = &args.explain {
        return page(code);
    }
    let (others, rules): (Vec<PathBuf>, Vec<PathBuf>) = args.files.iter().cloned().partition(|file| is_yaml(file));
    let of_bindings = rules_of_bindings(args, &rules);
    let sets = if rules.is_empty() && !others.is_empty() { vec![] } else { sets(&rules)? };
    if args.form.format == Format::Text {
        return in_text(args, &others, &of_bindings, sets);
    }
    let mut checked = Vec::new();
    let mut failures = Vec::new();
    for file in &others {
        let found = other(file, &of_bindings).err();
        failures.extend(found.is_some().then_some(Failure::Unusable));
        let findings = found.iter().map(Finding::of_yaml).collect();
        checked.push(CheckedInput { name: file.display().to_string(), findings });
    }
    for files in sets {
        let name = files.first().map_or_else(|| "the shipped rules".into(), |file| file.display().to_string());
        let loaded = load(args, files);
        let failure = if loaded.root_unreadable { Failure::Unusable } else { Failure::Negative };
        failures.extend(loaded.rules.is_none().then_some(failure));
        let findings =
            loaded.diagnostics.iter().map(|found| Finding::of_rules(found, &loaded.sources, &name)).collect();
        checked.push(CheckedInput { name, findings });
    }
    match args.form.format {
        Format::Text => {}
        Format::Json => output::print_json(&as_json(&checked))?,
        Format::Sarif => output::print_json(&as_sarif(&checked))?,
        Format::Github => output::print(&as_github(&checked))?,
        Format::Junit => output::print_data(&as_junit(&checked))?,
    }
    Failure::all(failures)
}

/// Prints the findings of YAML files and of rule sets as text.
fn in_text(
    args: &Args,
    others: &[PathBuf],
    of_bindings: &RulesOptions,
    sets: Vec<Vec<PathBuf>>,
) -> Result<(), Failure> {
    let mut failures = Vec::new();
    for file in others {
        match other(file, of_bindings) {
            Ok(_) if is_quiet() => {}
            Ok(fine) => output::print(&fine)?,
            Err(error) => failures.push(error.into()),
        }
    }
    for files in sets {
        failures.extend(report(&load(args, files), args.verbose).err());
    }
    Failure::all(failures)
}

fn load(args: &Args, files: Vec<PathBuf>) -> LoadedRules {
    let (hand_file, overrides) = (args.hand.clone(), args.set.values.clone());
    language::load(&Request { files, hand_file, overrides, ..Request::default() })
}

/// The rules by which bindings are checked: the files that are named with them, or those of the program.
fn rules_of_bindings(args: &Args, files: &[PathBuf]) -> RulesOptions {
    let rules = files.iter().filter(|file| !file.is_dir()).fold(RulesOptions::default(), RulesOptions::file);
    let rules = args.hand.iter().fold(rules, RulesOptions::hand_file);
    args.set.values.iter().fold(rules, |rules, (name, value)| rules.param(name, value))
}

/// Checks a YAML file, a binding by these rules; returns what it is.
fn other(file: &Path, rules: &RulesOptions) -> Result<String, InputError> {
    let (place, text) = (file.display().to_string(), inputs::text(file)?);
    let Some(kind) = FileKind::of(file, &text) else {
        let message = "found none of the keys of a scene, an operator script, a binding or a robot file";
        return Err(InputError::new(place, message)
            .help("name it `NAME.scene.yaml`, `NAME.operator.yaml`, `NAME.binding.yaml` or `NAME.robot.yaml`"));
    };
    let more = inputs::read(kind, file, &text, Some(rules.clone()))?;
    let (facts, warnings) = more.split_at(more.find('\n').unwrap_or(more.len()));
    Ok(format!("{place}: {}{facts}, without errors{warnings}\n", kind.name()))
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

/// Prints the diagnostics of a rule set and its size, and its cost when `verbose`.
fn report(loaded: &LoadedRules, verbose: bool) -> Result<(), Failure> {
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
        out.push_str(&size(rules));
        let cost = cost(rules)?;
        if verbose {
            out.push_str(&cost);
        }
        out.push_str(&channels_of_failures(rules));
    }
    if !is_quiet() {
        output::print(&out)?;
    }
    if errors > 0 || loaded.rules.is_none() { Err(Failure::Negative) } else { Ok(()) }
}

/// Prints the page of a code, or what a kind of issue is.
fn page(code: &str) -> Result<(), Failure> {
    let upper = code.to_uppercase();
    let text = match (codes::page(&upper), IssueKind::from_name(&code.to_lowercase())) {
        (Some(page), _) => format!("{upper}\n\n{page}\n"),
        (None, Some(kind)) => {
            let about = kind.about();
            format!("{kind}\n\n{about}\n\nIt is an issue of a log; docs/logs.md, section Bad logs, has its causes.\n")
        }
        (None, None) => return Err(unknown_code(code).into()),
    };
    Ok(output::print(&text)?)
}

fn unknown_code(code: &str) -> InputError {
    let codes: Vec<&str> = codes::ALL.iter().map(|(code, _)| *code).collect();
    let kinds: Vec<&str> = IssueKind::ALL.iter().map(|kind| kind.name()).collect();
    let error = InputError::new("--explain", format!("`{code}` is neither a code nor a kind of issues"));
    error.help(match nearest(code, kinds.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("codes are {}; kinds of issues are {}", codes.join(", "), kinds.join(", ")),
    })
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

/// The number of declarations of each kind.
fn size(rules: &Rules) -> String {
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
    format!(
        "\n{}, {}, {}, {}, {}, {}\n",
        counted(rules.primitives.len(), "primitive", "primitives"),
        counted(rules.signals.len(), "signal", "signals"),
        counted(rules.latches.len(), "latch", "latches"),
        counted(rules.trees.len(), "tree", "trees"),
        counted(rules.tasks.len(), "task", "tasks") + &of_tasks + &failures,
        counted(rules.relabels.len(), "relabeling rule", "relabeling rules"),
    )
}

/// Formats the size of the compiled rules, the cost of a frame, and the delay of live labels.
fn cost(rules: &Rules) -> Result<String, Failure> {
    let graph = lower(rules);
    let mut out = format!(
        "{}, {}\n",
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
