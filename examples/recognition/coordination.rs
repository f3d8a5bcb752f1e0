//! The coordination of two hands that was found, against the true one.

use teachtree::analysis::score::{NameMap, Share, TrackTruth, Truth};
use teachtree::analysis::{Analysis, Who};
use teachtree::base::hands::Side;
use teachtree::base::recording::Recording;

/// A named stretch of time, s.
type Named = (String, f64, f64);

/// What is counted of the coordination in a recording.
pub struct Coordination {
    /// There is none, and that is true.
    pub none: Option<bool>,
    /// The primitives of both hands, one after the other, are the true ones.
    pub same: bool,
    /// Hand-overs that are found, with who gives and who takes.
    pub passes: Share,
    /// Hand-overs that are none.
    pub false_passes: usize,
    /// How far the ends of hand-overs are off, s.
    pub off_s: Vec<f64>,
}

impl Coordination {
    /// Nothing when the recording has one hand.
    pub fn new(recording: &Recording, analysis: &Analysis) -> Option<Self> {
        let truth = Truth::of_recording(recording, &NameMap::default())?;
        let of_truth = |who: Who| truth.tracks.iter().find(|track| track.who == who).map(spans);
        let of_analysis = |who: Who| {
            let segments = &analysis.track(who)?.relabelled;
            Some(segments.iter().map(|it| (it.primitive.clone(), it.start_s, it.end_s)).collect::<Vec<Named>>())
        };
        let (_, found) = (analysis.track(Who::Hand(Side::Left))?, of_analysis(Who::Both).unwrap_or_default());
        let wanted: Vec<Named> =
            of_truth(Who::Both).unwrap_or_default().into_iter().filter(|(name, ..)| name != "separate").collect();
        let names = |list: &[Named]| list.iter().map(|(name, ..)| name.clone()).collect::<Vec<_>>();
        let passes = |list: &[Named]| list.iter().filter(|(name, ..)| name == "Pass").cloned().collect::<Vec<_>>();
        let mut coordination = Self {
            none: wanted.is_empty().then_some(found.is_empty()),
            same: names(&wanted) == names(&found),
            passes: Share::default(),
            false_passes: 0,
            off_s: vec![],
        };
        let found_passes = passes(&found);
        let overlaps = |one: &Named, other: &Named| one.1 < other.2 && other.1 < one.2;
        for pass in passes(&wanted) {
            let partner = found_passes.iter().find(|found| overlaps(found, &pass));
            let giver = |end_s: f64, of: &dyn Fn(Who) -> Option<Vec<Named>>| {
                Side::BOTH.into_iter().filter(|side| releases(of(Who::Hand(*side)), end_s)).collect::<Vec<_>>()
            };
            let right = partner.is_some_and(|found| giver(found.2, &of_analysis) == giver(pass.2, &of_truth));
            coordination.passes.count(right);
            coordination
                .off_s
                .extend(partner.iter().flat_map(|found| [(found.1 - pass.1).abs(), (found.2 - pass.2).abs()]));
        }
        let wanted_passes = passes(&wanted);
        let falsely = |found: &&Named| !wanted_passes.iter().any(|pass| overlaps(pass, found));
        coordination.false_passes = found_passes.iter().filter(falsely).count();
        Some(coordination)
    }
}

fn spans(track: &TrackTruth) -> Vec<Named> {
    track.primitives.iter().map(|span| (span.name().to_string(), span.start_s, span.end_s)).collect()
}

/// Whether a hand lets go at this time: its Release begins there, give or take a tenth of a second.
fn releases(list: Option<Vec<Named>>, at_s: f64) -> bool {
    list.iter().flatten().any(|(name, start_s, _)| name == "Release" && (start_s - at_s).abs() < 0.1)
}
