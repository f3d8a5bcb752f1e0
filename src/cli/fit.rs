//! `teachtree fit`: params learned from labeled recordings, held against recordings that were held out.

use super::analysis::AnalysisArgs;
use super::groups::Groups;
use super::output_args::FormatArg;
use super::parallel::{LogResults, ParallelArgs, distinct_failures};
use super::print_args::is_quiet;
use super::progress::Progress;
use super::truth::TruthArgs;
use super::{Failure, output};
use std::path::{Path, PathBuf};
use teachtree_analysis::fit::{self, Fit, HeldGroups, MIN_LOGS, Verdict};
use teachtree_analysis::score::{KnownNames, NameMap, Stage};
use teachtree_base::error::InputError;
use teachtree_base::spelling::nearest;
use teachtree_language::param_sites::{ParamSite, param_sites};
use teachtree_language::{Request, Rules};
use teachtree_report as report;
use teachtree_session::fitting::{Recording, Runner, fitted, space};
use teachtree_session::patch::{Patch, patch};
use teachtree_session::{LabelsInternals, LogInternals, RulesInternals, RulesOptionsInternals};

/// Folds in which recordings are held out unless an option says otherwise, at most.
const FOLDS: usize = 8;

/// Options of `fit`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree fit recordings/ --rules tap.rules\n  teachtree fit recordings/ --rules tap.rules --params tap_time,tap_force -o tap.patch\n  teachtree fit a.csv b.csv c.csv d.csv --binding lab.binding.yaml --labels labels/ --track right\n  patch -p0 < tap.patch\nA patch is printed only if held-out recordings confirm it. Rule files are never written.\nExit status: 0 there is a patch, 1 there is none, 2 bad input."
)]
pub struct Args {
    /// Labeled recordings; a folder stands for all its logs, `set#*` for all episodes of a data set
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    /// The params to fit; by default all with a range
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    params: Vec<String>,
    /// Number of folds for cross-validation; by default one for each recording or group, at most 8
    #[arg(long, value_name = "FOLDS")]
    hold_out: Option<usize>,
    /// Regular expression whose first capture group is the group of a recording, such as the person, in its name
    #[arg(long, value_name = "REGEX")]
    group_by: Option<String>,
    /// Write a patch even if held-out recordings do not confirm it or are too few
    #[arg(long)]
    anyway: bool,
    /// Compare segments before relabeling with the truth
    #[arg(long)]
    raw: bool,
    #[command(flatten)]
    truth: TruthArgs,
    #[command(flatten)]
    analysis: AnalysisArgs,
    #[command(flatten)]
    many: ParallelArgs,
    #[command(flatten)]
    form: FormatArg<Format>,
    /// Output file of the patch; by default standard output
    #[arg(long, short, value_name = "FILE.patch")]
    out: Option<PathBuf>,
}

/// Forms of what was fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// Tables for the terminal
    Text,
    /// `teachtree.fit/2`
    Json,
}

/// Runs `fit`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let logs = args.truth.labeled_logs(args.analysis.logs(&args.logs)?)?;
    let places: Vec<&Path> = args.out.iter().map(PathBuf::as_path).collect();
    args.analysis.checked_inputs(&logs, &places)?;
    let groups = groups(args, &logs)?;
    let (runner, params) = opened(args, &logs)?;
    let space = space(&runner.rules, &params);
    let searches = args.anyway || logs.len() >= MIN_LOGS;
    let progress = (searches && !is_quiet()).then(|| Progress::new("fitting"));
    let mut shown = |part: f64| progress.iter().for_each(|bar| bar.set(part));
    let fitted =
        fitted(&runner, &space, &groups, args.anyway, &mut |points| runner.objectives(&space, points), &mut shown);
    drop(progress);
    let found = if fitted.verdict == Verdict::Gain || args.anyway && !fitted.changed().is_empty() {
        Some(patch(&runner.rules, &params, &space.params, &fitted.point))
    } else {
        None
    };
    print_fit(args, &logs, &runner.rules, &fitted, found.as_ref())?;
    if found.is_some() { Ok(()) } else { Err(Failure::Negative) }
}

/// The groups in which recordings are held out: those that `--group-by` names, or each recording.
fn groups(args: &Args, logs: &[PathBuf]) -> Result<HeldGroups, InputError> {
    let of_logs = match args.group_by.as_deref() {
        Some(pattern) => Groups::new(logs, Some(pattern))?.of_logs,
        None => (0..logs.len()).collect(),
    };
    let count = of_logs.iter().max().map_or(0, |last| last + 1);
    if args.group_by.is_some() && count < 2 {
        return Err(InputError::new("--group-by", "puts all recordings into 1 group, expected at least 2")
            .help("one of them is held out while the others are fitted"));
    }
    let folds = args.hold_out.unwrap_or(count.min(FOLDS));
    if args.hold_out.is_some() && !(2..=count).contains(&folds) {
        let (what, of) = if args.group_by.is_some() { ("folds", "groups") } else { ("groups", "recordings") };
        return Err(InputError::new("--hold-out", format!("{folds} {what} of {count} {of}"))
            .help(format!("at least 2, and no more than there are {of}")));
    }
    Ok(HeldGroups { of_logs, folds })
}

/// A recording that was opened, with the rules that read it.
struct FitInput {
    recording: Recording,
    rules: Rules,
    request: Request,
    /// Params that the binding or the command line sets.
    fixed: Vec<(String, String)>,
    warnings: Vec<String>,
}

fn open(args: &Args, log: &Path, names: &NameMap) -> Result<FitInput, Failure> {
    let log = args.analysis.read(log)?;
    let rules = args.analysis.rules.load(&log)?;
    let request = args.analysis.rules.options().request_for(&log);
    let fixed = rules.params().to_vec();
    let mut warnings = Vec::new();
    let recording = Recording::open(&log, &rules, |opened, analysis| {
        let (truth, more) =
            args.truth.of_log(log.path())?.of(opened, analysis, names, &KnownNames::new(rules.set()))?;
        warnings = more;
        Ok(truth)
    })?;
    Ok(FitInput { recording, rules: rules.set().clone(), request, fixed, warnings })
}

/// Opens the recordings: what runs them, and the params that may be changed.
fn opened(args: &Args, logs: &[PathBuf]) -> Result<(Runner, Vec<ParamSite>), Failure> {
    let names = args.truth.names()?;
    args.analysis.source.check(logs.len())?;
    let LogResults { done: all, failed } = args.many.each_log("reading", logs, |log| open(args, log, &names))?;
    Failure::all(distinct_failures(failed))?;
    let Some((rules, request, fixed)) =
        all.first().map(|(_, first)| (first.rules.clone(), first.request.clone(), first.fixed.clone()))
    else {
        return Err(InputError::new("the command line", "there are no recordings").into());
    };
    let mut recordings = Vec::new();
    for (log, one) in all {
        if one.rules.digest() != rules.digest() {
            let message = "the recording uses other rules than the first one";
            return Err(InputError::new(log.display().to_string(), message)
                .help("name the rules with --rules; recordings of one and of two hands are fitted apart")
                .into());
        }
        for warning in &one.warnings {
            output::warn(warning);
        }
        recordings.push(one.recording);
    }
    let params = chosen(args, &rules, &fixed)?;
    let stage = if args.raw { Stage::Raw } else { Stage::Relabeled };
    Ok((Runner::new(recordings, rules, request, stage), params))
}

/// The params that may be changed: those that are named, or all that are one number with a range and not set otherwise.
fn chosen(args: &Args, rules: &Rules, fixed: &[(String, String)]) -> Result<Vec<ParamSite>, InputError> {
    let all = param_sites(rules);
    let is_fixed = |name: &str| fixed.iter().any(|(set, _)| set == name);
    for name in &args.params {
        let wrong = |message: String| InputError::new("--params", message);
        if is_fixed(name) {
            return Err(wrong(format!("`{name}` is set by the binding or by --set")).help("leave it out on one side"));
        }
        if all.iter().any(|one| one.name == *name) {
            continue;
        }
        return Err(match rules.param(name) {
            Some(param) if param.range.is_none() => wrong(format!("`{name}` has no range"))
                .help(format!("declare its range: `param {name} = … in LOW .. HIGH`")),
            Some(_) => wrong(format!("`{name}` is computed from others")).help("name those that it is computed from"),
            None => {
                let near = nearest(name, rules.params.iter().map(|param| param.name.as_str()));
                let error = wrong(format!("there is no param `{name}`"));
                match near {
                    Some(near) => error.help(format!("did you mean `{near}`?")),
                    None => error,
                }
            }
        });
    }
    let named = |one: &ParamSite| args.params.is_empty() || args.params.contains(&one.name);
    let chosen: Vec<ParamSite> = all.into_iter().filter(|one| named(one) && !is_fixed(&one.name)).collect();
    if chosen.is_empty() {
        let message = "no param of the rules has a range to be searched";
        return Err(InputError::new("--params", message).help("`param NAME = VALUE in LOW .. HIGH` declares one"));
    }
    Ok(chosen)
}

fn print_fit(
    args: &Args,
    logs: &[PathBuf],
    rules: &Rules,
    fitted: &Fit,
    found: Option<&Patch>,
) -> Result<(), InputError> {
    let files: Vec<String> = rules.sources.files.iter().map(|file| file.name.clone()).collect();
    if let (Some(path), Some(found)) = (&args.out, found) {
        let mut inputs = args.analysis.inputs(logs);
        inputs.extend(args.truth.labels.iter().cloned().chain(files.iter().map(PathBuf::from)));
        output::write(path, &found.diff, &inputs)?;
    }
    let diff = found.map(|found| found.diff.as_str());
    if args.form.format == Format::Json {
        return output::print_json(&fit::json(fitted, &files, diff));
    }
    let mut printed = report::fit(fitted, &files);
    if let Some(found) = found {
        printed.push_str(&report::fit_patch(fitted, &found.lacking, args.out.as_deref().map(Path::display)));
        if args.out.is_none() {
            output::print(&format!("{printed}\n"))?;
            return output::print_data(&found.diff);
        }
    }
    output::print(&printed)
}
