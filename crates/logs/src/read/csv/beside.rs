//! The names of the files beside a log that belong to it.

use std::path::{Path, PathBuf};

/// The files that may stand beside a log: `demonstration.scene.yaml`, `demonstration.csv.scene.yaml`.
pub fn beside(log: &Path, ending: &str) -> [PathBuf; 2] {
    let mut whole = log.as_os_str().to_owned();
    whole.push(format!(".{ending}"));
    [log.with_extension(ending), PathBuf::from(whole)]
}
