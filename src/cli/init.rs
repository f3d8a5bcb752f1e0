//! `teachtree init`: writes the files with which a log needs no options, and a first analysis.

mod entries;
mod questions;

use super::analyze::timeline;
use super::source::each;
use super::{Failure, output};
use entries::{Alike, NewEntries};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use teachtree_analysis::UNKNOWN;
use teachtree_analysis::outcome::{OutcomeKind, ReasonKind};
use teachtree_base::error::InputError;
use teachtree_frames::bind::BLANK;
use teachtree_frames::propose::{ProjectParams, Proposal, quoted};
use teachtree_logs::allowed_folders::AllowedFolders;
use teachtree_logs::atomic_write::Files;
use teachtree_logs::read::formats;
use teachtree_session::files::{all_logs, needs_no_binding, recordings};
use teachtree_session::project_file;
use teachtree_session::{Analysis, Log, Rules};

/// Options of `init`.
#[derive(clap::Args)]
#[command(
    arg(each()),
    after_help = "Examples:\n  teachtree init plug.csv\n  teachtree init my_set -o lab --yes\n  teachtree init recordings/ --force\nIt writes NAME.binding.yaml, NAME.scene.yaml, NAME.analysis.json and NAME.report.html, and an entry of teachtree.yaml (docs/bindings.md).\nExit status: 0 analyzed, 1 written but not analyzed: the files need an edit, 2 bad usage or input."
)]
pub struct Args {
    /// Recordings of any format, or folders of recordings; the guesses are made from the first one
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    /// Output folder; by default the folder of the log
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Accept all guesses without questions
    #[arg(long, short)]
    yes: bool,
    /// Overwrite existing files
    #[arg(long)]
    force: bool,
}

/// The files that are written.
struct Places {
    binding: PathBuf,
    scene: PathBuf,
    project: PathBuf,
    analysis: PathBuf,
    report: PathBuf,
}

impl Places {
    fn new(folder: &Path, log: &Path) -> Self {
        let stem = formats::stem(&formats::without_episode(log));
        let named = |ending: &str| folder.join(format!("{stem}.{ending}"));
        Self {
            binding: named("binding.yaml"),
            scene: named("scene.yaml"),
            project: folder.join(project_file::NAME),
            analysis: named("analysis.json"),
            report: named("report.html"),
        }
    }

    /// Refuses to overwrite a file. The project file gets entries.
    fn refuse_existing(&self, is_canonical: bool) -> Result<(), InputError> {
        let guessed = [&self.binding, &self.scene].into_iter().filter(|_| !is_canonical);
        let mut places = guessed.chain([&self.analysis, &self.report]);
        let there = places.find(|place| place.symlink_metadata().is_ok());
        there.map_or(Ok(()), |place| {
            let error = InputError::new(place.display().to_string(), "exists already");
            Err(error.help("name another folder with `-o DIR`, or overwrite it with `--force`"))
        })
    }
}

/// The folder that is written: that of the option, a folder of recordings that was named, else that of the first log.
fn folder(args: &Args, log: &Path) -> PathBuf {
    let file = formats::without_episode(log);
    let is_below = |named: &&PathBuf| named.is_dir() && file.starts_with(named) && file != **named;
    let beside = || file.parent().unwrap_or(Path::new("")).to_path_buf();
    args.out.clone().or_else(|| args.logs.iter().find(is_below).cloned()).unwrap_or_else(beside)
}

/// Runs `init`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let logs = logs(args)?;
    let Some(log) = logs.first() else { return Ok(()) };
    let folder = folder(args, log);
    let places = Places::new(&folder, log);
    let is_canonical = needs_no_binding(log, &AllowedFolders::default())?;
    if !args.force {
        places.refuse_existing(is_canonical)?;
    }
    let alike = Alike::new(&logs, &folder, args.out.is_some());
    let binding = (!is_canonical).then_some(places.binding.as_path());
    // What cannot be edited is refused before files are written.
    NewEntries::new(&places.project, &alike, binding)?.text(&keys(binding.map(|_| &places), None, None))?;
    let proposal = if is_canonical { None } else { Some(questions::proposed(log, !args.yes)?) };
    if let Some(folder) = &args.out {
        output::make_folder(folder)?;
    }
    let mut written = WrittenFiles { args, logs: &logs, places: vec![] };
    if let Some(proposal) = &proposal {
        written.write(&[(&places.binding, proposal.binding.as_str()), (&places.scene, proposal.scene.as_str())])?;
    }
    let analyzed = match &proposal {
        Some(proposal) if !proposal.has_channels => Err(nothing_guessed(&places.binding, proposal).into()),
        proposal => analyzed(log, proposal.as_ref().map(|proposal| (&places, &proposal.params))),
    };
    let params = proposal.as_ref().map(|proposal| &proposal.params);
    let keys = keys(binding.map(|_| &places), params, analyzed.as_ref().ok());
    if let Some(text) = NewEntries::new(&places.project, &alike, binding)?.text(&keys)? {
        written.write_project(&places.project, &text)?;
    }
    let mut text = String::new();
    if let Some(proposal) = &proposal {
        text.push_str(&guesses(proposal));
    }
    if let Ok(analysis) = &analyzed {
        let (json, page) = (analysis.json(), analysis.html()?);
        written.write(&[(&places.analysis, json.as_str()), (&places.report, page.as_str())])?;
        let _ = writeln!(text, "{}", timeline(analysis, true).trim_end());
    }
    text.push_str(&left_out(&alike, log));
    let names: Vec<String> = written.places.iter().map(|place| place.display().to_string()).collect();
    let _ = writeln!(text, "\nwritten: {}", names.join(", "));
    output::print(&text)?;
    match analyzed {
        Ok(_) => Ok(output::print(&next(args, &logs, log, &places, true))?),
        Err(failure) => {
            failure.report();
            output::print(&next(args, &logs, log, &places, false))?;
            Err(Failure::Negative)
        }
    }
}

/// The files that a run wrote.
struct WrittenFiles<'a> {
    args: &'a Args,
    logs: &'a [PathBuf],
    places: Vec<PathBuf>,
}

impl WrittenFiles<'_> {
    /// Writes files that belong together.
    fn write(&mut self, texts: &[(&PathBuf, &str)]) -> Result<(), InputError> {
        let mut files = Files::default();
        for (place, text) in texts {
            // With `--force` a scene beside the log is written anew.
            let inputs: &[PathBuf] = if self.args.force { &[] } else { self.logs };
            output::add(&mut files, place, text, inputs)?;
        }
        files.commit()?;
        self.places.extend(texts.iter().map(|(place, _)| (*place).clone()));
        Ok(())
    }

    /// Writes the project file; a folder that is a log may contain it.
    fn write_project(&mut self, place: &Path, text: &str) -> Result<(), InputError> {
        output::write(place, text, &[])?;
        self.places.push(place.to_path_buf());
        Ok(())
    }
}

/// The recordings that got no entry, as a line.
fn left_out(alike: &Alike, log: &Path) -> String {
    const MOST: usize = 10;
    let names: Vec<String> = alike.left_out.iter().take(MOST).map(|file| file.display().to_string()).collect();
    let more = match alike.left_out.len().saturating_sub(MOST) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    match names.is_empty() {
        true => String::new(),
        false => format!(
            "left out: {}{more}: their columns differ from those of {}, or they are in another folder; run `init` for them\n",
            names.join(", "),
            log.display()
        ),
    }
}

/// The recordings; a folder that is one recording in parts is one.
fn logs(args: &Args) -> Result<Vec<PathBuf>, InputError> {
    let mut logs = vec![];
    for path in &args.logs {
        let several = match formats::recording_of(path) {
            None => formats::all_of(path)?,
            Some(_) => None,
        };
        let is_one = || path.is_dir() && formats::open(path).is_ok();
        logs.extend(match several {
            Some(several) => several,
            None => match recordings(std::slice::from_ref(path), None) {
                // Files other than tables are not parts of a recording.
                Ok(found) if found.iter().any(|found| found.log == *path) && path.is_dir() && !is_one() => {
                    all_logs(std::slice::from_ref(path))?
                }
                Ok(found) => found.into_iter().map(|found| found.log).collect(),
                Err(_) if is_one() => vec![path.clone()],
                Err(error) => return Err(error),
            },
        });
    }
    Ok(logs)
}

/// The error of a binding without a channel; some entries of it are commented out where a file is missing.
fn nothing_guessed(binding: &Path, proposal: &Proposal) -> InputError {
    let error = InputError::new(binding.display().to_string(), "no channel was guessed, so nothing is analyzed");
    error.help(match proposal.refused.is_empty() {
        true => "take `#` from `robots` there, after what it needs is beside it".to_string(),
        false => format!("replace each `{BLANK}` there by a column of the log; the file lists them with the reasons"),
    })
}

fn analyzed(log: &Path, guessed: Option<(&Places, &ProjectParams)>) -> Result<Analysis, Failure> {
    let (mut options, mut rules) = (Log::options(), Rules::options());
    if let Some((places, params)) = guessed {
        options = options.binding(&places.binding).scene(&places.scene);
        rules = params.values.iter().fold(rules, |rules, (name, value)| rules.param(name, value));
    }
    let log = options.open(log)?;
    Ok(rules.for_log(&log)?.analyze(&log)?)
}

/// The keys of an entry of the project file, a line each; canonical logs have neither binding nor scene.
fn keys(places: Option<&Places>, params: Option<&ProjectParams>, analysis: Option<&Analysis>) -> Vec<String> {
    let name = |path: &Path| quoted(&path.file_name().unwrap_or_default().to_string_lossy());
    let mut keys = match places {
        Some(places) => vec![format!("binding: {}", name(&places.binding)), format!("scene: {}", name(&places.scene))],
        None => vec!["params: {}    # values of params, such as touch_on: 0.3 N".into()],
    };
    if let Some(params) = params.filter(|params| !params.values.is_empty()) {
        let values: Vec<String> = params.values.iter().map(|(name, value)| format!("{name}: {value}")).collect();
        keys.push(format!("params: {{{}}}    # {}", values.join(", "), params.reason));
    }
    // A recording that failed or has no outcome is not an example, unless only the rules lack a criterion.
    let is_example = |analysis: &&Analysis| {
        let outcome = analysis.outcome();
        let lacks_criterion = outcome.reasons.iter().any(|reason| reason.kind == ReasonKind::NoCriterion);
        outcome.result == OutcomeKind::Success || lacks_criterion
    };
    let tasks = analysis.filter(is_example).into_iter().flat_map(Analysis::tasks);
    let tasks = tasks.filter(|task| !task.is_failure()).map(|task| task.name());
    // What no task explains is nothing to expect.
    let tasks: Vec<&str> = tasks.filter(|task| *task != UNKNOWN).collect();
    if !tasks.is_empty() {
        keys.push(format!("# expect: {}    # the tasks that a recording should contain", tasks.join(", ")));
    }
    keys
}

/// Formats the guesses, and the quantities that were not found.
fn guesses(proposal: &Proposal) -> String {
    if !proposal.refused.is_empty() {
        let lines = proposal.refused.iter().map(|line| format!("  {line}\n"));
        return format!("nothing was recognized in the columns of the log:\n{}\n", lines.collect::<String>());
    }
    let mut text = String::from("guessed\n");
    let is_shown = |line: &&str| {
        // Arms stand below `robots`.
        ["time:", "rate:", "resample:", "params:", "robots:", "  "].iter().any(|key| line.starts_with(key))
    };
    let before = proposal.binding.lines().take_while(|line| !line.starts_with("channels:"));
    for line in before.filter(is_shown) {
        let _ = writeln!(text, "  {line}");
    }
    let channels = proposal.binding.lines().skip_while(|line| *line != "channels:").skip(1);
    for line in channels.take_while(|line| line.starts_with("  ")).filter(|line| !line.trim_start().starts_with('#')) {
        let _ = writeln!(text, "{line}");
    }
    for lacking in &proposal.lacking {
        let _ = writeln!(text, "not found: {lacking}");
    }
    text.push('\n');
    text
}

/// The next commands.
fn next(args: &Args, logs: &[PathBuf], log: &Path, places: &Places, is_analyzed: bool) -> String {
    let store = formats::without_episode(log);
    let recordings = logs.iter().filter(|log| formats::without_episode(log) == store).count();
    let shell = |path: &Path| {
        let text = path.display().to_string();
        let is_plain = text.chars().all(|c| c.is_alphanumeric() || "._-/".contains(c));
        if is_plain { text } else { format!("'{}'", text.replace('\'', "'\\''")) }
    };
    // In another folder the file is found from there.
    let (go, from) = match &args.out {
        Some(folder) => (format!("cd {} && ", shell(folder)), std::env::current_dir().ok()),
        None => (String::new(), None),
    };
    let [log, all] = [log.to_path_buf(), PathBuf::from(format!("{}#*", store.display()))]
        .map(|log| shell(&from.as_ref().map_or_else(|| log.clone(), |from| from.join(&log))));
    let all = match recordings {
        0 | 1 => String::new(),
        several => {
            let of = if store.is_dir() { "data set" } else { "file" };
            format!("  {go}teachtree analyze {all}    # all {several} recordings of the {of}\n")
        }
    };
    let binding = shell(&places.binding);
    // What an analysis refuses is edited before.
    if !is_analyzed {
        let check = if places.binding.is_file() {
            format!("  teachtree check {binding}    # after you edit it\n")
        } else {
            String::new()
        };
        return format!(
            "\nnext:\n  {go}teachtree inspect {log}    # the columns with their ranges\n{check}  {go}teachtree analyze {log}    # then; without options\n"
        );
    }
    let check = if places.binding.is_file() { format!("teachtree check {binding}") } else { "teachtree check".into() };
    format!(
        "\nnext:\n  {go}teachtree analyze {log}    # without options\n{all}  {go}teachtree studio {log}    # view and correct it\n  {check}    # after you edit the binding\n"
    )
}
