//! The shared state of the threads: the newest inputs of hands, the newest state of the world, labels and recordings.

use super::options::Options;
use super::takes::Takes;
use super::tracks::{PrimitiveStyle, Tracks};
use nalgebra::{Isometry3, Point3, Vector3};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use teachtree_world::HandInput;

/// Maximum number of waiting button events.
const MOST_ACTIONS: usize = 16;

/// A running teaching session.
pub struct Teaching {
    pub(super) options: Options,
    /// Whether the threads end.
    pub(super) stops: AtomicBool,
    /// Counts jumps of the world: resets and undos. An input that was sent after an earlier count is outdated.
    pub(super) epoch: AtomicU64,
    asked: Mutex<HandInputs>,
    newest: Mutex<StateSnapshot>,
    changed: Condvar,
    /// The appearance of the primitives by name.
    pub(super) styles: BTreeMap<String, PrimitiveStyle>,
    pub(super) tracks: Mutex<Tracks>,
    pub(super) takes: Mutex<Takes>,
}

/// The inputs since the last step.
#[derive(Default)]
pub(super) struct HandInputs {
    pub(super) hands: [Option<HandInput>; 2],
    pub(super) actions: Vec<Action>,
    /// The step of the last tracked fingertips of each hand, which come from a device.
    of_device: [Option<u64>; 2],
}

/// Number of steps without a message of a device after which a page may control its hand.
const DEVICE_STEPS: u64 = 2000;

/// A button.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Action {
    Start,
    Stop,
    Undo,
    Reset,
}

/// The newest state.
#[derive(Clone, Default)]
pub(super) struct StateSnapshot {
    /// The number of the step; 0 before the first one.
    pub(super) step: u64,
    pub(super) epoch: u64,
    pub(super) is_recording: bool,
    /// Number of recorded rows.
    pub(super) rows: usize,
    /// The hands of the scene, in its order.
    pub(super) hands: Vec<HandSnapshot>,
    pub(super) bodies: Vec<Isometry3<f64>>,
    pub(super) servo: ServoTiming,
}

/// The timing of the servo.
#[derive(Clone, Copy, Default)]
pub(super) struct ServoTiming {
    pub(super) steps: u64,
    pub(super) share: f64,
    /// The 99.9 % quantile and the maximum of the lateness, µs.
    pub(super) p999_us: u64,
    pub(super) latest_us: u64,
    pub(super) given_up_ms: u64,
}

/// A hand.
#[derive(Clone, Default)]
pub(super) struct HandSnapshot {
    pub(super) palm: Isometry3<f64>,
    pub(super) tips: Vec<Point3<f64>>,
    /// The forces on its fingertips, N; a device displays no force for a hand without inputs.
    pub(super) forces: Vec<Vector3<f64>>,
    pub(super) is_silent: bool,
}

/// Locks a mutex. A poisoned lock holds a consistent value, because values are replaced as a whole.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Teaching {
    /// Returns the state before the first step.
    pub(super) fn new(options: Options, styles: BTreeMap<String, PrimitiveStyle>) -> Self {
        Self {
            options,
            stops: AtomicBool::new(false),
            epoch: AtomicU64::new(0),
            asked: Mutex::default(),
            newest: Mutex::default(),
            changed: Condvar::new(),
            styles,
            tracks: Mutex::default(),
            takes: Mutex::default(),
        }
    }

    /// Ends the servo and writes the current recording.
    pub fn stop(&self) {
        self.stops.store(true, Ordering::SeqCst);
    }

    /// Returns the number of recordings that are being written.
    pub fn is_writing(&self) -> bool {
        lock(&self.takes).is_writing()
    }

    /// Returns the errors of recordings, one sentence each.
    pub fn troubles(&self) -> Vec<String> {
        lock(&self.takes).troubles()
    }

    /// Returns the written files.
    pub fn files(&self) -> Vec<PathBuf> {
        lock(&self.takes).files()
    }

    /// Presses a button.
    pub(super) fn act(&self, action: Action) {
        let mut asked = lock(&self.asked);
        if asked.actions.len() < MOST_ACTIONS {
            asked.actions.push(action);
        }
    }

    /// Sets the input of a hand, unless the world has jumped since `epoch`. A page leads palms all the time, so it does not override a device.
    pub(super) fn set_input(&self, hand: usize, epoch: Option<u64>, input: HandInput) {
        let step = lock(&self.newest).step;
        let mut asked = lock(&self.asked);
        if epoch.is_some_and(|epoch| epoch != self.epoch.load(Ordering::SeqCst)) {
            return;
        }
        let HandInputs { hands, of_device, .. } = &mut *asked;
        let (Some(asked), Some(of_device)) = (hands.get_mut(hand), of_device.get_mut(hand)) else { return };
        let is_tips = matches!(input, HandInput::Tips { .. });
        if !is_tips && of_device.is_some_and(|at| step < at.saturating_add(DEVICE_STEPS)) {
            return;
        }
        *of_device = is_tips.then_some(step);
        *asked = Some(input);
    }

    /// Takes the newest input of each hand, and the buttons in order.
    pub(super) fn take_inputs(&self) -> ([Option<HandInput>; 2], Vec<Action>) {
        let mut asked = lock(&self.asked);
        (std::mem::take(&mut asked.hands), std::mem::take(&mut asked.actions))
    }

    /// Records a jump of the world: earlier inputs are discarded.
    pub(super) fn jump(&self) {
        let mut asked = lock(&self.asked);
        asked.hands = [None, None];
        self.epoch.fetch_add(1, Ordering::SeqCst);
    }

    /// Publishes a new state.
    pub(super) fn publish(&self, update: impl FnOnce(&mut StateSnapshot)) {
        update(&mut lock(&self.newest));
        self.changed.notify_all();
    }

    /// Waits briefly for a state at or after `step`; returns `None` on timeout.
    pub(super) fn state_after(&self, step: u64) -> Option<StateSnapshot> {
        let newest = lock(&self.newest);
        let waited = self.changed.wait_timeout_while(newest, Duration::from_millis(100), |newest| newest.step < step);
        let (newest, _) = waited.unwrap_or_else(PoisonError::into_inner);
        (newest.step >= step).then(|| newest.clone())
    }
}
