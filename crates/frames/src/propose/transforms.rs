//! The transforms of a bag: which frames hang on which, and which of them move with an arm.

use super::parts::{Part, Quantity};
use super::words;
use crate::inspect::{Inspection, ValueKind};
use std::collections::BTreeMap;

/// The end of the column with the parent of a transform.
const PARENT: &str = ".header.frame_id";
/// What stands before the name of a child.
const CHILD: &str = "transforms.";

/// A transform.
struct Transform {
    parent: String,
    moves: bool,
}

/// The transforms of a log, by child.
pub struct Transforms(BTreeMap<String, Transform>);

impl Transforms {
    pub fn of(log: &Inspection) -> Self {
        let columns = log.sheets.iter().flat_map(|sheet| sheet.columns.iter().map(move |column| (sheet, column)));
        let transforms = columns.filter_map(|(sheet, column)| {
            let path = column.name.strip_suffix(PARENT)?;
            let [parent] = &column.texts[..] else { return None };
            let is_own = |name: &str| name.strip_prefix(path).is_some_and(|rest| rest.starts_with(".transform."));
            let mut own = sheet.columns.iter().filter(|column| is_own(&column.name));
            let moves = own.any(|column| matches!(column.kind, ValueKind::Number | ValueKind::Flag));
            Some((child(path)?.to_string(), Transform { parent: plain(parent).into(), moves }))
        });
        Self(transforms.collect())
    }

    /// The frames from a child up to its root.
    fn chain(&self, frame: &str) -> Vec<&Transform> {
        let mut found: Vec<&Transform> = vec![];
        let mut next = self.0.get(frame);
        while let Some(transform) = next.filter(|_| found.len() < self.0.len()) {
            found.push(transform);
            next = self.0.get(&transform.parent);
        }
        found
    }

    /// The root on which a frame hangs.
    fn root(&self, frame: &str) -> Option<String> {
        Some(self.chain(frame).last()?.parent.clone())
    }

    /// Takes what never moves in a frame that moves for a part of a robot: its tool, where the name says so.
    pub fn mark(&self, parts: &mut [Part]) {
        for part in parts.iter_mut().filter(|part| part.is_constant()) {
            let Some(frame) = part.name.split_once(".transform.").and_then(|(path, _)| child(path)) else { continue };
            let chain = self.chain(frame);
            let is_fixed = chain.first().is_some_and(|own| !own.moves);
            if !is_fixed || chain.iter().all(|transform| !transform.moves) {
                continue;
            }
            match words::tool_rank(&part.words) {
                Some(_) if !words::is_part(&part.words) => part.carried_in = self.root(frame),
                _ => part.quantity = Quantity::Other,
            }
        }
    }
}

/// The name of a child in the path of its transform.
fn child(path: &str) -> Option<&str> {
    Some(plain(path.rsplit_once(CHILD)?.1))
}

/// A frame without the slash that some programs write before it.
fn plain(frame: &str) -> &str {
    frame.trim_start_matches('/')
}
