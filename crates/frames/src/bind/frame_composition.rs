//! Poses that stand in different frames: transforms of the log are composed, so that all poses count in one frame.

use super::BindingFile;
use super::frame_tree::{FrameTree, FramedPose, Transform};
use super::header::{BoundColumn, Header};
use crate::clean::preprocess::over_all;
use nalgebra::{Isometry3, Point3, UnitQuaternion};
use std::collections::BTreeSet;
use teachtree_base::error::InputError;
use teachtree_base::geometry::{pose, unit};
use teachtree_base::recording::Recording;
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::read::table::{ColumnRequest, Source};

/// A transform is interpolated, or held at the ends, over this many of its usual steps, and at least over `bridge`.
const STEPS: f64 = 3.0;
/// A transform whose numbers differ by less never changes.
const CONSTANT: f64 = 1e-12;

/// Which transforms are composed for which poses.
#[derive(Default)]
pub struct FrameComposition {
    poses: Vec<ComposedPose>,
    /// What is reported of the frames.
    report: Option<String>,
}

struct ComposedPose {
    channel: String,
    is_position: bool,
    /// The columns of the transforms, from the frame of the pose up: x y z w x y z.
    chain: Vec<[usize; 7]>,
}

impl FrameComposition {
    /// Finds the frames of the bound poses. `wants` gets the columns of the transforms.
    ///
    /// # Errors
    /// The binding names a frame on which a pose does not hang; a pose that has to be composed and is bound with signs or changes its frame.
    pub fn of(
        source: &Source,
        header: &Header,
        file: &BindingFile,
        bound: &[BoundColumn],
        wants: &mut [ColumnRequest],
    ) -> Result<Self, InputError> {
        let tree = FrameTree::of(source, header);
        let poses = tree.poses(bound, header);
        let wanted = file.binding.frame.as_deref().map(|frame| frame.trim_start_matches('/'));
        let frames: BTreeSet<&str> = poses.iter().flat_map(|pose| &pose.frames).map(String::as_str).collect();
        let to = match wanted {
            Some(_) if tree.is_empty() => {
                return Err(file.error("frame", "the log has no transforms between frames".into()));
            }
            Some(frame) => frame,
            None if frames.len() < 2 => return Ok(Self::default()),
            None => match tree.common(&frames) {
                Some(frame) => frame,
                None => return Ok(Self { poses: vec![], report: Some(not_connected(&poses)) }),
            },
        };
        let mut composed = vec![];
        for pose in &poses {
            let wrong = |message: String| file.error("channels", format!("`{}`: {message}", pose.channel));
            if let [one, other] = pose.frames.as_slice() {
                return Err(wrong(format!(
                    "its frame changes from `{one}` to `{other}`, expected one frame all along"
                )));
            }
            let from = pose.frames.first().map_or("", String::as_str);
            let Some(chain) = tree.chain(from, to).map_err(wrong)? else {
                let message = format!(
                    "`{}` stands in the frame `{from}`, which no transform of the log connects with `{to}`",
                    pose.channel
                );
                return Err(file.error("frame", message));
            };
            if !chain.is_empty() && !pose.is_plain {
                let message = format!(
                    "it stands in the frame `{from}` and has to be composed, expected its columns without signs"
                );
                return Err(wrong(message));
            }
            let columns = |transform: &&Transform| {
                let ([x, y, z], [w, i, j, k]) = (transform.position, transform.rotation);
                [x, y, z, w, i, j, k]
            };
            let chain: Vec<[usize; 7]> = chain.iter().map(columns).collect();
            for column in chain.iter().flatten() {
                wants.get_mut(*column).into_iter().for_each(|want| *want = ColumnRequest::Number(1.0));
            }
            composed.push(ComposedPose { channel: pose.channel.clone(), is_position: pose.is_position, chain });
        }
        let names: Vec<String> =
            frames.iter().filter(|frame| **frame != to).map(|frame| format!("`{frame}`")).collect();
        let report = wanted.is_none().then(|| {
            format!("the poses stand in different frames; those in {} are composed with the transforms of the log, and all count in `{to}`", names.join(" and "))
        });
        Ok(Self { poses: composed, report })
    }

    /// Moves the poses into one frame. `numbers` are the columns of the log.
    pub fn compose(&self, recording: &mut Recording, numbers: &[Vec<f64>], bridge_s: f64) -> Option<Issue> {
        for pose in self.poses.iter().filter(|pose| !pose.chain.is_empty()) {
            let chain: Vec<SampledTransform> = pose
                .chain
                .iter()
                .map(|columns| SampledTransform::new(&recording.time, numbers, columns, bridge_s))
                .collect();
            let letters: &[&str] = if pose.is_position { &["x", "y", "z"] } else { &["w", "x", "y", "z"] };
            let names: Vec<String> = letters.iter().map(|letter| format!("{}.{letter}", pose.channel)).collect();
            for row in 0..recording.time.len() {
                let value =
                    |name: &String| recording.columns.get(name).and_then(|column| column.values.get(row)).copied();
                let values: Vec<f64> = names.iter().map(|name| value(name).unwrap_or(f64::NAN)).collect();
                let stamp = recording.time.get(row).copied().unwrap_or_default();
                let moved = moved(&values, &chain, stamp);
                for (name, value) in names.iter().zip(moved) {
                    let slot = recording.columns.get_mut(name).and_then(|column| column.values.get_mut(row));
                    slot.into_iter().for_each(|slot| *slot = value);
                }
            }
        }
        let report = self.report.clone()?;
        Some(over_all(&recording.time, IssueKind::DIFFERENT_FRAMES, "", report))
    }
}

/// The message about frames that no transform connects.
fn not_connected(poses: &[FramedPose]) -> String {
    let frames: Vec<String> = poses
        .iter()
        .filter_map(|pose| Some(format!("`{}` stands in `{}`", pose.channel, pose.frames.first()?)))
        .collect();
    format!(
        "{}, and no transform of the log connects these frames: the poses are used as if the frames were one",
        frames.join(", ")
    )
}

/// A position or a quaternion w x y z, moved up a chain of transforms; not measured where one of them is not.
fn moved(values: &[f64], chain: &[SampledTransform], stamp: f64) -> Vec<f64> {
    let lost = vec![f64::NAN; values.len()];
    if values.iter().any(|value| value.is_nan()) {
        return lost;
    }
    let up = chain.iter().try_fold(Isometry3::identity(), |below, transform| Some(transform.at(stamp)? * below));
    match (up, values) {
        (Some(up), [x, y, z]) => (up * Point3::new(*x, *y, *z)).iter().copied().collect(),
        (Some(up), [w, x, y, z]) => {
            let turned: UnitQuaternion<f64> = up.rotation * unit([*w, *x, *y, *z]);
            vec![turned.w, turned.i, turned.j, turned.k]
        }
        _ => lost,
    }
}

/// The samples of a transform: stamps, s, and poses.
struct SampledTransform {
    samples: Vec<(f64, Isometry3<f64>)>,
    is_constant: bool,
    /// Over how long it is interpolated or held, s.
    reach_s: f64,
}

impl SampledTransform {
    fn new(time: &[f64], numbers: &[Vec<f64>], columns: &[usize; 7], bridge_s: f64) -> Self {
        let value = |row: usize, column: &usize| {
            numbers.get(*column).and_then(|values| values.get(row)).copied().unwrap_or(f64::NAN)
        };
        let mut samples = vec![];
        let mut first: Option<[f64; 7]> = None;
        let mut is_constant = true;
        for (row, stamp) in time.iter().enumerate() {
            let parts = columns.each_ref().map(|column| value(row, column));
            if parts.iter().all(|part| part.is_finite()) {
                let of_first = *first.get_or_insert(parts);
                is_constant &= parts.iter().zip(of_first).all(|(part, first)| (part - first).abs() < CONSTANT);
                let [x, y, z, w, i, j, k] = parts;
                samples.push((*stamp, pose([x, y, z], [w, i, j, k])));
            }
        }
        let mut steps: Vec<f64> = samples
            .windows(2)
            .map(|pair| pair.last().map_or(0.0, |last| last.0) - pair.first().map_or(0.0, |first| first.0))
            .collect();
        steps.sort_by(f64::total_cmp);
        let usual_s = steps.get(steps.len() / 2).copied().unwrap_or_default();
        Self { samples, is_constant, reach_s: f64::max(bridge_s, STEPS * usual_s) }
    }

    /// The pose of the child in the parent at a time, s; `None` where it is too far from the samples.
    fn at(&self, stamp: f64) -> Option<Isometry3<f64>> {
        if self.is_constant {
            return self.samples.first().map(|(_, pose)| *pose);
        }
        let after = self.samples.partition_point(|(time, _)| *time < stamp);
        let (before, after) =
            (after.checked_sub(1).and_then(|before| self.samples.get(before)), self.samples.get(after));
        match (before, after) {
            (_, Some((to, pose))) if *to == stamp => Some(*pose),
            (Some((from, first)), Some((to, last))) if to - from <= self.reach_s => {
                let share = (stamp - from) / (to - from);
                first.try_lerp_slerp(last, share, 1e-9).or(Some(*first))
            }
            (Some((held, pose)), None) | (None, Some((held, pose))) if (stamp - held).abs() <= self.reach_s => {
                Some(*pose)
            }
            _ => None,
        }
    }
}
