//! Diagrams of rules for Graphviz: `dot -Tsvg`.

use super::outline::{Mark, Outline, Row};
use super::{TransitionDiagram, fill, legend};
use std::fmt::Write;

const HEAD: &str = "digraph rules {\n  rankdir=LR;\n  node [fontname=\"Helvetica\", fontsize=11, shape=box, style=\"rounded,filled\", fillcolor=\"#ffffff\"];\n  edge [fontname=\"Helvetica\", fontsize=10, color=\"#5b6472\"];\n";
const TAKEN: &str = "color=\"#1a56db\", penwidth=3";

/// Trees: down is no, right is yes.
pub fn trees(outlines: &[Outline]) -> String {
    let mut text = HEAD.to_string();
    for (number, outline) in outlines.iter().enumerate() {
        let title = outline.frame.as_ref().map_or(outline.title.clone(), |frame| format!("{}\n{frame}", outline.title));
        let _ = writeln!(text, "  subgraph cluster_{number} {{\n    label={};", quoted(&title));
        for (at, row) in outline.rows.iter().enumerate() {
            tree_row(&mut text, outline, number, at, row);
        }
        text.push_str("  }\n");
    }
    text.push_str("}\n");
    text
}

fn tree_row(text: &mut String, outline: &Outline, number: usize, at: usize, row: &Row) {
    let name = |at: usize| format!("t{number}_{at}");
    let node = name(at);
    let thick = if row.mark == Mark::Taken { format!(", {TAKEN}") } else { String::new() };
    let _ = writeln!(text, "    {node} [label={}, tooltip={}{thick}];", quoted(&row.text()), quoted(&row.place));
    let yes = if row.condition == "else" { "" } else { "yes" };
    let attributes = |label: &str, marked: bool| {
        let thick = if marked { format!(", {TAKEN}") } else { String::new() };
        format!("[label={}{thick}]", quoted(label))
    };
    let taken = row.mark == Mark::Taken;
    match &row.leaf {
        Some(leaf) => {
            let (label, color) = (quoted(leaf), quoted(&fill(leaf, &outline.primitives)));
            let _ = writeln!(text, "    {node}_leaf [label={label}, fillcolor={color}{thick}];");
            let _ = writeln!(text, "    {node} -> {node}_leaf {};", attributes(yes, taken));
        }
        None => {
            let _ = writeln!(text, "    {node} -> {} {};", name(at + 1), attributes(yes, taken));
        }
    }
    if let Some(next) = outline.otherwise(at) {
        let _ = writeln!(text, "    {node} -> {} {};", name(next), attributes("no", row.mark == Mark::Passed));
        // What is asked one after the other stands one below the other.
        let _ = writeln!(text, "    {{ rank=same; {node}; {}; }}", name(next));
    }
}

/// Which leaf can follow which.
pub fn transitions(all: &[TransitionDiagram]) -> String {
    let mut text = HEAD.to_string();
    for (number, of) in all.iter().enumerate() {
        let caption: Vec<String> = of.now.iter().map(|now| now.caption.clone()).chain(legend(of)).collect();
        let title = format!("{}\n{}", of.tree, caption.join("\n"));
        let _ = writeln!(text, "  subgraph cluster_{number} {{\n    label={};", quoted(&title));
        for (at, leaf) in of.drawn() {
            let thick = if of.is_now(leaf) { format!(", {TAKEN}") } else { String::new() };
            let (label, color) = (quoted(leaf), quoted(&fill(leaf, &of.primitives)));
            let _ = writeln!(text, "    t{number}_{at} [label={label}, fillcolor={color}{thick}];");
        }
        for (ends, arrow) in of.shown() {
            let mut attributes = Vec::new();
            attributes.extend(of.counts.get(&ends).map(|count| format!("label=\"{count}\"")));
            attributes.extend((!arrow.is_decided).then(|| "style=dashed".to_string()));
            attributes.extend(of.is_current_transition(ends).then(|| TAKEN.to_string()));
            attributes.push(format!("tooltip={}", quoted(&arrow.places.join(", "))));
            let (from, to) = ends;
            let _ = writeln!(text, "    t{number}_{from} -> t{number}_{to} [{}];", attributes.join(", "));
        }
        text.push_str("  }\n");
    }
    text.push_str("}\n");
    text
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n"))
}
