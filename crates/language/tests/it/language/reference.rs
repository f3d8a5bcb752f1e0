//! The language reference: every rule block in it is a rule file that loads.

use super::report;
use teachtree_base::channels::DERIVED;
use teachtree_base::units::UNITS;
use teachtree_language::{self as language, SHIPPED};

const REFERENCE: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../grammar/README.md"));

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
    let words = words.chain(SHIPPED.iter().map(|(name, _)| *name));
    for word in words {
        assert!(REFERENCE.contains(&format!("`{word}`")), "`{word}` is not in the reference");
    }
}

#[test]
fn the_page_of_check_shows_what_is_reported() {
    let page = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/check.md"));
    let blocks: Vec<&str> = page.split("```").collect();
    let throw =
        blocks.iter().find_map(|block| block.strip_prefix("text\n").filter(|text| text.contains("primitive Throw")));
    let printed = report(&language::load_text("throw.rules", throw.unwrap()));
    let printed: Vec<&str> = printed.lines().map(str::trim_end).collect();
    let page: Vec<&str> = page.lines().map(str::trim_end).collect();
    let printed = printed.join("\n");
    assert!(page.join("\n").contains(printed.trim_end()), "docs/check.md shows something else than:\n{printed}");
}
