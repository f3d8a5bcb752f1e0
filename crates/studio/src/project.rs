//! The recordings of a studio, and what was found in each of them.
//!
//! A recording is read once and stays in memory while there is room; rules with other params are evaluated over the frames that are there. Rows of the list
//! hold only what the list shows.

use super::background::Background;
use super::labels::{self, Labels, SaveError, SentLabels};
use super::loaded_recording::{Agreement, LoadedRecording, RuleOutcome, RuleState};
use super::rule_comparison::RuleComparison;
use super::{score, tuning};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use teachtree_analysis::TrackId;
use teachtree_analysis::outcome::OutcomeKind;
use teachtree_analysis::score::{KnownNames, Tally};
use teachtree_base::diagnostic::Source;
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_learn::Declaration;
use teachtree_logs::allowed_folders::{AllowedFolders, LogFolders};
use teachtree_logs::read::formats;
use teachtree_session::files;
use teachtree_session::{Analysis, Error, LogOptions, RulesOptions};
use teachtree_session::{AnalysisInternals, ErrorInternals, LogInternals, RulesInternals, RulesOptionsInternals};

/// The values that recordings in memory have together, about; the newest stays in any case.
const MAX_VALUES: usize = 60_000_000;
/// The most recordings of a studio.
const MAX_RECORDINGS: usize = 20_000;

/// What a studio is opened on.
pub struct Options {
    /// Recordings, folders, data sets.
    pub paths: Vec<PathBuf>,
    /// How logs are opened.
    pub source: LogOptions,
    /// The binding among that, which decides whether a folder is one recording.
    pub binding: Option<PathBuf>,
    /// The rules.
    pub rules: RulesOptions,
    /// Other rules that these are held against, with their name.
    pub against: Option<(String, RulesOptions)>,
    /// The name that labels are signed with until the page says another one.
    pub who: String,
}

/// The recordings, with the results so far.
pub struct Studio {
    /// In the order of the list.
    pub recordings: Vec<Recording>,
    pub(super) source: LogOptions,
    pub(super) rules: RulesOptions,
    /// Other rules that these are held against, with their name.
    pub against: Option<(String, RulesOptions)>,
    state: Mutex<State>,
    /// There is something to analyze.
    pub(super) wake: Condvar,
    /// Held while labels or rules are written.
    pub(super) saving: Mutex<()>,
    /// Fits of the rules of a recording.
    pub fitting: Background<usize>,
    /// New primitives for the rules of a recording.
    pub learning: Background<(usize, Declaration)>,
    /// The default annotator.
    pub who: String,
}

/// A recording of the list.
pub struct Recording {
    /// The options for opening the log.
    pub log: PathBuf,
    /// Its name in the list.
    pub name: String,
    /// The folders that its files must be in.
    pub(super) folders: LogFolders,
}

impl Recording {
    /// Creates a recording that was found at a path of the command line, in `named`.
    fn new(name: String, log: PathBuf, path: &Path, named: &AllowedFolders) -> Result<Self, InputError> {
        let file = formats::without_episode(&log);
        let folders = if file != formats::without_episode(path) {
            LogFolders { log: named.clone(), beside: named.clone() }
        } else {
            let beside = AllowedFolders::of(file.parent().unwrap_or(Path::new("")))?;
            let log = if file.is_dir() { named.clone() } else { beside.clone().with_named(&file) };
            LogFolders { log, beside }
        };
        Ok(Self { log, name, folders })
    }
}

/// What changes.
#[derive(Default)]
pub struct State {
    /// Grows with each change that a page may want to show.
    pub revision: u64,
    /// Grows when rules or params change: what was found before is old.
    pub generation: u64,
    /// Grows when rule files were written.
    pub epoch: u64,
    /// Params that differ from the files, with their values.
    pub params: BTreeMap<String, String>,
    /// Texts of rule files that differ from the files, by the name of the file, and how often they were changed.
    pub edits: BTreeMap<String, String>,
    pub edit_version: u64,
    /// Texts of rule files as they were read, by the name of the file.
    pub texts: BTreeMap<String, String>,
    /// One for each recording.
    pub rows: Vec<Row>,
    /// What a thread is at.
    pub claimed: BTreeSet<usize>,
    /// Recordings in memory; the one that was used last is the last.
    open: Vec<(usize, Arc<LoadedRecording>)>,
}

impl State {
    /// Keeps the texts of rule files that were read for the first time.
    pub(super) fn remember<'a>(&mut self, read: impl Iterator<Item = &'a Source>) {
        for source in read {
            self.texts.entry(source.name.clone()).or_insert_with(|| source.text.clone());
        }
    }
}

/// What the list shows of a recording.
#[derive(Clone, Default)]
pub struct Row {
    /// The generation of what is here; `None` before the first analysis.
    pub generation: Option<u64>,
    /// What was found, or why nothing was.
    pub outcome: Option<Result<Summary, String>>,
    /// The stability of the least stable task; the inner one is `None` without a task.
    pub stability: Option<Option<f64>>,
    /// The label file and how well the rules agree with it.
    pub agreement: Agreement,
    /// How the rules and the others differ.
    pub against: Option<RuleComparison>,
}

/// What was found, in brief.
#[derive(Clone)]
pub struct Summary {
    length_s: f64,
    /// Track and name of each task, with its object.
    tasks: Vec<(String, String)>,
    /// The kinds of issues, each once.
    issues: BTreeSet<String>,
    issue_count: usize,
    /// Whether the recording is a success.
    /// `None` where neither rules nor expected tasks decide it.
    result: Option<OutcomeKind>,
}

impl Studio {
    /// Finds the recordings; none is read yet.
    ///
    /// # Errors
    /// A path that cannot be read or holds no recording, more recordings than a list can have.
    pub fn new(options: Options) -> Result<Self, InputError> {
        let Options { paths, source, binding, rules, against, who } = options;
        let mut found = Vec::new();
        for path in &paths {
            let folder = Some(formats::without_episode(path)).filter(|path| path.is_dir());
            // The command line may name a file that is a link.
            let named = folder.map_or_else(|| Ok(AllowedFolders::default()), |folder| AllowedFolders::of(&folder))?;
            // A set or a file of several recordings stands for all of them.
            let is_whole = formats::recording_of(path).is_none();
            let several = if is_whole { formats::all_of_within(path, &named)? } else { None };
            let logs: Vec<(String, PathBuf)> = match several {
                Some(logs) => logs.into_iter().map(|log| (formats::stem(&log), log)).collect(),
                None => {
                    let paths = std::slice::from_ref(path);
                    let logs = files::recordings_within(paths, binding.as_deref(), &named)?;
                    logs.into_iter().map(|one| (one.name.display().to_string(), one.log)).collect()
                }
            };
            for (name, log) in logs {
                found.push(Recording::new(name, log, path, &named)?);
            }
        }
        if found.len() > MAX_RECORDINGS {
            let message = format!("found {} recordings, at most {MAX_RECORDINGS} are shown", found.len());
            return Err(InputError::new("studio", message).help("name fewer, such as `set#0..999`"));
        }
        let mut seen = BTreeSet::new();
        found.retain(|recording: &Recording| seen.insert(recording.log.clone()));
        let rows = vec![Row::default(); found.len()];
        let state = Mutex::new(State { rows, revision: 1, ..State::default() });
        Ok(Self {
            recordings: found,
            source,
            rules,
            against,
            state,
            wake: Condvar::new(),
            saving: Mutex::default(),
            fitting: Background::default(),
            learning: Background::default(),
            who,
        })
    }

    fn recording(&self, at: usize) -> Result<&Recording, Error> {
        self.recordings.get(at).ok_or_else(|| Error::internal("there is no such recording"))
    }

    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        // The locked value is complete after each step.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The recording by the rules of now, read and analyzed unless it is there. Where the rules do not run it has no lanes.
    ///
    /// # Errors
    /// What is wrong with the recording.
    pub fn loaded(&self, at: usize) -> Result<Arc<LoadedRecording>, Error> {
        let (generation, epoch, params, edits, known) = {
            let mut state = self.state();
            let known = state.open.iter().position(|(number, _)| *number == at);
            let known = known.map(|place| {
                let one = state.open.remove(place);
                state.open.push(one.clone());
                one.1
            });
            (state.generation, state.epoch, state.params.clone(), state.edits.clone(), known)
        };
        if let Some(known) = known.as_ref().filter(|known| known.generation == generation) {
            return Ok(Arc::clone(known));
        }
        let now = RuleState { generation, epoch, params: &params, edits: &edits };
        let loaded = Arc::new(self.analyzed(at, known.as_deref(), &now)?);
        let mut state = self.state();
        if state.epoch == epoch {
            state.remember(loaded.base.sources().files.iter());
        }
        state.open.retain(|(number, _)| *number != at);
        state.open.push((at, Arc::clone(&loaded)));
        let mut values: usize = state.open.iter().map(|(_, one)| one.values()).sum();
        while values > MAX_VALUES && state.open.len() > 1 {
            values -= state.open.remove(0).1.values();
        }
        Ok(loaded)
    }

    /// Analyzes a recording, using earlier results.
    ///
    /// # Errors
    /// What is wrong with the recording.
    fn analyzed(&self, at: usize, known: Option<&LoadedRecording>, now: &RuleState) -> Result<LoadedRecording, Error> {
        let RuleState { generation, epoch, params, edits } = *now;
        let same = known.filter(|known| known.epoch == epoch);
        let other = same.and_then(|known| known.other.clone());
        let by = |of: &Analysis, rules: &RulesOptions| {
            let found = rules.clone().for_log(of.log()).and_then(|rules| of.by_rules(&rules));
            RuleOutcome::of(found, of.log(), &rules.clone().request_for(of.log()))
        };
        let base = match (same, known) {
            (Some(same), _) => same.base.clone(),
            (None, Some(known)) => by(&known.base.shown, &self.rules)?,
            (None, None) => {
                let recording = self.recording(at)?;
                let log = self.source.clone().within(recording.folders.clone()).open(&recording.log)?;
                log.read()?;
                let found = self.rules.clone().for_log(&log).and_then(|rules| rules.analyze(&log));
                RuleOutcome::of(found, &log, &self.rules.clone().request_for(&log))?
            }
        };
        let edited = self.rules.clone().buffers(tuning::buffers(edits));
        // Params of rules that do not run are those of other recordings.
        let now = match (edits.is_empty(), params.is_empty() || base.runs().is_err()) {
            (true, true) => base.clone(),
            (is_written, _) => {
                let log = base.shown.log();
                let written = if is_written { Ok(base.shown.rules().clone()) } else { edited.clone().for_log(log) };
                let takes = |name: &String| written.as_ref().is_ok_and(|rules| rules.set().param(name).is_some());
                let own = params.iter().filter(|(name, _)| takes(name));
                by(&base.shown, &own.fold(edited, |rules, (name, value)| rules.param(name, value)))?
            }
        };
        let by_other = |rules: &RulesOptions| {
            let found = rules.clone().for_log(base.shown.log()).and_then(|rules| base.shown.by_rules(&rules));
            found.map(Arc::new).map_err(|error| error.to_string())
        };
        let other = other.or_else(|| self.against.as_ref().map(|(_, rules)| by_other(rules)));
        let folders = self.recording(at)?.folders.clone();
        Ok(LoadedRecording { generation, epoch, base, now, other, folders })
    }
    /// Analyzes a recording and puts what was found into its row.
    ///
    /// # Errors
    /// As [`loaded`](Self::loaded).
    pub fn refresh(&self, at: usize) -> Result<Arc<LoadedRecording>, Error> {
        let loaded = self.loaded(at);
        let ran = loaded.as_ref().map_err(Error::clone).and_then(|loaded| loaded.now.runs());
        let outcome = ran.map(summary).map_err(|error| error.to_string());
        let agreement = loaded.as_ref().map(|loaded| loaded.agreement()).unwrap_or_default();
        let both = |loaded: &Arc<LoadedRecording>| {
            Some(RuleComparison::of(loaded.now.runs().ok()?, loaded.other.as_ref()?, &loaded.folders.beside))
        };
        let against = loaded.as_ref().ok().and_then(both);
        let mut state = self.state();
        let generation = loaded.as_ref().map_or(state.generation, |loaded| loaded.generation);
        if let Some(row) = state.rows.get_mut(at) {
            row.generation = Some(generation);
            row.outcome = Some(outcome);
            row.agreement = agreement;
            row.against = against;
        }
        state.revision += 1;
        loaded
    }

    /// The same, of rules that run.
    ///
    /// # Errors
    /// Also why the rules do not run.
    pub fn refresh_running(&self, at: usize) -> Result<Arc<LoadedRecording>, Error> {
        let loaded = self.refresh(at)?;
        loaded.now.runs()?;
        Ok(loaded)
    }

    /// The list, as the page takes it.
    pub fn list(&self) -> Value {
        let state = self.state();
        let rows = self.recordings.iter().zip(&state.rows).map(|(recording, row)| {
            let mut value = json!({ "name": recording.name, "log": recording.log.display().to_string() });
            let Some(fields) = value.as_object_mut() else { return value };
            let status = match (&row.outcome, row.generation == Some(state.generation)) {
                (None, _) => "waiting",
                (Some(Err(_)), _) => "failed",
                (Some(Ok(_)), false) => "old",
                (Some(Ok(_)), true) => "done",
            };
            fields.insert("status".into(), status.into());
            match &row.outcome {
                Some(Ok(found)) => {
                    fields.insert("length_s".into(), json!(found.length_s));
                    fields.insert("tasks".into(), json!(found.tasks));
                    fields.insert("issues".into(), json!(found.issues));
                    fields.insert("issue_count".into(), json!(found.issue_count));
                    fields.insert("outcome".into(), json!(found.result));
                }
                Some(Err(error)) => _ = fields.insert("error".into(), json!(error)),
                None => {}
            }
            fields.insert("stability".into(), json!(row.stability.flatten()));
            row.agreement.put(fields);
            if let Some(against) = &row.against {
                fields.insert("against".into(), against.json());
            }
            value
        });
        let rows: Vec<Value> = rows.collect();
        let current = || state.rows.iter().filter(|row| row.generation == Some(state.generation));
        let waiting = state.rows.len() - current().count();
        let (mut now, mut base) = (Tally::default(), Tally::default());
        for row in current() {
            row.agreement.now.iter().for_each(|tally| now.add(tally));
            row.agreement.base.iter().for_each(|tally| base.add(tally));
        }
        // Less than a thousandth is the same.
        let gains = || current().filter_map(|row| row.agreement.gain());
        let (better, worse) = (gains().filter(|by| *by > 5e-4).count(), gains().filter(|by| *by < -5e-4).count());
        json!({ "revision": state.revision, "waiting": waiting, "params": state.params, "edit_version": state.edit_version, "recordings": rows,
            "score": score::brief(&now), "base": score::brief(&base), "better": better, "worse": worse,
            "labeled": gains().count() })
    }

    /// Changes rules or params: all results become outdated, and the background threads analyze again.
    pub(super) fn renew(&self, change: impl FnOnce(&mut State)) {
        let mut state = self.state();
        change(&mut state);
        state.generation += 1;
        state.revision += 1;
        drop(state);
        self.wake.notify_all();
    }

    /// The labels of a recording.
    ///
    /// # Errors
    /// A recording or a label file that cannot be read.
    pub fn labels(&self, at: usize) -> Result<Labels, Error> {
        self.loaded(at)?.labels()
    }

    /// Saves the labels of a recording in the place of the version that they change, and scores them.
    ///
    /// # Errors
    /// A recording that cannot be read; labels that are wrong, or of another version.
    pub fn save_labels(&self, at: usize, sent: SentLabels) -> Result<Result<Labels, SaveError>, Error> {
        let loaded = self.loaded(at)?;
        let saved = {
            let _saving = self.saving.lock().unwrap_or_else(PoisonError::into_inner);
            let known = KnownNames::new(loaded.now.set());
            labels::write(loaded.log().opened()?, loaded.only(), sent, &known, &loaded.folders.beside)
        };
        self.refresh(at)?;
        Ok(saved)
    }

    /// Runs the rules with other values of params over a recording at once, and over the others in the background.
    ///
    /// # Errors
    /// Values that the rules do not take; those of before stay.
    pub fn turn(&self, at: usize, values: &BTreeMap<String, f64>) -> Result<Arc<LoadedRecording>, Error> {
        let argument = |error| Error::new(error, ErrorKind::Argument);
        let params = tuning::overrides(self.loaded(at)?.now.runs()?.rules().set(), values).map_err(argument)?;
        let before = self.state().params.clone();
        if params != before {
            self.renew(|state| state.params = params);
        }
        let turned = self.refresh_running(at);
        if turned.is_err() {
            self.renew(|state| state.params = before);
            self.refresh(at)?;
        }
        turned
    }

    /// Writes the texts and params that were changed into the rule files; returns the files.
    ///
    /// # Errors
    /// Files that come with the program, were changed since, or cannot be written.
    pub fn save_params(&self, at: usize) -> Result<Vec<String>, Error> {
        let loaded = self.loaded(at)?;
        let now = loaded.now.runs()?.rules().set();
        let (params, edits, texts) = {
            let state = self.state();
            (state.params.clone(), state.edits.clone(), state.texts.clone())
        };
        let files = {
            let _saving = self.saving.lock().unwrap_or_else(PoisonError::into_inner);
            let saved = tuning::save(&texts, now, &edits, &params);
            saved.map_err(|error| Error::new(error, ErrorKind::Argument))?
        };
        self.reload();
        Ok(files)
    }

    /// Reads the rule files again, with no texts and params changed.
    pub fn reload(&self) {
        self.renew(|state| {
            state.epoch += 1;
            state.params.clear();
            state.edits.clear();
            state.texts.clear();
            state.edit_version += 1;
            state.rows.iter_mut().for_each(|row| row.stability = None);
        });
    }
}

fn summary(analysis: &Analysis) -> Summary {
    let found = analysis.found();
    let tasks = found.tracks.iter().flat_map(|track| {
        let who = if matches!(track.who, TrackId::Both) { String::new() } else { track.who.to_string() };
        track.tasks.iter().map(move |task| (who.clone(), format!("{}{}", task.task, task.subject.suffix())))
    });
    Summary {
        length_s: found.end_s - found.start_s,
        tasks: tasks.collect(),
        issues: found.issues.iter().map(|issue| issue.kind.name().to_string()).collect(),
        issue_count: found.issues.len(),
        result: found.has_criterion().then(|| found.outcome().result),
    }
}
