//! Labels of the annotations of a LeRobot set, `meta/lerobot_annotations.json`: words that hold from a time on, as a person has corrected them.
//!
//! Words are names of the rules, or what the templates make of them that `meta/info.json` says were used; else those of `annotate` without `--words`, or
//! the plain names with their bodies. What fits none is looked up in the map of names.
//!
//! Words hold until the next ones, so a subtask continues after its task has ended: where the file has motions too, a task ends with the last of them that
//! closes it.

use serde_json::Value;
use std::path::Path;
use teachtree_analysis::UNKNOWN;
use teachtree_analysis::score::{KnownNames, NameMap, TaskParts};
use teachtree_base::error::InputError;
use teachtree_base::hands::{Side, TrackId};
use teachtree_base::json;
use teachtree_frames::OpenedLog;
use teachtree_logs::allowed_folders::AllowedFolders;
use teachtree_logs::read::formats::lerobot::annotate::prelabels::{self, Atom};
use teachtree_logs::read::formats::recording_of;
use teachtree_logs::read::labels::{self, Interval, LabelKind, Labels};
use teachtree_logs::read::text;
use teachtree_report::words::{ParsedPhrase, Phrasing, Style};

/// The largest description of a set that is read, bytes.
const MAX_INFO: u64 = 16 << 20;

/// Reads the labels of the episode that a log is.
pub(super) fn read(path: &Path, opened: &OpenedLog, map: &NameMap, known: &KnownNames) -> Result<Labels, InputError> {
    let file = path.display().to_string();
    let wrong = |message: String| InputError::new(&file, message);
    let episodes = prelabels::read(path)?;
    let episode: usize = match recording_of(&opened.log) {
        Some(number) => number.parse().map_err(|_| wrong(format!("has labels of episodes, found `#{number}`")))?,
        None => 0,
    };
    let atoms = episodes.get(&episode).ok_or_else(|| wrong(format!("has no labels of episode {episode}")))?;
    let phrasing = phrasing(path, &AllowedFolders::default())?;
    let mut intervals: Vec<Interval> = Vec::new();
    for style in Style::ALL {
        let mut spoken: Vec<WordedInterval> = Vec::new();
        let own: Vec<&Atom> = atoms.iter().filter(|atom| atom.style.as_deref() == Some(style.name())).collect();
        let last = labels::end_of(&opened.row_time);
        let next = own.iter().skip(1).map(|atom| Some(atom.timestamp - opened.zero_stamp_s)).chain([last]);
        let (kind, names) = match style {
            Style::Motion => (LabelKind::Primitive, &known.primitives),
            Style::Subtask => (LabelKind::Task, &known.tasks),
        };
        for (atom, end_s) in own.iter().zip(next) {
            let (Some(content), Some(end_s)) = (atom.content.as_deref(), end_s) else { continue };
            let start_s = atom.timestamp - opened.zero_stamp_s;
            let place = format!("episode {episode}, {} at {} s", style.name(), atom.timestamp);
            let mut add = |hand: Option<TrackId>, name: String, part: &str| {
                let tracks = match hand {
                    Some(TrackId::Both) => [Side::Left, Side::Right].map(|side| Some(TrackId::Hand(side))).to_vec(),
                    other => vec![other],
                };
                for track in tracks {
                    let interval = Interval { place: place.clone(), track, kind, name: name.clone(), start_s, end_s };
                    put(&mut spoken, WordedInterval { interval, part: part.into(), content: content.into() });
                }
            };
            if map.get(content).is_some() {
                add(None, content.into(), content);
                continue;
            }
            for (part, ParsedPhrase { hand, name }) in content.split("; ").zip(phrasing.names(content, style, names)) {
                let name = name.ok_or_else(|| {
                    let message =
                        format!("{place}: found `{content}`, which are not the words for a name of the rules");
                    wrong(message).help("write the name itself, or map the words: --map 'WORDS=NAME'")
                })?;
                if name != UNKNOWN {
                    add(hand, name, part);
                }
            }
        }
        let tasks = spoken.into_iter().map(|spoken| spoken.interval);
        match kind {
            LabelKind::Primitive => intervals.extend(tasks),
            LabelKind::Task => {
                let tasks: Vec<Interval> = tasks.flat_map(|task| done(task, &intervals, map, known)).collect();
                intervals.extend(tasks);
            }
        }
    }
    intervals.retain(|interval| interval.end_s > interval.start_s);
    labels::of_intervals(file, intervals)
}

/// An interval with the words that it was read off.
struct WordedInterval {
    interval: Interval,
    /// The words for this hand.
    part: String,
    /// The words for all hands.
    content: String,
}

/// Adds an interval; if only the words of the other hand changed, extends the interval before.
fn put(spoken: &mut Vec<WordedInterval>, next: WordedInterval) {
    let before = spoken.iter_mut().rev().find(|it| it.interval.track == next.interval.track);
    let goes_on = |it: &&mut WordedInterval| {
        it.interval.end_s == next.interval.start_s && it.part == next.part && it.content != next.content
    };
    match before.filter(goes_on) {
        Some(before) => {
            before.interval.end_s = next.interval.end_s;
            before.content = next.content;
        }
        None => spoken.push(next),
    }
}

/// The tasks in an interval whose words name one, by its motions: each ends with a motion that closes it, and what comes then without a motion of the task
/// is none of it. The interval itself where no motion closes it.
fn done(task: Interval, motions: &[Interval], map: &NameMap, known: &KnownNames) -> Vec<Interval> {
    let mapped = |name: &str| map.get(name).map_or_else(|| vec![name.to_string()], <[String]>::to_vec);
    let names = mapped(&task.name);
    let of_task =
        |name: &&String| known.tasks.iter().position(|known| known == *name).and_then(|at| known.parts.get(at));
    let parts: Vec<&TaskParts> = names.iter().filter_map(|name| of_task(&name)).collect();
    let is = |motion: &Interval, of: &dyn Fn(&TaskParts) -> &Vec<String>| {
        let names = mapped(&motion.name);
        parts.iter().any(|part| of(part).iter().any(|name| names.contains(name)))
    };
    let is_within = |motion: &&Interval| {
        let middle_s = (motion.start_s + motion.end_s) / 2.0;
        motion.track == task.track && (task.start_s..task.end_s).contains(&middle_s)
    };
    let within: Vec<&Interval> = motions.iter().filter(is_within).collect();
    let is_last = |motion: &Interval| is(motion, &|part| &part.last);
    let is_joined = parts.iter().any(|part| part.joined);
    let (mut tasks, mut start_s, mut has_key) = (Vec::<Interval>::new(), task.start_s, false);
    for (at, motion) in within.iter().enumerate() {
        has_key |= is(motion, &|part| &part.keys);
        if is_last(motion) && !within.get(at + 1).is_some_and(|next| is_last(next)) && has_key {
            let end_s = motion.end_s.min(task.end_s);
            match tasks.last_mut().filter(|_| is_joined) {
                Some(before) => before.end_s = end_s,
                None => tasks.push(Interval { start_s, end_s, ..task.clone() }),
            }
            (start_s, has_key) = (end_s, false);
        }
    }
    if has_key || tasks.is_empty() {
        tasks.push(Interval { start_s, ..task });
    }
    tasks
}

/// The templates of the set: `words` of `info.json` beside the file, which must be in `folders`; the shipped words where there are none.
pub fn phrasing(path: &Path, folders: &AllowedFolders) -> Result<Phrasing, InputError> {
    let info = path.with_file_name("info.json");
    let Some(file) = folders.open_if_there(&info)? else { return Phrasing::shipped() };
    let place = info.display().to_string();
    let whole: Value = json::read(&text::whole(&file, &info, MAX_INFO)?, &place)?;
    let words = whole.get("teachtree").and_then(|of| of.get("words")).and_then(Value::as_array);
    let words: Vec<String> = words.into_iter().flatten().filter_map(Value::as_str).map(str::to_string).collect();
    if words.is_empty() { Phrasing::shipped() } else { Phrasing::read(&words) }
}
