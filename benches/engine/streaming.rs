//! Frame by frame, as a live log comes in: how long each frame takes.

use crate::measure::{Wanted, figure, heading, median};
use crate::shipped::{Shipped, TWO_HANDS};
use std::time::Instant;
use teachtree::engine::stepper::Stepper;
use teachtree::stream::frames::Values;

const FRAMES: usize = 100_000;
/// How often a log is gone through; the median of what is found each time counts.
const PASSES: usize = 5;

pub fn section() {
    heading("frame by frame, all three rule files with two hands; reading the clock twice is part of each time");
    let clock = sorted((0..FRAMES).map(|_| Instant::now().elapsed().as_nanos() as u64).collect());
    figure("reading the clock: median", at(&clock, 0.5), "ns", Wanted::Nothing);
    figure("reading the clock: 99.9 %", at(&clock, 0.999), "ns", Wanted::Nothing);
    for scene in TWO_HANDS {
        let job = Shipped::new("rules/bimanual.rules", scene, FRAMES);
        let passes: Vec<Vec<u64>> = (0..PASSES).map(|_| sorted(times(&job))).collect();
        let share = |share: f64| median(passes.iter().map(|times| at(times, share)).collect());
        figure(&format!("{scene}: median"), share(0.5), "ns", Wanted::AtMost(300.0));
        figure(&format!("{scene}: 99 %"), share(0.99), "ns", Wanted::Nothing);
        figure(&format!("{scene}: 99.9 %"), share(0.999), "ns", Wanted::AtMost(3000.0));
    }
}

fn sorted(mut times: Vec<u64>) -> Vec<u64> {
    times.sort_unstable();
    times
}

/// The time that a share of all frames does not take longer than.
fn at(sorted: &[u64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share) as usize] as f64
}

/// Nanoseconds of each frame.
fn times(job: &Shipped) -> Vec<u64> {
    let mut stepper = Stepper::new(&job.graph, &job.frames.layout).expect("1 kHz suits the rules");
    let inputs = stepper.plan().inputs.clone();
    let columns: Vec<Values<'_>> = inputs.iter().map(|key| job.frames.column(*key).unwrap_or(Values::NONE)).collect();
    let mut times = Vec::with_capacity(job.frames.len);
    let mut runs = 0;
    let mut row = vec![0.0; columns.len()];
    for frame in 0..job.frames.len {
        for (value, column) in row.iter_mut().zip(&columns) {
            *value = column.get(frame).unwrap_or_default();
        }
        let start = Instant::now();
        stepper.push(&row, &mut |_, _| runs += 1);
        times.push(start.elapsed().as_nanos() as u64);
    }
    assert!(runs > 0, "something happens");
    times
}
