//! `teachtree learn`: a rule file learned from labeled recordings, measured on groups of recordings that were held out.

mod extension;
mod json;
mod refitted;
mod relearned;

use super::analysis::AnalysisArgs;
use super::groups::Groups;
use super::output_args::FormatArg;
use super::parallel::{LogResults, ParallelArgs, distinct_failures};
use super::print_args::is_quiet;
use super::progress::Progress;
use super::truth::TruthArgs;
use super::{Failure, output};
use json::RuleOutput;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use teachtree_analysis::json::printed;
use teachtree_analysis::score::name_map::SEPARATE;
use teachtree_analysis::score::{NameMap, TrackTruth, Truth};
use teachtree_analysis::{Analysis, TrackId};
use teachtree_base::error::InputError;
use teachtree_language::is_primitive;
use teachtree_learn::{
    Declaration, Demonstration, FEW_GROUPS, LabeledSpan, LabeledTrack, LearningResult, REFITTED, learn,
};
use teachtree_session::{AnalysisInternals, LabelsInternals, Log, LogInternals};

/// Options of `learn`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree learn recordings/ --group-by '^(\\w+?)_' -o mine.rules\n  teachtree learn recordings/ --binding yumi.binding.yaml --labels labels/ --track both --map S1=Approach,S2=Grasp --group-by 'S(\\d)' --rules old.rules -o mine.rules\n  teachtree learn recordings/ --labels labels/ --from old.rules -o better.rules\n  teachtree learn recordings/ --labels labels/ --new Shake -o shake.rules\nWithout -o the rules are printed; --from prints a patch, also with -o. A file is written only if it is better than the rules of --rules on held-out recordings; with --from, only if something changes; with --new, only if it is proved additive.\nExit status: 0 there are rules, 1 there are none, 2 bad input."
)]
pub struct Args {
    /// Labeled recordings; a folder stands for all logs in it, `set#*` for all episodes of a data set
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    /// Learn this new primitive from labels that name it, as a file that extends the rules: `Shake`, or its declaration, such as `Shake is Translate`
    #[arg(long, value_name = "PRIMITIVE", value_parser = teachtree_new_primitive::declaration, conflicts_with = "group_by")]
    new: Option<Declaration>,
    /// Learn single guards and numbers of this rule file again where held-out groups gain, and print a patch; its order, labels and memory stay
    #[arg(long, value_name = "FILE.rules", conflicts_with_all = ["new", "rules", "anyway"])]
    from: Option<PathBuf>,
    /// Regular expression whose first capture group is the group of a recording, such as the person, in its name
    #[arg(long, value_name = "REGEX")]
    group_by: Option<String>,
    /// Write rules even if they are not better than those of --rules, or not proved additive
    #[arg(long)]
    anyway: bool,
    #[command(flatten)]
    truth: TruthArgs,
    #[command(flatten)]
    analysis: AnalysisArgs,
    #[command(flatten)]
    many: ParallelArgs,
    #[command(flatten)]
    form: FormatArg<Format>,
    /// Output file of the rules; by default standard output
    #[arg(long, short, value_name = "FILE.rules")]
    out: Option<PathBuf>,
}

/// Forms of the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// A table for the terminal
    Text,
    /// `teachtree.learning/1`
    Json,
}

/// Runs `learn`.
pub fn run(args: &Args) -> Result<(), Failure> {
    if let Some(new) = &args.new {
        return extension::run(args, new);
    }
    if let Some(from) = &args.from {
        return relearned::run(args, from);
    }
    let logs = args.truth.labeled_logs(args.analysis.logs(&args.logs)?)?;
    let places: Vec<&Path> = args.out.iter().map(PathBuf::as_path).collect();
    args.analysis.checked_inputs(&logs, &places)?;
    let groups = Groups::new(&logs, args.group_by.as_deref())?;
    let map = args.truth.names()?;
    args.analysis.source.check(logs.len())?;
    let recordings = labeled_logs(args, &args.analysis, &logs, &map)?;
    let names = names(&recordings)?;
    let has_rules = recordings.iter().all(|one| one.present.is_some());
    let progress = (has_rules && !is_quiet()).then(|| Progress::new("fitting the present rules"));
    let shown = |part: f64| progress.iter().for_each(|bar| bar.set(part));
    let refitted = refitted::analyses(args, &recordings, &groups, &shown)?;
    drop(progress);
    let refitted = (0..recordings.len()).map(|at| refitted.as_ref().and_then(|found| found.get(at)));
    let demonstrations: Result<Vec<Demonstration>, Failure> = recordings
        .iter()
        .zip(refitted)
        .zip(&groups.of_logs)
        .map(|((one, refitted), group)| one.demonstration(*group, &names, refitted))
        .collect();
    let learned = learned(args, &demonstrations?, &names)?;
    print(args, &logs, &groups, &learned)?;
    if args.anyway || learned.is_better() { Ok(()) } else { Err(Failure::Negative) }
}

fn learned(args: &Args, demonstrations: &[Demonstration], names: &[String]) -> Result<LearningResult, Failure> {
    let progress = (!is_quiet()).then(|| Progress::new("learning"));
    let shown = |part: f64| progress.iter().for_each(|bar| bar.set(part));
    let learned = args.many.each("learning", &[()], |_| learn(demonstrations, names, &shown))?.pop();
    drop(progress);
    Ok(learned.unwrap_or_else(|| Err(InputError::new("the command line", "there are no recordings")))?)
}

/// A recording with its labels.
struct LabeledLog {
    log: Log,
    truth: Truth,
    /// What the present rules find in it.
    present: Option<Analysis>,
    warnings: Vec<String>,
}

/// Reads all recordings, and runs the rules that `analysis` names on them.
fn labeled_logs(
    args: &Args,
    analysis: &AnalysisArgs,
    logs: &[PathBuf],
    map: &NameMap,
) -> Result<Vec<LabeledLog>, Failure> {
    let LogResults { done, failed } = args.many.each_log("reading", logs, |log| read(args, analysis, log, map))?;
    Failure::all(distinct_failures(failed))?;
    let recordings: Vec<LabeledLog> = done.into_iter().map(|(_, recording)| recording).collect();
    recordings.iter().flat_map(|recording| &recording.warnings).for_each(|warning| output::warn(warning));
    Ok(recordings)
}

fn read(args: &Args, analysis: &AnalysisArgs, log: &Path, map: &NameMap) -> Result<LabeledLog, Failure> {
    let has_rules = analysis.has_present_rules(log)?;
    let log = analysis.read(log)?;
    let only = match log.hands().as_slice() {
        [hand] => Some(TrackId::Hand(*hand)),
        _ => None,
    };
    let (truth, warnings) = args.truth.of_log(log.path())?.of_any_names(log.opened()?, only, map)?;
    let present = has_rules.then(|| analysis.analyze(&log)).transpose()?;
    let present = present.map(|analysis| analysis.found().clone());
    Ok(LabeledLog { log, truth, present, warnings })
}

/// The names of all labels, in the order in which they first occur.
fn names(recordings: &[LabeledLog]) -> Result<Vec<String>, InputError> {
    let mut names: Vec<String> = Vec::new();
    for LabeledLog { log, truth, .. } in recordings {
        for span in truth.tracks.iter().flat_map(|track| &track.primitives) {
            let wrong = |message: String| InputError::new(log.name(), message);
            let [name] = span.names.as_slice() else {
                return Err(wrong(format!("found `{}`, expected one name for each label", span.name()))
                    .help("map each label to one name: `--map S1=Move`"));
            };
            if name == SEPARATE || !is_primitive(name) {
                return Err(wrong(format!(
                    "found the label `{name}`, expected the name of a primitive, such as `Grasp`"
                ))
                .help(format!(
                    "map it to a name, or leave its time out: `--map '{name}=Grasp'`, `--map '{name}=mask'`"
                )));
            }
            if !names.contains(name) {
                names.push(name.clone());
            }
        }
    }
    Ok(names)
}

impl LabeledLog {
    /// It with the label names; `refitted` is what the present rules with fitted params find.
    fn demonstration(
        &self,
        group: usize,
        names: &[String],
        refitted: Option<&Analysis>,
    ) -> Result<Demonstration<'_>, Failure> {
        let opened = self.log.opened()?;
        let tracks = self.truth.tracks.iter().filter(|track| !track.primitives.is_empty());
        Ok(Demonstration {
            name: self.log.name(),
            group,
            hands: self.log.hands(),
            frames: Box::new(move |channels| opened.frames(channels)),
            tracks: tracks.map(|track| self.track(track, names, refitted)).collect(),
        })
    }

    fn track(&self, truth: &TrackTruth, names: &[String], refitted: Option<&Analysis>) -> LabeledTrack {
        let labels = truth.primitives.iter().map(|span| {
            let label = span.names.first().map_or(names.len(), |name| position(name, names));
            LabeledSpan { label, start_s: span.start_s, end_s: span.end_s }
        });
        let found = |found: Option<&Analysis>| labels_of(found?, truth.who, names);
        let (present, refitted) = (found(self.present.as_ref()), found(refitted));
        LabeledTrack { who: truth.who, spans: labels.collect(), present, refitted }
    }
}

/// The position of a label; after the last one for any other name.
fn position(name: &str, names: &[String]) -> usize {
    names.iter().position(|known| known == name).unwrap_or(names.len())
}

/// The labels that rules give a track; `None` if they do not label it.
fn labels_of(found: &Analysis, who: TrackId, names: &[String]) -> Option<Vec<LabeledSpan>> {
    let is_label = |name: &str| names.iter().any(|known| known == name);
    let segments = found.track(who)?.relabeled.iter().map(|segment| LabeledSpan {
        label: position(found.primitives.counts_for(&segment.primitive, is_label), names),
        start_s: segment.start_s,
        end_s: segment.end_s,
    });
    Some(segments.collect())
}

fn print(args: &Args, logs: &[PathBuf], groups: &Groups, learned: &LearningResult) -> Result<(), InputError> {
    let is_written = args.anyway || learned.is_better();
    if let (Some(path), true) = (&args.out, is_written) {
        let mut inputs = args.analysis.inputs(logs);
        inputs.extend(args.truth.labels.iter().cloned());
        output::write(path, &learned.text, &inputs)?;
    }
    warn_of_few(groups);
    if args.form.format == Format::Json {
        let file = args.out.as_deref().filter(|_| is_written);
        let written = RuleOutput { rules: &learned.text, is_better: learned.is_better(), file };
        return args.form.print(&printed(&json::of_file(&written, learned, logs.len(), &groups.names)));
    }
    output::print(&table(args, logs.len(), groups, learned, is_written))?;
    if args.out.is_none() && is_written { output::print_data(&format!("\n{}", learned.text)) } else { Ok(()) }
}

fn warn_of_few(groups: &Groups) {
    if groups.names.len() < FEW_GROUPS {
        output::warn(&format!(
            "{} groups: learned rules may not hold for other people or setups; {FEW_GROUPS} groups or more show whether they do",
            groups.names.len()
        ));
    }
}

fn table(args: &Args, logs: usize, groups: &Groups, learned: &LearningResult, is_written: bool) -> String {
    let (boundaries, kinds) = learned.boundaries;
    let mut text = format!(
        "{logs} recordings in {} groups ({}); {boundaries} boundaries of {kinds} kinds; {} conditions; {}\n\n",
        groups.names.len(),
        groups.origin,
        learned.conditions,
        learned.extent.text("the rules")
    );
    let _ = writeln!(text, "{:<20}{:>16}{:>9}{:>7}", "candidate", "held out: F1@50", "frames", "lines");
    for (at, candidate) in learned.candidates.iter().enumerate() {
        let [f1, frames] = [candidate.f1, candidate.accuracy].map(|part| format!("{:.1} %", part * 100.0));
        let lines = candidate.lines.map_or(String::new(), |lines| lines.to_string());
        let mark = if at != learned.chosen {
            ""
        } else if is_written {
            "   written"
        } else {
            "   chosen"
        };
        let _ = writeln!(text, "{:<20}{f1:>16}{frames:>9}{lines:>7}{mark}", candidate.name);
    }
    let place = args.out.as_ref().map_or("standard output".into(), |path| path.display().to_string());
    let _ = match (is_written, learned.is_better()) {
        (true, true) => {
            writeln!(
                text,
                "\nwritten to {place}: the best candidate; a rule or condition less counts 0.2 points of F1@50"
            )
        }
        (true, false) => {
            writeln!(text, "\nwritten to {place} as --anyway asks: it is not better than the present rules")
        }
        (false, _) => {
            let is_refitted = learned.present().is_some_and(|present| present.name == REFITTED);
            let fitted = if is_refitted { " with fitted params, whose patch `fit` prints" } else { "" };
            writeln!(
                text,
                "\nnothing is written: no candidate is better than the present rules{fitted}; --anyway writes the chosen one"
            )
        }
    };
    text
}
