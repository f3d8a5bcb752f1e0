//! A plot of several lines over the time of a task, with its primitives as bars above.

use teachtree_report::palette::color;
use teachtree_report::svg::{BAR, Bar, TimeAxis, ValueAxis, WIDTH, curve, escape, length};
use teachtree_robot::simulation::trace::TraceSample;

/// The height of the curves, and where they begin below the title and the bars.
const HEIGHT: f64 = 84.0;
const TOP: f64 = BAR + 26.0;
/// Room for a name in the legend.
const NAME: f64 = 92.0;
/// Colors of lines, as classes of the page's style.
const COLORS: usize = 8;

/// A line.
pub(super) struct Line {
    /// Its name in the legend.
    pub name: String,
    /// Which of the colors.
    pub color: usize,
    /// The stroke of the line.
    pub stroke: Stroke,
    /// A value a moment.
    pub values: Vec<f64>,
}

/// The stroke of a line.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Stroke {
    Solid,
    Dashed,
    Dotted,
}

impl Stroke {
    /// Returns the CSS class of the page's style sheet.
    const fn class(self) -> &'static str {
        match self {
            Self::Solid => "",
            Self::Dashed => " dashed",
            Self::Dotted => " dotted",
        }
    }
}

/// A plot.
pub(super) struct Plot {
    /// What is shown, with its unit.
    pub title: String,
    /// Its lines.
    pub lines: Vec<Line>,
    /// The axis is at least this long.
    pub shortest: f64,
}

impl Plot {
    /// Draws it.
    pub fn draw(&self, moments: &[&TraceSample]) -> String {
        let (Some(first), Some(last)) = (moments.first(), moments.last()) else { return String::new() };
        let time = TimeAxis { start_s: first.time_s, end_s: last.time_s };
        let bars: String = moments
            .chunk_by(|one, next| one.primitive == next.primitive)
            .filter_map(|run| Some((run.first()?, run.last()?)))
            .map(|(from, to)| {
                let bar = Bar {
                    x: time.x(from.time_s)..time.x(to.time_s),
                    name: &from.primitive,
                    color: color(&from.primitive, Some(from.does)),
                    title: from.primitive.clone(),
                    open: (false, false),
                };
                bar.draw(20.0)
            })
            .collect();
        let (top, bottom) = (TOP, TOP + HEIGHT);
        let rate_hz = (moments.len() as f64 - 1.0) / (last.time_s - first.time_s).max(f64::MIN_POSITIVE);
        let values = self.lines.iter().map(|line| line.values.as_slice());
        let axis = ValueAxis::new(top, bottom, values, rate_hz, self.shortest);
        let x = |at: usize| moments.get(at).map_or(0.0, |moment| time.x(moment.time_s));
        let mut legend = String::new();
        let mut curves = String::new();
        for (place, line) in self.lines.iter().enumerate() {
            let path = curve(&line.values, std::slice::from_ref(&(0..line.values.len())), x, &axis);
            let class = format!("line c{}{}", line.color % COLORS, line.stroke.class());
            curves.push_str(&format!(r#"<path class="{class}" d="{path}"/>"#));
            curves.push_str(&axis.beyond(&line.values, x));
            let from = WIDTH - 12.0 - NAME * (self.lines.len() - place) as f64;
            legend.push_str(&format!(
                r#"<path class="{class}" d="M{} 10h16"/><text x="{}" y="14">{}</text>"#,
                length(from),
                length(from + 20.0),
                escape(&line.name)
            ));
        }
        let title = escape(&self.title);
        format!(
            "<svg viewBox=\"0 0 {WIDTH} {}\" role=\"img\" aria-label=\"{title}\">\n<text class=\"title\" x=\"0\" y=\"14\">{title}</text>{legend}\n{bars}\n{}{}\n\
             {curves}</svg>\n",
            length(bottom + 22.0),
            time.ticks(top, bottom),
            axis.ticks(),
        )
    }
}
