//! The relabeled truth: primitives in, the same after the settling, recognition and relabeling of the rules out.
//!
//! A true sequence may hold what relabeling joins on purpose (a slide before the grasp, a push within a trace). Where relabeled results are to
//! be compared with such a truth, both need the same form: the result of the rules if every leaf were right.

use super::truth::{Span, TrackTruth, Truth};
use crate::{TrackId, analyze};
use std::collections::BTreeMap;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_engine::runs::{Leaves, Run};
use teachtree_frames::frames::Frames;
use teachtree_language::rules::{Label, PrimitiveId, Rules};

impl Truth {
    /// The truth with the primitives of the hands relabeled; tasks and both hands stay as they are.
    ///
    /// # Errors
    /// A name that the rules do not have, or alternatives: neither can be relabeled.
    pub fn relabeled(&self, rules: &Rules, frames: &Frames) -> Result<Self, InputError> {
        let analysis = analyze(rules, frames, &leaves(self, rules, frames)?);
        let tracks = self.tracks.iter().map(|truth| match (truth.who, analysis.track(truth.who)) {
            (TrackId::Hand(_), track) => {
                let segments = track.map_or(&[][..], |track| &track.relabeled);
                TrackTruth { primitives: segments.iter().map(span).collect(), ..truth.clone() }
            }
            (TrackId::Both, _) => truth.clone(),
        });
        Ok(Self { tracks: tracks.collect() })
    }
}

/// The leaves that the trees of the hands would have returned. Rules over both hands need both tracks.
fn leaves(truth: &Truth, rules: &Rules, frames: &Frames) -> Result<Vec<Leaves>, InputError> {
    let labels = labels(rules);
    let frame = |time_s: f64| frames.time.partition_point(|time| *time < time_s);
    let mut leaves: Vec<Leaves> = Vec::new();
    for stretch in &frames.stretches {
        let mut hands: BTreeMap<Side, Vec<Run>> = BTreeMap::new();
        for track in &truth.tracks {
            let TrackId::Hand(side) = track.who else { continue };
            let runs = hands.entry(side).or_default();
            let mut next = stretch.start;
            for span in &track.primitives {
                let label = match span.names.as_slice() {
                    [name] => labels.get(name).copied(),
                    _ => None,
                };
                let label = label.ok_or_else(|| {
                    let message =
                        format!("`{}` is not a primitive of the rules, so the truth cannot be relabeled", span.name());
                    InputError::new("the truth", message).help("leave out --relabel-truth")
                })?;
                // A span over a gap is two.
                let (start, end) = (frame(span.start_s).max(stretch.start), frame(span.end_s).min(stretch.end));
                if start < end {
                    if next < start {
                        runs.push(Run { start: next, end: start, label: None });
                    }
                    runs.push(Run { start, end, label: Some(label) });
                    next = end;
                }
            }
        }
        leaves.push(Leaves { frames: stretch.clone(), hands, ..Leaves::default() });
    }
    Ok(leaves)
}

fn span(segment: &crate::Segment) -> Span {
    Span { names: vec![segment.primitive.clone()], start_s: segment.start_s, end_s: segment.end_s }
}

/// The labels by the names with which they are shown.
fn labels(rules: &Rules) -> BTreeMap<String, Label> {
    let sides = |sided: bool| if sided { Side::BOTH.map(Some).to_vec() } else { vec![None] };
    let labels = (0..)
        .map(PrimitiveId)
        .zip(&rules.primitives)
        .flat_map(|(primitive, declared)| sides(declared.sided).into_iter().map(move |side| Label { primitive, side }));
    labels.map(|label| (rules.label_name(label), label)).collect()
}
