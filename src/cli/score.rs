//! `teachtree score`: what is found in recordings against what is true.

use super::analysis::AnalysisArgs;
use super::output_args::{FormatArg, OutArg};
use super::parallel::{LogResults, ParallelArgs, distinct_failures};
use super::truth::{TruthArgs, read};
use super::{Failure, output};
use std::path::{Path, PathBuf};
use teachtree_analysis::json::Meta;
use teachtree_analysis::score::{self, KnownNames, NameMap, Row, Score, Sequences, Stage, Truth};
use teachtree_base::error::InputError;
use teachtree_logs::atomic_write::Files;
use teachtree_report as report;
use teachtree_session::{AnalysisInternals, LabelsInternals, LogInternals, RulesInternals};

/// Options of `score`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree score demonstration.csv\n  teachtree score recordings/ --format json -o score.json --picture score.svg\n  teachtree score S2_T1.csv --binding yumi.binding.yaml --labels S2_T1_segments.csv --track right --map 'S1=Move|Approach,S2=Grasp,S9=mask'\n  teachtree score 'set#*' --binding lab.binding.yaml --labels labels/ --track right --min-f1 85"
)]
pub struct Args {
    /// Recordings; a folder stands for all its logs, `set#*` for all episodes of a data set
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    #[command(flatten)]
    truth: TruthArgs,
    #[command(flatten)]
    analysis: AnalysisArgs,
    #[command(flatten)]
    many: ParallelArgs,
    /// Relabel the truth by the same rules before relabeled segments are compared with it
    #[arg(long)]
    relabel_truth: bool,
    /// The expected sequences of tasks, instead of those of the truth: YAML, `task: Move Approach …`
    #[arg(long, value_name = "FILE")]
    sequences: Option<PathBuf>,
    /// Also score the segments before relabeling
    #[arg(long)]
    raw: bool,
    /// Fail when frame accuracy over all recordings is below this, in percent
    #[arg(long, value_name = "PERCENT", value_parser = percent)]
    min_accuracy: Option<f64>,
    /// Fail when F1 at an overlap of 50 % is below this, in percent
    #[arg(long, value_name = "PERCENT", value_parser = percent)]
    min_f1: Option<f64>,
    /// Fail when the edit score is below this, in percent
    #[arg(long, value_name = "PERCENT", value_parser = percent)]
    min_edit: Option<f64>,
    #[command(flatten)]
    form: FormatArg<Format>,
    #[command(flatten)]
    out: OutArg,
    /// Also draw confusions and boundary errors
    #[arg(long, value_name = "FILE.svg")]
    picture: Option<PathBuf>,
}

/// Forms of a score.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// Tables for the terminal
    Text,
    /// `teachtree.score/1`
    Json,
}

/// Reads a percentage.
fn percent(text: &str) -> Result<f64, String> {
    let number = text.trim().strip_suffix('%').unwrap_or(text).trim();
    let value: Option<f64> = number.parse().ok().filter(|value| (0.0..=100.0).contains(value));
    value.ok_or_else(|| "expected a number from 0 to 100".into())
}

/// Runs `score`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let outputs: Vec<&Path> = args.out.file.iter().chain(&args.picture).map(PathBuf::as_path).collect();
    output::refuse_one_for_two(&outputs)?;
    let logs = args.truth.labeled_logs(args.analysis.logs(&args.logs)?)?;
    args.analysis.checked_inputs(&logs, &outputs)?;
    let map = args.truth.names()?;
    let sequences = args.sequences.as_deref().map(|path| Ok::<_, InputError>((path, read(path)?))).transpose()?;
    let texts = ScoreInputs { map, sequences };
    args.analysis.source.check(logs.len())?;
    let LogResults { done, failed } = args.many.each_log("scoring", &logs, |log| score_log(args, log, &texts))?;
    let (failures, count) = (distinct_failures(failed), done.len());
    let (mut relabeled, mut raw, mut meta) = (Vec::new(), Vec::new(), None);
    for (_, scored) in done {
        for warning in scored.warnings {
            output::warn(&warning);
        }
        relabeled.extend(scored.relabeled);
        raw.extend(scored.raw);
        meta.get_or_insert(scored.meta);
    }
    let mut scores = vec![Score::new(Stage::Relabeled, relabeled)];
    if args.raw {
        scores.push(Score::new(Stage::Raw, raw));
    }
    let Some(meta) = meta else { return Failure::all(failures) };
    let scores = scores.into_iter().map(Score::or_nothing).collect::<Result<Vec<_>, _>>()?;
    write(args, &scores, &meta, &logs)?;
    let missed = scores.first().map_or_else(Vec::new, |score| args.missed(score));
    missed.iter().for_each(|missed| output::complain(missed));
    Failure::some(failures, count)?;
    if missed.is_empty() { Ok(()) } else { Err(Failure::Negative) }
}

impl Args {
    /// The least scores that are asked for and not reached, in a sentence each.
    fn missed(&self, score: &Score) -> Vec<String> {
        let [.., half] = score.all.f1();
        let least = [
            ("the share of frames right", self.min_accuracy, score.all.accuracy()),
            ("F1 at 50 % overlap", self.min_f1, half),
            ("the edit score", self.min_edit, score.all.edit()),
        ];
        let missed = least.into_iter().filter_map(|(name, least, found)| {
            let least = least?;
            match found.map(|share| share * 100.0) {
                Some(percent) if percent >= least => None,
                Some(percent) => Some(format!("FAILED   {name} is {percent:.1} %, expected at least {least} %")),
                None => Some(format!(
                    "FAILED   {name} is not known, since no frame has a label; expected at least {least} %"
                )),
            }
        });
        missed.collect()
    }
}

fn write(args: &Args, scores: &[Score], meta: &Meta, logs: &[PathBuf]) -> Result<(), InputError> {
    let mut inputs = args.analysis.inputs(logs);
    inputs.extend([&args.truth.labels, &args.sequences].into_iter().flatten().cloned());
    inputs.extend(args.truth.map.iter().map(PathBuf::from));
    let mut files = Files::default();
    if let (Some(path), Some(score)) = (&args.picture, scores.first()) {
        output::add(&mut files, path, &report::score::picture(score, meta), &inputs)?;
    }
    let text = match args.form.format {
        Format::Text => report::score::text(scores, meta),
        Format::Json => score::json(scores, meta),
    };
    args.out.add(&mut files, &text, &inputs)?;
    files.commit_anew()?;
    args.out.print(&args.form, &text)
}

/// The score of one recording.
struct RecordingScore {
    relabeled: Vec<Row>,
    raw: Vec<Row>,
    meta: Meta,
    /// What is to be said about the labels.
    warnings: Vec<String>,
}

/// What is read once for all recordings.
struct ScoreInputs<'a> {
    map: NameMap,
    sequences: Option<(&'a Path, String)>,
}

fn score_log(args: &Args, log: &Path, texts: &ScoreInputs) -> Result<RecordingScore, Failure> {
    let map = &texts.map;
    let log = args.analysis.source.open(log)?;
    let opened = log.opened()?;
    let rules = args.analysis.rules.load(&log)?;
    let known = KnownNames::new(rules.set());
    let sequences =
        texts.sequences.as_ref().map(|(path, text)| Sequences::read(text, &path.display().to_string(), &known));
    let sequences = sequences.transpose()?.unwrap_or_default();
    let analysis = rules.analyze(&log)?;
    let (truth, warnings) = args.truth.of_log(log.path())?.of(opened, analysis.found(), map, &known)?;
    let rows = |truth: &Truth, stage| {
        let mut rows = score::score(truth, analysis.found(), stage, analysis.meta())?;
        rows.iter_mut().for_each(|row| sequences.expect(&mut row.tally));
        Ok::<_, InputError>(rows)
    };
    let raw = if args.raw { rows(&truth, Stage::Raw)? } else { Vec::new() };
    let truth = if args.relabel_truth { truth.relabeled(rules.set(), &analysis.run()?.frames)? } else { truth };
    Ok(RecordingScore { relabeled: rows(&truth, Stage::Relabeled)?, raw, meta: analysis.meta().clone(), warnings })
}
