//! What is shown of long work on a terminal: a bar where it is known how much there is to do, else a sign that the program is at work and for how long.
//! Nothing of it is shown where standard error is not a terminal.

use super::print_args::is_quiet;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;
use teachtree_logs::read::progress;

/// How often the sign of work is drawn.
const TICK: Duration = Duration::from_millis(100);
/// Number of ticks without other output after which the progress appears.
const PATIENCE: u32 = 10;

/// The state of the terminal. Code that draws or prints holds the lock.
static SHOWN: Mutex<ProgressState> = Mutex::new(ProgressState { bars: 0, ticks: 0, sign: None });

struct ProgressState {
    /// Number of bars.
    bars: usize,
    /// For how many ticks there was nothing else.
    ticks: u32,
    sign: Option<ProgressBar>,
}

impl ProgressState {
    /// Takes the sign of work away.
    fn clear(&mut self) {
        self.ticks = 0;
        if let Some(sign) = self.sign.take() {
            sign.finish_and_clear();
        }
    }
}

fn shown() -> MutexGuard<'static, ProgressState> {
    SHOWN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Prints something while nothing else is drawn.
pub fn aside<R>(print: impl FnOnce() -> R) -> R {
    let mut shown = shown();
    shown.clear();
    print()
}

/// A bar with a label that moves from 0 to 1.
pub struct Progress {
    bar: ProgressBar,
}

const STEPS: u64 = 1000;

impl Progress {
    /// A bar at 0.
    pub fn new(label: &str) -> Self {
        let mut shown = shown();
        shown.clear();
        shown.bars += 1;
        // `indicatif` hides the bar itself when standard error is not a terminal.
        let target = if is_quiet() { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let bar = ProgressBar::with_draw_target(Some(STEPS), target);
        if let Ok(style) = ProgressStyle::with_template("{msg} {bar:40} {percent:>3} %  {elapsed}") {
            bar.set_style(style);
        }
        bar.set_message(label.to_string());
        Self { bar }
    }

    /// Moves the bar to a part of the whole, 0 to 1.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "between 0 and 1000"
    )]
    pub fn set(&self, part: f64) {
        self.bar.set_position((part.clamp(0.0, 1.0) * STEPS as f64) as u64);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
        let mut shown = shown();
        shown.bars = shown.bars.saturating_sub(1);
        shown.ticks = 0;
    }
}

/// The sign that a command is at work, with what was read of the log and for how long it takes. It appears after a second without a bar or output, and goes
/// when either comes, or when this is dropped.
pub struct ActivityIndicator(Option<(Sender<()>, JoinHandle<()>)>);

impl ActivityIndicator {
    /// A sign with this label.
    pub fn new(label: &str) -> Self {
        if is_quiet() || !std::io::stderr().is_terminal() {
            return Self(None);
        }
        let (stop, stopped) = channel();
        let label = label.to_string();
        let watch = move || {
            let mut waited = Duration::ZERO;
            while stopped.recv_timeout(TICK) == Err(RecvTimeoutError::Timeout) {
                waited += TICK;
                tick(&label, waited);
            }
            shown().clear();
        };
        // Without a thread there is no sign.
        let watching = std::thread::Builder::new().name("progress".into()).spawn(watch);
        Self(watching.ok().map(|watching| (stop, watching)))
    }
}

impl Drop for ActivityIndicator {
    fn drop(&mut self) {
        if let Some((stop, watching)) = self.0.take() {
            // The thread gets the message, or it has ended.
            let _ = stop.send(());
            let _ = watching.join();
        }
    }
}

fn tick(label: &str, waited: Duration) {
    let mut shown = shown();
    if shown.bars > 0 {
        return;
    }
    shown.ticks += 1;
    if shown.ticks < PATIENCE {
        return;
    }
    let sign = shown.sign.get_or_insert_with(|| {
        let sign = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr()).with_elapsed(waited);
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}  {elapsed}") {
            sign.set_style(style);
        }
        sign
    });
    let read = progress::share().map_or(String::new(), |share| format!(", {:.0} % of the log read", share * 100.0));
    sign.set_message(format!("{label}{read}"));
    sign.tick();
}
