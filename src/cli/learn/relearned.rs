//! `learn --from`: guards and numbers of a written rule file, learned again from labels.

use super::super::analysis::AnalysisArgs;
use super::super::groups::Groups;
use super::super::print_args::is_quiet;
use super::super::progress::Progress;
use super::super::rules::RuleArgs;
use super::super::{Failure, output};
use super::json::{self, RuleOutput};
use super::{Args, Format, LabeledLog, labeled_logs, labels_of, names, warn_of_few};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use teachtree_analysis::json::printed;
use teachtree_base::error::InputError;
use teachtree_language::Rules;
use teachtree_learn::{Demonstration, MOST_RUNS, RelearnedRules, relearn};
use teachtree_session::edited_rules::EditedRules;
use teachtree_session::patch::diff;
use teachtree_session::{RulesInternals, RulesOptionsInternals};

/// Runs `learn --from`.
pub fn run(args: &Args, from: &Path) -> Result<(), Failure> {
    let rules = RuleArgs { rules: vec![from.to_path_buf()], ..args.analysis.rules.clone() };
    let analysis = AnalysisArgs { rules, source: args.analysis.source.clone() };
    let logs = args.truth.labeled_logs(args.analysis.logs(&args.logs)?)?;
    let places: Vec<&Path> = args.out.iter().map(PathBuf::as_path).collect();
    analysis.checked_inputs(&logs, &places)?;
    let groups = Groups::new(&logs, args.group_by.as_deref())?;
    let map = args.truth.names()?;
    analysis.source.check(logs.len())?;
    let recordings = labeled_logs(args, &analysis, &logs, &map)?;
    let names = names(&recordings)?;
    let (rules, edited) = loaded(&analysis, &recordings, from)?;
    let place = rules.sources.files.iter().position(|file| is_file(&file.name, from)).unwrap_or(0);
    let demonstrations: Vec<Demonstration> = recordings
        .iter()
        .zip(&groups.of_logs)
        .map(|(one, group)| one.demonstration(*group, &names, None))
        .collect::<Result<_, Failure>>()?;
    check_tracks(&demonstrations, from)?;
    let labels = |text: &str| {
        let analyses = edited.analyses(text)?;
        let of_log = |(found, one): (&teachtree_analysis::Analysis, &Demonstration)| {
            one.tracks.iter().map(|track| labels_of(found, track.who, &names)).collect::<Option<Vec<_>>>()
        };
        analyses.iter().zip(&demonstrations).map(of_log).collect()
    };
    let progress = (!is_quiet()).then(|| Progress::new("learning"));
    let shown = |part: f64| progress.iter().for_each(|bar| bar.set(part));
    let learn = |_: &()| relearn(&demonstrations, &names, (&rules, place as u32), (&labels, MOST_RUNS), &shown);
    let learned = args.many.each("learning", &[()], learn)?.pop();
    drop(progress);
    let learned = learned.unwrap_or_else(|| Err(InputError::new("the command line", "there are no recordings")))?;
    let patch = diff(&from.display().to_string(), &rules.sources.files[place].text, &learned.text);
    print(args, from, &logs, &groups, &learned, &patch)?;
    if learned.changes.is_empty() { Err(Failure::Negative) } else { Ok(()) }
}

/// Whether the name of a source is that of a file on disk.
fn is_file(name: &str, file: &Path) -> bool {
    let canonical = |path: &Path| std::fs::canonicalize(path).ok();
    canonical(file).is_some() && canonical(Path::new(name)) == canonical(file)
}

/// The rules of all recordings, and what runs them with other texts of the file.
fn loaded<'a>(
    analysis: &AnalysisArgs,
    recordings: &'a [LabeledLog],
    from: &Path,
) -> Result<(Rules, EditedRules<'a>), Failure> {
    let mut first: Option<(Rules, EditedRules)> = None;
    for LabeledLog { log, .. } in recordings {
        let rules = analysis.rules.load(log)?;
        match &first {
            None => {
                let file = std::fs::canonicalize(from).map_err(|_| {
                    InputError::new(from.display().to_string(), "is a file of the program, expected a file of your own")
                        .help(format!("copy it: `teachtree show {} > mine.rules`", from.display()))
                })?;
                let logs = recordings.iter().map(|one| &one.log).collect();
                let request = analysis.rules.options().request_for(log);
                first = Some((rules.set().clone(), EditedRules::new(logs, request, file)));
            }
            Some((known, _)) if known.digest() != rules.set().digest() => {
                let message = "the recording uses other params or another hand model than the first one";
                return Err(InputError::new(log.name(), message).help("learn from these recordings separately").into());
            }
            Some(_) => {}
        }
    }
    Ok(first.ok_or_else(|| InputError::new("the command line", "there are no recordings"))?)
}

/// Refuses labels of a track that the rules do not label.
fn check_tracks(demonstrations: &[Demonstration], from: &Path) -> Result<(), InputError> {
    for one in demonstrations {
        if let Some(track) = one.tracks.iter().find(|track| track.present.is_none()) {
            let message = format!("has no tree that labels the track `{}` of {}", track.who, one.name);
            return Err(InputError::new(from.display().to_string(), message)
                .help("name another track with --track, or rules that label it"));
        }
    }
    Ok(())
}

fn print(
    args: &Args,
    from: &Path,
    logs: &[PathBuf],
    groups: &Groups,
    learned: &RelearnedRules,
    patch: &str,
) -> Result<(), InputError> {
    let is_better = !learned.changes.is_empty();
    let file = args.out.as_deref().filter(|_| is_better);
    if let Some(path) = file {
        let mut inputs = args.analysis.inputs(logs);
        inputs.extend(args.truth.labels.iter().cloned().chain([from.to_path_buf()]));
        output::write(path, &learned.text, &inputs)?;
    }
    warn_of_few(groups);
    if args.form.format == Format::Json {
        let written = RuleOutput { rules: &learned.text, is_better, file };
        return args.form.print(&printed(&json::of_changes(&written, learned, logs.len(), &groups.names, patch)));
    }
    output::print(&table(from, logs.len(), groups, learned, file))?;
    if is_better { output::print_data(&format!("\n{patch}")) } else { Ok(()) }
}

fn table(from: &Path, logs: usize, groups: &Groups, learned: &RelearnedRules, file: Option<&Path>) -> String {
    let mut text = format!(
        "{logs} recordings in {} groups ({}); {} conditions; {}\n\n",
        groups.names.len(),
        groups.origin,
        learned.conditions,
        learned.extent(&from.display().to_string())
    );
    let _ = writeln!(text, "{:<20}{:>16}{:>9}", "candidate", "held out: F1@50", "frames");
    for candidate in learned.candidates.iter().take(1 + learned.changes.len()) {
        let [f1, frames] = [candidate.f1, candidate.accuracy].map(|part| format!("{:.1} %", part * 100.0));
        let _ = writeln!(text, "{:<20}{f1:>16}{frames:>9}", candidate.name);
    }
    text.push('\n');
    for change in &learned.changes {
        let [before, after] = &change.texts;
        let reason = change.evidence(groups.names.len());
        let _ = writeln!(text, "{}:{}: `{before}` becomes `{after}`: {reason}", from.display(), change.line);
    }
    let _ = match (learned.obstacle(), file) {
        (Some(obstacle), _) => writeln!(text, "nothing changes: {obstacle}"),
        (None, Some(path)) => writeln!(text, "\nwritten to {}", path.display()),
        (None, None) => Ok(()),
    };
    text
}
