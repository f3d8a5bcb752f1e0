//! `teachtree config`: how a log is read and analyzed, and where each setting is from.

use super::analysis::{AnalysisArgs, ExpectArg};
use super::{Failure, output};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use teachtree_frames::bind::BindingFile;
use teachtree_logs::read::csv;
use teachtree_logs::read::formats;
use teachtree_session::project_file::{self, ProjectSettings, Setting};
use teachtree_session::{Log, LogInternals, Rules, RulesInternals};

/// Options of `config`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree config demonstration.csv\n  teachtree config 'set#3' --rules my.rules\nOptions override teachtree.yaml, which overrides the binding (docs/project.md)."
)]
pub struct Args {
    /// A recording of any format, `set#3` for an episode
    #[arg(value_name = "LOG")]
    log: PathBuf,
    #[command(flatten)]
    analysis: AnalysisArgs,
    #[command(flatten)]
    expect: ExpectArg,
}

/// A line: the name of a setting, its value, and where it is from.
type Line = (&'static str, String, String);

/// Runs `config`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let settings = args.analysis.source.settings(&args.log)?;
    let mut lines = vec![project_line(&settings, &args.log)];
    let binding = chosen(args.analysis.source.binding.as_ref(), "--binding", settings.binding.as_ref());
    let scene = scene_line(args, &settings, binding.as_ref().map(|(path, _)| path.as_path()));
    lines.push(match &binding {
        Some((path, from)) => ("binding", path.display().to_string(), from.clone()),
        None => ("binding", "none".into(), "the columns have canonical names".into()),
    });
    lines.push(scene);
    lines.extend(named_rules(args, &settings));
    let labels = settings.labels.as_ref().map(|labels| (labels.value.display().to_string(), labels.place.clone()));
    lines.extend(labels.map(|(labels, from)| ("labels", labels, from)));
    // What is wrong with the log or the rules is reported below the settings that lead to it.
    output::print(&format!("{}\n{}", args.log.display(), text(lines)))?;
    let log = args.analysis.read(&args.log)?;
    let rules = args.analysis.rules.load(&log)?;
    let mut lines: Vec<Line> = default_rules(args, &settings, &rules).into_iter().collect();
    if let Some((file, reason)) = rules.hand_model().as_deref().and_then(|model| model.split_once(", ")) {
        lines.push(("hand model", file.into(), reason.into()));
    }
    lines.extend(param_lines(args, &settings, &rules, binding.map(|(path, _)| path)));
    lines.extend(expect_line(args, &log));
    Ok(output::print(&text(lines))?)
}

fn text(lines: Vec<Line>) -> String {
    let mut text = String::new();
    for (name, value, from) in lines {
        let _ = writeln!(text, "  {name:<13} {value}  ({from})");
    }
    text
}

fn project_line(settings: &ProjectSettings, log: &Path) -> Line {
    match &settings.file {
        Some(file) => {
            let place = if project_file::is_above(file, log) { "the log" } else { "this folder" };
            let fits = if settings.has_entry { "" } else { "; no entry matches the log" };
            ("project file", file.display().to_string(), format!("the nearest one above {place}{fits}"))
        }
        None => ("project file", "none".into(), format!("no {} above the log or this folder", project_file::NAME)),
    }
}

/// A path of the command line or of the project file, and where it is from.
fn chosen(given: Option<&PathBuf>, option: &str, setting: Option<&Setting<PathBuf>>) -> Option<(PathBuf, String)> {
    let of_project = || setting.map(|setting| (setting.value.clone(), setting.place.clone()));
    given.map(|path| (path.clone(), option.to_string())).or_else(of_project)
}

fn scene_line(args: &Args, settings: &ProjectSettings, binding: Option<&Path>) -> Line {
    let source = &args.analysis.source;
    if let Some((path, from)) = chosen(source.scene.as_ref(), "--scene", settings.scene.as_ref()) {
        return ("scene", path.display().to_string(), from);
    }
    if let Some(binding) = binding
        && BindingFile::read(binding).is_ok_and(|file| file.binding.scene.is_some())
    {
        return ("scene", binding.display().to_string(), "`scene` of the binding".into());
    }
    match csv::scene_file_beside(&formats::without_episode(&args.log)) {
        Some(path) => ("scene", path.display().to_string(), "beside the log".into()),
        None => ("scene", args.log.display().to_string(), "in the log".into()),
    }
}

/// The rules that are named.
fn named_rules(args: &Args, settings: &ProjectSettings) -> Option<Line> {
    let joined = |files: &[PathBuf]| files.iter().map(|file| file.display().to_string()).collect::<Vec<_>>().join(", ");
    match &settings.rules {
        _ if !args.analysis.rules.rules.is_empty() => {
            Some(("rules", joined(&args.analysis.rules.rules), "--rules".into()))
        }
        setting => setting.as_ref().map(|files| ("rules", joined(&files.value), files.place.clone())),
    }
}

/// The rules where none are named.
fn default_rules(args: &Args, settings: &ProjectSettings, rules: &Rules) -> Option<Line> {
    let files: Vec<&str> = rules.files().collect();
    let line = || ("rules", files.join(", "), format!("by default for {}", hands(rules)));
    named_rules(args, settings).is_none().then(line)
}

/// The number of hands that default rules are for.
fn hands(rules: &Rules) -> &'static str {
    let is_for_two = rules.files().any(|file| Path::new(file).ends_with("bimanual.rules"));
    if is_for_two { "two hands" } else { "one hand" }
}

fn param_lines(args: &Args, settings: &ProjectSettings, rules: &Rules, binding: Option<PathBuf>) -> Vec<Line> {
    let from = |param: &str| {
        let is_given = args.analysis.rules.set.values.iter().any(|(name, _)| name == param);
        let of_project = settings.params.get(param).map(|setting| setting.place.clone());
        let of_binding = || binding.as_ref().map(|binding| binding.display().to_string()).unwrap_or_default();
        if is_given { "--set".into() } else { of_project.unwrap_or_else(of_binding) }
    };
    // The last value of a param counts.
    let all = rules.params();
    let is_last = |at: usize, param: &str| all.iter().skip(at + 1).all(|(later, _)| later != param);
    let counting = all.iter().enumerate().filter(|(at, (param, _))| is_last(*at, param));
    counting.map(|(_, (param, value))| ("param", format!("{param} = {value}"), from(param))).collect()
}

fn expect_line(args: &Args, log: &Log) -> Option<Line> {
    let given = args.expect.expect.clone().map(|tasks| (tasks, "--expect".to_string()));
    let (tasks, from) = given.or_else(|| log.expected())?;
    Some(("expect", tasks, from))
}
