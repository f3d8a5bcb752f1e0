//! The background queue: analyzes every recording by the current rules, then the stability of each task.

use super::project::{State, Studio};
use std::num::NonZero;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, PoisonError};
use teachtree_session::AnalysisInternals;

/// The most threads that work in the background.
const MAX_THREADS: usize = 4;

/// Something to be done with a recording.
#[derive(Clone, Copy)]
enum Job {
    Analyze(usize),
    Stability(usize),
}

impl Studio {
    /// Starts the threads that fill in the list; one processor is left for the page.
    pub fn work(self: &Arc<Self>) {
        let threads =
            std::thread::available_parallelism().map_or(1, NonZero::get).saturating_sub(1).clamp(1, MAX_THREADS);
        self.wait_for_fits();
        self.wait_for_learning();
        for _ in 0..threads {
            let studio = Arc::clone(self);
            std::thread::spawn(move || {
                loop {
                    let job = studio.next_job();
                    // A panic is a bug; the other recordings are analyzed nevertheless.
                    let done = catch_unwind(AssertUnwindSafe(|| studio.run(job)));
                    studio.finish(job, done.is_ok());
                }
            });
        }
    }

    fn next_job(&self) -> Job {
        let mut state = self.state();
        loop {
            if let Some(job) = job(&state) {
                state.claimed.insert(at(job));
                return job;
            }
            state = self.wake.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn run(&self, job: Job) {
        match job {
            // What went wrong is in the row.
            Job::Analyze(at) => _ = self.refresh(at),
            Job::Stability(at) => {
                let least =
                    self.loaded(at).and_then(|loaded| loaded.base.runs()?.clone().with_confidence()).map(|analysis| {
                        let shares =
                            analysis.found().tracks.iter().flat_map(|track| &track.tasks).filter_map(|it| it.stability);
                        shares.reduce(f64::min)
                    });
                let mut state = self.state();
                if let Some(row) = state.rows.get_mut(at) {
                    row.stability = Some(least.unwrap_or_default());
                }
                state.revision += 1;
            }
        }
    }

    fn finish(&self, job: Job, is_done: bool) {
        let mut state = self.state();
        let generation = state.generation;
        state.claimed.remove(&at(job));
        if let Some(row) = state.rows.get_mut(at(job)).filter(|_| !is_done) {
            row.generation = Some(generation);
            row.outcome = Some(Err("the analysis failed: this is a bug".into()));
            row.stability = Some(None);
            state.revision += 1;
        }
        drop(state);
        self.wake.notify_all();
    }
}

fn at(job: Job) -> usize {
    match job {
        Job::Analyze(at) | Job::Stability(at) => at,
    }
}

fn job(state: &State) -> Option<Job> {
    let free = || state.rows.iter().enumerate().filter(|(at, _)| !state.claimed.contains(at));
    let old = free().find(|(_, row)| row.generation != Some(state.generation));
    // While params are turned, how sure the tasks are would be of rules that are gone in a moment.
    let unknown = || free().find(|(_, row)| row.stability.is_none()).filter(|_| state.params.is_empty());
    old.map(|(at, _)| Job::Analyze(at)).or_else(|| unknown().map(|(at, _)| Job::Stability(at)))
}
