//! Which flagged contacts with a support carry an object. A flag contains no direction, and the role of a body shows what it may do, not what it does in a
//! contact: a log may name the links of a robot like its table.
//!
//! - Where an object has rested in the contact untouched by hands, the other body carries it, and does so again at such a height. Between two directions `u`
//!   of up in its own frame, the height of the origin of an object above a level surface changes by at most its radius times `|u - u'|`.
//! - An object that hands never leave in the contact is carried near the least height of the contacts so far: what it takes along does not carry it.
//! - What is fixed to a hand, or touches a body that moves or is above it, is not carried by that body unless it has rested there.

use super::hands::HandTrack;
use super::motion::Motion;
use crate::clean::preprocess::{CleanLog, FlaggedSupport, State, SupportLevel};
use nalgebra::Vector3;

/// An object slower than this rests, m/s.
const RESTS: f64 = 5e-3;
/// How far heights of one contact may differ, m: flags begin early, and surfaces yield.
const LEVEL: f64 = 0.020;
/// Levels nearer than this are one, m.
const SAME: f64 = 0.005;
/// The most levels of an object on a body.
const LEVELS: usize = 64;
/// A body that gets farther than this moves, m.
const MOVES: f64 = 0.020;

/// An object and a support whose contact is known as a flag.
pub struct RoleSupport<'a> {
    measured: &'a CleanLog<'a>,
    object: (usize, &'a Motion<'a>),
    other: (usize, &'a Motion<'a>),
    /// The radius of the ball that holds the object, m.
    radius: f64,
    /// Whether a hand holds the object all the time.
    is_fixed: bool,
    /// Whether the log has the position of the other body.
    other_is_placed: bool,
}

impl<'a> RoleSupport<'a> {
    /// `None` of bodies that the scene lacks.
    pub fn new(measured: &'a CleanLog, motions: &'a [Motion], (object, other): (usize, usize)) -> Option<Self> {
        let (_, body) = measured.scene.bodies.get_index(object)?;
        let (name, _) = measured.scene.bodies.get_index(other)?;
        Some(Self {
            measured,
            object: (object, motions.get(object)?),
            other: (other, motions.get(other)?),
            radius: body.bounding_radius(),
            is_fixed: body.fixed_to.is_some(),
            other_is_placed: measured.vec3(&format!("{name}.position")).is_some(),
        })
    }

    /// What the whole log shows: the levels at which the object rests in the contact while no hand touches it, and whether the other body moves.
    pub fn learn(&self, tracks: &[HandTrack], flags: &[bool]) -> FlaggedSupport {
        let held = |frame: usize| {
            let holds = |track: &HandTrack| {
                track.touching.get(frame) == Some(&true) && track.target.get(frame) == Some(&Some(self.object.0))
            };
            self.is_fixed || tracks.iter().any(holds)
        };
        let mut levels: Vec<SupportLevel> = vec![];
        for (frame, _) in flags.iter().enumerate().filter(|(_, flag)| **flag) {
            let relative = self.object.1.velocity(frame) - self.other.1.velocity(frame);
            if relative.norm() > RESTS || held(frame) {
                continue;
            }
            let level = self.level(frame);
            if levels.len() < LEVELS && !levels.iter().any(|it| self.is_at(it, &level, SAME)) {
                levels.push(level);
            }
        }
        let start = self.other.1.position(0);
        let moves = (0..flags.len()).any(|frame| (self.other.1.position(frame) - start).norm() > MOVES);
        FlaggedSupport { other: self.other.0, levels, moves: self.other_is_placed && moves }
    }

    /// Whether the other body carries the object, at each frame in which they touch, by what the whole log shows.
    pub fn carries(&self, known: &FlaggedSupport, flags: &[bool]) -> Vec<bool> {
        let mut carries = vec![false; flags.len()];
        let is_free = !self.is_fixed && !known.moves;
        let key = format!("lowest contact {} {}", self.object.0, self.other.0);
        self.measured.follow(&key, |frame, was| {
            if flags.get(frame) != Some(&true) {
                return was;
            }
            let level = self.level(frame);
            let lowest = if was.on { was.way.min(level.height) } else { level.height };
            let near_lowest = is_free && !self.is_below(frame) && level.height - lowest <= LEVEL.max(self.radius);
            let carried = match known.levels.as_slice() {
                [] => near_lowest,
                levels => levels.iter().any(|it| self.is_at(it, &level, LEVEL)),
            };
            if let Some(value) = carries.get_mut(frame) {
                *value = carried;
            }
            State { on: true, which: None, way: lowest }
        });
        carries
    }

    fn level(&self, frame: usize) -> SupportLevel {
        let (object, other) = (self.object.1.pose(frame), self.other.1.position(frame));
        SupportLevel { height: object.translation.z - other.z, up: object.rotation.inverse() * Vector3::z() }
    }

    fn is_at(&self, level: &SupportLevel, found: &SupportLevel, within: f64) -> bool {
        (level.height - found.height).abs() <= within + self.radius * (level.up - found.up).norm()
    }

    /// Whether the object is below the other body.
    fn is_below(&self, frame: usize) -> bool {
        self.other_is_placed && self.object.1.position(frame).z + self.radius < self.other.1.position(frame).z
    }
}
