//! Audits raw columns. Recordings whose columns have other names than those of channels, and for which there is no binding, are audited by it
//! alone.

use super::super::Failure;
use super::super::parallel::LogResults;
use super::{Args, Checks, finish};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use teachtree_analysis::audit::signals::{EpisodeDeclaration, facts, findings};
use teachtree_analysis::audit::{Facts, Finding, FindingKind};
use teachtree_base::error::InputError;
use teachtree_frames::OpenedLog;
use teachtree_frames::bind::BindingFile;
use teachtree_frames::raw_log::{self, RawLog};
use teachtree_logs::allowed_folders::AllowedFolders;
use teachtree_logs::read::formats;
use teachtree_logs::read::formats::lerobot::episode_facts::{EpisodeFacts, episode_facts};
use teachtree_session::files::is_canonical;

/// Whether recordings are audited without rules: nothing is given that only rules need, and the first one that can be opened has columns of other names.
pub(super) fn is_for(args: &Args, logs: &[PathBuf]) -> Result<bool, InputError> {
    for log in logs {
        if args.expect.expect.is_some() || args.analysis.has_rules(log)? {
            return Ok(false);
        }
    }
    let folders = AllowedFolders::default();
    Ok(logs.iter().find_map(|log| is_canonical(log, &folders).ok()) == Some(false))
}

/// Audits recordings without rules.
pub(super) fn run(args: &Args, logs: &[PathBuf], inputs: &[PathBuf]) -> Result<(), Failure> {
    let LogResults { done, failed } = args.many.each_log("auditing", logs, |log| Ok(of_log(log, args.rest)?))?;
    let unchecked: BTreeSet<String> = done.iter().flat_map(|(_, (_, unchecked))| unchecked.iter().cloned()).collect();
    let done = done.into_iter().map(|(log, (facts, _))| (log, facts)).collect();
    finish(args, done, failed, Checks { meta: None, inputs, unchecked })
}

fn of_log(path: &Path, rest_s: f64) -> Result<(Facts, Vec<String>), InputError> {
    let (log, declared) = raw(path)?;
    Ok(facts(&log, &declared, rest_s))
}

/// The columns of a recording, and what its data set says of it.
fn raw(path: &Path) -> Result<(RawLog, EpisodeDeclaration), InputError> {
    let folders = AllowedFolders::default();
    let mut log = raw_log::read(path, &folders)?;
    let set = formats::without_episode(path);
    let mut declared = EpisodeDeclaration::default();
    if formats::is_set(&set) {
        let EpisodeFacts { fps, length, videos, pictures } =
            episode_facts(&set, formats::recording_of(path).as_deref(), &folders)?;
        declared = EpisodeDeclaration { fps, frames: length, videos };
        log.tables.first_mut().into_iter().for_each(|table| table.pictures.clone_from(&pictures));
    }
    Ok((log, declared))
}

/// The findings in the columns of a recording that rules run on, from `span_s[0]` to `span_s[1]`, and the checks that were left out.
/// Columns with the names of channels have issues instead, which know what they measure.
pub(super) fn of_columns(binding: Option<&Path>, opened: &OpenedLog, span_s: [f64; 2]) -> (Vec<Finding>, Vec<String>) {
    let Some(file) = binding.and_then(|path| BindingFile::read(path).ok()) else { return (Vec::new(), Vec::new()) };
    let (log, declared) = match raw(&opened.log) {
        Ok(raw) => raw,
        Err(error) => return (Vec::new(), vec![format!("stamps, missing frames and spikes: {}", error.message)]),
    };
    // Stamps of a bag count from its first message, those of the rules from its first bound one.
    let zero_s = match (log.origin_ns, &opened.clock) {
        (None, _) => Some(opened.zero_stamp_s),
        (Some(origin_ns), Some(clock)) => {
            Some(opened.zero_stamp_s + clock.origin_ns.saturating_sub(origin_ns) as f64 * 1e-9)
        }
        (Some(_), None) => None,
    };
    let (mut found, unchecked) = findings(&log, &declared, zero_s, span_s);
    found.retain(|finding| !is_expected(&file, opened, finding));
    (found, unchecked)
}

/// Whether a binding says of a finding that it is none: a spike in a column that is not bound or that may jump, and stamps that the log is resampled from.
fn is_expected(file: &BindingFile, opened: &OpenedLog, finding: &Finding) -> bool {
    let is_bridged = |[start, end]: [f64; 2]| end - start <= file.binding.bridge.0;
    match finding.kind {
        FindingKind::Spike => finding.column.as_deref().is_some_and(|column| !is_continuous(file, opened, column)),
        FindingKind::UnevenStamps => file.binding.resample.is_some(),
        FindingKind::MissingFrames => file.binding.resample.is_some() && finding.span_s.is_some_and(is_bridged),
        _ => false,
    }
}

/// Quantities that change within a sample: at an impact, and where a quaternion changes its sign.
const JUMPING: [&str; 5] = ["force", "torque", "velocity", "angular_velocity", "rotation"];

/// Whether a column is bound as a quantity that has no jumps.
fn is_continuous(file: &BindingFile, opened: &OpenedLog, column: &str) -> bool {
    let objects: Vec<&str> = opened.recording.scene.bodies.keys().map(String::as_str).collect();
    let jumps = |key: &str| key.rsplit('.').next().is_some_and(|quantity| JUMPING.contains(&quantity));
    let continuous = file.binding.channels.iter().filter(|(key, _)| !jumps(key));
    continuous.flat_map(|(_, columns)| columns.patterns()).any(|pattern| pattern.fits(column, &objects))
}
