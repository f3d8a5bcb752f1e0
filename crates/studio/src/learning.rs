//! A new primitive learned from the marks of a person, in the background: what `learn --new` does, with the texts of the editor.

use super::project::Studio;
use super::{labels, tuning};
use serde::Deserialize;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError};
use teachtree_analysis::TrackId;
use teachtree_analysis::score::{KnownNames, NameMap, Truth};
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_learn::{Declaration, FoundInterval};
use teachtree_logs::atomic_write::Files;
use teachtree_logs::read::labels::{LabelKind, Labels};
use teachtree_new_primitive::{BaseRules, MarkedRecording, declaration, learn_primitive, marks};
use teachtree_session::{Error, ErrorInternals, LogInternals, RulesOptions, RulesOptionsInternals};

/// Recordings without labels in which the primitive is looked for, at most.
const UNLABELED: usize = 20;

/// A request to learn.
#[derive(Deserialize)]
pub struct LearnRequest {
    /// The primitive, or its declaration: `Shake`, `Shake is Translate`.
    primitive: String,
}

/// A request to write the rules that were learned.
#[derive(Deserialize)]
pub struct SaveRequest {
    /// The name of the file.
    file: String,
}

impl Studio {
    /// Starts the thread that learns.
    pub(super) fn wait_for_learning(self: &Arc<Self>) {
        let studio = Arc::clone(self);
        std::thread::spawn(move || studio.learning.run(|(at, new)| studio.learn_now(at, &new)));
    }

    /// Requests a new primitive for the rules of a recording.
    ///
    /// # Errors
    /// A text that does not declare a primitive; a sided primitive.
    pub fn begin_learning(&self, at: usize, asked: &LearnRequest) -> Result<Value, Error> {
        let wrong = |message: String| {
            argument(InputError::new("the new primitive", format!("found `{}`, {message}", asked.primitive)))
        };
        let new = declaration(&asked.primitive).map_err(wrong)?;
        if new.sided {
            return Err(wrong("expected a primitive without sides; `teachtree learn --new` learns sided ones".into()));
        }
        Ok(self.learning.begin((at, new)))
    }

    /// The options of the rules, with the texts of the editor.
    fn edited_rules(&self) -> RulesOptions {
        let edits = self.state().edits.clone();
        self.rules.clone().buffers(tuning::buffers(&edits))
    }

    fn learn_now(&self, at: usize, new: &Declaration) -> Result<Value, Error> {
        let options = self.edited_rules();
        let digest = options.clone().for_log(self.loaded(at)?.log())?.digest();
        let (mut numbers, mut recordings, mut unlabeled) = (Vec::new(), Vec::new(), 0);
        for number in 0..self.recordings.len() {
            // The list has the error of a recording that cannot be analyzed.
            let Ok(loaded) = self.loaded(number) else { continue };
            if !options.clone().for_log(loaded.log()).is_ok_and(|rules| rules.digest() == digest) {
                continue;
            }
            let opened = loaded.log().opened()?;
            let table = labels::read_table(opened, &loaded.folders.beside).map_err(argument)?;
            let tracks = match &table {
                Some((_, table)) => marks(&truth(table, loaded.only())?, new),
                None => Vec::new(),
            };
            unlabeled += usize::from(tracks.is_empty());
            if !tracks.is_empty() || unlabeled <= UNLABELED {
                numbers.push(number);
                recordings.push(MarkedRecording { log: loaded.log().clone(), tracks });
            }
        }
        let rules = BaseRules::new(&options, recordings.iter().map(|one| &one.log), None)?;
        let learned = learn_primitive(new, &recordings, &rules, &|part| self.learning.set_part(part))?;
        let interval = |it: &FoundInterval| {
            let at = numbers.get(it.recording);
            json!({
                "at": at, "name": at.and_then(|at| self.recordings.get(*at)).map(|recording| &recording.name),
                "track": it.who, "start": it.time_s[0], "end": it.time_s[1], "state": it.state(), "agreement": it.agreement,
            })
        };
        let questions: Vec<Value> = learned.questions().into_iter().map(interval).collect();
        Ok(json!({
            "primitive": learned.name, "rules": learned.text, "summary": learned.summary()?,
            "proved": learned.extension.proof.is_proved(), "questions": questions,
        }))
    }

    /// Writes the rules that were learned beside those that they extend, or into the current folder beside shipped ones; returns the file.
    ///
    /// # Errors
    /// Nothing was learned; a name that is not that of a rule file, or is taken; a file that cannot be written.
    pub fn save_learned(&self, at: usize, asked: &SaveRequest) -> Result<PathBuf, Error> {
        let wrong = |message: &str| argument(InputError::new(&asked.file, message));
        let outcome = self.learning.outcome().unwrap_or_default();
        let text = outcome["rules"].as_str().ok_or_else(|| wrong("no rules were learned"))?;
        let file = Path::new(&asked.file);
        if outcome["proved"] != json!(true) {
            return Err(wrong(
                "the rules are not proved to only add to those that they extend, so they are not written",
            ));
        }
        let is_name = file.file_name() == Some(file.as_os_str()) && !asked.file.contains('\\');
        if !is_name || file.extension().is_none_or(|ending| ending != "rules") {
            return Err(wrong("expected the name of a rule file without a folder, such as `shake.rules`"));
        }
        let named = self.edited_rules().request_for(self.loaded(at)?.log()).files;
        let folder = named.iter().find(|file| file.exists()).and_then(|file| file.parent()).unwrap_or(Path::new(""));
        let path = folder.join(file);
        let _saving = self.saving.lock().unwrap_or_else(PoisonError::into_inner);
        if path.symlink_metadata().is_ok() {
            return Err(wrong("exists already; choose another name"));
        }
        let mut files = Files::default();
        files.add(&path, |out| out.write_all(text.as_bytes())).and_then(|()| files.commit()).map_err(argument)?;
        Ok(path)
    }
}

fn argument(error: InputError) -> Error {
    Error::new(error, ErrorKind::Argument)
}

/// The truth in the names of the labels, which no rules need to have.
fn truth(table: &Labels, only: Option<TrackId>) -> Result<Truth, Error> {
    let names = |kind: LabelKind| {
        let of_kind = table.intervals.iter().filter(move |interval| interval.kind == kind);
        of_kind.map(|interval| interval.name.clone()).collect()
    };
    let known =
        KnownNames { primitives: names(LabelKind::Primitive), tasks: names(LabelKind::Task), ..KnownNames::default() };
    Truth::of_labels(table, only, &NameMap::default(), &known).map_err(argument)
}
