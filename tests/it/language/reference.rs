//! The language reference: every rule block in it is a rule file that loads.

use super::report;
use std::collections::BTreeMap;
use teachtree_base::channels::DERIVED;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::units::UNITS;
use teachtree_engine::evaluator::evaluate;
use teachtree_frames::frames::{ColumnKey, Frames, HandLayout, Layout};
use teachtree_language::graph::lower;
use teachtree_language::{self as language, SHIPPED, codes};

const REFERENCE: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/grammar/README.md"));

/// The blocks fenced as `rules`, each with the line of the reference on which it begins.
fn blocks() -> Vec<(usize, String)> {
    let mut blocks = Vec::new();
    let mut open: Option<(usize, String)> = None;
    for (at, line) in REFERENCE.lines().enumerate() {
        match &mut open {
            Some(_) if line == "```" => blocks.extend(open.take()),
            Some((_, text)) => {
                text.push_str(line);
                text.push('\n');
            }
            None if line == "```rules" => open = Some((at + 2, String::new())),
            None => {}
        }
    }
    assert!(open.is_none(), "a block is not closed");
    blocks
}

#[test]
fn every_rule_block_loads() {
    let blocks = blocks();
    assert!(blocks.len() >= 10);
    for (line, text) in blocks {
        let loaded = language::load_text(&format!("reference line {line}"), &text);
        assert!(loaded.rules.is_some(), "{}", report(&loaded));
    }
}

#[test]
fn everything_built_in_is_described() {
    let words = DERIVED.iter().map(|channel| channel.name).chain(UNITS.iter().map(|unit| unit.symbol));
    let words = words.chain(SHIPPED.iter().map(|(name, _)| *name)).chain(codes::ALL.iter().map(|(code, _)| *code));
    for word in words {
        assert!(REFERENCE.contains(&format!("`{word}`")), "`{word}` is not in the reference");
    }
}

#[test]
fn the_page_of_check_shows_what_is_reported() {
    let page = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/check.md"));
    let blocks: Vec<&str> = page.split("```").collect();
    let throw =
        blocks.iter().find_map(|block| block.strip_prefix("text\n").filter(|text| text.contains("primitive Throw")));
    let printed = report(&language::load_text("throw.rules", throw.unwrap()));
    let printed: Vec<&str> = printed.lines().map(str::trim_end).collect();
    let page: Vec<&str> = page.lines().map(str::trim_end).collect();
    let printed = printed.join("\n");
    assert!(page.join("\n").contains(printed.trim_end()), "docs/check.md shows something else than:\n{printed}");
}

#[test]
fn a_latch_that_looks_ahead_dates_a_rest_back_to_its_beginning() {
    let text = "primitive Move, Rest, LateRest
        for each hand {
          signal moving  = norm(target.velocity) > 10 mm/s
          signal rested  = (not moving) for 300 ms
          latch  resting set not ((moving) within next 300 ms)  clear moving
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
