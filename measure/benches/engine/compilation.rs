//! The time from rule files to compiled rules: the shipped ones, and a generated set a hundred times as large.

use crate::timing::{TargetFigure, figure, heading, median};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use teachtree_base::hands::{Finger, Side};
use teachtree_engine::compiled::instantiate::instantiate;
use teachtree_engine::compiled::plan::Plan;
use teachtree_frames::frames::{HandLayout, Layout};
use teachtree_language::graph::{Graph, lower};
use teachtree_language::{self as language, Request};

const SHIPPED: &str = "rules/bimanual.rules";
const ROUNDS: usize = 21;
/// Numbers of primitives of generated sets, and of conditions per primitive.
const PRIMITIVES: [usize; 3] = [250, 500, 1000];
const CONDITIONS_EACH: usize = 5;
/// The quantities of the conditions.
const QUANTITIES: usize = 50;
/// Conditions per file: a rule file has at most 50,000 words and symbols.
const CONDITIONS_A_FILE: usize = 2500;

pub fn section() {
    heading("shipped rules ready to run");
    let own = std::env::current_exe().expect("it runs");
    let own = own.to_str().expect("its place is text");
    let process = milliseconds(ROUNDS, || run(own, &["ready"]));
    figure("a process that makes them ready for two hands, and ends", process, "ms", TargetFigure::AtMost(5.0));
    let check = milliseconds(ROUNDS, || run(&program(), &["check", SHIPPED]));
    figure(&format!("process `teachtree check {SHIPPED}`, one hand and two"), check, "ms", TargetFigure::Nothing);
    let nothing = milliseconds(ROUNDS, || run(&program(), &["--version"]));
    figure("process `teachtree --version`", nothing, "ms", TargetFigure::Nothing);
    let within = milliseconds(ROUNDS, || drop(compiled(Path::new(SHIPPED))));
    figure("read, checked, lowered and opened within a process", within, "ms", TargetFigure::Nothing);
    let rules = load(Path::new(SHIPPED));
    let graph = lower(&rules);
    figure(
        "of that: read and checked",
        milliseconds(ROUNDS, || drop(load(Path::new(SHIPPED)))),
        "ms",
        TargetFigure::Nothing,
    );
    figure("of that: lowered", milliseconds(ROUNDS, || drop(lower(&rules))), "ms", TargetFigure::Nothing);
    let opened = milliseconds(ROUNDS, || drop(instantiate(&graph, &layout())));
    figure("of that: opened for two hands", opened, "ms", TargetFigure::Nothing);

    let folder = tempfile::tempdir().expect("a temporary folder");
    let sizes = PRIMITIVES.map(|primitives| {
        heading(&format!("generated: {primitives} primitives, {} conditions", primitives * CONDITIONS_EACH));
        let main = write_rules(folder.path(), primitives);
        let wanted = |bound: f64| if primitives == 1000 { TargetFigure::AtMost(bound) } else { TargetFigure::Nothing };
        let start = Instant::now();
        let rules = load(&main);
        let read = start.elapsed().as_secs_f64();
        let graph = lower(&rules);
        let lowered = start.elapsed().as_secs_f64();
        let plan = instantiate(&graph, &layout()).expect("1 kHz suits the rules");
        let opened = start.elapsed().as_secs_f64();
        figure("read and checked", read, "s", TargetFigure::Nothing);
        figure("lowered", lowered - read, "s", TargetFigure::Nothing);
        figure("opened for two hands", opened - lowered, "s", TargetFigure::Nothing);
        figure("all of it", opened, "s", wanted(1.0));
        let (took, memory) = peak(&main);
        figure("process `teachtree check`", took, "s", wanted(1.0));
        figure("its memory at most", memory, "MB", wanted(200.0));
        let (nodes, steps) = (nodes(&graph), steps(&plan));
        figure("nodes of the graph", nodes, "", TargetFigure::Nothing);
        figure("nodes of the opened graph", steps, "", TargetFigure::Nothing);
        [nodes, steps]
    });
    heading("growth of the graph when rules double");
    for (pair, primitives) in sizes.windows(2).zip(PRIMITIVES.windows(2)) {
        let [from, to] = [primitives[0], primitives[1]];
        figure(&format!("nodes, {from} to {to} primitives"), pair[1][0] / pair[0][0], "", TargetFigure::AtMost(2.1));
        figure(&format!("opened, {from} to {to} primitives"), pair[1][1] / pair[0][1], "", TargetFigure::AtMost(2.1));
    }
}

fn milliseconds(rounds: usize, mut run: impl FnMut()) -> f64 {
    run();
    let time = |()| {
        let start = Instant::now();
        run();
        start.elapsed().as_secs_f64() * 1e3
    };
    median(std::iter::repeat_n((), rounds).map(time).collect())
}

/// Compiles the shipped rules once.
pub fn ready() {
    drop(std::hint::black_box(compiled(Path::new(SHIPPED))));
}

fn run(program: &str, arguments: &[&str]) {
    let status = Command::new(program).args(arguments).stdout(Stdio::null()).status().expect("the program runs");
    assert!(status.success(), "{arguments:?} failed");
}

/// Returns the time of `teachtree check`, s, and its largest resident memory, MB, as Linux reports it; NaN on other systems.
fn peak(rules: &Path) -> (f64, f64) {
    let start = Instant::now();
    let mut child =
        Command::new(program()).arg("check").arg(rules).stdout(Stdio::null()).spawn().expect("the program runs");
    let mut peak = f64::NAN;
    let status = loop {
        let printed = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        let line = printed.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kilobytes = line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<f64>().ok());
        peak = kilobytes.map_or(peak, |kilobytes| kilobytes / 1024.0);
        if let Some(status) = child.try_wait().expect("it can be waited for") {
            break status;
        }
        std::thread::sleep(Duration::from_millis(1));
    };
    assert!(status.success(), "check refuses {}", rules.display());
    (start.elapsed().as_secs_f64(), peak)
}

fn load(main: &Path) -> language::Rules {
    let loaded = language::load(&Request { files: vec![main.into()], needs_tree: true, ..Request::default() });
    loaded.rules.unwrap_or_else(|| panic!("{:#?}", loaded.diagnostics))
}

fn compiled(main: &Path) -> Plan {
    instantiate(&lower(&load(main)), &layout()).expect("1 kHz suits the rules")
}

/// The slots of two hands with five fingers each and six bodies to touch, at 1 kHz.
fn layout() -> Layout {
    let fingers = vec![Finger::Thumb, Finger::Index, Finger::Middle, Finger::Ring, Finger::Little];
    let contacts = (1..=6).map(|at| format!("body {at}")).collect::<Vec<_>>();
    let hand = |side| HandLayout { side, fingers: fingers.clone(), contacts: contacts.clone(), knows_distance: false };
    Layout { rate_hz: 1000.0, hands: Side::BOTH.map(hand).to_vec() }
}

fn nodes(graph: &Graph) -> f64 {
    (graph.values.len() + graph.trees.iter().map(|tree| tree.decision.tests.len()).sum::<usize>()) as f64
}

fn steps(plan: &Plan) -> f64 {
    let tests: usize = plan.trees.iter().map(|tree| tree.decision.tests.len()).sum();
    (plan.numbers.len() + plan.conditions.len() + plan.stateful.len() + tests) as f64
}

/// Writes a rule set with the given number of primitives into a folder: conditions of all kinds, each used by one choice of the tree.
fn write_rules(folder: &Path, primitives: usize) -> PathBuf {
    let folder = folder.join(primitives.to_string());
    fs::create_dir_all(&folder).expect("a folder can be made");
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).expect("a file can be written");
    let mut stream = String::from("stream {\n  for each hand {\n");
    for at in 0..QUANTITIES {
        let _ = writeln!(stream, "    q{at} : scalar m/s");
    }
    write("quantities.rules", &(stream + "  }\n}\n"));

    let conditions = primitives * CONDITIONS_EACH;
    let mut main = String::new();
    for (file, start) in (0..conditions).step_by(CONDITIONS_A_FILE).enumerate() {
        let mut text = String::from("use \"quantities.rules\"\nfor each hand {\n");
        for at in start..(start + CONDITIONS_A_FILE).min(conditions) {
            let (quantity, limit, time) = ((at * 7 + at / 50) % QUANTITIES, at + 1, 1 + at % 200);
            let _ = match at % 3 {
                0 => writeln!(text, "  signal c{at} = q{quantity} above {limit}.5 mm/s until below {limit} mm/s"),
                1 => writeln!(text, "  signal c{at} = (q{quantity} > {limit} mm/s) for {time} ms"),
                _ => writeln!(text, "  signal c{at} = q{quantity} < {limit} mm/s"),
            };
        }
        let name = format!("conditions{file}.rules");
        write(&name, &(text + "}\n"));
        let _ = writeln!(main, "use \"{name}\"");
    }
    let labels: Vec<String> = (0..primitives).map(|at| format!("P{at}")).collect();
    let _ = writeln!(main, "primitive {}, Other\ntree generated for each hand {{", labels.join(", "));
    for at in 0..primitives {
        let [a, b, c, d, e] = [0, 1, 2, 3, 4].map(|which| format!("c{}", CONDITIONS_EACH * at + which));
        let _ = writeln!(main, "  ({a} or {b}) and ({c} or not {d}) and {e} => P{at}");
    }
    write("main.rules", &(main + "  else => Other\n}\n"));
    folder.join("main.rules")
}

/// The program, which `cargo build --release` puts beside the folder of the benches.
fn program() -> String {
    let own = std::env::current_exe().expect("it runs");
    let folder = own.ancestors().nth(2).expect("a target folder");
    let program = folder.join(format!("teachtree{}", std::env::consts::EXE_SUFFIX));
    assert!(program.is_file(), "{} is missing: run `cargo build --release` first", program.display());
    program.to_str().expect("its place is text").to_string()
}
