//! `other` on logs of one hand and of two.

use std::collections::BTreeMap;
use teachtree_base::hands::{Finger, Side};
use teachtree_engine::evaluator::evaluate;
use teachtree_engine::reference;
use teachtree_frames::frames::{ColumnKey, Frames, HandLayout, Layout};
use teachtree_language as language;
use teachtree_language::graph::lower;
use teachtree_language::rules::Rules;

fn rules(text: &str) -> Rules {
    let loaded = language::load_text("my.rules", text);
    loaded.rules.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics))
}

/// A log of the hands with their loads, in N.
fn log(rules: &Rules, loads: &[(Side, Vec<f64>)]) -> Frames {
    let len = loads[0].1.len();
    let hand = |(side, _): &(Side, _)| HandLayout {
        side: *side,
        fingers: vec![Finger::Thumb],
        contacts: Vec::new(),
        knows_distance: false,
    };
    let channel = rules.channels.iter().position(|channel| channel.name == "load").unwrap() as u32;
    let column = |(side, load): &(Side, Vec<f64>)| {
        let key = ColumnKey { channel, side: Some(*side), slot: 0, component: 0 };
        (key, load.clone())
    };
    Frames {
        layout: Layout { rate_hz: 1000.0, hands: loads.iter().map(hand).collect() },
        channels: rules.channels.clone(),
        columns: loads.iter().map(column).collect::<BTreeMap<_, _>>(),
        len,
        time: (0..len).map(|frame| frame as f64 / 1000.0).collect(),
        stretches: std::iter::once(0..len).collect(),
        ..Frames::default()
    }
}

#[test]
fn other_is_the_other_hand_and_nothing_where_there_is_none() {
    let text = "primitive More, Less
        for each hand {
          signal carried = load
          signal spare   = carried - other.carried          // seen from the other hand, `other` is this one
          latch  more    set spare > 0 N  clear other.spare >= 0 N
        }
        tree t for each hand { more => More  else => Less }";
    let rules = rules(text);
    let loads = [vec![1.0, 2.0, 3.0, 2.0, 2.0], vec![2.0, 1.0, 1.0, 2.0, 4.0]];
    let both = log(&rules, &[(Side::Left, loads[0].clone()), (Side::Right, loads[1].clone())]);
    let labels = |frames: &Frames, side: Side| -> Vec<String> {
        let compiled = evaluate(&lower(&rules), frames).unwrap();
        assert_eq!(compiled, reference::evaluate(&rules, frames).unwrap());
        let runs = compiled[0].hands[&side].iter();
        let labels = runs.flat_map(|run| (run.start..run.end).map(|_| rules.label_name(run.label.unwrap())));
        labels.collect()
    };
    assert_eq!(labels(&both, Side::Left), ["Less", "More", "More", "Less", "Less"]);
    assert_eq!(labels(&both, Side::Right), ["More", "Less", "Less", "Less", "More"]);
    // Alone, a hand has all of the load.
    let alone = log(&rules, &[(Side::Left, vec![0.0, 1.0, 1.0])]);
    assert_eq!(labels(&alone, Side::Left), ["Less", "More", "More"]);
}
