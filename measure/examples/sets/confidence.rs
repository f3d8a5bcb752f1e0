//! The calibration of the confidence: the share of right boundaries by stability in each set, and whether a map that was learned on the other sets holds.

use super::manifest::Set;
use super::measured::{self, AnalyzedRecording};
use std::fmt::Write as _;
use std::path::Path;
use teachtree_analysis::score::TrackTruth;
use teachtree_measure::calibration::Calibration;
use teachtree_measure::confidence::{CLASSES, ConfidenceSample, right_of, table};
use teachtree_session::AnalysisInternals;

/// Maximum distance of a right boundary from the true one, s.
const RIGHT_S: f64 = 0.15;
/// The least confidence of the goal.
const SURE: f64 = 0.9;

/// The boundaries of the recordings of a set at which the label changes, each with its stability.
pub fn of_set(set: &Set, folder: &Path) -> Result<Vec<ConfidenceSample>, String> {
    let samples = measured::each(set, folder, |path, AnalyzedRecording { analysis, truth, .. }| {
        let analysis = analysis.with_confidence().map_err(|error| format!("{}: {error}", path.display()))?;
        Ok(truth.tracks.iter().flat_map(|track| of_track(track, analysis.found())).collect::<Vec<_>>())
    })?;
    samples.into_iter().collect::<Result<Vec<_>, String>>().map(|samples| samples.concat())
}

fn of_track(truth: &TrackTruth, found: &teachtree_analysis::Analysis) -> Vec<ConfidenceSample> {
    let Some(track) = found.track(truth.who) else { return Vec::new() };
    let named = |name: &str| truth.primitives.iter().any(|span| span.names.iter().any(|one| one == name));
    // The first true span whose label has the primitive stands for the label.
    let label = |primitive: &str| {
        let counted = found.primitives.counts_for(primitive, named);
        truth.primitives.iter().map(|span| &span.names).find(|names| names.iter().any(|name| name == counted))
    };
    let changes = track.relabeled.windows(2).filter_map(|pair| match pair {
        [before, after] if label(&before.primitive) != label(&after.primitive) => Some(after),
        _ => None,
    });
    let sample = |segment: &teachtree_analysis::Segment| {
        let names = label(&segment.primitive)?;
        let is_labeled = |at_s: f64| truth.primitives.iter().any(|span| span.start_s <= at_s && at_s < span.end_s);
        let mut starts = truth.primitives.iter().filter(|span| &span.names == names).map(|span| span.start_s);
        let right = starts.any(|start_s| (start_s - segment.start_s).abs() <= RIGHT_S);
        let share = segment.confidence?.stability;
        is_labeled(segment.start_s).then_some(ConfidenceSample { share, right })
    };
    changes.filter_map(sample).collect()
}

/// The tables: the shares of right boundaries by stability, the calibration of each set by the other sets, and the calibration by all sets.
pub fn tables(sets: &[(&Set, Vec<ConfidenceSample>)]) -> String {
    let rows: Vec<(&str, &[ConfidenceSample])> =
        sets.iter().map(|(set, samples)| (set.manifest.name.as_str(), &samples[..])).collect();
    let learned = |except: &str| {
        let kinds = sets.iter().filter(|(set, samples)| {
            set.manifest.name != except && set.manifest.label_error <= RIGHT_S && !samples.is_empty()
        });
        Calibration::of_kinds(kinds.map(|(_, samples)| &samples[..]))
    };
    let mut text = table("stability", "boundaries", &CLASSES, &rows);
    text.push_str(
        "\n| calibrated by the other sets | boundaries right | confidence, mean | confidence, largest | right, of 90 % and more |\n|---|---|---|---|---|\n",
    );
    for (name, samples) in &rows {
        let calibration = learned(name);
        let calibrated: Vec<ConfidenceSample> = samples
            .iter()
            .map(|sample| ConfidenceSample { share: calibration.share(sample.share), ..*sample })
            .collect();
        let mean = calibrated.iter().map(|it| it.share).sum::<f64>() / calibrated.len().max(1) as f64;
        let largest = calibrated.iter().map(|it| it.share).fold(0.0, f64::max);
        let sure = right_of(calibrated.iter().filter(|it| it.share >= SURE));
        let right = right_of(samples.iter());
        let _ = writeln!(text, "| {name} | {right} | {:.1} % | {:.1} % | {sure} |", 100.0 * mean, 100.0 * largest);
    }
    text.push_str("\n| stability, from | confidence |\n|---|---|\n");
    for (least, share) in learned("").steps() {
        let _ = writeln!(text, "| {:.1} % | {:.1} % |", 100.0 * least, 100.0 * share);
    }
    text
}
