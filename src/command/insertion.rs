//! Into a fixed socket an object goes along the axis. A person lets it slide about on the rim and feels for the hole (chapter, section 2.1: such error is
//! inadvertent); a robot knows where the hole is. So the nearer the object comes, the more it is brought over the hole and upright, it stays a little
//! above the rim until the person has found the hole, and then goes down as deep and as fast as the person's. Nothing pushes back there, so the forces stay
//! those of carrying it.

use super::RATE_HZ;
use super::episodes::Episode;
use super::series::Series;
use crate::base::geometry::pose;
use crate::base::scene::{Body, Role, Scene};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

/// The object is over the axis when it is as low as this above the rim, and on its way as the person's was when it is higher than that, m.
const OVER_M: f64 = 0.008;
const ON_ITS_WAY_M: f64 = 0.030;
/// Its plug point is about to go in when it is nearer to the axis than the radius and this, m; farther away by this much more, it is not at all. Drawn
/// over the hole on a shorter way, it would be jerked out of the hand.
const BESIDE_M: f64 = 0.010;
const COMES_M: f64 = 0.060;
/// It waits this far above the rim, m.
const WAITS_M: f64 = 0.005;
/// From there it comes to the person's depth within this time, s.
const CATCHES_UP_S: f64 = 0.4;
/// An axis of the object is the one that it has in the socket when they are nearer than this, rad.
const UPRIGHT_RAD: f64 = 0.1;

/// A hole: its rim and its unit direction outwards, reference frame, and its radius, m.
struct Hole {
    rim: Point3<f64>,
    axis: Vector3<f64>,
    radius: f64,
    threaded: bool,
}

/// Where the object's plug point is, seen from a hole.
struct Seen {
    height: f64,
    beside: Vector3<f64>,
}

/// Straightens the way of the object into a socket, in all episodes in which it is inserted.
pub(super) fn along_the_axis(series: &mut Series, scene: &Scene, name: &str, body: &Body, episodes: &[Episode]) {
    let plug = plug_of(body);
    let holes = holes(scene, name);
    for episode in episodes {
        let inserts = |primitive: &str| primitive == "Insert";
        let Some(first) = episode.pieces.iter().position(|piece| inserts(&piece.primitive)) else { continue };
        let Some(&deepest) = episode.pieces[first..]
            .iter()
            .take_while(|piece| inserts(&piece.primitive))
            .filter_map(|piece| piece.samples.last())
            .last()
        else {
            continue;
        };
        let end = series.object[deepest];
        let near = |hole: &&Hole| {
            let seen = hole.seen(&end, &plug);
            seen.height < 0.0 && seen.beside.norm() < hole.radius + BESIDE_M
        };
        let Some(hole) = holes.iter().find(near) else { continue };
        let Some(upright) = upright(&end, &hole.axis) else { continue };
        let begins = episode.pieces[first].samples[0];
        let held: Vec<usize> = episode
            .pieces
            .iter()
            .filter(|piece| piece.touching && piece.primitive != "Grasp")
            .flat_map(|piece| piece.samples.iter().copied())
            .filter(|&at| at <= deepest)
            .collect();
        let mut carried = held.first().copied();
        let found = hole.seen(&series.object[begins], &plug).height;
        for at in held {
            let person = series.object[at];
            let seen = hole.seen(&person, &plug);
            let weight = hole.nearness(&seen);
            if weight == 0.0 {
                carried = Some(at);
            }
            if let Some(carried) = carried {
                series.fingers.iter_mut().for_each(|finger| finger.wanted_force[at] = finger.force[carried]);
            }
            let turned = UnitQuaternion::rotation_between(&(person.rotation * upright), &hole.axis)
                .unwrap_or_else(UnitQuaternion::identity);
            let rotation = turned.powf(weight) * person.rotation;
            let height = if at < begins {
                seen.height + (WAITS_M - seen.height).max(0.0) * weight
            } else {
                let since = (at - begins) as f64 / RATE_HZ;
                seen.height + (WAITS_M - found) * (1.0 - smooth_step(since / CATCHES_UP_S))
            };
            let point = hole.rim + hole.axis * height + seen.beside * (1.0 - weight);
            series.wanted[at] =
                Isometry3::from_parts(Translation3::from(point.coords - rotation * plug.coords), rotation);
        }
        // What follows goes on from there.
        let shift = series.wanted[deepest] * end.inverse();
        let after = episode.pieces.iter().flat_map(|piece| piece.samples.iter().copied());
        for at in after.filter(|&at| at > deepest) {
            series.wanted[at] = shift * series.object[at];
        }
    }
}

/// The axis of the plain hole of a fixed body in which an object is at this pose, unit, outwards, reference frame; `None` when it is in none.
pub fn axis_of_its_hole(scene: &Scene, name: &str, body: &Body, object: &Isometry3<f64>) -> Option<Vector3<f64>> {
    let plug = plug_of(body);
    let holds = |hole: &&Hole| {
        let seen = hole.seen(object, &plug);
        !hole.threaded && seen.height < 0.0 && seen.beside.norm() < hole.radius + BESIDE_M
    };
    holes(scene, name).iter().find(holds).map(|hole| hole.axis)
}

fn plug_of(body: &Body) -> Point3<f64> {
    Point3::from(body.plug.map_or([0.0; 3], |plug| plug.map(|length| length.0)))
}

/// The holes of fixed bodies that take this object.
fn holes(scene: &Scene, object: &str) -> Vec<Hole> {
    let fixed = scene.bodies.values().filter(|body| body.role == Role::Socket);
    let takes = |accepts: &Option<Vec<String>>| {
        accepts.as_ref().is_none_or(|accepted| accepted.iter().any(|name| name == object))
    };
    fixed
        .flat_map(|body| {
            let world_from_body = pose(body.position.map(|length| length.0), body.rotation);
            let sockets = body.sockets.values().filter(|socket| takes(&socket.accepts));
            sockets.map(move |socket| Hole {
                rim: world_from_body * Point3::from(socket.rim.map(|length| length.0)),
                axis: world_from_body.rotation
                    * Vector3::from(socket.axis).try_normalize(1e-9).unwrap_or_else(Vector3::z),
                radius: socket.radius.0,
                threaded: socket.pitch.is_some(),
            })
        })
        .collect()
}

impl Hole {
    fn seen(&self, object: &Isometry3<f64>, plug: &Point3<f64>) -> Seen {
        let from_rim = object * plug - self.rim;
        let height = from_rim.dot(&self.axis);
        Seen { height, beside: from_rim - self.axis * height }
    }

    /// From 0 far away to 1 in the hole and just above it.
    fn nearness(&self, seen: &Seen) -> f64 {
        let above = smooth_step((ON_ITS_WAY_M - seen.height) / (ON_ITS_WAY_M - OVER_M));
        let beside = (self.radius + BESIDE_M + COMES_M - seen.beside.norm()) / COMES_M;
        above * smooth_step(beside)
    }
}

/// The axis of the object that is along `axis` when it is in: one of its own, when one is near. `None` when the pose is none.
fn upright(end: &Isometry3<f64>, axis: &Vector3<f64>) -> Option<Vector3<f64>> {
    let seen = end.rotation.inverse_transform_vector(axis).try_normalize(1e-9)?;
    let own = [Vector3::x(), Vector3::y(), Vector3::z()].into_iter().flat_map(|own| [own, -own]);
    Some(own.into_iter().find(|own| own.angle(&seen) < UPRIGHT_RAD).unwrap_or(seen))
}

/// 3 t² - 2 t³, from 0 at 0 to 1 at 1.
pub(super) fn smooth_step(share: f64) -> f64 {
    let t = share.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
