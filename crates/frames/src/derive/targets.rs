//! The derived channels, one function each, from the tracks of the hands and the motion of the bodies.

use super::contacts::{Contact, Contacts};
use super::hands::{HandTrack, fingers, knows_distance, knows_grasp};
use super::motion::{Motion, quaternion, slope, smoothed, vector};
use super::partner::Partner;
use super::raw_channels::Slots;
use super::sockets::{Insertion, Socket, logged, plugged, sockets};
use super::source::Source;
use crate::clean::preprocess::{CleanLog, State};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use std::collections::BTreeMap;
use std::ops::Range;
use teachtree_base::channels::{DISTANCE_KNOWN, GRASP_KNOWN, PARTNER, ROTATION_KNOWN, TARGET_INSIDE, TARGET_TOUCHED};
use teachtree_base::geometry::Solid;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::scene::Body;

/// The normal of a contact that carries points at least this much up (45°).
pub(super) const CARRIES: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Everything that derived channels are computed from.
pub struct Derivation<'a> {
    pub(super) measured: &'a CleanLog<'a>,
    pub(super) motions: &'a [Motion<'a>],
    objects: &'a [usize],
    pub(super) partners: &'a [usize],
    pub(super) tracks: &'a [HandTrack],
    sockets: Vec<Socket<'a>>,
    /// For each object.
    pub(super) plugged: BTreeMap<usize, Insertion>,
    /// For each body whose angle in a socket the log has: how fast it turns there, rad/s.
    angle_rates: BTreeMap<usize, Vec<f64>>,
    pub(super) contacts: Contacts<'a>,
}

impl<'a> Derivation<'a> {
    /// Prepares what several channels share.
    pub fn new(
        measured: &'a CleanLog,
        motions: &'a [Motion<'a>],
        objects: &'a [usize],
        partners: &'a [usize],
        tracks: &'a [HandTrack],
        contacts: Contacts<'a>,
    ) -> Self {
        let sockets = sockets(measured.scene);
        let plugged = objects.iter().map(|body| (*body, plugged(measured, motions, &sockets, *body))).collect();
        let angle_rate = |body: &usize| {
            let (name, _) = measured.scene.bodies.get_index(*body)?;
            let angle = sockets.iter().find_map(|socket| logged(measured, name, "angle", socket))?;
            Some((*body, slope(measured, angle)))
        };
        let angle_rates = objects.iter().filter_map(angle_rate).collect();
        Self { measured, motions, objects, partners, tracks, sockets, plugged, angle_rates, contacts }
    }

    /// The columns of a derived channel, or `None` for a name that is not derived.
    pub fn channel(&self, name: &str, side: Option<Side>) -> Option<Slots> {
        let track = side.and_then(|side| self.tracks.iter().find(|track| track.side == side));
        match (name, track) {
            ("closing", _) => Some(vec![vec![self.closing()]]),
            ("targets.contact", _) => Some(vec![vec![self.targets_contact()]]),
            (name, Some(track)) => self.of_hand(name, track),
            (_, None) => None,
        }
    }

    fn of_hand<'s>(&'s self, name: &str, track: &HandTrack) -> Option<Slots> {
        let motion = |body: usize| self.motions.get(body);
        let plug = |body: usize| self.plugged.get(&body);
        let gravity = self.measured.scene.gravity.iter().map(|part| part.0 * part.0).sum::<f64>().sqrt();
        let of_body = |value: &dyn Fn(&Body) -> f64| {
            let bodies = &self.measured.scene.bodies;
            of_target(track, [0.0], |body| Source::Same([bodies.get_index(body).map_or(0.0, |(_, body)| value(body))]))
        };
        let of_contact = |source: &dyn Fn(&'s Contact<'a>, usize) -> Source<'s, 3>| {
            let slot = |partner: &usize| {
                let contact = |body: usize| self.contacts.get(&(body, *partner));
                of_target(track, [0.0; 3], |body| {
                    contact(body).map_or(Source::ZERO, |contact| source(contact, *partner))
                })
            };
            self.partners.iter().map(slot).collect::<Slots>()
        };
        Some(match name {
            "target" => vec![of_target(track, [-1.0], |body| Source::Same([self.object(body)]))],
            "target.position" => {
                vec![of_target(track, [0.0; 3], |body| motion(body).map_or(Source::ZERO, Motion::positions))]
            }
            "target.rotation" => {
                let of_target = |motion: Option<&Motion>, frame| motion.map(|motion| motion.pose(frame).rotation);
                vec![self.rotation(track, of_target)]
            }
            "target.hold_rotation" => {
                let palm = self.palm_rotation(track);
                let of_hold = |motion: Option<&Motion>, frame| {
                    let of_target = motion.filter(|motion| motion.has_rotation() || palm.is_none());
                    of_target
                        .map(|motion| motion.pose(frame).rotation)
                        .or_else(|| palm.map(|palm| quaternion(&palm, frame)))
                };
                vec![self.rotation(track, of_hold)]
            }
            "fingers.distance" => {
                let fingers = fingers(self.measured, track.side);
                fingers.into_iter().map(|finger| vec![self.distances(track, finger)]).collect()
            }
            "target.velocity" => {
                vec![of_target(track, [0.0; 3], |body| motion(body).map_or(Source::ZERO, Motion::velocities))]
            }
            "target.angular_velocity" => {
                vec![of_target(track, [0.0; 3], |body| motion(body).map_or(Source::ZERO, Motion::angular_velocities))]
            }
            "target.radius" => vec![of_body(&Body::bounding_radius)],
            "target.weight" => vec![of_body(&|body| body.mass.map_or(0.0, |mass| mass.0 * gravity))],
            "target.noise" => vec![of_target(track, [0.0], |body| {
                let name = self.measured.scene.bodies.get_index(body).map(|(name, _)| name);
                let noise = name.and_then(|name| self.measured.positions.get(name));
                Source::Same([noise.map_or(0.0, |noise| noise.deviation)])
            })],
            "target.fixed" => vec![of_body(&|body| flag(body.fixed_to == Some(track.side)))],
            "target.spin" => vec![vec![each_run(track, |frames, body, spins| self.spins(frames, body, spins))]],
            "target.depth" => {
                vec![of_target(track, [0.0], |body| plug(body).map_or(Source::ZERO, |it| Source::column(&it.depth)))]
            }
            "target.sinking" => {
                vec![of_target(track, [0.0], |body| plug(body).map_or(Source::ZERO, |it| Source::column(&it.rate)))]
            }
            "target.over_socket" => {
                vec![of_target(track, [0.0], |body| plug(body).map_or(Source::ZERO, |it| Source::column(&it.over)))]
            }
            "target.in_plain_socket" => vec![vec![each_run(track, |frames, body, flags| {
                flags.extend(frames.map(|frame| flag(self.socket(frame, plug(body)).is_some_and(Socket::is_plain))));
            })]],
            "contacts.force" => of_contact(&|contact, _| contact.forces()),
            "contacts.normal" => of_contact(&|contact, _| contact.normals()),
            "contacts.velocity" => of_contact(&|_, partner| motion(partner).map_or(Source::ZERO, Motion::velocities)),
            "contacts.handled" => self.partners.iter().map(|partner| vec![self.handled(track, *partner)]).collect(),
            TARGET_TOUCHED => vec![vec![track.touching.iter().map(|touching| flag(*touching)).collect()]],
            PARTNER => {
                vec![vec![self.partners_of(track, |partner| partner.map_or(-1.0, |partner| partner.body as f64))]]
            }
            TARGET_INSIDE => {
                vec![vec![self.partners_of(track, |partner| flag(partner.is_some_and(|partner| partner.inside)))]]
            }
            DISTANCE_KNOWN => vec![vec![vec![flag(knows_distance(self.measured, track.side)); track.target.len()]]],
            ROTATION_KNOWN => {
                let of_hand = self.palm_rotation(track).is_some();
                let is_known =
                    |target: &Option<usize>| of_hand || target.and_then(motion).is_some_and(Motion::has_rotation);
                vec![vec![track.target.iter().map(|target| flag(is_known(target))).collect()]]
            }
            GRASP_KNOWN => vec![vec![vec![flag(knows_grasp(self.measured, track.side)); track.target.len()]]],
            "load" => {
                let [x, y, z] = self.forces(track);
                vec![vec![x.iter().zip(&y).zip(&z).map(|((x, y), z)| Vector3::new(*x, *y, *z).norm()).collect()]]
            }
            "push" => vec![self.forces(track).iter().map(|column| smoothed(self.measured, column)).collect()],
            _ => return None,
        })
    }

    /// Which object this is, counted from zero; -1 when it is none.
    fn object(&self, body: usize) -> f64 {
        self.objects.iter().position(|object| *object == body).map_or(-1.0, |index| index as f64)
    }

    /// The rotation of a hand, if the log has it.
    fn palm_rotation(&self, track: &HandTrack) -> Option<[&[f64]; 4]> {
        self.measured.rotation(&format!("{}.{}.rotation", track.side, Finger::Palm))
    }

    /// A rotation at each frame from the motion of the target; none is that of the reference frame.
    fn rotation(
        &self,
        track: &HandTrack,
        of: impl Fn(Option<&Motion>, usize) -> Option<UnitQuaternion<f64>>,
    ) -> Vec<Vec<f64>> {
        let mut columns = [(); 4].map(|()| Vec::with_capacity(track.target.len()));
        for (frames, target) in &track.runs {
            let motion = target.and_then(|body| self.motions.get(body));
            for frame in frames.clone() {
                let rotation = of(motion, frame).unwrap_or_default();
                let parts = [rotation.w, rotation.i, rotation.j, rotation.k];
                columns.iter_mut().zip(parts).for_each(|(column, part)| column.push(part));
            }
        }
        columns.into()
    }

    /// The distance of a fingertip from the surface of the target's parts at each frame, or of the ball of its `radius`, m, negative inside; from the origin of
    /// the reference frame without a target. A target whose rotation the log lacks stands as in the scene.
    fn distances(&self, track: &HandTrack, finger: Finger) -> Vec<f64> {
        let position = self.measured.vec3(&format!("{}.{finger}.position", track.side));
        let tip =
            |frame: usize| Point3::from(position.map_or_else(Vector3::zeros, |position| vector(&position, frame)));
        let mut column = Vec::with_capacity(track.target.len());
        for (frames, target) in &track.runs {
            let target = target.and_then(|body| self.measured.scene.bodies.get_index(body).zip(self.motions.get(body)));
            let target = target.map(|((_, body), motion)| (Solid::of_radius_or_parts(body), motion));
            column.extend(frames.clone().map(|frame| match &target {
                Some((solid, motion)) => solid.distance(&motion.pose(frame).inverse_transform_point(&tip(frame))),
                None => tip(frame).coords.norm(),
            }));
        }
        column
    }

    /// The socket that something is in.
    pub(super) fn socket(&self, frame: usize, plugged: Option<&Insertion>) -> Option<&Socket<'_>> {
        self.sockets.get(plugged?.socket.get(frame).copied().flatten()?)
    }

    /// Whether a body is in or at a socket, or another body is in a socket of this one. The force then contains the insertion force in addition to
    /// the weight.
    pub(super) fn is_at_socket(&self, body: usize, frame: usize) -> bool {
        let plugged = self.plugged.get(&body);
        self.socket(frame, plugged).is_some()
            || plugged.and_then(|it| it.over.get(frame)).is_some_and(|over| *over > 0.5)
            || self.plugged.values().any(|it| self.socket(frame, Some(it)).is_some_and(|socket| socket.body == body))
    }

    /// Whether a hand whose target this object is touches it.
    pub(super) fn is_touched(&self, object: usize, frame: usize) -> bool {
        self.touching(object, frame).next().is_some()
    }

    /// Returns the hands that touch an object in a frame.
    pub(super) fn touching(&self, object: usize, frame: usize) -> impl Iterator<Item = Side> {
        let touches = move |track: &&HandTrack| {
            track.touching.get(frame) == Some(&true) && track.target.get(frame) == Some(&Some(object))
        };
        self.tracks.iter().filter(touches).map(|track| track.side)
    }

    /// Angular velocity about the axis of the socket it is in, relative to that socket, else about the normal of the contact that carries it,
    /// else about the vertical.
    fn spins(&self, frames: Range<usize>, body: usize, spins: &mut Vec<f64>) {
        if let Some(rates) = self.angle_rates.get(&body) {
            return spins.extend_from_slice(rates.get(frames).unwrap_or_default());
        }
        let turn = |body: usize, frame: usize| {
            self.motions.get(body).map_or_else(Vector3::zeros, |motion| motion.angular_velocity(frame))
        };
        let plugged = self.plugged.get(&body);
        let contacts: Vec<&Contact> =
            self.partners.iter().filter_map(|partner| self.contacts.get(&(body, *partner))).collect();
        spins.extend(frames.map(|frame| match self.socket(frame, plugged) {
            Some(socket) => (turn(body, frame) - turn(socket.body, frame)).dot(&socket.axis(self.motions, frame)),
            None => {
                let carrying =
                    contacts.iter().map(|contact| contact.normal(frame)).filter(|normal| normal.z >= CARRIES);
                let normal = carrying.max_by(|a, b| a.z.total_cmp(&b.z)).unwrap_or_else(Vector3::z);
                turn(body, frame).dot(&normal)
            }
        }));
    }

    /// Whether the other hand has a body that the target touches, or that body is in a socket of the target.
    fn handled(&self, track: &HandTrack, partner: usize) -> Vec<f64> {
        let other = self.tracks.iter().find(|other| other.side != track.side);
        let touches = |frame: usize| {
            other.is_some_and(|other| {
                other.touching.get(frame) == Some(&true) && other.target.get(frame) == Some(&Some(partner))
            })
        };
        let plugged = self.plugged.get(&partner);
        each_run(track, |frames, body, flags| {
            let in_body = |frame| self.socket(frame, plugged).is_some_and(|socket| socket.body == body);
            flags.extend(frames.map(|frame| flag(body != partner && (touches(frame) || in_body(frame)))));
        })
    }

    /// A number of the partner of a hand's target at each frame.
    fn partners_of(&self, track: &HandTrack, number: impl Fn(Option<Partner>) -> f64) -> Vec<f64> {
        let mut column = Vec::with_capacity(track.target.len());
        self.partner(track, &mut |partner| column.push(number(partner)));
        column
    }

    /// The sum of the finger forces at each frame, N.
    fn forces(&self, track: &HandTrack) -> [Vec<f64>; 3] {
        let mut sum = [(); 3].map(|()| vec![0.0; self.measured.len()]);
        for finger in Finger::ALL {
            let force = self.measured.vec3(&format!("{}.{finger}.force", track.side)).unwrap_or_default();
            for (sum, force) in sum.iter_mut().zip(force) {
                sum.iter_mut().zip(force).for_each(|(sum, force)| *sum += force);
            }
        }
        sum
    }

    /// The targets of both hands, left first, where they differ.
    fn both_targets(&self) -> impl Fn(usize) -> Option<(usize, usize)> {
        let [left, right] = Side::BOTH.map(|side| self.tracks.iter().find(|track| track.side == side));
        move |frame| {
            let target = |track: Option<&HandTrack>| track?.target.get(frame).copied().flatten();
            target(left).zip(target(right)).filter(|(left, right)| left != right)
        }
    }

    /// Speed at which one target's depth in the other grows, m/s; 0 while neither is in the other.
    fn closing(&self) -> Vec<f64> {
        let into = |frame: usize, body: usize, other: usize| {
            let plugged = self.plugged.get(&body)?;
            (self.socket(frame, Some(plugged))?.body == other).then(|| plugged.rate.get(frame).copied())?
        };
        let targets = self.both_targets();
        let at = |frame: usize| {
            targets(frame).and_then(|(left, right)| into(frame, left, right).or_else(|| into(frame, right, left)))
        };
        (0..self.measured.len()).map(|frame| at(frame).unwrap_or_default()).collect()
    }

    fn targets_contact(&self) -> Vec<f64> {
        let mut flags = vec![0.0; self.measured.len()];
        let targets = self.both_targets();
        self.measured.follow("targets touch", |frame, was| {
            let contact = targets(frame).and_then(|pair| self.contacts.get(&pair));
            let touching = contact.is_some_and(|contact| contact.touching(frame, was.on));
            if let Some(value) = flags.get_mut(frame) {
                *value = flag(touching);
            }
            State { on: touching, ..was }
        });
        flags
    }
}

/// A quantity of the target at each frame, a column for each component; `none` without a target.
fn of_target<'s, const N: usize>(
    track: &HandTrack,
    none: [f64; N],
    of: impl Fn(usize) -> Source<'s, N>,
) -> Vec<Vec<f64>> {
    let mut columns = [(); N].map(|()| Vec::with_capacity(track.target.len()));
    for (frames, target) in &track.runs {
        target.map_or(Source::Same(none), &of).append(frames.clone(), &mut columns);
    }
    columns.into()
}

/// A number of the target at each frame, from what adds those of the frames in which the target is the same body; 0 without a target.
fn each_run(track: &HandTrack, add: impl Fn(Range<usize>, usize, &mut Vec<f64>)) -> Vec<f64> {
    let mut column = Vec::with_capacity(track.target.len());
    for (frames, target) in &track.runs {
        match target {
            Some(body) => add(frames.clone(), *body, &mut column),
            None => column.resize(frames.end, 0.0),
        }
    }
    column
}

fn flag(yes: bool) -> f64 {
    f64::from(u8::from(yes))
}
