//! What an analysis finds in a recording, and how that of a damaged copy differs.

use crate::alteration::DamagedFile;
use crate::sources::Source;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use teachtree::{Error, Log, Rules, Side, TrackId};

/// The names of [`Outcome`]s, in order.
pub const NAMES: [&str; 6] =
    ["refused", "reported", "same labels", "changed at the damage", "changed further", "panics"];

/// What came of damage.
pub enum Outcome {
    /// The log is refused.
    Refused,
    /// An issue is reported that the plain recording does not have.
    Reported,
    /// The same labels and tasks.
    Same,
    /// The same tasks, and other labels only at the damaged samples.
    Near,
    /// Other labels elsewhere, or other tasks, and no new issue.
    Further(String),
    Panicked(String),
}

impl Outcome {
    pub const fn index(&self) -> usize {
        match self {
            Self::Refused => 0,
            Self::Reported => 1,
            Self::Same => 2,
            Self::Near => 3,
            Self::Further(_) => 4,
            Self::Panicked(_) => 5,
        }
    }
}

/// A label and when it lasts, s.
type TimedLabel = (TrackId, f64, f64, String);

/// What is found in a recording.
struct Labels {
    segments: Vec<TimedLabel>,
    tasks: Vec<(TrackId, String)>,
    /// Kind and channel of each issue, and when it is, ms; texts may differ in numbers that are of no account.
    issues: Vec<(String, String, [i64; 2])>,
    span_s: [f64; 2],
}

/// What is found in the plain recording, and the rules for it.
pub struct Baseline {
    rules: Rules,
    hands: Vec<Side>,
    labels: Labels,
}

fn labels(rules: &Rules, log: &Log) -> Result<Labels, Error> {
    let analysis = rules.analyze(log)?;
    let ms = |secs: f64| (secs * 1e3).round() as i64;
    let segments = analysis.tracks().flat_map(|track| track.segments());
    let tasks =
        analysis.tracks().flat_map(|track| track.tasks().map(move |task| (track.who(), task.name().to_string())));
    Ok(Labels {
        segments: segments.map(|it| (it.track(), it.start_s(), it.end_s(), it.primitive().to_string())).collect(),
        tasks: tasks.collect(),
        issues: analysis
            .issues()
            .iter()
            .map(|it| (it.kind.name().to_string(), it.channel.clone(), [ms(it.start_s), ms(it.end_s)]))
            .collect(),
        span_s: [analysis.start_s(), analysis.end_s()],
    })
}

impl Baseline {
    pub fn of_plain(source: &Source) -> Result<Self, Error> {
        let log = source.open(&source.path)?;
        let rules = Rules::for_log(&log)?;
        Ok(Self { hands: log.hands(), labels: labels(&rules, &log)?, rules })
    }

    /// Analyzes a damaged copy.
    pub fn compare(&self, source: &Source, file: &Path, altered: &DamagedFile, margin_s: f64) -> Outcome {
        let run = || {
            let log = source.open(file)?;
            // Other hands may need other rules.
            let own = if log.hands() == self.hands { None } else { Some(Rules::for_log(&log)?) };
            labels(own.as_ref().unwrap_or(&self.rules), &log)
        };
        match catch_unwind(AssertUnwindSafe(run)) {
            Err(panic) => Outcome::Panicked(panic.downcast_ref::<String>().cloned().unwrap_or_default()),
            Ok(Err(_)) => Outcome::Refused,
            Ok(Ok(found)) => self.outcome(&found, altered, source.rows(), margin_s),
        }
    }

    fn outcome(&self, found: &Labels, altered: &DamagedFile, rows: usize, margin_s: f64) -> Outcome {
        let plain = &self.labels;
        if found.issues.iter().any(|issue| !plain.issues.contains(issue)) {
            return Outcome::Reported;
        }
        let changed = changes(plain, found);
        if changed.is_empty() && plain.tasks == found.tasks {
            return Outcome::Same;
        }
        // Rows come at even steps, nearly.
        let [start_s, end_s] = plain.span_s;
        let time = |row: usize| start_s + row as f64 / rows.max(1) as f64 * (end_s - start_s);
        let is_near = altered.rows.as_ref().is_some_and(|damaged| {
            let (from_s, to_s) = (time(damaged.start) - margin_s, time(damaged.end) + margin_s);
            changed.iter().all(|(_, from, to, _)| *from >= from_s && *to <= to_s)
        });
        if is_near && plain.tasks == found.tasks {
            return Outcome::Near;
        }
        let mut how: Vec<String> =
            changed.iter().take(3).map(|(who, from, to, what)| format!("{who} {from:.3}..{to:.3} s {what}")).collect();
        if plain.tasks != found.tasks {
            let named = |tasks: &[(TrackId, String)]| {
                tasks.iter().map(|(_, task)| task.as_str()).collect::<Vec<_>>().join(", ")
            };
            how.push(format!("tasks [{}] became [{}]", named(&plain.tasks), named(&found.tasks)));
        }
        Outcome::Further(how.join("; "))
    }
}

/// Where labels differ.
fn changes(plain: &Labels, found: &Labels) -> Vec<TimedLabel> {
    const INSTANT_S: f64 = 1e-6;
    let mut changed = Vec::new();
    let mut tracks: Vec<TrackId> = plain.segments.iter().chain(&found.segments).map(|it| it.0).collect();
    tracks.sort_by_key(|who| who.to_string());
    tracks.dedup();
    for who in tracks {
        let [before, after] = [plain, found].map(|it| it.segments.iter().filter(|it| it.0 == who).collect::<Vec<_>>());
        let mut stamps: Vec<f64> = before.iter().chain(&after).flat_map(|it| [it.1, it.2]).collect();
        stamps.sort_by(f64::total_cmp);
        for pair in stamps.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            let at = |labels: &[&TimedLabel]| {
                let middle = f64::midpoint(from, to);
                labels
                    .iter()
                    .find(|it| it.1 <= middle && middle < it.2)
                    .map_or_else(|| "nothing".into(), |it| it.3.clone())
            };
            let (was, is) = (at(&before), at(&after));
            if to - from > INSTANT_S && was != is {
                changed.push((who, from, to, format!("{was} became {is}")));
            }
        }
    }
    changed
}
