//! Opening a log: a path in, a recording with the names that the rules know out, whatever the log looked like.

use crate::bind::{Binding, BindingFile, assumed_log, bind, check_channels};
use crate::clean::closed_grippers;
use crate::clean::gap_filling;
use crate::clean::spikes;
use crate::derive;
use crate::frames::Frames;
use crate::hand_models::{self, HandModel};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use teachtree_base::channels::ChannelSpec;
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_base::file_kind::FileKind;
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;
use teachtree_logs::allowed_folders::LogFolders;
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::read::csv;
use teachtree_logs::read::formats;
use teachtree_logs::read::table::{BagClock, Source};

/// What to open.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OpenRequest {
    /// The log.
    pub log: PathBuf,
    /// The binding that describes a foreign log; by default the log is canonical.
    pub binding: Option<PathBuf>,
    /// A scene instead of the one that the log or the binding carries.
    pub scene: Option<PathBuf>,
    /// The folders that the files of the log and the files beside it must be in. `binding` and `scene` may be in any folder.
    pub folders: LogFolders,
}

/// An opened log.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenedLog {
    /// The log as the user named it.
    pub log: PathBuf,
    /// Its columns under canonical names.
    pub recording: Recording,
    /// What was dropped while it was read.
    pub issues: Vec<Issue>,
    /// When each row of the file was, s, on the time base of the recording; also of those that were left out.
    pub row_time: Vec<f64>,
    /// The hand model that the binding names: a path when it lies beside the binding.
    pub hand_file: Option<String>,
    /// What the clock of the log shows at t = 0, s.
    pub zero_stamp_s: f64,
    /// The clock of the bag that the log is; `None` of other logs, and where the binding takes the stamps from a column.
    pub clock: Option<BagClock>,
    /// Whether the recording is a success, by each field of the log that says so.
    pub success_fields: Vec<(&'static str, bool)>,
    /// Rule parameters that the binding overrides, in its order: name, and value with unit.
    pub params: Vec<(String, String)>,
    /// The places of these params in the binding, by name.
    pub param_places: BTreeMap<String, String>,
    /// Forces that count as they are, although they stay constant.
    pub trust: Vec<String>,
    /// The tasks that the binding expects, with the place where it does.
    pub expect: Option<(String, String)>,
    /// The place of `resample` in the binding; `None` of a log that is not resampled.
    pub resample_place: Option<String>,
    /// The columns of the flags in the binding, as written and with the opposite comparison, by channel.
    pub turned_flags: BTreeMap<String, [String; 2]>,
    /// The flags that the binding sets to a constant, by channel.
    pub constant_flags: BTreeSet<String>,
    /// Channels of the binding with nearly the names of known ones, and the error that each is when no rule reads it.
    pub suspicious_channels: Vec<(String, InputError)>,
}

/// Opens a log.
///
/// # Errors
/// The first thing that cannot be read as the policies of docs/logs.md want it, with file, row and column.
pub fn open(request: &OpenRequest) -> Result<OpenedLog, InputError> {
    let source = formats::open_within(&request.log, &request.folders.log);
    open_source(source.map_err(|error| swapped(error, request))?, request)
}

/// The error about a file that is not a log, with the option that takes such a file.
fn swapped(error: InputError, request: &OpenRequest) -> InputError {
    let is_log = |file: &&PathBuf| FileKind::of(file, "") == Some(FileKind::Log);
    let options = [("--binding", &request.binding), ("--scene", &request.scene)];
    let swapped = options.iter().find_map(|(option, file)| Some((option, file.as_ref().filter(is_log)?)));
    match swapped {
        Some((option, log)) if error.message.ends_with(NO_LOG) => {
            let help = format!("LOG and {option} are swapped: `{} {option} {}`", log.display(), request.log.display());
            error.help(help)
        }
        _ => error,
    }
}

/// The end of messages about other files in the place of a log.
const NO_LOG: &str = "expected a log";

/// A log that has each column that a binding names and no rows, in the scene of the binding or in one with each body that it mentions. What is refused of it
/// is refused of every log.
///
/// # Errors
/// What the binding contradicts itself in, at `file:line:column`.
pub fn assume(binding: &Path, file: &BindingFile) -> Result<OpenedLog, InputError> {
    let scene = file.binding.scene.clone().map_or_else(|| file.mentioned_bodies(), Ok)?;
    let suspicious_channels = file.check(&scene)?;
    let recording = assumed_log::recording(file, scene).map_err(|error| said(error, &suspicious_channels))?;
    let read = csv::LoadedRecording { recording, issues: vec![], row_time: vec![], zero_stamp_s: 0.0 };
    Ok(bound_log(PathBuf::from("the log"), read, binding, file.clone(), suspicious_channels))
}

/// The error about an unknown name, in place of another error about the same place.
fn said(error: InputError, suspicious_channels: &[(String, InputError)]) -> InputError {
    suspicious_channels.iter().find(|(_, slip)| slip.place == error.place).map_or(error, |(_, slip)| slip.clone())
}

/// Opens a log whose columns are known already.
///
/// # Errors
/// As [`open`].
pub fn open_source(source: Source, request: &OpenRequest) -> Result<OpenedLog, InputError> {
    let mut opened = opened(source, request)?;
    opened.issues = std::mem::take(&mut opened.issues).into_iter().map(|issue| opened.spelled(issue)).collect();
    Ok(opened)
}

fn opened(mut source: Source, request: &OpenRequest) -> Result<OpenedLog, InputError> {
    let log = request.log.clone();
    let (clock, success_fields) = (source.clock, std::mem::take(&mut source.success_fields));
    let Some(binding) = &request.binding else {
        let read = csv::read_source(source, &log, request.scene.as_deref(), &request.folders.beside)?;
        return Ok(OpenedLog { clock, success_fields, ..canonical(read, log) });
    };
    let in_binding = |error: InputError| error.or_kind(ErrorKind::Binding);
    let file = BindingFile::read(binding).map_err(in_binding)?;
    let scene = match (&request.scene, &file.binding.scene, source.scene.take()) {
        (Some(path), ..) => csv::read_scene(path)?,
        (None, Some(scene), _) => scene.clone(),
        (None, None, Some(own)) => own,
        (None, None, None) => {
            check_channels(&source, &file).map_err(in_binding)?;
            let is_missing = csv::scene_file_beside(&log).is_none();
            csv::scene_beside(&log, &request.folders.beside).map_err(|error| match is_missing {
                true => error.help("describe the bodies below `scene` in the binding, or name a scene with --scene"),
                false => error,
            })?
        }
    };
    let suspicious_channels = file.check(&scene).map_err(in_binding)?;
    let bound = bind(source, &file, scene);
    let mut read = bound.map_err(|error| in_binding(in_log(&log, said(error, &suspicious_channels))))?;
    let clock = clock.filter(|_| file.binding.has_stamps_of_log());
    if file.binding.resample.is_none() {
        read.issues.extend(gap_filling::fill_gaps(&mut read.recording));
    }
    read.issues.extend(closed_grippers::learn(&mut read.recording));
    Ok(OpenedLog { clock, success_fields, ..bound_log(log, read, binding, file, suspicious_channels) })
}

/// A recording with the other settings of its binding.
fn bound_log(
    log: PathBuf,
    read: csv::LoadedRecording,
    binding: &Path,
    file: BindingFile,
    suspicious_channels: Vec<(String, InputError)>,
) -> OpenedLog {
    let csv::LoadedRecording { recording, issues, row_time, zero_stamp_s } = read;
    let expect = file.binding.expect.clone().map(|text| (text, file.place(&["expect"])));
    let (turned_flags, constant_flags, param_places) =
        (file.turned_flags(), file.constant_flags(), file.param_places());
    let resample_place = file.binding.resample.map(|_| file.place(&["resample"]));
    let Binding { hand_file, params, trust, time_offset, .. } = file.binding;
    let hand_file = hand_file.map(|name| hand_file_of(binding, name));
    // Zero stays zero, without a sign.
    let zero_stamp_s = zero_stamp_s - time_offset.0;
    let params = params.into_iter().collect();
    OpenedLog {
        log,
        recording,
        issues,
        row_time,
        zero_stamp_s,
        clock: None,
        success_fields: vec![],
        hand_file,
        params,
        param_places,
        trust,
        expect,
        resample_place,
        turned_flags,
        constant_flags,
        suspicious_channels,
    }
}

/// Opens a log with canonical names that is in memory, its scene included: no file beside it is looked for. `log` is its name in messages.
///
/// # Errors
/// As [`open`].
pub fn open_memory(mut source: Source, log: PathBuf) -> Result<OpenedLog, InputError> {
    let scene = source.scene.take().unwrap_or_default();
    let mut read = csv::columns(source, &csv::StampSource::canonical())?;
    read.count_from_first();
    read.recording.scene = scene;
    let mut opened = canonical(read, log);
    opened.issues = std::mem::take(&mut opened.issues).into_iter().map(|issue| opened.spelled(issue)).collect();
    Ok(opened)
}

/// A log with canonical names as it was read, cleaned.
fn canonical(read: csv::LoadedRecording, log: PathBuf) -> OpenedLog {
    let csv::LoadedRecording { mut recording, mut issues, row_time, zero_stamp_s } = read;
    issues.extend(spikes::reject(&mut recording));
    issues.extend(gap_filling::fill_gaps(&mut recording));
    issues.extend(closed_grippers::learn(&mut recording));
    let (params, trust, suspicious_channels) = (vec![], vec![], vec![]);
    OpenedLog {
        log,
        recording,
        issues,
        row_time,
        zero_stamp_s,
        clock: None,
        success_fields: vec![],
        hand_file: None,
        params,
        param_places: BTreeMap::new(),
        trust,
        expect: None,
        resample_place: None,
        turned_flags: BTreeMap::new(),
        constant_flags: BTreeSet::new(),
        suspicious_channels,
    }
}

impl OpenedLog {
    /// The hand model for the log and the reason for it: the one that the binding names, else the one for the quantities of the log.
    pub fn hand_model(&self) -> HandModel {
        match &self.hand_file {
            Some(file) => HandModel { file: file.clone(), reason: "as `hand_file` in the binding says".into() },
            None => {
                let Recording { scene, columns, spelling, .. } = &self.recording;
                hand_models::of_columns(scene, columns.keys().map(String::as_str), spelling)
            }
        }
    }

    /// The hands that the log measures, left first.
    pub fn hands(&self) -> Vec<Side> {
        derive::sides(&self.recording.scene, self.recording.columns.keys().map(String::as_str))
    }

    /// Refuses a channel of the binding with nearly the name of a known one, if rules with these channels do not read it.
    ///
    /// # Errors
    /// The first one, with the known name.
    pub fn check_channels(&self, channels: &[ChannelSpec]) -> Result<(), InputError> {
        let unread = self.suspicious_channels.iter().find(|(channel, _)| !derive::reads(channels, channel));
        unread.map_or(Ok(()), |(_, error)| Err(error.clone()))
    }

    /// The frames that rules with these channels read; every issue of the log is among theirs.
    ///
    /// # Errors
    /// As [`frames`](crate::frames()), with the name of the log.
    pub fn frames(&self, channels: &[ChannelSpec]) -> Result<Frames, InputError> {
        self.check_channels(channels)?;
        let mut frames = derive::frames_trusting(&self.recording, channels, &self.trust)
            .map_err(|error| in_log(&self.log, self.recording.spelling.of_error(error)))?;
        frames.row_time.clone_from(&self.row_time);
        // A flag that the user sets is a statement.
        frames.issues.retain(|it| it.kind != IssueKind::CONSTANT_FLAG || !self.constant_flags.contains(&it.channel));
        frames.issues = frames.issues.into_iter().map(|issue| self.spelled(self.with_turned_flag(issue))).collect();
        // A binding looks at sensors before it corrects them; what it has found is found again where nothing was corrected.
        frames.issues.retain(|issue| !self.issues.contains(issue));
        frames.issues.splice(0..0, self.issues.iter().cloned());
        frames.issues.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
        Ok(frames)
    }

    /// The recording as the rules see it.
    ///
    /// # Errors
    /// As [`trusted`](crate::trusted), with the name of the log.
    pub fn trusted(&self) -> Result<Recording, InputError> {
        derive::trusted(&self.recording, &self.trust)
            .map_err(|error| in_log(&self.log, self.recording.spelling.of_error(error)))
    }

    /// An issue with the line of the binding that turns a reversed flag.
    fn with_turned_flag(&self, issue: Issue) -> Issue {
        match self.turned_flags.get(&issue.channel).filter(|_| issue.kind == IssueKind::REVERSED_FLAG) {
            Some([written, turned]) => {
                let message = format!("{}, `{}: {turned}` for `{written}`", issue.message, issue.channel);
                Issue { message, ..issue }
            }
            None => issue,
        }
    }

    /// An issue with the names of channels as the user writes them.
    fn spelled(&self, issue: Issue) -> Issue {
        issue.spelled(&self.recording.spelling)
    }
}

/// The hand model that a binding names: one of one's own lies beside it; others come with the program, or are found from where it runs.
pub fn hand_file_of(binding: &Path, name: String) -> String {
    let own = binding.parent().map(|folder| folder.join(&name)).filter(|path| path.is_file());
    own.map_or(name, |path| path.display().to_string())
}

/// The same error with the name of the log: `the log` is what it is called where no file is known.
fn in_log(log: &Path, error: InputError) -> InputError {
    let place = match error.place.as_str() {
        "the log" => log.display().to_string(),
        channel if channel.starts_with("channel ") => format!("{} {channel}", log.display()),
        _ => return error,
    };
    InputError { place, ..error }
}
