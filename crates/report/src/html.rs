//! The page for browsers: an analysis, its frames and its recording in, one file out that needs no network.
//!
//! With scripts it is a page to work in (`page`). Without, there is for each hand the lanes of raw segments, relabeled segments and tasks, and below them the
//! signals of the paper's Figure 5 with the boundaries of the raw segments as lines and points on the curves; for both hands the lanes. Tables say the same in
//! words.

use super::figure::figure;
use super::svg::{escape, scrolled};
use super::{page, palette, parts, remarks};
use teachtree_analysis::confidence::percent;
use teachtree_analysis::explain::AnalyzedRecording;
use teachtree_analysis::json::{Meta, VERSION};
use teachtree_analysis::number::{decimals, number};
use teachtree_analysis::{Analysis, CompositeSpan, Confidence, Segment, Subject, Track, TrackId};
use teachtree_base::error::InputError;
use teachtree_base::recording::Recording;
use teachtree_frames::frames::Frames;

/// Nothing is fetched, whatever the page is made of.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'";

/// Writes the page. The frames are those that were analyzed, made with [`channels`](super::channels) from the recording.
///
/// # Errors
/// When the rate of the log cannot honour a duration of the rules.
pub fn html(analyzed: &AnalyzedRecording, recording: &Recording, meta: &Meta) -> Result<String, InputError> {
    let AnalyzedRecording { analysis, frames, .. } = *analyzed;
    let mut body = header(analysis, meta);
    body.push_str(page::PLACE);
    body.push_str(&tasks(analysis));
    body.push_str("<details id=\"drawings\" open><summary>Drawings and tables, as they are printed</summary>\n");
    for track in &analysis.tracks {
        body.push_str(&section(track, analysis, frames));
    }
    body.push_str("</details>\n");
    body.push_str(&issues(analysis));
    body.push_str(&page::scripts(analyzed, recording, meta)?);
    Ok(format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{} – teachtree</title>\n<style>\n{}</style>\n</head>\n<body>\n{body}</body>\n</html>\n",
        escape(&meta.log),
        page::STYLE
    ))
}

fn header(analysis: &Analysis, meta: &Meta) -> String {
    let Analysis { frames, rate_hz, start_s, end_s, .. } = analysis;
    let mut facts = vec![format!("{} s, {frames} frames at {} Hz", decimals(end_s - start_s, 3), number(*rate_hz))];
    facts.extend(meta.date().map(|date| format!("from {date}")));
    facts.extend(meta.binding.iter().map(|binding| format!("binding <code>{}</code>", escape(binding))));
    let files: Vec<String> = meta.rules.iter().map(|file| format!("<code>{}</code>", escape(file))).collect();
    let mut rules = format!("rules {}", files.join(", "));
    if !meta.digest.is_empty() {
        rules.push_str(&format!(", digest <code>{}</code>", escape(&meta.digest)));
    }
    let params: Vec<String> =
        meta.params.iter().map(|(name, value)| format!("<code>{} = {}</code>", escape(name), escape(value))).collect();
    if !params.is_empty() {
        rules.push_str(&format!(", with {}", params.join(", ")));
    }
    rules.extend(meta.hand_model.iter().map(|hand_model| format!("; hand model {}", escape(hand_model))));
    rules.push_str(&format!("; teachtree {VERSION}"));
    format!(
        "<header>\n<h1>{}</h1>\n<p class=\"quiet\">{}</p>\n<p class=\"quiet\">{rules}</p>\n{}</header>\n",
        escape(&meta.log),
        facts.join("; "),
        if analysis.has_criterion() { outcome(analysis) } else { String::new() }
    )
}

/// The outcome with its reasons, colored by the result.
fn outcome(analysis: &Analysis) -> String {
    let outcome = analysis.outcome();
    let class = outcome.result.name();
    format!("<p class=\"outcome {class}\">Outcome {}</p>\n", escape(&outcome.sentence()))
}

fn tasks(analysis: &Analysis) -> String {
    let rows: Vec<String> = (analysis.tracks.iter())
        .flat_map(|track| track.tasks.iter().map(move |task| (track, task)))
        .map(|(track, task)| {
            let chips: String = task.segments.iter().map(chip).collect();
            format!(
                "<tr><td><strong>{}</strong></td><td>{}</td>{}{}<td>{chips}</td>{}<td>{}</td></tr>\n",
                escape(&task.task),
                track.who,
                subject_cells(&task.subject),
                time_cells(task.start_s, task.end_s),
                share_cell(task.stability),
                escape(&remarks(task))
            )
        })
        .chain(analysis.tracks.iter().flat_map(|track| track.composites.iter().map(move |it| composite(track, it))))
        .collect();
    let sure = share_title(analysis.tracks.iter().flat_map(|track| &track.tasks).any(|task| task.stability.is_some()));
    if rows.is_empty() {
        return "<h2>Tasks</h2>\n<p>No task was found.</p>\n".into();
    }
    format!(
        "<h2>Tasks</h2>\n{}<table>\n<tr><th>task</th><th>hand</th><th>object</th><th>partner</th><th>start s</th><th>end s</th><th>segments</th>{sure}<th></th></tr>\n{}</table></div>\n",
        scrolled("Tasks"),
        rows.concat()
    )
}

/// The row of a task that is made of tasks.
fn composite(track: &Track, found: &CompositeSpan) -> String {
    let names = escape(&found.parts.join(", "));
    let (sure, cut) = (track.tasks.iter().any(|task| task.stability.is_some()), escape(&parts(found)));
    format!(
        "<tr><td><strong>{}</strong></td><td>{}</td><td></td><td></td>{}<td>{names}</td>{}<td>{cut}</td></tr>\n",
        escape(&found.task),
        track.who,
        time_cells(found.start_s, found.end_s),
        if sure { "<td></td>" } else { "" },
    )
}

/// The title of the column of stabilities, if the tasks have them.
fn share_title(is_known: bool) -> &'static str {
    if is_known { "<th>stability</th>" } else { "" }
}

/// Formats a confidence or a stability in percent; empty without one.
fn share_cell(share: Option<f64>) -> String {
    share.map_or_else(String::new, |share| format!("<td class=\"number\">{}</td>", escape(&percent(share))))
}

/// Formats the confidence of a segment's start, and its range under variation of the params.
fn confidence_cells(confidence: Option<Confidence>) -> String {
    confidence.map_or_else(String::new, |it| {
        let cell = share_cell(Some(it.share));
        format!("{cell}<td class=\"number\">{:.3} – {:.3}</td>", it.earliest_s, it.latest_s)
    })
}

fn subject_cells(subject: &Subject) -> String {
    let cell = |body: &Option<String>| format!("<td>{}</td>", escape(body.as_deref().unwrap_or_default()));
    cell(&subject.object) + &cell(&subject.partner)
}

fn time_cells(start_s: f64, end_s: f64) -> String {
    format!("<td class=\"number\">{start_s:.3}</td><td class=\"number\">{end_s:.3}</td>")
}

fn chip(segment: &Segment) -> String {
    let color = palette::color(&segment.primitive, segment.does).hex();
    format!("<span class=\"chip\" style=\"background:{color}\">{}</span>", escape(&segment.primitive))
}

fn section(track: &Track, analysis: &Analysis, frames: &Frames) -> String {
    let heading = match track.who {
        TrackId::Hand(side) => format!("{} hand", capital(side.name())),
        TrackId::Both => "Both hands".into(),
    };
    let (drawing, lacking) = figure(track, analysis, frames, &heading);
    let mut section = format!("<h2>{heading}</h2>\n{}{drawing}</div>\n", scrolled(&heading));
    for (plot, channels) in lacking {
        section.push_str(&format!("<p class=\"warn\">No {plot}: the recording has no {channels}.</p>\n"));
    }
    section.push_str(&segments(track));
    section
}

fn capital(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn segments(track: &Track) -> String {
    let rows: String = (track.relabeled.iter())
        .map(|segment| {
            format!(
                "<tr><td>{}</td>{}{}{}<td>{}</td><td>{}</td></tr>\n",
                chip(segment),
                subject_cells(&segment.subject),
                time_cells(segment.start_s, segment.end_s),
                confidence_cells(segment.confidence),
                escape(&segment.was.join(", ")),
                escape(&segment.by.join("; "))
            )
        })
        .collect();
    if rows.is_empty() {
        return "<p class=\"quiet\">No segments.</p>\n".into();
    }
    let is_sure = track.relabeled.iter().any(|segment| segment.confidence.is_some());
    let sure = if is_sure { "<th>confidence</th><th>starts between, s</th>" } else { "" };
    format!(
        "<details><summary>Segments after relabeling: {}</summary>{}<table>\n\
         <tr><th>primitive</th><th>object</th><th>partner</th><th>start s</th><th>end s</th>{sure}<th>was</th><th>changed by</th></tr>\n{rows}</table></div></details>\n",
        track.relabeled.len(),
        scrolled("Segments after relabeling")
    )
}

fn issues(analysis: &Analysis) -> String {
    if analysis.issues.is_empty() {
        return String::new();
    }
    let rows: String = (analysis.issues.iter())
        .map(|issue| {
            format!(
                "<tr><td>{}</td>{}<td>{}</td><td>{}</td></tr>\n",
                escape(issue.kind.name()),
                time_cells(issue.start_s, issue.end_s),
                escape(&issue.channel),
                escape(&issue.message)
            )
        })
        .collect();
    format!(
        "<h2>Issues</h2>\n{}<table>\n<tr><th>kind</th><th>start s</th><th>end s</th><th>channel</th><th>what</th></tr>\n{rows}</table></div>\n",
        scrolled("Issues")
    )
}
