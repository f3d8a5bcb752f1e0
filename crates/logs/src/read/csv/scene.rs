//! The scene of a log: read from the file beside it or from one that is named, and checked.

use super::beside;
use crate::allowed_folders::AllowedFolders;
use crate::names;
use crate::read::text;
use std::fs::File;
use std::path::{Path, PathBuf};
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_base::file_kind::FileKind;
use teachtree_base::scene::Scene;
use teachtree_base::short_number::ShortNumber;
use teachtree_base::yaml;

/// Reads the scene that a log carries, from a file in `folders`.
///
/// # Errors
/// No scene file is beside the log, it is outside of the folders, or it is invalid.
pub fn scene_beside(log: &Path, folders: &AllowedFolders) -> Result<Scene, InputError> {
    if let Some(file) = scene_file_beside(log) {
        return scene_of(folders.open(&file), &file);
    }
    let help = "name the scene with --scene, or a binding with --binding";
    if log == Path::new("-") {
        return Err(InputError::new("standard input", "carries no scene").help(help).or_kind(ErrorKind::Scene));
    }
    let mut wanted = beside(log, "scene.yaml").map(|file| format!("`{}`", file.display())).to_vec();
    wanted.dedup();
    let message = format!("the log has no scene beside it, expected {}", wanted.join(" or "));
    Err(InputError::new(log.display().to_string(), message).help(help).or_kind(ErrorKind::Scene))
}

/// Returns the scene file beside a log, if there is one. It may be a pipe or a link that leads nowhere, which reading it refuses by name.
pub fn scene_file_beside(log: &Path) -> Option<PathBuf> {
    beside(log, "scene.yaml").into_iter().find(|file| file.symlink_metadata().is_ok())
}

/// Reads a scene file.
///
/// # Errors
/// When it cannot be read, or says something that a scene cannot mean, at `file:line:column`.
pub fn read_scene(path: &Path) -> Result<Scene, InputError> {
    let parse = |text: String| parse_scene(&text, &path.display().to_string());
    text::parsed(path, MAX_BYTES, FileKind::Scene, parse).map_err(|error| error.or_kind(ErrorKind::Scene))
}

const MAX_BYTES: u64 = yaml::MAX_BYTES as u64;

/// Reads the scene in an open file. `path` is its name in messages.
fn scene_of(file: Result<File, InputError>, path: &Path) -> Result<Scene, InputError> {
    let read = || parse_scene(&text::whole(&file?, path, MAX_BYTES)?, &path.display().to_string());
    read().map_err(|error| error.or_kind(ErrorKind::Scene))
}

/// Reads the text of a scene file; `name` is its name in messages.
///
/// # Errors
/// What a scene cannot mean, at `name:line:column`.
pub fn parse_scene(text: &str, name: &str) -> Result<Scene, InputError> {
    let scene: Scene = yaml::read(text, name)?;
    check_scene(&scene).map_err(|error| yaml::located(error, text, name))?;
    Ok(scene)
}

/// Maximum distance of a body's initial position from the origin, m.
const FARTHEST_M: f64 = 1e3;
/// Maximum number of bodies, since all pairs of them are compared.
const MAX_BODIES: usize = 256;
/// The most parts of a body.
const MAX_PARTS: usize = 256;

/// Returns the invalid values of a scene, at their keys, `bodies.cube.position`. [`yaml::located`] converts keys to a place in a file.
pub fn check_scene(scene: &Scene) -> Result<(), InputError> {
    if let Some(name) = scene.bodies.keys().find(|name| !names::is_body_name(name)) {
        return Err(InputError::new(
            "bodies",
            format!(
                "`{name}` cannot name a body: names have no blanks, commas or dots, and are not `left`, `right`, `both`, `contact`, `time`"
            ),
        ));
    }
    if scene.bodies.len() > MAX_BODIES {
        let message = format!("found {} bodies, expected at most {MAX_BODIES}", scene.bodies.len());
        return Err(InputError::new("bodies", message));
    }
    for (name, body) in &scene.bodies {
        if body.parts.len() > MAX_PARTS {
            let message = format!("found {} parts, expected at most {MAX_PARTS}", body.parts.len());
            return Err(InputError::new(format!("bodies.{name}.parts"), message));
        }
        for (index, part) in body.parts.iter().enumerate() {
            part.check().map_err(|message| InputError::new(format!("bodies.{name}.parts.{index}"), message))?;
        }
        if let Some(far) = body.position.iter().find(|length| length.0.abs() > FARTHEST_M) {
            let message = format!("found {} m, expected at most {FARTHEST_M} m", ShortNumber(far.0));
            return Err(InputError::new(format!("bodies.{name}.position"), message));
        }
        for (socket, spec) in &body.sockets {
            let unknown = spec.accepts.iter().flatten().find(|object| !scene.bodies.contains_key(*object));
            if let Some(unknown) = unknown {
                let message = format!("found `{unknown}`, expected the names of bodies of the scene");
                return Err(InputError::new(format!("bodies.{name}.sockets.{socket}.accepts"), message));
            }
        }
    }
    for (side, hand) in &scene.hands {
        let twice = hand.fingers.iter().enumerate().find(|(at, finger)| hand.fingers[..*at].contains(finger));
        if let Some((_, finger)) = twice {
            let message = format!("found {finger} twice, expected each finger once");
            return Err(InputError::new(format!("hands.{side}.fingers"), message));
        }
    }
    Ok(())
}
