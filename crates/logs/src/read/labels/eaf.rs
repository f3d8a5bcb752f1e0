//! Label files of ELAN (EAF 2.7 to 3.0): a tier a track and kind, `right primitive`, `left task`.
//!
//! Times are milliseconds from the beginning of the log's time base, or, in files that `analyze --format eaf` wrote, from the first frame of the log. A tier
//! whose name has none of `left`, `right` and `both` is about the track that is asked for; there may be one such tier. Tiers of the type `object`
//! name what segments are about and are left out.

use super::{Interval, LabelKind, MAX_NAME, MAX_ROWS};
use crate::read::text;
use roxmltree::{Document, Node, ParsingOptions};
use std::collections::BTreeMap;
use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_base::hands::TrackId;

/// The largest file that is read, bytes, and its most elements.
const MAX_BYTES: u64 = 64 << 20;
const MAX_NODES: u32 = 4_000_000;
/// Maximum length of a chain of dependent annotations.
const DEEPEST: usize = 16;
/// The property with the stamp of the first frame, s.
pub const START: &str = "teachtree.start_s";
/// The type of tiers that name objects.
pub const OBJECT: &str = "object";

/// The times of annotations that have some, and the annotations that others refer to.
#[derive(Default)]
struct Times<'a> {
    slots: BTreeMap<&'a str, f64>,
    /// The slots of each annotation.
    own: BTreeMap<&'a str, (&'a str, &'a str)>,
    parents: BTreeMap<&'a str, &'a str>,
}

/// Reads the intervals of a file.
pub(super) fn read(path: &Path) -> Result<Vec<Interval>, InputError> {
    let file = path.display().to_string();
    let wrong = |message: String| InputError::new(&file, message);
    let text = text::read(path, MAX_BYTES)?;
    let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(&text, options)
        .map_err(|error| wrong(format!("is not a file of ELAN: {error}")))?;
    let root = document.root_element();
    if !root.has_tag_name("ANNOTATION_DOCUMENT") {
        let name = root.tag_name().name();
        return Err(wrong(format!("found the element `{name}`, expected `ANNOTATION_DOCUMENT`, as ELAN writes it")));
    }
    let unit =
        root.descendants().find(|node| node.has_tag_name("HEADER")).and_then(|node| node.attribute("TIME_UNITS"));
    if let Some(unit) = unit.filter(|unit| *unit != "milliseconds") {
        return Err(wrong(format!("found times in `{unit}`, expected milliseconds")));
    }
    let start = root.descendants().find(|node| node.has_tag_name("PROPERTY") && node.attribute("NAME") == Some(START));
    let start_s: f64 = match start.and_then(|node| node.text()) {
        Some(text) => text
            .trim()
            .parse()
            .ok()
            .filter(|start: &f64| start.is_finite())
            .ok_or_else(|| wrong(format!("found `{text}` as the property {START}, expected a time in seconds")))?,
        None => 0.0,
    };
    let times = times(root, &wrong)?;
    let (mut intervals, mut tracks): (Vec<Interval>, Vec<&str>) = (Vec::new(), Vec::new());
    for tier in root.children().filter(|node| node.has_tag_name("TIER")) {
        let id = tier.attribute("TIER_ID").unwrap_or_default();
        let annotations: Vec<Node> = tier.descendants().filter(is_annotation).collect();
        if annotations.is_empty() || tier.attribute("LINGUISTIC_TYPE_REF") == Some(OBJECT) {
            continue;
        }
        let words: Vec<String> = id.split(|c: char| !c.is_alphanumeric()).map(str::to_lowercase).collect();
        let track = words.iter().find_map(|word| TrackId::from_name(word));
        if track.is_none() {
            tracks.push(id);
        }
        let is_task = words.iter().any(|word| word == "task" || word == "tasks");
        let kind = if is_task { LabelKind::Task } else { LabelKind::Primitive };
        for annotation in annotations {
            if intervals.len() == MAX_ROWS {
                return Err(wrong(format!("the file has more than {MAX_ROWS} annotations")));
            }
            let place = format!("annotation {}", annotation.attribute("ANNOTATION_ID").unwrap_or_default());
            let at = |message: String| InputError::new(format!("{file} {place}"), message);
            let value = annotation.children().find(|node| node.has_tag_name("ANNOTATION_VALUE"));
            let name = value.and_then(|node| node.text()).unwrap_or_default().trim().to_string();
            if name.len() > MAX_NAME {
                return Err(at(format!("the name has {} bytes, at most {MAX_NAME} are read", name.len())));
            }
            let (from, to) = times.of(annotation).map_err(at)?;
            if to < from {
                return Err(at(format!("ends before it starts, at {to} ms after {from} ms")));
            }
            if name.is_empty() || to <= from {
                continue;
            }
            let [start_s, end_s] = [from, to].map(|ms| start_s + ms / 1000.0);
            intervals.push(Interval { place, track, kind, name, start_s, end_s });
        }
    }
    if let [one, other, ..] = tracks.as_slice() {
        let message = format!("the tiers `{one}` and `{other}` name no track, expected at most one such tier");
        return Err(wrong(message)
            .help("name tiers `right primitive`, `left task`, …, or delete those that label no primitives"));
    }
    Ok(intervals)
}

fn is_annotation(node: &Node) -> bool {
    node.has_tag_name("ALIGNABLE_ANNOTATION") || node.has_tag_name("REF_ANNOTATION")
}

fn times<'a>(root: Node<'a, 'a>, wrong: &dyn Fn(String) -> InputError) -> Result<Times<'a>, InputError> {
    let mut times = Times::default();
    for node in root.descendants() {
        let attribute = |name: &str| node.attribute(name);
        if node.has_tag_name("TIME_SLOT")
            && let (Some(id), Some(value)) = (attribute("TIME_SLOT_ID"), attribute("TIME_VALUE"))
        {
            let ms = value.parse::<u64>().map_err(|_| {
                wrong(format!("found `{value}` as the time of `{id}`, expected a whole number of milliseconds"))
            })?;
            times.slots.insert(id, ms as f64);
        }
        let Some(id) = attribute("ANNOTATION_ID") else { continue };
        if let (Some(one), Some(other)) = (attribute("TIME_SLOT_REF1"), attribute("TIME_SLOT_REF2")) {
            times.own.insert(id, (one, other));
        }
        if let Some(parent) = attribute("ANNOTATION_REF") {
            times.parents.insert(id, parent);
        }
    }
    Ok(times)
}

impl Times<'_> {
    /// Returns start and end of an annotation, ms: its own time, or that of the annotation that it refers to.
    fn of(&self, annotation: Node) -> Result<(f64, f64), String> {
        let mut id = annotation.attribute("ANNOTATION_ID").unwrap_or_default();
        for _ in 0..DEEPEST {
            if let Some((one, other)) = self.own.get(id) {
                let time = |slot: &str| self.slots.get(slot).copied();
                return time(one).zip(time(other)).ok_or_else(|| "has no time, expected one that is aligned".into());
            }
            match self.parents.get(id) {
                Some(parent) => id = parent,
                None => return Err(format!("refers to `{id}`, which does not exist")),
            }
        }
        Err(format!("refers to others more than {DEEPEST} deep"))
    }
}
