//! `cargo bench -p teachtree-measure --bench logs [-- FRAMES]`: logs from file to labels, each figure compared with a peer in the same run.
//!
//! The logs are written to a temporary folder and deleted at the end; an hour of two hands, 3.6 million frames, takes 8 GB. Peers
//! in Python (polars, pyarrow) are measured where they are installed. All run in turns in every round; medians are reported.
#![allow(missing_docs, reason = "a program")]
#![allow(
    clippy::print_stdout,
    clippy::expect_used,
    clippy::panic,
    reason = "a program that stops when something is wrong"
)]

#[path = "logs/measured_logs.rs"]
mod measured_logs;
#[path = "logs/peers.rs"]
mod peers;

use peers::{Python, arrow_columns};
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use teachtree_logs::read::formats;
use teachtree_logs::read::table::ColumnRequest;

/// One hour at 1 kHz.
const HOUR: usize = 3_600_000;
/// Rows of the table of the job that `benches/engine/job` measures.
const ROWS: usize = 400_000;
/// Frames of each of four logs.
const EACH: usize = 200_000;
const ROUNDS: usize = 5;

const POLARS_CSV: &str = "import sys, time, polars as pl
names = open(sys.argv[1]).readline().strip().split(',')
while sys.stdin.readline():
    s = time.perf_counter(); pl.read_csv(sys.argv[1], schema=dict.fromkeys(names, pl.Float64)).height; print(time.perf_counter() - s, flush=True)";
const PYARROW_PARQUET: &str = "import sys, time, pyarrow.parquet as pq
names = [f.name for f in pq.ParquetFile(sys.argv[1]).schema_arrow if str(f.type) in ('double', 'float')]
while sys.stdin.readline():
    s = time.perf_counter(); pq.read_table(sys.argv[1], columns=names, use_threads=False).num_rows; print(time.perf_counter() - s, flush=True)";

fn main() {
    // Paths of rules, logs and robots are those of the repository.
    std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).expect("the folder of the repository");
    let frames = std::env::args().find_map(|arg| arg.parse().ok()).unwrap_or(HOUR);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let place = |name: &str| folder.path().join(name);

    println!("{:<44} {:>14} {:>14}", "", "rows/s", "the first to it");
    let (csv, parquet) = (place("job.csv"), place("job.parquet"));
    measured_logs::job(ROWS, &csv, &parquet);
    let mut contest = Contest::new(ROWS);
    contest.enter("CSV, 46 columns, all cores", || seconds(|| read(&csv)));
    contest.python("polars, all cores", POLARS_CSV, &csv);
    contest.run(1, ROUNDS);
    let mut contest = Contest::new(ROWS);
    contest.enter("Parquet, 46 columns, one core", || seconds(|| read(&parquet)));
    contest
        .enter("arrow's column reader into vectors, one core", || seconds(|| drop(black_box(arrow_columns(&parquet)))));
    contest.python("pyarrow, one core", PYARROW_PARQUET, &parquet);
    contest.run(1, ROUNDS);

    let logs: Vec<PathBuf> = (1..=4).map(|log| place(&format!("{log}.parquet"))).collect();
    logs.iter().for_each(|log| measured_logs::two_hands(EACH, log));
    let mut contest = Contest::new(EACH * logs.len());
    contest.enter("analyze, four logs, two cores", || analyze(&logs, 2).seconds);
    contest.enter("the same on one core", || analyze(&logs, 1).seconds);
    // The upper limit of the machine: two processes share nothing.
    let halves = || {
        std::thread::scope(|scope| logs.chunks(2).for_each(|half| drop(scope.spawn(|| analyze(half, 1)))));
    };
    contest.enter("two logs each by two processes, one core each", || seconds(halves));
    contest.run(1, ROUNDS);

    let log = place("hour.parquet");
    measured_logs::two_hands(frames, &log);
    let mut contest = Contest::new(frames);
    contest.enter("analyze, two hands, whole process", || analyze(std::slice::from_ref(&log), 1).seconds);
    contest.enter("arrow's column reader into vectors", || seconds(|| drop(black_box(arrow_columns(&log)))));
    contest.python("pyarrow, one core", PYARROW_PARQUET, &log);
    contest.run(1, 1);

    println!("\n{:<44} {:>14} {:>12}", "most memory of `analyze`", "frames", "MB");
    let resident = |log: &Path| analyze(&[log.to_path_buf()], 2).resident_kb as f64 / 1e3;
    println!("{:<44} {frames:>14} {:>12.0}", "two hands, Parquet", resident(&log));
    std::fs::remove_file(&log).expect("it is there");
    let csv = place("some.csv");
    measured_logs::one_hand_csv(frames / 10, &csv);
    println!("{:<44} {:>14} {:>12.0}", "one hand, CSV", frames / 10, resident(&csv));
}

fn read(path: &Path) {
    let wants: Vec<ColumnRequest> = std::iter::once(ColumnRequest::Time(1.0))
        .chain(vec![ColumnRequest::Number(1.0); measured_logs::CHANNELS])
        .collect();
    drop(black_box(formats::open(path).expect("opens").read(&wants, None).expect("reads")));
}

/// The candidates for one task, and their times, s.
struct Contest<'a> {
    rows: usize,
    names: Vec<&'a str>,
    runs: Vec<Box<dyn FnMut() -> f64 + 'a>>,
}

impl<'a> Contest<'a> {
    fn new(rows: usize) -> Self {
        Self { rows, names: vec![], runs: vec![] }
    }

    fn enter(&mut self, name: &'a str, run: impl FnMut() -> f64 + 'a) {
        self.names.push(name);
        self.runs.push(Box::new(run));
    }

    fn python(&mut self, name: &'a str, script: &str, file: &Path) {
        match Python::new(script, file) {
            Some(mut python) => self.enter(name, move || python.seconds()),
            None => println!("{name}: not measured, python3 does not have it"),
        }
    }

    /// Runs all in turns; prints the rows per second of each, and the ratio of the first one to the others.
    fn run(mut self, warm_up: usize, rounds: usize) {
        let mut times = vec![vec![]; self.runs.len()];
        for round in 0..warm_up.min(rounds - 1) + rounds {
            for (run, times) in self.runs.iter_mut().zip(&mut times) {
                let took = run();
                if round >= warm_up.min(rounds - 1) {
                    times.push(took);
                }
            }
        }
        let times: Vec<f64> = times.iter_mut().map(|times| median(times)).collect();
        for (name, time) in self.names.iter().zip(&times) {
            println!("{name:<44} {:>12.2} M {:>14.2}", self.rows as f64 / time / 1e6, time / times[0]);
        }
        println!();
    }
}

fn seconds(run: impl FnOnce()) -> f64 {
    let start = Instant::now();
    run();
    start.elapsed().as_secs_f64()
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// The time and memory of a run of the program.
struct RunCost {
    seconds: f64,
    resident_kb: u64,
}

/// Runs `analyze` on logs as a separate process.
fn analyze(logs: &[PathBuf], cores: usize) -> RunCost {
    let start = Instant::now();
    let mut child = Command::new(program())
        .args(["analyze", "--format", "json"])
        .args(logs)
        .env("RAYON_NUM_THREADS", cores.to_string())
        .stdout(Stdio::null())
        .spawn()
        .expect("the program runs");
    let mut resident_kb = 0;
    let status = loop {
        // The peak memory, where the system reports it.
        let printed = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        let most = printed
            .lines()
            .find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix("kB")?.trim().parse().ok());
        resident_kb = most.unwrap_or(resident_kb);
        if let Some(status) = child.try_wait().expect("it ends") {
            break status;
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    assert!(status.success(), "analyze ends well");
    RunCost { seconds: start.elapsed().as_secs_f64(), resident_kb }
}

/// The program, which `cargo build --release` puts beside the folder of the benches.
fn program() -> String {
    let own = std::env::current_exe().expect("it runs");
    let folder = own.ancestors().nth(2).expect("a target folder");
    let program = folder.join(format!("teachtree{}", std::env::consts::EXE_SUFFIX));
    assert!(program.is_file(), "{} is missing: run `cargo build --release` first", program.display());
    program.to_str().expect("its place is text").to_string()
}
