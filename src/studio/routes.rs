//! Addresses in, answers out. Files of the page are in the program; no address leads to a file by its path.

use super::http::{Content, Request, Response};
use super::project::{Loaded, Studio};
use crate::report::page;
use crate::session::Error;
use serde_json::{Value, json};
use std::sync::Arc;

/// The page, with the place of a recording in it.
const INDEX: &str = include_str!("page/index.html");
/// What the scripts of the report hand out when they are one module.
const EXPORTS: &str = "\nconst view = { get data() { return data; }, get step() { return step; }, get playing() { return state.playing; } };\n\
     export { added, draw, drawPanel, escaped, fitting, GUTTER, lanes, load, nameOf, panels, plotWidth, readOut, seconds, setTime, show, \
     showTracks, signals, state, view };\n";
/// The modules of the page, by name.
const MODULES: [(&str, &str); 4] = [
    ("studio.js", include_str!("page/studio.js")),
    ("server.js", include_str!("page/server.js")),
    ("list.js", include_str!("page/list.js")),
    ("recording.js", include_str!("page/recording.js")),
];

/// Answers a request that may be made.
pub fn answer(request: &Request, path: &str, changes: bool, studio: &Studio) -> Response {
    let text = |kind, text: String| Response { status: 200, kind, content: Content::Bytes(text.into_bytes()) };
    let parts: Vec<&str> = path.split('/').collect();
    if !changes && let [name] = parts.as_slice() {
        let module = MODULES.iter().find(|(known, _)| known == name);
        match (*name, module) {
            ("", _) => return text("text/html; charset=utf-8", INDEX.replace("<!--bench-->", page::PLACE)),
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
    match (changes, parts.as_slice()) {
        (false, ["api", "list"]) => list(request, studio),
        (false, ["api", "recording", at]) => match number(at, studio) {
            Some(at) => answered(studio.refresh(at).and_then(|loaded| recording(at, &loaded, studio))),
            None => nothing(),
        },
        _ => nothing(),
    }
}

fn nothing() -> Response {
    Response::refused(404, "there is nothing at this address")
}

fn number(text: &str, studio: &Studio) -> Option<usize> {
    text.parse().ok().filter(|at| *at < studio.recordings.len())
}

fn answered(answer: Result<Value, Error>) -> Response {
    answer.map_or_else(|error| Response::refused(422, &error.to_string()), |value| Response::json(&value))
}

/// The list; only its number where the page has it.
fn list(request: &Request, studio: &Studio) -> Response {
    let revision = studio.state().revision;
    if request.asked("since").and_then(|since| since.parse().ok()) == Some(revision) {
        return Response::json(&json!({ "revision": revision }));
    }
    Response::json(&studio.list())
}

/// All that the page shows of a recording.
fn recording(at: usize, loaded: &Arc<Loaded>, studio: &Studio) -> Result<Value, Error> {
    let analysis = &loaded.now;
    let recording = &analysis.log().opened()?.recording;
    let mismatch = |error| Error::new(error, crate::base::error::ErrorKind::Mismatch);
    let data = page::data(&analysis.explained()?, recording, analysis.meta()).map_err(mismatch)?;
    let rules = analysis.rules();
    let name = studio.recordings.get(at).map(|recording| &recording.name);
    Ok(json!({ "name": name, "data": data, "rules": rules.files().collect::<Vec<_>>(), "digest": rules.digest() }))
}
