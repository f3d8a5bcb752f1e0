//! How large graphs of `language` get for a log.

mod growth;

use std::fmt::Write;
use teachtree_base::hands::{Finger, Side};
use teachtree_engine::compiled::instantiate::instantiate;
use teachtree_engine::compiled::plan::Plan;
use teachtree_frames::frames::{HandLayout, Layout};
use teachtree_language::graph::{Graph, lower};
use teachtree_language::load_text;

fn graph(rules: &str) -> Graph {
    let loaded = load_text("test.rules", rules);
    lower(&loaded.rules.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics)))
}

/// Opens a graph for one right hand with a thumb at 1 kHz.
fn open_for_a_hand(graph: &Graph) -> Result<Plan, String> {
    open_at(graph, 1000.0)
}

fn open_at(graph: &Graph, rate_hz: f64) -> Result<Plan, String> {
    let hand =
        HandLayout { side: Side::Right, fingers: vec![Finger::Thumb], contacts: Vec::new(), knows_distance: false };
    let layout = Layout { rate_hz, hands: vec![hand] };
    instantiate(graph, &layout).map_err(|error| error.to_string())
}

/// A chain of declarations is as long as its author likes: nothing recurses along it, and nothing walks it again for each of its members.
#[test]
fn long_chains_of_signals_and_latches_compile() {
    let tree = |last: &str| format!("primitive A, B\ntree t for each hand {{ {last} => A\n else => B }}\n");
    let mut signals = String::from("stream { speed : scalar m/s }\nsignal s0 = speed above 2 m/s until below 1 m/s\n");
    let mut latches = String::from("stream { speed : scalar m/s }\nlatch s0 set speed > 2 m/s clear speed < 1 m/s\n");
    for at in 1..4000 {
        let before = at - 1;
        let _ = writeln!(signals, "signal s{at} = rises(s{before}) or falls(s{before})");
        let _ = writeln!(latches, "latch s{at} set s{before} clear not s{before}");
    }
    for rules in [signals + &tree("s3999"), latches + &tree("s3999")] {
        assert!(open_for_a_hand(&graph(&rules)).unwrap().conditions.len() > 4000);
    }
}

#[test]
fn windows_that_no_memory_holds_are_refused() {
    let rules = |duration: &str| {
        format!(
            "stream {{ speed : scalar m/s }}\nprimitive A, B\n\
             tree t for each hand {{ rate(speed, {duration}) > 1 m/s^2 => A\n else => B }}\n"
        )
    };
    assert!(open_for_a_hand(&graph(&rules("60 s"))).is_ok());
    let refused = load_text("test.rules", &rules("1000000 s")).diagnostics;
    assert!(refused.iter().any(|it| it.message == "a duration is at most an hour"), "{refused:?}");
    // An hour may be too long for a log that is fast, and many of them for any.
    let refused = open_at(&graph(&rules("3600 s")), 2000.0).unwrap_err();
    assert!(refused.contains("is 7200000 samples at 2000.0 Hz, expected at most 4000000"), "{refused}");
    let many: Vec<String> = (0..20).map(|at| format!("rate(speed, {} s) > 1 m/s^2", 3600 - at)).collect();
    let many = rules("1 s").replace("rate(speed, 1 s) > 1 m/s^2", &many.join(" and "));
    let refused = open_for_a_hand(&graph(&many)).unwrap_err();
    assert!(refused.contains("MB of state, expected at most 256 MB"), "{refused}");
}
