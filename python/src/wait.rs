//! Long work without the interpreter's lock, that Ctrl-C interrupts.

use crate::error;
use pyo3::prelude::*;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread;
use std::time::Duration;

/// Interval between checks of Python's signals.
const TICK: Duration = Duration::from_millis(20);

/// Does `work` on a thread of its own, without the interpreter's lock.
///
/// Ctrl-C raises `KeyboardInterrupt` within [`TICK`]; work that cannot be cancelled continues in the background, and its result is dropped.
///
/// # Errors
/// What a handler of signals raises; a panic of `work`, which is a bug.
pub fn released<T: Send + 'static>(py: Python<'_>, work: impl FnOnce() -> T + Send + 'static) -> PyResult<T> {
    let (sender, mut receiver) = sync_channel(1);
    thread::Builder::new().name("teachtree".into()).spawn(move || sender.send(work()))?;
    loop {
        let received;
        (receiver, received) = py.detach(move || {
            let received = receiver.recv_timeout(TICK);
            (receiver, received)
        });
        match received {
            Ok(result) => return Ok(result),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => {
                return Err(error::raised(
                    py,
                    "internal",
                    "teachtree",
                    "the work ended without a result",
                    Some("this is a bug of teachtree; please report it"),
                ));
            }
        }
    }
}
