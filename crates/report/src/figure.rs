//! The figure of one track: lanes above, signals below, boundaries through all of them.

use super::palette::{self, Color};
use super::signals::{Panel, Signals, of_both};
use super::svg::{BAR, Bar, LEFT, TimeAxis, ValueAxis, WIDTH, curve, escape, length};
use super::{parts, remarks};
use std::ops::Range;
use teachtree_analysis::number::decimals;
use teachtree_analysis::{Analysis, Segment, TaskSpan, Track, TrackId};
use teachtree_frames::frames::Frames;

/// Distance between lanes.
const GAP: f64 = 6.0;
/// Height of a panel with its title.
const PANEL: f64 = 96.0;
/// Height of its title.
const TITLE: f64 = 20.0;
/// Height of the row of a finger.
const FINGER: f64 = 6.0;
/// More boundaries than this are drawn without points on the curves, which would hide them.
const MAX_POINTS: usize = 400;

/// Draws a track. Returns the drawing, and the plots that are left out with the channels that they need.
pub(super) fn figure(
    track: &Track,
    analysis: &Analysis,
    frames: &Frames,
    label: &str,
) -> (String, Vec<(&'static str, &'static str)>) {
    let time = TimeAxis { start_s: analysis.start_s, end_s: analysis.end_s };
    let mut drawing = Drawing { time, frames, y: 4.0, body: String::new() };
    drawing.issues(track, analysis);
    drawing.segments("raw", &track.segments);
    drawing.segments("relabeled", &track.relabeled);
    drawing.tasks(track);
    let lanes_end = drawing.y;
    let mut lacking = Vec::new();
    let panels = match track.who {
        TrackId::Hand(side) => {
            let signals = Signals::new(frames, side);
            drawing.touches(&signals);
            signals.panels()
        }
        TrackId::Both => of_both(frames),
    };
    let mut drawn = Vec::new();
    for panel in panels {
        match panel.curves {
            Ok(_) => drawn.push(drawing.panel(panel)),
            Err(channels) => lacking.push((panel.title, channels)),
        }
    }
    drawing.cuts(lanes_end, &track.segments, &drawn);
    let bottom = drawing.y;
    let ticks = time.ticks(lanes_end, bottom);
    let height = length(bottom + 22.0);
    let svg = format!(
        "<svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{}: {}\">\n{ticks}\n{}</svg>\n",
        escape(label),
        escape(&alt_text(track)),
        drawing.body
    );
    (svg, lacking)
}

/// The figure in words.
fn alt_text(track: &Track) -> String {
    let tasks: Vec<String> = track
        .tasks
        .iter()
        .map(|task| format!("{} from {:.2} to {:.2} s", task.task, task.start_s, task.end_s))
        .collect();
    let segments: Vec<&str> = track.relabeled.iter().map(|segment| segment.primitive.as_str()).collect();
    let tasks = if tasks.is_empty() { "no task".into() } else { tasks.join(", ") };
    format!("{tasks}; segments {}", segments.join(", "))
}

/// A drawing in the making, from top to bottom.
struct Drawing<'a> {
    time: TimeAxis,
    frames: &'a Frames,
    y: f64,
    body: String,
}

/// A panel that has been drawn.
struct DrawnPanel {
    axis: ValueAxis,
    panel: Panel,
}

impl Drawing<'_> {
    fn x(&self, segment: &Segment) -> Range<f64> {
        self.time.x(segment.start_s)..self.time.x(segment.end_s)
    }

    fn lane(&mut self, name: &str, bars: &[Bar]) {
        let y = length(self.y + 14.0);
        self.body.push_str(&format!(r#"<text class="lane" x="0" y="{y}">{name}</text>"#));
        for bar in bars {
            self.body.push_str(&bar.draw(self.y));
        }
        self.body.push('\n');
        self.y += BAR + GAP;
    }

    fn segments(&mut self, name: &str, segments: &[Segment]) {
        let bar = |segment: &'_ Segment| {
            (self.x(segment), palette::color(&segment.primitive, segment.does), describe(segment))
        };
        let parts: Vec<(Range<f64>, Color, String)> = segments.iter().map(bar).collect();
        let bars: Vec<Bar> = (segments.iter().zip(parts))
            .map(|(segment, (x, color, title))| Bar { x, name: &segment.primitive, color, title, open: (false, false) })
            .collect();
        self.lane(name, &bars);
    }

    fn tasks(&mut self, track: &Track) {
        let bars: Vec<Bar> = (track.tasks.iter().zip(palette::TASKS.into_iter().cycle()))
            .map(|(task, color)| Bar {
                x: self.time.x(task.start_s)..self.time.x(task.end_s),
                name: &task.task,
                color,
                title: describe_task(task),
                open: (task.open_start, task.open_end),
            })
            .collect();
        if !bars.is_empty() {
            self.lane("tasks", &bars);
        }
        let bars: Vec<Bar> = (track.composites.iter().zip(palette::TASKS.into_iter().cycle().skip(1)))
            .map(|(found, color)| Bar {
                x: self.time.x(found.start_s)..self.time.x(found.end_s),
                name: &found.task,
                color,
                title: format!("{}, {}", found.task, parts(found)),
                open: (found.open_start, found.open_end),
            })
            .collect();
        if !bars.is_empty() {
            self.lane("composite", &bars);
        }
    }

    /// Marks where the log could not be trusted, for this track or for all.
    fn issues(&mut self, track: &Track, analysis: &Analysis) {
        let own = format!("{}.", track.who);
        let whole = |issue: &&teachtree_logs::issue::Issue| issue.channel.is_empty() || issue.channel.starts_with(&own);
        let marks: Vec<String> = (analysis.issues.iter().filter(whole))
            .map(|issue| {
                let (start, end) = (self.time.x(issue.start_s), self.time.x(issue.end_s));
                let title = format!("{} {}: {}", issue.kind, issue.channel, issue.message);
                let (x, y, width) = (length(start), length(self.y), length((end - start).max(2.0)));
                format!(
                    r#"<rect class="issue" x="{x}" y="{y}" width="{width}" height="5"><title>{}</title></rect>"#,
                    escape(&title)
                )
            })
            .collect();
        if !marks.is_empty() {
            let y = length(self.y + 7.0);
            self.body.push_str(&format!("<text class=\"lane\" x=\"0\" y=\"{y}\">issues</text>{}\n", marks.concat()));
            self.y += 5.0 + GAP;
        }
    }

    /// A row for each finger, filled while it touches.
    fn touches(&mut self, signals: &Signals) {
        let touches = signals.touches();
        if touches.is_empty() {
            return;
        }
        self.y += GAP;
        let middle = self.y + FINGER * touches.len() as f64 / 2.0 + 4.0;
        self.body.push_str(&format!(r#"<text class="lane" x="0" y="{}">touches</text>"#, length(middle)));
        for touch in touches {
            let y = length(self.y + FINGER / 2.0);
            let mut path = String::new();
            let runs = touch.touches.chunk_by(|one, next| one == next);
            runs.fold(0, |start, run| {
                let end = start + run.len();
                if run.first() == Some(&true) {
                    let from = self.frames.time.get(start).copied().unwrap_or_default();
                    let (from, to) = (self.time.x(from), self.time.x(self.frames.end_of(end - 1)));
                    path.push_str(&format!("M{} {y}H{}", length(from), length(to.max(from + 0.5))));
                }
                end
            });
            self.body
                .push_str(&format!(r#"<path class="touch" d="{path}"><title>{} touches</title></path>"#, touch.finger));
            self.y += FINGER;
        }
        self.body.push('\n');
        self.y += GAP;
    }

    fn panel(&mut self, panel: Panel) -> DrawnPanel {
        let curves = panel.curves.as_deref().unwrap_or(&[]);
        let values = curves.iter().map(|curve| curve.values.as_slice());
        let rate_hz = self.frames.layout.rate_hz;
        let axis = ValueAxis::new(self.y + TITLE, self.y + PANEL - 4.0, values, rate_hz, panel.least);
        let y = length(self.y + 14.0);
        let mut title = format!("{}, {}", panel.title, panel.unit);
        let named: Vec<&str> = curves.iter().map(|curve| curve.name).filter(|name| !name.is_empty()).collect();
        if !named.is_empty() {
            title.push(':');
        }
        let mut names = format!(r#"<text class="title" x="{LEFT}" y="{y}">{title}"#);
        for (name, class) in named.iter().zip(["key", "key second"]) {
            names.push_str(&format!(r#" <tspan class="{class}">{name}</tspan>"#));
        }
        names.push_str("</text>");
        self.body.push_str(&names);
        self.body.push_str(&axis.ticks());
        for (one, class) in curves.iter().zip(["curve", "curve second"]) {
            let x = |frame: usize| self.time.x(self.frames.time.get(frame).copied().unwrap_or_default());
            let path = curve(&one.values, &self.frames.stretches, x, &axis);
            self.body.push_str(&format!(r#"<path class="{class}" d="{path}"/>"#));
            self.body.push_str(&axis.beyond(&one.values, x));
        }
        self.body.push('\n');
        self.y += PANEL;
        DrawnPanel { axis, panel }
    }

    /// The boundaries of the raw segments: a line through all panels, and a point on each curve.
    fn cuts(&mut self, top: f64, segments: &[Segment], panels: &[DrawnPanel]) {
        self.body.push_str("<g class=\"cuts\">\n");
        for pair in segments.windows(2) {
            let [before, after] = pair else { continue };
            let from = if before.frames.end == after.frames.start { &before.primitive } else { "gap" };
            let title = format!("{from} → {} at {:.3} s", after.primitive, after.start_s);
            let mut points = String::new();
            let curves =
                panels.iter().flat_map(|drawn| drawn.panel.curves.iter().flatten().map(|curve| (&drawn.axis, curve)));
            for (axis, curve) in curves.filter(|_| segments.len() <= MAX_POINTS) {
                if let Some(value) = curve.values.get(after.frames.start).filter(|value| value.is_finite()) {
                    points.push_str(&format!(r#"<circle cy="{}" r="3"/>"#, length(axis.y(*value))));
                }
            }
            self.body.push_str(&format!(
                "<g transform=\"translate({} 0)\" fill=\"{}\"><title>{}</title><path class=\"cut\" d=\"M0 {}V{}\"/>{points}</g>\n",
                length(self.time.x(after.start_s)),
                palette::color(&after.primitive, after.does).hex(),
                escape(&title),
                length(top),
                length(self.y)
            ));
        }
        self.body.push_str("</g>\n");
    }
}

/// The tooltip of a segment.
fn describe(segment: &Segment) -> String {
    let mut text =
        format!("{}{}\n{}", segment.primitive, segment.subject.suffix(), times(segment.start_s, segment.end_s));
    if !segment.by.is_empty() {
        text.push_str(&format!("\nwas {}\nby {}", segment.was.join(", "), segment.by.join("; ")));
    }
    text
}

/// The tooltip of a task.
fn describe_task(task: &TaskSpan) -> String {
    let remarks = remarks(task);
    let rest = if remarks.is_empty() { String::new() } else { format!("\n{remarks}") };
    format!("{}{}\n{}{rest}", task.task, task.subject.suffix(), times(task.start_s, task.end_s))
}

fn times(start_s: f64, end_s: f64) -> String {
    format!("{start_s:.3} – {end_s:.3} s, {} ms", decimals((end_s - start_s) * 1e3, 3))
}
