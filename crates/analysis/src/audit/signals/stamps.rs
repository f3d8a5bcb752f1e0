//! Stamps that are equal, go back or are uneven, and frames that are missing between them.

use super::{EpisodeDeclaration, Finding, FindingKind, frames_are, short, stamps_of};
use std::collections::BTreeMap;
use teachtree_frames::raw_log::RawTable;

/// A step this many times the usual one is a gap, unless the next steps make up for it.
const GAP_STEPS: f64 = 1.5;
/// Number of next steps that may compensate for a long one.
const CATCH_UP: usize = 4;
/// Minimum number of steps that determine a rate.
const FEWEST_STEPS: usize = 10;
/// A sender is periodic if this share of its steps is within half of the usual one.
const PERIODIC: f64 = 0.8;
const NEAR: f64 = 0.5;
/// How far steps may be from the usual one, as a share of it, and the share of steps that may be farther: of rows, and of messages, which are stamped when
/// they are sent.
const EVEN_ROWS: (f64, f64) = (0.1, 0.01);
const EVEN_MESSAGES: (f64, f64) = (NEAR, 0.1);

/// The faults of the stamps of a table.
pub(super) fn findings(table: &RawTable, declared: &EpisodeDeclaration) -> Vec<Finding> {
    let mut senders: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for (row, stamp) in table.stamps_s.iter().enumerate() {
        senders.entry(table.writers.get(row).copied().unwrap_or(0)).or_default().push(*stamp);
    }
    let mut findings = Vec::new();
    for stamps in senders.values() {
        findings.extend(order(table, stamps));
        findings.extend(steps(table, stamps, declared));
    }
    if !table.is_topic {
        findings.extend(numbers(table));
        findings.extend(length(table, declared));
    }
    findings
}

/// Equal stamps, and stamps that go back.
fn order(table: &RawTable, stamps: &[f64]) -> Vec<Finding> {
    let column = || stamps_of(table);
    let pairs = || stamps.iter().zip(stamps.iter().skip(1));
    let mut findings = Vec::new();
    let back = pairs().filter(|(from, to)| to < from).collect::<Vec<_>>();
    if let Some((from, to)) = back.iter().max_by(|(a, b), (c, d)| (*a - *b).total_cmp(&(*c - *d))) {
        let message = format!(
            "{} earlier than the one before, the farthest goes back from {} s to {} s",
            if back.len() == 1 { "1 stamp is".into() } else { format!("{} stamps are", back.len()) },
            short(**from),
            short(**to)
        );
        findings.push(Finding::of_column(
            FindingKind::StampsBack,
            column(),
            Some([**to, **from]),
            **from - **to,
            message,
        ));
    }
    let equal: Vec<f64> = pairs().filter(|(from, to)| from == to).map(|(_, to)| *to).collect();
    if let (Some(first), Some(last)) = (equal.first(), equal.last()) {
        let rows = if table.is_topic { "message" } else { "row" };
        let message = format!(
            "{} the stamp of the {rows} before, first at {} s",
            if equal.len() == 1 { format!("1 {rows} has") } else { format!("{} {rows}s have", equal.len()) },
            short(*first)
        );
        findings.push(Finding::of_column(
            FindingKind::EqualStamps,
            column(),
            Some([*first, *last]),
            equal.len() as f64,
            message,
        ));
    }
    findings
}

/// A gap: the stamps before and after it, and the number of frames that are missing in it.
type Gap = ([f64; 2], u64);

/// Missing frames, uneven steps, and a rate that is not the one that the data set says.
fn steps(table: &RawTable, stamps: &[f64], declared: &EpisodeDeclaration) -> Vec<Finding> {
    let steps: Vec<f64> = stamps.iter().zip(stamps.iter().skip(1)).map(|(from, to)| to - from).collect();
    let mut rising: Vec<f64> = steps.iter().copied().filter(|step| *step > 0.0).collect();
    if rising.len() < FEWEST_STEPS {
        return Vec::new();
    }
    rising.sort_by(f64::total_cmp);
    let usual = rising.get(rising.len() / 2).copied().unwrap_or(f64::INFINITY);
    let near = rising.iter().filter(|step| (**step / usual - 1.0).abs() <= NEAR).count();
    let is_periodic = near as f64 >= PERIODIC * rising.len() as f64;
    if table.is_topic && !is_periodic {
        return Vec::new();
    }
    let gaps = if is_periodic { gaps(stamps, &steps, usual) } else { Vec::new() };
    let mut findings = Vec::new();
    findings.extend(missing(table, &gaps, usual));
    let (within, share) = if table.is_topic { EVEN_MESSAGES } else { EVEN_ROWS };
    // A gap is reported as such, not as an uneven step.
    let odd = rising.iter().filter(|step| (**step / usual - 1.0).abs() > within).count().saturating_sub(gaps.len());
    let part = odd as f64 / rising.len() as f64;
    if part > share {
        let message = format!(
            "{:.0} % of the steps differ from the usual {} s by more than {:.0} %",
            part * 100.0,
            short(usual),
            within * 100.0
        );
        findings.push(Finding::of_column(FindingKind::UnevenStamps, stamps_of(table), None, part, message));
    }
    if let Some(fps) = declared.fps.filter(|fps| !table.is_topic && (usual * fps - 1.0).abs() > EVEN_ROWS.0) {
        let message = format!(
            "the usual step is {} s, and `fps` of meta/info.json is {}, which is a step of {} s",
            short(usual),
            short(fps),
            short(1.0 / fps)
        );
        findings.push(Finding::of_column(FindingKind::UnevenStamps, stamps_of(table), None, 1.0 / usual, message));
    }
    findings
}

/// The gaps between stamps with this usual step. A late frame followed by earlier ones, or a step after an early frame, is not a gap.
fn gaps(stamps: &[f64], steps: &[f64], usual: f64) -> Vec<Gap> {
    let is_long = |step: &f64| *step > GAP_STEPS * usual;
    let mut gaps = Vec::new();
    for (at, step) in steps.iter().enumerate().filter(|(_, step)| is_long(step)) {
        let next = steps.iter().skip(at + 1).take(CATCH_UP).take_while(|step| **step > 0.0 && !is_long(step));
        let before = at.checked_sub(1).and_then(|before| steps.get(before)).filter(|step| **step >= 0.0);
        let early = before.map_or(0.0, |before| (before - usual).min(0.0));
        let late: f64 = step - usual + early + next.map(|step| step - usual).sum::<f64>().min(0.0);
        let missing = (late / usual).round();
        if let (true, Some(from), Some(to)) = (missing >= 1.0, stamps.get(at), stamps.get(at + 1)) {
            gaps.push(([*from, *to], missing as u64));
        }
    }
    gaps
}

fn missing(table: &RawTable, gaps: &[Gap], usual: f64) -> Option<Finding> {
    let (longest, _) = gaps.iter().max_by_key(|(_, missing)| *missing)?;
    let count: u64 = gaps.iter().map(|(_, missing)| missing).sum();
    let [from, to] = *longest;
    let message = match gaps.len() {
        1 => format!(
            "{} missing: no stamp for {} s, the usual step is {} s",
            frames_are(count),
            short(to - from),
            short(usual)
        ),
        gaps => format!(
            "{} missing in {gaps} gaps, the longest of {} s; the usual step is {} s",
            frames_are(count),
            short(to - from),
            short(usual)
        ),
    };
    Some(Finding::of_column(FindingKind::MissingFrames, stamps_of(table), Some(*longest), count as f64, message))
}

/// Numbers of frames that are left out.
fn numbers(table: &RawTable) -> Option<Finding> {
    let (name, values) = table.columns.iter().find(|(name, _)| name == "frame_index")?;
    let pairs = values.iter().zip(values.iter().skip(1)).enumerate();
    let jumps: Vec<(usize, f64, f64)> =
        pairs.filter(|(_, (from, to))| *to - *from > 1.5).map(|(at, (from, to))| (at, *from, *to)).collect();
    let (at, from, to) = jumps.first()?;
    let count: f64 = jumps.iter().map(|(_, from, to)| (to - from - 1.0).max(0.0)).sum();
    let span_s =
        table.stamps_s.get(*at).zip(table.stamps_s.get(at + 1)).map(|(from, to)| [from.min(*to), from.max(*to)]);
    let message = format!(
        "{} missing by their sequence numbers, which go from {from} to {to}{}",
        frames_are(count as u64),
        if jumps.len() == 1 { String::new() } else { format!(", and skip in {} places", jumps.len()) }
    );
    Some(Finding::of_column(FindingKind::MissingFrames, table.title(name), span_s, count, message))
}

/// Fewer or more rows than the data set says.
fn length(table: &RawTable, declared: &EpisodeDeclaration) -> Option<Finding> {
    let (said, found) = (declared.frames?, table.stamps_s.len());
    let message = format!("the list of episodes says {said} frames, and the data file has {found}");
    let off = said.abs_diff(found);
    (off > 0).then(|| Finding::of_column(FindingKind::MissingFrames, stamps_of(table), None, off as f64, message))
}
