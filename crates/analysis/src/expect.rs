//! Expectations: what rules are to say of a recording, as text that a person reads and reviews; compared with a tolerance at boundaries.
//!
//! ```text
//! log: lift.csv                      settings, each at most once but `rules` and `set`
//! binding: lab.binding.yaml
//! tolerance: 20 ms
//!
//! track right                        then, for each track, its relabeled segments and its tasks
//!   task pick_and_place  7.904 .. 11.684
//!   Approach             7.904 .. 8.234
//! ```
//!
//! A line that ends with `pinned` is never replaced. `#` begins a comment. Times are s in the recording. A header between two lines `---`, as `cargo insta`
//! writes it, is passed over.

mod update;

use super::score::KnownNames;
use super::{Analysis, TrackId};
use teachtree_base::error::InputError;
use teachtree_base::units::{self, Dimension};
use teachtree_language::rules::Rules;
use teachtree_logs::read::first_stamp::in_recording;

/// The default tolerance of a boundary, s.
pub const TOLERANCE_S: f64 = 0.02;

/// The lines around the header that `cargo insta` writes.
const HEADER: &str = "---";

/// An expectation file.
#[derive(Clone, Debug, PartialEq)]
pub struct Expectation {
    /// The recording, beside the file.
    pub log: String,
    /// Its binding, beside the file.
    pub binding: Option<String>,
    /// Its scene, beside the file.
    pub scene: Option<String>,
    /// The rule files: beside the file, or shipped ones.
    pub rules: Vec<String>,
    /// The hand model.
    pub hand: Option<String>,
    /// Params to override.
    pub set: Vec<(String, String)>,
    /// The tolerance of a boundary, s.
    pub tolerance_s: f64,
    /// The expected segments and tasks, in the order of the file.
    pub lines: Vec<Line>,
    /// The text up to the first track.
    head: String,
    /// The whole text.
    text: String,
}

/// A segment or task that is expected.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Whose.
    pub who: TrackId,
    /// Whether it is a task.
    pub is_task: bool,
    /// The primitive or the task.
    pub name: String,
    /// When it starts, s.
    pub start_s: f64,
    /// When it ends, s.
    pub end_s: f64,
    /// Whether an update keeps it in the file.
    pub pinned: bool,
    /// The line of the file, counted from 1.
    pub line: usize,
}

impl Expectation {
    /// Lets times since 1970 count as those of the recording do; `zero_stamp_s` is what the stamps of its log show at 0 s.
    pub fn count_from(&mut self, zero_stamp_s: f64) {
        for line in &mut self.lines {
            line.start_s = in_recording(line.start_s, zero_stamp_s);
            line.end_s = in_recording(line.end_s, zero_stamp_s);
        }
    }

    /// Reads a file; `name` is its name in errors.
    ///
    /// # Errors
    /// At the first line that says nothing.
    pub fn read(text: &str, name: &str) -> Result<Self, InputError> {
        let mut read = Self {
            log: String::new(),
            binding: None,
            scene: None,
            rules: Vec::new(),
            hand: None,
            set: Vec::new(),
            tolerance_s: TOLERANCE_S,
            lines: Vec::new(),
            head: String::new(),
            text: text.to_string(),
        };
        let mut who: Option<TrackId> = None;
        // A file that `cargo insta review` accepted begins with a header between two lines `---`.
        let mut in_header = text.lines().next().is_some_and(|line| line.trim_end() == HEADER);
        for (line, at) in text.lines().zip(1..) {
            if in_header {
                in_header = at == 1 || line.trim_end() != HEADER;
                read.head.push_str(line);
                read.head.push('\n');
                continue;
            }
            let fail = |message: String, help: &str| InputError::new(format!("{name}:{at}"), message).help(help);
            let said = line.split('#').next().unwrap_or("").trim();
            if let Some(name) = said.strip_prefix("track ") {
                who = Some(track(line).ok_or_else(|| {
                    fail(format!("there is no track `{}`", name.trim()), "tracks are left, right and both")
                })?);
                continue;
            }
            let Some(who) = who else {
                read.head.push_str(line);
                read.head.push('\n');
                if !said.is_empty() {
                    read.setting(said).map_err(|message| {
                        fail(message, "settings are log, binding, scene, rules, hand, set and tolerance; then comes `track right`")
                    })?;
                }
                continue;
            };
            if !said.is_empty() {
                let line = expected(said, who, at).ok_or_else(|| {
                    fail(
                        format!("expected a segment, found `{said}`"),
                        "such as `Grasp 3.31 .. 4.27` or `task push 0 .. 9.5`",
                    )
                })?;
                if line.end_s < line.start_s {
                    return Err(fail(
                        format!("`{said}` ends before it begins"),
                        "times are s in the recording, the start first",
                    ));
                }
                read.lines.push(line);
            }
        }
        if read.log.is_empty() {
            return Err(InputError::new(name, "names no log").help("begin it with `log: FILE`"));
        }
        Ok(read)
    }

    /// The text of the file.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Checks that the rules have what is expected; `name` is what the file is called in errors.
    ///
    /// # Errors
    /// At the first line that names something else.
    pub fn check(&self, rules: &Rules, name: &str) -> Result<(), InputError> {
        let known = KnownNames::new(rules);
        for line in &self.lines {
            let (names, what) = if line.is_task { (&known.tasks, "task") } else { (&known.primitives, "primitive") };
            if line.name != super::UNKNOWN && !names.contains(&line.name) {
                let message = format!("the rules have no {what} `{}`", line.name);
                return Err(known.advise(InputError::new(format!("{name}:{}", line.line), message), &line.name));
            }
        }
        Ok(())
    }

    fn setting(&mut self, said: &str) -> Result<(), String> {
        let (key, value) = said.split_once(':').ok_or_else(|| format!("expected a setting, found `{said}`"))?;
        let value = value.trim().to_string();
        match key.trim() {
            "log" => self.log = value,
            "binding" => self.binding = Some(value),
            "scene" => self.scene = Some(value),
            "rules" => self.rules.push(value),
            "hand" => self.hand = Some(value),
            "set" => {
                let (param, value) = value.split_once('=').ok_or("expected `set: NAME = VALUE`")?;
                self.set.push((param.trim().to_string(), value.trim().to_string()));
            }
            "tolerance" => {
                self.tolerance_s =
                    tolerance(&value).ok_or_else(|| format!("`{value}` is not a tolerance such as `20 ms`"))?
            }
            other => return Err(format!("there is no setting `{other}`")),
        }
        Ok(())
    }
}

/// The track that a line begins.
fn track(line: &str) -> Option<TrackId> {
    TrackId::from_name(line.split('#').next().unwrap_or("").trim().strip_prefix("track ")?.trim())
}

fn tolerance(text: &str) -> Option<f64> {
    let unit = text.find(|c: char| c.is_ascii_alphabetic())?;
    let (number, unit) = text.split_at_checked(unit)?;
    let (in_si, dimension) = units::compound(unit).ok()?;
    let seconds = number.trim().parse::<f64>().ok()? * in_si;
    (dimension == Dimension::TIME && seconds >= 0.0 && seconds.is_finite()).then_some(seconds)
}

fn expected(said: &str, who: TrackId, line: usize) -> Option<Line> {
    let (is_task, rest) = match said.strip_prefix("task ") {
        Some(rest) => (true, rest.trim()),
        None => (false, said),
    };
    let (rest, pinned) = match rest.strip_suffix("pinned").filter(|rest| rest.ends_with(char::is_whitespace)) {
        Some(rest) => (rest, true),
        None => (rest, false),
    };
    let (name, times) = rest.split_once(char::is_whitespace)?;
    let (start, end) = times.split_once("..")?;
    let (start_s, end_s): (f64, f64) = (start.trim().parse().ok()?, end.trim().parse().ok()?);
    (start_s.is_finite() && end_s.is_finite()).then(|| Line {
        who,
        is_task,
        name: name.to_string(),
        start_s,
        end_s,
        pinned,
        line,
    })
}

/// Returns an analysis as lines of an expectation: for each track its segments, then its tasks. Empty tracks are omitted.
pub fn lines(analysis: &Analysis) -> Vec<Line> {
    let mut lines = Vec::new();
    for track in &analysis.tracks {
        let line = |is_task, name: &str, start_s, end_s| Line {
            who: track.who,
            is_task,
            name: name.to_string(),
            start_s,
            end_s,
            pinned: false,
            line: 0,
        };
        lines.extend(track.relabeled.iter().map(|found| line(false, &found.primitive, found.start_s, found.end_s)));
        lines.extend(track.tasks.iter().map(|found| line(true, &found.task, found.start_s, found.end_s)));
    }
    lines
}

/// The file with the results that differ, as `cargo insta review --extensions expect` reads it from `NAME.expect.new`: with a header that names
/// the log.
pub fn pending(expectation: &Expectation, found: &[Line]) -> String {
    let text = expectation.updated(found, true);
    if text.starts_with(HEADER) {
        return text;
    }
    let log = serde_json::Value::from(expectation.log.as_str());
    format!("{HEADER}\nsource: {log}\n{HEADER}\n{text}")
}

/// Returns the differences between the analysis and the expectation, each with its line of the file.
pub fn compare(expected: &[Line], found: &[Line], tolerance_s: f64) -> Vec<(usize, String)> {
    let mut differences = Vec::new();
    let mut kinds: Vec<(TrackId, bool)> = expected.iter().chain(found).map(|line| (line.who, line.is_task)).collect();
    kinds.sort_unstable();
    kinds.dedup();
    for kind in kinds {
        let of = |line: &&Line| (line.who, line.is_task) == kind;
        let (expected, found): (Vec<&Line>, Vec<&Line>) =
            (expected.iter().filter(of).collect(), found.iter().filter(of).collect());
        differences.extend(compare_one(&expected, &found, tolerance_s));
    }
    differences.sort_by_key(|(line, _)| *line);
    differences
}

/// Compares the segments, or the tasks, of one track: aligned by name, then held against each other at their boundaries.
fn compare_one(expected: &[&Line], found: &[&Line], tolerance_s: f64) -> Vec<(usize, String)> {
    let mut differences = Vec::new();
    let mut line = expected.first().map_or(0, |line| line.line);
    for (wanted, got) in aligned(expected, found) {
        let (wanted, got) = (wanted.and_then(|at| expected.get(at)), got.and_then(|at| found.get(at)));
        line = wanted.map_or(line, |wanted| wanted.line);
        match (wanted, got) {
            (Some(wanted), Some(got)) => {
                for (word, wanted_s, got_s) in
                    [("begins", wanted.start_s, got.start_s), ("ends", wanted.end_s, got.end_s)]
                {
                    let late = got_s - wanted_s;
                    if beyond(late, tolerance_s) {
                        let (off, early_or_late) = (late.abs() * 1e3, if late > 0.0 { "late" } else { "early" });
                        let message = format!(
                            "{} {word} at {got_s:.3} s, expected {wanted_s:.3} s: {off:.0} ms {early_or_late}, tolerance {:.0} ms",
                            named(wanted),
                            tolerance_s * 1e3
                        );
                        differences.push((line, message));
                    }
                }
            }
            (Some(wanted), None) => {
                let message =
                    format!("{} from {:.3} to {:.3} s is missing", named(wanted), wanted.start_s, wanted.end_s);
                differences.push((line, message));
            }
            (None, Some(got)) => {
                let message = format!("{} from {:.3} to {:.3} s was not expected", named(got), got.start_s, got.end_s);
                differences.push((line, message));
            }
            (None, None) => {}
        }
    }
    differences
}

/// Whether a boundary moved too far; what is written has three decimals.
fn beyond(late_s: f64, tolerance_s: f64) -> bool {
    late_s.abs() > tolerance_s + 5e-4
}

/// Whether a line says what was found.
fn is_met(wanted: &Line, got: &Line, tolerance_s: f64) -> bool {
    !beyond(got.start_s - wanted.start_s, tolerance_s) && !beyond(got.end_s - wanted.end_s, tolerance_s)
}

/// The lines of one track by their places, those of the same name side by side, as many as there can be in their order.
fn aligned(expected: &[&Line], found: &[&Line]) -> Vec<(Option<usize>, Option<usize>)> {
    // common[at][other]: how many names the rests have in common, in order.
    let mut common = vec![vec![0_usize; found.len() + 1]; expected.len() + 1];
    for at in (0..expected.len()).rev() {
        for other in (0..found.len()).rev() {
            common[at][other] = if expected[at].name == found[other].name {
                1 + common[at + 1][other + 1]
            } else {
                common[at + 1][other].max(common[at][other + 1])
            };
        }
    }
    let mut pairs = Vec::new();
    let (mut at, mut other) = (0, 0);
    loop {
        match (expected.get(at), found.get(other)) {
            (Some(wanted), Some(got)) if wanted.name == got.name => {
                pairs.push((Some(at), Some(other)));
                at += 1;
                other += 1;
            }
            (Some(_), got) if got.is_none() || common[at + 1][other] >= common[at][other + 1] => {
                pairs.push((Some(at), None));
                at += 1;
            }
            (_, Some(_)) => {
                pairs.push((None, Some(other)));
                other += 1;
            }
            (_, None) => return pairs,
        }
    }
}

fn named(line: &Line) -> String {
    let kind = if line.is_task { "task " } else { "" };
    format!("{}: {kind}{}", line.who, line.name)
}
