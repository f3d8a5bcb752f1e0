//! The part of a recording with one task, resampled at the rate of commands, and its segments and contact points.

use super::columns::{RowTime, interpolated, poses, poses_at, positions_at, vectors};
use super::schema::{Contact, GraspSpec, Quality, Segment, Tip};
use super::smoothing::{deviation, jerk, smooth_parts, smooth_within};
use super::touch_detection::{TouchForces, are_of_gripper, flags, touching};
use super::{FRICTION, RATE_HZ, pads};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use teachtree_base::geometry::{face_normal, surface_distance};
use teachtree_base::hands::{Finger, Side};
use teachtree_base::log_channel::{ContactPart, FingerPart, LogChannel};
use teachtree_base::meaning::Meaning;
use teachtree_base::pose::PoseArray;
use teachtree_base::recording::Recording;
use teachtree_base::scene::{Body, Hand};

/// Frequency at which smoothing halves positions, Hz, and the largest distance by which it may move them, m.
const POSITION_HZ: f64 = 4.0;
const POSITION_M: f64 = 0.002;
/// Frequency at which smoothing halves forces, Hz. Voluntary changes of force are slower than 5 Hz, and physiological tremor has 8 to 12 Hz: a sine of 8 Hz is
/// passed by 6 %, one of 10.8 Hz by 1 %. Tremor may be larger than small forces, so that the amplitude is not a criterion.
pub const FORCE_HZ: f64 = 5.0;
/// Maximum distance at which the pads of a closed gripper touch an object, m.
const PAD_GAP_M: f64 = 0.004;
/// The distance that a rotation of 1 rad counts as, m.
const TURN_M: f64 = 0.05;
/// Minimum contact time of a participating finger, as a share of the time in which any finger has contact.
const TAKES_PART: f64 = 0.3;
/// Minimum contact force between a body and the object, N.
const ON_N: f64 = 0.01;
/// An object is at rest if it moves by less than this, m, for this time, s. It comes to rest within the third time after its task, s.
const RESTS_M: f64 = 0.001;
const RESTS_FOR_S: f64 = 0.1;
pub(super) const RESTS_WITHIN_S: f64 = 1.0;
const SAME_S: f64 = 1e-6;
/// The time after the first contact in which a finger moves to its mean contact point, s.
const SETTLES_S: f64 = 0.1;

/// A commanded attempt.
pub(super) struct Episode {
    pub(super) pieces: Vec<EpisodeSegment>,
    /// Whether the object falls intentionally at the end.
    pub(super) lets_fall: bool,
}

/// A segment of an attempt.
pub(super) struct EpisodeSegment {
    pub(super) primitive: String,
    /// The action of the hand.
    pub(super) does: Meaning,
    /// The indices of the commanded samples of the series, in order; never empty.
    pub(super) samples: Vec<usize>,
    /// Whether the object is touched.
    pub(super) touching: bool,
}

/// Samples of one task.
pub(super) struct Series {
    pub(super) start_s: f64,
    /// The times of the samples, s.
    times: Vec<RowTime>,
    /// The recorded poses of the object.
    pub(super) object: Vec<Isometry3<f64>>,
    /// The desired poses of the object, before smoothing.
    pub(super) wanted: Vec<Isometry3<f64>>,
    pub(super) fingers: Vec<FingerSeries>,
    /// Whether two jaws hold the object with flat pads, so that the contact points on the pads are unknown.
    pub(super) flat_pads: bool,
    tip_radius: f64,
}

/// One finger.
pub(super) struct FingerSeries {
    pub(super) finger: Finger,
    /// Center of the tip, frame of the object, m.
    tip: Vec<Vector3<f64>>,
    /// Center of the tip, reference frame, m.
    pub(super) tip_in_world: Vec<Vector3<f64>>,
    /// The recorded force on the object, frame of the object, N; and the desired force, before smoothing.
    pub(super) force: Vec<Vector3<f64>>,
    pub(super) wanted_force: Vec<Vector3<f64>>,
    /// The wanted force without tremor, in the samples of touching segments.
    smooth_force: Vec<Vector3<f64>>,
    /// Recorded force on the object in the same frame; empty if it was not measured.
    recorded_force: Vec<Vector3<f64>>,
    pub(super) touches: Vec<bool>,
}

impl Series {
    /// `None` when the recording lacks the pose of the object or every fingertip.
    pub(super) fn new(
        recording: &Recording,
        side: Side,
        hand: &Hand,
        object: &str,
        [start_s, end_s]: [f64; 2],
        touch: TouchForces,
    ) -> Option<Self> {
        let count = ((end_s - start_s) * RATE_HZ).round() as usize + 1;
        recording.time.first()?;
        let times: Vec<RowTime> = (0..count).map(|at| RowTime::at(recording, start_s + at as f64 / RATE_HZ)).collect();
        let rows: Vec<usize> = times.iter().map(|time| time.row).collect();
        let (name, body) = (object, recording.scene.bodies.get(object));
        let object = poses_at(recording, object, &times)?;
        let mut fingers = Vec::new();
        for &finger in hand.fingers.iter().filter(|finger| **finger != Finger::Palm) {
            let tip = |part| LogChannel::Finger(side, finger, part);
            let Some(tips) = positions_at(recording, &tip(FingerPart::Position), &times) else { continue };
            let forces = vectors(recording, &tip(FingerPart::Force), &rows);
            let is_measured = forces.is_some();
            let forces = forces.unwrap_or_else(|| vec![Vector3::zeros(); rows.len()]);
            let at_rows = |rows: &[usize]| Some(touching(recording, (side, finger), name, rows, touch));
            // Between two rows a finger has contact if it has contact at both.
            let mut touches = interpolated(&times, at_rows, |one, other, _| one && other)?;
            let local =
                |(at, tip): (usize, &Vector3<f64>)| object[at].inverse_transform_point(&Point3::from(*tip)).coords;
            if let Some(body) = body.filter(|_| are_of_gripper(recording, (side, finger), name)) {
                for (on, tip) in touches.iter_mut().zip(tips.iter().enumerate().map(local)) {
                    *on &= surface_distance(body, &tip.into()) < PAD_GAP_M;
                }
            }
            let on_object = |((force, object), on): ((&Vector3<f64>, &Isometry3<f64>), &bool)| {
                if *on { object.inverse_transform_vector(force) } else { Vector3::zeros() }
            };
            let force: Vec<Vector3<f64>> = forces.iter().zip(&object).zip(&touches).map(on_object).collect();
            fingers.push(FingerSeries {
                finger,
                tip: tips.iter().enumerate().map(local).collect(),
                wanted_force: force.clone(),
                smooth_force: force.clone(),
                recorded_force: if is_measured { force.clone() } else { Vec::new() },
                force,
                tip_in_world: tips,
                touches,
            });
        }
        let wanted = object.clone();
        // A hand with contact flags does not measure the positions of its contacts.
        let flat_pads =
            fingers.len() == 2 && fingers.iter().all(|it| flags(recording, (side, it.finger), name).is_some());
        (!fingers.is_empty()).then_some(Self {
            start_s,
            times,
            object,
            wanted,
            fingers,
            flat_pads,
            tip_radius: hand.tip_radius.0,
        })
    }

    /// Returns the number of samples.
    pub(super) fn len(&self) -> usize {
        self.object.len()
    }

    /// Returns the time of a sample, s of the recording.
    pub(super) fn time_s(&self, at: usize) -> f64 {
        self.start_s + at as f64 / RATE_HZ
    }

    /// Returns the sample at a time, s of the recording; the first or the last one for a time outside the series.
    pub(super) fn sample(&self, time_s: f64) -> usize {
        (((time_s - self.start_s) * RATE_HZ).round().max(0.0) as usize).min(self.len().saturating_sub(1))
    }

    /// Returns the recorded poses of another body; `None` for a body that was not measured.
    pub(super) fn other(&self, recording: &Recording, body: &str) -> Option<Vec<Isometry3<f64>>> {
        poses_at(recording, body, &self.times)
    }

    /// Returns the resting pose of an object at a time (s) or soon after it; `None` for an object that was not measured, or still moves at the end of the
    /// recording.
    pub(super) fn at_rest(&self, recording: &Recording, object: &str, end_s: f64) -> Option<Isometry3<f64>> {
        // The recording may end there: the last row with enough time before the end counts too.
        let ends_s = end_s.min(*recording.time.last()?);
        let from = recording.time.partition_point(|time| *time <= ends_s - RESTS_FOR_S + SAME_S).saturating_sub(1);
        let rows: Vec<usize> =
            (from..recording.time.len()).take_while(|row| recording.time[*row] <= end_s + RESTS_WITHIN_S).collect();
        let poses = poses(recording, object, &rows)?;
        let place = |at: usize| poses[at].translation.vector;
        (0..rows.len()).find_map(|from| {
            let until_s = (recording.time[rows[from]] + RESTS_FOR_S).max(ends_s);
            let until = (from..rows.len()).find(|at| recording.time[rows[*at]] >= until_s - SAME_S)?;
            (from..=until).all(|at| (place(at) - place(from)).norm() < RESTS_M).then(|| poses[until])
        })
    }

    /// Returns the unit normals from a body to the object, zero without contact; `None` if the recording lacks their contact.
    pub(super) fn normals(&self, recording: &Recording, object: &str, body: &str) -> Option<Vec<Vector3<f64>>> {
        let contact = |part| LogChannel::Contact(object, body, part);
        let rows: Vec<usize> = self.times.iter().map(|time| time.row).collect();
        let forces = vectors(recording, &contact(ContactPart::Force), &rows)?;
        let normals = vectors(recording, &contact(ContactPart::Normal), &rows).unwrap_or_else(|| forces.clone());
        let touches = |force: &Vector3<f64>| force.norm() > ON_N;
        let unit = |(force, normal): (&Vector3<f64>, &Vector3<f64>)| {
            normal.try_normalize(1e-6).filter(|_| touches(force)).unwrap_or_else(Vector3::zeros)
        };
        Some(forces.iter().zip(&normals).map(unit).collect())
    }

    /// Sets the force of a finger, N, against the normal of its contact, at those of these samples at which it has contact.
    pub(super) fn press(&mut self, contact: &Contact, force: f64, samples: &[usize]) {
        let pressed = -Vector3::from(contact.normal) * force;
        let Some(finger) = self.fingers.iter_mut().find(|it| it.finger == contact.finger) else { return };
        for &at in samples {
            if finger.touches[at] {
                (finger.force[at], finger.wanted_force[at]) = (pressed, pressed);
            }
        }
    }

    /// Returns the number of samples at which a fingertip has contact and is at the object.
    pub(super) fn nearness(&self, body: &Body) -> usize {
        self.touching_samples(body).count()
    }

    /// Returns the first and the last sample at which a fingertip has contact and is at the object; `None` without such a sample.
    pub(super) fn touched(&self, body: &Body) -> Option<(usize, usize)> {
        Some((self.touching_samples(body).min()?, self.touching_samples(body).max()?))
    }

    /// Returns the samples at which a fingertip has contact and is at the object, finger by finger.
    fn touching_samples<'a>(&'a self, body: &'a Body) -> impl Iterator<Item = usize> + 'a {
        let is_at = |tip: &Vector3<f64>| surface_distance(body, &Point3::from(*tip)) < self.tip_radius + 0.004;
        self.fingers.iter().flat_map(move |finger| {
            let samples = finger.tip.iter().zip(&finger.touches).enumerate();
            samples.filter(move |(_, (tip, on))| **on && is_at(tip)).map(|(at, _)| at)
        })
    }

    /// Returns the contact points of an episode: for each finger the mean over its contact time, on the surface of the object.
    pub(super) fn contacts(&self, body: &Body, episode: &Episode) -> GraspSpec {
        let samples =
            episode.pieces.iter().filter(|piece| piece.touching).flat_map(|piece| piece.samples.iter().copied());
        // A long retreat after the release does not reduce the share of contact time.
        let samples: Vec<usize> = samples.filter(|&at| self.fingers.iter().any(|finger| finger.touches[at])).collect();
        let (mut contacts, mut means, mut brief) = (Vec::new(), Vec::new(), Vec::new());
        for finger in &self.fingers {
            let touched: Vec<usize> = samples.iter().copied().filter(|&at| finger.touches[at]).collect();
            if touched.is_empty() {
                continue;
            }
            if (touched.len() as f64) < TAKES_PART * samples.len() as f64 {
                brief.push(finger.finger);
                continue;
            }
            let mean = touched.iter().map(|&at| finger.tip[at]).sum::<Vector3<f64>>() / touched.len() as f64;
            let Some(normal) = face_normal(body, &mean.into()) else { continue };
            let point = mean - normal * surface_distance(body, &mean.into());
            contacts.push(Contact { finger: finger.finger, point: point.into(), normal: normal.into() });
            means.push(mean);
        }
        if self.flat_pads {
            pads::face_contacts(body, &mut contacts, &means);
            pads::opposite(body, &mut contacts, self.tip_radius);
        }
        for contact in &mut contacts {
            (contact.point, contact.normal) = (contact.point.map(round), contact.normal.map(round));
        }
        GraspSpec { contacts, brief, mapped: None, infeasible: None }
    }

    /// Smooths the forces of an episode. A contact may last through several segments, and its force is smooth from one to the next.
    pub(super) fn smooth_forces(&mut self, episode: &Episode) {
        let touching = episode.pieces.iter().filter(|piece| piece.touching);
        let mut samples: Vec<usize> = touching.flat_map(|piece| piece.samples.iter().copied()).collect();
        // A segment begins with the last sample of the one before.
        samples.dedup();
        self.fingers.iter_mut().for_each(|finger| finger.smooth_force(&samples));
    }

    /// Returns a commanded segment, after [`Self::smooth_forces`] of its episode.
    pub(super) fn segment(&self, piece: &EpisodeSegment, grasp: Option<&GraspSpec>) -> Segment {
        let mut quality = Quality::default();
        let at = &piece.samples;
        let first = self.wanted[at[0]].rotation;
        let flat = |poses: &[Isometry3<f64>]| at.iter().map(|&at| flattened(&poses[at], &first)).collect::<Vec<_>>();
        let object = smooth_within(&flat(&self.wanted), RATE_HZ, POSITION_HZ, POSITION_M);
        note(&mut quality, &flat(&self.object), &object);
        let contact_of = |finger: Finger| grasp?.contacts.iter().find(|contact| contact.finger == finger);
        let taking_part: Vec<&FingerSeries> = match grasp {
            Some(grasp) if !grasp.contacts.is_empty() => {
                self.fingers.iter().filter(|finger| contact_of(finger.finger).is_some()).collect()
            }
            _ => self.fingers.iter().collect(),
        };
        let hand: Vec<[f64; 3]> = at
            .iter()
            .map(|&at| {
                let sum: Vector3<f64> = taking_part.iter().map(|finger| finger.tip[at]).sum();
                (sum / taking_part.len().max(1) as f64).into()
            })
            .collect();
        let smooth_hand = smooth_within(&hand, RATE_HZ, POSITION_HZ, POSITION_M);
        note(&mut quality, &hand, &smooth_hand);
        let mut tips = Vec::new();
        for finger in &self.fingers {
            let contact = contact_of(finger.finger);
            let raw: Vec<[f64; 3]> = at.iter().map(|&at| finger.tip[at].into()).collect();
            let mut position = smooth_within(&raw, RATE_HZ, POSITION_HZ, POSITION_M);
            if contact.is_none() || !piece.touching {
                note(&mut quality, &raw, &position);
            }
            let mut force = vec![[0.0; 3]; at.len()];
            if let Some(contact) = contact.filter(|_| piece.touching) {
                let normal = Vector3::from(contact.normal);
                let rests = Vector3::from(contact.point) + normal * self.tip_radius;
                let mut on_for = if finger.touches[at[0]] { SETTLES_S } else { 0.0 };
                for (place, &at) in position.iter_mut().zip(at) {
                    // A finger in contact stays at its mean contact point.
                    on_for = if finger.touches[at] { on_for + 1.0 / RATE_HZ } else { 0.0 };
                    let share = (on_for / SETTLES_S).min(1.0);
                    *place = (Vector3::from(*place) * (1.0 - share) + rests * share).into();
                }
                quality.contact_deviation = quality.contact_deviation.max(deviation(&raw, &position));
                finger.forces(at, &normal, &mut force, &mut quality);
            }
            let recorded = at.iter().filter_map(|&at| finger.recorded_force.get(at));
            tips.push(Tip {
                finger: finger.finger,
                demonstrated_force: recorded.map(|force| rounded(*force)).collect(),
                position: position.into_iter().map(|it| rounded(it.into())).collect(),
                force: force.into_iter().map(|it| rounded(it.into())).collect(),
            });
        }
        Segment {
            primitive: piece.primitive.clone(),
            does: piece.does,
            duration_s: at.len().saturating_sub(1) as f64 / RATE_HZ,
            demonstrated_start_s: self.time_s(at[0]),
            object: object.iter().map(|flat| unflattened(flat, &first)).collect(),
            hand: smooth_hand.into_iter().map(|it| rounded(it.into())).collect(),
            tips,
            quality,
            ..Segment::default()
        }
    }
}

impl FingerSeries {
    /// Smooths the force from each contact to its loss; `samples` are those of touching segments, in order.
    fn smooth_force(&mut self, samples: &[usize]) {
        for run in samples.chunk_by(|one, next| self.touches[*one] == self.touches[*next]) {
            if !self.touches[run[0]] {
                continue;
            }
            let wanted: Vec<[f64; 3]> = run.iter().map(|&at| self.wanted_force[at].into()).collect();
            for (&at, force) in run.iter().zip(smooth_parts(&wanted, RATE_HZ, FORCE_HZ)) {
                self.smooth_force[at] = force.into();
            }
        }
    }

    /// Writes the forces of these samples within the friction cone, and returns the changes.
    fn forces(&self, at: &[usize], normal: &Vector3<f64>, out: &mut [[f64; 3]], quality: &mut Quality) {
        for (out, &at) in out.iter_mut().zip(at).filter(|(_, at)| self.touches[**at]) {
            let (inside, was_outside) = into_cone(self.smooth_force[at], normal);
            quality.into_cone += usize::from(was_outside);
            quality.force_deviation = quality.force_deviation.max((inside - self.force[at]).norm());
            *out = inside.into();
        }
    }
}

/// Returns a pose of the object as position and rotation since `first`; the rotation is scaled to a distance, m.
fn flattened(pose: &Isometry3<f64>, first: &UnitQuaternion<f64>) -> [f64; 6] {
    let (place, turned) = (pose.translation.vector, (pose.rotation * first.inverse()).scaled_axis() * TURN_M);
    [place.x, place.y, place.z, turned.x, turned.y, turned.z]
}

fn unflattened(flat: &[f64; 6], first: &UnitQuaternion<f64>) -> PoseArray {
    let turned = Vector3::new(flat[3], flat[4], flat[5]) / TURN_M;
    let turn = UnitQuaternion::from_scaled_axis(turned) * first;
    [flat[0], flat[1], flat[2], turn.w, turn.i, turn.j, turn.k].map(round)
}

/// Returns a pose as commands write it: seven numbers with seven decimals.
pub(super) fn pose_array(pose: &Isometry3<f64>) -> PoseArray {
    teachtree_base::pose::pose_array(pose).map(round)
}

/// Returns the nearest force on an object (N) within the friction cone about `-normal`, the direction into its surface, and whether the given force was
/// outside.
pub fn into_cone(force: Vector3<f64>, normal: &Vector3<f64>) -> (Vector3<f64>, bool) {
    let pressed = -force.dot(normal);
    if pressed <= 0.0 {
        return (Vector3::zeros(), force != Vector3::zeros());
    }
    let along = force + normal * pressed;
    let largest = FRICTION * pressed;
    if along.norm() <= largest { (force, false) } else { (along.normalize() * largest - normal * pressed, true) }
}

fn note<const N: usize>(quality: &mut Quality, raw: &[[f64; N]], smoothed: &[[f64; N]]) {
    quality.jerk_before = quality.jerk_before.max(jerk(raw, RATE_HZ));
    quality.jerk_after = quality.jerk_after.max(jerk(smoothed, RATE_HZ));
    quality.position_deviation = quality.position_deviation.max(deviation(raw, smoothed));
}

fn round(value: f64) -> f64 {
    (value * 1e7).round() / 1e7 + 0.0
}

fn rounded(vector: Vector3<f64>) -> [f64; 3] {
    [round(vector.x), round(vector.y), round(vector.z)]
}
