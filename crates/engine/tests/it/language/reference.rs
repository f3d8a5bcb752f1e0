//! Examples of the language reference, run on logs.

use std::collections::BTreeMap;
use teachtree_base::hands::{Finger, Side};
use teachtree_engine::evaluator::evaluate;
use teachtree_frames::frames::{ColumnKey, Frames, HandLayout, Layout};
use teachtree_language as language;
use teachtree_language::graph::lower;

#[test]
fn a_lasting_rest_begins_with_its_first_frame() {
    let text = "primitive Move, Rest, LateRest
        for each hand {
          signal moving  = norm(target.velocity) > 10 mm/s
          signal rested  = (not moving) for 300 ms
          signal resting = (not moving) lasting 300 ms
        }
        tree t for each hand { rested => LateRest  resting => Rest  else => Move }";
    let rules = language::load_text("my.rules", text).rules.unwrap();
    let len = 2000;
    // Too short a rest, then one that is long enough.
    let rests = [200..450, 900..1500];
    let speed: Vec<f64> =
        (0..len).map(|at| if rests.iter().any(|rest| rest.contains(&at)) { 0.0 } else { 0.1 }).collect();
    let column = |component: u32| {
        let key = ColumnKey { channel: 0, side: Some(Side::Right), slot: 0, component };
        (key, if component == 0 { speed.clone() } else { vec![0.0; len] })
    };
    let hand =
        HandLayout { side: Side::Right, fingers: vec![Finger::Thumb], contacts: Vec::new(), knows_distance: false };
    let frames = Frames {
        layout: Layout { rate_hz: 1000.0, hands: vec![hand] },
        channels: rules.channels.clone(),
        columns: (0..3).map(column).collect::<BTreeMap<_, _>>(),
        len,
        time: (0..len).map(|frame| frame as f64 / 1000.0).collect(),
        stretches: std::iter::once(0..len).collect(),
        objects: vec!["cube".into()],
        ..Frames::default()
    };
    let leaves = evaluate(&lower(&rules), &frames).unwrap();
    let runs: Vec<(usize, usize, String)> = leaves[0].hands[&Side::Right]
        .iter()
        .map(|run| (run.start, run.end, rules.label_name(run.label.unwrap())))
        .collect();
    let wanted = [(0, 900, "Move"), (900, 1199, "Rest"), (1199, 1500, "LateRest"), (1500, len, "Move")];
    assert_eq!(runs, wanted.map(|(start, end, name)| (start, end, name.to_string())));
}
