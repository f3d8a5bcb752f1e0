//! `meta/lerobot_annotations.json`: labels that a person corrects beside the video, in the annotation tab of LeRobot's dataset visualizer.
//!
//! ```json
//! {"version": 2, "schema": {"persistent_styles": ["subtask"], "event_styles": ["vqa"]}, "episodes": {"0": {"atoms": [
//!     {"role": "assistant", "content": "grasp nut", "style": "motion", "timestamp": 2.1, "tool_calls": null}]}}}
//! ```

use super::files::printed;
use super::{AnnotationTarget, Changes, ROLE, Request, Storage, timeline};
use crate::allowed_folders::AllowedFolders;
use crate::read::{file, text};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_base::json;

/// The file in a set.
pub const FILE: &str = "meta/lerobot_annotations.json";
/// The version that is written.
const VERSION: u64 = 2;
/// Styles that hold until the next label, and those of one frame, as LeRobot has them.
const PERSISTENT: [&str; 4] = ["memory", "motion", "plan", "subtask"];
const EVENTS: [&str; 2] = ["interjection", "vqa"];
/// The largest file that is read, bytes.
const MAX_BYTES: u64 = 256 << 20;

/// A row of language: what holds from a time on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Atom {
    /// The role of the speaker.
    pub role: String,
    /// The text.
    pub content: Option<String>,
    /// The kind: `motion`, `subtask`, `plan`, …
    pub style: Option<String>,
    /// The time from which it holds, s of the episode.
    pub timestamp: f64,
    /// Its other fields.
    #[serde(flatten)]
    pub other: Map<String, Value>,
}

impl Atom {
    fn is_ours(&self, styles: &[&str]) -> bool {
        self.role == ROLE && self.style.as_deref().is_some_and(|style| styles.contains(&style))
    }
}

/// The atoms of each episode, in order of time.
pub type Atoms = BTreeMap<usize, Vec<Atom>>;

/// Reads a file.
///
/// # Errors
/// When it cannot be read, or is not such a file.
pub fn read(path: &Path) -> Result<Atoms, InputError> {
    atoms_of(&file::open(path)?, path)
}

/// Reads an open file. `path` is its name in messages.
fn atoms_of(file: &File, path: &Path) -> Result<Atoms, InputError> {
    let place = path.display().to_string();
    let whole: Value = json::read(&text::whole(file, path, MAX_BYTES)?, &place)?;
    let wrong = |message: String| InputError::new(&place, message);
    if let Some(version) = whole.get("version").filter(|version| **version != json!(VERSION)) {
        return Err(wrong(format!("found version {version}, expected {VERSION}")));
    }
    let episodes = whole.get("episodes").and_then(Value::as_object);
    let episodes =
        episodes.ok_or_else(|| wrong("expected an object `episodes`, with a list `atoms` for each episode".into()))?;
    let mut all = Atoms::new();
    for (number, episode) in episodes {
        let at = |what: &str| format!("`episodes.{number}`: {what}");
        let number: usize = number.parse().map_err(|_| wrong(at("expected the number of an episode as a key")))?;
        let atoms = episode.get("atoms").and_then(Value::as_array);
        let atoms = atoms.ok_or_else(|| wrong(at("expected a list `atoms`")))?;
        let mut own = Vec::new();
        for (atom, place) in atoms.iter().zip(0..) {
            let read = Atom::deserialize(atom).map_err(|error| wrong(at(&format!("`atoms[{place}]`: {error}"))))?;
            if !read.timestamp.is_finite() {
                return Err(wrong(at(&format!("`atoms[{place}]`: expected a `timestamp` in seconds"))));
            }
            own.push(read);
        }
        own.sort_by(|a, b| a.timestamp.total_cmp(&b.timestamp));
        all.insert(number, own);
    }
    Ok(all)
}

/// The atoms of a set, whose file must be in `folders`; none where it has no such file.
fn read_if_there(folder: &Path, folders: &AllowedFolders) -> Result<Atoms, InputError> {
    let path = folder.join(FILE);
    folders.open_if_there(&path)?.map_or_else(|| Ok(Atoms::new()), |file| atoms_of(&file, &path))
}

pub(super) struct Prelabels;

impl Storage for Prelabels {
    fn refuse_labeled(&self, set: &AnnotationTarget, styles: &[&str]) -> Result<(), InputError> {
        let known = read_if_there(&set.folder, &set.folders)?;
        let ours = |atom: &&Atom| atom.is_ours(styles);
        let found = known.iter().find_map(|(episode, atoms)| Some((episode, atoms.iter().find(ours)?)));
        found.map_or(Ok(()), |(episode, atom)| {
            let style = atom.style.as_deref().unwrap_or_default();
            Err(set.has_labels(format!("episode {episode} has labels of style `{style}` in {FILE}")))
        })
    }

    /// Adds the file, with the atoms of other styles that there are.
    fn add(&self, changes: &mut Changes, set: &AnnotationTarget, request: &Request) -> Result<(), InputError> {
        let mut all = read_if_there(&set.folder, &set.folders)?;
        for (episode, stamps) in &set.stamps {
            let own = all.entry(*episode).or_default();
            own.retain(|atom| !atom.is_ours(request.styles));
            let rows = timeline::rows(*episode, request.labels, stamps);
            for row in rows.map_err(|message| InputError::new(set.folder.display().to_string(), message))? {
                let other = std::iter::once(("tool_calls".to_string(), Value::Null)).collect();
                let (role, content, style) = (row.role, row.content, row.style);
                own.push(Atom { role, content, style, timestamp: f64::from(row.timestamp), other });
            }
            own.sort_by(|a, b| a.timestamp.total_cmp(&b.timestamp).then_with(|| a.style.cmp(&b.style)));
        }
        let episodes: Map<String, Value> =
            all.into_iter().map(|(episode, atoms)| (episode.to_string(), json!({ "atoms": atoms }))).collect();
        let schema = json!({ "persistent_styles": PERSISTENT, "event_styles": EVENTS });
        let document = json!({ "version": VERSION, "schema": schema, "episodes": episodes });
        changes.files.insert(FILE.into(), printed(&document, FILE)?);
        Ok(())
    }
}
