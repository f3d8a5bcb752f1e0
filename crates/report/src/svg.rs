//! Drawing: bars, curves and axes in, SVG out.
//!
//! Lengths are in units of the view box, x to the right and y down. Curves are thinned to the least and the greatest value
//! in each unit of x, so that the size of a drawing does not grow with the length of a log.

use super::palette::{Color, INK};
use super::round_step;
use super::scale::scale;
use std::ops::Range;
use teachtree_analysis::number::decimals;

/// The width of a drawing.
pub const WIDTH: f64 = 1200.0;
/// Where time begins.
pub(super) const LEFT: f64 = 132.0;
/// Where time ends.
pub(super) const RIGHT: f64 = WIDTH - 12.0;
/// Size of the mark of what lies outside of a scale.
const MARK: f64 = 7.0;
/// Width of a letter of the names in bars, about.
const LETTER: f64 = 6.3;

/// The tag that begins a part of a page that is scrolled sideways where the window is narrow, by pointer or by keys.
pub fn scrolled(label: &str) -> String {
    format!("<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{}\">", escape(label))
}

/// Text for an element or an attribute.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            // XML has no other control characters.
            control if control.is_control() && control != '\n' => escaped.push(' '),
            other => escaped.push(other),
        }
    }
    escaped
}

/// The text of a length.
pub fn length(value: f64) -> String {
    decimals(value, 1)
}

/// From time to x.
#[derive(Clone, Copy, Debug)]
pub struct TimeAxis {
    /// Start of the recording, s.
    pub start_s: f64,
    /// End of the recording, s.
    pub end_s: f64,
}

impl TimeAxis {
    /// Where a time is.
    pub fn x(&self, time_s: f64) -> f64 {
        let length = (self.end_s - self.start_s).max(f64::MIN_POSITIVE);
        LEFT + ((time_s - self.start_s) / length).clamp(0.0, 1.0) * (RIGHT - LEFT)
    }

    /// Lines at round times from `top` to `bottom`, with the times below.
    pub fn ticks(&self, top: f64, bottom: f64) -> String {
        let step = round_step((self.end_s - self.start_s) / 12.0);
        let first = (self.start_s / step).ceil();
        let mut lines = String::new();
        let mut labels = String::new();
        // The step bounds their number.
        for tick in (0..20).map(|tick| (first + f64::from(tick)) * step).take_while(|tick| *tick <= self.end_s) {
            let x = length(self.x(tick));
            lines.push_str(&format!("M{x} {}V{}", length(top), length(bottom)));
            let label = decimals(tick, 6);
            // A number at the end of the axis stays within the drawing.
            let x = length(self.x(tick).min(WIDTH - (label.len() + 2) as f64 * LETTER / 2.0));
            labels.push_str(&format!(r#"<text class="tick" x="{x}" y="{}">{label} s</text>"#, length(bottom + 14.0)));
        }
        format!(r#"<path class="grid" d="{lines}"/>{labels}"#)
    }
}

/// A bar with a name and a text to be read over it; `open` ends are drawn ragged.
pub struct Bar<'a> {
    /// Where it starts and ends, in x.
    pub x: Range<f64>,
    /// Its name.
    pub name: &'a str,
    /// Its color.
    pub color: Color,
    /// What is said over it.
    pub title: String,
    /// Whether the start and the end were cut off.
    pub open: (bool, bool),
}

/// The height of a bar.
pub const BAR: f64 = 20.0;

impl Bar<'_> {
    /// Draws the bar below `top`.
    pub fn draw(&self, top: f64) -> String {
        let Range { start, end } = self.x;
        // Even the shortest segment can be seen and pointed at.
        let width = (end - start).max(1.0);
        let (bottom, middle) = (top + BAR, top + BAR / 2.0);
        let tooth = if width > 12.0 { 5.0 } else { 0.0 };
        let left = if self.open.0 { format!("L{} {}", length(start + tooth), length(middle)) } else { String::new() };
        let right =
            if self.open.1 { format!("L{} {}", length(start + width - tooth), length(middle)) } else { String::new() };
        let shape = format!(
            "M{0} {2}H{1}{right}L{1} {3}H{0}{left}Z",
            length(start),
            length(start + width),
            length(top),
            length(bottom)
        );
        let room = ((width - 6.0) / LETTER).max(0.0) as usize;
        let shown: String = self.name.chars().take(if room < 2 { 0 } else { room }).collect();
        let label = if shown.is_empty() {
            String::new()
        } else {
            let indent = if self.open.0 { tooth } else { 0.0 };
            let (x, y) = (length(start + 4.0 + indent), length(top + 14.0));
            format!(r#"<text x="{x}" y="{y}" fill="{}">{}</text>"#, INK.hex(), escape(&shown))
        };
        let (title, fill) = (escape(&self.title), self.color.hex());
        format!(r#"<g class="bar"><title>{title}</title><path d="{shape}" fill="{fill}"/>{label}</g>"#)
    }
}

/// From value to y: a box between two heights.
#[derive(Clone, Copy, Debug)]
pub struct ValueAxis {
    /// The y of the greatest value.
    pub top: f64,
    /// The y of the least value.
    pub bottom: f64,
    least: f64,
    greatest: f64,
}

impl ValueAxis {
    /// Returns an axis for curves at a number of frames a second that contains zero and all but rare and brief values, and is at least `shortest` long.
    pub fn new<'v>(
        top: f64,
        bottom: f64,
        curves: impl Iterator<Item = &'v [f64]> + Clone,
        rate_hz: f64,
        shortest: f64,
    ) -> Self {
        // What lies within the shortest scale is never left out.
        let held = scale(curves, &[0.0, shortest], rate_hz);
        let (least, greatest) = held.map_or((0.0, 0.0), |held| (held.least, held.greatest));
        // A little room, so that a peak does not touch the title.
        let room = 0.06 * (greatest - least);
        Self { top, bottom, least, greatest: (greatest + room).max(least + shortest) }
    }

    /// Where a value is.
    pub fn y(&self, value: f64) -> f64 {
        let within = value.clamp(self.least, self.greatest);
        self.bottom - (within - self.least) / (self.greatest - self.least) * (self.bottom - self.top)
    }

    /// Marks where values lie outside of the axis, the farthest one above and below with its value.
    pub fn beyond(&self, values: &[f64], x: impl Fn(usize) -> f64) -> String {
        let (greatest, least) = (self.greatest, self.least);
        let mut drawn = String::new();
        for (sign, edge, y) in [(1.0, greatest, self.top), (-1.0, -least, self.bottom)] {
            let out = |frame: usize| values.get(frame).map(|value| sign * value).filter(|value| *value > edge);
            let places: Vec<(usize, f64)> = (0..values.len()).filter_map(|at| Some((at, out(at)?))).collect();
            let Some((farthest, value)) = places.iter().copied().max_by(|one, other| one.1.total_cmp(&other.1)) else {
                continue;
            };
            let mut shown: Vec<f64> = vec![x(farthest)];
            for (at, _) in places {
                if shown.iter().all(|other| (other - x(at)).abs() >= MARK) {
                    shown.push(x(at));
                }
            }
            for at in shown {
                let (left, foot) = (length(at - MARK / 2.0), length(y + sign * MARK));
                drawn.push_str(&format!(
                    r#"<path class="beyond" d="M{left} {foot}h{MARK}L{} {}Z"/>"#,
                    length(at),
                    length(y)
                ));
            }
            let at = x(farthest);
            let (aside, end) = if at < (LEFT + RIGHT) / 2.0 { (MARK, "start") } else { (-MARK, "end") };
            drawn.push_str(&format!(
                r#"<text class="beyond" x="{}" y="{}" text-anchor="{end}">{}</text>"#,
                length(at + aside),
                length(y + if sign > 0.0 { 9.0 } else { -2.0 }),
                decimals(sign * value, 2)
            ));
        }
        drawn
    }

    /// Lines at round values with their numbers.
    pub fn ticks(&self) -> String {
        // One line alone gives no scale.
        let lines = |step: f64| (self.greatest / step).floor() - (self.least / step).ceil();
        let wide = round_step((self.greatest - self.least) / 3.0);
        let step = if lines(wide) < 1.0 { round_step((self.greatest - self.least) / 6.0) } else { wide };
        let first = (self.least / step).ceil();
        let mut drawn = String::new();
        for tick in (0..8).map(|tick| (first + f64::from(tick)) * step).take_while(|tick| *tick <= self.greatest) {
            let y = self.y(tick);
            let class = if tick == 0.0 { "zero" } else { "grid" };
            drawn.push_str(&format!(
                r#"<path class="{class}" d="M{LEFT} {}H{RIGHT}"/><text class="value" x="{}" y="{}">{}</text>"#,
                length(y),
                LEFT - 6.0,
                length(y + 4.0),
                decimals(tick, 6)
            ));
        }
        drawn
    }
}

/// The path of a curve over stretches of frames: thinned, broken at gaps and where there is no value.
pub fn curve(values: &[f64], stretches: &[Range<usize>], x: impl Fn(usize) -> f64, axis: &ValueAxis) -> String {
    let mut path = Path::default();
    for stretch in stretches {
        path.lift();
        let mut frame = stretch.start;
        while frame < stretch.end {
            // All frames within one unit of x.
            let column = x(frame).floor();
            let mut least: Option<(usize, f64)> = None;
            let mut greatest: Option<(usize, f64)> = None;
            let mut broken = false;
            while frame < stretch.end && x(frame).floor() <= column {
                match values.get(frame) {
                    Some(value) if value.is_finite() => {
                        if least.is_none_or(|(_, best)| *value < best) {
                            least = Some((frame, *value));
                        }
                        if greatest.is_none_or(|(_, best)| *value > best) {
                            greatest = Some((frame, *value));
                        }
                    }
                    _ => broken = true,
                }
                frame += 1;
            }
            let mut ends: Vec<(usize, f64)> = least.into_iter().chain(greatest).collect();
            ends.sort_by_key(|(frame, _)| *frame);
            for (at, value) in ends {
                path.to(x(at), axis.y(value));
            }
            if broken {
                path.lift();
            }
        }
    }
    path.lift();
    path.text
}

/// A path in the making, written in tenths and step by step, leaving out points that add nothing to a level line.
#[derive(Default)]
struct Path {
    text: String,
    /// Where the path is, in tenths.
    at: Option<(i64, i64)>,
    /// The length of a pending level line, in tenths.
    level: i64,
}

impl Path {
    fn lift(&mut self) {
        self.end_level();
        self.at = None;
    }

    fn end_level(&mut self) {
        if self.level != 0 {
            self.text.push_str(&format!("h{}", tenths(self.level)));
            self.level = 0;
        }
    }

    fn to(&mut self, x: f64, y: f64) {
        let (x, y) = ((x * 10.0).round() as i64, (y * 10.0).round() as i64);
        match self.at.map(|(last_x, last_y)| (x - last_x, y - last_y)) {
            Some((right, 0)) => self.level += right,
            Some((right, down)) => {
                self.end_level();
                let blank = if down < 0 { "" } else { " " };
                let step = match right {
                    0 => format!("v{}", tenths(down)),
                    _ => format!("l{}{blank}{}", tenths(right), tenths(down)),
                };
                self.text.push_str(&step);
            }
            None => self.text.push_str(&format!("M{} {}", tenths(x), tenths(y))),
        }
        self.at = Some((x, y));
    }
}

fn tenths(value: i64) -> String {
    length(value as f64 / 10.0)
}
