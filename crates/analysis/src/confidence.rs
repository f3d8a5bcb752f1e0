//! The stability and the confidence of boundaries, and the stability of tasks, from variations: analyses of the same log by rules with other values, and of
//! varied logs by the same rules.
//!
//! The stability of a boundary is the share of the variations that have it at the same place, to [`SAME_S`]. Its confidence is the share of boundaries with
//! this stability that were right on public sets ([`calibrated`]). The stability of a task is the share of the variations that have it under the same name
//! over half of the time. A task has no confidence, since the public sets have no tasks.

use super::{Analysis, Segment, TaskSpan, TrackId};

/// Maximum distance between two boundaries that count as the same, s.
pub const SAME_S: f64 = 0.1;
/// … and another one when it is farther off than this, s.
const FAR_S: f64 = 1.0;
/// Minimum share of their time that two tasks have in common if they count as the same.
const SHARED: f64 = 0.5;

/// The steps of the calibration, by docs/measurements/confidence.md: from this stability on, this share of the boundaries is right. Both rise.
const CALIBRATION: [(f64, f64); 8] =
    [(0.0, 0.0), (0.5, 0.053), (0.65, 0.117), (0.722, 0.284), (0.8, 0.334), (0.888, 0.449), (0.9, 0.614), (1.0, 0.692)];

/// The share of right boundaries, 0 to 1, at a stability, 0 to 1.
pub fn calibrated(stability: f64) -> f64 {
    CALIBRATION.iter().take_while(|(least, _)| *least <= stability).last().map_or(0.0, |(_, share)| *share)
}

/// A confidence or a stability in percent. Variations cannot show that a result is certain, so that nothing above 99 % is printed as a number.
pub fn percent(share: f64) -> String {
    if share >= 0.995 { "> 99 %".into() } else { format!("{:.0} %", share * 100.0) }
}

/// The confidence of the start of a segment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Confidence {
    /// The share of boundaries with this stability that were right on public sets.
    pub share: f64,
    /// The share of the variations in which it is at the same place.
    pub stability: f64,
    /// The earliest time at which a variation has it, s.
    pub earliest_s: f64,
    /// The latest, s.
    pub latest_s: f64,
    /// The margin of the deciding quantity to its threshold, in standard deviations of its noise; `None` if the deciding quantity has no noise.
    pub margin: Option<f64>,
}

/// Gives the boundaries of an analysis their confidence, and the tasks their stability, from its variations.
pub fn compare(analysis: &mut Analysis, variations: &[Analysis]) {
    for track in &mut analysis.tracks {
        let others: Vec<(&[Segment], &[TaskSpan])> = variations
            .iter()
            .map(|other| other.track(track.who).map_or((&[][..], &[][..]), |it| (&it.relabeled[..], &it.tasks[..])))
            .collect();
        let starts: Vec<Confidence> = track
            .relabeled
            .iter()
            .map(|segment| boundary(segment, others.iter().map(|(segments, _)| *segments)))
            .collect();
        for (segment, start) in track.relabeled.iter_mut().zip(&starts) {
            segment.confidence = Some(*start);
        }
        for task in &mut track.tasks {
            let same = others.iter().filter(|(_, tasks)| tasks.iter().any(|other| is_same(task, other)));
            task.stability = Some(share(same.count(), others.len()));
        }
    }
}

/// Gives each boundary its margin, by track and frame.
pub fn with_margins<E>(
    analysis: &mut Analysis,
    mut margin: impl FnMut(TrackId, usize) -> Result<Option<f64>, E>,
) -> Result<(), E> {
    for track in &mut analysis.tracks {
        for segment in &mut track.relabeled {
            if let Some(confidence) = &mut segment.confidence {
                confidence.margin = margin(track.who, segment.frames.start)?;
            }
        }
        // The segments of tasks are those of the track, relabeled for the task.
        for segment in track.tasks.iter_mut().flat_map(|task| &mut task.segments) {
            let same = track.relabeled.iter().find(|other| other.frames.start == segment.frames.start);
            segment.confidence = same.and_then(|same| same.confidence);
        }
    }
    Ok(())
}

fn share(count: usize, of: usize) -> f64 {
    if of == 0 { 0.0 } else { count as f64 / of as f64 }
}

/// The start of a segment among those of the same primitive in other analyses.
fn boundary<'a>(segment: &Segment, others: impl Iterator<Item = &'a [Segment]>) -> Confidence {
    let at = segment.start_s;
    let (mut same, mut all) = (0, 0);
    let (mut earliest_s, mut latest_s) = (at, at);
    for segments in others {
        all += 1;
        let starts = segments.iter().filter(|other| other.primitive == segment.primitive).map(|other| other.start_s);
        let Some(start) = starts.min_by(|a, b| (a - at).abs().total_cmp(&(b - at).abs())) else { continue };
        if (start - at).abs() <= FAR_S {
            same += usize::from((start - at).abs() <= SAME_S);
            earliest_s = start.min(earliest_s);
            latest_s = start.max(latest_s);
        }
    }
    let stability = share(same, all);
    Confidence { share: calibrated(stability), stability, earliest_s, latest_s, margin: None }
}

fn is_same(task: &TaskSpan, other: &TaskSpan) -> bool {
    let shared = task.end_s.min(other.end_s) - task.start_s.max(other.start_s);
    let all = task.end_s.max(other.end_s) - task.start_s.min(other.start_s);
    task.task == other.task && shared >= SHARED * all
}
