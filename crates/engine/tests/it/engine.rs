//! Tests of `engine`: the compiled evaluator against the reference, on random rules and random logs.

mod proofs;
pub mod random;

use proptest::prelude::*;
use rayon::prelude::*;
use std::ops::Range;
use teachtree_base::hands::Side;
use teachtree_engine::evaluator::{Evaluator, evaluate, evaluate_in_blocks};
use teachtree_engine::live::Stepper;
use teachtree_engine::reference;
use teachtree_engine::runs::{Leaves, Run, append};
use teachtree_frames as stream;
use teachtree_frames::frames::{ColumnKey, Frames, HandLayout, Layout};
use teachtree_language::graph::{Graph, lower};
use teachtree_language::ops::TemporalOperator;
use teachtree_language::rules::{Branch, Consequent, Expr, ExprKind, Rules};
use teachtree_language::{Request, load, load_text};
use teachtree_world as world;

proptest! {
    // PROPTEST_CASES asks for more than the usual 256.
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// The compiled graph and the literal evaluator give the same leaves, frame for frame; any block size gives the same leaves.
    #[test]
    fn compiled_equals_reference_in_blocks_of_any_size(seed in any::<u64>(), depth in 1_u32..5, block in 1_usize..80) {
        let (rules, frames) = random::case(seed, depth);
        let graph = lower(&rules);
        let expected = reference::evaluate(&rules, &frames).unwrap();
        let whole = evaluate(&graph, &frames).unwrap();
        prop_assert_eq!(&whole, &expected);
        let stepped = stepped(&graph, &frames);
        prop_assert_eq!(&stepped, &expected);
        let blocks = evaluate_in_blocks(&graph, &frames, block).unwrap();
        prop_assert_eq!(&blocks, &expected);
    }

    /// `bridging` and `lasting` have the leaves of their definitions by the other operators.
    #[test]
    fn bridging_and_lasting_equal_their_definitions(seed in any::<u64>(), depth in 1_u32..5) {
        let (rules, frames) = random::case(seed, depth);
        let expected = reference::evaluate(&rules, &frames).unwrap();
        let written_out = written_out(rules);
        prop_assert_eq!(&reference::evaluate(&written_out, &frames).unwrap(), &expected);
        prop_assert_eq!(&evaluate(&lower(&written_out), &frames).unwrap(), &expected);
    }

    /// On numbers that need rounding as well.
    #[test]
    fn compiled_equals_reference_on_rough_numbers(seed in any::<u64>(), depth in 1_u32..5, block in 1_usize..80) {
        let (rules, frames) = random::case_of_rough_numbers(seed, depth);
        let expected = reference::evaluate(&rules, &frames).unwrap();
        let graph = lower(&rules);
        let whole = evaluate(&graph, &frames).unwrap();
        prop_assert_eq!(&whole, &expected);
        let blocks = evaluate_in_blocks(&graph, &frames, block).unwrap();
        prop_assert_eq!(&blocks, &expected);
    }
}

/// The rules with `bridging` and `lasting` replaced by their definitions.
fn written_out(mut rules: Rules) -> Rules {
    fn branch(choices: &mut Branch) {
        for choice in &mut choices.choices {
            choice.condition.iter_mut().for_each(expr);
            if let Consequent::Branch(below) = &mut choice.then {
                branch(below);
            }
        }
    }
    fn expr(whole: &mut Expr) {
        whole.arguments_mut().into_iter().for_each(expr);
        let of = |temporal, inner: &Expr| Expr {
            kind: ExprKind::Temporal(temporal, Box::new(inner.clone())),
            ..inner.clone()
        };
        let kind = match &whole.kind {
            ExprKind::Temporal(TemporalOperator::Bridging(time), inner) => ExprKind::And(vec![
                of(TemporalOperator::WithinLast(time.clone()), inner),
                of(TemporalOperator::WithinNext(time.clone()), inner),
            ]),
            ExprKind::Temporal(TemporalOperator::Lasting(time), inner) => {
                of(TemporalOperator::WithinNext(time.clone()), &of(TemporalOperator::For(time.clone()), inner)).kind
            }
            _ => return,
        };
        whole.kind = kind;
    }
    rules.signals.iter_mut().for_each(|signal| expr(&mut signal.expr));
    for latch in &mut rules.latches {
        expr(&mut latch.set);
        expr(&mut latch.clear);
    }
    rules.trees.iter_mut().for_each(|tree| branch(&mut tree.root));
    rules
}

/// Runs `PROGRAMS` random programs, from `SEED` on, on all cores.
#[test]
#[ignore = "minutes: `PROGRAMS=1000000 cargo test --release -p teachtree-engine -- --ignored --nocapture many_programs`"]
fn many_programs_and_logs() {
    let number = |name: &str, default: u64| std::env::var(name).map_or(default, |text| text.parse().unwrap());
    let (programs, first) = (number("PROGRAMS", 10_000), number("SEED", 0));
    let frames: usize = (first..first + programs)
        .into_par_iter()
        .map(|seed| {
            let depth = 1 + (seed % 4) as u32;
            let block = 1 + (seed % 79) as usize;
            let (rules, frames) = random::case(seed, depth);
            let graph = lower(&rules);
            let expected = reference::evaluate(&rules, &frames).unwrap();
            assert_eq!(evaluate(&graph, &frames).unwrap(), expected, "seed {seed}");
            assert_eq!(stepped(&graph, &frames), expected, "seed {seed}, frame by frame");
            assert_eq!(evaluate_in_blocks(&graph, &frames, block).unwrap(), expected, "seed {seed}, blocks of {block}");
            let (rules, frames) = random::case_of_rough_numbers(seed, depth);
            let rough = evaluate_in_blocks(&lower(&rules), &frames, block).unwrap();
            assert_eq!(rough, reference::evaluate(&rules, &frames).unwrap(), "seed {seed}, rough numbers");
            frames.len
        })
        .sum();
    let report = format!("twice {programs} programs, {frames} frames: the engine equals the reference\n");
    std::io::Write::write_all(&mut std::io::stderr(), report.as_bytes()).unwrap();
}

/// A quotient by a negative zero has another sign than one by zero: constants that differ in it are not shared.
#[test]
fn zeros_of_both_signs_differ() {
    let (rules, frames) = random::case_of_rough_numbers(15_073_927_809_592_403_377, 4);
    let compiled = evaluate(&lower(&rules), &frames).unwrap();
    assert_eq!(compiled, reference::evaluate(&rules, &frames).unwrap());
}

/// Where the columns' blocks join, rates look back into the block before, or into what was kept of it: a log of several blocks has the same
/// leaves in one piece, in pieces that have no block before them, and frame by frame.
#[test]
fn blocks_of_a_long_log_join() {
    for seed in 0..60 {
        let (rules, mut frames) = random::case(seed, 3);
        let times = 9000 / frames.len + 1;
        for column in frames.columns.values_mut() {
            *column = column.repeat(times);
        }
        frames.len *= times;
        frames.stretches = std::iter::once(0..frames.len).collect();
        let graph = lower(&rules);
        let whole = evaluate(&graph, &frames).unwrap();
        assert_eq!(whole, evaluate_in_blocks(&graph, &frames, 700).unwrap(), "seed {seed}");
        assert_eq!(whole, stepped(&graph, &frames), "seed {seed}");
    }
}

/// The leaves of a log that comes in frame by frame.
pub fn stepped(graph: &Graph, frames: &Frames) -> Vec<Leaves> {
    let mut stepper = Stepper::new(graph, &frames.layout).unwrap();
    let sides: Vec<Option<Side>> = stepper.plan().trees.iter().map(|tree| tree.side).collect();
    let rows = rows(frames, &stepper);
    let stretch = |stretch: &Range<usize>| {
        let mut leaves = Leaves { frames: stretch.clone(), ..Leaves::default() };
        let mut emit = |tree: usize, run: Run| {
            let run = Run { start: run.start + stretch.start, end: run.end + stretch.start, ..run };
            append(sides[tree].map_or(&mut leaves.both, |side| leaves.hands.entry(side).or_default()), run);
        };
        for row in &rows[stretch.clone()] {
            stepper.push(row, &mut emit);
        }
        stepper.finish(&mut emit);
        leaves
    };
    frames.stretches.iter().map(stretch).collect()
}

/// A log frame by frame, as a run wants it.
fn rows(frames: &Frames, stepper: &Stepper) -> Vec<Vec<f64>> {
    let column = |key: &ColumnKey| frames.column(*key).unwrap_or(&[]);
    let columns: Vec<&[f64]> = stepper.plan().inputs.iter().map(column).collect();
    (0..frames.len)
        .map(|frame| columns.iter().map(|column| column.get(frame).copied().unwrap_or(0.0)).collect())
        .collect()
}

/// All shipped rules over a hand-over, frame by frame: the same leaves, and no memory is asked for once the run is made.
#[test]
fn a_live_log_takes_no_memory() {
    let loaded = load(&Request { files: vec!["bimanual.rules".into()], ..Request::default() });
    let (rules, scene) = (loaded.rules.unwrap(), "hand_over_left_to_right");
    let recording = world::teach(&world::scene(scene).unwrap(), &world::operator(scene).unwrap(), 4).unwrap();
    let frames = stream::frames(&recording, &rules.channels).unwrap();
    let graph = lower(&rules);
    assert_eq!(stepped(&graph, &frames), evaluate(&graph, &frames).unwrap());

    let mut stepper = Stepper::new(&graph, &frames.layout).unwrap();
    let rows = rows(&frames, &stepper);
    let mut runs = 0;
    let asked = allocation_counter::measure(|| {
        for row in &rows {
            stepper.push(row, &mut |_, _| runs += 1);
        }
        stepper.finish(&mut |_, _| runs += 1);
    });
    assert_eq!(asked.count_total, 0, "{asked:?}");
    assert!(runs > 10, "only {runs} runs in {} frames", frames.len);
}

/// A threshold is a number, not a column of them: a run of rules with thousands of thresholds is small.
#[test]
fn thresholds_take_no_columns() {
    let threshold = |at: usize| format!("speed > {at} mm/s");
    let signal = |at: usize| {
        let thresholds: Vec<String> = (1..=40).map(|of| threshold(40 * at + of)).collect();
        format!("  signal s{at} = {}\n", thresholds.join(" or "))
    };
    let signals: String = (0..100).map(signal).collect();
    let choices: String = (0..100).map(|at| format!("  s{at} => A\n")).collect();
    let rules = format!(
        "stream {{ for each hand {{ speed : scalar m/s }} }}\nprimitive A, B\nfor each hand {{\n{signals}}}\n\
         tree t for each hand {{\n{choices}  else => B\n}}\n"
    );
    let loaded = load_text("thresholds.rules", &rules);
    let rules = loaded.rules.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics));
    let hand = HandLayout { side: Side::Right, fingers: vec![], contacts: vec![], knows_distance: false };
    let layout = Layout { rate_hz: 1000.0, hands: vec![hand] };
    let graph = lower(&rules);
    let mut evaluator = None;
    let asked = allocation_counter::measure(|| evaluator = Some(Evaluator::new(&graph, &layout).unwrap()));
    assert!(evaluator.unwrap().plan().conditions.len() >= 4000);
    // The bits of a block are half a kilobyte a condition; a column is 32 kB.
    assert!(asked.bytes_max < 4000 * 4096, "{} bytes", asked.bytes_max);
}

/// The random cases are not trivial: they reach many different leaves and all kinds of operators.
#[test]
fn random_cases_are_worth_testing() {
    let mut changes = 0;
    let mut windows = 0;
    for seed in 0..200 {
        let (rules, frames) = random::case(seed, 3);
        let leaves = evaluate(&lower(&rules), &frames).unwrap();
        changes += leaves.iter().flat_map(|leaves| leaves.hands.values()).map(|runs| runs.len() - 1).sum::<usize>();
        windows += teachtree_engine::compiled::instantiate::instantiate(&lower(&rules), &frames.layout)
            .unwrap()
            .cost()
            .state_bytes;
    }
    assert!(changes > 1000, "the leaves change only {changes} times");
    assert!(windows > 10_000, "the cases have only {windows} bytes of memory");
}
