//! Labeled intervals as the result of an analysis, so that all methods are scored alike.

use teachtree_analysis::{Analysis, Segment, TrackId};

/// A stretch of time to which a method gives a label of the set.
#[derive(Clone, Debug, PartialEq)]
pub struct LabeledInterval {
    pub who: TrackId,
    pub label: String,
    pub start_s: f64,
    pub end_s: f64,
}

/// The same recording with the segments of a method; `primitive` is what a label stands for.
pub fn in_place_of<'a>(
    shipped: &Analysis,
    intervals: &'a [LabeledInterval],
    primitive: impl Fn(&'a str) -> &'a str,
) -> Analysis {
    let mut result = shipped.clone();
    let frame =
        |at_s: f64| (((at_s - shipped.start_s) * shipped.rate_hz).round().max(0.0) as usize).min(shipped.frames);
    for track in &mut result.tracks {
        let own = intervals.iter().filter(|it| it.who == track.who);
        track.relabeled = own
            .map(|it| Segment {
                primitive: primitive(&it.label).into(),
                frames: frame(it.start_s)..frame(it.end_s),
                start_s: it.start_s,
                end_s: it.end_s,
                ..Segment::default()
            })
            .collect();
        track.segments.clone_from(&track.relabeled);
        track.tasks.clear();
        track.composites.clear();
    }
    result
}
