//! The report of an audit: a table for terminals, and a page for browsers that needs no network and no scripts.

mod csv;
mod json;

pub use self::csv::csv;
pub use json::json;

use super::palette::{INK, color};
use super::svg::{escape, length};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use teachtree_analysis::audit::{DrawnSegment, Facts, Finding, FindingKind};
use teachtree_analysis::json::{Meta, VERSION};
use teachtree_analysis::{TrackId, number::fixed};

/// The widest name of a recording in a table.
const NAME: usize = 48;
/// Letters of the text after the names that a line has at least.
const TEXT: usize = 40;
/// The width of the time axis of a page, and the height of a lane.
const WIDTH: f64 = 720.0;
const LANE: f64 = 16.0;

/// An audit of recordings.
pub struct Audit<'a> {
    /// Each with its name.
    pub recordings: &'a [(String, Facts)],
    /// Those that could not be read, with the reason.
    pub failed: &'a [(String, String)],
    /// The number of recordings that have each task.
    pub tasks: &'a BTreeMap<String, usize>,
    /// The number of recordings with each failed task.
    pub failures: &'a BTreeMap<String, usize>,
    /// The usual properties of the set, as text.
    pub usual: &'a [String],
    /// Checks that were left out, with the reason, in words.
    pub unchecked: &'a [String],
    /// What does not make a recording a bad one.
    pub allowed: &'a [FindingKind],
}

impl Audit<'_> {
    /// Whether nothing is wrong with a recording but what is allowed.
    pub fn is_good(&self, facts: &Facts) -> bool {
        facts.findings.iter().all(|finding| self.allowed.contains(&finding.kind))
    }

    /// The number of recordings with findings of each kind.
    pub fn counts(&self) -> BTreeMap<FindingKind, usize> {
        let has = |kind: FindingKind| {
            self.recordings.iter().filter(move |(_, facts)| facts.findings.iter().any(|it| it.kind == kind))
        };
        FindingKind::ALL.into_iter().map(|kind| (kind, has(kind).count())).collect()
    }

    /// Number of recordings that are good.
    pub fn good(&self) -> usize {
        self.recordings.iter().filter(|(_, facts)| self.is_good(facts)).count()
    }

    /// Formats the number of recordings per task, most frequent first; `None` for a single recording.
    fn by_task(&self, counts: &BTreeMap<String, usize>) -> Option<String> {
        let all = self.recordings.len();
        let mut tasks: Vec<(&String, &usize)> = counts.iter().collect();
        tasks.sort_by_key(|(_, count)| std::cmp::Reverse(**count));
        let words = |(task, count): &(&String, &usize)| format!("{task} in {count} of {all}");
        (all > 1 && !tasks.is_empty()).then(|| tasks.iter().map(words).collect::<Vec<_>>().join(", "))
    }

    fn summary(&self) -> String {
        let all = self.recordings.len();
        let mut text =
            format!("{} of {all} {} good", self.good(), if all == 1 { "recording is" } else { "recordings are" });
        for (kind, count) in self.counts().into_iter().filter(|(_, count)| *count > 0) {
            let allowed = if self.allowed.contains(&kind) { " (allowed)" } else { "" };
            let with = if kind.is_counted_with() { "with " } else { "" };
            let _ = write!(text, ", {count} {with}{}{allowed}", kind.words());
        }
        if !self.failed.is_empty() {
            let _ = write!(text, ", {} cannot be read", self.failed.len());
        }
        text
    }
}

/// An interval, printed after its words.
fn span(span_s: Option<[f64; 2]>) -> String {
    span_s.map_or(String::new(), |[start, end]| format!(" [{}–{} s]", fixed(start, 2), fixed(end, 2)))
}

/// A finding in words: column, kind and time.
fn described(finding: &Finding) -> String {
    let column = finding.column.as_ref().map_or(String::new(), |column| format!("{column}: "));
    format!("{column}{}{}", finding.message, span(finding.span_s))
}

/// The table, with lines of this width.
pub fn text(audit: &Audit, width: usize) -> String {
    let shown = |name: &str| {
        let count = name.chars().count();
        if count <= NAME {
            name.to_string()
        } else {
            format!("…{}", name.chars().skip(count + 1 - NAME).collect::<String>())
        }
    };
    let names = audit.recordings.iter().map(|(name, _)| shown(name).chars().count());
    let name_width = names.max().unwrap_or(0).max("recording".len());
    let mut text = format!("{:<name_width$}  {:>8}  finding\n", "recording", "length");
    for (name, facts) in audit.recordings {
        let head = format!("{:<name_width$}  {:>6} s", shown(name), fixed(facts.duration_s(), 1));
        if facts.findings.is_empty() {
            let _ = writeln!(text, "{head}  -");
        }
        for (at, finding) in facts.findings.iter().enumerate() {
            let words = format!("{}: {}", finding.kind.words(), described(finding));
            let room = width.saturating_sub(name_width + 12).max(TEXT);
            for (line, part) in wrapped(&words, room).into_iter().enumerate() {
                let head = if at == 0 && line == 0 { head.clone() } else { " ".repeat(name_width + 10) };
                let indent = if line == 0 { "" } else { "  " };
                let _ = writeln!(text, "{head}  {indent}{part}");
            }
        }
    }
    for (title, counts) in [("tasks", audit.tasks), ("failures", audit.failures)] {
        if let Some(tasks) = audit.by_task(counts) {
            let _ = writeln!(text, "{title}: {tasks}");
        }
    }
    for sentence in audit.usual {
        let _ = writeln!(text, "usual: {sentence}");
    }
    for sentence in audit.unchecked {
        let _ = writeln!(text, "not checked: {sentence}");
    }
    let _ = writeln!(text, "{}", audit.summary());
    text
}

/// Words in lines of a width.
fn wrapped(words: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in words.split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.into()),
        }
    }
    lines
}

const STYLE: &str = "body{font:14px system-ui,\"Segoe UI\",Roboto,sans-serif;color:#1b1f27;max-width:1100px;margin:2em auto;padding:0 1em}\
h1{font-size:20px}table{border-collapse:collapse;width:100%}td,th{border-top:1px solid #d9dee6;padding:6px 10px 6px 0;text-align:left;\
vertical-align:top}th{font-weight:600}.quiet{color:#5b6472}.kind{display:inline-block;border-radius:3px;padding:0 6px;margin-right:6px;\
background:#f6d5d0;white-space:nowrap}.allowed{background:#e6e9ee}.good{background:#d3ecd6}ul{margin:4px 0;padding:0;list-style:none}\
svg{display:block;font:11px system-ui,sans-serif}.lane{fill:#5b6472}.found{fill:none;stroke:#c0392b;stroke-width:2}";

/// The page; `meta` says by which rules, if there were any.
pub fn page(audit: &Audit, meta: Option<&Meta>) -> String {
    let longest = audit.recordings.iter().map(|(_, facts)| facts.duration_s()).fold(0.0, f64::max);
    let mut body =
        format!("<h1>Audit of {} recordings</h1>\n<p>{}.</p>\n", audit.recordings.len(), escape(&audit.summary()));
    for (title, counts) in [("Tasks", audit.tasks), ("Failures", audit.failures)] {
        if let Some(tasks) = audit.by_task(counts) {
            let _ = writeln!(body, "<p>{title}: {}.</p>", escape(&tasks));
        }
    }
    for (title, sentences) in [("Usual in this set", audit.usual), ("Not checked", audit.unchecked)] {
        let items: String = sentences.iter().map(|it| format!("<li>{}</li>", escape(it))).collect();
        if !items.is_empty() {
            let _ = writeln!(body, "<p>{title}:</p><ul>{items}</ul>");
        }
    }
    body.push_str("<table>\n<tr><th>recording</th><th>length</th><th>segments and findings</th></tr>\n");
    for (name, facts) in audit.recordings {
        let findings: String = facts
            .findings
            .iter()
            .map(|finding| {
                let class = if audit.allowed.contains(&finding.kind) { "kind allowed" } else { "kind" };
                let words = escape(&described(finding));
                format!("<li><span class=\"{class}\">{}</span>{words}</li>", finding.kind.words())
            })
            .collect();
        let good = if facts.findings.is_empty() { "<li><span class=\"kind good\">good</span></li>" } else { "" };
        let (name, seconds, drawn) = (escape(name), fixed(facts.duration_s(), 1), lanes(facts, longest));
        let _ = writeln!(
            body,
            "<tr><td>{name}</td><td>{seconds}&nbsp;s</td><td>{drawn}<ul>{findings}{good}</ul></td></tr>"
        );
    }
    for (name, why) in audit.failed {
        let _ = writeln!(body, "<tr><td>{}</td><td></td><td>cannot be read: {}</td></tr>", escape(name), escape(why));
    }
    body.push_str("</table>\n");
    let rules = meta.map_or("no rules".into(), |meta| {
        format!("rules {}, digest {}", escape(&meta.rules.join(" ")), escape(&meta.digest))
    });
    let _ = writeln!(body, "<p class=\"quiet\">teachtree {VERSION}, {rules}</p>");
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Audit</title>\n<style>{STYLE}</style></head>\n<body>\n{body}</body></html>\n"
    )
}

/// The segments of the hands as bars; all recordings have one scale. What findings are about is framed.
fn lanes(facts: &Facts, longest: f64) -> String {
    let x = |time_s: f64| 44.0 + (time_s - facts.start_s).max(0.0) / longest.max(f64::MIN_POSITIVE) * WIDTH;
    // An audit without rules has findings and no lanes.
    let height = facts.lanes.len().max(1) as f64 * (LANE + 2.0) + 2.0;
    let mut svg =
        format!("<svg width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\">", length(WIDTH + 48.0), length(height));
    for (at, (who, spans)) in facts.lanes.iter().enumerate() {
        let top = 1.0 + at as f64 * (LANE + 2.0);
        let _ = write!(svg, "<text class=\"lane\" x=\"0\" y=\"{}\">{who}</text>", length(top + 12.0));
        spans.iter().for_each(|span| svg.push_str(&bar(span, top, &x)));
    }
    for finding in &facts.findings {
        let Some([start, end]) = finding.span_s else { continue };
        let lane = |who: TrackId| facts.lanes.iter().position(|(known, _)| *known == who);
        let (top, lanes) = finding.track.and_then(lane).map_or((0, facts.lanes.len().max(1)), |at| (at, 1));
        let (left, top, height) = (x(start), 1.0 + top as f64 * (LANE + 2.0), lanes as f64 * (LANE + 2.0) - 2.0);
        let (left, top, width, height) = (length(left), length(top), length((x(end) - left).max(2.0)), length(height));
        let _ = write!(svg, "<rect class=\"found\" x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\"/>");
    }
    svg + "</svg>"
}

fn bar((start, end, name, does): &DrawnSegment, top: f64, x: &dyn Fn(f64) -> f64) -> String {
    let (left, width) = (x(*start), x(*end) - x(*start));
    let fill = color(name, *does).hex();
    let title = escape(&format!("{name} {}–{} s", fixed(*start, 2), fixed(*end, 2)));
    let mut bar = format!(
        "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{LANE}\" fill=\"{fill}\"><title>{title}</title></rect>",
        length(left),
        length(top),
        length(width)
    );
    if width > 7.0 * name.chars().count() as f64 {
        let (at, down, ink) = (length(left + 3.0), length(top + 12.0), INK.hex());
        let _ = write!(bar, "<text x=\"{at}\" y=\"{down}\" fill=\"{ink}\">{}</text>", escape(name));
    }
    bar
}
