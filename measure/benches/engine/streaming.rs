//! The time of each frame of a live log.

use crate::shipped::{RulesOnLog, TWO_HANDS};
use crate::timing::{TargetFigure, figure, heading, median};
use std::time::{Duration, Instant};
use teachtree_engine::live::Stepper;

const FRAMES: usize = 100_000;
const WEEK: usize = 7 * 24 * 3_600_000;
/// Number of passes through a log; the median of the passes is reported.
const PASSES: usize = 5;

pub fn section() {
    heading("frame by frame, all three rule files with two hands; reading the clock twice is part of each time");
    let clock = sorted((0..FRAMES).map(|_| Instant::now().elapsed().as_nanos() as u64).collect());
    figure("reading the clock: median", at(&clock, 0.5), "ns", TargetFigure::Nothing);
    figure("reading the clock: 99.9 %", at(&clock, 0.999), "ns", TargetFigure::Nothing);
    for scene in TWO_HANDS {
        let job = RulesOnLog::new("rules/bimanual.rules", scene, FRAMES);
        let passes: Vec<Vec<u64>> = (0..PASSES).map(|_| sorted(times(&job))).collect();
        let share = |share: f64| median(passes.iter().map(|times| at(times, share)).collect());
        figure(&format!("{scene}: median"), share(0.5), "ns", TargetFigure::AtMost(300.0));
        figure(&format!("{scene}: 99 %"), share(0.99), "ns", TargetFigure::Nothing);
        figure(&format!("{scene}: 99.9 %"), share(0.999), "ns", TargetFigure::AtMost(3000.0));
    }
}

/// A week at 1 kHz without a gap: the memory before and after it.
pub fn week() {
    heading("a simulated week frame by frame, all three rule files with two hands: minutes of it");
    let job = RulesOnLog::new("rules/bimanual.rules", TWO_HANDS[0], FRAMES);
    let mut live = Live::new(&job);
    live.over(&job, FRAMES);
    live.runs = 0;
    let before = resident_kb();
    let start = Instant::now();
    live.over(&job, WEEK);
    figure("it took", start.elapsed().as_secs_f64() / 60.0, "min", TargetFigure::Nothing);
    figure("leaves", live.runs as f64, "", TargetFigure::Nothing);
    figure("in memory more than before it", resident_kb() - before, "kB", TargetFigure::AtMost(64.0));
}

/// Returns the resident memory of the program, kB, where the system reports it.
fn resident_kb() -> f64 {
    let printed = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let resident =
        printed.lines().find_map(|line| line.strip_prefix("VmRSS:")?.trim().strip_suffix("kB")?.trim().parse().ok());
    resident.unwrap_or(f64::NAN)
}

pub fn sorted(mut times: Vec<u64>) -> Vec<u64> {
    times.sort_unstable();
    times
}

/// Returns a quantile of the times.
pub fn at(sorted: &[u64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share) as usize] as f64
}

/// A log that is replayed frame by frame, repeatedly.
struct Live<'a> {
    stepper: Stepper,
    columns: Vec<&'a [f64]>,
    row: Vec<f64>,
    runs: u64,
}

impl<'a> Live<'a> {
    fn new(job: &'a RulesOnLog) -> Self {
        let stepper = Stepper::new(&job.graph, &job.frames.layout).expect("1 kHz suits the rules");
        let inputs = &stepper.plan().inputs;
        let columns: Vec<&[f64]> = inputs.iter().map(|key| job.frames.column(*key).unwrap_or(&[])).collect();
        Self { row: vec![0.0; columns.len()], columns, stepper, runs: 0 }
    }

    /// Processes one frame and returns its time.
    fn frame(&mut self, frame: usize) -> Duration {
        for (value, column) in self.row.iter_mut().zip(&self.columns) {
            *value = column.get(frame).copied().unwrap_or_default();
        }
        let start = Instant::now();
        self.stepper.push(&self.row, &mut |_, _| self.runs += 1);
        start.elapsed()
    }

    fn over(&mut self, job: &RulesOnLog, frames: usize) {
        for frame in 0..frames {
            self.frame(frame % job.frames.len);
        }
    }
}

/// Returns the time of each frame, ns.
fn times(job: &RulesOnLog) -> Vec<u64> {
    let mut live = Live::new(job);
    let times = (0..job.frames.len).map(|frame| live.frame(frame).as_nanos() as u64).collect();
    assert!(live.runs > 0, "something happens");
    times
}
