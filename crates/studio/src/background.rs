//! Work in the background that the page begins, follows and stops.

use serde_json::{Value, json};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use teachtree_session::Error;

/// Work of one kind; one piece runs at a time.
pub struct Background<T> {
    state: Mutex<State<T>>,
    wake: Condvar,
}

struct State<T> {
    /// The work, until it begins.
    asked: Option<T>,
    running: bool,
    /// The share that is done, 0 to 1.
    part: f64,
    stopped: bool,
    /// The last outcome, as the page takes it.
    outcome: Option<Value>,
}

impl<T> Default for State<T> {
    fn default() -> Self {
        Self { asked: None, running: false, part: 0.0, stopped: false, outcome: None }
    }
}

impl<T> Default for Background<T> {
    fn default() -> Self {
        Self { state: Mutex::default(), wake: Condvar::new() }
    }
}

impl<T> Background<T> {
    fn state(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The state as the page takes it.
    pub fn status(&self) -> Value {
        let state = self.state();
        json!({ "running": state.running, "part": state.part, "outcome": state.outcome })
    }

    /// The last outcome.
    pub fn outcome(&self) -> Option<Value> {
        self.state().outcome.clone()
    }

    /// Requests work; work that runs continues.
    pub fn begin(&self, asked: T) -> Value {
        {
            let mut state = self.state();
            if !state.running {
                *state = State { asked: Some(asked), running: true, ..State::default() };
            }
        }
        self.wake.notify_all();
        self.status()
    }

    /// Ends the work that runs, without an outcome.
    pub fn stop(&self) -> Value {
        self.state().stopped = true;
        self.status()
    }

    pub fn is_stopped(&self) -> bool {
        self.state().stopped
    }

    /// Sets the share that is done, 0 to 1.
    pub fn set_part(&self, part: f64) {
        self.state().part = part;
    }

    /// Does what is requested, one after the other; never returns.
    pub fn run(&self, work: impl Fn(T) -> Result<Value, Error>) {
        loop {
            let asked = {
                let mut state = self.state();
                loop {
                    if let Some(asked) = state.asked.take() {
                        break asked;
                    }
                    state = self.wake.wait(state).unwrap_or_else(PoisonError::into_inner);
                }
            };
            let found = catch_unwind(AssertUnwindSafe(|| work(asked)));
            let mut state = self.state();
            let outcome = match found {
                _ if state.stopped => json!({ "error": "stopped" }),
                Ok(Ok(outcome)) => outcome,
                Ok(Err(error)) => json!({ "error": error.to_string() }),
                Err(_) => json!({ "error": "the work failed: this is a bug" }),
            };
            state.outcome = Some(outcome);
            state.running = false;
        }
    }
}
