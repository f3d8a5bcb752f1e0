//! `teachtree prove` and `teachtree diff`: two rule sets held against each other.

use super::analysis::AnalysisArgs;
use super::parallel::{LogResults, ParallelArgs, named_failures};
use super::rules::{RuleArgs, load_files};
use super::source::SourceArgs;
use super::truth::{TruthArgs, lacks_labels};
use super::{Failure, output};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use teachtree_analysis::Analysis;
use teachtree_analysis::difference::{changes, extent, tracks};
use teachtree_analysis::score::{ComparedResult, Comparison, KnownNames, NameMap, compare};
use teachtree_language::DEFAULT_HAND;
use teachtree_language::graph::compare::{
    Difference, ExtensionProof, TreeComparison, declarations, differences, prove_extension,
};
use teachtree_session as session;
use teachtree_session::files::all_logs;
use teachtree_session::{AnalysisInternals, LabelsInternals, LogInternals, RulesInternals};

/// Options of `prove`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree prove additive single_hand.rules contact.rules\n  teachtree prove additive contact.rules tap.rules --hand hand_flags.rules\nExit status: 0 proved, 1 not proved, 2 bad input."
)]
pub struct ProveArgs {
    /// What is to be proved
    #[arg(value_enum)]
    claim: Claim,
    /// The rules that are extended
    base: PathBuf,
    /// The rules that use and extend them
    extended: PathBuf,
    /// The hand file that implements the abstract signals of both
    #[arg(long, value_name = "FILE")]
    hand: Option<String>,
}

/// What can be proved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Claim {
    /// Base and extension analyze every recording alike until a primitive of the extension occurs
    Additive,
}

/// Options of `diff`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree diff contact.rules tap.rules\n  teachtree diff old/tap.rules new/tap.rules demonstration.csv\n  teachtree diff old.rules new.rules recordings/ --labels recordings/"
)]
pub struct DiffArgs {
    /// The first rules
    one: PathBuf,
    /// The second rules
    other: PathBuf,
    /// Recordings on which both are run; a folder stands for all logs in it, `set#*` for all episodes of a data set
    #[arg(value_name = "LOG")]
    logs: Vec<PathBuf>,
    #[command(flatten)]
    many: ParallelArgs,
    /// The hand file that implements the abstract signals of both; overrides the binding's
    #[arg(long, value_name = "FILE")]
    hand: Option<String>,
    #[command(flatten)]
    truth: TruthArgs,
    #[command(flatten)]
    source: SourceArgs,
}

/// Runs `prove`.
pub fn prove(args: &ProveArgs) -> Result<(), Failure> {
    let Claim::Additive = args.claim;
    let read = |file: &PathBuf| load_files(std::slice::from_ref(file), args.hand.as_deref());
    let rules = read(&args.base)?;
    let proof = prove_extension(rules.set(), read(&args.extended)?.set());
    let (base, extended) = (args.base.display(), args.extended.display());
    let mut printed = String::new();
    if proof.is_proved() {
        let _ = writeln!(printed, "proved: {extended} only adds to {base}");
        let hand = args.hand.as_deref().unwrap_or(DEFAULT_HAND);
        let hand = rules.files().any(|file| Path::new(file).ends_with(hand)).then_some(hand);
        write_proof(&proof, hand, &mut printed);
    } else {
        let is_undecided = proof.findings.is_empty() && proof.trees.differences.is_empty();
        let _ = if is_undecided {
            writeln!(printed, "not proved: whether {extended} only adds to {base} is undecided")
        } else {
            writeln!(printed, "not proved: {extended} does not only add to {base}")
        };
        for finding in &proof.findings {
            let _ = writeln!(printed, "  {}   {}", finding.what, finding.place);
        }
        write_differences(&proof.trees, &mut printed);
        if proof.of_one_hand {
            printed.push_str("  for recordings of one hand, it is proved\n");
        }
    }
    output::print(&printed)?;
    if proof.is_proved() { Ok(()) } else { Err(Failure::Negative) }
}

/// Formats the result of a proof and the hand file that it holds for.
fn write_proof(proof: &ExtensionProof, hand: Option<&str>, printed: &mut String) {
    let new = if proof.new.is_empty() { "none".to_string() } else { proof.new.join(", ") };
    let _ = writeln!(printed, "  new primitives: {new}");
    for tree in &proof.trees.trees {
        let _ =
            writeln!(printed, "  {tree}: on every frame and in every state of the base, its leaf or a new primitive");
    }
    for tree in &proof.trees.alone {
        let _ = writeln!(printed, "  {tree}: a new tree, which gives `separate` or a new primitive");
    }
    printed.push_str("  channels, params, signals, latches, primitives and settling of the base keep their meaning\n");
    printed.push_str("  relabeling and tasks are those of the base where no new primitive occurs\n");
    let hand = hand.map_or(String::new(), |hand| format!(" the hand file {hand} and"));
    let _ = writeln!(
        printed,
        "  this holds for every recording that both analyze, with{hand} the declared values of params;"
    );
    printed.push_str(
        "  in a gap-free interval, leaves are equal up to the first new primitive; after it, the previous leaf differs, and so may `from`\n",
    );
}

/// Runs `diff`.
pub fn diff(args: &DiffArgs) -> Result<(), Failure> {
    let read = |file: &PathBuf| load_files(std::slice::from_ref(file), args.hand.as_deref());
    let (one, other) = (read(&args.one)?, read(&args.other)?);
    let (one, other) = (one.set(), other.set());
    let other_name = args.other.display().to_string();
    let compared = differences(one, other);
    let mut printed = String::new();
    for what in declarations(one, other) {
        let _ = writeln!(printed, "in {other_name} {what}");
    }
    for tree in &compared.alone {
        let _ = writeln!(printed, "only one of them has the tree {tree}");
    }
    write_differences(&compared, &mut printed);
    if compared.differences.is_empty() && !compared.is_cut {
        for tree in &compared.trees {
            let _ =
                writeln!(printed, "{tree}: the same leaf on every frame, as long as the declarations mean the same");
        }
    }
    let logs = all_logs(&args.logs)?;
    args.source.check(logs.len())?;
    args.truth.check(logs.len())?;
    let names = args.truth.of_session().names()?;
    let by = |file: &PathBuf| AnalysisArgs {
        rules: RuleArgs::of_files(std::slice::from_ref(file), args.hand.as_deref()),
        source: args.source.clone(),
    };
    let (by_one, by_other) = (by(&args.one), by(&args.other));
    let LogResults { done, failed } = args.many.each_log("comparing", &logs, |log| {
        let opened = by_one.read(log)?;
        let (ours, theirs) = (by_one.analyze(&opened)?, by_other.analyze(&opened)?);
        let mut printed = format!("\n{}\n", log.display());
        write_log_differences(ours.found(), theirs.found(), &mut printed);
        write_agreement(args, &ours, &theirs, &names, &mut printed)?;
        Ok(printed)
    })?;
    let failures = named_failures(failed);
    printed.extend(done.iter().map(|(_, text)| text.as_str()));
    // Where no recording could be read, the difference of the rules would hide it.
    if !done.is_empty() || failures.is_empty() {
        output::print(&printed)?;
    }
    Failure::some(failures, done.len())
}

/// The cases in which trees differ.
fn write_differences(compared: &TreeComparison, printed: &mut String) {
    for Difference { tree, conditions, before, one, other, place } in &compared.differences {
        let _ = writeln!(printed, "  {tree}: {one} becomes {other}   {place}");
        if let Some(before) = before {
            let _ = writeln!(printed, "    after {before}, when");
        } else {
            printed.push_str("    when\n");
        }
        for (condition, holds) in conditions {
            let _ = writeln!(printed, "      {} {condition}", if *holds { "yes" } else { "no " });
        }
    }
    if compared.is_cut {
        printed.push_str("  there may be more differences: not all pairs of ways were looked through\n");
    }
}

/// Where two analyses of a recording differ.
fn write_log_differences(one: &Analysis, other: &Analysis, printed: &mut String) {
    let before = printed.len();
    let all = changes(one, other);
    for who in tracks(one, other) {
        let (ours, theirs) = (one.track(who), other.track(who));
        for change in all.iter().filter(|change| change.who == who) {
            let (start_s, end_s) = (change.start_s, change.end_s);
            let _ = writeln!(printed, "  {who} {start_s:.3} – {end_s:.3} s: {} becomes {}", change.one, change.other);
        }
        let tasks = [ours, theirs].map(|track| {
            let tasks = track.map_or(&[][..], |track| &track.tasks);
            tasks
                .iter()
                .map(|task| format!("{} {:.3} – {:.3} s", task.task, task.start_s, task.end_s))
                .collect::<Vec<_>>()
        });
        for gone in tasks[0].iter().filter(|task| !tasks[1].contains(task)) {
            let _ = writeln!(printed, "  {who} task {gone} is gone");
        }
        for new in tasks[1].iter().filter(|task| !tasks[0].contains(task)) {
            let _ = writeln!(printed, "  {who} task {new} is new");
        }
    }
    let outcomes = [one.outcome(), other.outcome()];
    if let [ours, theirs] = &outcomes
        && ours.result != theirs.result
    {
        let _ = writeln!(printed, "  outcome {} becomes {}", ours.result, theirs.sentence());
    }
    if printed.len() == before {
        printed.push_str("  no difference\n");
    } else {
        let it = extent(one, other, &all);
        let share = 100.0 * it.frames as f64 / it.of_frames.max(1) as f64;
        let _ = writeln!(
            printed,
            "  {} of {} frames ({share:.1} %) and {} of {} segments differ",
            it.frames, it.of_frames, it.segments, it.of_segments
        );
    }
}

/// Which of two analyses agrees better with the labels: those of `--labels`, else those of the log where it has any.
fn write_agreement(
    args: &DiffArgs,
    ours: &session::Analysis,
    theirs: &session::Analysis,
    names: &NameMap,
    printed: &mut String,
) -> Result<(), Failure> {
    // A log without labels is compared all the same.
    if let Some(labels) = args.truth.labels.as_ref().filter(|labels| lacks_labels(labels, ours.log().path())) {
        let _ = writeln!(printed, "  no label file in {}: which agrees better is not known", labels.display());
        return Ok(());
    }
    let known = [ours, theirs].map(|analysis| KnownNames::new(analysis.rules().set()));
    let truth = |analysis: &session::Analysis, known: &KnownNames| {
        let (truth, _) = args.truth.of_session().of(analysis.log().opened()?, analysis.found(), names, known)?;
        Ok::<_, Failure>(truth)
    };
    let [of_ours, of_theirs] = &known;
    let compared = truth(ours, of_ours).and_then(|one| {
        let other = truth(theirs, of_theirs)?;
        let one = ComparedResult { truth: &one, found: ours.found(), meta: ours.meta(), known: of_ours };
        let other = ComparedResult { truth: &other, found: theirs.found(), meta: theirs.meta(), known: of_theirs };
        Ok(compare([&one, &other])?)
    });
    let Comparison { accuracy, scored_s, unknown } = match compared {
        Ok(compared) => compared,
        Err(_) if args.truth.labels.is_none() => return Ok(()),
        Err(error) => return Err(error),
    };
    for (primitive, time) in unknown {
        let _ = writeln!(printed, "  the labels do not know {primitive}: {time:.1} s with it are not compared");
    }
    if let [Some(one), Some(other)] = accuracy {
        let better = match (other - one) * 100.0 {
            by if by > 0.05 => format!("{} agrees better", args.other.display()),
            by if by < -0.05 => format!("{} agrees better", args.one.display()),
            _ => "both agree alike".into(),
        };
        let _ = writeln!(
            printed,
            "  of {scored_s:.1} s with labels {:.1} % and {:.1} % agree: {better}",
            one * 100.0,
            other * 100.0
        );
    }
    Ok(())
}
