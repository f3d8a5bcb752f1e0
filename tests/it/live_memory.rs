//! Memory of `Live`: what it holds does not grow with the log, and most rows take none.

use crate::live_log::{Rows, demonstration};
use std::io::Write as _;
use teachtree::{Calibration, Live, Rules};

/// Number of rows after which the evaluations of `Live` and the sums of derived channels are in step again.
const IN_STEP: usize = 3200;

/// A demonstration that is repeated without a gap.
struct DemonstrationLoop {
    rows: Rows,
    live: Live,
    step: f64,
    taken: usize,
}

impl DemonstrationLoop {
    fn new(name: &str) -> Self {
        let mut rows = Rows::of(&demonstration(name));
        let step = rows.rows[1][0] - rows.rows[0][0];
        let log = rows.log();
        let rules = Rules::for_log(&log).unwrap();
        let calibration = Calibration::of_whole(&log, &rules).unwrap();
        // The hands rest at the end for as long as it takes to be in step.
        let last = rows.rows.last().unwrap().clone();
        let length = (rows.rows.len() + 1500).next_multiple_of(IN_STEP);
        rows.rows.resize(length, last);
        let live = Live::new(&rules, &rows.titles, &rows.scene, &calibration).unwrap().with_confidence();
        Self { rows, live, step, taken: 0 }
    }

    /// Pushes the demonstration once; returns how many rows asked for memory, how often at most, and the number of tasks.
    fn once(&mut self) -> [u64; 3] {
        let [mut rows, mut most, mut tasks] = [0; 3];
        for at in 0..self.rows.rows.len() {
            let row = &mut self.rows.rows[at];
            row[0] = self.taken as f64 * self.step;
            self.taken += 1;
            let live = &mut self.live;
            let asked = allocation_counter::measure(|| {
                let events = live.push(row).unwrap();
                tasks += events.iter().filter(|event| event.is_final() && event.task().is_some()).count() as u64;
            });
            rows += u64::from(asked.count_total > 0);
            most = most.max(asked.count_total);
        }
        [rows, most, tasks]
    }
}

fn memory_is_constant(name: &str, frames: usize) {
    let mut log = DemonstrationLoop::new(name);
    // What is kept has its largest size.
    for _ in 0..2 {
        log.once();
    }
    let (mut tasks, from) = (0, log.taken);
    let mut rows = 0;
    let asked = allocation_counter::measure(|| {
        while log.taken - from < frames {
            let [allocating, most, found] = log.once();
            (rows, tasks) = (rows + allocating, tasks + found);
            assert!(most < 100_000, "{most} allocations in one row");
        }
    });
    let frames = log.taken - from;
    let _ = writeln!(
        std::io::stderr(),
        "{name}: {frames} rows, {rows} of them took memory, {} allocations a row",
        asked.count_total / frames as u64
    );
    assert_eq!((asked.bytes_current, asked.count_current), (0, 0), "{frames} rows");
    assert!(tasks as usize >= frames / log.rows.rows.len(), "{tasks} tasks");
    // Rows between two looks take none: one in 20 at 1 kHz does.
    assert!(rows as usize * 10 < frames, "{rows} of {frames} rows took memory");
}

#[test]
fn memory_does_not_grow_with_the_log() {
    memory_is_constant("pick_and_place", 30_000);
    memory_is_constant("hand_over_left_to_right", 30_000);
}

/// An hour at 1 kHz.
#[test]
#[ignore = "minutes: `cargo test --test it -- --ignored --nocapture memory_does_not_grow_in_an_hour`"]
fn memory_does_not_grow_in_an_hour() {
    memory_is_constant("hand_over_left_to_right", 3_600_000);
}
