//! The servo: a step of the world each millisecond of real time.
//!
//! Late steps are made at once until the world has caught up with real time. After a pause of more than a tenth of a second (a machine that slept) the time is
//! skipped instead. INVARIANT: this is the only file of this crate that reads a clock, and no recording depends on it.

use super::labels::LabelerInput;
use super::punctuality::Punctuality;
use super::shared_state::{Action, HandSnapshot, ServoTiming, Teaching};
use super::take_jobs::write;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{SyncSender, TrySendError};
use std::time::{Duration, Instant};
use teachtree_world::{MOST_STEPS, TeleopWorld};

/// A step of the world.
const STEP: Duration = Duration::from_millis(1);
/// The lateness above which time is skipped.
const MOST_BEHIND: Duration = Duration::from_millis(100);
/// Number of undone rows that are labeled again in a step.
const ROWS_A_STEP: usize = 40;

/// Steps the world until the program ends.
pub(super) fn run(
    mut work: TeleopWorld,
    teaching: &Arc<Teaching>,
    to_labels: &SyncSender<LabelerInput>,
) -> Punctuality {
    let mut punctuality = Punctuality::default();
    let mut fed = LabelFeed::default();
    let mut due = Instant::now();
    while !teaching.stops.load(Ordering::SeqCst) {
        due += STEP;
        let now = Instant::now();
        if let Some(early) = due.checked_duration_since(now) {
            std::thread::sleep(early);
        }
        let late = Instant::now().saturating_duration_since(due);
        punctuality.count(late);
        if late > MOST_BEHIND {
            punctuality.given_up_ms += u64::try_from(late.as_millis()).unwrap_or(u64::MAX);
            due += late;
        }
        step(&mut work, teaching, to_labels, &mut fed, &punctuality);
    }
    if let Some(taken) = work.stop() {
        write(teaching, taken);
    }
    punctuality
}

/// The progress of the labels.
#[derive(Default)]
struct LabelFeed {
    row: usize,
    is_begun: bool,
    /// The message that waits for room.
    last: Option<LabelerInput>,
}

fn step(
    work: &mut TeleopWorld,
    teaching: &Arc<Teaching>,
    to_labels: &SyncSender<LabelerInput>,
    fed: &mut LabelFeed,
    punctuality: &Punctuality,
) {
    let (mut hands, mut actions) = teaching.take_inputs();
    if work.is_recording() && work.recorded() >= MOST_STEPS {
        actions.insert(0, Action::Stop);
    }
    for action in actions {
        match action {
            Action::Start if !work.is_recording() => {
                work.start();
                *fed = LabelFeed::default();
            }
            Action::Stop => {
                if let Some(taken) = work.stop() {
                    write(teaching, taken);
                }
                fed.last = Some(LabelerInput::End);
            }
            Action::Undo => {
                work.undo();
                teaching.jump();
                hands = [None, None];
                *fed = LabelFeed::default();
            }
            Action::Reset => {
                work.reset();
                teaching.jump();
                hands = [None, None];
                fed.last = Some(LabelerInput::Nothing);
            }
            Action::Start => {}
        }
    }
    for (hand, input) in hands.into_iter().enumerate() {
        if let Some(input) = input {
            work.set_input(hand, input);
        }
    }
    work.step();
    feed(work, to_labels, fed);
    teaching.publish(|newest| {
        newest.step += 1;
        newest.epoch = teaching.epoch.load(Ordering::SeqCst);
        newest.is_recording = work.is_recording();
        newest.rows = work.recorded();
        let seen = work.observation();
        newest.bodies.clear();
        newest.bodies.extend(seen.bodies.iter().map(|body| body.pose));
        newest.hands.resize_with(seen.hands.len(), HandSnapshot::default);
        for (hand, (now, seen)) in newest.hands.iter_mut().zip(&seen.hands).enumerate() {
            now.palm = seen.palm;
            now.tips.clear();
            now.tips.extend(seen.tips.iter().map(|tip| tip.position));
            now.forces = work.felt(hand);
            now.is_silent = work.is_silent(hand);
        }
        // The table of lateness is evaluated rarely.
        if newest.step % 128 == 1 {
            newest.servo = ServoTiming {
                steps: punctuality.steps,
                share: punctuality.share(),
                p999_us: punctuality.within_us(0.999),
                latest_us: punctuality.latest_us,
                given_up_ms: punctuality.given_up_ms,
            };
        }
    });
}

/// Passes rows to the labels, as many as they accept.
fn feed(work: &TeleopWorld, to_labels: &SyncSender<LabelerInput>, fed: &mut LabelFeed) {
    if let Some(last) = fed.last.take()
        && let Err(TrySendError::Full(last)) = to_labels.try_send(last)
    {
        fed.last = Some(last);
    }
    if !work.is_recording() || fed.last.is_some() {
        return;
    }
    if !fed.is_begun {
        if to_labels.try_send(LabelerInput::Begin(work.columns())).is_err() {
            return;
        }
        fed.is_begun = true;
    }
    for _ in 0..ROWS_A_STEP {
        let Some(row) = work.row(fed.row) else { return };
        if to_labels.try_send(LabelerInput::Row(row)).is_err() {
            return;
        }
        fed.row += 1;
    }
}
