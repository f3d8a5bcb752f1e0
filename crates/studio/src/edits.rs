//! Rule files in the editor of the page: their texts, what is wrong with them, and the rules with texts that are not written yet.
//!
//! The texts belong to the studio, as params do: every window shows the same ones. A change names the version that it was made to, and is refused if the studio
//! has another version. Texts with errors stay in the page; analyses use the last texts without errors.

use super::project::Studio;
use super::tuning;
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use teachtree_base::diagnostic::{Diagnostic, Severity, Source};
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_language::{MAX_BYTES, Request};
use teachtree_logs::read::text;
use teachtree_lsp::LanguageService;
use teachtree_report::page;
use teachtree_session::{AnalysisInternals, ErrorInternals, RulesOptionsInternals};
use teachtree_session::{Error, Log};

/// Texts as a page sends them, by the name of the file.
#[derive(Deserialize)]
pub struct EditedTexts {
    /// The version that was changed.
    version: u64,
    /// The texts that differ from the files.
    files: BTreeMap<String, String>,
}

/// A place in a text.
#[derive(Deserialize)]
pub struct TextPosition {
    /// The texts that differ from the files.
    files: BTreeMap<String, String>,
    /// The file.
    file: String,
    /// The line, from 0.
    line: u32,
    /// The column, from 0, in units of UTF-16.
    character: u32,
}

fn argument(error: InputError) -> Error {
    Error::new(error, ErrorKind::Argument)
}

impl Studio {
    fn request(&self, log: &Log, texts: &BTreeMap<String, String>) -> Request {
        let request = self.rules.clone().buffers(tuning::buffers(texts)).request_for(log);
        Request { needs_tree: true, ..request }
    }

    fn service(&self, at: usize, texts: &BTreeMap<String, String>) -> Result<LanguageService, Error> {
        let loaded = self.loaded(at)?;
        let service = LanguageService::new(&self.request(loaded.log(), texts));
        let mut state = self.state();
        if loaded.epoch == state.epoch {
            let read = |source: &&Source| !texts.contains_key(&source.name);
            state.remember(service.sources().files.iter().filter(read));
        }
        drop(state);
        Ok(service)
    }

    /// The files that a service reads and those with an edit: their texts as they are in the files and as they are now.
    fn files(&self, service: &LanguageService, edits: &BTreeMap<String, String>) -> Vec<Value> {
        let state = self.state();
        let read = service.sources().files.iter().map(|source| &source.name);
        // A file that is no longer used keeps its text.
        let left = edits.keys().filter(|name| !read.clone().any(|known| known == *name));
        let files = read.clone().chain(left).filter_map(|name| {
            let base = state.texts.get(name)?;
            let is_own = text::read(Path::new(name), MAX_BYTES).is_ok();
            Some(json!({ "name": name, "base": base, "text": edits.get(name).unwrap_or(base), "own": is_own }))
        });
        files.collect()
    }

    /// The rule files of a recording: their texts as they are in the files and as they are now, and what is wrong with them.
    ///
    /// # Errors
    /// A recording or rules that cannot be read.
    pub fn texts(&self, at: usize) -> Result<Value, Error> {
        let (version, edits) = {
            let state = self.state();
            (state.edit_version, state.edits.clone())
        };
        let service = self.service(at, &edits)?;
        Ok(json!({ "version": version, "files": self.files(&service, &edits), "findings": findings(&service) }))
    }

    /// Looks at texts and, where they have no error, runs them over a recording at once and over the others in the background. An answer with `error` has the
    /// texts that another window has in the place of version `version`.
    ///
    /// # Errors
    /// Texts of files that are none of the rules, or cannot be written; a recording that cannot be read.
    pub fn edit(&self, at: usize, sent: EditedTexts) -> Result<Value, Error> {
        let loaded = self.loaded(at)?;
        let (version, before, params, base) = {
            let state = self.state();
            (state.edit_version, state.edits.clone(), state.params.clone(), state.texts.clone())
        };
        let mut texts = BTreeMap::new();
        for (name, text) in sent.files {
            let Some(was) = base.get(&name) else {
                return Err(argument(InputError::new(name, "is not a file of the rules")));
            };
            if text.len() as u64 > MAX_BYTES {
                let message = format!("found a text of {} bytes, at most {MAX_BYTES} are read", text.len());
                return Err(argument(InputError::new(name, message)));
            }
            // A page knows one kind of line end only.
            let text = text.replace("\r\n", "\n");
            let text = if was.contains("\r\n") { text.replace('\n', "\r\n") } else { text };
            if text == *was {
                continue;
            }
            if !Path::new(&name).is_file() {
                let error = InputError::new(&name, "comes with the program and cannot be changed");
                return Err(argument(error.help("`teachtree show NAME > NAME` makes a copy of your own")));
            }
            texts.insert(name, text);
        }
        if version != sent.version {
            return Ok(
                json!({ "error": "another window has changed these rules", "version": version, "files": before }),
            );
        }
        let service = self.service(at, &texts)?;
        // The page has those of the rule files as they are.
        let is_new = |file: &Value| !loaded.base.sources().files.iter().any(|source| file["name"] == source.name);
        let more: Vec<Value> = self.files(&service, &texts).into_iter().filter(is_new).collect();
        let mut answer =
            json!({ "version": version, "more": more, "findings": findings(&service), "sound": service.is_sound() });
        if !service.is_sound() {
            return Ok(answer);
        }
        if texts != before {
            self.renew(|state| {
                state.edits = texts;
                state.edit_version += 1;
            });
        }
        let refreshed = self.refresh_running(at);
        let refused = match &refreshed {
            Ok(_) => None,
            Err(error) => Some(error.to_string()),
        };
        if refused.is_some() {
            // Rules that do not run over this recording: those of before stay.
            self.renew(|state| {
                state.edits = before;
                state.params = params;
            });
            self.refresh(at)?;
        }
        let version = self.state().edit_version;
        let Some(fields) = answer.as_object_mut() else { return Ok(answer) };
        fields.insert("version".into(), json!(version));
        fields.insert("refused".into(), json!(refused));
        if let Ok(now) = refreshed {
            fields.insert("lanes".into(), page::tracks(now.now.shown.found()));
            fields.insert("params".into(), tuning::params(now.now.set()));
        }
        Ok(answer)
    }

    /// What is known of a place in a text, as Markdown; `null` where nothing is.
    ///
    /// # Errors
    /// A recording that cannot be read.
    pub fn hover(&self, at: usize, place: &TextPosition) -> Result<Value, Error> {
        let service = self.service(at, &place.files)?;
        Ok(json!({ "text": service.hover(&place.file, place.line, place.character) }))
    }

    /// What may be written at a place.
    ///
    /// # Errors
    /// A recording that cannot be read.
    pub fn proposals(&self, at: usize, place: &TextPosition) -> Result<Value, Error> {
        let service = self.service(at, &place.files)?;
        Ok(json!({ "proposals": service.proposals(&place.file, place.line, place.character) }))
    }
}

/// Errors, then warnings, each with its file and place: line and column from 1, columns in characters.
fn findings(service: &LanguageService) -> Value {
    let one = |found: &Diagnostic| {
        let first = found.labels.first();
        let file = first.and_then(|label| service.sources().files.get(label.span.file as usize));
        let place = first.map(|label| service.place(label.span));
        json!({
            "code": found.code, "severity": found.severity, "message": found.message,
            "file": file.map(|file| &file.name), "line": place.map(|place| place.0.0), "column": place.map(|place| place.0.1),
            "about": first.map(|label| &label.text), "notes": found.notes, "help": found.help,
        })
    };
    let of = |severity| service.findings().iter().filter(move |found| found.severity == severity).map(one);
    of(Severity::Error).chain(of(Severity::Warning)).collect()
}
