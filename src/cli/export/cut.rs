//! Cuts a bag into episodes, with their tasks in words.

use super::super::Failure;
use super::super::analysis::AnalysisArgs;
use super::super::annotate::phrasing;
use super::super::audit::seconds;
use super::bag::OpenBag;
use std::path::{Path, PathBuf};
use teachtree_analysis::audit::signals::rests;
use teachtree_analysis::episodes::{EpisodeSpan, between_rests, of_tasks};
use teachtree_base::error::InputError;
use teachtree_logs::read::formats::lerobot::annotate::Label;
use teachtree_report::words::{Style, Words};
use teachtree_session::{Analysis, AnalysisInternals as _, LogInternals as _};

/// How bags are cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Cut {
    /// An episode for each task that the rules find; needs a binding
    Tasks,
    /// From rest to rest
    Rests,
    /// One episode
    Whole,
}

/// How bags are analyzed, cut and put in words.
#[derive(clap::Args, Clone)]
pub struct CutArgs {
    #[command(flatten)]
    pub analysis: AnalysisArgs,
    /// How bags are cut into episodes; by default at tasks with a binding or rules, else at rests
    #[arg(long, value_enum, value_name = "HOW")]
    cut: Option<Cut>,
    /// Minimum time without motion that ends an episode, s
    #[arg(long, value_name = "SECONDS", default_value = "1", value_parser = seconds)]
    rest: f64,
    /// Time before and after the motion that an episode includes, s
    #[arg(long, value_name = "SECONDS", default_value = "0.5", value_parser = margin)]
    margin: f64,
    /// Wording of labels, as for `annotate`; may be repeated
    #[arg(long, value_name = "TEMPLATE|FILE.yaml")]
    pub words: Vec<String>,
}

/// Reads a time in s that may be 0.
fn margin(text: &str) -> Result<f64, String> {
    let number = text.trim().strip_suffix('s').unwrap_or(text).trim();
    let value: Option<f64> = number.parse().ok().filter(|value: &f64| value.is_finite() && *value >= 0.0);
    value.ok_or_else(|| "expected a time in s, such as `0.5`".into())
}

impl CutArgs {
    /// Whether rules are run on the bags.
    ///
    /// # Errors
    /// When `teachtree.yaml` names a binding for some bags only, or cannot be read.
    pub fn has_rules(&self, bags: &[PathBuf]) -> Result<bool, InputError> {
        let (mut with, mut without) = (None, None);
        for bag in bags {
            *(if self.analysis.has_rules(bag)? { &mut with } else { &mut without }) = Some(bag);
        }
        if let (Some(with), Some(without)) = (with, without) {
            let message = format!("has no binding, but {} has one", with.display());
            return Err(InputError::new(without.display().to_string(), message)
                .help("name one for all bags with --binding or in teachtree.yaml"));
        }
        Ok(with.is_some())
    }

    /// Where bags are cut.
    ///
    /// # Errors
    /// As [`has_rules`](Self::has_rules).
    pub fn cut(&self, bags: &[PathBuf]) -> Result<Cut, InputError> {
        Ok(match self.cut {
            Some(cut) => cut,
            None if self.has_rules(bags)? => Cut::Tasks,
            None => Cut::Rests,
        })
    }
}

/// Words with the times for which they hold, s of the bag.
struct TimedWords {
    style: Style,
    start_s: f64,
    end_s: f64,
    content: String,
}

/// The episodes of a bag, and the words in it.
pub struct Episodes {
    /// Where the bag is cut.
    pub cut: Cut,
    /// The episodes, s of the bag.
    pub spans: Vec<EpisodeSpan>,
    words: Vec<TimedWords>,
    /// The analysis, if there is a binding.
    pub analysis: Option<Analysis>,
}

impl Episodes {
    /// Those of a bag.
    ///
    /// # Errors
    /// The bag cannot be analyzed, or nothing in it moves.
    pub fn of(args: &CutArgs, path: &Path, bag: &OpenBag) -> Result<Self, Failure> {
        let whole = bag.span();
        let bags = [path.to_path_buf()];
        let cut = args.cut(&bags)?;
        let analyzed = args.has_rules(&bags)?.then(|| analyzed(args, path, bag)).transpose()?;
        let (analysis, shift_s, words) = match analyzed {
            Some((analysis, shift_s, words)) => (Some(analysis), shift_s, words),
            None => (None, 0.0, Vec::new()),
        };
        let spans = match (cut, &analysis) {
            (Cut::Whole, _) => vec![EpisodeSpan::new(whole)],
            (Cut::Tasks, Some(analysis)) => shifted(of_tasks(analysis.found(), args.margin), shift_s),
            (Cut::Tasks, None) => Vec::new(),
            (Cut::Rests, _) => {
                let rests = rests(&bag.log, whole, args.rest).ok_or_else(|| {
                    let message =
                        "no column of numbers changes like a measured one does, expected one by which rests are found";
                    InputError::new(path.display().to_string(), message).help("`--cut whole` makes one episode of it")
                })?;
                between_rests(&rests, whole, args.margin)
            }
        };
        Ok(Self { cut, spans, words, analysis })
    }

    /// What is to be done in an episode: the words of the tasks in it.
    pub fn task(&self, span: &EpisodeSpan) -> Option<String> {
        // The words of the task before end within the margin of the episode.
        let overlap = |words: &TimedWords| words.end_s.min(span.end_s) - words.start_s.max(span.start_s);
        let is_in = |words: &&TimedWords| overlap(words) > 0.5 * (words.end_s - words.start_s);
        let mut tasks: Vec<&str> = Vec::new();
        for words in self.words.iter().filter(|words| words.style == Style::Subtask).filter(is_in) {
            if tasks.last() != Some(&words.content.as_str()) {
                tasks.push(&words.content);
            }
        }
        (!tasks.is_empty()).then(|| tasks.join(", then "))
    }

    /// The labels of an episode of `frames` frames that begins at `start_s`, s of the bag.
    pub fn labels(&self, start_s: f64, frames: usize, fps: f64) -> Vec<Label> {
        let row = |time_s: f64| ((time_s - start_s) * fps - 1e-6).ceil().max(0.0) as usize;
        let is_in = |words: &&TimedWords| words.end_s > start_s && row(words.start_s) < frames;
        let label = |words: &TimedWords| Label {
            style: words.style.name(),
            row: row(words.start_s),
            end: row(words.end_s).min(frames),
            content: words.content.clone(),
        };
        self.words.iter().filter(is_in).map(label).collect()
    }
}

fn shifted(spans: Vec<EpisodeSpan>, shift_s: f64) -> Vec<EpisodeSpan> {
    let shift = |span: EpisodeSpan| EpisodeSpan {
        start_s: span.start_s + shift_s,
        end_s: span.end_s + shift_s,
        succeeded_s: span.succeeded_s + shift_s,
        ..span
    };
    spans.into_iter().map(shift).collect()
}

/// The analysis of a bag, what is added to its times, s, and its words.
fn analyzed(args: &CutArgs, path: &Path, bag: &OpenBag) -> Result<(Analysis, f64, Vec<TimedWords>), Failure> {
    let log = args.analysis.read(path)?;
    let analysis = args.analysis.analyze(&log)?;
    let opened = log.opened()?;
    let Some(clock) = opened.clock else {
        let message = "its stamps come from a column or a rate of the binding, expected those of its messages";
        let error = InputError::new(path.display().to_string(), message);
        return Err(error.help("leave `time` and `rate` out of the binding").into());
    };
    let shift_s = (clock.origin_ns - bag.origin_ns) as f64 * 1e-9 + opened.zero_stamp_s;
    let phrasing = phrasing(&args.words)?;
    let end_s = analysis.found().end_s;
    let time = |row: usize| opened.row_time.get(row).copied().unwrap_or(end_s) + shift_s;
    let mut words = Vec::new();
    for style in Style::ALL {
        let timed = |Words { row, end, content }| TimedWords { style, start_s: time(row), end_s: time(end), content };
        words.extend(phrasing.of(analysis.found(), style).into_iter().map(timed));
    }
    Ok((analysis, shift_s, words))
}
