//! Poses in different frames: transforms of the log are composed, so that all poses are expressed in one frame.

use super::BindingFile;
use super::frame_tree::{FrameTree, FramedPose, Transform};
use super::sampled_transform::SampledTransform;
use crate::clean::preprocess::over_all;
use indexmap::IndexSet;
use nalgebra::{Isometry3, Point3, UnitQuaternion};
use std::collections::BTreeSet;
use teachtree_base::error::InputError;
use teachtree_base::geometry::unit;
use teachtree_base::recording::Recording;
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::read::table::ColumnRequest;

/// Which transforms are composed for which poses.
#[derive(Default)]
pub struct FrameComposition {
    poses: Vec<ComposedPose>,
    /// The columns of the transforms: x y z w x y z.
    transforms: IndexSet<[usize; 7]>,
    /// The issues of the frames.
    pub report: Option<String>,
    /// Whether the poses are in frames that no transform connects.
    pub is_unconnected: bool,
}

struct ComposedPose {
    channel: String,
    is_position: bool,
    /// The transforms from the frame of the pose up.
    chain: Vec<usize>,
}

impl FrameComposition {
    /// The transforms of the bound poses, which `tree` has found. `wants` gets the columns of the transforms.
    ///
    /// # Errors
    /// The binding names a frame on which a pose does not hang; a pose that has to be composed and is bound with signs or changes its frame.
    pub fn of(
        tree: &FrameTree,
        poses: &[FramedPose],
        file: &BindingFile,
        wants: &mut [ColumnRequest],
    ) -> Result<Self, InputError> {
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
                None => {
                    let report = Some(not_connected(poses));
                    return Ok(Self { report, is_unconnected: true, ..Self::default() });
                }
            },
        };
        let (mut composed, mut transforms) = (vec![], IndexSet::new());
        for pose in poses {
            let wrong = |message: String| file.error("channels", format!("`{}`: {message}", pose.channel));
            if let [one, other] = pose.frames.as_slice() {
                return Err(wrong(format!(
                    "its frame changes from `{one}` to `{other}`, expected the same frame in all messages"
                )));
            }
            let from = pose.frames.first().map_or("", String::as_str);
            let Some(chain) = tree.chain(from, to).map_err(wrong)? else {
                let message = format!(
                    "`{}` is in the frame `{from}`, which no transform of the log connects with `{to}`",
                    pose.channel
                );
                return Err(file.error("frame", message));
            };
            if !chain.is_empty() && !pose.is_plain {
                let message = format!(
                    "it is in the frame `{from}` and is composed with transforms, expected its columns without signs"
                );
                return Err(wrong(message));
            }
            let columns = |transform: &&Transform| {
                let ([x, y, z], [w, i, j, k]) = (transform.position, transform.rotation);
                [x, y, z, w, i, j, k]
            };
            let chain = chain.iter().map(columns).map(|columns| transforms.insert_full(columns).0).collect();
            composed.push(ComposedPose { channel: pose.channel.clone(), is_position: pose.is_position, chain });
        }
        for column in transforms.iter().flatten() {
            wants.get_mut(*column).into_iter().for_each(|want| *want = ColumnRequest::Number(1.0));
        }
        let names: Vec<String> =
            frames.iter().filter(|frame| **frame != to).map(|frame| format!("`{frame}`")).collect();
        let report = wanted.is_none().then(|| {
            format!("the poses are in different frames; those in {} are composed with the transforms of the log, and all are expressed in `{to}`", names.join(" and "))
        });
        Ok(Self { poses: composed, transforms, report, is_unconnected: false })
    }

    /// The columns of each transform that is composed: x y z w x y z.
    pub fn transforms(&self) -> impl Iterator<Item = &[usize; 7]> {
        self.transforms.iter()
    }

    /// The transforms of a whole log. `numbers` are its columns.
    pub fn sampled(&self, time: &[f64], numbers: &[Vec<f64>], bridge_s: f64) -> Vec<SampledTransform> {
        self.transforms().map(|columns| SampledTransform::of(time, numbers, columns, bridge_s)).collect()
    }

    /// Returns the issues of the frames over all these stamps.
    pub fn issue(&self, time: &[f64]) -> Option<Issue> {
        Some(over_all(time, IssueKind::DIFFERENT_FRAMES, "", self.report.clone()?))
    }

    /// Moves the poses into one frame by the transforms, which are in the order of [`transforms`](Self::transforms).
    pub fn compose(&self, recording: &mut Recording, transforms: &[SampledTransform]) {
        for pose in self.poses.iter().filter(|pose| !pose.chain.is_empty()) {
            let chain: Vec<&SampledTransform> = pose.chain.iter().filter_map(|at| transforms.get(*at)).collect();
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
fn moved(values: &[f64], chain: &[&SampledTransform], stamp: f64) -> Vec<f64> {
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
