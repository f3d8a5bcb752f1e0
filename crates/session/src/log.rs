//! Logs: files of any format, with a binding and a scene where they need them, and columns in memory.

use super::analysis::Analysis;
use super::error::Error;
use super::files;
use super::growing_log::{self, OnSegment};
use super::project_file::{ProjectSettings, Setting};
use super::rules::RulesOptions;
use crate::ErrorInternals;
use std::collections::BTreeMap;
use std::fmt;
use std::io::BufRead;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_base::hands::Side;
use teachtree_base::scene::Scene as Bodies;
use teachtree_frames as stream;
use teachtree_frames::OpenRequest;
use teachtree_frames::OpenedLog;
use teachtree_frames::hand_models::HandModel;
use teachtree_frames::streaming::StreamedLog;
use teachtree_logs::allowed_folders::LogFolders;
use teachtree_logs::read::csv;
use teachtree_logs::read::formats;
use teachtree_logs::read::memory_table::{Cells, InMemoryTable, SharedNumbers};
use teachtree_logs::read::table::{MAX_COLUMNS, Source, check_size};

/// A recorded demonstration: columns over time, and the scene in which it happened.
///
/// A log whose form allows it (CSV or Parquet with the names of docs/logs.md, contacts included) is analyzed in windows, with constant
/// memory: [`open`](Self::open) reads its header only, and mistakes in its rows show when it is analyzed. Other logs are read when they are
/// opened. [`read`](Self::read) reads any log into memory. Clones share what was read.
#[derive(Clone)]
pub struct Log(Arc<Inner>);

struct Inner {
    request: OpenRequest,
    /// The settings of `teachtree.yaml`, where they are asked for.
    settings: ProjectSettings,
    /// A log that can be read in windows.
    streamed: Option<LogHeader>,
    opened: OnceLock<Result<OpenedLog, InputError>>,
}

/// A log that can be read in windows, as far as its header shows.
struct LogHeader {
    hands: Vec<Side>,
    hand_model: HandModel,
    /// The header, until the first analysis takes it.
    flow: Mutex<Option<StreamedLog>>,
}

impl Log {
    /// Opens a log: a file of any format (docs/logs.md), a folder that is one log, `set#3` for episode 3 of a data set. Its columns have the
    /// names of docs/logs.md, and its scene is beside it or in it; [`options`](Self::options) opens other logs.
    ///
    /// # Errors
    /// [`ErrorKind::Io`], [`ErrorKind::Format`] and [`ErrorKind::Scene`], at the file, row and column.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::options().open(path)
    }

    /// Options to open a log with: a binding, a scene.
    pub fn options() -> LogOptions {
        LogOptions::default()
    }

    /// A log of columns in memory. `name` stands in messages and outputs.
    ///
    /// One column is `time`, its values strictly rising; the others have the names of docs/logs.md, such as `right.thumb.force.x`, and as many
    /// values. A value that was not measured is NaN. No file is read.
    ///
    /// # Errors
    /// [`ErrorKind::Format`]: columns of different lengths, two of one name, units that do not fit, stamps that do not rise.
    pub fn from_columns(
        name: impl Into<String>,
        columns: impl IntoIterator<Item = Column>,
        scene: &Scene,
    ) -> Result<Self, Error> {
        let name = name.into();
        let in_format = |error| Error::new(error, ErrorKind::Format);
        let source = source(&name, columns).map_err(in_format)?;
        let source = Source { scene: Some(scene.0.clone()), ..source };
        let log = PathBuf::from(name);
        let request = OpenRequest { log: log.clone(), ..OpenRequest::default() };
        Ok(Self::of(request, ProjectSettings::default(), stream::open_memory(source, log).map_err(in_format)?))
    }

    pub(crate) fn open_request(request: OpenRequest, settings: ProjectSettings) -> Result<Self, Error> {
        if let Some(flow) = StreamedLog::open(&request) {
            let (hands, hand_model) = (flow.hands(), flow.hand_model());
            let streamed = Some(LogHeader { hands, hand_model, flow: Mutex::new(Some(flow)) });
            return Ok(Self(Arc::new(Inner { request, settings, streamed, opened: OnceLock::new() })));
        }
        let opened = stream::open(&request).map_err(|error| Error::new(error, ErrorKind::Format))?;
        Ok(Self::of(request, settings, opened))
    }

    /// A log without rows, with the columns that a binding names.
    pub(crate) fn assumed(request: OpenRequest, opened: OpenedLog) -> Self {
        Self::of(request, ProjectSettings::default(), opened)
    }

    pub(crate) fn open_source_with(
        source: Source,
        request: &OpenRequest,
        settings: &ProjectSettings,
    ) -> Result<Self, Error> {
        let opened = stream::open_source(source, request).map_err(|error| Error::new(error, ErrorKind::Format))?;
        Ok(Self::of(request.clone(), settings.clone(), opened))
    }

    fn of(request: OpenRequest, settings: ProjectSettings, opened: OpenedLog) -> Self {
        Self(Arc::new(Inner { request, settings, streamed: None, opened: OnceLock::from(Ok(opened)) }))
    }

    /// Reads the log into memory, unless it is there: analyses of it run there from now on.
    ///
    /// # Errors
    /// What is wrong with its rows: [`ErrorKind::Io`], [`ErrorKind::Format`].
    pub fn read(&self) -> Result<(), Error> {
        self.opened().map(|_| ())
    }

    /// The name of the log: its path as it was given.
    pub fn name(&self) -> String {
        self.0.request.log.display().to_string()
    }

    /// The name of the file or folder, without the folders above it and without its ending, and of the recording in it: `lift_demo_3`.
    pub(crate) fn short_name(&self) -> String {
        formats::stem(&self.0.request.log)
    }

    /// The hands that the log measures, left first.
    pub fn hands(&self) -> Vec<Side> {
        match (&self.0.streamed, self.0.opened.get()) {
            (Some(streamed), _) => streamed.hands.clone(),
            (None, Some(Ok(opened))) => opened.hands(),
            (None, _) => Vec::new(),
        }
    }

    /// The hand model for the log and why it is loaded where none is named with the rules: `hand_gripper.rules, since the log has
    /// right.gripper.closed`. `None` of a log that cannot be read.
    pub fn hand_model(&self) -> Option<String> {
        self.chosen_hand_model().map(|model| model.to_string())
    }

    /// The windowed reader of the log; `None` for a log in memory.
    pub(crate) fn flow(&self) -> Option<StreamedLog> {
        let streamed = self.0.streamed.as_ref()?;
        if self.0.opened.get().is_some() {
            return None;
        }
        // A poisoned lock holds a whole value: taking it cannot be interrupted.
        let taken = streamed.flow.lock().unwrap_or_else(PoisonError::into_inner).take();
        taken.or_else(|| StreamedLog::open(&self.0.request))
    }

    /// The path of the binding.
    pub(crate) fn binding(&self) -> Option<&Path> {
        self.0.request.binding.as_deref()
    }
}

/// The options for opening a log. Made by [`Log::options`].
#[derive(Clone, Debug, Default)]
pub struct LogOptions {
    binding: Option<PathBuf>,
    scene: Option<PathBuf>,
    folders: LogFolders,
    by_project: bool,
}

impl LogOptions {
    /// The folders that the files of the log and the files beside it must be in.
    #[doc(hidden)]
    #[must_use]
    pub fn within(self, folders: LogFolders) -> Self {
        Self { folders, ..self }
    }

    /// The file that says which columns of a foreign log are which channels (docs/bindings.md).
    #[must_use]
    pub fn binding(mut self, path: impl Into<PathBuf>) -> Self {
        self.binding = Some(path.into());
        self
    }

    /// Takes what these options do not name from the nearest `teachtree.yaml` above the log, else above the folder in which the program runs: the
    /// binding and the scene, and for [`Rules::for_log`](super::Rules::for_log) rules, hand model, params and expected tasks (docs/project.md). A binding
    /// of these options also replaces the scene, the hand model and the params of the file, which were chosen for its binding.
    #[must_use]
    pub fn by_project(self) -> Self {
        Self { by_project: true, ..self }
    }

    /// The file of the scene, instead of the one that the log or its binding carries.
    #[must_use]
    pub fn scene(mut self, path: impl Into<PathBuf>) -> Self {
        self.scene = Some(path.into());
        self
    }

    /// Reads a log that is still being written, as JSON lines (docs/logs.md), to its end. `on_segment` is called with each segment once it has been
    /// closed for a second; returns the analysis of the whole log, which is the one that counts.
    ///
    /// # Errors
    /// [`ErrorKind::Format`], when a line is not a JSON object; as [`Rules::analyze`](super::Rules::analyze); what `on_segment` returns.
    pub fn follow(self, lines: impl BufRead, rules: &RulesOptions, on_segment: OnSegment) -> Result<Analysis, Error> {
        let (request, settings) = self.request("-".into())?;
        growing_log::follow(lines, &request, &settings, rules, on_segment)
    }

    /// A log of columns in memory, as [`Log::from_columns`]; with a binding the columns have the names that the binding expects. The scene is that
    /// of these options, else that of the binding, else `scene`.
    ///
    /// # Errors
    /// As [`Log::from_columns`], [`ErrorKind::Binding`], and [`ErrorKind::Scene`] where a binding is given and there is no scene.
    pub fn from_columns(
        self,
        name: impl Into<String>,
        columns: impl IntoIterator<Item = Column>,
        scene: Option<&Scene>,
    ) -> Result<Log, Error> {
        if self.binding.is_none() {
            let own = self.scene.map(Scene::open).transpose()?;
            return Log::from_columns(name, columns, own.as_ref().or(scene).unwrap_or(&Scene::default()));
        }
        let name = name.into();
        let source = source(&name, columns).map_err(|error| Error::new(error, ErrorKind::Format))?;
        let source = Source { scene: scene.map(|scene| scene.0.clone()), ..source };
        let (request, settings) = Self { by_project: false, ..self }.request(name.into())?;
        Log::open_source_with(source, &request, &settings)
    }

    /// Opens a log; of a folder its only recording.
    ///
    /// # Errors
    /// As [`Log::open`], and [`ErrorKind::Binding`].
    pub fn open(self, path: impl AsRef<Path>) -> Result<Log, Error> {
        let in_format = |error| Error::new(error, ErrorKind::Format);
        let log = files::single(path.as_ref(), self.binding.as_deref(), &self.folders.log).map_err(in_format)?;
        let (request, settings) = self.request(log)?;
        Log::open_request(request, settings)
    }

    fn request(self, log: PathBuf) -> Result<(OpenRequest, ProjectSettings), Error> {
        let Self { mut binding, mut scene, folders, by_project } = self;
        let mut settings = ProjectSettings::default();
        if by_project {
            settings = ProjectSettings::of(&log).map_err(|error| Error::new(error, ErrorKind::Format))?;
        }
        if binding.is_some() {
            settings = settings.without_binding();
        } else {
            scene = scene.or_else(|| settings.scene.as_ref().map(|scene| scene.value.clone()));
            binding = settings.binding.as_ref().map(|binding| binding.value.clone());
        }
        Ok((OpenRequest { log, binding, scene, folders }, settings))
    }
}

/// A column of a log in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    title: String,
    cells: Cells,
}

impl Column {
    /// A column with its name, its unit and a value for each row.
    ///
    /// The unit is one of docs/logs.md, such as `N`, `mN`, `mm/s`, `deg`; with `""` the values are in the unit that docs/logs.md gives for the name.
    pub fn new(name: impl Into<String>, unit: &str, values: impl Into<Vec<f64>>) -> Self {
        let name = name.into();
        let title = if unit.is_empty() { name } else { format!("{name} [{unit}]") };
        Self { title, cells: Cells::Numbers(values.into()) }
    }

    /// A column whose values stay in the memory of another library, such as an Arrow array. They are copied only as far as rules read them.
    ///
    /// Name and unit as in [`Column::new`].
    pub fn shared(name: impl Into<String>, unit: &str, values: Arc<dyn AsRef<[f64]> + Send + Sync>) -> Self {
        Self { cells: Cells::Shared(SharedNumbers::new(values)), ..Self::new(name, unit, []) }
    }

    /// A column of texts, such as `right.label` or `right.target`; a text that is not known is empty.
    pub fn texts(name: impl Into<String>, texts: impl Into<Vec<String>>) -> Self {
        Self { title: name.into(), cells: Cells::Texts(texts.into()) }
    }
}

fn source(name: &str, columns: impl IntoIterator<Item = Column>) -> Result<Source, InputError> {
    let mut memory = InMemoryTable::new(name);
    for Column { title, cells } in columns {
        let rows = cells.rows();
        let wrong = |message: String| InputError::new(format!("{name} column {title}"), message);
        if memory.columns().contains_key(&title) {
            return Err(wrong("the column occurs twice".into()).help("keep one of them, or rename the other"));
        }
        if memory.rows() != rows && !memory.columns().is_empty() {
            let message = format!("expected {} values as in the columns before, found {rows}", memory.rows());
            return Err(wrong(message));
        }
        if memory.columns().len() == MAX_COLUMNS {
            return Err(InputError::new(
                name,
                format!("found more than {MAX_COLUMNS} columns, the most that are read"),
            ));
        }
        memory.push_column(title, cells);
        check_size(name, memory.rows(), memory.columns().len())?;
    }
    Ok(Source::one(name, memory.header(), Box::new(memory)))
}

/// The bodies and hands of a log (docs/scenes.md).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene(Bodies);

impl Scene {
    /// Reads a scene file.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] and [`ErrorKind::Scene`], at `file:line:column`.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Error> {
        csv::read_scene(path.as_ref()).map(Self).map_err(|error| Error::new(error, ErrorKind::Scene))
    }

    /// Reads the text of a scene file (YAML); `name` stands in messages.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`], at `name:line:column`.
    pub fn parse(name: &str, text: &str) -> Result<Self, Error> {
        csv::parse_scene(text, name).map(Self).map_err(|error| Error::new(error, ErrorKind::Scene))
    }
}

impl fmt::Debug for Log {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Log").field("request", &self.0.request).finish_non_exhaustive()
    }
}

impl fmt::Display for Log {
    /// The name.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.request.log.display().fmt(f)
    }
}

/// The methods of [`Log`] for the other crates of the workspace; not a part of the public interface.
#[doc(hidden)]
pub trait LogInternals: Sized {
    /// A log whose columns are known, with the binding and the scene of a request.
    fn open_source(source: Source, request: &OpenRequest) -> Result<Self, Error>;
    /// The path of the log, as it was given.
    fn path(&self) -> &Path;
    /// The log in memory.
    fn opened(&self) -> Result<&OpenedLog, Error>;
    /// The hand model for the log, and why it is loaded; `None` of a log that cannot be read.
    fn chosen_hand_model(&self) -> Option<HandModel>;
    /// The params that the binding of the log and then `teachtree.yaml` set.
    fn params(&self) -> Vec<(String, String)>;
    /// The places of these params, by name: `teachtree.yaml:3:14`.
    fn param_places(&self) -> BTreeMap<String, String>;
    /// The tasks that `teachtree.yaml` or the binding of the log expects, with the place where it does.
    fn expected(&self) -> Option<(String, String)>;
    /// The settings of `teachtree.yaml`, where the log was opened with them.
    fn project_settings(&self) -> &ProjectSettings;
}

impl LogInternals for Log {
    fn open_source(source: Source, request: &OpenRequest) -> Result<Self, Error> {
        Self::open_source_with(source, request, &ProjectSettings::default())
    }

    fn path(&self) -> &Path {
        &self.0.request.log
    }

    fn opened(&self) -> Result<&OpenedLog, Error> {
        let opened = self.0.opened.get_or_init(|| stream::open(&self.0.request));
        opened.as_ref().map_err(|error| Error::new(error.clone(), ErrorKind::Format))
    }

    fn chosen_hand_model(&self) -> Option<HandModel> {
        if let Some(Setting { value, place }) = &self.0.settings.hand_file {
            return Some(HandModel { file: value.clone(), reason: format!("as `hand_file` in {place} says") });
        }
        match (&self.0.streamed, self.0.opened.get()) {
            (Some(streamed), _) => Some(streamed.hand_model.clone()),
            (None, Some(Ok(opened))) => Some(opened.hand_model()),
            (None, _) => None,
        }
    }

    fn params(&self) -> Vec<(String, String)> {
        let mut params = match self.0.opened.get() {
            Some(Ok(opened)) => opened.params.clone(),
            // Only logs without a binding are read in windows.
            _ => Vec::new(),
        };
        params.extend(self.0.settings.params.iter().map(|(param, setting)| (param.clone(), setting.value.clone())));
        params
    }

    fn param_places(&self) -> BTreeMap<String, String> {
        let mut places = match self.0.opened.get() {
            Some(Ok(opened)) => opened.param_places.clone(),
            _ => BTreeMap::new(),
        };
        places.extend(self.0.settings.params.iter().map(|(param, setting)| (param.clone(), setting.place.clone())));
        places
    }

    fn expected(&self) -> Option<(String, String)> {
        if let Some(Setting { value, place }) = &self.0.settings.expect {
            return Some((value.clone(), place.clone()));
        }
        self.0.opened.get().and_then(|opened| opened.as_ref().ok()).and_then(|opened| opened.expect.clone())
    }

    fn project_settings(&self) -> &ProjectSettings {
        &self.0.settings
    }
}

/// The methods of [`Scene`] for the other crates of the workspace; not a part of the public interface.
#[doc(hidden)]
pub trait SceneInternals: Sized {
    fn of(bodies: Bodies) -> Self;
    fn inner(&self) -> &Bodies;
}

impl SceneInternals for Scene {
    fn of(bodies: Bodies) -> Self {
        Self(bodies)
    }

    fn inner(&self) -> &Bodies {
        &self.0
    }
}
