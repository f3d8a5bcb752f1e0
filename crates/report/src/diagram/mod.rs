//! Diagrams of rules: the trees as they are written, and which leaf can follow which; as text, dot, mermaid and SVG.
//!
//! What is drawn is plain data (`outline`, `transition_diagram`); each form is a file. Drawings are laid out by sums of heights and widths of texts: the
//! order is that of the rule file, so a layout that looks for an order of its own would only lose it.

mod dot;
mod matrix;
mod mermaid;
mod outline;
mod svg_tree;
mod text;
mod transition_diagram;

pub use outline::{Mark, Outline, Row, TakenPath, outline};
pub use transition_diagram::{CurrentLeaf, TransitionDiagram, transition_diagram};

use teachtree_base::meaning::Primitives;

/// Forms of a diagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DiagramFormat {
    /// For terminals.
    Text,
    /// For Graphviz.
    Dot,
    /// For Markdown that draws mermaid.
    Mermaid,
    /// A picture that stands alone.
    Svg,
}

/// Draws trees, one below the other.
pub fn trees(outlines: &[Outline], form: DiagramFormat) -> String {
    match form {
        DiagramFormat::Text => text::trees(outlines),
        DiagramFormat::Dot => dot::trees(outlines),
        DiagramFormat::Mermaid => mermaid::trees(outlines),
        DiagramFormat::Svg => svg_tree::trees(outlines),
    }
}

/// Draws which leaf can follow which, tree by tree.
pub fn transitions(all: &[TransitionDiagram], form: DiagramFormat) -> String {
    match form {
        DiagramFormat::Text => text::transitions(all),
        DiagramFormat::Dot => dot::transitions(all),
        DiagramFormat::Mermaid => mermaid::transitions(all),
        DiagramFormat::Svg => matrix::transitions(all),
    }
}

/// The caption of a diagram of transitions.
fn legend(of: &TransitionDiagram) -> Vec<String> {
    let mut caption = vec![
        "an arrow: a frame after the first leaf can give the second one, before settling; latches may have any state"
            .to_string(),
    ];
    if let Some(log) = &of.log {
        caption.push(format!("numbers: how often in {log}; arrows that it does not show are left out"));
    }
    if of.shown().any(|(_, arrow)| !arrow.is_decided) {
        caption.push("dashed: undecided within the limit of work".into());
    }
    if !of.never.is_empty() {
        caption.push(format!("never reached: {}", of.never.join(", ")));
    }
    caption
}

/// The color of a leaf: that of its primitive, or of paper.
fn fill(leaf: &str, primitives: &Primitives) -> String {
    use super::palette::{Color, color};
    let is_primitive = leaf.starts_with(char::is_uppercase);
    if is_primitive { color(leaf, primitives.does(leaf)) } else { Color(0xf1, 0xf3, 0xf6) }.hex()
}
