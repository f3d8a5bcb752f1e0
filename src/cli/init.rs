//! `teachtree init`: from a log of which nothing is known to files with which commands need no option, and a first analysis.

use super::analyze::timeline;
use super::{Failure, output};
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::io::{BufRead, IsTerminal};
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;
use teachtree_frames::inspect::inspect;
use teachtree_frames::propose::{Answers, Proposal, Question, propose};
use teachtree_logs::atomic_write::Files;
use teachtree_logs::names;
use teachtree_logs::read::formats;
use teachtree_session::files::all_logs;
use teachtree_session::project_file;
use teachtree_session::{Analysis, Log, Rules};

/// Options of `init`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree init plug.csv\n  teachtree init my_set -o lab --yes\n  teachtree init recordings/ --force\nIt writes NAME.binding.yaml, NAME.scene.yaml, teachtree.yaml, NAME.analysis.json and NAME.report.html (docs/bindings.md).\nExit status: 0 analyzed, 1 written but not analyzed: the files need an edit, 2 bad usage or input."
)]
pub struct Args {
    /// Recordings of any format, or folders of them; the first one shows what they are like
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    /// The folder to write; that of the log when left out
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Ask nothing, also in a terminal
    #[arg(long, short)]
    yes: bool,
    /// Overwrite files that are there
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
    fn new(args: &Args, log: &Path) -> Self {
        let file = formats::without_episode(log);
        let beside = file.parent().unwrap_or(Path::new("")).to_path_buf();
        let folder = args.out.clone().unwrap_or(beside);
        let stem = formats::stem(&file);
        let named = |ending: &str| folder.join(format!("{stem}.{ending}"));
        Self {
            binding: named("binding.yaml"),
            scene: named("scene.yaml"),
            project: folder.join(project_file::NAME),
            analysis: named("analysis.json"),
            report: named("report.html"),
        }
    }

    fn all(&self) -> [&PathBuf; 5] {
        [&self.binding, &self.scene, &self.project, &self.analysis, &self.report]
    }

    /// Refuses to overwrite a file.
    fn refuse_existing(&self) -> Result<(), InputError> {
        let there = self.all().into_iter().find(|place| place.symlink_metadata().is_ok());
        there.map_or(Ok(()), |place| {
            let error = InputError::new(place.display().to_string(), "is there already");
            Err(error.help("name another folder with `-o DIR`, or overwrite it with `--force`"))
        })
    }
}

/// Runs `init`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let logs = logs(args)?;
    let Some(log) = logs.first() else { return Ok(()) };
    let places = Places::new(args, log);
    if !args.force {
        places.refuse_existing()?;
    }
    let source = formats::open(log)?;
    let canonical = source.header().iter().any(|title| names::meaning(names::split_unit(title).0).is_some());
    let proposal = if canonical { None } else { Some(proposed(args, log)?) };
    if let Some(folder) = &args.out {
        output::make_folder(folder)?;
    }
    if let Some(proposal) = &proposal {
        write(args, &[(&places.binding, proposal.binding.as_str()), (&places.scene, proposal.scene.as_str())], &logs)?;
    }
    let rules = proposal.as_ref().and_then(|proposal| proposal.rules);
    let analyzed = analyzed(log, proposal.is_some().then_some(&places), rules);
    let project = project(&places, &logs, proposal.as_ref(), analyzed.as_ref().ok());
    write(args, &[(&places.project, project.as_str())], &logs)?;
    let mut text = String::new();
    if let Some(proposal) = &proposal {
        text.push_str(&guesses(proposal));
    }
    if let Ok(analysis) = &analyzed {
        let (json, page) = (analysis.json(), analysis.html()?);
        write(args, &[(&places.analysis, json.as_str()), (&places.report, page.as_str())], &logs)?;
        let _ = writeln!(text, "{}", timeline(analysis, true).trim_end());
    }
    let written: Vec<String> =
        places.all().into_iter().filter(|place| place.is_file()).map(|place| place.display().to_string()).collect();
    let _ = writeln!(text, "\nwritten: {}", written.join(", "));
    output::print(&text)?;
    match analyzed {
        Ok(_) => Ok(output::print(&next(args, log, &places))?),
        Err(failure) => {
            failure.report();
            output::print(&next(args, log, &places))?;
            Err(Failure::Negative)
        }
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
        let in_parts = || path.is_dir() && formats::is_one_log(path) && formats::open(path).is_ok();
        logs.extend(match several {
            Some(several) => several,
            None if in_parts() && have_other_headers(path) => vec![path.clone()],
            None => all_logs(std::slice::from_ref(path))
                .or_else(|error| if in_parts() { Ok(vec![path.clone()]) } else { Err(error) })?,
        });
    }
    Ok(logs)
}

/// Whether the tables of a folder have headers of their own: they are parts of one recording.
fn have_other_headers(folder: &Path) -> bool {
    let Ok(logs) = all_logs(&[folder.to_path_buf()]) else { return true };
    let headers: BTreeSet<Vec<String>> =
        logs.iter().filter_map(|log| formats::open(log).ok()).map(|source| source.header()).collect();
    headers.len() > 1
}

/// The proposal for a log, with the answers of a person where there is one.
fn proposed(args: &Args, log: &Path) -> Result<Proposal, Failure> {
    let inspected = inspect(formats::open(log)?, None, None)?;
    let first = propose(&inspected, &Answers::default());
    let is_asked = !args.yes && std::io::stdin().is_terminal() && std::io::stderr().is_terminal();
    if !is_asked || first.questions.is_empty() {
        return Ok(first);
    }
    let mut answers = Answers::default();
    for question in &first.questions {
        match question {
            Question::Rate(rate) => {
                let answer = asked(&format!("The rows have no stamps. Rows in a second? [{rate}] "))?;
                answers.rate_hz =
                    Some(answer.parse().ok().filter(|rate: &f64| *rate > 0.0 && *rate <= 1e4).unwrap_or(*rate));
            }
            Question::Closed(side, closed, otherwise) => {
                let answer = asked(&format!(
                    "Is the {side} gripper closed when `{closed}`, and not when `{otherwise}`? [Y/n] "
                ))?;
                answers.is_reversed.insert(*side, answer.to_lowercase().starts_with('n'));
            }
        }
    }
    Ok(propose(&inspected, &answers))
}

/// Asks a person for a line.
fn asked(question: &str) -> Result<String, InputError> {
    output::complain(question);
    let mut line = String::new();
    let read = std::io::stdin().lock().read_line(&mut line);
    read.map_err(|error| InputError::new("standard input", error.to_string()))?;
    Ok(line.trim().to_string())
}

/// Writes files that belong together.
fn write(args: &Args, texts: &[(&PathBuf, &str)], logs: &[PathBuf]) -> Result<(), InputError> {
    let mut files = Files::default();
    for (place, text) in texts {
        // With `--force` a scene beside the log is written anew.
        let inputs: &[PathBuf] = if args.force { &[] } else { logs };
        output::add(&mut files, place, text, inputs)?;
    }
    files.commit()
}

fn analyzed(log: &Path, places: Option<&Places>, rules: Option<&str>) -> Result<Analysis, Failure> {
    let options = Log::options();
    let options = match places {
        Some(places) => options.binding(&places.binding).scene(&places.scene),
        None => options,
    };
    let log = options.open(log)?;
    let rules = rules.iter().fold(Rules::options(), |options, rules| options.file(rules));
    Ok(rules.for_log(&log)?.analyze(&log)?)
}

/// The text of the project file.
fn project(places: &Places, logs: &[PathBuf], proposal: Option<&Proposal>, analysis: Option<&Analysis>) -> String {
    let mut text = String::from(
        "# Written by `teachtree init`. Options override it; `teachtree config LOG` prints what holds (docs/project.md).\nlogs:\n",
    );
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let tasks: Vec<String> =
        analysis.iter().flat_map(|analysis| analysis.tasks()).map(|task| task.name().to_string()).collect();
    for pattern in patterns(logs) {
        let _ = writeln!(text, "  \"{}\":", pattern.replace('\\', "\\\\").replace('"', "\\\""));
        if proposal.is_some() {
            let _ =
                writeln!(text, "    binding: \"{}\"\n    scene: \"{}\"", name(&places.binding), name(&places.scene));
        } else {
            text.push_str("    params: {}    # values of params, such as touch_on: 0.3 N\n");
        }
        if let Some(rules) = proposal.and_then(|proposal| proposal.rules) {
            let _ = writeln!(text, "    rules: [{rules}]    # without failures: the place of the hand is not known");
        }
        if !tasks.is_empty() {
            let _ = writeln!(text, "    # expect: {}    # the tasks that a recording should contain", tasks.join(", "));
        }
    }
    text
}

/// The patterns of the logs: their ending where all files of it in the folder have the columns of the first one.
fn patterns(logs: &[PathBuf]) -> Vec<String> {
    let files: BTreeSet<PathBuf> = logs.iter().map(|log| formats::without_episode(log)).collect();
    let escaped = |file: &PathBuf| project_file::escaped(&file.file_name().unwrap_or_default().to_string_lossy());
    let names: BTreeSet<String> = files.iter().map(escaped).collect();
    let ending = |file: &PathBuf| file.extension().map(|it| it.to_string_lossy().into_owned());
    let mut endings: Vec<String> = files.iter().filter_map(ending).collect();
    endings.dedup();
    let [ending] = &endings[..] else { return names.into_iter().collect() };
    let is_file = files.iter().all(|file| file.is_file());
    if is_file && are_alike(&files, ending) { vec![format!("*.{ending}")] } else { names.into_iter().collect() }
}

/// Whether all files of an ending beside some logs have the same columns.
fn are_alike(files: &BTreeSet<PathBuf>, ending: &str) -> bool {
    const MOST: usize = 100;
    let folders: BTreeSet<&Path> = files.iter().filter_map(|file| file.parent()).collect();
    let mut beside = vec![];
    for folder in folders {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let Ok(entries) = std::fs::read_dir(folder) else { return false };
        let is_it = |path: &PathBuf| path.extension().is_some_and(|it| it == ending) && path.is_file();
        beside.extend(entries.flatten().map(|entry| entry.path()).filter(is_it));
    }
    let header = |file: &PathBuf| formats::open(file).ok().map(|source| source.header());
    let Some(first) = files.first().and_then(header) else { return false };
    beside.len() <= MOST && beside.iter().all(|file| header(file).as_ref() == Some(&first))
}

/// What was guessed, and what was not found.
fn guesses(proposal: &Proposal) -> String {
    let mut text = String::from("guessed\n");
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

/// The next three commands.
fn next(args: &Args, log: &Path, places: &Places) -> String {
    let quoted = |path: &Path| {
        let text = path.display().to_string();
        let is_plain = text.chars().all(|c| c.is_alphanumeric() || "._-/".contains(c));
        if is_plain { text } else { format!("'{}'", text.replace('\'', "'\\''")) }
    };
    // In another folder the file is found from there.
    let (go, log) = match &args.out {
        Some(folder) => {
            let whole = std::path::absolute(log).unwrap_or_else(|_| log.to_path_buf());
            (format!("cd {} && ", quoted(folder)), quoted(&whole))
        }
        None => (String::new(), quoted(log)),
    };
    let binding = quoted(&places.binding);
    let look = if places.report.is_file() {
        format!("{go}teachtree studio {log}")
    } else {
        format!("{go}teachtree inspect {log}")
    };
    let check = if places.binding.is_file() { format!("teachtree check {binding}") } else { "teachtree check".into() };
    format!(
        "\nnext:\n  {go}teachtree analyze {log}    # without options\n  {look}    # look at it\n  {check}    # after an edit of a guess\n"
    )
}
