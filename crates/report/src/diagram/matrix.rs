//! Which leaf can follow which as a picture: a row for each leaf before, a column for each leaf that follows.
//!
//! In the trees of hands nearly every leaf can follow every other one, since everything may change from one frame to the next: some two hundred
//! arrows between fifteen names. As a matrix they can be read, and what cannot be is seen at once.

use super::{TransitionDiagram, fill, legend};
use crate::svg::{escape, length};

/// Sizes of a cell, and of a letter of the names.
const CELL: f64 = 30.0;
const LETTER: f64 = 7.4;
const MARGIN: f64 = 18.0;
const LINE: f64 = 18.0;

const STYLE: &str = "svg{background:#fff;fill:#1b1f27;font:12px system-ui,\"Segoe UI\",Roboto,\"DejaVu Sans\",sans-serif}\
.title{font-size:15px;font-weight:600}.caption{font-weight:600;fill:#1a56db}.quiet{fill:#5b6472}.middle{text-anchor:middle}\
.cell{fill:#fff;stroke:#d9dee6}.self{fill:#eef1f5;stroke:#d9dee6}.seen{stroke:#d9dee6}.leaf{stroke:#5b6472}\
.can{fill:#5b6472}.perhaps{fill:none;stroke:#5b6472;stroke-dasharray:3 2}.taken{stroke:#1a56db;stroke-width:3}";

/// Draws the matrices, one below the other.
pub fn transitions(all: &[TransitionDiagram]) -> String {
    let mut body = String::new();
    let mut right = 0.0_f64;
    let mut y = MARGIN;
    for of in all {
        let mut line = |class: &str, text: &str, y: &mut f64| {
            *y += LINE;
            body.push_str(&format!(
                "<text class=\"{class}\" x=\"{MARGIN}\" y=\"{}\">{}</text>\n",
                length(*y - 4.0),
                escape(text)
            ));
            right = right.max(2.0 * MARGIN + text.chars().count() as f64 * LETTER);
        };
        line("title", &format!("{}: possible transitions", of.tree), &mut y);
        for now in &of.now {
            line("caption", &format!("{}, after {}", now.caption, now.before), &mut y);
        }
        line("quiet", "rows: the previous leaf; columns: the next leaf", &mut y);
        for caption in legend(of) {
            let caption = caption
                .replace("an arrow: a frame", "a dot: a frame")
                .replace("; arrows that it does not show are left out", "");
            line("quiet", &caption, &mut y);
        }
        let (drawn, width, bottom) = matrix(of, y + 8.0);
        body.push_str(&drawn);
        right = right.max(width);
        y = bottom + MARGIN;
    }
    let (width, height) = (length(right.ceil()), length(y.ceil()));
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\">\n<style>{STYLE}</style>\n{body}</svg>\n"
    )
}

/// Draws one of them below `top`: the drawing, its right and its bottom.
fn matrix(of: &TransitionDiagram, top: f64) -> (String, f64, f64) {
    let names: Vec<(usize, &str)> = of.drawn().collect();
    // Nothing follows nothing: `none` is a row only.
    let columns: Vec<(usize, &str)> = names.iter().copied().filter(|(at, _)| *at > 0).collect();
    let longest = names.iter().map(|(_, name)| name.chars().count()).max().unwrap_or_default() as f64 * LETTER + 14.0;
    let most = of.counts.values().copied().max().unwrap_or(1).max(1) as f64;
    let (left, first) = (MARGIN + longest + 6.0, top + longest + 6.0);
    let mut drawn = String::new();
    for (number, (_, name)) in columns.iter().enumerate() {
        let x = left + number as f64 * CELL;
        // Names of columns read upwards.
        drawn.push_str(&format!(
            "<g transform=\"translate({} {})rotate(-90)\">{}</g>\n",
            length(x + 3.0),
            length(first - 6.0),
            pill(of, name, longest)
        ));
    }
    for (row, (from, name)) in names.iter().enumerate() {
        let y = first + row as f64 * CELL;
        drawn.push_str(&format!(
            "<g transform=\"translate({MARGIN} {})\">{}</g>\n",
            length(y + 3.0),
            pill(of, name, longest)
        ));
        for (column, (to, other)) in columns.iter().enumerate() {
            let x = left + column as f64 * CELL;
            drawn.push_str(&cell(of, ((*from, name), (*to, other)), (x, y), most));
        }
    }
    (drawn, left + columns.len() as f64 * CELL + MARGIN, first + names.len() as f64 * CELL)
}

fn pill(of: &TransitionDiagram, name: &str, width: f64) -> String {
    let class = if of.is_now(name) { "leaf taken" } else { "leaf" };
    format!(
        "<rect class=\"{class}\" width=\"{}\" height=\"{}\" rx=\"12\" fill=\"{}\"/><text x=\"8\" y=\"16\">{}</text>",
        length(width),
        length(CELL - 6.0),
        fill(name, &of.primitives),
        escape(name)
    )
}

/// A cell: a dot where the one can follow the other, a dashed ring where that is undecided, a number where it did.
fn cell(
    of: &TransitionDiagram,
    ((from, name), (to, other)): ((usize, &str), (usize, &str)),
    (x, y): (f64, f64),
    most: f64,
) -> String {
    let arrow = of.arrows.get(&(from, to));
    let count = of.counts.get(&(from, to));
    let class = match (from == to, count, of.is_current_transition((from, to))) {
        (true, ..) => "self",
        (_, Some(_), true) => "seen taken",
        (_, Some(_), false) => "seen",
        (_, None, _) => "cell",
    };
    // The more often, the darker; a cell seen once is still seen.
    let shade = count.map_or(String::new(), |count| {
        format!(
            " fill=\"#f7a14a\" fill-opacity=\"{}\"",
            length((0.2 + 0.8 * *count as f64 / most).min(1.0) * 10.0 / 10.0)
        )
    });
    let places = arrow.map_or(String::new(), |arrow| format!("\n{}", arrow.places.join("\n")));
    let (cx, cy) = (length(x + CELL / 2.0), length(y + CELL / 2.0));
    let sign = match (arrow, count) {
        _ if from == to => String::new(),
        (_, Some(count)) => {
            format!("<text class=\"middle\" x=\"{cx}\" y=\"{}\">{count}</text>", length(y + CELL / 2.0 + 4.0))
        }
        (Some(arrow), None) if arrow.is_decided => format!("<circle class=\"can\" cx=\"{cx}\" cy=\"{cy}\" r=\"3\"/>"),
        (Some(_), None) => format!("<circle class=\"perhaps\" cx=\"{cx}\" cy=\"{cy}\" r=\"7\"/>"),
        (None, None) => String::new(),
    };
    format!(
        "<g><title>{}</title><rect class=\"{class}\" x=\"{}\" y=\"{}\" width=\"{CELL}\" height=\"{CELL}\"{shade}/>{sign}</g>\n",
        escape(&format!("{name} to {other}{places}")),
        length(x),
        length(y)
    )
}
