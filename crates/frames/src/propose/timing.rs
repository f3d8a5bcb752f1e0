//! The stamps of a log, and whether it is resampled.

use super::parts::Part;
use super::yaml_scalar::scalar;
use super::{Answers, Question, Survey};
use crate::inspect::{Inspection, SheetReport};

/// The least rate at which short durations of the rules are a sample, Hz.
const SLOW_HZ: f64 = 19.0;
/// Largest multiple of the rate of the slowest poses to which parts are resampled: at higher ones, noise of a tracker becomes velocity.
const POSES: f64 = 4.0;
/// Why slow logs are resampled.
const TOO_SLOW: &str = "durations of the rules are shorter than its steps";

/// The lines of a binding about time.
pub struct Timing {
    /// The lines.
    pub lines: Vec<String>,
    /// What is to be asked.
    pub question: Option<Question>,
}

/// The stamps of the sheets that are used.
pub fn timing(log: &Inspection, survey: &Survey, answers: &Answers) -> Timing {
    let used: Vec<&SheetReport> = log.sheets.iter().filter(|sheet| is_used(sheet, survey)).collect();
    let used = if used.is_empty() { log.sheets.iter().collect() } else { used };
    let (mut lines, mut question) = (vec![], None);
    let in_ms = used.iter().find_map(|sheet| milliseconds(sheet));
    let unit_s = if in_ms.is_some() { 1e-3 } else { 1.0 };
    match used.iter().find_map(|sheet| sheet.time.as_deref()) {
        _ if in_ms.is_some() => lines.extend(in_ms),
        Some("time" | "time [s]") => {}
        Some(time) => lines.push(format!("time: {}", scalar(time))),
        None if even_stamps(&used).is_some() => {
            let time = even_stamps(&used).unwrap_or_default();
            lines.push(format!("time: {}    # it increases evenly; in s", scalar(time)));
        }
        None => {
            let (rate, reason) = usual_rate(log);
            if answers.rate_hz.is_none() {
                question = Some(Question::Rate(rate));
            }
            let (rate, reason) = answers.rate_hz.map_or((rate, reason), |rate| (rate, "as it was answered"));
            lines.push(format!("rate: {rate} Hz    # the rows have no stamps; {reason}"));
            if rate >= SLOW_HZ && used.len() > 1 {
                lines.push(format!("resample: {rate} Hz    # its parts have rows of their own"));
            }
            if rate < SLOW_HZ {
                let bridge_ms = (2e3 / rate).ceil();
                lines.push(format!("resample: 50 Hz    # {TOO_SLOW}\nbridge: {bridge_ms} ms"));
            }
        }
    }
    lines.extend(resampling(&used, survey, unit_s));
    Timing { lines, question }
}

/// The line for stamps without a unit that are integers at least 1 apart: rows are milliseconds apart, not seconds.
fn milliseconds(sheet: &SheetReport) -> Option<String> {
    let time = sheet.time.as_deref()?;
    let step = 1.0 / sheet.rate_hz;
    let is_whole = [step, sheet.start_s, sheet.duration_s]
        .iter()
        .all(|count| count.is_finite() && (count - count.round()).abs() < 1e-6);
    let is_fast = !time.contains('[') && (1.0..=1e3 / SLOW_HZ).contains(&step);
    (is_whole && is_fast).then(|| {
        let name = scalar(&format!("{time} [ms]"));
        format!("time: {name}    # whole numbers without a unit, {step:.0} apart; if they are in s, delete `[ms]`")
    })
}

/// The column of a single sheet without stamps whose values increase by even steps of less than a second, and are not row numbers.
fn even_stamps<'a>(used: &[&'a SheetReport]) -> Option<&'a str> {
    let [sheet] = used else { return None };
    let is_stamp = |column: &&crate::inspect::ColumnReport| {
        let steps: Vec<f64> = column.samples.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let least = steps.iter().copied().fold(f64::INFINITY, f64::min);
        let mean = (column.max - column.min) / (sheet.rows.max(2) - 1) as f64;
        let is_even = least > 0.0 && steps.iter().all(|step| *step < 2.0 * least);
        column.unit.is_empty() && steps.len() >= 20 && is_even && (1e-4..1.0).contains(&mean)
    };
    let mut stamps = sheet.columns.iter().filter(is_stamp);
    let found = stamps.next()?;
    stamps.next().is_none().then_some(found.name.as_str())
}

/// The rate of logs without stamps by the names of their columns, and the reason.
fn usual_rate(log: &Inspection) -> (f64, &'static str) {
    let has = |part: &str| log.sheets.iter().flat_map(|sheet| &sheet.columns).any(|column| column.name.contains(part));
    match () {
        () if has("demo_start_pose") && has("eef_rot_axis_angle") => (59.94, "59.94 Hz is that of the camera of UMI"),
        () if has("observations/qpos") => (50.0, "50 Hz is that of ALOHA"),
        () if has("obs/") => (20.0, "20 Hz is that of robomimic, MimicGen and LIBERO"),
        () if has("actions") => (20.0, "20 Hz is usual in demonstrations with `actions`, and a guess"),
        () if log.log.contains(".zarr") => (10.0, "10 Hz is that of Diffusion Policy"),
        () => (100.0, "nothing in the log shows it, and 100 Hz is a guess"),
    }
}

fn is_used(sheet: &SheetReport, survey: &Survey) -> bool {
    let is_it = |other: &SheetReport| std::ptr::eq(sheet, other);
    let of_hands = survey.hands.values().flat_map(|hand| hand.tool.iter().chain(hand.tips.values()).chain(&hand.force));
    let of_bodies = survey.bodies.iter().flat_map(|body| &body.positions);
    let of_grippers = survey.grippers.values().any(|gripper| gripper.sheet == sheet.name);
    let of_arms = survey.arms.iter().any(|arm| arm.sheet == sheet.name);
    of_arms || of_grippers || of_hands.chain(of_bodies).any(|part| is_it(part.sheet))
}

/// The least rate at which the positions of bodies were logged, Hz; infinite without any.
fn slowest_pose(survey: &Survey) -> f64 {
    let sheets = survey.bodies.iter().flat_map(|body| &body.positions).map(|part| part.sheet);
    sheets.map(|sheet| sheet.rate_hz).filter(|rate| *rate > 0.0).fold(f64::INFINITY, f64::min)
}

/// Lines that bring sheets of their own stamps, uneven or slow stamps to an even rate; `unit_s` is the unit of the stamps, s.
fn resampling(used: &[&SheetReport], survey: &Survey, unit_s: f64) -> Vec<String> {
    let parts = survey.hands.values().flat_map(|hand| hand.tool.iter().chain(hand.tips.values()));
    let parts: Vec<&Part> = parts.chain(survey.bodies.iter().flat_map(|body| &body.positions)).collect();
    let missing = parts.iter().map(|part| part.missing()).fold(0.0, f64::max);
    let stamped: Vec<&&SheetReport> =
        used.iter().filter(|sheet| sheet.rate_hz > 0.0 && sheet.duration_s > 0.0).collect();
    let fastest = stamped.iter().map(|sheet| sheet.rate_hz / unit_s).fold(0.0, f64::max);
    if fastest <= 0.0 {
        return vec![];
    }
    let slowest =
        stamped.iter().map(|sheet| sheet.rows as f64 / (sheet.duration_s * unit_s)).fold(f64::INFINITY, f64::min);
    let longest = stamped.iter().map(|sheet| sheet.longest_step_s * unit_s).fold(0.0, f64::max);
    // Rows of several topics in one table have the values of one of them each.
    let is_sparse = missing > 0.3;
    let (rate, why) = match () {
        () if fastest < SLOW_HZ => (50.0, TOO_SLOW),
        () if used.len() > 1 => {
            (fastest.min(POSES * slowest_pose(survey) / unit_s), "its parts have stamps of their own")
        }
        () if is_sparse => (100.0, "its rows have some of the values each"),
        () if stamped.iter().any(|sheet| sheet.uneven > 0.01) => (fastest, "its steps are uneven"),
        () if missing > 0.0 => (fastest, "values are missing"),
        () => return vec![],
    };
    let mut lines = vec![format!("resample: {} Hz    # {why}", rate.round().clamp(1.0, 10_000.0))];
    let least = [longest * 1.1, 2.0 / slowest.max(0.1), if missing > 0.0 && !is_sparse { 1.0 } else { 0.0 }];
    let bridge = least.into_iter().fold(0.0, f64::max);
    if bridge > 0.1 {
        let bridge_ms = (bridge.min(2.0) * 10.0).ceil() * 100.0;
        let gaps: Option<Vec<f64>> = parts.iter().map(|part| longest_gap_s(part)).collect();
        let longest_gap = gaps.map_or_else(String::new, |gaps| {
            let gap_ms = (gaps.into_iter().fold(longest / unit_s, f64::max) * unit_s * 1e3).round();
            format!("; the longest one in this log is about {gap_ms} ms")
        });
        lines.push(format!("bridge: {bridge_ms} ms    # gaps up to this are filled{longest_gap}"));
    }
    lines
}

/// The longest time between two positions of a part, in the unit of the stamps; `None` where not all rows are known.
fn longest_gap_s(part: &Part) -> Option<f64> {
    let rows = part.sheet.rows;
    // The origin is the position of a lost body, as for `missing`.
    let is_known = |row: &usize| part.position(*row).is_some_and(|at| part.is_constant() || at != [0.0; 3]);
    let known: Vec<usize> = (0..rows).filter(is_known).collect();
    let steps = known.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or_default();
    (part.rows() == rows).then(|| steps as f64 * part.sheet.duration_s / rows.saturating_sub(1).max(1) as f64)
}
