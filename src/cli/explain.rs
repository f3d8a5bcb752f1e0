//! `teachtree explain`: why a recording has its labels at a time.

use super::Failure;
use super::analysis::AnalysisArgs;
use super::output_args::FormatArg;
use super::truth::TrackArg;
use std::path::PathBuf;
use teachtree_base::units::time;
use teachtree_session::Question;

/// Options of `explain`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree explain demonstration.csv --at 8.5s\n  teachtree explain demonstration.csv --at 7.8s..8.1s --track right\n  teachtree explain demonstration.csv --at 7s..10s --why-not Press\n  teachtree explain log.csv --binding lab.binding.yaml --at 3410ms --format json"
)]
pub struct Args {
    /// The recording
    #[arg(value_name = "LOG")]
    log: PathBuf,
    /// The time in the recording, `3.41s` or `3410ms`, or an interval, `3.2s..3.6s`
    #[arg(long, value_name = "TIME", value_parser = times)]
    at: (f64, f64),
    /// The track to explain; by default all tracks
    #[arg(long, value_enum, value_name = "TRACK")]
    track: Option<TrackArg>,
    /// The expected primitive: print the nearest path to it, and the conditions that fail
    #[arg(long, value_name = "PRIMITIVE")]
    why_not: Option<String>,
    /// Also print all conditions of the refused choices, all latches, and all tasks that were tried
    #[arg(long)]
    full: bool,
    #[command(flatten)]
    analysis: AnalysisArgs,
    #[command(flatten)]
    form: FormatArg<Format>,
}

/// Forms of an explanation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// Text
    Text,
    /// `teachtree.explain/1`
    Json,
}

/// Reads `3.41s` or `3.2s..3.6s`.
fn times(text: &str) -> Result<(f64, f64), String> {
    match text.split_once("..") {
        Some((from, to)) => {
            let (from, to) = (time(from)?, time(to)?);
            if to > from { Ok((from, to)) } else { Err("the interval ends before it begins".into()) }
        }
        None => time(text).map(|at| (at, at)),
    }
}

/// Runs `explain`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let analysis = args.analysis.analyze(&args.analysis.read(&args.log)?)?;
    let (from, to) = args.at;
    let mut question = Question::between(from, to);
    if let Some(track) = args.track {
        question = question.track(track.into());
    }
    if let Some(primitive) = &args.why_not {
        question = question.why_not(primitive);
    }
    let explained = analysis.explain(&question)?;
    let text = match args.form.format {
        Format::Text if args.full => format!("{explained:#}"),
        Format::Text => explained.to_string(),
        Format::Json => explained.json(),
    };
    Ok(args.form.print(&text)?)
}
