//! `teachtree config`: how a log is read and analyzed, and where each setting is from.

use super::analysis::{AnalysisArgs, ExpectArg};
use super::output_args::FormatArg;
use super::{Failure, output};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;
use teachtree_frames::bind::BindingFile;
use teachtree_logs::read::csv;
use teachtree_logs::read::formats;
use teachtree_session::project_file::{self, ProjectFile, ProjectSettings, Setting};
use teachtree_session::{Log, LogInternals, Rules, RulesInternals};

/// Options of `config`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree config                        the entries of teachtree.yaml\n  teachtree config demonstration.csv\n  teachtree config 'set#3' --rules my.rules\nOptions override teachtree.yaml, which overrides the binding (docs/project.md)."
)]
pub struct Args {
    /// A recording of any format, `set#3` for an episode; without it, the entries of the `teachtree.yaml` that counts in this folder are printed
    #[arg(value_name = "LOG")]
    log: Option<PathBuf>,
    #[command(flatten)]
    analysis: AnalysisArgs,
    #[command(flatten)]
    expect: ExpectArg,
    #[command(flatten)]
    form: FormatArg<Format>,
}

/// Forms of settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// Text
    Text,
    /// `teachtree.config/1`
    Json,
}

/// A line: the name of a setting, its value, and where it is from.
type Line = (&'static str, String, String);

/// Runs `config`.
pub fn run(args: &Args) -> Result<(), Failure> {
    match &args.log {
        Some(log) => settings_of_log(args, log),
        None => settings_of_folder(args),
    }
}

/// Prints the settings of a log.
fn settings_of_log(args: &Args, log: &Path) -> Result<(), Failure> {
    let settings = args.analysis.source.settings(log)?;
    let mut lines = vec![project_line(&settings, log)];
    let binding = chosen(args.analysis.source.binding.as_ref(), "--binding", settings.binding.as_ref());
    let scene = scene_line(args, log, &settings, binding.as_ref().map(|(path, _)| path.as_path()));
    lines.push(match &binding {
        Some((path, from)) => ("binding", path.display().to_string(), from.clone()),
        None => ("binding", "none".into(), "neither an option nor an entry names one".into()),
    });
    let is_scene_named = scene.is_some();
    lines.extend(scene);
    lines.extend(named_rules(args, &settings));
    let labels = settings.labels.as_ref().map(|labels| (labels.value.display().to_string(), labels.place.clone()));
    lines.extend(labels.map(|(labels, from)| ("labels", labels, from)));
    let is_text = args.form.format == Format::Text;
    if is_text {
        // What is wrong with the log or the rules is reported below the settings that lead to it.
        output::print(&format!("{}\n{}", log.display(), text(&std::mem::take(&mut lines))))?;
    }
    let opened = args.analysis.read(log)?;
    let rules = args.analysis.rules.load(&opened)?;
    // A log that was read without a scene file has its own scene.
    lines.extend((!is_scene_named).then(|| ("scene", log.display().to_string(), "in the log".into())));
    lines.extend(default_rules(args, &settings, &rules));
    if let Some((file, reason)) = rules.hand_model().as_deref().and_then(|model| model.split_once(", ")) {
        lines.push(("hand model", file.into(), reason.into()));
    }
    lines.extend(param_lines(args, &settings, &rules, binding.map(|(path, _)| path)));
    lines.extend(expect_line(args, &opened));
    if is_text {
        return Ok(output::print(&text(&lines))?);
    }
    let settings: Vec<Value> = lines.iter().map(setting).collect();
    Ok(args.form.print(&document(json!({ "log": log.display().to_string(), "settings": settings })))?)
}

/// Prints the entries of the project file of the folder in which the program runs.
fn settings_of_folder(args: &Args) -> Result<(), Failure> {
    let AnalysisArgs { source, rules } = &args.analysis;
    let is_option_given = source.binding.is_some()
        || source.scene.is_some()
        || !rules.rules.is_empty()
        || rules.hand.file.is_some()
        || !rules.set.values.is_empty()
        || args.expect.expect.is_some();
    if is_option_given {
        return Err(
            InputError::new("config", "options override the settings of a log, expected a LOG before them").into()
        );
    }
    let Some(file) = ProjectFile::above(Path::new(""))? else {
        let error = InputError::new(project_file::NAME, "there is no such file in this folder or above it");
        return Err(error
            .help("`teachtree init LOG` writes one, `teachtree config LOG` prints the settings of a log")
            .into());
    };
    let path = file.path().display().to_string();
    let mut out = format!("{path}\n");
    let mut entries = Vec::new();
    for (pattern, place, settings) in file.settings_of_entries() {
        let lines = lines_of_entry(&settings);
        let _ = write!(out, "{pattern}  ({place})\n{}", text(&lines));
        let settings: Vec<Value> = lines.iter().map(setting).collect();
        entries.push(json!({ "logs": pattern, "from": place, "settings": settings }));
    }
    match args.form.format {
        Format::Text => Ok(args.form.print(&out)?),
        Format::Json => Ok(args.form.print(&document(json!({ "project_file": path, "entries": entries })))?),
    }
}

/// The settings of an entry of a project file.
fn lines_of_entry(settings: &ProjectSettings) -> Vec<Line> {
    let paths = [("binding", &settings.binding), ("scene", &settings.scene), ("labels", &settings.labels)];
    let of_paths = paths.into_iter().filter_map(|(name, setting)| {
        setting.as_ref().map(|setting| (name, setting.value.display().to_string(), setting.place.clone()))
    });
    let texts = [("hand model", &settings.hand_file), ("expect", &settings.expect)];
    let of_texts = texts
        .into_iter()
        .filter_map(|(name, setting)| setting.as_ref().map(|it| (name, it.value.clone(), it.place.clone())));
    let rules = settings.rules.iter().map(|files| ("rules", joined(&files.value), files.place.clone()));
    let params = settings.params.iter();
    let params =
        params.map(|(param, setting)| ("param", format!("{param} = {}", setting.value), setting.place.clone()));
    of_paths.chain(rules).chain(of_texts).chain(params).collect()
}

fn text(lines: &[Line]) -> String {
    let mut text = String::new();
    for (name, value, from) in lines {
        let _ = writeln!(text, "  {name:<13} {value}  ({from})");
    }
    text
}

fn setting((name, value, from): &Line) -> Value {
    json!({ "name": name, "value": value, "from": from })
}

/// `teachtree.config/1`.
fn document(fields: Value) -> String {
    let mut document = json!({ "schema": "teachtree.config/1" });
    if let (Value::Object(document), Value::Object(fields)) = (&mut document, fields) {
        document.extend(fields);
    }
    format!("{document:#}\n")
}

fn joined(files: &[PathBuf]) -> String {
    files.iter().map(|file| file.display().to_string()).collect::<Vec<_>>().join(", ")
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

/// The scene file; `None` if only the log can contain a scene.
fn scene_line(args: &Args, log: &Path, settings: &ProjectSettings, binding: Option<&Path>) -> Option<Line> {
    let source = &args.analysis.source;
    if let Some((path, from)) = chosen(source.scene.as_ref(), "--scene", settings.scene.as_ref()) {
        return Some(("scene", path.display().to_string(), from));
    }
    if let Some(binding) = binding
        && BindingFile::read(binding).is_ok_and(|file| file.binding.scene.is_some())
    {
        return Some(("scene", binding.display().to_string(), "`scene` of the binding".into()));
    }
    let beside = csv::scene_file_beside(&formats::without_episode(log));
    beside.map(|path| ("scene", path.display().to_string(), "beside the log".into()))
}

/// The rules that are named.
fn named_rules(args: &Args, settings: &ProjectSettings) -> Option<Line> {
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
