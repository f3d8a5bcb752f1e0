//! Bad samples in a demonstration, and what is reported of them.

use std::path::Path;
use teachtree_base::recording::Recording;
use teachtree_frames::OpenRequest;
use teachtree_frames::open;
use teachtree_logs::issue::Issue;
use teachtree_logs::read::formats;
use teachtree_world::{shipped, teach};

pub type Change<'a> = &'a dyn Fn(&mut Recording);

pub fn taught() -> Recording {
    teach(&shipped::scene("pick_and_place").unwrap(), &shipped::operator("pick_and_place").unwrap(), 1).unwrap()
}

pub fn set(log: &mut Recording, column: &str, row: usize, value: f64) {
    log.columns[column].values[row] = value;
}

pub fn add(log: &mut Recording, column: &str, row: usize, value: f64) {
    log.columns[column].values[row] += value;
}

/// Every n-th row of a recording.
pub fn slower(log: &mut Recording, every: usize) {
    log.time = log.time.iter().copied().step_by(every).collect();
    log.columns.values_mut().for_each(|column| column.values = column.values.iter().copied().step_by(every).collect());
    log.labels.values_mut().for_each(|texts| *texts = texts.iter().cloned().step_by(every).collect());
}

/// What is reported of the jumps of a log that is written and opened.
pub fn jumps(folder: &Path, recording: &Recording) -> Vec<Issue> {
    let log = folder.join("log.csv");
    formats::write(recording, &log).unwrap();
    let opened = open(&OpenRequest { log, ..OpenRequest::default() }).unwrap();
    opened.issues.into_iter().filter(|issue| issue.kind == "impossible_jump").collect()
}
