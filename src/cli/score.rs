//! `teachtree score`: what is found in recordings against what is true.

use super::parallel::ParallelArgs;
use super::rules::{RuleArgs, read_by};
use super::source::SourceArgs;
use super::truth::{TruthArgs, read};
use super::{Failure, output};
use std::path::{Path, PathBuf};
use teachtree_analysis::json::Meta;
use teachtree_analysis::score::{self, KnownNames, NameMap, Row, Score, Sequences, Stage, Truth};
use teachtree_base::error::InputError;
use teachtree_logs::atomic_write::Files;
use teachtree_report as report;
use teachtree_session::files::all_logs;
use teachtree_session::{AnalysisInternals, LabelsInternals, LogInternals, RulesInternals};

/// Options of `score`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree score demonstration.csv\n  teachtree score recordings/ --format json -o score.json --picture score.svg\n  teachtree score S2_T1.csv --binding yumi.binding.yaml --labels S2_T1_segments.csv --track right --map 'S1=Move|Approach,S2=Grasp,S9=mask'\n  teachtree score 'set#*' --binding lab.binding.yaml --labels labels/ --track right --min-f1 85"
)]
pub struct Args {
    /// Recordings; a folder stands for all logs in it, `set#*` for all episodes of a data set
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    #[command(flatten)]
    truth: TruthArgs,
    #[command(flatten)]
    rules: RuleArgs,
    #[command(flatten)]
    source: SourceArgs,
    #[command(flatten)]
    many: ParallelArgs,
    /// Relabel the truth by the same rules before relabeled segments are compared with it
    #[arg(long)]
    relabel_truth: bool,
    /// The sequences that tasks should have, instead of those of the truth: YAML, `task: Move Approach …`
    #[arg(long, value_name = "FILE")]
    sequences: Option<PathBuf>,
    /// Also score the segments before relabeling
    #[arg(long)]
    raw: bool,
    /// Fail when the frames right, all recordings together, are less than this, in percent
    #[arg(long, value_name = "PERCENT", value_parser = percent)]
    min_accuracy: Option<f64>,
    /// Fail when F1 at an overlap of 50 % is less than this, in percent
    #[arg(long, value_name = "PERCENT", value_parser = percent)]
    min_f1: Option<f64>,
    /// Fail when the edit score is less than this, in percent
    #[arg(long, value_name = "PERCENT", value_parser = percent)]
    min_edit: Option<f64>,
    /// What to write
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Where to write it; standard output when left out
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
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
    let outputs: Vec<&Path> = args.out.iter().chain(&args.picture).map(PathBuf::as_path).collect();
    output::refuse_one_for_two(&outputs)?;
    let logs = all_logs(&args.logs)?;
    args.truth.check(logs.len())?;
    let logs = args.truth.labeled(logs, &args.many)?;
    let map = args.truth.of_session().names()?;
    let sequences = args.sequences.as_deref().map(|path| Ok::<_, InputError>((path, read(path)?))).transpose()?;
    let texts = ScoreInputs { map, sequences };
    args.source.check(logs.len())?;
    let scored = args.many.each("scoring", &logs, |log| score_log(args, log, &texts))?;
    let mut relabeled = Vec::new();
    let mut raw = Vec::new();
    let mut meta = None;
    let (mut failures, mut done) = (Vec::new(), 0);
    for scored in scored {
        let scored = match scored {
            Ok(scored) => scored,
            // The other recordings are worth having all the same. What is wrong with all of them is said once.
            Err(failure) => {
                if !failures.contains(&failure) {
                    failures.push(failure);
                }
                continue;
            }
        };
        done += 1;
        for warning in scored.warnings {
            args.many.warn(&warning);
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
    Failure::some(failures, done)?;
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
    let files = read_by(&args.source, &args.rules);
    let named = [&args.truth.labels, &args.sequences].into_iter().flatten();
    let map = args.truth.map.as_deref().map(Path::new);
    let inputs: Vec<&Path> = logs.iter().chain(named).chain(&files).map(PathBuf::as_path).chain(map).collect();
    let mut files = Files::default();
    if let (Some(path), Some(score)) = (&args.picture, scores.first()) {
        output::add(&mut files, path, &report::score::picture(score, meta), &inputs)?;
    }
    let text = match args.format {
        Format::Text => report::score::text(scores, meta),
        Format::Json => score::json(scores, meta),
    };
    if let Some(path) = &args.out {
        output::add(&mut files, path, &text, &inputs)?;
    }
    files.commit_anew()?;
    match &args.out {
        Some(_) => Ok(()),
        None if args.format == Format::Text => output::print(&text),
        None => output::print_json(&text),
    }
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
    let log = args.source.open(log)?;
    let opened = log.opened()?;
    let rules = args.rules.load(&log)?;
    let known = KnownNames::new(rules.set());
    let sequences =
        texts.sequences.as_ref().map(|(path, text)| Sequences::read(text, &path.display().to_string(), &known));
    let sequences = sequences.transpose()?.unwrap_or_default();
    let analysis = rules.analyze(&log)?;
    let (truth, warnings) = args.truth.of_session().of(opened, analysis.found(), map, &known)?;
    let rows = |truth: &Truth, stage| {
        let mut rows = score::score(truth, analysis.found(), stage, analysis.meta())?;
        rows.iter_mut().for_each(|row| sequences.expect(&mut row.tally));
        Ok::<_, InputError>(rows)
    };
    let raw = if args.raw { rows(&truth, Stage::Raw)? } else { Vec::new() };
    let truth = if args.relabel_truth { truth.relabeled(rules.set(), &analysis.run()?.frames)? } else { truth };
    Ok(RecordingScore { relabeled: rows(&truth, Stage::Relabeled)?, raw, meta: analysis.meta().clone(), warnings })
}
