//! The timeline for terminals: an analysis in, lanes and lists out.
//!
//! Every track has a lane of raw segments, one of relabeled segments when rules changed something, and one of tasks, all to the same
//! scale, and below the tasks and their segments with times and trails. Without color the lanes are drawn with letters
//! and bars; without Unicode everything is ASCII. No line of the timeline is longer than the width.

use super::palette::{self, Color, INK};
use super::{parts, remarks, round_step};
use teachtree_analysis::confidence::percent;
use teachtree_analysis::json::{Meta, VERSION};
use teachtree_analysis::number::{decimals, number};
use teachtree_analysis::{Analysis, Confidence, Segment, Subject, TaskSpan, Track, TrackId};
use teachtree_base::meaning::Meaning;

/// How to draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Style {
    /// Whether colors may be used.
    pub color: bool,
    /// Whether characters beyond ASCII may be used.
    pub unicode: bool,
    /// Columns of the terminal; at least 40 are taken.
    pub width: usize,
}

/// Without color, with Unicode, 100 columns wide.
impl Default for Style {
    fn default() -> Self {
        Self { color: false, unicode: true, width: 100 }
    }
}

/// The narrowest timeline that is drawn.
pub const MIN_WIDTH: usize = 40;

/// Columns of the names of the lanes.
const GUTTER: usize = 12;
/// Columns of the names in the lists, at least.
const NAME: usize = 21;
/// Columns of the color of a segment and the blank after it.
const SWATCH: usize = 3;

/// Draws the timeline and the lists.
pub fn text(analysis: &Analysis, meta: &Meta, style: Style) -> String {
    let style = Style { width: style.width.max(MIN_WIDTH), ..style };
    let page = Page { style, analysis, names: names(analysis) };
    let mut lines = page.header(meta);
    for track in &analysis.tracks {
        lines.push(String::new());
        lines.extend(page.lanes(track));
    }
    for track in &analysis.tracks {
        lines.push(String::new());
        lines.extend(page.list(track));
    }
    if !analysis.issues.is_empty() {
        lines.push(String::new());
        lines.extend(page.issues());
    }
    let mut text = String::new();
    for line in lines {
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

/// One bar of a lane.
struct Bar<'a> {
    start_s: f64,
    end_s: f64,
    name: &'a str,
    color: Color,
}

struct Page<'a> {
    style: Style,
    analysis: &'a Analysis,
    /// Columns of the names of listed segments.
    names: usize,
}

/// The columns that the longest name of a listed segment or task takes, [`NAME`] at least.
fn names(analysis: &Analysis) -> usize {
    let width = |name: &str, subject: &Subject| (name.to_string() + &subject.suffix()).chars().count();
    let listed = analysis.tracks.iter().flat_map(|track| {
        let in_tasks = track.tasks.iter().flat_map(|task| &task.segments);
        let segments = outside(track).into_iter().flatten().chain(in_tasks);
        let tasks = track.tasks.iter().map(|task| width(&task.task, &task.subject).saturating_sub(SWATCH));
        let composites = track.composites.iter().map(|it| it.task.chars().count().saturating_sub(SWATCH));
        segments.map(|segment| width(&segment.primitive, &segment.subject)).chain(tasks).chain(composites)
    });
    listed.fold(NAME, usize::max)
}

impl Page<'_> {
    fn header(&self, meta: &Meta) -> Vec<String> {
        let Analysis { frames, rate_hz, start_s, end_s, .. } = self.analysis;
        let plural = if *frames == 1 { "" } else { "s" };
        let duration = decimals(end_s - start_s, 3);
        let mut lines = vec![format!(
            "{}  {duration} s, {frames} frame{plural} at {} Hz{}",
            self.bold(&meta.log),
            number(*rate_hz),
            meta.date().map_or(String::new(), |date| format!(", from {date}"))
        )];
        let mut facts = Vec::new();
        facts.extend(meta.binding.iter().map(|binding| format!("binding {binding}")));
        facts.push(format!("rules {}", meta.rules.join(", ")));
        facts.extend(meta.hand_model.iter().map(|hand_model| format!("hand model {hand_model}")));
        facts.extend(meta.params.iter().map(|(name, value)| format!("{name} = {value}")));
        facts.extend((!meta.digest.is_empty()).then(|| format!("digest {}", meta.digest)));
        facts.push(format!("teachtree {VERSION}"));
        lines.extend(wrap(&facts.join("; "), self.style.width, "", "  "));
        if self.analysis.has_criterion() {
            lines.extend(self.outcome());
        }
        lines
    }

    /// The outcome with its reasons.
    fn outcome(&self) -> Vec<String> {
        let sentence = self.analysis.outcome().sentence();
        let sentence = if self.style.unicode { sentence } else { sentence.replace('–', "-") };
        wrap(&format!("outcome {sentence}"), self.style.width, "", "  ")
    }

    fn lanes(&self, track: &Track) -> Vec<String> {
        let name = track.who.to_string();
        let mut lines = vec![format!("{}{}", self.bold(&format!("{name:GUTTER$}")), self.axis())];
        lines.push(format!("{:GUTTER$}{}", "raw", self.lane(&bars(&track.segments))));
        if track.relabeled.iter().any(|segment| !segment.by.is_empty()) || track.relabeled.len() != track.segments.len()
        {
            lines.push(format!("{:GUTTER$}{}", "relabeled", self.lane(&bars(&track.relabeled))));
        }
        if !track.tasks.is_empty() {
            let tasks: Vec<Bar> = (track.tasks.iter().zip(palette::TASKS.into_iter().cycle()))
                .map(|(task, color)| Bar { start_s: task.start_s, end_s: task.end_s, name: &task.task, color })
                .collect();
            lines.push(format!("{:GUTTER$}{}", "tasks", self.lane(&tasks)));
        }
        if !track.composites.is_empty() {
            let bars: Vec<Bar> = (track.composites.iter().zip(palette::TASKS.into_iter().cycle().skip(1)))
                .map(|(it, color)| Bar { start_s: it.start_s, end_s: it.end_s, name: &it.task, color })
                .collect();
            lines.push(format!("{:GUTTER$}{}", "composite", self.lane(&bars)));
        }
        lines
    }

    fn columns(&self) -> usize {
        self.style.width - GUTTER
    }

    /// The column of a time.
    fn column(&self, time_s: f64) -> f64 {
        let Analysis { start_s, end_s, .. } = self.analysis;
        let length = (end_s - start_s).max(f64::MIN_POSITIVE);
        (time_s - start_s) / length * self.columns() as f64
    }

    /// Marks at round times, ten columns apart or more.
    fn axis(&self) -> String {
        let Analysis { start_s, end_s, .. } = self.analysis;
        let step = round_step((end_s - start_s) * 10.0 / self.columns() as f64);
        let mut axis = String::new();
        let mut tick = (start_s / step).ceil() * step;
        // The width bounds the marks; the comparison also ends on what is not a number.
        while tick <= *end_s && axis.chars().count() < self.columns() {
            let column = self.column(tick) as usize;
            let mark = format!("{} s", decimals(tick, 3));
            if column + mark.len() > self.columns() || column < axis.len() {
                break;
            }
            axis.push_str(&" ".repeat(column - axis.len()));
            axis.push_str(&mark);
            tick += step;
        }
        axis
    }

    /// Which bar each column shows: the one with the greatest share of it; a bar that would show nowhere takes the column of its middle
    /// from a bar that has others.
    fn owners(&self, bars: &[Bar]) -> Vec<Option<usize>> {
        let columns = self.columns();
        let mut owners: Vec<Option<usize>> = vec![None; columns];
        let mut shares = vec![0.5; columns];
        for (at, bar) in bars.iter().enumerate() {
            let (start, end) = (self.column(bar.start_s), self.column(bar.end_s));
            for column in start as usize..(end.ceil() as usize).min(columns) {
                let share = end.min(column as f64 + 1.0) - start.max(column as f64);
                if share >= shares[column] {
                    shares[column] = share;
                    owners[column] = Some(at);
                }
            }
        }
        let mut counts = vec![0_usize; bars.len()];
        owners.iter().flatten().for_each(|owner| counts[*owner] += 1);
        for (at, bar) in bars.iter().enumerate() {
            let middle = (self.column((bar.start_s + bar.end_s) / 2.0) as usize).min(columns - 1);
            let spare = owners[middle].is_none_or(|owner| counts[owner] > 1);
            if counts[at] == 0 && spare {
                if let Some(owner) = owners[middle] {
                    counts[owner] -= 1;
                }
                owners[middle] = Some(at);
                counts[at] = 1;
            }
        }
        owners
    }

    fn lane(&self, bars: &[Bar]) -> String {
        let owners = self.owners(bars);
        let runs = owners.chunk_by(|one, next| one == next);
        runs.map(|run| match run.first().copied().flatten().and_then(|owner| bars.get(owner)) {
            Some(bar) => self.bar(bar, run.len()),
            None => " ".repeat(run.len()),
        })
        .collect()
    }

    /// A bar of a width: a name as far as it fits, after a mark for the beginning when there is room.
    fn bar(&self, bar: &Bar, width: usize) -> String {
        let edge = match (self.style.color, self.style.unicode) {
            _ if width < 2 => "",
            (true, _) if width < 4 => "",
            (true, _) => " ",
            (false, true) => "▏",
            (false, false) => "|",
        };
        let room = width - edge.chars().count();
        let name: String = bar.name.chars().take(room).collect();
        let fill = if self.style.color { " " } else { "." };
        let padding = fill.repeat(room - name.chars().count());
        let cell = format!("{edge}{name}{padding}");
        if self.style.color {
            format!("\x1b[48;5;{}m\x1b[38;5;{}m{cell}\x1b[0m", bar.color.terminal(), INK.terminal())
        } else {
            cell
        }
    }

    fn list(&self, track: &Track) -> Vec<String> {
        let mut lines = vec![self.bold(&track.who.to_string())];
        for composite in &track.composites {
            let name = self.bold(&format!("{:1$}", composite.task, self.names + SWATCH));
            let times = self.times(composite.start_s, composite.end_s);
            lines.push(format!("  {name}{times}   {}", parts(composite)));
        }
        if track.relabeled.is_empty() {
            lines.push(if track.who == TrackId::Both { "  no coordination" } else { "  no task" }.into());
        }
        let mut outside = outside(track).into_iter().peekable();
        for task in &track.tasks {
            let is_before = |stretch: &&[Segment]| stretch.first().is_some_and(|first| first.start_s < task.start_s);
            while let Some(stretch) = outside.next_if(is_before) {
                lines.extend(self.no_task(track.who, stretch));
            }
            lines.extend(self.task(task));
        }
        lines.extend(outside.flat_map(|stretch| self.no_task(track.who, stretch)));
        lines
    }

    fn no_task(&self, who: TrackId, stretch: &[Segment]) -> Vec<String> {
        let title = matches!(who, TrackId::Hand(_)).then(|| "  no task".to_string());
        title.into_iter().chain(stretch.iter().flat_map(|segment| self.segment(segment))).collect()
    }

    fn task(&self, task: &TaskSpan) -> Vec<String> {
        let times = self.times(task.start_s, task.end_s);
        let width = self.names + SWATCH;
        let name = self.bold(&format!("{:width$}", task.task.clone() + &task.subject.suffix()));
        let stability = task.stability.map_or_else(String::new, |share| format!("   stability {}", percent(share)));
        let mut lines = vec![format!("  {name}{times}{stability}   {}", remarks(task))];
        lines.extend(task.segments.iter().flat_map(|segment| self.segment(segment)));
        lines
    }

    fn segment(&self, segment: &Segment) -> Vec<String> {
        let swatch = if self.style.color {
            format!("\x1b[48;5;{}m  \x1b[0m", palette::color(&segment.primitive, segment.does).terminal())
        } else {
            "  ".into()
        };
        let times = self.times(segment.start_s, segment.end_s);
        let (name, width) = (segment.primitive.clone() + &segment.subject.suffix(), self.names);
        let confidence_text = segment.confidence.map_or_else(String::new, |it| self.confidence_text(&it));
        let mut lines = vec![format!("  {swatch} {name:width$}{times}{confidence_text}")];
        if !segment.by.is_empty() {
            let trail = format!("was {}; by {}", segment.was.join(" "), segment.by.join("; "));
            lines.extend(wrap(&trail, self.style.width, "       ", "         "));
        }
        lines
    }

    /// How sure a start is: the confidence, the interval that contains the starts of all variations, and the margin in standard deviations.
    fn confidence_text(&self, Confidence { share, earliest_s, latest_s, margin, .. }: &Confidence) -> String {
        let margin = margin.map_or_else(String::new, |margin| format!(", margin {} SD", decimals(margin, 1)));
        let dash = if self.style.unicode { "–" } else { "-" };
        format!("   confidence {}, starts {earliest_s:.3} {dash} {latest_s:.3} s{margin}", percent(*share))
    }

    fn times(&self, start_s: f64, end_s: f64) -> String {
        let dash = if self.style.unicode { "–" } else { "-" };
        // A long time keeps its distance from the name before it.
        format!(" {start_s:8.3} {dash} {end_s:8.3} s")
    }

    fn issues(&self) -> Vec<String> {
        let mut lines = vec![self.bold("issues")];
        for issue in &self.analysis.issues {
            let channel = if issue.channel.is_empty() { String::new() } else { format!(" {}", issue.channel) };
            let times = self.times(issue.start_s, issue.end_s);
            let text = format!("{}{channel}, {}: {}", issue.kind, times.trim_start(), issue.message);
            lines.extend(wrap(&text, self.style.width, "  ", "    "));
        }
        lines
    }

    fn bold(&self, text: &str) -> String {
        if self.style.color { format!("\x1b[1m{text}\x1b[0m") } else { text.into() }
    }
}

/// The stretches of segments of no task: all of a track without tasks, else those in which the hand does more than move and approach.
fn outside(track: &Track) -> Vec<&[Segment]> {
    let is_inside = |segment: &Segment| track.tasks.iter().any(|task| task.frames.contains(&segment.frames.start));
    let handles = |segment: &Segment| !segment.does.is_some_and(Meaning::is_free);
    let stretches = track.relabeled.chunk_by(|one, next| is_inside(one) == is_inside(next));
    let is_shown = |stretch: &&[Segment]| {
        !stretch.iter().any(is_inside) && (track.tasks.is_empty() || stretch.iter().any(handles))
    };
    stretches.filter(is_shown).collect()
}

fn bars(segments: &[Segment]) -> Vec<Bar<'_>> {
    segments
        .iter()
        .map(|segment| Bar {
            start_s: segment.start_s,
            end_s: segment.end_s,
            name: &segment.primitive,
            color: palette::color(&segment.primitive, segment.does),
        })
        .collect()
}

/// Breaks a text at blanks into lines of a width.
fn wrap(text: &str, width: usize, first: &str, rest: &str) -> Vec<String> {
    let mut lines = vec![first.to_string()];
    let mut empty = true;
    for word in text.split_whitespace() {
        let line = lines.last().map_or(0, |line| line.chars().count());
        if !empty && line + 1 + word.chars().count() > width {
            lines.push(rest.to_string());
            empty = true;
        }
        if let Some(line) = lines.last_mut() {
            if !empty {
                line.push(' ');
            }
            line.push_str(word);
        }
        empty = false;
    }
    lines
}
