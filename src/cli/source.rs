//! How a log is read: the options that commands on logs have in common.

use crate::stream::OpenRequest;
use std::path::{Path, PathBuf};

/// Options that say how a log is read.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct SourceArgs {
    /// How the columns of foreign logs become channels
    #[arg(long, value_name = "FILE")]
    pub binding: Option<PathBuf>,
    /// A scene instead of the one that each log carries
    #[arg(long, value_name = "FILE")]
    pub scene: Option<PathBuf>,
}

impl SourceArgs {
    /// What to open.
    pub fn request(&self, log: &Path) -> OpenRequest {
        OpenRequest { log: log.into(), binding: self.binding.clone(), scene: self.scene.clone() }
    }
}
