//! The settings of an editor: options of the command line, `initializationOptions`, and `workspace/didChangeConfiguration`.

use serde::Deserialize;
use serde_json::Value;
use std::path::{Path, PathBuf};
use teachtree_base::units;

/// The settings.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// The recording whose values are shown.
    pub log: Option<PathBuf>,
    /// The time in the recording, such as `2.5s`; by default its beginning.
    pub at: Option<String>,
    /// The binding of its columns.
    pub binding: Option<PathBuf>,
    /// A scene instead of the one that it carries.
    pub scene: Option<PathBuf>,
    /// The hand model that implements abstract signals.
    pub hand: Option<String>,
}

impl Settings {
    /// These settings with what a client sends laid over them, alone or under `teachtree`; its paths are relative to `folder`, and an empty
    /// text unsets. Errors say what is wrong with it.
    pub fn with(&self, sent: &Value, folder: Option<&Path>) -> Result<Self, String> {
        let sent = sent.get("teachtree").unwrap_or(sent);
        if sent.is_null() {
            return Ok(self.clone());
        }
        let more = Self::deserialize(sent).map_err(|error| format!("the settings of teachtree are wrong: {error}"))?;
        let place = |path: PathBuf| folder.map_or_else(|| path.clone(), |folder| folder.join(&path));
        let path = |new: Option<PathBuf>, old: &Option<PathBuf>| match new {
            Some(path) => Some(path).filter(|path| !path.as_os_str().is_empty()).map(place),
            None => old.clone(),
        };
        let text = |new: Option<String>, old: &Option<String>| match new {
            Some(text) => Some(text).filter(|text| !text.is_empty()),
            None => old.clone(),
        };
        let settings = Self {
            log: path(more.log, &self.log),
            at: text(more.at, &self.at),
            binding: path(more.binding, &self.binding),
            scene: path(more.scene, &self.scene),
            hand: text(more.hand, &self.hand),
        };
        settings.time_s()?;
        Ok(settings)
    }

    /// The time, s. Errors say what is wrong with it.
    pub fn time_s(&self) -> Result<Option<f64>, String> {
        self.at.as_deref().map(units::time).transpose()
    }
}
