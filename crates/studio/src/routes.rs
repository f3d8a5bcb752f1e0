//! Addresses in, answers out. Files of the page are in the program; no address leads to a file by its path.

use super::edits::{EditedTexts, TextPosition};
use super::labels::{Labels, SaveError, SentLabels};
use super::learning::{LearnRequest, SaveRequest};
use super::loaded_recording::LoadedRecording;
use super::project::Studio;
use super::video::videos;
use super::{export, rule_comparison, tuning};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::Arc;
use teachtree_analysis::UNKNOWN;
use teachtree_analysis::score::KnownNames;
use teachtree_base::hands::TrackId;
use teachtree_report::page;
use teachtree_serve::{Content, Page, Request, Response};
use teachtree_session::{AnalysisInternals, ErrorInternals, LogInternals, RulesInternals};
use teachtree_session::{Error, Question};

/// The page, with the place of a recording in it.
const INDEX: &str = include_str!("page/index.html");
/// What the scripts of the report hand out when they are one module.
const EXPORTS: &str = "\nconst view = { get data() { return data; }, get step() { return step; }, get playing() { return state.playing; } };\n\
     export { added, draw, drawPanel, escaped, fitting, GUTTER, lanes, load, nameOf, panels, plotWidth, readOut, seconds, setTime, show, \
     showTracks, signals, state, view };\n";
/// The modules of the page, by name.
const MODULES: [(&str, &str); 13] = [
    ("studio.js", include_str!("page/studio.js")),
    ("server.js", include_str!("page/server.js")),
    ("list.js", include_str!("page/list.js")),
    ("recording.js", include_str!("page/recording.js")),
    ("lines.js", include_str!("page/lines.js")),
    ("against.js", include_str!("page/against.js")),
    ("editor.js", include_str!("page/editor.js")),
    ("fit.js", include_str!("page/fit.js")),
    ("labels.js", include_str!("page/labels.js")),
    ("learning.js", include_str!("page/learning.js")),
    ("tune.js", include_str!("page/tune.js")),
    ("ask.js", include_str!("page/ask.js")),
    ("video.js", include_str!("page/video.js")),
];

impl Page for Studio {
    const COMMAND: &'static str = "studio";

    fn answer(&self, request: &Request, path: &str, changes: bool) -> Response {
        answer(request, path, changes, self)
    }
}

fn answer(request: &Request, path: &str, changes: bool, studio: &Studio) -> Response {
    let text = |kind, text: String| Response { status: 200, kind, content: Content::Bytes(text.into_bytes()) };
    let parts: Vec<&str> = path.split('/').collect();
    if !changes && let [name] = parts.as_slice() {
        let module = MODULES.iter().find(|(known, _)| known == name);
        match (*name, module) {
            ("", _) => return text("text/html; charset=utf-8", index()),
            ("style.css", _) => {
                return text(
                    "text/css; charset=utf-8",
                    format!("{}\n{}", page::STYLE, include_str!("page/studio.css")),
                );
            }
            // The scripts of the report as one module.
            ("bench.js", _) => return text("text/javascript; charset=utf-8", page::SCRIPTS.concat() + EXPORTS),
            (_, Some((_, module))) => return text("text/javascript; charset=utf-8", (*module).into()),
            _ => {}
        }
    }
    let (what, at) = match parts.as_slice() {
        ["api", "list"] if !changes => return list(request, studio),
        ["api", "rules"] if changes => {
            studio.reload();
            return Response::json(&json!({}));
        }
        ["api", "fit"] if !changes => return Response::json(&studio.fitting.status()),
        ["api", "fit", "stop"] if changes => return Response::json(&studio.fitting.stop()),
        ["api", "learn"] if !changes => return Response::json(&studio.learning.status()),
        ["api", "recording", at, what @ ..] => (what, number(at, studio)),
        ["video", at, place] if !changes => return video(at, place, studio),
        _ => return not_found(),
    };
    let Some(at) = at else { return not_found() };
    match (changes, what) {
        (false, []) => respond(studio.refresh(at).and_then(|loaded| recording(at, &loaded, studio))),
        (false, ["labels"]) => respond(studio.labels(at).map(|labels| labels_json(&labels))),
        (true, ["labels"]) => body(request, |sent: SentLabels| match studio.save_labels(at, sent)? {
            Ok(labels) => Ok(Response::json(&labels_json(&labels))),
            Err(SaveError::Conflict(labels)) => {
                let mut refused = labels_json(&labels);
                if let Some(fields) = refused.as_object_mut() {
                    fields.insert("error".into(), "another window or program has changed these labels".into());
                }
                Ok(Response { status: 409, ..Response::json(&refused) })
            }
            Err(SaveError::Failed(error)) => Ok(Response::refused(422, &error.to_string())),
        }),
        (true, ["params"]) => body(request, |values: BTreeMap<String, f64>| {
            let loaded = studio.turn(at, &values)?;
            Ok(Response::json(&page::tracks(loaded.now.shown.found())))
        }),
        (true, ["fit"]) => Response::json(&studio.fitting.begin(at)),
        (true, ["learn"]) => {
            body(request, |asked: LearnRequest| Ok(Response::json(&studio.begin_learning(at, &asked)?)))
        }
        (true, ["learn", "save"]) => body(request, |asked: SaveRequest| {
            let file = studio.save_learned(at, &asked)?;
            Ok(Response::json(&json!({ "file": file.display().to_string() })))
        }),
        (false, ["rules"]) => respond(studio.texts(at)),
        (true, ["rules"]) => body(request, |sent: EditedTexts| {
            let answer = studio.edit(at, sent)?;
            Ok(Response { status: if answer.get("error").is_some() { 409 } else { 200 }, ..Response::json(&answer) })
        }),
        (true, ["rules", "hover"]) => {
            body(request, |asked: TextPosition| Ok(Response::json(&studio.hover(at, &asked)?)))
        }
        (true, ["rules", "complete"]) => {
            body(request, |asked: TextPosition| Ok(Response::json(&studio.proposals(at, &asked)?)))
        }
        (true, ["params", "save"]) => respond(studio.save_params(at).map(|files| json!({ "files": files }))),
        (true, ["export", form @ ("elan" | "lerobot")]) => body(request, |asked: ExportRequest| {
            let written = match *form {
                "elan" => export::elan(&*studio.loaded(at)?, asked.replace),
                _ => export::lerobot(studio, at, asked.replace),
            };
            match written {
                Ok(path) => Ok(Response::json(&json!({ "file": path.display().to_string() }))),
                Err(export::ExportError::FileExists(path)) => {
                    Ok(Response::refused(409, &format!("{} exists already", path.display())))
                }
                Err(export::ExportError::Failed(error)) => Err(error),
            }
        }),
        (false, ["explain"]) => explained(request, at, studio),
        _ => not_found(),
    }
}

/// What a page says with an export.
#[derive(Deserialize)]
struct ExportRequest {
    /// Whether a file that is there may be replaced.
    #[serde(default)]
    replace: bool,
}

fn labels_json(labels: &Labels) -> Value {
    json!({ "version": labels.version, "lines": labels.lines })
}

/// Answers a request with a body in JSON.
fn body<T: DeserializeOwned>(request: &Request, answer: impl FnOnce(T) -> Result<Response, Error>) -> Response {
    match serde_json::from_slice(&request.body) {
        Ok(sent) => answer(sent).unwrap_or_else(|error| Response::refused(422, &error.to_string())),
        Err(error) => Response::refused(400, &format!("invalid body: {error}")),
    }
}

/// A video, of which a part may be asked for.
fn video(at: &str, place: &str, studio: &Studio) -> Response {
    let found = number(at, studio).zip(place.parse::<usize>().ok()).and_then(|(at, place)| {
        let loaded = studio.loaded(at).ok()?;
        videos(loaded.log(), &loaded.folders).ok()?.into_iter().nth(place)
    });
    let Some(video) = found else { return not_found() };
    match video.open() {
        Ok(file) => Response { status: 200, kind: video.kind(), content: Content::File(file) },
        Err(error) => Response::refused(422, &error.to_string()),
    }
}

/// Why a track has its label at a time, and why not another one, as `teachtree explain` writes it.
fn explained(request: &Request, at: usize, studio: &Studio) -> Response {
    let Some(time) = request.query_value("t").and_then(|time| time.parse::<f64>().ok()).filter(|time| time.is_finite())
    else {
        return Response::refused(400, "expected a time after `t=`");
    };
    let question = Question::at(time);
    let question =
        request.query_value("track").and_then(TrackId::from_name).into_iter().fold(question, Question::track);
    let question =
        request.query_value("why_not").filter(|name| !name.is_empty()).into_iter().fold(question, Question::why_not);
    respond(
        studio.loaded(at).and_then(|loaded| Ok(json!({ "text": loaded.now.runs()?.explain(&question)?.to_string() }))),
    )
}

/// The page, with the place of a recording in it and, above its replay, that of videos; its keys stand with those of the report.
fn index() -> String {
    let bench = page::PLACE.replace("<div id=\"side\">", "<div id=\"side\">\n<div id=\"videos\" hidden></div>");
    let bench = bench.replace("</p>\n</details>", &format!("</p>\n{}</details>", include_str!("page/keys.html")));
    INDEX.replace("<!--bench-->", &bench)
}

fn not_found() -> Response {
    Response::refused(404, "there is nothing at this address")
}

fn number(text: &str, studio: &Studio) -> Option<usize> {
    text.parse().ok().filter(|at| *at < studio.recordings.len())
}

fn respond(answer: Result<Value, Error>) -> Response {
    answer.map_or_else(|error| Response::refused(422, &error.to_string()), |value| Response::json(&value))
}

/// The list; only its number where the page has it.
fn list(request: &Request, studio: &Studio) -> Response {
    let revision = studio.state().revision;
    if request.query_value("since").and_then(|since| since.parse().ok()) == Some(revision) {
        return Response::json(&json!({ "revision": revision }));
    }
    Response::json(&studio.list())
}

/// All that the page shows of a recording.
fn recording(at: usize, loaded: &Arc<LoadedRecording>, studio: &Studio) -> Result<Value, Error> {
    let analysis = &loaded.now.shown;
    let recording = &analysis.log().opened()?.recording;
    let mismatch = |error| Error::new(error, teachtree_base::error::ErrorKind::Mismatch);
    let data = page::data(&analysis.explained()?, recording, analysis.meta()).map_err(mismatch)?;
    let failed = loaded.now.runs().err().map(|error| error.to_string());
    // Rules that do not run have no params to be turned.
    let params = loaded.now.runs().map_or_else(|_| json!([]), |analysis| tuning::params(analysis.rules().set()));
    let files: Vec<&str> = loaded.now.sources().files.iter().map(|source| source.name.as_str()).collect();
    let name = studio.recordings.get(at).map(|recording| &recording.name);
    let known = KnownNames::new(loaded.now.set());
    let tasks: Vec<&str> = known.tasks.iter().map(String::as_str).chain([UNKNOWN]).collect();
    // What is wrong with labels or videos does not keep the recording from being shown.
    let (labels, label_error) = match studio.labels(at) {
        Ok(labels) => (labels_json(&labels), None),
        Err(error) => (Value::Null, Some(error.to_string())),
    };
    let against = rule_comparison::lanes(loaded.other.as_ref(), studio.against.as_ref().map(|(name, _)| name.as_str()));
    let found = videos(analysis.log(), &loaded.folders);
    let videos =
        found.unwrap_or_default().into_iter().map(|one| json!({ "camera": one.camera, "offset": one.offset_s }));
    Ok(json!({
        "name": name, "data": data, "rules": files, "failed": failed, "who": studio.who,
        "colors": page::colors_of(loaded.now.set()), "names": { "primitive": known.primitives, "task": tasks }, "labels": labels, "label_error": label_error,
        "params": params, "videos": videos.collect::<Vec<_>>(), "against": against,
    }))
}
