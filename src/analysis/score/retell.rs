//! The truth retold as relabelled results are: primitives in, the same after the settling, recognition and relabelling of the rules out.
//!
//! A true sequence may hold what relabelling joins on purpose (a slide before the grasp, a push within a trace). Where relabelled results are to
//! be compared with such a truth, both have to be told in the same way: what the rules would say if every leaf were right.

use super::truth::{Span, TrackTruth, Truth};
use crate::analysis::{Who, analyse};
use crate::base::error::InputError;
use crate::base::hands::Side;
use crate::engine::runs::{Leaves, Run};
use crate::language::rules::{Label, PrimitiveId, Rules};
use crate::stream::frames::Frames;
use std::collections::BTreeMap;

impl Truth {
    /// The truth with the primitives of the hands relabelled; tasks and both hands stay as they are.
    ///
    /// # Errors
    /// A name that the rules do not have, or alternatives: neither can be relabelled.
    pub fn retold(&self, rules: &Rules, frames: &Frames) -> Result<Self, InputError> {
        let tracks = self.tracks.iter().map(|truth| match truth.who {
            Who::Hand(_) => Ok(TrackTruth { primitives: retold(truth, rules, frames)?, ..truth.clone() }),
            Who::Both => Ok(truth.clone()),
        });
        Ok(Self { tracks: tracks.collect::<Result<_, InputError>>()? })
    }
}

fn retold(truth: &TrackTruth, rules: &Rules, frames: &Frames) -> Result<Vec<Span>, InputError> {
    let Who::Hand(side) = truth.who else { return Ok(truth.primitives.clone()) };
    let labels = labels(rules);
    let frame = |time_s: f64| frames.time.partition_point(|time| *time < time_s);
    let mut leaves: Vec<Leaves> = Vec::new();
    for span in &truth.primitives {
        let label = match span.names.as_slice() {
            [name] => labels.get(name).copied(),
            _ => None,
        };
        let label = label.ok_or_else(|| {
            let message = format!("`{}` is no primitive of the rules, so the truth cannot be relabelled", span.name());
            InputError::new("the truth", message).help("leave out --relabel-truth")
        })?;
        // A span over a gap is two.
        for stretch in &frames.stretches {
            let (start, end) = (frame(span.start_s).max(stretch.start), frame(span.end_s).min(stretch.end));
            if start >= end {
                continue;
            }
            let run = Run { start, end, label: Some(label) };
            match leaves.last_mut().filter(|last| last.frames.end == start && start > stretch.start) {
                Some(last) => {
                    last.frames.end = end;
                    last.hands.entry(side).or_default().push(run);
                }
                None => leaves.push(Leaves {
                    frames: start..end,
                    hands: BTreeMap::from([(side, vec![run])]),
                    ..Leaves::default()
                }),
            }
        }
    }
    let analysis = analyse(rules, frames, &leaves);
    let track = analysis.track(truth.who);
    let segments = track.map_or(&[][..], |track| &track.relabelled);
    let span = |segment: &crate::analysis::Segment| Span {
        names: vec![segment.primitive.clone()],
        start_s: segment.start_s,
        end_s: segment.end_s,
    };
    Ok(segments.iter().map(span).collect())
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
