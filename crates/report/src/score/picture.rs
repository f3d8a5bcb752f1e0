//! A score as a picture: what was taken for what, and how far boundaries are off. An SVG file that stands alone.
//!
//! Rows of a matrix are true, columns are found; the darker a cell, the larger its share of the row. Of the boundary errors of a primitive the box holds
//! the middle half, the line in it is the median, the whiskers end at the 5th and 95th percentile, and points are what lies beyond.

use super::{percent, task_names};
use crate::palette::{self, Color, INK};
use crate::round_step;
use crate::svg::{escape, length};
use teachtree_analysis::json::Meta;
use teachtree_analysis::number::{decimals, fixed};
use teachtree_analysis::score::statistics::quantile;
use teachtree_analysis::score::{BoundaryErrors, Score};

/// The width of the picture.
const WIDTH: f64 = 1200.0;
/// Where the matrices begin, and how wide the first may be.
const MATRICES: [f64; 2] = [140.0, 770.0];
const MATRIX_WIDTH: f64 = 420.0;
/// Room above a matrix for the names of its columns.
const HEAD: f64 = 124.0;
/// The largest cell.
const CELL: f64 = 36.0;
/// The axis of boundary errors.
const AXIS: [f64; 2] = [140.0, 1180.0];
/// The height of a row of boundary errors.
const ROW: f64 = 26.0;
/// The axis holds at least this much on both sides, s.
const LEAST_S: f64 = 0.010;
/// Points beyond the whiskers that are drawn for a primitive, on each side.
const MAX_POINTS: usize = 100;
/// The cells of tasks.
const TASK: Color = Color(0x6b, 0xae, 0xf0);

const STYLE: &str = "svg{background:#fff;fill:#1b1f27;font:12px system-ui,\"Segoe UI\",Roboto,\"DejaVu Sans\",sans-serif}\
.head{font-size:15px;font-weight:600}.quiet{fill:#5b6472}.end{text-anchor:end}.middle{text-anchor:middle}\
.grid{stroke:#d9dee6;fill:none}.zero{stroke:#8a94a3;fill:none}.box{stroke:#16191f;stroke-width:1}.line{stroke:#16191f;fill:none}\
.median{stroke:#16191f;stroke-width:2}";

/// Draws a score; `meta` says by which rules.
pub fn picture(score: &Score, meta: &Meta) -> String {
    let mut body = header(score, meta);
    let top = 64.0;
    let primitives: Vec<&str> = score.all.primitives().into_iter().collect();
    let left = Matrix {
        title: "primitives, share of the true time",
        names: &primitives,
        left: MATRICES[0],
        top,
        count: &|truth, result| {
            score.all.time_s.get(&(truth.to_string(), result.to_string())).copied().unwrap_or_default()
        },
        unit: " s",
        color: &|name| palette::color(name, score.all.primitives.does(name)),
    };
    body.push_str(&left.draw());
    let mut bottom = left.bottom();
    let tasks = task_names(score);
    if !tasks.is_empty() {
        let confusion = score.all.task_confusion();
        let right = Matrix {
            title: "tasks, share of the true ones",
            names: &tasks,
            left: MATRICES[1],
            top,
            count: &|truth, result| confusion.get(&(truth, result)).map_or(0.0, |count| *count as f64),
            unit: "",
            color: &|_| TASK,
        };
        body.push_str(&right.draw());
        bottom = bottom.max(right.bottom());
    }
    let (strips, bottom) = strips(score, &primitives, bottom + 44.0);
    body.push_str(&strips);
    let height = length(bottom);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" height=\"{height}\">\n\
         <style>{STYLE}</style>\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n{body}</svg>\n"
    )
}

fn header(score: &Score, meta: &Meta) -> String {
    let all = &score.all;
    let mut facts = vec![
        format!("recordings {}", score.recordings()),
        format!("frame accuracy {}", percent(all.accuracy())),
        format!("edit score {}", percent(all.edit())),
    ];
    if all.tasks.is_some() {
        let found = all.tasks_found();
        facts.insert(1, format!("tasks found {} of {}", found.right, found.of));
    }
    format!(
        "<text class=\"head\" x=\"12\" y=\"24\">{}: {}</text>\n<text class=\"quiet\" x=\"12\" y=\"42\">{}</text>\n",
        score.stage,
        escape(&facts.join(", ")),
        escape(&format!("rules {}", meta.rules.join(", ")))
    )
}

/// What was taken for what.
struct Matrix<'a> {
    title: &'a str,
    names: &'a [&'a str],
    left: f64,
    top: f64,
    /// How much of a true name was found as another one.
    count: &'a dyn Fn(&str, &str) -> f64,
    unit: &'a str,
    color: &'a dyn Fn(&str) -> Color,
}

impl Matrix<'_> {
    fn cell(&self) -> f64 {
        (MATRIX_WIDTH / self.names.len().max(1) as f64).min(CELL)
    }

    fn bottom(&self) -> f64 {
        self.top + HEAD + self.cell() * self.names.len() as f64
    }

    fn draw(&self) -> String {
        let (cell, first) = (self.cell(), self.top + HEAD);
        let mut drawn =
            format!("<text class=\"quiet\" x=\"{}\" y=\"{}\">{}</text>\n", self.left, self.top + 8.0, self.title);
        for (at, name) in (0..).map(f64::from).zip(self.names) {
            let middle = (at + 0.5) * cell;
            let (x, y) = (length(self.left + middle + 4.0), length(first - 6.0));
            let name = escape(name);
            drawn.push_str(&format!("<text transform=\"translate({x} {y}) rotate(-50)\">{name}</text>"));
            let (x, y) = (length(self.left - 8.0), length(first + middle + 4.0));
            drawn.push_str(&format!("<text class=\"end\" x=\"{x}\" y=\"{y}\">{name}</text>\n"));
        }
        for (row, truth) in (0..).map(f64::from).zip(self.names) {
            let whole: f64 = self.names.iter().map(|result| (self.count)(truth, result)).sum();
            for (column, result) in (0..).map(f64::from).zip(self.names) {
                let count = (self.count)(truth, result);
                let share = if whole > 0.0 { count / whole } else { 0.0 };
                let (x, y) = (self.left + column * cell, first + row * cell);
                drawn.push_str(&self.square(truth, result, (x, y), count, share));
            }
            drawn.push('\n');
        }
        drawn
    }

    fn square(&self, truth: &str, result: &str, (x, y): (f64, f64), count: f64, share: f64) -> String {
        let side = length(self.cell() - 1.0);
        let place = format!("x=\"{}\" y=\"{}\" width=\"{side}\" height=\"{side}\"", length(x), length(y));
        if count <= 0.0 {
            return format!("<rect {place} fill=\"#f3f5f8\"/>");
        }
        let title = format!("{truth} found as {result}: {}{}, {}", decimals(count, 3), self.unit, percent(Some(share)));
        let (title, fill) = (escape(&title), (self.color)(truth).hex());
        let shown = fixed(share * 100.0, 0);
        let (x, y) = (length(x + self.cell() / 2.0), length(y + self.cell() / 2.0 + 4.0));
        let text = match shown.as_str() {
            "0" => String::new(),
            percent => format!("<text class=\"middle\" x=\"{x}\" y=\"{y}\" fill=\"{}\">{percent}</text>", INK.hex()),
        };
        // Even a small share can be seen.
        let opacity = decimals(0.12 + 0.88 * share, 3);
        format!("<g><title>{title}</title><rect {place} fill=\"{fill}\" fill-opacity=\"{opacity}\"/>{text}</g>")
    }
}

/// The boundary errors of each primitive; returns the drawing and where it ends.
fn strips(score: &Score, primitives: &[&str], top: f64) -> (String, f64) {
    let errors: Vec<(&str, BoundaryErrors)> = primitives
        .iter()
        .map(|name| (*name, score.all.errors_of(name)))
        .filter(|(_, errors)| errors.found.of > 0)
        .collect();
    if errors.is_empty() {
        return (String::new(), top);
    }
    // The axis holds all whiskers; what lies beyond is drawn at its ends.
    let whiskers =
        errors.iter().flat_map(|(_, errors)| [quantile(&errors.late_s, 0.05), quantile(&errors.late_s, 0.95)]);
    let reach_s = whiskers.flatten().map(f64::abs).fold(LEAST_S, f64::max) * 1.1;
    let x = |late_s: f64| AXIS[0] + ((late_s / reach_s).clamp(-1.0, 1.0) + 1.0) / 2.0 * (AXIS[1] - AXIS[0]);
    let bottom = top + 12.0 + ROW * errors.len() as f64;
    let mut drawn = format!(
        "<text class=\"quiet\" x=\"{}\" y=\"{}\">starts: how much later than true, ms</text>\n",
        AXIS[0],
        length(top)
    );
    let step = round_step(reach_s * 1e3 / 5.0);
    let last = (reach_s * 1e3 / step).floor();
    for tick in (0..16).map(|tick| (f64::from(tick) - last) * step).take_while(|tick| *tick <= reach_s * 1e3) {
        let class = if tick == 0.0 { "zero" } else { "grid" };
        let at = length(x(tick / 1e3));
        let (from, to, below) = (length(top + 8.0), length(bottom), length(bottom + 16.0));
        drawn.push_str(&format!(
            "<path class=\"{class}\" d=\"M{at} {from}V{to}\"/><text class=\"quiet middle\" x=\"{at}\" y=\"{below}\">{}</text>",
            decimals(tick, 6)
        ));
    }
    drawn.push('\n');
    for (row, (name, errors)) in (0..).map(f64::from).zip(&errors) {
        drawn.push_str(&strip(
            name,
            palette::color(name, score.all.primitives.does(name)),
            errors,
            top + 12.0 + (row + 0.5) * ROW,
            x,
        ));
    }
    (drawn, bottom + 28.0)
}

fn strip(name: &str, color: Color, errors: &BoundaryErrors, y: f64, x: impl Fn(f64) -> f64) -> String {
    let at = |q: f64| quantile(&errors.late_s, q);
    let (label, baseline) = (escape(name), length(y + 4.0));
    let mut drawn = format!("<text class=\"end\" x=\"{}\" y=\"{baseline}\">{label}</text>", AXIS[0] - 8.0);
    if let (Some(p5), Some(p25), Some(p50), Some(p75), Some(p95)) = (at(0.05), at(0.25), at(0.5), at(0.75), at(0.95)) {
        let title = format!(
            "{name}: {} of {} found, median {} ms, 95 % from {} to {} ms",
            errors.found.right,
            errors.found.of,
            fixed(p50 * 1e3, 1),
            fixed(p5 * 1e3, 1),
            fixed(p95 * 1e3, 1)
        );
        let [x5, x25, x50, x75, x95] = [p5, p25, p50, p75, p95].map(&x);
        let fill = color.hex();
        drawn.push_str(&format!(
            "<g><title>{}</title><path class=\"line\" d=\"M{} {}H{}\"/>",
            escape(&title),
            length(x5),
            length(y),
            length(x95)
        ));
        drawn.push_str(&format!(
            "<rect class=\"box\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"14\" fill=\"{fill}\"/>",
            length(x25),
            length(y - 7.0),
            length((x75 - x25).max(1.0))
        ));
        let (x50, up, down) = (length(x50), length(y - 7.0), length(y + 7.0));
        drawn.push_str(&format!("<path class=\"median\" d=\"M{x50} {up}V{down}\"/></g>"));
        let early = errors.late_s.iter().filter(|late| **late < p5).take(MAX_POINTS);
        let late = errors.late_s.iter().rev().filter(|late| **late > p95).take(MAX_POINTS);
        for beyond in early.chain(late) {
            drawn.push_str(&format!(
                "<circle cx=\"{}\" cy=\"{}\" r=\"2\" fill=\"{fill}\" stroke=\"#16191f\" stroke-width=\"0.5\"/>",
                length(x(*beyond)),
                length(y)
            ));
        }
    }
    drawn.push('\n');
    drawn
}
