//! Tare: what a fingertip's force sensor reads while the fingertip is far from every object is its bias, and how much that scatters is its noise.
//! Where no distance is known, or the readings are not steady, both come from the readings alone: for rules that compare fingertip forces with thresholds of
//! their own, from the [group without contact](crate::clean::fingertip_level), else from the [level](crate::clean::contact_level) of contact.

use super::motion::{Motion, vector};
use super::pose_noise;
use crate::clean::contact_kinds::learned;
use crate::clean::contact_level::{LearnedLevel, vector_as_list};
use crate::clean::fingertip_level::{self, FingertipLevel, Reading};
use crate::clean::preprocess::{CleanLog, Noise, PositionNoise};
use indexmap::IndexMap;
use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};
use teachtree_base::channels::{ChannelSpec, Fallback};
use teachtree_base::geometry::surface_distance;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::scene::{Role, Scene};
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::names;

/// The channel of the force from which fingers are in contact.
const LEVEL: &str = "fingers.level";
/// A fingertip this far from every object feels nothing, m.
const FAR: f64 = 0.030;
/// Number of samples that are evaluated, and minimum number of them far from objects.
const LOOKED_AT: usize = 2000;
const FAR_ENOUGH: usize = 20;
/// A bias counts when it is this many standard errors of its mean, and no sensor is off by more than this, N.
const SIGNIFICANT: f64 = 6.0;
const LARGEST: f64 = 0.5;
/// The least bias of a fingertip that is reported, N: the force at which contact ends by default.
const REPORTED: f64 = teachtree_base::contact_threshold::OFF_N;
/// The least bias that is reported where no channel gives the position of the fingertip, N.
const BIASED: f64 = 0.05;
/// What scatters by more than this times its scatter from sample to sample, and by more than this, N², is not noise: the hand does touch
/// something, and the places in the log are not what they seem.
const STEADY: f64 = 4.0;
const QUIET: f64 = 1e-6;

/// The evaluated frames, each with the next frame.
pub fn samples(frames: usize) -> impl Iterator<Item = [usize; 2]> {
    let stride = frames.div_ceil(LOOKED_AT).max(1);
    (0..frames).step_by(stride).map(move |frame| [frame, (frame + 1).min(frames - 1)])
}

/// Whether the bias of sensors is estimated from this column: where the fingertips and the objects are, and what the fingertips feel.
pub fn asks(scene: &Scene, column: &str) -> bool {
    let Some(meaning) = names::meaning(column) else { return false };
    let Some((owner, quantity)) = meaning.channel.rsplit_once('.') else { return false };
    match quantity {
        "force" | "position" if owner.split_once('.').is_some_and(|(side, _)| Side::from_name(side).is_some()) => true,
        "position" | "rotation" => scene.bodies.get(owner).is_some_and(|body| body.role == Role::Object),
        _ => false,
    }
}

/// The learned data of the fingertips' force sensors, by channel, and of the positions of objects.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensors {
    /// The readings far from all objects.
    rests: IndexMap<String, SensorBias>,
    /// The contact levels after subtraction of the bias.
    levels: IndexMap<String, LearnedLevel>,
    /// The results from readings alone.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    fingertips: IndexMap<String, FingertipLevel>,
    /// The noise of positions, by object.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    positions: IndexMap<String, PositionNoise>,
}

/// The method for sensors of fingertips whose bias no distance determines.
#[derive(Clone, Copy, Debug)]
pub struct Fingertips {
    /// Whether readings without contact are a group. Rules that read `fingers.level` have fingers that bear a tool or an object, with a level of two groups.
    pub are_free: bool,
    /// Whether the bias may change in the log.
    pub may_drift: bool,
    /// The least force in contact where rules that read `fingers.level` do not learn it, N; `None` where they read no level.
    pub least: Option<f64>,
}

impl Fingertips {
    /// For rules with these channels, of a whole log.
    pub fn of(channels: &[ChannelSpec]) -> Self {
        let level = channels.iter().find(|channel| channel.name == LEVEL);
        let least = level.and_then(|channel| match channel.absent {
            Fallback::Constant(least) => Some(least),
            _ => None,
        });
        Self { are_free: level.is_none(), may_drift: true, least }
    }
}

/// Returns bias and contact level of the force sensors of the fingertips, from samples.
pub fn sensors(measured: &CleanLog, samples: &[[usize; 2]], fingertips: Fingertips) -> Sensors {
    let objects: Vec<(usize, Motion)> = objects(measured);
    let mut sensors = Sensors::default();
    for side in Side::BOTH {
        for finger in Finger::ALL.map(|finger| format!("{side}.{finger}")) {
            let channel = format!("{finger}.force");
            let Some(force) = measured.vec3(&channel) else { continue };
            let mut rest = rest(measured, samples, &objects, &finger);
            let bias = rest.filter(SensorBias::is_biased).map_or(Vector3::zeros(), |rest| rest.bias);
            let readings = |frames: &[[usize; 2]]| -> Vec<Vector3<f64>> {
                frames.iter().map(|[frame, _]| vector(&force, *frame) - bias).collect()
            };
            let handled: Vec<&(usize, Motion)> =
                objects.iter().filter(|(body, _)| !is_fixed(measured, *body, side)).collect();
            // A sensor at the wrist feels what the tool touches, wherever the palm is.
            let is_tip = !handled.is_empty() && !finger.ends_with(Finger::Palm.name());
            let tip = measured.vec3(&format!("{finger}.position")).filter(|_| is_tip);
            let far = tip.map(|tip| far(measured, samples, &handled, &tip));
            let level = learned(&readings(samples), far.as_deref().map(readings).as_deref(), fingertips.least);
            let is_free = fingertips.are_free && !finger.ends_with(Finger::Palm.name());
            let readings = fingertip_readings(measured, samples, &force, far.as_deref().unwrap_or_default());
            let drifts = fingertips.may_drift && fingertip_level::drifts(&readings);
            let is_unknown = rest.is_none() && (far.is_none() || matches!(level, LearnedLevel::Mixed { .. }));
            if is_free && (drifts || is_unknown) {
                let level = fingertip_level::learned(&readings, fingertips.may_drift);
                rest = rest.filter(|_| matches!(level, FingertipLevel::Unclear(_)));
                sensors.fingertips.insert(channel.clone(), level);
            }
            sensors.levels.insert(channel.clone(), level);
            sensors.rests.extend(rest.map(|rest| (channel, rest)));
        }
    }
    sensors
}

/// The readings of a fingertip; `far` are those far from every object.
fn fingertip_readings(
    measured: &CleanLog,
    samples: &[[usize; 2]],
    force: &[&[f64]; 3],
    far: &[[usize; 2]],
) -> Vec<Reading> {
    let mut far = far.iter().peekable();
    let reading = |[frame, next]: &[usize; 2]| Reading {
        time_s: measured.time.get(*frame).copied().unwrap_or_default(),
        force: vector(force, *frame),
        next: vector(force, *next),
        is_far: far.next_if(|[far, _]| far == frame).is_some(),
    };
    samples.iter().map(reading).collect()
}

/// Subtracts the bias of each fingertip's force sensor, and stores its noise and its contact level; returns an issue for each bias that was subtracted.
pub fn tare(measured: &mut CleanLog, fingertips: Fingertips) -> Vec<Issue> {
    let found = of_whole(measured, fingertips);
    correct(measured, &found)
}

/// Learns from the sensors of a whole log.
pub fn of_whole(measured: &CleanLog, fingertips: Fingertips) -> Sensors {
    let sensors = sensors(measured, &samples(measured.len()).collect::<Vec<_>>(), fingertips);
    Sensors { positions: pose_noise::of_objects(measured).collect(), ..sensors }
}

/// Like the above, with the learned data of the sensors.
pub fn correct(measured: &mut CleanLog, found: &Sensors) -> Vec<Issue> {
    let mut issues = Vec::new();
    for (body, noise) in &found.positions {
        measured.positions.insert(body.clone(), *noise);
        if noise.limit == 0.0 {
            continue;
        }
        let message = format!(
            "its samples scatter by {:.1} mm; motion slower than {:.0} mm/s is treated as noise",
            noise.deviation * 1e3,
            noise.limit * 1e3
        );
        issues.push(measured.over_all(IssueKind::NOISY_POSITION, &format!("{body}.position"), message));
    }
    for (channel, rest) in &found.rests {
        measured.noise.insert(channel.clone(), Noise { variance: rest.variance });
        if rest.is_biased() {
            measured.subtract(channel, rest.bias.into());
            let message = format!(
                "reads {:.3} N while the fingertip is far from every object; this is taken as its bias and subtracted",
                rest.bias.norm()
            );
            issues.push(measured.over_all(IssueKind::BIASED, channel, message));
        }
    }
    for (channel, fingertip) in &found.fingertips {
        measured.fingertips.insert(channel.clone(), fingertip.clone());
        let FingertipLevel::Level(level) = fingertip else { continue };
        measured.subtract_rest(channel, level);
        let largest = level.rest.iter().map(|rest| rest.force.norm()).fold(0.0, f64::max);
        if largest > REPORTED {
            let drifts = match level.drift() {
                0.0 => String::new(),
                drift => format!(", and drifts by {drift:.3} N"),
            };
            let message = format!(
                "reads {largest:.3} N without contact{drifts}; this is taken as its bias and subtracted; contact is above {:.3} N",
                level.begins
            );
            issues.push(measured.over_all(IssueKind::BIASED, channel, message));
        }
    }
    let levels = found
        .levels
        .iter()
        .filter(|(channel, _)| !matches!(found.fingertips.get(*channel), Some(FingertipLevel::Level(_))));
    for (channel, learned) in levels {
        measured.levels.insert(channel.clone(), *learned);
        let LearnedLevel::Level(level) = learned else { continue };
        if found.rests.contains_key(channel) || level.rest == Vector3::zeros() {
            continue;
        }
        measured.subtract(channel, level.rest.into());
        if level.rest.norm() > level.scatter.max(BIASED) {
            let message = format!(
                "reads {:.3} N without contact; this is taken as its bias and subtracted; contact is above {:.3} N",
                level.rest.norm(),
                level.begins
            );
            issues.push(measured.over_all(IssueKind::BIASED, channel, message));
        }
    }
    issues
}

/// The reading of a sensor at rest.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorBias {
    /// N.
    #[serde(with = "vector_as_list")]
    bias: Vector3<f64>,
    /// The variance, summed over the vector's components, N².
    variance: f64,
    samples: usize,
}

impl SensorBias {
    /// Whether the bias is more than what chance gives.
    fn is_biased(&self) -> bool {
        self.bias.norm_squared() > SIGNIFICANT * SIGNIFICANT * self.variance / self.samples as f64
    }
}

/// Whether a hand holds a body all the time.
fn is_fixed(measured: &CleanLog, body: usize, side: Side) -> bool {
    measured.scene.bodies.get_index(body).is_some_and(|(_, body)| body.fixed_to == Some(side))
}

/// The objects of a scene, which is what fingertips touch.
fn objects<'a>(measured: &'a CleanLog) -> Vec<(usize, Motion<'a>)> {
    let bodies = measured.scene.bodies.iter().enumerate().filter(|(_, (_, body))| body.role == Role::Object);
    bodies.map(|(index, (name, body))| (index, Motion::of_poses(measured, name, body))).collect()
}

/// Returns the reading of a finger's sensor far from all objects; `None` if its position is unknown, or it is never far.
fn rest(measured: &CleanLog, samples: &[[usize; 2]], objects: &[(usize, Motion)], finger: &str) -> Option<SensorBias> {
    let force = measured.vec3(&format!("{finger}.force"))?;
    let tip = measured.vec3(&format!("{finger}.position"))?;
    let frames = far(measured, samples, &objects.iter().collect::<Vec<_>>(), &tip);
    if frames.len() < FAR_ENOUGH {
        return None;
    }
    let count = frames.len() as f64;
    let mean = |value: &dyn Fn([usize; 2]) -> f64| frames.iter().map(|frames| value(*frames)).sum::<f64>() / count;
    let bias = frames.iter().map(|[frame, _]| vector(&force, *frame)).sum::<Vector3<f64>>() / count;
    let variance = mean(&|[frame, _]| (vector(&force, frame) - bias).norm_squared());
    let next = |[frame, next]: [usize; 2]| (vector(&force, next) - vector(&force, frame)).norm_squared();
    let steady = variance <= QUIET.max(STEADY * mean(&next) / 2.0);
    (steady && bias.norm() <= LARGEST).then_some(SensorBias { bias, variance, samples: frames.len() })
}

/// The samples in which a fingertip is far from every object.
fn far(
    measured: &CleanLog,
    samples: &[[usize; 2]],
    objects: &[&(usize, Motion)],
    tip: &[&[f64]; 3],
) -> Vec<[usize; 2]> {
    let is_far =
        |frame: usize| {
            let tip: Point3<f64> = vector(tip, frame).into();
            objects.iter().all(|(index, motion)| {
                measured.scene.bodies.get_index(*index).is_none_or(|(_, body)| {
                    surface_distance(body, &motion.pose(frame).inverse_transform_point(&tip)) > FAR
                })
            })
        };
    samples.iter().copied().filter(|[frame, _]| is_far(*frame)).collect()
}
