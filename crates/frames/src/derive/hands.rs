//! A hand over the whole log: where its fingertips are, which of them touch, and which object is its target.
//!
//! The target is the object that the hand touches, else the one nearest to its fingertips; it changes only while the hand touches
//! nothing, where touching is the channel `fingers.contact` that the rules see (docs/sources.md, A11). Where no channel shows a touch, the hand holds the
//! object that [moves with it](super::carrying).

use super::carrying::Carrying;
use super::motion::{Displacement, Motion, vector};
use super::raw_channels::Array;
use crate::clean::preprocess::{CleanLog, State};
use nalgebra::{Point3, Vector3};
use std::ops::Range;
use teachtree_base::geometry::Solid;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::log_channel::{FingerPart, LogChannel};
use teachtree_base::scene::Body;
use teachtree_logs::names;

/// While nothing is touched, another object must be nearer than the target by this much to become the target, m: two objects at the
/// same distance would otherwise take turns.
const NEARER_BY: f64 = 0.010;
/// Distances that differ by less than this, m, are worked out anew.
const ROUNDED: f64 = 1e-6;

/// A hand over the whole log.
pub struct HandTrack {
    /// Which hand.
    pub side: Side,
    /// Whether the hand touches anything.
    pub touching: Vec<bool>,
    /// The body that is the target, as an index in the scene.
    pub target: Vec<Option<usize>>,
    /// Returns the targets as consecutive intervals of frames.
    pub runs: Vec<(Range<usize>, Option<usize>)>,
}

/// The fingers of a hand, in the order of `fingers`: from the scene, or those that the log measures where the scene has no such hand. A tool point has
/// the force sensor at its wrist, whether the scene names it or not.
pub fn fingers(measured: &CleanLog, side: Side) -> Vec<Finger> {
    if let Some(hand) = measured.scene.hands.get(&side) {
        let is_sensed = hand.fingers == [Finger::Thumb]
            && measured.vec3(&format!("{side}.{}.force", Finger::Palm)).is_some()
            && measured.vec3(&format!("{side}.{}.force", Finger::Thumb)).is_none();
        return hand.fingers.iter().copied().chain(is_sensed.then_some(Finger::Palm)).collect();
    }
    let felt = |finger: Finger| finger_feels(measured, side, finger);
    let seen = |finger: Finger| finger != Finger::Palm && finger_has(measured, side, finger, "position");
    let fingers: Vec<Finger> = Finger::ALL.into_iter().filter(|finger| felt(*finger) || seen(*finger)).collect();
    // For a gripper with a known opening only, both jaws count.
    if fingers.is_empty() { vec![Finger::Thumb, Finger::Index] } else { fingers }
}

/// Whether the log has the force or a contact of a finger.
pub fn finger_feels(measured: &CleanLog, side: Side, finger: Finger) -> bool {
    ["force", "contact"].iter().any(|quantity| finger_has(measured, side, finger, quantity))
}

fn finger_has(measured: &CleanLog, side: Side, finger: Finger, quantity: &str) -> bool {
    let channel = format!("{side}.{finger}.{quantity}");
    let is_of = |name: &&str| name.strip_prefix(&channel).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
    measured.channels().iter().any(is_of)
}

/// Whether the distance of a hand from its target is known on all frames. An object that is fixed to the hand hides the distance, since it is always
/// the target. An object without a measured pose stays where the scene puts it, unless the hand may carry it off.
pub fn knows_distance(measured: &CleanLog, side: Side) -> bool {
    let tips = Finger::ALL.into_iter().filter(|finger| *finger != Finger::Palm);
    let mut placed = tips.filter(|finger| measured.vec3(&format!("{side}.{finger}.position")).is_some());
    let bodies = super::objects(measured.scene).into_iter().filter_map(|body| measured.scene.bodies.get_index(body));
    let objects: Vec<(&String, &Body)> = bodies.collect();
    let stays =
        |body: &Body| super::unplaced::is_placed(body) && body.fixed_to.is_none() && !knows_grasp(measured, side);
    let is_known = |(name, body): &(&String, &Body)| {
        body.fixed_to != Some(side) && (measured.vec3(&format!("{name}.position")).is_some() || stays(body))
    };
    placed.next().is_some() && !objects.is_empty() && objects.iter().all(is_known)
}

/// Whether the log shows when a hand holds something: it has the contact or the force of a fingertip, or the flag or the opening of a gripper.
pub fn knows_grasp(measured: &CleanLog, side: Side) -> bool {
    let channels = measured.columns.keys().filter_map(|column| LogChannel::parse(names::meaning(column)?.channel));
    channels.into_iter().any(|channel| match channel {
        LogChannel::GripperClosed(of) | LogChannel::GripperOpening(of) => of == side,
        LogChannel::Finger(of, finger, FingerPart::Force | FingerPart::Contact) | LogChannel::Touch(of, finger, _) => {
            of == side && finger != Finger::Palm
        }
        _ => false,
    })
}

/// Whether a channel shows that a hand touches something: the flag or the force of a finger, or the flag of a gripper.
pub fn feels<'a>(side: Side, mut columns: impl Iterator<Item = &'a str>) -> bool {
    columns.any(|column| {
        let of_hand = column.strip_prefix(side.name()).and_then(|rest| rest.strip_prefix('.'));
        of_hand.is_some_and(|of_hand| {
            of_hand == "gripper.closed" || of_hand.contains(".contact") || of_hand.contains(".force")
        })
    })
}

/// Follows a hand through the log; `touches` is the channel `fingers.contact` of this hand.
pub fn track(measured: &CleanLog, motions: &[Motion], side: Side, fingers: &[Finger], touches: &Array) -> HandTrack {
    let (mut touching, mut target) = (vec![false; measured.len()], vec![None; measured.len()]);
    let objects = super::objects(measured.scene);
    let hand = TargetFinder::new(measured, motions, side, fingers, touches, &objects);
    let carrying = match feels(side, measured.columns.keys().copied()) {
        true => None,
        false => Carrying::new(measured, motions, side, fingers, &objects),
    };
    let fixed = objects
        .iter()
        .copied()
        .find(|body| measured.scene.bodies.get_index(*body).is_some_and(|(_, body)| body.fixed_to == Some(side)));
    let mut sure = None;
    measured.follow(&format!("target of {side}"), |frame, was| {
        let touches = hand.touching(frame);
        let carried = carrying
            .as_ref()
            .and_then(|carrying| carrying.carried(frame, was, |bodies| hand.nearest_of(frame, bodies)));
        let now = match (fixed, carried) {
            (Some(body), _) => State { on: touches, which: Some(body), way: 0.0 },
            (None, Some(carried)) => carried,
            (None, None) if touches && was.on => was,
            (None, None) if touches => State { on: true, which: hand.touched(frame).or(was.which), way: 0.0 },
            (None, None) => State { on: false, which: hand.nearest(frame, was.which, &mut sure), way: 0.0 },
        };
        if let (Some(touching), Some(target)) = (touching.get_mut(frame), target.get_mut(frame)) {
            // A hand touches objects that are fixed to it all the time.
            (*touching, *target) = (touches || fixed.is_some(), now.which);
        }
        now
    });
    let mut runs: Vec<(Range<usize>, Option<usize>)> = vec![];
    for (frame, body) in target.iter().enumerate() {
        match runs.last_mut() {
            Some((frames, same)) if same == body => frames.end = frame + 1,
            _ => runs.push((frame..frame + 1, *body)),
        }
    }
    HandTrack { side, touching, target, runs }
}

/// The target at a frame, which holds until something has moved.
struct CachedTarget {
    frame: usize,
    target: usize,
    /// Maximum displacement of a fingertip relative to an object, m.
    while_within: f64,
    /// The maximum distance of the fingertips from the origin of each object, m.
    reach: Vec<f64>,
}

/// Finds the object that a hand touches or is nearest to.
struct TargetFinder<'a> {
    motions: &'a [Motion<'a>],
    objects: &'a [usize],
    /// The shape of each object.
    solids: Vec<Solid>,
    fingers: Vec<FingerSignals<'a>>,
    /// Whether the log has the place of a fingertip.
    any_tip: bool,
}

struct FingerSignals<'a> {
    tip: bool,
    position: Option<[&'a [f64]; 3]>,
    touches: &'a [f64],
    /// Which object it touches, where the log says so, beside `objects`.
    touches_object: Vec<Option<&'a [f64]>>,
}

impl<'a> TargetFinder<'a> {
    fn new(
        measured: &'a CleanLog,
        motions: &'a [Motion],
        side: Side,
        fingers: &[Finger],
        touches: &'a Array,
        objects: &'a [usize],
    ) -> Self {
        let signals_of = |(finger, touches): (&Finger, &'a Vec<f64>)| {
            let object_flag = |body: &usize| {
                let (name, _) = measured.scene.bodies.get_index(*body)?;
                measured.scalar(&format!("{side}.{finger}.contact.{name}"))
            };
            FingerSignals {
                tip: *finger != Finger::Palm,
                position: measured.vec3(&format!("{side}.{finger}.position")),
                touches,
                touches_object: objects.iter().map(object_flag).collect(),
            }
        };
        let body = |object: &usize| measured.scene.bodies.get_index(*object);
        let solids = objects.iter().filter_map(body).map(|(_, body)| Solid::new(body)).collect();
        let fingers: Vec<FingerSignals> = fingers.iter().zip(touches).map(signals_of).collect();
        let any_tip = fingers.iter().any(|finger| finger.tip && finger.position.is_some());
        Self { motions, objects, solids, fingers, any_tip }
    }

    fn touching(&self, frame: usize) -> bool {
        self.fingers.iter().any(|finger| finger.touches_at(frame))
    }

    /// The object touched by most fingers, as far as the log says; of several the one nearest to the fingers that touch.
    fn touched(&self, frame: usize) -> Option<usize> {
        let votes = |at: usize| {
            let flags = self.fingers.iter().filter_map(|finger| finger.touches_object.get(at).copied().flatten());
            flags.filter(|flag| is_true(flag, frame)).count()
        };
        let votes: Vec<usize> = (0..self.objects.len()).map(votes).collect();
        let most = votes.iter().copied().max()?;
        let candidates: Vec<usize> =
            self.objects.iter().zip(&votes).filter(|(_, votes)| **votes == most).map(|(body, _)| *body).collect();
        match candidates.as_slice() {
            [only] => Some(*only),
            several => {
                let touching = |finger: &FingerSignals| finger.touches_at(frame);
                self.least(self.distances(frame, touching).filter(|(body, _)| several.contains(body)))
                    .map(|(body, _)| body)
            }
        }
    }

    /// The object whose surface is nearest to the fingertips; the target so far, unless another is clearly nearer.
    fn nearest(&self, frame: usize, target: Option<usize>, sure: &mut Option<CachedTarget>) -> Option<usize> {
        // The only candidate is taken at any distance.
        if let [only] = self.objects {
            return Some(*only);
        }
        if sure.as_ref().is_some_and(|sure| Some(sure.target) == target && self.still(sure, frame)) {
            return target;
        }
        let distances: Vec<(usize, f64)> = self.distances(frame, |finger| self.measures(finger)).collect();
        let Some((body, distance)) = self.least(distances.iter().copied()) else { return target };
        let of_target =
            |target| distances.iter().find(|(body, _)| Some(*body) == target).map(|(_, distance)| *distance);
        let found = match of_target(target) {
            Some(so_far) if so_far - distance < NEARER_BY => target,
            _ => Some(body),
        };
        *sure = found.zip(of_target(found)).map(|(found, so_far)| {
            let others = distances.iter().filter(|(body, _)| *body != found).map(|(_, distance)| *distance);
            let ahead = others.fold(f64::INFINITY, f64::min) - so_far + NEARER_BY;
            let reach = |body: &usize| {
                let origin =
                    self.motions.get(*body).map_or_else(Vector3::zeros, |it| it.pose(frame).translation.vector);
                self.tips(frame).map(|tip| (tip - origin).norm()).fold(0.0, f64::max)
            };
            let reach = self.objects.iter().map(reach).collect();
            // Either may come as much nearer as the other gets farther; what is left out is far more than errors of rounding.
            CachedTarget { frame, target: found, while_within: (ahead - ROUNDED) / 2.0, reach }
        });
        found
    }

    /// The one of some objects whose surface is nearest to the fingertips.
    fn nearest_of(&self, frame: usize, bodies: &[usize]) -> Option<usize> {
        let distances = self.distances(frame, |finger| self.measures(finger));
        self.least(distances.filter(|(body, _)| bodies.contains(body))).map(|(body, _)| body)
    }

    /// Whether a fingertip counts for what is near.
    fn measures(&self, finger: &FingerSignals) -> bool {
        finger.tip || !self.any_tip
    }

    fn tips(&self, frame: usize) -> impl Iterator<Item = Vector3<f64>> {
        let fingers = self.fingers.iter().filter(|finger| self.measures(finger)).filter_map(|finger| finger.position);
        fingers.map(move |columns| vector(&columns, frame))
    }

    /// Whether fingertips and objects are still so near to where they were that what was found is so.
    fn still(&self, sure: &CachedTarget, frame: usize) -> bool {
        let tips = self.tips(frame).zip(self.tips(sure.frame));
        let fingers = tips.map(|(now, before)| (now - before).norm_squared()).fold(0.0, f64::max).sqrt();
        if fingers >= sure.while_within {
            return false;
        }
        let objects = self.objects.iter().zip(&sure.reach).filter_map(|(body, reach)| {
            let Displacement { by, turned } = self.motions.get(*body)?.moved(sure.frame, frame);
            Some(by + turned * reach)
        });
        fingers + objects.fold(0.0, f64::max) < sure.while_within
    }

    /// The least distance between the surface of each object and one of the fingers, m; nothing where no finger is placed.
    fn distances(&self, frame: usize, feels: impl Fn(&FingerSignals) -> bool) -> impl Iterator<Item = (usize, f64)> {
        self.objects.iter().zip(&self.solids).filter_map(move |(body, solid)| {
            let reference_from_body = self.motions.get(*body)?.pose(frame);
            let fingers = self.fingers.iter().filter(|finger| feels(finger)).filter_map(|finger| finger.position);
            let points = fingers.map(|columns| Point3::from(vector(&columns, frame)));
            let distance = |point: Point3<f64>| solid.distance(&reference_from_body.inverse_transform_point(&point));
            points.map(distance).min_by(f64::total_cmp).map(|distance| (*body, distance))
        })
    }

    fn least(&self, distances: impl Iterator<Item = (usize, f64)>) -> Option<(usize, f64)> {
        distances.min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

impl FingerSignals<'_> {
    fn touches_at(&self, frame: usize) -> bool {
        is_true(self.touches, frame)
    }
}

/// A flag at a frame.
fn is_true(column: &[f64], frame: usize) -> bool {
    column.get(frame).is_some_and(|value| *value > 0.5)
}
