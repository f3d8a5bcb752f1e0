//! The derived channels, one function each, from the tracks of the hands and the motion of the bodies.

use super::contacts::{Contact, Contacts};
use super::hands::HandTrack;
use super::motion::{Motion, slope, steady, vector};
use super::raw::Slots;
use super::sockets::{Plugged, Socket, logged, plugged, sockets};
use crate::base::hands::{Finger, Side};
use crate::stream::measured::{Measured, State};
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// The normal of a contact that carries points at least this much up (45°).
const CARRIES: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Everything that derived channels are computed from.
pub struct Derivation<'a> {
    measured: &'a Measured<'a>,
    motions: &'a [Motion<'a>],
    objects: &'a [usize],
    partners: &'a [usize],
    tracks: &'a [HandTrack],
    sockets: Vec<Socket<'a>>,
    /// For each object.
    plugged: BTreeMap<usize, Plugged>,
    /// For each body whose angle in a socket the log has: how fast it turns there, rad/s.
    angle_rates: BTreeMap<usize, Vec<f64>>,
    contacts: Contacts<'a>,
}

impl<'a> Derivation<'a> {
    /// Prepares what several channels share.
    pub fn new(
        measured: &'a Measured,
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
            Some((*body, slope(measured, |frame| angle.get(frame).copied().unwrap_or_default())))
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

    fn of_hand(&self, name: &str, track: &HandTrack) -> Option<Slots> {
        let of_motion = |value: &dyn Fn(&Motion, usize) -> Vector3<f64>| {
            self.vectors(track, |frame, body| {
                self.motions.get(body).map_or_else(Vector3::zeros, |motion| value(motion, frame))
            })
        };
        let of_body = |value: &dyn Fn(&crate::base::scene::Body) -> f64| {
            let values: Vec<f64> = self.measured.scene.bodies.values().map(value).collect();
            self.scalars(track, |_, body| values.get(body).copied().unwrap_or_default())
        };
        let of_plug = |value: &dyn Fn(&Plugged, usize) -> f64| {
            self.scalars(track, |frame, body| self.plugged.get(&body).map_or(0.0, |plug| value(plug, frame)))
        };
        let gravity = self.measured.scene.gravity.iter().map(|part| part.0 * part.0).sum::<f64>().sqrt();
        Some(match name {
            "target" => vec![vec![self.target(track)]],
            "target.position" => vec![of_motion(&|motion, frame| motion.pose(frame).translation.vector)],
            "target.rotation" => vec![self.rotation(track)],
            "target.velocity" => vec![of_motion(&|motion, frame| motion.velocity(frame))],
            "target.angular_velocity" => vec![of_motion(&|motion, frame| motion.angular_velocity(frame))],
            "target.radius" => vec![vec![of_body(&crate::base::scene::Body::bounding_radius)]],
            "target.weight" => vec![vec![of_body(&|body| body.mass.map_or(0.0, |mass| mass.0 * gravity))]],
            "target.spin" => vec![vec![self.scalars(track, |frame, body| self.spin(frame, body))]],
            "target.depth" => vec![vec![of_plug(&|plug, frame| plug.depth.get(frame).copied().unwrap_or_default())]],
            "target.sinking" => vec![vec![of_plug(&|plug, frame| plug.rate.get(frame).copied().unwrap_or_default())]],
            "target.fixed" => {
                let bodies = &self.measured.scene.bodies;
                let fixed: Vec<bool> = bodies.values().map(|body| body.fixed_to == Some(track.side)).collect();
                vec![vec![self.scalars(track, |_, body| flag(fixed.get(body) == Some(&true)))]]
            }
            "target.over_socket" => {
                vec![vec![of_plug(&|plug, frame| flag(plug.over.get(frame).copied().unwrap_or_default()))]]
            }
            "target.in_plain_socket" => {
                vec![vec![
                    self.scalars(track, |frame, body| flag(self.socket(frame, body).is_some_and(Socket::is_plain))),
                ]]
            }
            "contacts.force" => self.slots(track, |frame, contact, _| contact.force(frame)),
            "contacts.normal" => self.slots(track, |frame, contact, _| contact.normal(frame)),
            "contacts.velocity" => self.slots(track, |frame, _, partner| {
                self.motions.get(partner).map_or_else(Vector3::zeros, |motion| motion.velocity(frame))
            }),
            "contacts.handled" => self.handled(track),
            "load" => vec![vec![self.forces(track).iter().map(Vector3::norm).collect()]],
            "push" => vec![
                columns::<3>(self.forces(track).into_iter().map(Into::into))
                    .iter()
                    .map(|it| steady(self.measured, it))
                    .collect(),
            ],
            _ => return None,
        })
    }

    /// A number of the target at each frame; 0 without a target.
    fn scalars(&self, track: &HandTrack, value: impl Fn(usize, usize) -> f64) -> Vec<f64> {
        track.target.iter().enumerate().map(|(frame, target)| target.map_or(0.0, |body| value(frame, body))).collect()
    }

    /// A vector of the target at each frame, as three columns; zero without a target.
    fn vectors(&self, track: &HandTrack, value: impl Fn(usize, usize) -> Vector3<f64>) -> Vec<Vec<f64>> {
        columns(
            track
                .target
                .iter()
                .enumerate()
                .map(|(frame, target)| target.map_or_else(Vector3::zeros, |body| value(frame, body)).into()),
        )
    }

    fn target(&self, track: &HandTrack) -> Vec<f64> {
        let index =
            |body: &usize| self.objects.iter().position(|object| object == body).map_or(-1.0, |index| index as f64);
        track.target.iter().map(|target| target.as_ref().map_or(-1.0, index)).collect()
    }

    fn rotation(&self, track: &HandTrack) -> Vec<Vec<f64>> {
        columns(track.target.iter().enumerate().map(|(frame, target)| {
            let rotation = target
                .and_then(|body| self.motions.get(body))
                .map(|motion| motion.pose(frame).rotation)
                .unwrap_or_default();
            [rotation.w, rotation.i, rotation.j, rotation.k]
        }))
    }

    /// The socket that a body is in.
    fn socket(&self, frame: usize, body: usize) -> Option<&Socket<'_>> {
        let index = self.plugged.get(&body)?.socket.get(frame).copied().flatten()?;
        self.sockets.get(index)
    }

    /// Angular velocity about the axis of the socket it is in, relative to that socket, else about the normal of the contact that carries it,
    /// else about the vertical.
    fn spin(&self, frame: usize, body: usize) -> f64 {
        let turn =
            |body: usize| self.motions.get(body).map_or_else(Vector3::zeros, |motion| motion.angular_velocity(frame));
        if let Some(rate) = self.angle_rates.get(&body).and_then(|rates| rates.get(frame)) {
            return *rate;
        }
        if let Some(socket) = self.socket(frame, body) {
            return (turn(body) - turn(socket.body)).dot(&socket.axis(self.motions, frame));
        }
        let carrying = self.partners.iter().filter_map(|partner| self.contacts.get(&(body, *partner)));
        let normals = carrying.map(|contact| contact.normal(frame)).filter(|normal| normal.z >= CARRIES);
        turn(body).dot(&normals.max_by(|a, b| a.z.total_cmp(&b.z)).unwrap_or_else(Vector3::z))
    }

    /// A vector for each slot of `contacts`; zero where the target is not touched by that body, or is that body.
    fn slots(&self, track: &HandTrack, value: impl Fn(usize, &Contact, usize) -> Vector3<f64>) -> Slots {
        let slot = |partner: &usize| {
            self.vectors(track, |frame, body| {
                self.contacts
                    .get(&(body, *partner))
                    .map_or_else(Vector3::zeros, |contact| value(frame, contact, *partner))
            })
        };
        self.partners.iter().map(slot).collect()
    }

    fn handled(&self, track: &HandTrack) -> Slots {
        let other = self.tracks.iter().find(|other| other.side != track.side);
        let touches = |frame: usize, partner: usize| {
            other.is_some_and(|other| {
                other.touching.get(frame) == Some(&true) && other.target.get(frame) == Some(&Some(partner))
            })
        };
        let plugged = |frame: usize, partner: usize, body: usize| {
            self.socket(frame, partner).is_some_and(|socket| socket.body == body)
        };
        let slot = |partner: &usize| {
            let counts = |frame, body| touches(frame, *partner) || plugged(frame, *partner, body);
            vec![self.scalars(track, |frame, body| flag(body != *partner && counts(frame, body)))]
        };
        self.partners.iter().map(slot).collect()
    }

    /// The sum of the finger forces at each frame, N.
    fn forces(&self, track: &HandTrack) -> Vec<Vector3<f64>> {
        let forces: Vec<[&[f64]; 3]> = Finger::ALL
            .iter()
            .filter_map(|finger| self.measured.vec3(&format!("{}.{finger}.force", track.side)))
            .collect();
        (0..self.measured.len()).map(|frame| forces.iter().map(|force| vector(force, frame)).sum()).collect()
    }

    /// The targets of both hands, left first, where they differ.
    fn both_targets(&self, frame: usize) -> Option<(usize, usize)> {
        let target =
            |side: Side| self.tracks.iter().find(|track| track.side == side)?.target.get(frame).copied().flatten();
        target(Side::Left).zip(target(Side::Right)).filter(|(left, right)| left != right)
    }

    /// Speed at which one target's depth in the other grows, m/s; 0 while neither is in the other.
    fn closing(&self) -> Vec<f64> {
        let into = |frame: usize, body: usize, other: usize| {
            let socket = self.plugged.get(&body)?.socket.get(frame).copied().flatten()?;
            (self.sockets.get(socket)?.body == other).then(|| self.plugged.get(&body)?.rate.get(frame).copied())?
        };
        let at = |frame: usize| {
            self.both_targets(frame)
                .and_then(|(left, right)| into(frame, left, right).or_else(|| into(frame, right, left)))
        };
        (0..self.measured.len()).map(|frame| at(frame).unwrap_or_default()).collect()
    }

    fn targets_contact(&self) -> Vec<f64> {
        let mut flags = vec![0.0; self.measured.len()];
        self.measured.follow("targets touch", |frame, was| {
            let contact = self.both_targets(frame).and_then(|pair| self.contacts.get(&pair));
            let touching = contact.is_some_and(|contact| contact.touching(frame, was.on));
            if let Some(value) = flags.get_mut(frame) {
                *value = flag(touching);
            }
            State { on: touching, ..was }
        });
        flags
    }
}

/// Rows of components as columns.
fn columns<const N: usize>(rows: impl Iterator<Item = [f64; N]>) -> Vec<Vec<f64>> {
    let mut columns = vec![Vec::with_capacity(rows.size_hint().0); N];
    for row in rows {
        for (column, value) in columns.iter_mut().zip(row) {
            column.push(value);
        }
    }
    columns
}

fn flag(yes: bool) -> f64 {
    f64::from(u8::from(yes))
}
