//! Trees as a picture: choices one below the other as they are written, leaves to the right. To the right is yes, down is no.

use super::fill;
use super::outline::{Mark, Outline, Row};
use crate::palette::INK;
use crate::svg::{escape, length};

/// Advance of a letter of the font for code, and the height of a line of it.
const LETTER: f64 = 7.25;
const LINE: f64 = 16.0;
/// Letters of a line of a condition.
const LONGEST: usize = 66;
/// Room around the text of a box.
const PAD: f64 = 9.0;
/// How far a branch is indented, and the distance of the lines from the left of a box.
const INDENT: f64 = 36.0;
const SPINE: f64 = 14.0;
/// Room between rows, and from a box to its leaf.
const GAP: f64 = 15.0;
const ARROW: f64 = 44.0;
/// Around everything.
const MARGIN: f64 = 18.0;
/// Height of the titles of a tree.
const TITLE: f64 = 26.0;

const STYLE: &str = "svg{background:#fff;fill:#1b1f27;font:12px ui-monospace,\"DejaVu Sans Mono\",Menlo,Consolas,monospace}\
.title{font:600 15px system-ui,\"Segoe UI\",Roboto,\"DejaVu Sans\",sans-serif}.name{font-weight:700}\
.caption{font:600 13px system-ui,\"Segoe UI\",Roboto,\"DejaVu Sans\",sans-serif;fill:#1a56db}\
.box{fill:#fff;stroke:#8a94a3}.leaf{stroke:#5b6472}.line{stroke:#8a94a3;fill:none}.hint{font-size:10px;fill:#5b6472}\
.taken{stroke:#1a56db;stroke-width:3}.off{opacity:.38}.tip{fill:#8a94a3}.tip.taken{fill:#1a56db;stroke:none}";

/// A row with its place.
struct PlacedRow<'a> {
    row: &'a Row,
    lines: Vec<String>,
    x: f64,
    y: f64,
    width: f64,
    height: f64,
}

/// Draws trees, one below the other.
pub fn trees(outlines: &[Outline]) -> String {
    let mut body = String::new();
    let mut right = 0.0_f64;
    let mut y = MARGIN;
    for outline in outlines {
        y += TITLE;
        body.push_str(&format!(
            "<text class=\"title\" x=\"{MARGIN}\" y=\"{}\">{}</text>\n",
            length(y - 8.0),
            escape(&outline.title)
        ));
        right = right.max(MARGIN * 2.0 + outline.title.chars().count() as f64 * 9.0);
        if let Some(frame) = &outline.frame {
            y += TITLE - 4.0;
            body.push_str(&format!(
                "<text class=\"caption\" x=\"{MARGIN}\" y=\"{}\">{}</text>\n",
                length(y - 8.0),
                escape(frame)
            ));
            right = right.max(MARGIN * 2.0 + frame.chars().count() as f64 * 8.0);
        }
        let placed = place(outline, y);
        let leaves_x =
            placed.iter().filter(|one| one.row.leaf.is_some()).map(|one| one.x + one.width).fold(0.0, f64::max) + ARROW;
        // Lines first, so that boxes stand on them.
        for at in 0..placed.len() {
            body.push_str(&lines(outline, &placed, at));
        }
        for one in &placed {
            body.push_str(&boxed(one, outline, leaves_x));
            let leaf = one.row.leaf.as_ref().map_or(0.0, |leaf| leaves_x + leaf_width(leaf));
            right = right.max(one.x + one.width + MARGIN).max(leaf + MARGIN);
        }
        y = placed.last().map_or(y, |last| last.y + last.height) + MARGIN * 1.5;
    }
    let (width, height) = (length(right.ceil()), length(y.ceil()));
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\">\n<style>{STYLE}</style>\n{body}</svg>\n"
    )
}

fn place(outline: &Outline, top: f64) -> Vec<PlacedRow<'_>> {
    let mut y = top;
    let rows = outline.rows.iter().map(|row| {
        let lines = wrapped(&row.text());
        let longest = lines.iter().map(|line| line.chars().count()).max().unwrap_or_default();
        let placed = PlacedRow {
            row,
            x: MARGIN + row.depth as f64 * INDENT,
            y,
            width: (longest as f64 * LETTER + 2.0 * PAD).max(INDENT + 2.0 * SPINE),
            height: lines.len() as f64 * LINE + PAD,
            lines,
        };
        y += placed.height + GAP;
        placed
    });
    rows.collect()
}

/// A condition in lines, cut at blanks.
fn wrapped(text: &str) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= LONGEST => {
                line.push(' ');
                line.push_str(word);
            }
            Some(_) => lines.push(format!("  {word}")),
            None => lines.push(word.to_string()),
        }
    }
    lines
}

fn leaf_width(leaf: &str) -> f64 {
    leaf.chars().count() as f64 * LETTER + 2.0 * PAD + 6.0
}

/// The lines that leave a row downwards: to the choices of its branch, and to the choice that is asked when it is not taken.
fn lines(outline: &Outline, placed: &[PlacedRow], at: usize) -> String {
    let Some(one) = placed.get(at) else { return String::new() };
    let mut drawn = String::new();
    let mut down = |to: Option<&PlacedRow>, label: &str, taken: bool, asked: bool| {
        let Some(to) = to else { return };
        let x = to.x + SPINE;
        let (from, end) = (one.y + one.height, to.y);
        let group = if outline.frame.is_some() && !asked { " class=\"off\"" } else { "" };
        drawn.push_str(&format!(
            "<g{group}><path class=\"{0}\" d=\"M{1} {2}V{3}\"/>{4}<text class=\"hint\" x=\"{5}\" y=\"{6}\">{label}</text></g>\n",
            class("line", taken),
            length(x),
            length(from),
            length(end - 5.0),
            tip(x, end, taken, true),
            length(x + 5.0),
            length(from + 11.0)
        ));
    };
    if one.row.leaf.is_none() {
        let caption = if one.row.condition == "else" { "" } else { "yes" };
        let taken = one.row.mark == Mark::Taken;
        down(placed.get(at + 1), caption, taken, taken);
    }
    let passed = one.row.mark == Mark::Passed;
    down(outline.otherwise(at).and_then(|next| placed.get(next)), "no", passed, passed);
    drawn
}

/// The head of an arrow, at its end.
fn tip(x: f64, y: f64, taken: bool, down: bool) -> String {
    let class = class("tip", taken);
    let (x0, y0) = (length(x), length(y));
    if down {
        format!(
            "<path class=\"{class}\" d=\"M{x0} {y0}L{} {1}H{2}Z\"/>",
            length(x - 4.0),
            length(y - 7.0),
            length(x + 4.0)
        )
    } else {
        format!(
            "<path class=\"{class}\" d=\"M{x0} {y0}L{0} {1}V{2}Z\"/>",
            length(x - 7.0),
            length(y - 4.0),
            length(y + 4.0)
        )
    }
}

fn class(name: &str, taken: bool) -> String {
    format!("{name}{}", if taken { " taken" } else { "" })
}

/// The box of a row, and its leaf.
fn boxed(one: &PlacedRow, outline: &Outline, leaves_x: f64) -> String {
    let row = one.row;
    let taken = row.mark == Mark::Taken;
    let off = outline.frame.is_some() && row.mark == Mark::Quiet;
    let group = if off { " class=\"off\"" } else { "" };
    let mut drawn = format!(
        "<g{group}><title>{}</title><rect class=\"{}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" rx=\"4\"/>",
        escape(&row.place),
        class("box", taken),
        length(one.x),
        length(one.y),
        length(one.width),
        length(one.height)
    );
    for (number, line) in one.lines.iter().enumerate() {
        let (x, y) = (length(one.x + PAD), length(one.y + PAD / 2.0 + 12.0 + number as f64 * LINE));
        let name = row.name.as_ref().filter(|_| number == 0).map(|name| format!("{name}:"));
        let text = match name.as_ref().and_then(|name| Some((name, line.strip_prefix(name.as_str())?))) {
            Some((name, rest)) => format!("<tspan class=\"name\">{}</tspan>{}", escape(name), escape(rest)),
            None => escape(line),
        };
        drawn.push_str(&format!("<text xml:space=\"preserve\" x=\"{x}\" y=\"{y}\">{text}</text>"));
    }
    if let Some(leaf) = &row.leaf {
        let middle = one.y + one.height / 2.0;
        let from = one.x + one.width;
        let caption = if row.condition == "else" { "" } else { "yes" };
        drawn.push_str(&format!(
            "<path class=\"{0}\" d=\"M{1} {2}H{3}\"/>{4}<text class=\"hint\" x=\"{5}\" y=\"{6}\">{caption}</text>",
            class("line", taken),
            length(from),
            length(middle),
            length(leaves_x - 5.0),
            tip(leaves_x, middle, taken, false),
            length(from + 5.0),
            length(middle - 4.0)
        ));
        drawn.push_str(&format!(
            "<rect class=\"{}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"24\" rx=\"12\" fill=\"{}\"/><text x=\"{}\" y=\"{}\" fill=\"{}\">{}</text>",
            class("leaf", taken),
            length(leaves_x),
            length(middle - 12.0),
            length(leaf_width(leaf)),
            fill(leaf, &outline.primitives),
            length(leaves_x + PAD + 3.0),
            length(middle + 4.0),
            INK.hex(),
            escape(leaf)
        ));
    }
    drawn.push_str("</g>\n");
    drawn
}
