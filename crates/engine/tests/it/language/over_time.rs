//! Numbers over time: what `mean(x over last d)` and `earliest(x since c)` are, frame by frame, and what is said of mistakes in them.

use super::report;
use std::collections::BTreeMap;
use teachtree_base::hands::{Finger, Side};
use teachtree_engine::evaluator::evaluate;
use teachtree_engine::inspect::Inspector;
use teachtree_frames::frames::{ColumnKey, Frames, HandLayout, Layout};
use teachtree_language::format::format;
use teachtree_language::graph::lower;
use teachtree_language::{self as language, LoadedRules};

const RATE_HZ: f64 = 100.0;

fn load(value: &str) -> LoadedRules {
    let text = format!(
        "use \"hand_force.rules\"\nprimitive A, B\nfor each hand {{\n  signal x = target.velocity.z\n  \
         signal high = x > 1 m/s\n  signal value = {value}\n  latch reads set from(A) clear high\n}}\n\
         tree t for each hand {{ high and not reads => A  else => B }}\n"
    );
    language::load_text("over_time.rules", &text)
}

/// The value on every frame of a log at 100 Hz in which the velocity upwards is `x`, the speed is that too, and the target changes as listed.
fn on_frames(value: &str, x: &[f64], targets: &[f64]) -> Vec<f64> {
    let loaded = load(value);
    let printed = report(&loaded);
    let rules = loaded.rules.unwrap_or_else(|| panic!("{printed}"));
    let hand =
        HandLayout { side: Side::Right, fingers: Finger::ALL.to_vec(), contacts: Vec::new(), knows_distance: false };
    let layout = Layout { rate_hz: RATE_HZ, hands: vec![hand] };
    let mut columns = BTreeMap::new();
    for (spec, channel) in rules.channels.iter().zip(0..) {
        let slots = if spec.axis.is_some() { Finger::ALL.len() } else { 1 };
        for slot in 0..slots {
            for component in 0..spec.shape.components().len() {
                let key = ColumnKey {
                    channel,
                    side: spec.per_hand.then_some(Side::Right),
                    slot: slot as u32,
                    component: component as u32,
                };
                let column = match spec.name.as_str() {
                    "target" => targets.to_vec(),
                    "target.velocity" if component == 2 => x.to_vec(),
                    _ => vec![0.0; x.len()],
                };
                columns.insert(key, column);
            }
        }
    }
    let frames = Frames {
        layout,
        channels: rules.channels.clone(),
        columns,
        len: x.len(),
        time: (0..x.len()).map(|frame| frame as f64 / RATE_HZ).collect(),
        stretches: std::iter::once(0..x.len()).collect(),
        objects: vec!["cube".into(), "ball".into()],
        ..Frames::default()
    };
    let leaves = evaluate(&lower(&rules), &frames).unwrap();
    let mut inspector = Inspector::new(&rules, &frames, &leaves[0]);
    let signal = rules.signals.iter().find(|signal| signal.name == "value").unwrap();
    let column = inspector.column(&signal.expr, Some(Side::Right)).unwrap();
    (0..x.len()).map(|frame| column.number(0, frame)).collect()
}

fn constant(value: &str, x: &[f64]) -> Vec<f64> {
    on_frames(value, x, &vec![0.0; x.len()])
}

const X: [f64; 23] = [
    0.5, 2.0, 0.25, 0.5, 1.5, 3.0, 0.0, -1.0, -2.5, 4.0, 1.25, 0.5, 0.5, 2.0, 2.5, 0.5, 1.5, -0.5, 0.25, 8.0, 0.5, 1.0,
    -3.0,
];

fn close(found: &[f64], wanted: &[f64]) {
    let near = |(found, wanted): (&f64, &f64)| (found - wanted).abs() < 1e-12;
    assert!(found.len() == wanted.len() && found.iter().zip(wanted).all(near), "{found:?}\n{wanted:?}");
}

#[test]
fn the_last_samples_are_looked_at_as_far_as_they_are_there() {
    // 50 ms are 5 samples.
    let last = |frame: usize| &X[(frame + 1).saturating_sub(5)..=frame];
    let each = |f: &dyn Fn(&[f64]) -> f64| (0..X.len()).map(|frame| f(last(frame))).collect::<Vec<f64>>();
    let sum = |last: &[f64]| last.iter().sum::<f64>();
    close(&constant("mean(x over last 50 ms)", &X), &each(&|last| sum(last) / last.len() as f64));
    close(&constant("integral(x over last 50 ms)", &X), &each(&|last| sum(last) / RATE_HZ));
    close(&constant("min(x over last 50 ms)", &X), &each(&|last| last.iter().copied().fold(f64::INFINITY, f64::min)));
    close(&constant("max(x over last 50 ms)", &X), &each(&|last| last.iter().copied().fold(-1e9, f64::max)));
    close(&constant("earliest(x over last 50 ms)", &X), &each(&|last| last[0]));
    let share = |last: &[f64]| last.iter().filter(|x| **x > 1.0).count() as f64;
    close(&constant("mean(high over last 50 ms)", &X), &each(&|last| share(last) / last.len() as f64));
    close(&constant("integral(high over last 50 ms)", &X), &each(&|last| share(last) / RATE_HZ));
    close(&constant("earliest(x over last 10 ms)", &X), &X);
}

#[test]
fn since_looks_at_the_samples_from_where_the_condition_last_began() {
    // Where `x` exceeds 1 anew: the condition may cease, and nothing begins before frame 1.
    let begin = |frame: usize| (0..=frame).rev().find(|at| X[*at] > 1.0 && (*at == 0 || X[at - 1] <= 1.0));
    let each = |before: &dyn Fn(f64) -> f64, f: &dyn Fn(&[f64]) -> f64| {
        let value = |frame: usize| begin(frame).map_or_else(|| before(X[frame]), |begin| f(&X[begin..=frame]));
        (0..X.len()).map(value).collect::<Vec<f64>>()
    };
    let sum = |since: &[f64]| since.iter().sum::<f64>();
    assert_eq!((begin(0), begin(3), begin(6)), (None, Some(1), Some(4)));
    close(&constant("earliest(x since high)", &X), &each(&|x| x, &|since| since[0]));
    close(&constant("max(x since high)", &X), &each(&|x| x, &|since| since.iter().copied().fold(-1e9, f64::max)));
    close(&constant("min(x since high)", &X), &each(&|x| x, &|since| since.iter().copied().fold(1e9, f64::min)));
    close(&constant("mean(x since high)", &X), &each(&|x| x, &|since| sum(since) / since.len() as f64));
    close(&constant("integral(x since high)", &X), &each(&|_| 0.0, &|since| sum(since) / RATE_HZ));
    // The time since something began.
    close(&constant("integral(true since high)", &X), &each(&|_| 0.0, &|since| since.len() as f64 / RATE_HZ));
}

#[test]
fn a_new_target_begins_anew() {
    let targets: Vec<f64> = (0..X.len()).map(|frame| f64::from(u8::from(frame >= 7))).collect();
    let memory = |frame: usize| if frame >= 7 { 7 } else { 0 };
    let wanted: Vec<f64> = (0..X.len()).map(|frame| X[(frame + 1).saturating_sub(5).max(memory(frame))]).collect();
    close(&on_frames("earliest(x over last 50 ms)", &X, &targets), &wanted);
    let since = on_frames("x - earliest(x since high)", &X, &targets);
    // On frame 6 `x` is 1.5 less than on frame 4; on 7 and 8 nothing has begun.
    close(&since[6..10], &[-1.5, 0.0, 0.0, 0.0]);
}

/// Nothing is taken away from a sum, so nothing of a large number remains.
#[test]
fn a_number_that_has_left_the_window_leaves_nothing_behind() {
    for peak in [1e300, f64::INFINITY, f64::NAN] {
        let x: Vec<f64> = (0..40).map(|frame| if frame == 12 { peak } else { 0.1 }).collect();
        let quiet: Vec<f64> = constant("mean(x over last 50 ms)", &x);
        for (frame, mean) in quiet.iter().enumerate() {
            let inside = (12..17).contains(&frame);
            assert_eq!(!inside, (mean - 0.1).abs() < 1e-15, "{peak}, frame {frame}: {mean}");
        }
    }
}

#[test]
fn mistakes_are_explained() {
    let mut missed = Vec::new();
    for (value, wanted) in [
        ("norm(target.velocity over last 1 s)", "`norm` does not take samples over time"),
        ("count(high over last 1 s)", "`(condition) within last 200 ms` tests whether it held"),
        ("mean(x over last 0 s)", "a duration is greater than 0"),
        ("mean(x over last 3 N)", "E303"),
        ("mean(target over last 1 s)", "`mean` over time takes a number, a vec3 or a condition"),
        ("max(target.velocity over last 1 s)", "`norm(v)` is the length of a vec3"),
        ("earliest(high over last 1 s)", "`earliest` over time takes a number, a vec3 or a rotation"),
        ("mean(x since x)", "`since` takes a condition"),
        ("mean((x) within last 1 s)", "`max(x over last 200 ms)` is the largest of the last samples"),
        ("earliest(x)", "`earliest` takes samples over time"),
        ("mean(reads over last 1 s)", "a signal cannot read the latch"),
        ("mean(x over last)", "E101"),
        ("mean(x * 2 over first 1 s)", "E101"),
        ("maen(x over last 1 s)", "did you mean `mean`?"),
        ("integral(integral(integral(target.velocity.z over last 1 s) over last 1 s) over last 1 s) > 0 s", "E301"),
    ] {
        let printed = report(&load(value));
        if !printed.contains(wanted) {
            missed.push(format!("{value}: `{wanted}` is not in\n{printed}"));
        }
    }
    assert!(missed.is_empty(), "{}", missed.join("\n"));
    let tree = "use \"hand_force.rules\"\nprimitive A, B\ntree t for each hand {\n  \
                norm(target.position - earliest(target.position since from(A))) > 1 m => A\n  else => B\n}\n";
    let printed = report(&language::load_text("tree.rules", tree));
    assert!(printed.contains("a summary over time cannot be applied to `from`"), "{printed}");
}

#[test]
fn proofs_know_what_is_made_of_numbers_that_are_never_negative() {
    for (value, finding) in [
        ("mean(high over last 1 s) > 120 %", Some("W301")),
        ("integral(high since high) < 0 s", Some("W301")),
        ("min(norm(target.velocity) since high) < -1 m/s", Some("W301")),
        ("min(x over last 1 s) < -1 m/s", None),
        ("max(x over last 0.1 ms) > 1 m/s", Some("W303")),
        // The same window is one quantity.
        ("max(x over last 1 s) > 2 m/s and max(x over last 1 s) < 1 m/s", Some("W301")),
        ("max(x over last 1 s) > 2 m/s and max(x over last 2 s) < 1 m/s", None),
        ("max(x since high) > 2 m/s and max(x since not high) < 1 m/s", None),
    ] {
        let printed = report(&load(value));
        let found = ["W301", "W302", "W303"].into_iter().find(|code| printed.contains(code));
        assert_eq!(found, finding, "{value}:\n{printed}");
    }
}

#[test]
fn they_are_formatted_and_their_words_stay_names() {
    let text = "for each hand {\n  signal since=load>1 N\n  signal over = mean( load   over   last 200 ms )> 2 N\n  \
                signal both = max(load since since) > 2 N and over\n}\n";
    let wanted = "for each hand {\n  signal since = load > 1 N\n  signal over = mean(load over last 200 ms) > 2 N\n  \
                  signal both = max(load since since) > 2 N and over\n}\n";
    assert_eq!(format(text).unwrap(), wanted);
}
