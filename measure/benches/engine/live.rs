//! `Live` row by row: sensors, derived channels, rules, settling, relabeling and tasks, beside the loop by hand that only evaluates predicates.

use crate::job;
use crate::shipped::TWO_HANDS;
use crate::streaming::{at, sorted};
use crate::timing::{Contestant, TargetFigure, figure, heading, race};
use std::hint::black_box;
use std::time::Instant;
use teachtree::{Calibration, Column, Live, Log, Rules, Scene};
use teachtree_world::{shipped, teach};

/// The number of rows; a recording is repeated until it has this number.
const ROWS: usize = 60_000;
const ROUNDS: usize = 5;

/// A recording as rows.
struct Rows {
    titles: Vec<String>,
    rows: Vec<Vec<f64>>,
    scene: Scene,
}

impl Rows {
    fn new(name: &str) -> Self {
        let (scene, operator) = (shipped::scene(name).expect("shipped"), shipped::operator(name).expect("shipped"));
        let recording = teach(&scene, &operator, 1).expect("it can be taught");
        let titles = std::iter::once("time".to_string()).chain(recording.columns.keys().cloned()).collect();
        let columns = || recording.columns.values();
        let row =
            |at: usize| std::iter::once(recording.time[at]).chain(columns().map(|column| column.values[at])).collect();
        let scene = serde_json::to_string(&recording.scene).expect("scenes are JSON");
        Self {
            titles,
            rows: (0..recording.time.len()).map(row).collect(),
            scene: Scene::parse("scene", &scene).expect("scenes are YAML"),
        }
    }

    fn live(&self, file: &str) -> Live {
        let column = |at: usize| self.rows.iter().map(|row| row[at]).collect::<Vec<f64>>();
        let columns = self.titles.iter().enumerate().map(|(at, title)| Column::new(title, "", column(at)));
        let log = Log::from_columns("log", columns, &self.scene).expect("simulated logs are whole");
        let rules = Rules::options().file(file).load().expect("shipped rules are right");
        let calibration = Calibration::of_whole(&log, &rules).expect("simulated logs are whole");
        Live::new(&rules, &self.titles, &self.scene, &calibration).expect("1 kHz suits the rules")
    }

    /// Pushes the rows again and again, each with the next stamp.
    fn push(&self, live: &mut Live, rows: usize, each: &mut dyn FnMut(u64)) -> usize {
        let step = self.rows[1][0] - self.rows[0][0];
        let mut row = self.rows[0].clone();
        let mut events = 0;
        for at in 0..rows {
            row.clone_from(&self.rows[at % self.rows.len()]);
            row[0] = at as f64 * step;
            let start = Instant::now();
            events += live.push(black_box(&row)).expect("rows are whole").len();
            each(start.elapsed().as_nanos() as u64);
        }
        events
    }
}

pub fn section() {
    heading(&format!("Live row by row with two hands, derived channels included, {ROWS} rows"));
    let by_hand = job::data::rows(ROWS, 1);
    let loop_s = race(
        ROUNDS,
        &mut [Contestant::new("row loop of twelve predicates", || {
            drop(black_box(job::baseline::in_rows(&by_hand)));
        })],
    )[0];
    figure("row loop of twelve predicates: mean", loop_s / ROWS as f64 * 1e6, "µs", TargetFigure::Nothing);
    for file in ["bimanual.rules", "prompt.rules"] {
        for scene in TWO_HANDS {
            of_scene(file, scene, loop_s / ROWS as f64 * 1e6);
        }
    }
}

/// The time of a row of a scene, beside that of the loop by hand, µs.
fn of_scene(file: &str, scene: &str, loop_us: f64) {
    let rows = Rows::new(scene);
    let mut live = rows.live(file);
    let mut times = Vec::with_capacity(ROWS);
    let events = rows.push(&mut live, ROWS, &mut |time| times.push(time));
    assert!(events > 10, "something happens");
    let mean = times.iter().sum::<u64>() as f64 / ROWS as f64 * 1e-3;
    let times = sorted(times);
    figure(&format!("{file}, {scene}: median"), at(&times, 0.5) * 1e-3, "µs", TargetFigure::AtMost(5.0));
    figure(&format!("{file}, {scene}: 99 %"), at(&times, 0.99) * 1e-3, "µs", TargetFigure::Nothing);
    figure(&format!("{file}, {scene}: 99.9 %"), at(&times, 0.999) * 1e-3, "µs", TargetFigure::AtMost(50.0));
    figure(&format!("{file}, {scene}: mean"), mean, "µs", TargetFigure::Nothing);
    figure(&format!("{file}, {scene}: mean to that of the row loop"), mean / loop_us, "", TargetFigure::Nothing);
}
