//! Diagrams of rules for terminals.

use super::outline::{Mark, Outline, Row};
use super::{TransitionDiagram, legend};
use std::fmt::Write;

/// Trees, one choice a line; on a frame, `yes` stands before what was taken and `no` before what was asked and not taken.
pub fn trees(outlines: &[Outline]) -> String {
    let mut text = String::new();
    for outline in outlines {
        if !text.is_empty() {
            text.push('\n');
        }
        let _ = writeln!(text, "tree {}", outline.title);
        if let Some(frame) = &outline.frame {
            let _ = writeln!(text, "{frame}");
        }
        for (at, row) in outline.rows.iter().enumerate() {
            let mark = match row.mark {
                _ if outline.frame.is_none() => "",
                Mark::Quiet => "    ",
                Mark::Passed => "no  ",
                Mark::Taken => "yes ",
            };
            let written = row.text();
            let indent = "  ".repeat(row.depth + 1);
            let _ = match &row.leaf {
                Some(leaf) => writeln!(text, "{mark}{indent}{written:width$} => {leaf}", width = width(outline, at)),
                None => writeln!(text, "{mark}{indent}{written}"),
            };
        }
    }
    text
}

/// How wide the choices are that stand around a leaf without a branch between.
fn width(outline: &Outline, at: usize) -> usize {
    let depth = outline.rows.get(at).map(|row| row.depth);
    let beside = |row: &&Row| Some(row.depth) == depth && row.leaf.is_some();
    let (above, below) = outline.rows.split_at(at);
    let around = above.iter().rev().take_while(beside).chain(below.iter().take_while(beside));
    around.map(|row| row.text().chars().count()).max().unwrap_or_default()
}

/// Which leaf can follow which, one leaf before a line.
pub fn transitions(all: &[TransitionDiagram]) -> String {
    let mut text = String::new();
    for of in all {
        if !text.is_empty() {
            text.push('\n');
        }
        let _ = writeln!(text, "tree {}: possible transitions", of.tree);
        for now in &of.now {
            let _ = writeln!(text, "{}, after {}", now.caption, now.before);
        }
        let width = of.drawn().map(|(_, leaf)| leaf.chars().count()).max().unwrap_or_default();
        for (from, leaf) in of.drawn() {
            let _ = writeln!(text, "{}", format!("  {leaf:width$} -> {}", line(of, from)).trim_end());
        }
        for caption in legend(of) {
            let _ = writeln!(text, "  {caption}");
        }
    }
    text
}

/// What can follow a leaf; where that is most of them, what cannot.
fn line(of: &TransitionDiagram, from: usize) -> String {
    let arrow = |to: usize| of.arrows.get(&(from, to));
    // Nothing follows nothing.
    let others = || of.leaves.iter().enumerate().skip(1).filter(|(to, _)| *to != from);
    let undecided = |to: usize| if arrow(to).is_some_and(|arrow| !arrow.is_decided) { "?" } else { "" };
    if of.log.is_some() {
        let shown = of.counts.range((from, 0)..(from + 1, 0));
        let shown = shown.filter_map(|((_, to), count)| Some(format!("{} {count}×", of.leaves.get(*to)?)));
        let shown: Vec<String> = shown.collect();
        return if shown.is_empty() { "nothing more".into() } else { shown.join(", ") };
    }
    let (can, cannot): (Vec<_>, Vec<_>) = others().partition(|(to, _)| arrow(*to).is_some());
    let decided = can.iter().all(|(to, _)| undecided(*to).is_empty());
    let names = |list: &[(usize, &String)]| -> String {
        list.iter().map(|(to, leaf)| format!("{leaf}{}", undecided(*to))).collect::<Vec<_>>().join(", ")
    };
    match (can.len(), cannot.len()) {
        (0, _) => "nothing else".into(),
        (2.., 0) if decided => "all others".into(),
        (can, cannot_be) if decided && can > 2 * cannot_be && can > 3 => format!("all others but {}", names(&cannot)),
        _ => names(&can),
    }
}
