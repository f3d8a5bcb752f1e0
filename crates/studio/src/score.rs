//! How well rules agree with the labels of a recording: the counts of `score --labels`.

use super::labels;
use serde_json::{Value, json};
use teachtree_analysis::Analysis as AnalysisResult;
use teachtree_analysis::score::{ComparedResult, Comparison, KnownNames, NameMap, Stage, Tally, Truth, compare, score};
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_frames::OpenedLog;
use teachtree_language::is_primitive;
use teachtree_logs::allowed_folders::AllowedFolders;
use teachtree_logs::read::labels::{LabelKind, Labels as Table};
use teachtree_session::score::meets;
use teachtree_session::{Analysis, Error};
use teachtree_session::{AnalysisInternals, ErrorInternals, LogInternals, RulesInternals};

/// The counts of a recording; none where it has no label file.
///
/// # Errors
/// Labels that cannot be read, or that name what the rules do not have.
pub fn tally(analysis: &Analysis, folders: &AllowedFolders) -> Result<Option<Tally>, Error> {
    let Some((truth, _)) = truth(analysis, folders)? else { return Ok(None) };
    let rows = score(&truth, analysis.found(), Stage::Relabeled, analysis.meta()).map_err(argument)?;
    let mut all = Tally::default();
    rows.iter().for_each(|row| all.add(&row.tally));
    Ok(Some(all))
}

/// How well two results of a recording agree with its labels; none where it has no label file.
///
/// # Errors
/// As [`tally`].
pub fn compared(now: &Analysis, other: &Analysis, folders: &AllowedFolders) -> Result<Option<Comparison>, Error> {
    let (Some((one, known)), Some((two, known_by_other))) = (truth(now, folders)?, truth(other, folders)?) else {
        return Ok(None);
    };
    let one = ComparedResult { truth: &one, found: now.found(), meta: now.meta(), known: &known };
    let two = ComparedResult { truth: &two, found: other.found(), meta: other.meta(), known: &known_by_other };
    compare([&one, &two]).map(Some).map_err(argument)
}

/// The labels of a recording, in the names of the rules.
fn truth(analysis: &Analysis, folders: &AllowedFolders) -> Result<Option<(Truth, KnownNames)>, Error> {
    let opened = analysis.log().opened()?;
    let Some((_, labels)) = labels::read_table(opened, folders).map_err(argument)? else { return Ok(None) };
    let known = KnownNames::new(analysis.rules().set());
    let truth = truth_of(&labels, opened, analysis.found(), &known).map_err(argument)?;
    Ok(Some((truth, known)))
}

/// Returns the ground truth that the labels contain. Primitives that the rules do not have yet are left out.
///
/// # Errors
/// The labels have other times, or tasks that the rules do not declare.
pub fn truth_of(
    labels: &Table,
    opened: &OpenedLog,
    found: &AnalysisResult,
    known: &KnownNames,
) -> Result<Truth, InputError> {
    meets(labels, &opened.recording.time)?;
    let mut labels = labels.clone();
    labels.intervals.retain(|it| it.kind != LabelKind::Primitive || !is_new(&it.name, known));
    Truth::of_labels(&labels, found.only(), &NameMap::default(), known)
}

/// Whether the name of a label could be that of a primitive that the rules do not have yet: `Shake`, `Join(left)`.
pub fn is_new(name: &str, known: &KnownNames) -> bool {
    let unsided = name.strip_suffix("(left)").or_else(|| name.strip_suffix("(right)")).unwrap_or(name);
    !known.primitives.iter().any(|it| it == name) && is_primitive(unsided)
}

fn argument(error: InputError) -> Error {
    Error::new(error, ErrorKind::Argument)
}

/// The measures that the page shows; what cannot be said is `null`.
pub fn brief(tally: &Tally) -> Value {
    let tasks = tally.tasks_found();
    let [.., half] = tally.f1();
    json!({
        "scored_s": tally.scored_s(), "accuracy": tally.accuracy(), "f1": half, "edit": tally.edit(),
        "tasks": tasks.of, "tasks_right": tasks.right,
    })
}
