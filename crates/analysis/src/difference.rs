//! The differences between two analyses of one recording with different rules or params.

use super::{Analysis, Segment, TrackId};
use std::collections::BTreeSet;
use std::ops::Range;

/// The placeholder for a time without a segment.
const NOTHING: &str = "nothing";

/// An interval in which a track has two labels.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Whose track it is.
    pub who: TrackId,
    /// The frames `[start, end)`.
    pub frames: Range<usize>,
    /// Start, s.
    pub start_s: f64,
    /// End, s.
    pub end_s: f64,
    /// The label of the first analysis.
    pub one: String,
    /// The label of the second one.
    pub other: String,
}

/// The amount of difference between two analyses of a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Extent {
    /// Frames on which a track has two labels.
    pub frames: usize,
    /// Of how many.
    pub of_frames: usize,
    /// Segments of the first analysis that the second one does not have with the same label and the same frames.
    pub segments: usize,
    /// Of how many.
    pub of_segments: usize,
}

/// The tracks that one of two analyses has, in order.
pub fn tracks(one: &Analysis, other: &Analysis) -> BTreeSet<TrackId> {
    one.tracks.iter().chain(&other.tracks).map(|track| track.who).collect()
}

/// The intervals in which the labels after relabeling differ, by track and time.
pub fn changes(one: &Analysis, other: &Analysis) -> Vec<Change> {
    tracks(one, other).into_iter().flat_map(|who| of_track(who, segments(one, who), segments(other, who))).collect()
}

/// Returns the amount of difference between the labels after relabeling; `changes` are those of [`changes`].
pub fn extent(one: &Analysis, other: &Analysis, changes: &[Change]) -> Extent {
    let mut spans: Vec<Range<usize>> = changes.iter().map(|change| change.frames.clone()).collect();
    spans.sort_by_key(|span| span.start);
    let (mut frames, mut until) = (0, 0);
    for span in spans {
        frames += span.end.saturating_sub(span.start.max(until));
        until = until.max(span.end);
    }
    let mut extent = Extent { frames, of_frames: one.frames, ..Extent::default() };
    for who in tracks(one, other) {
        let (ours, theirs) = (segments(one, who), segments(other, who));
        let known: BTreeSet<(usize, usize, &str)> = theirs.iter().map(key).collect();
        extent.of_segments += ours.len();
        extent.segments += ours.iter().filter(|segment| !known.contains(&key(segment))).count();
    }
    extent
}

fn key(segment: &Segment) -> (usize, usize, &str) {
    (segment.frames.start, segment.frames.end, &segment.primitive)
}

fn segments(analysis: &Analysis, who: TrackId) -> &[Segment] {
    analysis.track(who).map_or(&[], |track| &track.relabeled)
}

fn of_track(who: TrackId, one: &[Segment], other: &[Segment]) -> Vec<Change> {
    let mut cuts: Vec<(usize, f64)> = Vec::new();
    for segment in one.iter().chain(other) {
        cuts.extend([(segment.frames.start, segment.start_s), (segment.frames.end, segment.end_s)]);
    }
    cuts.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    cuts.dedup_by_key(|cut| cut.0);
    let label = |list: &[Segment], frame: usize| {
        let at = list.partition_point(|segment| segment.frames.end <= frame);
        let found = list.get(at).filter(|segment| segment.frames.contains(&frame));
        found.map_or(NOTHING.to_string(), |segment| segment.primitive.clone())
    };
    let mut changes: Vec<Change> = Vec::new();
    for pair in cuts.windows(2) {
        let [(start, start_s), (end, end_s)] = *pair else { continue };
        let (ours, theirs) = (label(one, start), label(other, start));
        if ours == theirs {
            continue;
        }
        match changes.last_mut() {
            Some(last) if last.frames.end == start && last.one == ours && last.other == theirs => {
                (last.frames.end, last.end_s) = (end, end_s);
            }
            _ => changes.push(Change { who, frames: start..end, start_s, end_s, one: ours, other: theirs }),
        }
    }
    changes
}
