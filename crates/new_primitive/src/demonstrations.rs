//! The shipped demonstrations as recordings of other tasks: three recordings of one task do not show where else a condition holds.

use super::{BaseRules, mismatch};
use rayon::prelude::*;
use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_base::recording::Recording;
use teachtree_base::scene::Scene;
use teachtree_frames::OpenRequest;
use teachtree_logs::read::csv;
use teachtree_session::{Error, Log, LogInternals};
use teachtree_world::{self as world, shipped};

/// The seed of the first operator. Each further one has the next seed, so that another person shows each task: the same seed is the same person, who may be
/// faster or calmer than most.
const FIRST_SEED: u64 = 1;
/// Every fifth row is kept: 200 Hz.
const STRIDE: usize = 5;

/// A recording of each shipped demonstration that measures what the rules read.
///
/// # Errors
/// Rules with errors; a demonstration that cannot be simulated.
pub(super) fn demonstrations(rules: &BaseRules) -> Result<Vec<Log>, Error> {
    let channels = rules.load("")?.channels;
    let task = |(seed, name)| Ok(Task { name, scene: shipped::scene(name)?, seed });
    let tasks: Vec<Task> =
        (FIRST_SEED..).zip(shipped::names()).map(task).collect::<Result<_, InputError>>().map_err(mismatch)?;
    let mut all = Vec::new();
    // Rules may read both hands by their names. One recording that lacks a channel stands for all with as many hands.
    for hands in [1, 2] {
        let mut tasks = tasks.iter().filter(|task| task.scene.hands.len() == hands);
        let Some(first) = tasks.next().map(Task::recorded).transpose()? else { continue };
        if first.opened()?.frames(&channels).is_err() {
            continue;
        }
        all.push(first);
        let others: Vec<&Task> = tasks.collect();
        let others: Vec<Log> = others.into_par_iter().map(Task::recorded).collect::<Result<_, Error>>()?;
        all.extend(others);
    }
    Ok(all)
}

/// A shipped task and the seed of the person who shows it.
struct Task {
    name: &'static str,
    scene: Scene,
    seed: u64,
}

impl Task {
    fn recorded(&self) -> Result<Log, Error> {
        let Self { name, scene, seed } = self;
        let taught = shipped::operator(name).and_then(|operator| world::teach(scene, &operator, *seed));
        let recording = thinned(taught.map_err(mismatch)?);
        let path = format!("{name} (shipped, seed {seed})");
        let path = Path::new(&path);
        let request = OpenRequest { log: path.to_path_buf(), ..OpenRequest::default() };
        Log::open_source(csv::source(&recording, path).map_err(mismatch)?, &request)
    }
}

fn thinned(mut recording: Recording) -> Recording {
    fn kept<T: Clone>(all: &[T]) -> Vec<T> {
        all.iter().step_by(STRIDE).cloned().collect()
    }
    recording.time = kept(&recording.time);
    recording.columns.values_mut().for_each(|column| column.values = kept(&column.values));
    recording.labels.values_mut().for_each(|texts| *texts = kept(texts));
    recording
}
