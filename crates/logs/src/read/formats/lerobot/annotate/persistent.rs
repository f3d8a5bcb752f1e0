//! Labels as LeRobot 3.0 has them: rows of the column `language_persistent`, each holds from its time on.

use super::super::super::parquet::language::{COLUMN, Episodes, Row};
use super::{AnnotationTarget, Changes, FrameColumn, ROLE, Request, RequiredVersion, Storage, timeline};
use serde_json::json;
use teachtree_base::error::InputError;

pub(super) struct Persistent;

impl Storage for Persistent {
    fn required_version(&self, is_v2: bool) -> Option<RequiredVersion> {
        is_v2.then_some(RequiredVersion {
            name: "v3.0",
            why: "the first with language columns",
            help: "--legacy and --gr00t write labels into sets of version 2; or convert it with lerobot's \
                   `convert_dataset_v21_to_v30`",
        })
    }

    fn refuse_labeled(&self, set: &AnnotationTarget, styles: &[&str]) -> Result<(), InputError> {
        let ours = |row: &&Row| is_ours(row, styles);
        let found = set.known.iter().find_map(|(episode, rows)| Some((episode, rows.iter().find(ours)?)));
        found.map_or(Ok(()), |(episode, row)| {
            let style = row.style.as_deref().unwrap_or_default();
            Err(set.has_labels(format!("episode {episode} has labels of style `{style}` already")))
        })
    }

    fn add(&self, changes: &mut Changes, set: &AnnotationTarget, request: &Request) -> Result<(), InputError> {
        changes.frames.push(FrameColumn::Language(rows(set, request)?));
        changes.features.push((COLUMN.into(), json!({ "dtype": "language", "shape": [1], "names": null })));
        Ok(())
    }
}

fn is_ours(row: &Row, styles: &[&str]) -> bool {
    row.role == ROLE && row.style.as_deref().is_some_and(|style| styles.contains(&style))
}

/// All rows of language: those of other styles that are there, and the labels.
///
/// # Errors
/// When a label and the frame before it have one stamp in 32 bits.
fn rows(set: &AnnotationTarget, request: &Request) -> Result<Episodes, InputError> {
    let mut all = Episodes::new();
    for (episode, stamps) in &set.stamps {
        let others = |row: &&Row| !is_ours(row, request.styles);
        let mut rows: Vec<Row> = set.known.get(episode).into_iter().flatten().filter(others).cloned().collect();
        rows.extend(timeline::rows(*episode, request.labels, stamps).map_err(|message| set.set.wrong(message))?);
        let key = |row: &Row| (row.style.clone(), row.role.clone());
        rows.sort_by(|a, b| a.timestamp.total_cmp(&b.timestamp).then_with(|| key(a).cmp(&key(b))));
        all.insert(*episode, rows);
    }
    Ok(all)
}
