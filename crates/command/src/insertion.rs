//! Insertions along the axis of the hole. The operator slides the object on the rim and searches the hole by touch (the paper, section 2.1: such error is
//! inadvertent); a robot sees the hole. Near the hole the commanded object is therefore aligned with the axis. It stays a little above the rim until the
//! operator has found the hole, and then follows the operator's depth and speed. The forces remain those of carrying, because nothing pushes back there.

use super::RATE_HZ;
use super::schema::HoleBody;
use super::series::{Episode, EpisodeSegment, Series, pose_array};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use teachtree_base::easing::smooth_step;
use teachtree_base::geometry::{Solid, perpendiculars};
use teachtree_base::meaning::Meaning;
use teachtree_base::recording::Recording;
use teachtree_base::scene::{Role, Scene};
use teachtree_base::socket::{PlugInSocket, SocketFrame};

/// Below the first height above the rim the object is on the axis; above the second one it follows the operator's path, m.
const OVER_M: f64 = 0.008;
const ON_ITS_WAY_M: f64 = 0.030;
/// The alignment is complete if the plug point is within the radius plus this distance from the axis, m, and zero if it is farther by the second distance. A
/// shorter transition would pull the object out of the hand.
const BESIDE_M: f64 = 0.010;
const COMES_M: f64 = 0.060;
/// Maximum displacement of a static body during an insertion into its hole, m.
const STANDS_M: f64 = 0.005;
/// The height above the rim at which the object waits, m.
const WAITS_M: f64 = 0.005;
/// The time from there to the operator's depth, s.
const CATCHES_UP_S: f64 = 0.4;
/// Depths below the rim at which the width of a hole is measured, m; the deeper ones serve pegs that begin below the rim. The width is measured along
/// `RAYS` directions; a search along a direction has a maximum number of steps, ends at a distance from a wall, m, and ignores walls farther away, m.
const BEHIND_M: [f64; 3] = [0.003, 0.012, 0.024];
const RAYS: u32 = 32;
const MARCHES: usize = 60;
const ON_SURFACE_M: f64 = 1e-6;
const FAR_M: f64 = 0.200;
/// Maximum angle between an axis of the object and the axis of the socket if they correspond, rad.
const UPRIGHT_RAD: f64 = 0.1;

/// A hole, in the frame of its body.
struct Hole<'a> {
    body: &'a str,
    frame: SocketFrame,
    /// Radius, m.
    radius: f64,
    threaded: bool,
    /// The pose of its body, if that is fixed.
    fixed: Option<Isometry3<f64>>,
}

/// A hole at its pose at a time, reference frame.
struct HolePose {
    frame: SocketFrame,
    radius: f64,
}

/// Another object with the hole of an insertion.
pub(super) struct HoleEntry {
    pub(super) body: String,
    /// The start of the insertion, s of the recording.
    pub(super) since_s: f64,
    /// The pose of that object during the insertion; `None` if it moved.
    pub(super) into: Option<HoleBody>,
}

/// Straightens the path of the object into a hole in all episodes with an insertion. Returns the last other object with such a hole.
pub(super) fn align_with_hole(
    series: &mut Series,
    recording: &Recording,
    name: &str,
    episodes: &[Episode],
) -> Option<HoleEntry> {
    let scene = &recording.scene;
    let plug = scene.bodies.get(name)?.plug_point();
    let holes = holes(scene, name);
    let ways: Vec<Vec<Isometry3<f64>>> = holes
        .iter()
        .map(|hole| match hole.fixed {
            Some(pose) => vec![pose; series.len()],
            None => series.other(recording, hole.body).unwrap_or_default(),
        })
        .collect();
    let mut entered = None;
    for episode in episodes {
        let inserts = |piece: &&EpisodeSegment| piece.does == Meaning::Insert;
        let Some(first) = episode.pieces.iter().position(|piece| inserts(&piece)) else { continue };
        // Two hands that fit two objects in the air alternate between Insert and Fit.
        let going_in = episode.pieces[first..].iter().take_while(|piece| inserts(piece) || piece.does == Meaning::Fit);
        let deepest = going_in.filter(inserts).filter_map(|piece| piece.samples.last()).last();
        let Some(&deepest) = deepest else { continue };
        let end = series.object[deepest];
        let begins = episode.pieces[first].samples[0];
        let takes = |hole: &Hole<'_>, way: &[Isometry3<f64>]| {
            way.get(deepest).is_some_and(|pose| hole.at(pose).holds(&end, &plug))
        };
        let mut found = holes.iter().zip(&ways).filter(|(hole, way)| takes(hole, way));
        let Some((hole, way)) = found.next() else { continue };
        let Some(upright) = upright(&end, &hole.at(&way[deepest]).frame.axis) else { continue };
        // If both hands move their objects, neither waits for the hole of the other one.
        let stands = (way[deepest].translation.vector - way[begins].translation.vector).norm() < STANDS_M;
        if hole.fixed.is_none() {
            let into = stands.then(|| HoleBody { body: hole.body.into(), pose: pose_array(&way[deepest]) });
            entered = Some(HoleEntry { body: hole.body.into(), since_s: series.time_s(begins), into });
        }
        let held: Vec<usize> = episode
            .pieces
            .iter()
            .filter(|piece| piece.touching && piece.does != Meaning::Close)
            .flat_map(|piece| piece.samples.iter().copied())
            .filter(|&at| at <= deepest)
            .collect();
        let mut carried = held.first().copied();
        let found = hole.at(&way[begins]).seen(&series.object[begins], &plug).height;
        for at in held {
            let hole = hole.at(&way[at]);
            let demonstrated = series.object[at];
            let seen = hole.seen(&demonstrated, &plug);
            let weight = hole.nearness(&seen);
            if weight == 0.0 {
                carried = Some(at);
            }
            if let Some(carried) = carried {
                series.fingers.iter_mut().for_each(|finger| finger.wanted_force[at] = finger.force[carried]);
            }
            let turned = UnitQuaternion::rotation_between(&(demonstrated.rotation * upright), &hole.frame.axis)
                .unwrap_or_else(UnitQuaternion::identity);
            let rotation = turned.powf(weight) * demonstrated.rotation;
            let height = if at < begins {
                seen.height + (WAITS_M - seen.height).max(0.0) * weight
            } else {
                let since = (at - begins) as f64 / RATE_HZ;
                seen.height + (WAITS_M - found) * (1.0 - smooth_step(since / CATCHES_UP_S))
            };
            let point = hole.frame.rim + hole.frame.axis * height + seen.beside * (1.0 - weight);
            series.wanted[at] =
                Isometry3::from_parts(Translation3::from(point.coords - rotation * plug.coords), rotation);
        }
        // Later samples continue from there.
        let shift = series.wanted[deepest] * end.inverse();
        let after = episode.pieces.iter().flat_map(|piece| piece.samples.iter().copied());
        for at in after.filter(|&at| at > deepest) {
            let pose = shift * series.object[at];
            let hole = hole.at(&way[at]);
            let weight = hole.nearness(&hole.seen(&pose, &plug));
            let turned = UnitQuaternion::rotation_between(&(pose.rotation * upright), &hole.frame.axis)
                .unwrap_or_else(UnitQuaternion::identity);
            series.wanted[at] = Isometry3::from_parts(pose.translation, turned.powf(weight) * pose.rotation);
        }
    }
    entered
}

/// A hole without a thread, with an object in it; reference frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HoleGeometry {
    /// The position of the object's plug point at the rim.
    pub rim: Point3<f64>,
    /// The outward axis, unit.
    pub axis: Vector3<f64>,
    /// The plug point, frame of the object.
    pub plug: Point3<f64>,
    /// The clearance on each side, m; `None` if shapes do not determine it.
    pub clearance: Option<f64>,
}

/// Returns the hole without a thread in which an object is at this pose, if any. `now` returns the poses of other objects with holes.
pub fn hole_of(
    scene: &Scene,
    name: &str,
    object: &Isometry3<f64>,
    now: &dyn Fn(&str) -> Option<Isometry3<f64>>,
) -> Option<HoleGeometry> {
    let plug = scene.bodies.get(name)?.plug_point();
    let holes = holes(scene, name);
    let mut places = holes.iter().filter(|hole| !hole.threaded).filter_map(|hole| {
        let pose = hole.fixed.or_else(|| now(hole.body))?;
        Some((hole, hole.at(&pose)))
    });
    let (hole, place) = places.find(|(_, place)| place.holds(object, &plug))?;
    let own = object.inverse_transform_vector(&place.frame.axis);
    let clearance = clearance(scene, (hole.body, &hole.frame.rim, &hole.frame.axis), (name, &plug, &own));
    Some(HoleGeometry { rim: place.frame.rim, axis: place.frame.axis, plug, clearance })
}

/// Returns the clearance of a hole on each side, m. Shapes are sampled just below the rim, solid ones from within. The roles are exchanged for a hollow object
/// on a pole. Each argument has a body, a point of its axis, and the axis.
fn clearance(
    scene: &Scene,
    hole: (&str, &Point3<f64>, &Vector3<f64>),
    plug: (&str, &Point3<f64>, &Vector3<f64>),
) -> Option<f64> {
    let radius = |(name, point, inwards): (&str, &Point3<f64>, &Vector3<f64>), behind_m: f64| {
        let solid = Solid::new(scene.bodies.get(name)?);
        radius_about(&solid, &(point + inwards * behind_m), inwards)
    };
    let (plug, plug_is_solid) = radius(plug, BEHIND_M[0])?;
    BEHIND_M.into_iter().find_map(|behind_m| {
        let (hole, hole_is_solid) = radius((hole.0, hole.1, &-hole.2), behind_m)?;
        let wider = if hole_is_solid { plug - hole } else { hole - plug };
        (hole_is_solid != plug_is_solid && wider > 0.0).then_some(wider)
    })
}

/// Returns the distance of the surface from a point perpendicular to an axis, m, and whether the point is in the body.
fn radius_about(solid: &Solid, point: &Point3<f64>, axis: &Vector3<f64>) -> Option<(f64, bool)> {
    let inside = solid.distance(point) < 0.0;
    let [one, other] = perpendiculars(axis);
    let mut nearest = f64::INFINITY;
    for ray in 0..RAYS {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(ray) / f64::from(RAYS)).sin_cos();
        let way = one * cos + other * sin;
        // A step of the length of the distance does not cross the surface.
        let mut gone = 0.0;
        for _ in 0..MARCHES {
            let left = solid.distance(&(point + way * gone)) * if inside { -1.0 } else { 1.0 };
            gone += left.max(0.0);
            if left < ON_SURFACE_M || gone > nearest {
                break;
            }
        }
        nearest = nearest.min(gone);
    }
    (nearest < FAR_M).then_some((nearest, inside))
}

/// Returns the holes for this object: those of fixed bodies and of other objects.
fn holes<'a>(scene: &'a Scene, object: &str) -> Vec<Hole<'a>> {
    let with_holes = scene
        .bodies
        .iter()
        .filter(|(name, body)| body.role == Role::Socket || body.role == Role::Object && name.as_str() != object);
    with_holes
        .flat_map(|(name, body)| {
            let fixed = body.pose();
            let sockets = body.sockets.values().filter(|socket| socket.takes(object));
            sockets.map(move |socket| Hole {
                body: name,
                frame: socket.frame(),
                radius: socket.radius.0,
                threaded: socket.pitch.is_some(),
                fixed: (body.role == Role::Socket).then_some(fixed),
            })
        })
        .collect()
}

impl Hole<'_> {
    /// Returns the hole for a pose of its body.
    fn at(&self, body: &Isometry3<f64>) -> HolePose {
        HolePose { frame: self.frame.placed(body), radius: self.radius }
    }
}

impl HolePose {
    /// Whether an object at this pose is in it.
    fn holds(&self, object: &Isometry3<f64>, plug: &Point3<f64>) -> bool {
        let seen = self.seen(object, plug);
        seen.height < 0.0 && seen.beside.norm() < self.radius + BESIDE_M
    }

    fn seen(&self, object: &Isometry3<f64>, plug: &Point3<f64>) -> PlugInSocket {
        self.frame.see(&(object * plug))
    }

    /// Returns the degree of alignment: 0 far away, 1 in the hole and just above it.
    fn nearness(&self, seen: &PlugInSocket) -> f64 {
        let above = smooth_step((ON_ITS_WAY_M - seen.height) / (ON_ITS_WAY_M - OVER_M));
        let beside = (self.radius + BESIDE_M + COMES_M - seen.beside.norm()) / COMES_M;
        above * smooth_step(beside)
    }
}

/// Returns the axis of the object that is parallel to `axis` in the hole: the nearest coordinate axis, if one is near. `None` for an invalid pose.
fn upright(end: &Isometry3<f64>, axis: &Vector3<f64>) -> Option<Vector3<f64>> {
    let seen = end.rotation.inverse_transform_vector(axis).try_normalize(1e-9)?;
    let own = [Vector3::x(), Vector3::y(), Vector3::z()].into_iter().flat_map(|own| [own, -own]);
    Some(own.into_iter().find(|own| own.angle(&seen) < UPRIGHT_RAD).unwrap_or(seen))
}
