//! An audit without rules: of recordings whose columns have other names than those of channels, and for which there is no binding.

use super::super::Failure;
use super::super::parallel::LogResults;
use super::{Args, Checks, finish};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use teachtree_analysis::audit::Facts;
use teachtree_analysis::audit::signals::{EpisodeDeclaration, facts};
use teachtree_base::error::InputError;
use teachtree_frames::raw_log;
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
    finish(args, done, failed, Checks { meta: None, inputs, unchecked: Some(unchecked.into_iter().collect()) })
}

fn of_log(path: &Path, rest_s: f64) -> Result<(Facts, Vec<String>), InputError> {
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
    Ok(facts(&log, &declared, rest_s))
}
