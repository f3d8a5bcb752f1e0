//! Simple peers: what one threshold reaches, measured in the same run.

use teachtree_analysis::{Analysis, Segment, Track, TrackId};
use teachtree_base::meaning::Primitives;
use teachtree_base::recording::Recording;

/// Contact is above this share of the 90th percentile of the force.
const SHARE: f64 = 0.35;
/// The first contact of the snap assembly, N.
pub const SNAP_N: f64 = 3.0;

fn norms(recording: &Recording, channel: &str) -> Vec<f64> {
    let column =
        |axis: &str| recording.columns.get(&format!("{channel}.{axis}")).map_or(&[][..], |column| &column.values);
    let [x, y, z] = ["x", "y", "z"].map(column);
    x.iter().zip(y).zip(z).map(|((x, y), z)| (x * x + y * y + z * z).sqrt()).collect()
}

/// Contact by a share of the force that occurs.
pub fn share_of_force(
    recording: &Recording,
    channel: &str,
    who: TrackId,
    contact: &'static str,
    apart: &'static str,
) -> Analysis {
    let norms = norms(recording, channel);
    let mut sorted = norms.clone();
    sorted.sort_by(f64::total_cmp);
    let most = teachtree_analysis::score::statistics::quantile(&sorted, 0.9).unwrap_or_default();
    let (start_s, end_s) =
        (recording.time.first().copied().unwrap_or(0.0), recording.time.last().copied().unwrap_or(0.0));
    let rate_hz = (norms.len().max(2) - 1) as f64 / (end_s - start_s).max(1e-9);
    labeled(who, norms.len(), rate_hz, start_s, |row| {
        if norms.get(row).is_some_and(|norm| *norm > SHARE * most) { contact } else { apart }
    })
}

/// When a force is above a threshold for the first time, s.
pub fn first_above(recording: &Recording, channel: &str, least: f64) -> Option<f64> {
    let row = norms(recording, channel).into_iter().position(|norm| norm > least)?;
    recording.time.get(row).copied()
}

/// A result of one track, by a name for each frame.
pub fn labeled(
    who: TrackId,
    frames: usize,
    rate_hz: f64,
    start_s: f64,
    name: impl Fn(usize) -> &'static str,
) -> Analysis {
    let at_s = |frame: usize| start_s + frame as f64 / rate_hz;
    let mut segments: Vec<Segment> = Vec::new();
    for frame in 0..frames {
        match segments.last_mut().filter(|last| last.primitive == name(frame)) {
            Some(last) => (last.frames.end, last.end_s) = (frame + 1, at_s(frame + 1)),
            None => segments.push(Segment {
                primitive: name(frame).into(),
                frames: frame..frame + 1,
                start_s: at_s(frame),
                end_s: at_s(frame + 1),
                ..Segment::default()
            }),
        }
    }
    let relabeled = segments.clone();
    let track = Track { who, segments, relabeled, tasks: Vec::new(), composites: Vec::new() };
    Analysis {
        frames,
        rows: frames,
        rate_hz,
        start_s,
        end_s: at_s(frames),
        stretches: vec![(start_s, at_s(frames))],
        tracks: vec![track],
        issues: Vec::new(),
        primitives: Primitives::default(),
        ..Analysis::default()
    }
}
