//! Labels of the annotations of a LeRobot set, `meta/lerobot_annotations.json`: words that hold from a time on, as a person has corrected them.
//!
//! Words are names of the rules, or what the templates make of them that `meta/info.json` says were used; else those of `annotate` without `--words`. What
//! fits none is looked up in the map of names.

use crate::analysis::UNKNOWN;
use crate::analysis::score::{Known, NameMap};
use crate::base::error::InputError;
use crate::base::hands::{Side, Who};
use crate::base::json;
use crate::report::words::{Named, Phrasing, Style};
use crate::stream::Opened;
use crate::stream::read::formats::lerobot::annotate::prelabels::{self, Atom};
use crate::stream::read::formats::recording_of;
use crate::stream::read::labels::{self, Interval, Kind, Labels};
use crate::stream::read::text;
use serde_json::Value;
use std::path::Path;

/// The largest description of a set that is read, bytes.
const MAX_INFO: u64 = 16 << 20;

/// Reads the labels of the episode that a log is.
pub(super) fn read(path: &Path, opened: &Opened, map: &NameMap, known: &Known) -> Result<Labels, InputError> {
    let file = path.display().to_string();
    let wrong = |message: String| InputError::new(&file, message);
    let episodes = prelabels::read(path)?;
    let episode: usize = match recording_of(&opened.log) {
        Some(number) => number.parse().map_err(|_| wrong(format!("has labels of episodes, found `#{number}`")))?,
        None => 0,
    };
    let atoms = episodes.get(&episode).ok_or_else(|| wrong(format!("has no labels of episode {episode}")))?;
    let phrasing = phrasing(path)?;
    let mut intervals = Vec::new();
    for style in Style::ALL {
        let own: Vec<&Atom> = atoms.iter().filter(|atom| atom.style.as_deref() == Some(style.name())).collect();
        let last = labels::end_of(&opened.row_time);
        let next = own.iter().skip(1).map(|atom| Some(atom.timestamp - opened.zero_stamp_s)).chain([last]);
        let (kind, names) = match style {
            Style::Motion => (Kind::Primitive, &known.primitives),
            Style::Subtask => (Kind::Task, &known.tasks),
        };
        for (atom, end_s) in own.iter().zip(next) {
            let (Some(content), Some(end_s)) = (atom.content.as_deref(), end_s) else { continue };
            let start_s = atom.timestamp - opened.zero_stamp_s;
            let place = format!("episode {episode}, {} at {} s", style.name(), atom.timestamp);
            let mut add = |hand: Option<Who>, name: String| {
                let tracks = match hand {
                    Some(Who::Both) => [Side::Left, Side::Right].map(|side| Some(Who::Hand(side))).to_vec(),
                    other => vec![other],
                };
                for track in tracks {
                    let (place, name) = (place.clone(), name.clone());
                    intervals.push(Interval { place, track, kind, name, start_s, end_s });
                }
            };
            if map.get(content).is_some() {
                add(None, content.into());
                continue;
            }
            for Named { hand, name } in phrasing.names(content, style, names) {
                let name = name.ok_or_else(|| {
                    let message =
                        format!("{place}: found `{content}`, which is not the words of one name of the rules");
                    wrong(message).help("write the name itself, or map the words: --map 'WORDS=NAME'")
                })?;
                if name != UNKNOWN {
                    add(hand, name);
                }
            }
        }
    }
    intervals.retain(|interval| interval.end_s > interval.start_s);
    labels::of_intervals(file, intervals)
}

/// The templates of the set: `words` of `info.json` beside the file.
pub(crate) fn phrasing(path: &Path) -> Result<Phrasing, InputError> {
    let info = path.with_file_name("info.json");
    if !info.is_file() {
        return Ok(Phrasing::default());
    }
    let place = info.display().to_string();
    let whole: Value = json::read(&text::read(&info, MAX_INFO)?, &place)?;
    let words = whole.get("teachtree").and_then(|of| of.get("words")).and_then(Value::as_array);
    let words: Vec<String> = words.into_iter().flatten().filter_map(Value::as_str).map(str::to_string).collect();
    Phrasing::read(&words)
}
