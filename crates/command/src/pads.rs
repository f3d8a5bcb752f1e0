//! The contacts of two flat pads. A log has the middle of each pad, which may be nearest to a face other than the pressed one. Commanded contacts are points,
//! but pads are areas.

use super::schema::Contact;
use nalgebra::Vector3;
use teachtree_base::geometry::{face_normal, perpendiculars, surface_distance};
use teachtree_base::scene::Body;

/// Faces are opposite when the cosine between their normals is below the negative of this.
const OPPOSITE: f64 = 0.99;
/// Half the length of the pads of jaws, m, and shares of it.
const PAD_M: f64 = 0.015;
const SHARES: [f64; 4] = [1.0, 0.75, 0.5, 0.25];
const SHARES_FROM_MIDDLE: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
/// Maximum distance between the surface and a face's plane at which the face continues, m.
const FLAT_M: f64 = 0.0005;
/// Maximum number of steps of the search for the surface between the pads, and the distance at which it ends, m.
const MARCHES: usize = 100;
const ON_SURFACE_M: f64 = 1e-6;
/// The step of the finite differences for the direction of the surface, m.
const PROBE_M: f64 = 1e-4;

/// Moves two contacts that are not on opposite faces to the intersections of the object with the line between both pads, if the faces there are opposite.
/// `pads` are the middles of the pads, frame of the object, m.
pub(super) fn face_contacts(body: &Body, contacts: &mut [Contact], pads: &[Vector3<f64>]) {
    let ([one, two], [from, to]) = (contacts, pads) else { return };
    if faces(&one.normal.into(), &two.normal.into()) {
        return;
    }
    // The part of a pad in contact may be nearer to the object than its middle.
    let way = to - from;
    let inward = toward(body, &((from + to) / 2.0));
    let inward = inward - way * (inward.dot(&way) / way.norm_squared().max(f64::MIN_POSITIVE));
    let inward = inward.try_normalize(ON_SURFACE_M).unwrap_or_default();
    let met = SHARES_FROM_MIDDLE.into_iter().find_map(|share| {
        let aside = inward * (PAD_M * share);
        let (first, second) = (met(body, &(from + aside), &(to + aside))?, met(body, &(to + aside), &(from + aside))?);
        faces(&first.1, &second.1).then_some([first, second])
    });
    for (contact, (point, normal)) in [one, two].into_iter().zip(met.into_iter().flatten()) {
        (contact.point, contact.normal) = (point.into(), normal.into());
    }
}

/// Returns the direction from a point to the nearest point of a body's surface.
fn toward(body: &Body, from: &Vector3<f64>) -> Vector3<f64> {
    let distance = |off: Vector3<f64>| surface_distance(body, &(from + off).into());
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let part = |axis: Vector3<f64>| distance(-axis * PROBE_M) - distance(axis * PROBE_M);
    axes.into_iter().map(|axis| axis * part(axis)).sum()
}

/// Whether faces with these normals are opposite.
fn faces(normal: &Vector3<f64>, other: &Vector3<f64>) -> bool {
    normal.dot(other) <= -OPPOSITE
}

/// Returns the first intersection of a body's surface with the segment from an outer point to another one, and the normal there; frame of the body.
fn met(body: &Body, from: &Vector3<f64>, to: &Vector3<f64>) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let way = to - from;
    let along = way.try_normalize(ON_SURFACE_M)?;
    let mut gone = 0.0;
    for _ in 0..MARCHES {
        let point = from + along * gone;
        let left = surface_distance(body, &point.into());
        if left < ON_SURFACE_M {
            return Some((point, face_normal(body, &point.into())?));
        }
        gone += left;
        if gone > way.norm() {
            return None;
        }
    }
    None
}

/// Moves two contacts on opposite faces to a common line perpendicular to the faces. The line is halfway between the contacts, shifted towards the middle of
/// the object within the length of the pads and the extent of the faces. Pads prevent rotation about the line between them, but balls of this radius (m) do
/// not.
pub(super) fn opposite(body: &Body, contacts: &mut [Contact], radius: f64) {
    let [one, two] = contacts else { return };
    let normal = Vector3::from(one.normal);
    if !faces(&normal, &two.normal.into()) {
        return;
    }
    let (first, second) = (Vector3::from(one.point), Vector3::from(two.point));
    let half = (second - first) / 2.0;
    let along = half - normal * half.dot(&normal);
    let middle = (first + second) / 2.0;
    let aside = middle - normal * middle.dot(&normal);
    let ends = |nearer: &Vector3<f64>| [(first + along - nearer, normal), (second - along - nearer, -normal)];
    // A ball touches only the face there.
    let lies = |(point, normal): (Vector3<f64>, Vector3<f64>)| {
        let gap = |out: f64| surface_distance(body, &(point + normal * out).into());
        gap(0.0).abs() < FLAT_M && gap(radius) > radius - FLAT_M
    };
    let mut nearer = Vector3::zeros();
    for (direction, length) in perpendiculars(&normal).map(|direction| (direction, aside.dot(&direction))) {
        let shares = SHARES.map(|share| nearer + direction * (length.clamp(-PAD_M, PAD_M) * share));
        nearer = shares.into_iter().find(|nearer| ends(nearer).into_iter().all(lies)).unwrap_or(nearer);
    }
    for (contact, end) in [one, two].into_iter().zip(ends(&nearer)) {
        if lies(end) {
            contact.point = end.0.into();
        }
    }
}
