//! The recognized coordination of two hands compared with the true one.

use teachtree_analysis::score::{NameMap, Share, TrackTruth, Truth};
use teachtree_analysis::{Analysis, TrackId};
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;

/// A named interval, s.
type NamedInterval = (String, f64, f64);

/// The counts of the coordination in a recording.
pub struct Coordination {
    /// For a recording without coordination: none is found.
    pub none: Option<bool>,
    /// The sequence of primitives of both hands is the true one.
    pub same: bool,
    /// Passes found with the correct giver and receiver.
    pub passes: Share,
    /// Passes found where there is none.
    pub false_passes: usize,
    /// Errors of the ends of Passes, s.
    pub off_s: Vec<f64>,
}

impl Coordination {
    /// Returns `None` for a recording of one hand.
    pub fn new(recording: &Recording, analysis: &Analysis) -> Option<Self> {
        let truth = Truth::of_recording(recording, &NameMap::default())?;
        let of_truth = |who: TrackId| truth.tracks.iter().find(|track| track.who == who).map(spans);
        let of_analysis = |who: TrackId| {
            let segments = &analysis.track(who)?.relabeled;
            Some(segments.iter().map(|it| (it.primitive.clone(), it.start_s, it.end_s)).collect::<Vec<NamedInterval>>())
        };
        let (_, found) = (analysis.track(TrackId::Hand(Side::Left))?, of_analysis(TrackId::Both).unwrap_or_default());
        let wanted: Vec<NamedInterval> =
            of_truth(TrackId::Both).unwrap_or_default().into_iter().filter(|(name, ..)| name != "separate").collect();
        let names = |list: &[NamedInterval]| list.iter().map(|(name, ..)| name.clone()).collect::<Vec<_>>();
        let passes =
            |list: &[NamedInterval]| list.iter().filter(|(name, ..)| name == "Pass").cloned().collect::<Vec<_>>();
        let mut coordination = Self {
            none: wanted.is_empty().then_some(found.is_empty()),
            same: names(&wanted) == names(&found),
            passes: Share::default(),
            false_passes: 0,
            off_s: vec![],
        };
        let found_passes = passes(&found);
        let overlaps = |one: &NamedInterval, other: &NamedInterval| one.1 < other.2 && other.1 < one.2;
        for pass in passes(&wanted) {
            let partner = found_passes.iter().find(|found| overlaps(found, &pass));
            let giver = |end_s: f64, of: &dyn Fn(TrackId) -> Option<Vec<NamedInterval>>| {
                Side::BOTH.into_iter().filter(|side| releases(of(TrackId::Hand(*side)), end_s)).collect::<Vec<_>>()
            };
            let right = partner.is_some_and(|found| giver(found.2, &of_analysis) == giver(pass.2, &of_truth));
            coordination.passes.count(right);
            coordination
                .off_s
                .extend(partner.iter().flat_map(|found| [(found.1 - pass.1).abs(), (found.2 - pass.2).abs()]));
        }
        let wanted_passes = passes(&wanted);
        let falsely = |found: &&NamedInterval| !wanted_passes.iter().any(|pass| overlaps(pass, found));
        coordination.false_passes = found_passes.iter().filter(falsely).count();
        Some(coordination)
    }
}

fn spans(track: &TrackTruth) -> Vec<NamedInterval> {
    track.primitives.iter().map(|span| (span.name().to_string(), span.start_s, span.end_s)).collect()
}

/// Whether a Release of the hand begins within 0.1 s of `at_s`.
fn releases(list: Option<Vec<NamedInterval>>, at_s: f64) -> bool {
    list.iter().flatten().any(|(name, start_s, _)| name == "Release" && (start_s - at_s).abs() < 0.1)
}
