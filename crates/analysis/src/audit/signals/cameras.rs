//! Frozen cameras, whose picture does not change during motion, and videos that end before their episode.

use super::rests::Motion;
use super::{EpisodeDeclaration, Finding, FindingKind, short};
use teachtree_frames::raw_log::{RawLog, RawTable};

/// The shortest time for which an unchanged picture is reported, s, and the fewest frames with it.
const LEAST_S: f64 = 1.0;
const LEAST_FRAMES: usize = 5;

/// The longest time for which each camera gives the same picture while things move.
pub(super) fn frozen(table: &RawTable, motion: Option<&Motion>) -> Vec<Finding> {
    let Some(motion) = motion else { return Vec::new() };
    table.pictures.iter().filter_map(|(camera, digests)| longest(table, camera, digests, motion)).collect()
}

fn longest(table: &RawTable, camera: &str, digests: &[u64], motion: &Motion) -> Option<Finding> {
    let shots: Vec<(u64, f64)> = digests.iter().copied().zip(table.stamps_s.iter().copied()).collect();
    let run = |run: &[(u64, f64)]| -> Option<([f64; 2], usize)> {
        let span = [run.first()?.1, run.last()?.1];
        let is_long = span[1] - span[0] >= LEAST_S && run.len() >= LEAST_FRAMES;
        (is_long && run.first()?.0 != 0 && motion.is_between(span)).then_some((span, run.len()))
    };
    let runs = shots.chunk_by(|(one, _), (next, _)| one == next).filter_map(run);
    let (span, frames) = runs.max_by(|(a, _), (b, _)| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))?;
    let length = span[1] - span[0];
    let message = format!("the picture stays the same for {} s ({frames} frames) while things move", short(length));
    let column = if camera.is_empty() { table.name.clone() } else { camera.to_string() };
    Some(Finding::of_column(FindingKind::FrozenCamera, column, Some(span), length, message))
}

/// Videos with fewer frames than the episode has rows.
pub(super) fn short_videos(log: &RawLog, declared: &EpisodeDeclaration) -> Vec<Finding> {
    let rows = log.tables.first().map_or(0, |table| table.stamps_s.len());
    let finding = |(camera, frames): &(String, u64)| {
        let missing = (rows as u64).checked_sub(*frames).filter(|missing| *missing > 0)?;
        let end_s = log.tables.first()?.stamps_s.get(usize::try_from(*frames).ok()?..)?;
        let message = format!("the video has {frames} frames, and the episode has {rows} rows");
        let span_s = end_s.first().zip(end_s.last()).map(|(from, to)| [*from, *to]);
        Some(Finding::of_column(FindingKind::MissingFrames, camera.clone(), span_s, missing as f64, message))
    };
    declared.videos.iter().filter_map(finding).collect()
}
