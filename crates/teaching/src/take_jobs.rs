//! Writes recordings as `teach` does, analyzes them, and runs the robot on them, each in its own thread.

use super::shared_state::{Teaching, lock};
use super::takes::{RobotJob, Take};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use teachtree_logs::read::formats;
use teachtree_session::Log;
use teachtree_world::RawRecording;

/// Maximum number of recordings of one run.
const MOST_TAKES: usize = 1000;
/// Maximum number of file names that are tried for a recording.
const MOST_NAMES: usize = 10_000;

/// Returns the first free file name of `taught.csv`, `taught_2.csv`, …
fn free_path(out: &Path, takes: &[Take], inputs: &[PathBuf]) -> Option<PathBuf> {
    let stem = out.file_stem()?.to_string_lossy().into_owned();
    let names = (1..=MOST_NAMES).map(|number| {
        if number == 1 {
            return out.to_path_buf();
        }
        let ending = out.extension().map_or(String::new(), |ending| format!(".{}", ending.to_string_lossy()));
        out.with_file_name(format!("{stem}_{number}{ending}"))
    });
    let is_free = |path: &PathBuf| {
        let beside = ["scene.yaml", "events.csv"].map(|ending| path.with_extension(ending));
        let is_there = |path: &PathBuf| path.exists() || inputs.contains(path);
        !is_there(path) && !beside.iter().any(is_there) && takes.iter().all(|take| take.file != *path)
    };
    { names }.find(is_free)
}

/// Writes a recording and analyzes it.
pub(super) fn write(teaching: &Arc<Teaching>, taken: RawRecording) {
    let at = {
        let mut takes = lock(&teaching.takes);
        let (options, seconds) = (&teaching.options, taken.seconds());
        let free = || free_path(&options.out, &takes.list, &options.inputs);
        let Some(file) = (takes.list.len() < MOST_TAKES).then(free).flatten() else {
            let why =
                format!("not written: there are {MOST_TAKES} recordings or {MOST_NAMES} files of this name already");
            // Repeated errors are reported once.
            if takes.list.last().is_none_or(|last| last.trouble.as_ref() != Some(&why)) {
                let (file, trouble) = (options.out.clone(), Some(why));
                takes.list.push(Take { file, seconds, tasks: Vec::new(), trouble, is_written: false });
                takes.version += 1;
            }
            return;
        };
        takes.list.push(Take { file, seconds, tasks: Vec::new(), trouble: None, is_written: false });
        takes.writing += 1;
        takes.version += 1;
        takes.list.len() - 1
    };
    let teaching = Arc::clone(teaching);
    std::thread::spawn(move || {
        let file = lock(&teaching.takes).list.get(at).map(|take| take.file.clone()).unwrap_or_default();
        let written = formats::write(&taken.recording(), &file).map_err(|error| error.to_string());
        let is_written = written.is_ok();
        let found = written.and_then(|()| analyzed(&teaching, &file));
        let mut takes = lock(&teaching.takes);
        takes.writing -= 1;
        takes.version += 1;
        if let Some(take) = takes.list.get_mut(at) {
            take.is_written = is_written;
            match found {
                Ok(tasks) => take.tasks = tasks,
                Err(why) => take.trouble = Some(why),
            }
        }
    });
}

/// Returns the tasks in the analysis of a file.
fn analyzed(teaching: &Teaching, file: &Path) -> Result<Vec<String>, String> {
    let analysis = Log::open(file).and_then(|log| teaching.options.rules.clone().for_log(&log)?.analyze(&log));
    let analysis = analysis.map_err(|error| error.to_string())?;
    Ok(analysis.tasks().iter().map(|task| task.to_string()).collect())
}

/// Runs the robot on a recording.
///
/// # Errors
/// No recording exists, or the robot is busy.
pub(super) fn perform(teaching: &Arc<Teaching>, take: Option<usize>) -> Result<(), String> {
    let (take, file) = {
        let mut takes = lock(&teaching.takes);
        if takes.robot.as_ref().is_some_and(|robot| robot.result.is_none()) {
            return Err("the robot is busy".into());
        }
        let take = take.unwrap_or_else(|| takes.list.len().saturating_sub(1));
        let written = takes.list.get(take).filter(|take| take.is_written).map(|take| take.file.clone());
        let Some(file) = written else { return Err("there is no recording: press Record, then Stop".into()) };
        takes.robot = Some(RobotJob { take, part: 0.0, result: None });
        takes.version += 1;
        (take, file)
    };
    let teaching = Arc::clone(teaching);
    std::thread::spawn(move || {
        let mut progress = |part: f64| {
            let mut takes = lock(&teaching.takes);
            takes.version += 1;
            if let Some(robot) = &mut takes.robot {
                robot.part = part;
            }
        };
        let result = (teaching.options.perform)(&file, &mut progress);
        let mut takes = lock(&teaching.takes);
        takes.version += 1;
        takes.robot = Some(RobotJob { take, part: 1.0, result: Some(result) });
    });
    Ok(())
}
