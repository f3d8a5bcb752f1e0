//! Facts about a hand and its object in each millisecond: contacts of the solver, forces without noise, and displacements over a quarter of a second,
//! which is longer than a period of tremor.

use super::series::{debounce, means, runs, strokes};
use super::world_state::WorldState;
use crate::sockets::{SocketSite, places};
use nalgebra::{Point3, Vector3};
use std::ops::Range;
use teachtree_base::hands::Finger;
use teachtree_base::scene::{Role, Scene};

/// Coefficient of static friction of the fingertips, for the minimum squeeze that can carry the object.
const FINGERTIP_FRICTION: f64 = 1.0;
/// Half of the time over which displacements are measured, ms.
const AROUND: usize = 125;
/// The minimum speed of a moving object, m/s, and the minimum angular speed of a turning one, rad/s.
const MOVES: f64 = 0.010;
const TURNS: f64 = 0.2;
/// A hand is near an object when the distance between the middle of its fingertips and the object's bounding ball is below the first value, m, and until it is
/// above the second one.
const NEAR_M: f64 = 0.050;
const STAYS_NEAR_M: f64 = 0.070;
/// A hand returns to an object, or to where it let go, when it comes this much closer, m.
const RETURN_M: f64 = 0.015;
/// Another object becomes the target if it is nearer by this, m.
const NEARER_BY_M: f64 = 0.010;
/// An object is in a socket when its plug point is this far below the rim, m.
const INSIDE_M: f64 = 0.001;
/// Minimum change of a plug's depth (without tremor) in one direction that counts as an insertion or extraction, m, at any speed. The motion starts at
/// `RESTS_WITHIN_M` from the resting depth. A plug less deep than a stroke enters from outside or leaves.
const STROKE_M: f64 = 0.002;
const RESTS_WITHIN_M: f64 = 0.0005;
/// A plug searches for its socket if its distance from the hole and its heights below and above the rim are within these values, m.
const SEARCH_BESIDE_M: f64 = 0.020;
const SEARCH_BELOW_M: f64 = 0.005;
const SEARCH_ABOVE_M: f64 = 0.030;
/// The minimum force with which fingers press an object down, N, multiplied by the scale of the forces.
const PRESSES_N: f64 = 0.8;
/// Interruptions of a contact shorter than a period of tremor, ms, are bridged; contacts shorter than `BLIP` do not count.
const BRIDGE: usize = 130;
const BLIP: usize = 20;
/// An object that moves less, m, or turns less, rad, was bumped; an object that is pushed less was nudged.
const BUMP_M: f64 = 0.002;
const BUMP_RAD: f64 = 0.14;
const NUDGE_M: f64 = 0.015;
/// Minimum duration of an opening or closing of a grip, ms.
const GRIP: usize = 60;

/// The facts of one hand at one instant. Fields without another subject are about its object.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Facts {
    /// Index of the object in the scene.
    pub(super) target: usize,
    /// The sum of the fingers' forces on it, N.
    pub(super) force: Vector3<f64>,
    /// Whether it touches the object of the other hand, and whether it is in a socket of that object.
    pub(super) meets: bool,
    pub(super) mated: bool,
    /// Number of fingers on the object.
    pub(super) fingers: usize,
    /// Whether the hand is near the object; whether it comes closer again after it has let go.
    pub(super) near: bool,
    pub(super) returns: bool,
    /// Whether the squeeze can carry its weight.
    pub(super) held: bool,
    /// Whether a body supports it. The rim of a socket that it searches does not count.
    pub(super) carried_by: bool,
    /// Whether it touches a body that does not support it.
    pub(super) beside: bool,
    /// Whether it moves; whether it moves along its support; whether it moves along a body beside it.
    pub(super) moving: bool,
    pub(super) sliding: bool,
    pub(super) along: bool,
    /// Whether it is in a socket; whether that socket has a thread.
    pub(super) inside: bool,
    pub(super) threaded: bool,
    /// Depth of the plug point in the socket, m.
    depth: Option<f64>,
    /// Whether it moves into the socket; whether it moves out.
    pub(super) sinking: bool,
    pub(super) rising: bool,
    /// Whether it turns about the axis of its socket, or about the vertical.
    pub(super) turning: bool,
    /// Whether the fingers press it down.
    pub(super) pressed: bool,
    /// Its speed, m/s, and angular speed, rad/s.
    pub(super) speed: f64,
    pub(super) spin: f64,
}

/// Returns the facts of a hand at every moment.
pub(super) fn facts(scene: &Scene, hand: usize, moments: &[WorldState], force_scale: f64) -> Vec<Facts> {
    let targets = targets(scene, hand, moments);
    let places = places(scene);
    let view = FactInputs { scene, hand, moments, places: &places, presses: PRESSES_N * force_scale };
    let mut facts: Vec<Facts> =
        targets.iter().enumerate().map(|(index, &target)| view.facts(index, target).unwrap_or_default()).collect();
    let (mut near, mut of) = (false, usize::MAX);
    for (index, &target) in targets.iter().enumerate() {
        let within = if near && of == target { STAYS_NEAR_M } else { NEAR_M };
        (near, of) = (view.distance(index, target).is_some_and(|distance| distance <= within), target);
        facts[index].near = near;
    }
    for finger in 0..moments.first().map_or(0, |moment| moment.hands[hand].len()) {
        let mut on: Vec<bool> = moments
            .iter()
            .zip(&targets)
            .map(|(moment, &target)| moment.hands[hand][finger].force_on(target).is_some())
            .collect();
        debounce(&mut on, BRIDGE, 0);
        facts.iter_mut().zip(on).for_each(|(facts, on)| facts.fingers += usize::from(on));
    }
    view.derive_returns(&mut facts);
    for (of, bridge, blip) in CLEANED {
        let mut series: Vec<bool> = facts.iter_mut().map(|facts| *of(facts)).collect();
        debounce(&mut series, *bridge, *blip);
        facts.iter_mut().zip(series).for_each(|(facts, value)| *of(facts) = value);
    }
    derive_insertions(&mut facts);
    for MotionFilter { moves, when, way, least } in LEADING {
        let series: Vec<bool> = facts.iter_mut().map(|facts| when(facts) && *moves(facts)).collect();
        for run in runs(&series).into_iter().filter(|run| series[run.start]) {
            if facts[run.clone()].iter().map(way).sum::<f64>() / 1000.0 < *least {
                facts[run].iter_mut().for_each(|facts| *moves(facts) = false);
            }
        }
    }
    facts
}

/// Derives insertions and extractions from the depth alone, so that slow motions count. Shorter motions are derived from the speed, and motions in a thread
/// from the rotation.
fn derive_insertions(facts: &mut [Facts]) {
    let socket = |facts: &Facts| (facts.inside && !facts.threaded).then_some(facts.target);
    let sockets: Vec<Option<usize>> = facts.iter().map(socket).collect();
    for run in runs(&sockets).into_iter().filter(|run| sockets[run.start].is_some()) {
        let mut last = facts[run.start].depth.unwrap_or(INSIDE_M);
        let depths: Vec<f64> = facts[run.clone()]
            .iter()
            .map(|facts| {
                last = facts.depth.unwrap_or(last);
                last
            })
            .collect();
        let depths = means(&depths, AROUND);
        for (stroke, sinks) in strokes(&depths, STROKE_M) {
            let from = depths[stroke.start];
            let rests = |at: &usize| from > STROKE_M && (depths[*at] - from).abs() < RESTS_WITHIN_M;
            let begins = stroke.clone().rev().find(rests).unwrap_or(stroke.start);
            for facts in &mut facts[run.start + begins..run.start + stroke.end] {
                (facts.sinking, facts.rising) = (sinks, !sinks);
            }
        }
    }
}

/// A filter for motions that are too short: a hand that grasps or releases an object bumps it.
struct MotionFilter {
    moves: fn(&mut Facts) -> &mut bool,
    /// The condition under which the filter applies.
    when: fn(&Facts) -> bool,
    /// The speed of the motion, and its minimum distance.
    way: fn(&Facts) -> f64,
    least: f64,
}

const LEADING: &[MotionFilter] = &[
    MotionFilter {
        moves: |facts| &mut facts.moving,
        when: |facts| facts.fingers > 0 && !facts.held,
        way: |facts| facts.speed,
        least: NUDGE_M,
    },
    MotionFilter {
        moves: |facts| &mut facts.sliding,
        when: |facts| facts.held && facts.carried_by,
        way: |facts| facts.speed,
        least: BUMP_M,
    },
    MotionFilter {
        moves: |facts| &mut facts.along,
        when: |facts| facts.held && facts.beside,
        way: |facts| facts.speed,
        least: BUMP_M,
    },
    MotionFilter {
        moves: |facts| &mut facts.turning,
        when: |facts| facts.held,
        way: |facts| facts.spin,
        least: BUMP_RAD,
    },
];

/// A condition, the longest gap that is bridged, and the shortest interval that stays, ms.
type DebounceRule = (fn(&mut Facts) -> &mut bool, usize, usize);
const CLEANED: &[DebounceRule] = &[
    (|facts| &mut facts.held, GRIP, GRIP),
    (|facts| &mut facts.carried_by, BRIDGE, BLIP),
    (|facts| &mut facts.beside, BRIDGE, BLIP),
    (|facts| &mut facts.moving, BRIDGE, GRIP),
    (|facts| &mut facts.sliding, BRIDGE, GRIP),
    (|facts| &mut facts.along, BRIDGE, GRIP),
    (|facts| &mut facts.inside, BRIDGE, GRIP),
    (|facts| &mut facts.meets, BRIDGE, BLIP),
    (|facts| &mut facts.mated, BRIDGE, GRIP),
    (|facts| &mut facts.turning, BRIDGE, GRIP),
    (|facts| &mut facts.pressed, BRIDGE, 2 * BRIDGE),
];

/// Returns the target object of a hand: the touched object, else the nearest one.
fn targets(scene: &Scene, hand: usize, moments: &[WorldState]) -> Vec<usize> {
    let objects: Vec<usize> = (0..scene.bodies.len()).filter(|&body| scene.bodies[body].role == Role::Object).collect();
    let mut target = usize::MAX;
    let of_moment = |moment: &WorldState| {
        let touched = |object: usize| moment.hands[hand].iter().any(|tip| tip.force_on(object).is_some());
        if !touched(target) {
            let distance = |object: &usize| moment.distance(hand, &scene.bodies[*object], *object);
            // Between two objects at the same distance the target does not change.
            let to_go = |object: &usize| distance(object) - if *object == target { NEARER_BY_M } else { 0.0 };
            let nearest = || objects.iter().copied().min_by(|a, b| to_go(a).total_cmp(&to_go(b)));
            target = objects.iter().copied().find(|&object| touched(object)).or_else(nearest).unwrap_or(usize::MAX);
        }
        target
    };
    moments.iter().map(of_moment).collect()
}

/// The inputs of the facts.
struct FactInputs<'a> {
    scene: &'a Scene,
    hand: usize,
    moments: &'a [WorldState],
    places: &'a [SocketSite],
    /// The minimum force with which fingers press an object down, N.
    presses: f64,
}

impl FactInputs<'_> {
    fn facts(&self, index: usize, target: usize) -> Option<Facts> {
        let (_, body) = self.scene.bodies.get_index(target)?;
        let moment = self.moments.get(index)?;
        let tips = &moment.hands[self.hand];
        let forces: Vec<(Finger, Vector3<f64>)> =
            tips.iter().filter_map(|tip| Some((tip.finger, tip.force_on(target)?))).collect();
        let total: Vector3<f64> = forces.iter().map(|(_, force)| force).sum();
        let squeeze = (forces.iter().map(|(_, force)| force.norm()).sum::<f64>() - total.norm()) / 2.0;
        let gravity = Vector3::from(self.scene.gravity.map(|part| part.0));
        let weight = body.mass.map_or(0.0, |mass| mass.0) * gravity.norm();
        let up = -gravity.try_normalize(1e-9).unwrap_or_default();
        let thumb = forces.iter().any(|(finger, _)| *finger == Finger::Thumb);

        let (before, after, seconds) = self.around(index)?;
        let moved = |body: usize| {
            let at = |moment: &WorldState| moment.bodies[body].pose.translation.vector;
            (at(after) - at(before)) / seconds
        };
        let velocity = moved(target);
        let turned = after.bodies[target].pose.rotation * before.bodies[target].pose.rotation.inverse();
        let mut axis = up;
        let mut facts = Facts {
            target,
            force: total,
            held: thumb && forces.len() > 1 && squeeze >= weight / 2.0 / FINGERTIP_FRICTION,
            moving: velocity.norm() > MOVES,
            sliding: (velocity - up * velocity.dot(&up)).norm() > MOVES,
            pressed: self.pressed_down(index, target, &up) > self.presses,
            speed: velocity.norm(),
            ..Facts::default()
        };
        let others = || moment.hands.iter().enumerate().filter(|(hand, _)| *hand != self.hand);
        let is_object = |body: usize| self.scene.bodies.get_index(body).is_some_and(|(_, it)| it.role == Role::Object);
        let touched = |body: usize| others().any(|(_, tips)| tips.iter().any(|tip| tip.force_on(body).is_some()));
        let handled = |body: usize| is_object(body) && touched(body);
        // A body that is plugged into the object is a part of it.
        let plugged = |body: usize| {
            let places = self.places.iter().filter(|place| place.body == target);
            places
                .filter_map(|place| Some((place, place.plug(body, &moment.bodies)?)))
                .any(|(place, plug)| place.holds(&plug))
        };
        let mut searched = None;
        for place in self.places {
            let Some(plug) = place.plug(target, &moment.bodies) else { continue };
            let beside = plug.beside.norm() <= place.socket.radius.0 + SEARCH_BESIDE_M;
            if beside && (-SEARCH_BELOW_M..=SEARCH_ABOVE_M).contains(&plug.height) {
                searched = Some(place.body);
            }
            if place.holds(&plug) && plug.height < -INSIDE_M {
                let height = |moment: &WorldState| place.plug(target, &moment.bodies).map_or(0.0, |plug| plug.height);
                let rate = (height(after) - height(before)) / seconds;
                axis = plug.axis;
                (facts.inside, facts.depth) = (true, Some(-plug.height));
                facts.threaded = place.socket.pitch.is_some();
                facts.mated = handled(place.body);
                (facts.sinking, facts.rising) = (rate < -MOVES, rate > MOVES);
            }
        }
        facts.spin = turned.scaled_axis().dot(&axis).abs() / seconds;
        facts.turning = facts.spin > TURNS;
        for (other, normal) in moment.contacts_of(target).filter(|(other, _)| facts.inside || Some(*other) != searched)
        {
            // The object of the other hand and plugged-in bodies are neither supports nor bodies beside the object.
            if handled(other) {
                facts.meets = true;
            } else if plugged(other) {
                continue;
            } else if normal.dot(&up) >= std::f64::consts::FRAC_1_SQRT_2 {
                facts.carried_by = true;
            } else {
                let relative = velocity - moved(other);
                facts.beside = true;
                facts.along |= (relative - normal * relative.dot(&normal)).norm() > MOVES;
            }
        }
        Some(facts)
    }

    /// Derives the times in which a free hand comes closer to an object, or to where it let go, by `RETURN_M` or more.
    fn derive_returns(&self, facts: &mut [Facts]) {
        let free: Vec<Option<usize>> = facts.iter().map(|facts| (facts.fingers == 0).then_some(facts.target)).collect();
        for run in runs(&free) {
            let Some(target) = free[run.start] else { continue };
            let start = self.moments[run.start].middle(self.hand);
            let from_object = run.clone().map(|at| self.distance(at, target).unwrap_or(f64::INFINITY)).collect();
            let from_start = run.clone().map(|at| (self.moments[at].middle(self.hand) - start).norm()).collect();
            let ways: [Vec<f64>; 2] = [from_object, from_start];
            let comes = |(stroke, grows): &(Range<usize>, bool)| !grows && ways[1][stroke.start] > RETURN_M;
            for (stroke, _) in ways.iter().flat_map(|way| strokes(way, RETURN_M)).filter(comes) {
                facts[run.start + stroke.start..run.start + stroke.end]
                    .iter_mut()
                    .for_each(|facts| facts.returns = true);
            }
        }
    }

    /// Returns the distance between the middle of the fingertips and the object's bounding ball, m.
    fn distance(&self, index: usize, target: usize) -> Option<f64> {
        let (_, body) = self.scene.bodies.get_index(target)?;
        let moment = self.moments.get(index)?;
        let position = Point3::from(moment.bodies.get(target)?.pose.translation.vector);
        Some((moment.middle(self.hand) - position).norm() - body.bounding_radius())
    }

    /// Returns the moments before and after, and the time between them, s.
    fn around(&self, index: usize) -> Option<(&WorldState, &WorldState, f64)> {
        let (before, after) = (index.saturating_sub(AROUND), (index + AROUND).min(self.moments.len().checked_sub(1)?));
        Some((self.moments.get(before)?, self.moments.get(after)?, (after - before).max(1) as f64 / 1000.0))
    }

    /// Returns the mean downward force of the fingers on the object over a period of tremor, N.
    fn pressed_down(&self, index: usize, target: usize, up: &Vector3<f64>) -> f64 {
        let end = (index + BRIDGE / 2).min(self.moments.len());
        let around = &self.moments[index.saturating_sub(BRIDGE / 2)..end];
        let force = |moment: &WorldState| -> Vector3<f64> {
            moment.hands[self.hand].iter().filter_map(|tip| tip.force_on(target)).sum()
        };
        // Every tenth millisecond suffices for a mean.
        let some = || around.iter().step_by(10);
        -some().map(|moment| force(moment).dot(up)).sum::<f64>() / some().count().max(1) as f64
    }
}
