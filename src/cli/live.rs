//! `teachtree analyze -`: JSON lines on standard input, segments printed as they close.
//!
//! What the rules read of a frame depends on frames before and after it (targets, velocities, dead sensors), so the log so far is analysed
//! again and again: each time that it has grown by [`LOOK_SECS`] and by a share of its length, which bounds the work. A segment is printed
//! when it has been closed for [`SURE_SECS`]; what is said at the end is about the whole log, and counts.

use super::{Failure, output};
use crate::analysis::Analysis;
use crate::base::error::InputError;
use crate::base::scene::Scene;
use crate::base::units::compound;
use crate::stream::binding::{Filling, Pattern};
use crate::stream::formats::jsonl::{Line, Lines, push, source};
use crate::stream::sheet::{Cells, Memory};
use crate::stream::table::Source;
use std::collections::BTreeMap;
use std::io::BufRead;

/// The log is looked at when it has grown by this much, s.
const LOOK_SECS: f64 = 0.25;
/// And by one frame in so many.
const LOOK_SHARE: usize = 32;
/// How long before the end of the log a segment must have closed to be printed, s: longer than the rules look ahead.
const SURE_SECS: f64 = 1.0;

/// Reads a log from its lines to the end; `time` is the column of its stamps, `analyse` makes an analysis of a log, and `say` is given a
/// line a segment.
///
/// # Errors
/// When a line is no JSON object, or nothing can be said.
pub fn read(
    bytes: impl BufRead,
    time: &Pattern,
    analyse: &mut dyn FnMut(Source) -> Result<Analysis, Failure>,
    say: &mut dyn FnMut(&str) -> Result<(), InputError>,
) -> Result<Source, Failure> {
    let mut lines = Lines::new(bytes, "standard input".into());
    let mut log = Log { rows: Memory::new("standard input"), scene: None };
    let mut said = Said::default();
    let (mut looked_rows, mut looked_s) = (0, f64::NEG_INFINITY);
    let to_seconds = time.unit.as_deref().and_then(|unit| compound(unit).ok()).map_or(1.0, |(factor, _)| factor);
    let mut cut = None;
    while let Some(line) = lines.line()? {
        let row = match line {
            Line::Scene(scene) => {
                log.scene = Some(*scene);
                continue;
            }
            Line::Row(row) => row,
            Line::Cut(message) => {
                cut = Some(message);
                continue;
            }
        };
        push(&row, &mut log.rows).map_err(|message| lines.error(message))?;
        let now = log.now(&time.name.fill(Filling::default())) * to_seconds;
        if now - looked_s >= LOOK_SECS && log.rows.rows() >= looked_rows + looked_rows / LOOK_SHARE + 2 {
            (looked_rows, looked_s) = (log.rows.rows(), now);
            // What cannot be analysed yet may be later; the end decides.
            if let Ok(analysis) = analyse(log.clone().source(None)) {
                said.say(&analysis, say)?;
            }
        }
    }
    Ok(log.source(cut))
}

/// A log so far.
#[derive(Clone)]
struct Log {
    rows: Memory,
    scene: Option<Scene>,
}

impl Log {
    /// The stamp of the last row in the column of this name.
    fn now(&self, time: &str) -> f64 {
        match self.rows.columns().get(time) {
            Some(Cells::Numbers(stamps)) => stamps.last().copied().unwrap_or(f64::NAN),
            _ => f64::NAN,
        }
    }

    fn source(self, cut: Option<String>) -> Source {
        source(self.rows, self.scene, cut)
    }
}

/// Until when each track was told, s.
#[derive(Default)]
struct Said {
    until_s: BTreeMap<String, f64>,
}

impl Said {
    fn say(
        &mut self,
        analysis: &Analysis,
        say: &mut dyn FnMut(&str) -> Result<(), InputError>,
    ) -> Result<(), InputError> {
        let mut lines: Vec<(f64, String)> = vec![];
        for track in &analysis.tracks {
            let until_s = self.until_s.entry(track.who.to_string()).or_insert(f64::NEG_INFINITY);
            // The last segment of a track is still going on.
            let closed = track.segments.split_last().map_or(&[][..], |(_, closed)| closed);
            for segment in closed {
                if segment.end_s > *until_s && segment.end_s <= analysis.end_s - SURE_SECS {
                    let start_s = segment.start_s.max(*until_s);
                    let (who, name) = (&track.who, &segment.primitive);
                    lines.push((
                        segment.end_s,
                        format!("{who:<6} {name:<12} {start_s:8.3} – {:8.3} s\n", segment.end_s),
                    ));
                    *until_s = segment.end_s;
                }
            }
        }
        lines.sort_by(|a, b| a.0.total_cmp(&b.0));
        lines.iter().try_for_each(|(_, line)| say(line))
    }
}

/// Prints a line at once.
///
/// # Errors
/// When standard output cannot be written.
pub fn say(line: &str) -> Result<(), InputError> {
    output::print(line)
}
