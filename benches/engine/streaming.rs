//! Frame by frame, as a live log comes in: how long each frame takes.

use crate::shipped::Shipped;
use std::time::Instant;
use teachtree::engine::stepper::Stepper;
use teachtree::stream::frames::Values;

/// Nanoseconds of each frame, sorted.
pub fn times(job: &Shipped) -> Vec<u64> {
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
    times.sort_unstable();
    times
}
