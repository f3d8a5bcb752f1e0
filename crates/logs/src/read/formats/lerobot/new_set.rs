//! A new LeRobot set of version 3.0, written episode by episode: numbers, pictures, tasks, labels and success.
//!
//! The set is made beside its place under another name and renamed when it is whole. A row group of a data file is an episode. The pictures of one episode are
//! in memory at a time.

mod statistics;

use super::super::parquet::column::{Column, Values};
use super::super::parquet::language::{COLUMN as LANGUAGE, Row};
use super::super::parquet::rewrite::{self, NewFile};
use super::annotate::files::{FirstErrorWriter, copy_error, make_parent, printed, write_bytes};
use super::annotate::timeline::{self, Vocabulary};
use super::annotate::{Label, PROVENANCE, success};
use crate::atomic_write::Folder;
use ::parquet::errors::ParquetError;
use serde_json::{Map, Value, json};
use statistics::Statistics;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;

/// The numbers that a robot measures.
pub const STATE: &str = "observation.state";
/// The numbers that it is commanded.
pub const ACTION: &str = "action";
/// The prefix of the names of cameras.
pub const CAMERA: &str = "observation.images.";
/// The size at which a data file ends, bytes, and the number of files in a folder, as lerobot has them.
const FILE_BYTES: usize = 100 << 20;
const FILES: usize = 1000;

/// The features of each frame of a set.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Features {
    /// Frames per second.
    pub fps: u32,
    /// Name of the robot in the set.
    pub robot: Option<String>,
    /// The names of the numbers in `observation.state`.
    pub state: Vec<String>,
    /// Those in `action`; a set may have none.
    pub action: Vec<String>,
    /// The cameras: name, and height, width and number of colors of their pictures.
    pub cameras: Vec<(String, [usize; 3])>,
    /// Whether frames have labels in words, `language_persistent`.
    pub has_labels: bool,
    /// Whether frames have `next.success`.
    pub has_success: bool,
}

/// An episode; all lists but the labels have an entry for each frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Episode {
    /// The instruction, as text.
    pub task: String,
    /// The vectors of `observation.state`, one after the other.
    pub state: Vec<f32>,
    /// Those of `action`.
    pub action: Vec<f32>,
    /// For each camera, the files of its pictures.
    pub pictures: Vec<Vec<Vec<u8>>>,
    /// The labels.
    pub labels: Vec<Label>,
    /// Whether the task has succeeded after the frame.
    pub success: Vec<bool>,
}

/// An episode as the list of episodes has it.
struct EpisodeEntry {
    task: String,
    from: usize,
    to: usize,
    place: (usize, usize),
    statistics: Vec<Statistics>,
}

/// A set that is being written.
pub struct NewSet {
    folder: Folder,
    /// The place of the set, for messages.
    place: PathBuf,
    features: Features,
    data: Option<DataFile>,
    /// The chunk and the number of the data file.
    at: (usize, usize),
    tasks: Vocabulary,
    episodes: Vec<EpisodeEntry>,
    /// Why an episode could not be written: the data file may be cut off.
    broken: Option<InputError>,
}

type DataFile = NewFile<FirstErrorWriter<BufWriter<File>>>;

impl NewSet {
    /// An empty set for a place where there is nothing.
    ///
    /// # Errors
    /// There is something, or the folder cannot be made.
    pub fn new(place: &Path, features: Features) -> Result<Self, InputError> {
        let folder = Folder::new(place)?;
        let tasks = Vocabulary::default();
        let place = place.to_path_buf();
        Ok(Self { folder, place, features, data: None, at: (0, 0), tasks, episodes: Vec::new(), broken: None })
    }

    /// The number of episodes so far.
    pub fn episodes(&self) -> usize {
        self.episodes.len()
    }

    /// The number of frames so far.
    pub fn frames(&self) -> usize {
        self.episodes.last().map_or(0, |last| last.to)
    }

    /// Writes the next episode.
    ///
    /// # Errors
    /// The lists of the episode have different lengths, or the set cannot be written.
    pub fn add(&mut self, episode: Episode) -> Result<(), InputError> {
        if let Some(error) = &self.broken {
            return Err(error.clone());
        }
        let added = self.append(episode);
        self.broken = added.as_ref().err().cloned();
        added
    }

    fn append(&mut self, episode: Episode) -> Result<(), InputError> {
        let frames = self.checked(&episode)?;
        let (number, from) = (self.episodes.len(), self.frames());
        let stamps: Vec<f64> = (0..frames).map(|frame| frame as f64 / f64::from(self.features.fps)).collect();
        let labels = BTreeMap::from([(number, episode.labels)]);
        let rows = timeline::rows(number, &labels, &stamps).map_err(|message| self.wrong(message))?;
        let task = i64::try_from(self.tasks.number(&episode.task)).unwrap_or(i64::MAX);
        let mut statistics = vec![Statistics::of(STATE, self.features.state.len(), &episode.state)];
        if !self.features.action.is_empty() {
            statistics.push(Statistics::of(ACTION, self.features.action.len(), &episode.action));
        }
        for (camera, [.., colors]) in &self.features.cameras {
            statistics.push(Statistics::of_pictures(camera, *colors, frames));
        }
        let whole = |value: usize| i64::try_from(value).unwrap_or(i64::MAX);
        let mut columns = vec![vectors(STATE, self.features.state.len(), episode.state)];
        if !self.features.action.is_empty() {
            columns.push(vectors(ACTION, self.features.action.len(), episode.action));
        }
        for ((camera, _), pictures) in self.features.cameras.iter().zip(episode.pictures) {
            columns.push(Column { name: camera.clone(), values: Values::Pictures(pictures) });
        }
        if self.features.has_success {
            columns.push(Column { name: success::COLUMN.into(), values: Values::Flags(episode.success) });
        }
        let stamps = stamps.into_iter().map(|stamp| stamp as f32).collect();
        let integers = |name: &str, values| Column { name: name.into(), values: Values::Integers(values) };
        columns.push(Column { name: "timestamp".into(), values: Values::Floats(stamps) });
        columns.push(integers("frame_index", (0..whole(frames)).collect()));
        columns.push(integers("episode_index", vec![whole(number); frames]));
        columns.push(integers("index", (whole(from)..whole(from + frames)).collect()));
        columns.push(integers("task_index", vec![task; frames]));
        if self.features.has_labels {
            columns.push(language(&rows, frames));
        }
        self.write(&columns)?;
        let to = from + frames;
        self.episodes.push(EpisodeEntry { task: episode.task, from, to, place: self.at, statistics });
        self.roll()
    }

    /// The number of frames of an episode.
    fn checked(&self, episode: &Episode) -> Result<usize, InputError> {
        let features = &self.features;
        let frames = episode.state.len() / features.state.len().max(1);
        let lengths = [
            episode.state.len() == frames * features.state.len(),
            episode.action.len() == frames * features.action.len(),
            episode.success.len() == if features.has_success { frames } else { 0 },
            episode.pictures.len() == features.cameras.len(),
            episode.pictures.iter().all(|pictures| pictures.len() == frames),
        ];
        if frames > 0 && lengths.iter().all(|is_right| *is_right) {
            return Ok(frames);
        }
        Err(self.wrong(format!("episode {} has lists of different lengths", self.episodes.len())))
    }

    fn wrong(&self, message: String) -> InputError {
        InputError::new(self.place.display().to_string(), message)
    }

    fn failed(&self, error: &ParquetError) -> InputError {
        self.wrong(format!("cannot be written: {error}"))
    }

    /// Writes columns as the next part of the data file.
    fn write(&mut self, columns: &[Column]) -> Result<(), InputError> {
        let mut data = match self.data.take() {
            Some(data) => data,
            None => {
                let path = self.data_file();
                make_parent(&path, &self.place)?;
                let out = File::create_new(&path).map_err(|error| copy_error(&self.place, &error))?;
                let out = FirstErrorWriter { out: BufWriter::new(out), failed: None };
                NewFile::new(columns, vec![rewrite::features(columns)], out).map_err(|error| self.failed(&error))?
            }
        };
        data.write(columns).map_err(|error| self.failed(&error))?;
        self.data = Some(data);
        Ok(())
    }

    /// Ends the data file if it is large enough.
    fn roll(&mut self) -> Result<(), InputError> {
        if self.data.as_ref().is_some_and(|data| data.bytes() >= FILE_BYTES) {
            self.close()?;
            let (chunk, file) = self.at;
            self.at = if file + 1 == FILES { (chunk + 1, 0) } else { (chunk, file + 1) };
        }
        Ok(())
    }

    fn close(&mut self) -> Result<(), InputError> {
        let Some(data) = self.data.take() else { return Ok(()) };
        data.close().map_err(|error| self.failed(&error))?;
        File::open(self.data_file()).and_then(|file| file.sync_all()).map_err(|error| copy_error(&self.place, &error))
    }

    fn data_file(&self) -> PathBuf {
        let (chunk, file) = self.at;
        self.folder.path().join(format!("data/chunk-{chunk:03}/file-{file:03}.parquet"))
    }

    /// Writes the metadata of the set, `provenance` included, and renames the set to its final path.
    ///
    /// # Errors
    /// The set cannot be written, an episode could not be, or something has come to its place meanwhile.
    pub fn finish(mut self, provenance: &Value) -> Result<(), InputError> {
        if let Some(error) = self.broken.take() {
            return Err(error);
        }
        self.close()?;
        let (episodes, frames) = (self.episodes.len(), self.frames());
        let tasks = std::mem::take(&mut self.tasks);
        let info = self.info(episodes, frames, tasks.words.len(), provenance);
        let list = self.list(provenance).map_err(|error| self.failed(&error))?;
        let tasks = tasks.table("task_index", "task").map_err(|error| self.failed(&error))?;
        let all = self.episodes.iter().map(|episode| episode.statistics.as_slice());
        let statistics = Statistics::summary(all);
        let place = self.place.display().to_string();
        let files = [
            ("meta/info.json", printed(&info, &place)?),
            ("meta/stats.json", printed(&statistics, &place)?),
            ("meta/tasks.parquet", tasks),
            ("meta/episodes/chunk-000/file-000.parquet", list),
        ];
        for (name, bytes) in files {
            let path = self.folder.path().join(name);
            make_parent(&path, &self.place)?;
            write_bytes(&path, &self.place, &bytes)?;
        }
        self.folder.commit()
    }

    /// The list of episodes.
    fn list(&self, provenance: &Value) -> Result<Vec<u8>, ParquetError> {
        let whole = |of: &dyn Fn(usize, &EpisodeEntry) -> usize| {
            let value = |(at, episode)| i64::try_from(of(at, episode)).unwrap_or(i64::MAX);
            Values::Integers(self.episodes.iter().enumerate().map(value).collect())
        };
        let tasks = self.episodes.iter().map(|episode| Some(vec![episode.task.clone()])).collect();
        let mut columns = vec![
            ("episode_index".to_string(), whole(&|at, _| at)),
            ("tasks".to_string(), Values::TextLists(tasks)),
            ("length".to_string(), whole(&|_, episode| episode.to - episode.from)),
            ("data/chunk_index".to_string(), whole(&|_, episode| episode.place.0)),
            ("data/file_index".to_string(), whole(&|_, episode| episode.place.1)),
            ("dataset_from_index".to_string(), whole(&|_, episode| episode.from)),
            ("dataset_to_index".to_string(), whole(&|_, episode| episode.to)),
            ("meta/episodes/chunk_index".to_string(), whole(&|_, _| 0)),
            ("meta/episodes/file_index".to_string(), whole(&|_, _| 0)),
        ];
        let all: Vec<&[Statistics]> = self.episodes.iter().map(|episode| episode.statistics.as_slice()).collect();
        columns.extend(Statistics::columns(&all));
        let columns: Vec<Column> = columns.into_iter().map(|(name, values)| Column { name, values }).collect();
        let mut bytes = Vec::new();
        let keys = vec![rewrite::features(&columns), (PROVENANCE, provenance.to_string())];
        rewrite::write_new(&columns, keys, &mut bytes)?;
        Ok(bytes)
    }

    /// `info.json`.
    fn info(&self, episodes: usize, frames: usize, tasks: usize, provenance: &Value) -> Value {
        let Features { fps, robot, state, action, cameras, has_labels, has_success } = &self.features;
        let mut features = Map::new();
        let vector = |names: &[String]| json!({ "dtype": "float32", "shape": [names.len()], "names": names });
        features.insert(STATE.into(), vector(state));
        if !action.is_empty() {
            features.insert(ACTION.into(), vector(action));
        }
        for (camera, shape) in cameras {
            let feature = json!({ "dtype": "image", "shape": shape, "names": ["height", "width", "channels"] });
            features.insert(camera.clone(), feature);
        }
        let plain = |dtype: &str| json!({ "dtype": dtype, "shape": [1], "names": null });
        let flags = if *has_success { vec![(success::COLUMN, "bool")] } else { vec![] };
        let counters = ["frame_index", "episode_index", "index", "task_index"].map(|name| (name, "int64"));
        let language = if *has_labels { vec![(LANGUAGE, "language")] } else { vec![] };
        let rest = flags.into_iter().chain([("timestamp", "float32")]).chain(counters).chain(language);
        features.extend(rest.map(|(name, dtype)| (name.to_string(), plain(dtype))));
        json!({
            "codebase_version": "v3.0", "robot_type": robot, "total_episodes": episodes, "total_frames": frames,
            "total_tasks": tasks, "chunks_size": FILES, "data_files_size_in_mb": FILE_BYTES >> 20,
            "video_files_size_in_mb": 200, "fps": fps, "splits": { "train": format!("0:{episodes}") },
            "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet", "video_path": null,
            "features": features, PROVENANCE: provenance,
        })
    }
}

fn vectors(name: &str, width: usize, values: Vec<f32>) -> Column<'static> {
    Column { name: name.into(), values: Values::FloatVectors(width, values) }
}

/// The rows of language, the same on all frames of an episode.
fn language(rows: &[Row], frames: usize) -> Column<'_> {
    Column { name: LANGUAGE.into(), values: Values::Language(vec![rows; frames]) }
}
