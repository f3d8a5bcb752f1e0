//! Many recordings: cores, progress, and what is reported of all of them together.

use super::Failure;
use super::print_args::is_quiet;
use super::progress::Progress;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use teachtree_base::error::InputError;
use teachtree_logs::issue::{Issue, IssueKind};

/// Options of commands that work on many recordings.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct ParallelArgs {
    /// Maximum number of recordings analyzed in parallel; by default the number of cores
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,
}

impl ParallelArgs {
    /// Does `work` on each item and collects the results in the order of the items, so that threads change nothing. A bar with this label shows how
    /// many are done.
    ///
    /// # Errors
    /// When the threads cannot be started.
    pub fn each<T: Sync, R: Send>(
        &self,
        label: &str,
        items: &[T],
        work: impl Fn(&T) -> R + Sync,
    ) -> Result<Vec<R>, InputError> {
        let progress = (items.len() > 1 && !is_quiet()).then(|| Progress::new(label));
        let done = AtomicUsize::new(0);
        let one = |item: &T| {
            let result = work(item);
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            progress.iter().for_each(|bar| bar.set(done as f64 / items.len() as f64));
            result
        };
        let all = || items.par_iter().map(one).collect();
        let Some(jobs) = self.jobs else { return Ok(all()) };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs.into()).build();
        let pool =
            pool.map_err(|error| InputError::new("--jobs", format!("the threads cannot be started: {error}")))?;
        Ok(pool.install(all))
    }

    /// Does `work` on each recording, as [`each`](Self::each).
    pub fn each_log<'a, R: Send>(
        &self,
        label: &str,
        logs: &'a [PathBuf],
        work: impl Fn(&Path) -> Result<R, Failure> + Sync,
    ) -> Result<LogResults<'a, R>, InputError> {
        let mut results = LogResults { done: Vec::new(), failed: Vec::new() };
        for (log, result) in logs.iter().zip(self.each(label, logs, |log| work(log))?) {
            match result {
                Ok(result) => results.done.push((log, result)),
                Err(failure) => results.failed.push((log, failure)),
            }
        }
        Ok(results)
    }
}

/// The results of several recordings, and the failures of the others.
pub struct LogResults<'a, R> {
    pub done: Vec<(&'a PathBuf, R)>,
    pub failed: Vec<(&'a PathBuf, Failure)>,
}

/// Failures, each with the name of its recording.
pub fn named_failures(failed: Vec<(&PathBuf, Failure)>) -> Vec<Failure> {
    failed.into_iter().map(|(log, failure)| failure.of_log(log)).collect()
}

/// Failures without those that are the same for several recordings.
pub fn distinct_failures(failed: Vec<(&PathBuf, Failure)>) -> Vec<Failure> {
    let mut failures = Vec::new();
    for (_, failure) in failed {
        if !failures.contains(&failure) {
            failures.push(failure);
        }
    }
    failures
}

/// The number of issues of each kind in the logs.
#[derive(Clone, Debug, Default)]
pub struct Issues(BTreeMap<String, Kind>);

/// The number of issues of each kind.
pub fn counts<'a>(issues: impl IntoIterator<Item = &'a Issue>) -> BTreeMap<IssueKind, usize> {
    let mut counts = BTreeMap::new();
    issues.into_iter().for_each(|issue| *counts.entry(issue.kind).or_default() += 1);
    counts
}

/// The issues of one kind.
#[derive(Clone, Debug)]
struct Kind {
    count: usize,
    logs: usize,
    first: String,
}

impl Issues {
    /// Adds those of one log, with the count of each kind.
    pub fn add(&mut self, log: &Path, kinds: &BTreeMap<IssueKind, usize>) {
        for (kind, count) in kinds {
            let first = || Kind { count: 0, logs: 0, first: log.display().to_string() };
            let all = self.0.entry(kind.name().into()).or_insert_with(first);
            all.count += count;
            all.logs += 1;
        }
    }

    /// A line for each kind; `None` without issues.
    pub fn summary(&self) -> Option<String> {
        let width = self.0.keys().map(|kind| kind.chars().count()).max()?;
        let mut text = String::from("issues, which `--format json` lists for each recording:");
        for (kind, Kind { count, logs, first }) in &self.0 {
            let recordings = if *logs == 1 { "recording" } else { "recordings" };
            let _ = write!(text, "\n  {kind:<width$} {count:>6} in {logs} {recordings}, the first is {first}");
        }
        Some(text)
    }
}

/// Maximum number of failures of one kind that are printed one by one.
const PRINTED: usize = 3;

/// The texts of failures. Those that differ only in the recording are counted, and some of them are named.
pub fn texts(failures: &[Failure]) -> Vec<String> {
    let mut counts: BTreeMap<(&str, Option<&str>), usize> = BTreeMap::new();
    let mut texts = Vec::new();
    for failure in failures {
        match failure {
            Failure::Input(error) => {
                let count = counts.entry((&error.message, error.help.as_deref())).or_default();
                *count += 1;
                if *count <= PRINTED {
                    texts.push(format!("error: {error}"));
                }
            }
            Failure::Text(text) if !texts.contains(text) => texts.push(text.clone()),
            _ => {}
        }
    }
    for ((message, _), count) in counts.into_iter().filter(|(_, count)| *count > PRINTED) {
        texts.push(format!("error: {} more recordings: {message}", count - PRINTED));
    }
    texts
}
