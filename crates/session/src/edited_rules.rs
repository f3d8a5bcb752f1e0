//! Rules with another text of one of their files, run over logs in memory: what `learn --from` tries.

use super::log::Log;
use super::run::{Run, channels};
use crate::LogInternals;
use rayon::prelude::*;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use teachtree_analysis::{self as analysis, Analysis};
use teachtree_base::channels::ChannelSpec;
use teachtree_base::diagnostic::Severity;
use teachtree_frames::frames::Frames;
use teachtree_language::graph::lower;
use teachtree_language::{self as language, Request};

/// Lists of channels whose frames are kept, at most; most texts read the channels of another one.
const KEPT: usize = 6;

/// The frames of all logs with some channels.
type FramesOfLogs = (Vec<ChannelSpec>, Vec<Arc<Frames>>);

/// Runs texts of a file over some logs.
pub struct EditedRules<'a> {
    logs: Vec<&'a Log>,
    request: Request,
    file: PathBuf,
    kept: Mutex<Vec<FramesOfLogs>>,
}

impl<'a> EditedRules<'a> {
    /// The rules that a request loads with texts for a file, which is named by its canonical path.
    pub const fn new(logs: Vec<&'a Log>, request: Request, file: PathBuf) -> Self {
        Self { logs, request, file, kept: Mutex::new(Vec::new()) }
    }

    /// What the rules find in each log with a text of the file; `None` if there is an error in them, or they cannot run.
    pub fn analyses(&self, text: &str) -> Option<Vec<Analysis>> {
        let mut request = self.request.clone();
        request.buffers.insert(self.file.clone(), text.to_string());
        let loaded = language::load(&request);
        let is_wrong = loaded.diagnostics.iter().any(|found| found.severity == Severity::Error);
        let rules = loaded.rules.filter(|_| !is_wrong)?;
        let graph = lower(&rules);
        let frames = self.frames(channels(&rules))?;
        let analyzed = |frames: &Arc<Frames>| {
            let run = Run::over(&rules, &graph, Arc::clone(frames)).ok()?;
            Some(analysis::analyze(&rules, &run.frames, &run.leaves))
        };
        frames.par_iter().map(analyzed).collect()
    }

    fn frames(&self, channels: Vec<ChannelSpec>) -> Option<Vec<Arc<Frames>>> {
        let known = |kept: &[FramesOfLogs]| kept.iter().find(|it| it.0 == channels).map(|it| it.1.clone());
        if let Some(frames) = known(&self.kept.lock().ok()?) {
            return Some(frames);
        }
        let derived = |log: &&Log| log.opened().ok()?.frames(&channels).ok().map(Arc::new);
        let frames: Vec<Arc<Frames>> = self.logs.iter().map(derived).collect::<Option<_>>()?;
        let mut kept = self.kept.lock().ok()?;
        if known(&kept).is_none() {
            if kept.len() == KEPT {
                kept.remove(0);
            }
            kept.push((channels, frames.clone()));
        }
        Some(frames)
    }
}
