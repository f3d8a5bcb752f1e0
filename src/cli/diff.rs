//! `teachtree diff`: two rule sets, compared by their declarations and by their results on recordings.

use super::Failure;
use super::analysis::AnalysisArgs;
use super::output_args::FormatArg;
use super::parallel::{LogResults, ParallelArgs, named_failures};
use super::rules::{RuleArgs, load_files};
use super::source::SourceArgs;
use super::truth::{TruthArgs, lacks_labels};
use serde_json::{Map, Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use teachtree_analysis::difference::{Change, Extent, changes, extent, tracks};
use teachtree_analysis::json::{VERSION, printed};
use teachtree_analysis::outcome::Outcome;
use teachtree_analysis::score::{ComparedResult, Comparison, KnownNames, NameMap, compare};
use teachtree_analysis::{Analysis, TaskSpan, TrackId};
use teachtree_language::graph::compare::{Difference, TreeComparison, declarations, differences};
use teachtree_session as session;
use teachtree_session::{AnalysisInternals, LabelsInternals, LogInternals, RulesInternals};

/// Options of `diff`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree diff contact.rules tap.rules\n  teachtree diff old/tap.rules new/tap.rules demonstration.csv\n  teachtree diff old.rules new.rules recordings/ --labels recordings/"
)]
pub struct Args {
    /// The first rules
    one: PathBuf,
    /// The second rules
    other: PathBuf,
    /// Recordings on which both are run; a folder stands for all its logs, `set#*` for all episodes of a data set
    #[arg(value_name = "LOG")]
    logs: Vec<PathBuf>,
    #[command(flatten)]
    many: ParallelArgs,
    /// The hand model that implements the abstract signals of both; overrides the binding's
    #[arg(long, value_name = "FILE")]
    hand: Option<String>,
    #[command(flatten)]
    truth: TruthArgs,
    #[command(flatten)]
    source: SourceArgs,
    #[command(flatten)]
    form: FormatArg<Format>,
}

/// Forms of a comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// Lines for the terminal
    Text,
    /// `teachtree.difference/1`
    Json,
}

/// The differences of the rules.
struct RuleDifferences {
    declarations: Vec<String>,
    trees: TreeComparison,
}

/// The differences of the results on a recording.
struct LogDifferences {
    changes: Vec<Change>,
    /// Tasks that one of the results has: the first one's, or the second one's where `true`.
    tasks: Vec<(TrackId, TaskSpan, bool)>,
    /// The outcomes, where they differ.
    outcomes: Option<[Outcome; 2]>,
    extent: Extent,
    agreement: Agreement,
}

/// Which of two results agrees better with labels.
enum Agreement {
    /// The log has no labels.
    Unasked,
    /// `--labels` has none for the log.
    Lacking(PathBuf),
    Known(Comparison),
}

/// Runs `diff`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let read = |file: &PathBuf| load_files(std::slice::from_ref(file), args.hand.as_deref());
    let (one, other) = (read(&args.one)?, read(&args.other)?);
    let rules = RuleDifferences {
        declarations: declarations(one.set(), other.set()),
        trees: differences(one.set(), other.set()),
    };
    let by = |file: &PathBuf| AnalysisArgs {
        rules: RuleArgs::of_files(std::slice::from_ref(file), args.hand.as_deref()),
        source: args.source.clone(),
    };
    let (by_one, by_other) = (by(&args.one), by(&args.other));
    let logs = by_one.logs(&args.logs)?;
    args.source.check(logs.len())?;
    args.truth.check(&logs)?;
    let names = args.truth.names()?;
    let LogResults { done, failed } = args.many.each_log("comparing", &logs, |log| {
        let opened = by_one.read(log)?;
        let (ours, theirs) = (by_one.analyze(&opened)?, by_other.analyze(&opened)?);
        LogDifferences::new(args, &ours, &theirs, &names)
    })?;
    let failures = named_failures(failed);
    // If no recording could be read, the difference of the rules would hide the error.
    if !done.is_empty() || failures.is_empty() {
        args.form.print(&match args.form.format {
            Format::Text => text(args, &rules, &done),
            Format::Json => printed(&document(args, &rules, &done)),
        })?;
    }
    Failure::some(failures, done.len())
}

impl LogDifferences {
    fn new(
        args: &Args,
        ours: &session::Analysis,
        theirs: &session::Analysis,
        names: &NameMap,
    ) -> Result<Self, Failure> {
        let (one, other) = (ours.found(), theirs.found());
        let changes = changes(one, other);
        let outcomes = [one.outcome(), other.outcome()];
        Ok(Self {
            tasks: task_changes(one, other),
            extent: extent(one, other, &changes),
            outcomes: (outcomes[0].result != outcomes[1].result).then_some(outcomes),
            agreement: agreement(args, ours, theirs, names)?,
            changes,
        })
    }

    fn is_empty(&self) -> bool {
        self.changes.is_empty() && self.tasks.is_empty() && self.outcomes.is_none()
    }
}

/// The tasks that only one of two results has, by track; those of the first result come first.
fn task_changes(one: &Analysis, other: &Analysis) -> Vec<(TrackId, TaskSpan, bool)> {
    let mut found = Vec::new();
    for who in tracks(one, other) {
        let [ours, theirs] = [one, other].map(|analysis| analysis.track(who).map_or(&[][..], |track| &track.tasks));
        let key = |task: &TaskSpan| (task.task.clone(), task.frames.clone());
        let only = |tasks: &[TaskSpan], others: &[TaskSpan], is_new: bool| {
            let lacks = |task: &&TaskSpan| !others.iter().any(|known| key(known) == key(task));
            tasks.iter().filter(lacks).map(|task| (who, task.clone(), is_new)).collect::<Vec<_>>()
        };
        found.extend(only(ours, theirs, false));
        found.extend(only(theirs, ours, true));
    }
    found
}

/// Which of two results agrees better with the labels: those of `--labels`, else those of the log where it has any.
fn agreement(
    args: &Args,
    ours: &session::Analysis,
    theirs: &session::Analysis,
    names: &NameMap,
) -> Result<Agreement, Failure> {
    // A log without labels is compared too.
    let labels = args.truth.labels_of(ours.log().path())?;
    if let Some(labels) = labels.as_ref().filter(|labels| lacks_labels(labels, ours.log().path())) {
        return Ok(Agreement::Lacking(labels.clone()));
    }
    let known = [ours, theirs].map(|analysis| KnownNames::new(analysis.rules().set()));
    let truth = |analysis: &session::Analysis, known: &KnownNames| {
        let labels = args.truth.of_log(analysis.log().path())?;
        let (truth, _) = labels.of(analysis.log().opened()?, analysis.found(), names, known)?;
        Ok::<_, Failure>(truth)
    };
    let [of_ours, of_theirs] = &known;
    let compared = truth(ours, of_ours).and_then(|one| {
        let other = truth(theirs, of_theirs)?;
        let one = ComparedResult { truth: &one, found: ours.found(), meta: ours.meta(), known: of_ours };
        let other = ComparedResult { truth: &other, found: theirs.found(), meta: theirs.meta(), known: of_theirs };
        Ok(compare([&one, &other])?)
    });
    match compared {
        Ok(compared) => Ok(Agreement::Known(compared)),
        Err(_) if labels.is_none() => Ok(Agreement::Unasked),
        Err(error) => Err(error),
    }
}

/// The comparison for people.
fn text(args: &Args, rules: &RuleDifferences, logs: &[(&PathBuf, LogDifferences)]) -> String {
    let other_name = args.other.display();
    let mut text = String::new();
    for what in &rules.declarations {
        let _ = writeln!(text, "in {other_name} {what}");
    }
    for tree in &rules.trees.alone {
        let _ = writeln!(text, "only one of them has the tree {tree}");
    }
    write_tree_differences(&rules.trees, &mut text);
    if rules.trees.differences.is_empty() && !rules.trees.is_cut {
        for tree in &rules.trees.trees {
            let _ = writeln!(
                text,
                "{tree}: the same leaf on every frame, if declarations of the same name have the same meaning"
            );
        }
    }
    for (log, found) in logs {
        let _ = writeln!(text, "\n{}", log.display());
        write_log_differences(found, &mut text);
        write_agreement(args, &found.agreement, &mut text);
    }
    text
}

/// The cases in which trees differ.
pub(super) fn write_tree_differences(compared: &TreeComparison, text: &mut String) {
    for Difference { tree, conditions, before, one, other, place } in &compared.differences {
        let _ = writeln!(text, "  {tree}: {one} becomes {other}   {place}");
        if let Some(before) = before {
            let _ = writeln!(text, "    after {before}, when");
        } else {
            text.push_str("    when\n");
        }
        for (condition, holds) in conditions {
            let _ = writeln!(text, "      {} {condition}", if *holds { "yes" } else { "no " });
        }
    }
    if compared.is_cut {
        text.push_str("  the comparison reached its limit of paths: there may be more differences\n");
    }
}

fn write_log_differences(found: &LogDifferences, text: &mut String) {
    for Change { who, start_s, end_s, one, other, .. } in &found.changes {
        let _ = writeln!(text, "  {who} {start_s:.3} – {end_s:.3} s: {one} becomes {other}");
    }
    for (who, TaskSpan { task, start_s, end_s, .. }, is_new) in &found.tasks {
        let what = if *is_new { "new" } else { "gone" };
        let _ = writeln!(text, "  {who} task {task} {start_s:.3} – {end_s:.3} s is {what}");
    }
    if let Some([ours, theirs]) = &found.outcomes {
        let _ = writeln!(text, "  outcome {} becomes {}", ours.result, theirs.sentence());
    }
    if found.is_empty() {
        text.push_str("  no difference\n");
        return;
    }
    let Extent { frames, of_frames, segments, of_segments } = found.extent;
    let share = 100.0 * frames as f64 / of_frames.max(1) as f64;
    let _ = writeln!(
        text,
        "  {frames} of {of_frames} frames ({share:.1} %) and {segments} of {of_segments} segments differ"
    );
}

fn write_agreement(args: &Args, agreement: &Agreement, text: &mut String) {
    let Comparison { accuracy, scored_s, unknown } = match agreement {
        Agreement::Unasked => return,
        Agreement::Lacking(labels) => {
            let _ = writeln!(text, "  no label file in {}: which agrees better is not known", labels.display());
            return;
        }
        Agreement::Known(compared) => compared,
    };
    for (primitive, time) in unknown {
        let _ = writeln!(text, "  no label names {primitive}: {time:.1} s with it are not compared");
    }
    if let [Some(one), Some(other)] = accuracy {
        let better = match (other - one) * 100.0 {
            by if by > 0.05 => format!("{} agrees better", args.other.display()),
            by if by < -0.05 => format!("{} agrees better", args.one.display()),
            _ => "both agree alike".into(),
        };
        let (one, other) = (one * 100.0, other * 100.0);
        let _ = writeln!(text, "  of {scored_s:.1} s with labels {one:.1} % and {other:.1} % agree: {better}");
    }
}

/// The comparison as `teachtree.difference/1` (docs/formats.md).
fn document(args: &Args, rules: &RuleDifferences, logs: &[(&PathBuf, LogDifferences)]) -> Value {
    let mut document = json!({
        "schema": "teachtree.difference/1",
        "version": VERSION,
        "one": args.one.display().to_string(),
        "other": args.other.display().to_string(),
        "declarations": rules.declarations,
    });
    add_tree_differences(&rules.trees, &mut document);
    document["recordings"] = logs.iter().map(|(log, found)| recording(log, found)).collect();
    document
}

/// Adds the fields of a comparison of trees.
pub(super) fn add_tree_differences(compared: &TreeComparison, document: &mut Value) {
    let difference = |found: &Difference| {
        let conditions = found.conditions.iter();
        let conditions = conditions.map(|(condition, holds)| json!({"condition": condition, "holds": holds}));
        json!({
            "tree": found.tree,
            "place": found.place,
            "one": found.one,
            "other": found.other,
            "previous": found.before,
            "conditions": conditions.collect::<Vec<_>>(),
        })
    };
    document["trees"] = json!(compared.trees);
    document["unpaired_trees"] = json!(compared.alone);
    document["differences"] = compared.differences.iter().map(difference).collect();
    document["complete"] = json!(!compared.is_cut);
}

fn recording(log: &Path, found: &LogDifferences) -> Value {
    let changes = found.changes.iter().map(|change| {
        let Change { who, start_s, end_s, one, other, .. } = change;
        json!({"track": who.to_string(), "start_s": start_s, "end_s": end_s, "one": one, "other": other})
    });
    let tasks = found.tasks.iter().map(|(who, task, is_new)| {
        let in_other = if *is_new { "new" } else { "gone" };
        json!({"track": who.to_string(), "task": task.task, "start_s": task.start_s, "end_s": task.end_s, "change": in_other})
    });
    let mut recording = Map::new();
    recording.insert("log".into(), json!(log.display().to_string()));
    recording.insert("changes".into(), changes.collect());
    recording.insert("tasks".into(), tasks.collect());
    if let Some([one, other]) = &found.outcomes {
        recording.insert("outcome".into(), json!({"one": one.result.to_string(), "other": other.result.to_string()}));
    }
    let Extent { frames, of_frames, segments, of_segments } = found.extent;
    recording.insert("frames".into(), json!({"changed": frames, "all": of_frames}));
    recording.insert("segments".into(), json!({"changed": segments, "all": of_segments}));
    if let Agreement::Known(Comparison { accuracy: [one, other], scored_s, unknown }) = &found.agreement {
        let agreement = json!({"scored_s": scored_s, "one": one, "other": other, "unknown_s": unknown});
        recording.insert("agreement".into(), agreement);
    }
    Value::Object(recording)
}
