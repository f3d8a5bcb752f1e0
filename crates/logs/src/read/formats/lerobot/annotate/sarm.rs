//! Stages of tasks for SARM, the reward model of LeRobot: for each episode lists of names, times and frames, `sparse` of the tasks and `dense` of the
//! primitives, and the mean share of an episode that each name takes.

use super::super::super::parquet::rewrite;
use super::files::printed;
use super::timeline::of_style;
use super::{AnnotationTarget, Changes, Lists, Request, RequiredVersion, Storage};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;

/// The prefix of columns of this style.
fn prefix(style: &str) -> &'static str {
    if style == "motion" { "dense" } else { "sparse" }
}

/// The columns of a prefix.
const COLUMNS: [&str; 5] =
    ["subtask_names", "subtask_start_times", "subtask_end_times", "subtask_start_frames", "subtask_end_frames"];

/// Whether a column is one of this style.
fn is_column(style: &str, name: &str) -> bool {
    name.strip_prefix(prefix(style)).and_then(|name| name.strip_prefix('_')).is_some_and(|name| COLUMNS.contains(&name))
}

/// The file of shares of a prefix.
fn file(prefix: &str) -> PathBuf {
    format!("meta/temporal_proportions_{prefix}.json").into()
}

/// A name in the episodes that have it.
#[derive(Default)]
struct Stage {
    /// The shares of these episodes.
    shares: Vec<f64>,
    /// Its start, as a share of the episode.
    starts: Vec<f64>,
}

pub(super) struct Sarm;

impl Storage for Sarm {
    fn required_version(&self, is_v2: bool) -> Option<RequiredVersion> {
        is_v2.then_some(RequiredVersion {
            name: "v3.0",
            why: "which SARM reads",
            help: "lerobot's `convert_dataset_v21_to_v30` makes one of it",
        })
    }

    fn refuse_labeled(&self, set: &AnnotationTarget, styles: &[&str]) -> Result<(), InputError> {
        let proportions: Vec<PathBuf> = styles.iter().map(|style| file(prefix(style))).collect();
        let places: Vec<&Path> = proportions.iter().map(PathBuf::as_path).collect();
        if let Some(what) = set.has(&[], &places)? {
            return Err(set.has_already(&what));
        }
        for list in set.lists()? {
            let known = rewrite::names(set.opened(&list)?, &list.display().to_string())?;
            let ours = |name: &&String| styles.iter().any(|style| is_column(style, name));
            if let Some(name) = known.iter().find(ours) {
                return Err(set.has_already(&format!("the column `{name}` in `meta/episodes`")));
            }
        }
        Ok(())
    }

    /// Adds the columns and the file of each style.
    fn add(&self, changes: &mut Changes, set: &AnnotationTarget, request: &Request) -> Result<(), InputError> {
        for style in request.styles {
            let (mut names, mut times, mut ends) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
            let (mut frames, mut end_frames) = (BTreeMap::new(), BTreeMap::new());
            let mut stages: BTreeMap<String, Stage> = BTreeMap::new();
            for (episode, labels) in request.labels {
                let Some(stamps) = set.stamps.get(episode) else { continue };
                let labels = of_style(labels, style, stamps.len());
                if labels.is_empty() {
                    continue;
                }
                let next = labels.iter().skip(1).map(|label| label.row).chain([stamps.len()]);
                // The frame of an end is included.
                let spans: Vec<(usize, usize)> = labels
                    .iter()
                    .zip(next)
                    .map(|(label, next)| (label.row, label.end.min(next).saturating_sub(1).max(label.row)))
                    .collect();
                let time = |frame: &usize| stamps.get(*frame).copied().unwrap_or(f64::NAN);
                let number = |frame: &usize| i64::try_from(*frame).unwrap_or(i64::MAX);
                names.insert(*episode, labels.iter().map(|label| label.content.clone()).collect());
                times.insert(*episode, spans.iter().map(|(start, _)| time(start)).collect());
                ends.insert(*episode, spans.iter().map(|(_, end)| time(end)).collect());
                frames.insert(*episode, spans.iter().map(|(start, _)| number(start)).collect());
                end_frames.insert(*episode, spans.iter().map(|(_, end)| number(end)).collect());
                let total: usize = spans.iter().map(|(start, end)| end + 1 - start).sum();
                let mut own: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
                for (label, (start, end)) in labels.iter().zip(&spans) {
                    own.entry(&label.content).or_insert((0, *start)).0 += end + 1 - start;
                }
                for (name, (count, start)) in own {
                    let stage = stages.entry(name.to_string()).or_default();
                    stage.shares.push(count as f64 / total as f64);
                    stage.starts.push(start as f64 / stamps.len() as f64);
                }
            }
            let prefix = prefix(style);
            let [of_names, of_starts, of_ends, of_frames, of_end_frames] =
                COLUMNS.map(|column| format!("{prefix}_{column}"));
            changes.episodes.extend([
                (of_names, Lists::Texts(names)),
                (of_starts, Lists::Numbers(times)),
                (of_ends, Lists::Numbers(ends)),
                (of_frames, Lists::Integers(frames)),
                (of_end_frames, Lists::Integers(end_frames)),
            ]);
            let file = file(prefix);
            changes.files.insert(file.clone(), printed(&shares(&stages), &file.display().to_string())?);
        }
        Ok(())
    }
}

/// The mean share of each name over the episodes that have it, all of them together 1, in the order in which they usually begin.
fn shares(stages: &BTreeMap<String, Stage>) -> Value {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let mut all: Vec<(&String, f64, f64)> =
        stages.iter().map(|(name, stage)| (name, mean(&stage.starts), mean(&stage.shares))).collect();
    all.sort_by(|a, b| a.1.total_cmp(&b.1).then_with(|| a.0.cmp(b.0)));
    let total: f64 = all.iter().map(|(_, _, share)| share).sum();
    let shares: Map<String, Value> =
        all.into_iter().map(|(name, _, share)| (name.clone(), json!(share / total))).collect();
    Value::Object(shares)
}
