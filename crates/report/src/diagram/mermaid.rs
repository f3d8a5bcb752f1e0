//! Diagrams of rules as mermaid, which GitHub and GitLab draw in Markdown.

use super::outline::{Mark, Outline};
use super::{TransitionDiagram, fill, legend};
use std::fmt::Write;

const TAKEN: &str = "stroke:#1a56db,stroke-width:3px";

/// Trees.
pub fn trees(outlines: &[Outline]) -> String {
    let mut text = "flowchart LR\n".to_string();
    let mut edges = Edges::default();
    for (number, outline) in outlines.iter().enumerate() {
        let title =
            outline.frame.as_ref().map_or(outline.title.clone(), |frame| format!("{} — {frame}", outline.title));
        let _ = writeln!(text, "  subgraph s{number}[{}]", quoted(&title));
        for (at, row) in outline.rows.iter().enumerate() {
            let node = format!("t{number}_{at}");
            let taken = row.mark == Mark::Taken;
            let _ = writeln!(text, "    {node}[{}]", quoted(&row.text()));
            if taken {
                let _ = writeln!(text, "    style {node} {TAKEN}");
            }
            let yes = if row.condition == "else" { "" } else { "yes" };
            match &row.leaf {
                Some(leaf) => {
                    let _ = writeln!(text, "    {node}_leaf([{}])", quoted(leaf));
                    let thick = if taken { format!(",{TAKEN}") } else { String::new() };
                    let _ = writeln!(
                        text,
                        "    style {node}_leaf fill:{},color:#16191f{thick}",
                        fill(leaf, &outline.primitives)
                    );
                    edges.add(&mut text, &node, &format!("{node}_leaf"), "-->", yes, taken);
                }
                None => edges.add(&mut text, &node, &format!("t{number}_{}", at + 1), "-->", yes, taken),
            }
            if let Some(next) = outline.otherwise(at) {
                edges.add(&mut text, &node, &format!("t{number}_{next}"), "-->", "no", row.mark == Mark::Passed);
            }
        }
        text.push_str("  end\n");
    }
    edges.finish(&mut text);
    text
}

/// Which leaf can follow which.
pub fn transitions(all: &[TransitionDiagram]) -> String {
    let mut text = "flowchart LR\n".to_string();
    let mut edges = Edges::default();
    for (number, of) in all.iter().enumerate() {
        let title: Vec<String> =
            std::iter::once(of.tree.clone()).chain(of.now.iter().map(|now| now.caption.clone())).collect();
        for caption in legend(of) {
            let _ = writeln!(text, "  %% {caption}");
        }
        let _ = writeln!(text, "  subgraph s{number}[{}]", quoted(&title.join(" — ")));
        for (at, leaf) in of.drawn() {
            let _ = writeln!(text, "    t{number}_{at}([{}])", quoted(leaf));
            let thick = if of.is_now(leaf) { format!(",{TAKEN}") } else { String::new() };
            let _ = writeln!(text, "    style t{number}_{at} fill:{},color:#16191f{thick}", fill(leaf, &of.primitives));
        }
        for (ends, arrow) in of.shown() {
            let count = of.counts.get(&ends).map_or(String::new(), ToString::to_string);
            let line = if arrow.is_decided { "-->" } else { "-.->" };
            let (from, to) = (format!("t{number}_{}", ends.0), format!("t{number}_{}", ends.1));
            edges.add(&mut text, &from, &to, line, &count, of.is_current_transition(ends));
        }
        text.push_str("  end\n");
    }
    edges.finish(&mut text);
    text
}

/// Edges are styled by their number, at the end.
#[derive(Default)]
struct Edges {
    count: usize,
    taken: Vec<String>,
}

impl Edges {
    fn add(&mut self, text: &mut String, from: &str, to: &str, line: &str, label: &str, taken: bool) {
        let label = if label.is_empty() { String::new() } else { format!("|{label}|") };
        let _ = writeln!(text, "    {from} {line}{label} {to}");
        if taken {
            self.taken.push(self.count.to_string());
        }
        self.count += 1;
    }

    fn finish(&self, text: &mut String) {
        if !self.taken.is_empty() {
            let _ = writeln!(text, "  linkStyle {} {TAKEN}", self.taken.join(","));
        }
    }
}

/// A text in quotes; what mermaid would take for its own is written as an entity.
fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for letter in text.chars() {
        match letter {
            '"' => quoted.push_str("#quot;"),
            '#' => quoted.push_str("#35;"),
            '<' => quoted.push_str("#lt;"),
            '>' => quoted.push_str("#gt;"),
            '&' => quoted.push_str("#amp;"),
            other => quoted.push(other),
        }
    }
    quoted.push('"');
    quoted
}
