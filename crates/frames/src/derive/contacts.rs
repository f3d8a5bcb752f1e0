//! The contacts of an object: one for each body that it may touch, from the best available source.
//!
//! 1. The log's forces, `contact.<a>.<b>.force`, read in either orientation.
//! 2. The log's flags, `contact.<a>.<b>`: such a contact bears the object's weight, along a normal from the shapes or from the roles; a support bears it where
//!    the [poses](super::role_support) show that it may.
//! 3. For an object of which the log has no contact at all, shapes and poses ([`touch`](super::touch)).

use super::hands::{HandTrack, finger_feels as feels};
use super::motion::{Columns3, Motion, vector};
use super::role_support::RoleSupport;
use super::source::Source;
use super::touch;
use super::unplaced;
use crate::clean::preprocess::{CleanLog, FlaggedSupport, Touches};
use nalgebra::Vector3;
use std::borrow::Cow;
use std::collections::BTreeMap;
use teachtree_base::contact_threshold;
use teachtree_base::geometry::face_normal;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::scene::{Role, Scene};
use teachtree_logs::issue::{Issue, IssueKind};

/// A force on a contact that is less than this has no direction worth the name, N.
const DIRECTED_ABOVE: f64 = 1e-6;

/// The contact between two bodies over the whole log, as seen by the first; everything in the reference frame.
pub struct Contact<'a> {
    /// Force of the other body on this one, N, if it is known.
    force: Option<Columns3<'a>>,
    /// Unit normal from the other body to this one; zero without contact.
    normal: [Vec<f64>; 3],
    flag: Option<Cow<'a, [f64]>>,
}

/// Contacts by object and other body, as indices in the scene.
pub type Contacts<'a> = BTreeMap<(usize, usize), Contact<'a>>;

impl<'a> Contact<'a> {
    /// A contact that the log does not have: force, normal and flag at each frame.
    pub fn derived(forces: &[Vector3<f64>], normals: impl Iterator<Item = Vector3<f64>>, flags: &[bool]) -> Self {
        let columns =
            |rows: Vec<Vector3<f64>>| [0, 1, 2].map(|axis| rows.iter().map(|row| row[axis]).collect::<Vec<f64>>());
        let flag = flags.iter().map(|flag| f64::from(u8::from(*flag))).collect();
        let (force, normal) = (columns(forces.to_vec()), columns(normals.collect()));
        Self::new(flags.len(), Some(force.map(Cow::Owned)), Some(normal.map(Cow::Owned)), Some(Cow::Owned(flag)))
    }

    fn new(
        frames: usize,
        force: Option<Columns3<'a>>,
        logged_normal: Option<Columns3<'a>>,
        flag: Option<Cow<'a, [f64]>>,
    ) -> Self {
        let normal = directions(frames, logged_normal.as_ref(), force.as_ref());
        Self { force, normal, flag }
    }

    /// The contact between two bodies, if the log has it.
    fn logged(measured: &'a CleanLog, body: &str, other: &str) -> Option<Self> {
        let read = |a: &str, b: &str, is_turned: bool| {
            let name = format!("contact.{a}.{b}");
            let columns = |channel: &str| {
                let seen = |column: &'a [f64]| match is_turned {
                    false => Cow::Borrowed(column),
                    true => Cow::Owned(column.iter().map(|value| -value).collect()),
                };
                measured.vec3(channel).map(|columns| columns.map(seen))
            };
            let (force, flag) = (columns(&format!("{name}.force")), measured.scalar(&name).map(Cow::Borrowed));
            let normal = columns(&format!("{name}.normal"));
            (force.is_some() || flag.is_some()).then(|| Self::new(measured.len(), force, normal, flag))
        };
        read(body, other, false).or_else(|| read(other, body, true))
    }

    /// Whether the log has the force of a contact under this order of the names.
    pub fn is_logged_as(measured: &CleanLog, a: &str, b: &str) -> bool {
        measured.vec3(&format!("contact.{a}.{b}.force")).is_some()
    }

    /// Force of the other body on this one at all frames, reference frame, N.
    pub fn forces(&self) -> Source<'_, 3> {
        self.force.as_ref().map_or(Source::ZERO, Source::from)
    }

    /// Unit normal from the other body to this one at all frames, reference frame: as logged, else the direction of the force; zero without contact.
    pub fn normals(&self) -> Source<'_, 3> {
        Source::from(&self.normal)
    }

    /// Force of the other body on this one, reference frame, N.
    #[inline]
    pub fn force(&self, frame: usize) -> Vector3<f64> {
        self.force.as_ref().map_or_else(Vector3::zeros, |force| vector(force, frame))
    }

    /// Unit normal from the other body to this one, reference frame.
    #[inline]
    pub fn normal(&self, frame: usize) -> Vector3<f64> {
        vector(&self.normal, frame)
    }

    /// Whether the bodies touch at each frame of a log: as logged, else from the force.
    pub fn touching(&self, frame: usize, was: bool) -> bool {
        match self.flag.as_ref().and_then(|flag| flag.get(frame)) {
            Some(flag) => *flag > 0.5,
            None if was => self.force(frame).norm() >= contact_threshold::OFF_N,
            None => self.force(frame).norm() > contact_threshold::ON_N,
        }
    }
}

/// Unit vectors along what is logged as normal, along the force where that has no direction; zero where neither has.
fn directions(frames: usize, normal: Option<&Columns3>, force: Option<&Columns3>) -> [Vec<f64>; 3] {
    let mut directions = [(); 3].map(|()| Vec::with_capacity(frames));
    for frame in 0..frames {
        let along = |columns: Option<&Columns3>, least: f64| vector(columns?, frame).try_normalize(least);
        let direction = along(normal, 1e-6).or_else(|| along(force, DIRECTED_ABOVE)).unwrap_or_else(Vector3::zeros);
        directions.iter_mut().zip(direction.iter()).for_each(|(column, part)| column.push(*part));
    }
    directions
}

/// The contacts of all objects; what the log shows of those that are computed from shapes is put into `learned`.
pub fn contacts<'a>(
    measured: &'a CleanLog,
    motions: &[Motion],
    tracks: &[HandTrack],
    objects: &[usize],
    learned: &mut BTreeMap<usize, Touches>,
) -> Contacts<'a> {
    let name = |body: usize| measured.scene.bodies.get_index(body).map(|(name, _)| name.as_str());
    let mut contacts = Contacts::new();
    for object in objects.iter().copied() {
        let others = (0..measured.scene.bodies.len()).filter(|other| *other != object);
        let logged: Vec<(usize, Contact)> =
            others.filter_map(|other| Some((other, Contact::logged(measured, name(object)?, name(other)?)?))).collect();
        if logged.is_empty() && !unplaced::is_unplaced(measured, object) {
            let derived = touch::contacts(measured, motions, tracks, object, learned);
            contacts.extend(derived.into_iter().map(|(other, contact)| ((object, other), contact)));
        }
        for (other, contact) in logged {
            let contact = match (&contact.force, &contact.flag) {
                (None, Some(flag)) => flagged(measured, motions, tracks, (object, other), flag, &contact, learned),
                _ => contact,
            };
            contacts.insert((object, other), contact);
        }
    }
    contacts
}

/// A contact of which the log has no force: it bears the nominal one along its normal.
fn flagged<'a>(
    measured: &CleanLog,
    motions: &[Motion],
    tracks: &[HandTrack],
    (object, other): (usize, usize),
    flag: &[f64],
    logged: &Contact,
    learned: &mut BTreeMap<usize, Touches>,
) -> Contact<'a> {
    let flags: Vec<bool> = flag.iter().map(|flag| *flag > 0.5).collect();
    let carries = is_support_by_role(measured.scene, (object, other))
        .then(|| carried_by_role(measured, motions, tracks, (object, other), &flags, learned))
        .flatten();
    let normal = |(frame, touches): (usize, &bool)| {
        let known = || logged.normal(frame).try_normalize(1e-6);
        let from_shapes = || touch::gap_at(measured, motions, object, other, frame).map(|gap| gap.normal);
        let from_roles = || match carries.as_ref().and_then(|carries| carries.get(frame)) {
            Some(false) => None,
            _ => normal_by_role(measured, motions, (object, other), frame),
        };
        touches.then(|| known().or_else(from_shapes).or_else(from_roles)).flatten().unwrap_or_else(Vector3::zeros)
    };
    let normals: Vec<Vector3<f64>> = flags.iter().enumerate().map(normal).collect();
    let bears = touch::nominal(measured, object);
    let forces: Vec<Vector3<f64>> = normals.iter().map(|normal| normal * bears).collect();
    Contact::derived(&forces, normals.into_iter(), &flags)
}

/// Whether the direction of a contact that is known as a flag comes from the role of a support: a shape is unknown.
pub fn is_support_by_role(scene: &Scene, (object, other): (usize, usize)) -> bool {
    let body = |body: usize| scene.bodies.get_index(body).map(|(_, body)| body);
    body(object).zip(body(other)).is_some_and(|(object, other)| {
        other.role == Role::Support && (object.parts.is_empty() || other.parts.is_empty())
    })
}

/// The frames in which a support carries an object by a flag; what the log shows of it is put into `learned`, of a window it is known.
fn carried_by_role(
    measured: &CleanLog,
    motions: &[Motion],
    tracks: &[HandTrack],
    (object, other): (usize, usize),
    flags: &[bool],
    learned: &mut BTreeMap<usize, Touches>,
) -> Option<Vec<bool>> {
    let support = RoleSupport::new(measured, motions, (object, other))?;
    let shown = match &measured.window {
        Some(window) => {
            let supports = window.touches.get(&object).map_or(&[][..], |touches| &touches.supports);
            match supports.iter().find(|support| support.other == other) {
                Some(known) => known.clone(),
                // A live log does not contain the later resting pose of an object.
                None if measured.scene.bodies.get_index(object)?.1.fixed_to.is_none() => return None,
                None => FlaggedSupport { other, levels: vec![], moves: false },
            }
        }
        None => {
            let shown = support.learn(tracks, flags);
            learned.entry(object).or_default().supports.push(shown.clone());
            shown
        }
    };
    Some(support.carries(&shown, flags))
}

/// The normal of a contact as far as the roles show: upwards from a support, level from a wall, else out of the other body towards the object.
fn normal_by_role(
    measured: &CleanLog,
    motions: &[Motion],
    (object, other): (usize, usize),
    frame: usize,
) -> Option<Vector3<f64>> {
    let (_, body) = measured.scene.bodies.get_index(other)?;
    let (at, there) = (motions.get(object)?.pose(frame), motions.get(other)?.pose(frame));
    let between = at.translation.vector - there.translation.vector;
    match body.role {
        Role::Support => Some(Vector3::z()),
        Role::Wall => Vector3::new(between.x, between.y, 0.0).try_normalize(1e-9),
        Role::Object | Role::Socket => {
            let point_in_body = there.inverse_transform_point(&at.translation.vector.into());
            let out = face_normal(body, &point_in_body).map(|normal| there.rotation * normal);
            out.or_else(|| between.try_normalize(1e-9))
        }
    }
}

/// Returns an issue for each object whose carrier no channel shows.
pub fn never_carried(measured: &CleanLog, objects: &[usize], contacts: &Contacts) -> Vec<Issue> {
    let body = |index: usize| measured.scene.bodies.get_index(index);
    let carried = |object: usize| {
        contacts
            .keys()
            .filter(|(one, _)| *one == object)
            .any(|(_, other)| body(*other).is_some_and(|(_, it)| it.role != Role::Wall))
    };
    // An object that a hand never releases, or that never leaves its socket, is not set down.
    let fixed = |object: usize| {
        body(object).is_some_and(|(name, it)| {
            let turns =
                |channel: &str| channel.strip_prefix(name.as_str()).is_some_and(|rest| rest.starts_with(".angle."));
            it.fixed_to.is_some() || measured.channels().iter().any(|channel| turns(channel))
        })
    };
    let named = |object: &usize| Some((body(*object)?, unplaced::is_unplaced(measured, *object)));
    let messages = objects.iter().filter(|object| !carried(**object) && !fixed(**object)).filter_map(named).map(
        |((name, it), is_unplaced)| {
            let support = measured.scene.bodies.iter().find(|(_, body)| body.role == Role::Support);
            let support_name = support.map_or("table", |(name, _)| name.as_str());
            let lacking = if is_unplaced {
                format!("`{name}.position` in the log, with the shape of `{name}`")
            } else if it.parts.is_empty() || support.is_none_or(|(_, support)| support.parts.is_empty()) {
                format!("shapes (`parts`) of `{name}` and of its support")
            } else {
                format!("its true position: by its shape, `{name}` never comes near another body")
            };
            let message = format!(
                "{}; expected `contact.{name}.{support_name}` or its force in the log, or {lacking} in the scene",
                without_support(measured, name)
            );
            measured.over_all(IssueKind::NO_SUPPORT, &format!("contact.{name}"), message)
        },
    );
    messages.collect()
}

/// What is found of an object whose support no channel shows. A hand without sensors in its fingers holds what moves with it.
fn without_support(measured: &CleanLog, object: &str) -> String {
    let tips_feel =
        |side: &Side| Finger::ALL.into_iter().any(|finger| finger != Finger::Palm && feels(measured, *side, finger));
    let is_gripper = |side: &Side| measured.scalar(&format!("{side}.gripper.closed")).is_some() && !tips_feel(side);
    let wrist_feels = |side: &Side| feels(measured, *side, Finger::Palm);
    let grippers: Vec<Side> = Side::BOTH.into_iter().filter(is_gripper).collect();
    if grippers.is_empty() && Side::BOTH.iter().any(tips_feel) {
        return format!(
            "no channel shows when `{object}` is carried: Grasp cannot be distinguished from Translate, and Place is not found"
        );
    }
    let found = match (grippers.is_empty(), grippers.iter().any(wrist_feels), Side::BOTH.iter().any(wrist_feels)) {
        (true, _, true) => "Place is not found",
        (_, false, _) => "Translate begins when it moves, and Place is not found",
        (_, true, _) => {
            "Translate begins when it moves, and Place is found only by the force at the wrist, as a change from its value after `off_way` of carrying"
        }
    };
    format!("no channel shows what carries `{object}`: {found}")
}
