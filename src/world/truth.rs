//! Ground truth: what a hand really did, from the world without noise and with the future known. It follows the definitions of the primitives
//! (PAPER.md section 3) on physical facts of its own and shares nothing with the rules: held means that the squeeze could carry the object's
//! weight, contacts are those that the solver made, and flickers shorter than a human act are taken out on both sides of a change.

use super::simulation::Observation;
use crate::base::hands::Finger;
use crate::base::recording::Event;
use crate::base::scene::{Role, Scene};
use nalgebra::{Point3, Vector3};

/// Coefficient of static friction of the fingertips, for the least squeeze that could carry the object.
const FINGERTIP_FRICTION: f64 = 1.0;
/// An object moves from this speed on, m/s.
const MOVES: f64 = 0.0075;
/// A hand is near an object when the middle of its fingertips is within this of the object's bounding ball, m.
const NEAR_M: f64 = 0.050;
/// A contact that is interrupted for less than this many ms goes on, and one shorter than `BLIP` is none.
const BRIDGE: usize = 60;
const BLIP: usize = 20;
/// A push that ends sooner, ms, is a nudge.
const NUDGE: usize = 200;
/// A primitive is not shorter, ms.
const SHORTEST: usize = 50;
/// Fingers leave an object within this time, ms.
const LEAVING: usize = 500;

/// The facts of one millisecond.
pub(super) struct Moment {
    hands: Vec<Vec<Tip>>,
    bodies: Vec<(Point3<f64>, Vector3<f64>)>,
    /// Body, other body, normal from the other to the body, whether they touch.
    contacts: Vec<(usize, usize, Vector3<f64>, bool)>,
}

struct Tip {
    finger: Finger,
    position: Point3<f64>,
    touches: Vec<(usize, Vector3<f64>)>,
}

impl Moment {
    /// The facts of an observation.
    pub(super) fn new(seen: &Observation) -> Self {
        let tips = |tips: &Vec<super::simulation::TipState>| {
            let tip = |tip: &super::simulation::TipState| Tip {
                finger: tip.finger,
                position: tip.position,
                touches: tip.touches.iter().map(|touch| (touch.body, touch.force)).collect(),
            };
            tips.iter().map(tip).collect()
        };
        Self {
            hands: seen.hands.iter().map(|hand| tips(&hand.tips)).collect(),
            bodies: seen.bodies.iter().map(|body| (body.pose.translation.vector.into(), body.velocity)).collect(),
            contacts: seen
                .contacts
                .iter()
                .map(|contact| (contact.body, contact.other, contact.normal, contact.force.norm() > 0.0))
                .collect(),
        }
    }
}

/// The facts of one hand in one millisecond, about the object it deals with.
#[derive(Clone, Copy, Default)]
struct Facts {
    fingers: usize,
    near: bool,
    held: bool,
    carried_by: bool,
    beside: bool,
    moving: bool,
    /// Moving along what carries it; one that is being lifted rises.
    sliding: bool,
    /// Moving along what stands beside.
    along: bool,
}

/// The true primitive of a hand at every moment.
pub(super) fn labels(scene: &Scene, hand: usize, moments: &[Moment]) -> Vec<String> {
    let targets = targets(scene, hand, moments);
    let mut facts: Vec<Facts> =
        moments.iter().zip(&targets).map(|(moment, &target)| facts(scene, hand, moment, target)).collect();
    steady(&mut facts, |facts| &mut facts.held, BRIDGE, BRIDGE);
    steady(&mut facts, |facts| &mut facts.carried_by, BRIDGE, BLIP);
    steady(&mut facts, |facts| &mut facts.beside, BRIDGE, BLIP);
    steady(&mut facts, |facts| &mut facts.moving, BRIDGE, BRIDGE);
    steady(&mut facts, |facts| &mut facts.sliding, BRIDGE, BRIDGE);
    steady(&mut facts, |facts| &mut facts.along, BRIDGE, BRIDGE);
    let leaving = leaving(&facts);
    let mut label = "Move";
    let mut lifted = false;
    let mut placed = false;
    let mut beside_before = false;
    let mut labels: Vec<&str> = Vec::with_capacity(facts.len());
    for (now, &leaves) in facts.iter().zip(&leaving) {
        if now.fingers == 0 {
            (lifted, placed) = (false, false);
            label = match label {
                "Move" | "Approach" if now.near => "Approach",
                "Move" | "Approach" => "Move",
                "Release" if !now.near => "Move",
                _ => "Release",
            };
        } else if leaves && !matches!(label, "Move" | "Approach") {
            label = "Release";
        } else if !now.held {
            label = match (now.moving, now.beside, label) {
                (true, true, _) => "Trace",
                (true, false, _) if now.carried_by => "Push",
                (.., "Move") => "Approach",
                (.., label) => label,
            };
        } else {
            if !now.carried_by {
                (lifted, placed, beside_before) = (true, false, beside_before && now.beside);
            }
            let landing = lifted && now.carried_by;
            if landing && !placed || now.carried_by && !lifted {
                beside_before = now.beside;
            }
            label = match now {
                Facts { carried_by: false, beside: false, .. } => "Translate",
                Facts { beside: true, along: true, .. } if !beside_before => "Follow",
                Facts { beside: true, .. } if !beside_before => "Press",
                _ if landing => "Place",
                Facts { sliding: true, .. } => "Slide",
                _ => "Grasp",
            };
            placed = placed || landing;
        }
        labels.push(label);
    }
    absorb(&mut labels, "Push", NUDGE);
    absorb(&mut labels, "", SHORTEST);
    labels.into_iter().map(String::from).collect()
}

/// Contacts made and lost, between fingertips and bodies and between bodies.
pub(super) fn contact_events(scene: &Scene, moments: &[Moment]) -> Vec<Event> {
    let names: Vec<&String> = scene.bodies.keys().collect();
    let mut events = Vec::new();
    let mut watch = |subjects: Vec<String>, touching: &dyn Fn(&Moment) -> bool| {
        let mut states: Vec<bool> = moments.iter().map(touching).collect();
        steady(&mut states, |state| state, BLIP, BLIP);
        let mut before = false;
        for (index, &state) in states.iter().enumerate() {
            if state != before {
                let kind = if state { "contact_made" } else { "contact_lost" };
                events.push(Event { time_s: index as f64 / 1000.0, kind: kind.into(), subjects: subjects.clone() });
                before = state;
            }
        }
    };
    for (hand, (side, fingers)) in scene.hands.iter().enumerate() {
        for (index, finger) in fingers.fingers.iter().enumerate() {
            for (body, name) in names.iter().enumerate() {
                watch(vec![format!("{side}.{finger}"), (*name).clone()], &|moment| {
                    moment.hands[hand][index]
                        .touches
                        .iter()
                        .any(|(touched, force)| *touched == body && force.norm() > 0.0)
                });
            }
        }
    }
    let pairs = moments.first().map_or(0, |moment| moment.contacts.len());
    for pair in 0..pairs {
        let (body, other, ..) = moments[0].contacts[pair];
        watch(vec![names[body].clone(), names[other].clone()], &|moment| moment.contacts[pair].3);
    }
    events
}

/// The object that a hand deals with: what it touches, else what it touches next while it is near, else what is nearest.
fn targets(scene: &Scene, hand: usize, moments: &[Moment]) -> Vec<usize> {
    let objects: Vec<usize> = (0..scene.bodies.len()).filter(|&body| scene.bodies[body].role == Role::Object).collect();
    let mut target = usize::MAX;
    moments
        .iter()
        .map(|moment| {
            let tips = &moment.hands[hand];
            let touched = objects.iter().copied().find(|object| tips.iter().any(|tip| touches(tip, *object)));
            let middle = middle(tips);
            let distance = |object: &usize| (moment.bodies[*object].0 - middle).norm();
            let nearest = || objects.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b)));
            if !tips.iter().any(|tip| touches(tip, target)) {
                target = touched.or_else(nearest).unwrap_or(usize::MAX);
            }
            target
        })
        .collect()
}

fn touches(tip: &Tip, body: usize) -> bool {
    tip.touches.iter().any(|(touched, force)| *touched == body && force.norm() > 0.0)
}

fn middle(tips: &[Tip]) -> Point3<f64> {
    let sum: Vector3<f64> = tips.iter().map(|tip| tip.position.coords).sum();
    (sum / tips.len().max(1) as f64).into()
}

fn facts(scene: &Scene, hand: usize, moment: &Moment, target: usize) -> Facts {
    let Some((_, body)) = scene.bodies.get_index(target) else { return Facts::default() };
    let tips = &moment.hands[hand];
    let (position, velocity) = moment.bodies[target];
    let forces: Vec<(Finger, Vector3<f64>)> = tips
        .iter()
        .flat_map(|tip| {
            tip.touches
                .iter()
                .filter(|(touched, force)| *touched == target && force.norm() > 0.0)
                .map(|(_, force)| (tip.finger, *force))
        })
        .collect();
    let total: Vector3<f64> = forces.iter().map(|(_, force)| force).sum();
    let squeeze = (forces.iter().map(|(_, force)| force.norm()).sum::<f64>() - total.norm()) / 2.0;
    let gravity = Vector3::from(scene.gravity.map(|part| part.0));
    let weight = body.mass.map_or(0.0, |mass| mass.0) * gravity.norm();
    let up = -gravity.try_normalize(1e-9).unwrap_or_default();
    let thumb = forces.iter().any(|(finger, _)| *finger == Finger::Thumb);
    let normals =
        moment.contacts.iter().filter(|contact| contact.3).filter_map(|&(body, other, normal, _)| match target {
            target if target == body => Some((normal, moment.bodies[other].1)),
            target if target == other => Some((-normal, moment.bodies[body].1)),
            _ => None,
        });
    let mut facts = Facts {
        fingers: forces.len(),
        near: (middle(tips) - position).norm() <= body.bounding_radius() + NEAR_M,
        held: thumb && forces.len() > 1 && squeeze >= weight / 2.0 / FINGERTIP_FRICTION,
        moving: velocity.norm() > MOVES,
        sliding: (velocity - up * velocity.dot(&up)).norm() > MOVES,
        ..Facts::default()
    };
    for (normal, other_velocity) in normals {
        if normal.dot(&up) >= std::f64::consts::FRAC_1_SQRT_2 {
            facts.carried_by = true;
        } else {
            facts.beside = true;
            let relative = velocity - other_velocity;
            facts.along |= (relative - normal * relative.dot(&normal)).norm() > MOVES;
        }
    }
    facts
}

/// Bridges gaps shorter than `bridge` and takes out what is shorter than `blip`.
fn steady<T>(series: &mut [T], of: impl Fn(&mut T) -> &mut bool, bridge: usize, blip: usize) {
    for (value, shortest) in [(false, bridge), (true, blip)] {
        let mut start = 0;
        while start < series.len() {
            let here = *of(&mut series[start]);
            let end = (start..series.len()).find(|&index| *of(&mut series[index]) != here).unwrap_or(series.len());
            if here == value && end - start < shortest && start > 0 && end < series.len() {
                for item in &mut series[start..end] {
                    *of(item) = !value;
                }
            }
            start = end;
        }
    }
}

/// From when on the fingers leave an object for good: the first departure after which no finger returns.
fn leaving(facts: &[Facts]) -> Vec<bool> {
    let mut leaving = vec![false; facts.len()];
    let mut end = None;
    for index in (0..facts.len()).rev() {
        let (fingers, after) = (facts[index].fingers, facts.get(index + 1).map_or(0, |next| next.fingers));
        if after == 0 && fingers > 0 {
            end = (index + 1 < facts.len()).then_some((index, 0));
        }
        if let Some((last, most)) = end {
            // Backwards in time, the number of fingers may only grow.
            if fingers == 0 || fingers < most || last - index > LEAVING {
                end = None;
            } else {
                leaving[index] = true;
                end = Some((last, fingers));
            }
        }
    }
    // The first moments with all fingers on are no departure yet.
    let mut index = 0;
    while index < leaving.len() {
        if !leaving[index] {
            index += 1;
            continue;
        }
        let end = (index..leaving.len()).find(|&next| !leaving[next]).unwrap_or(leaving.len());
        let most = facts[index].fingers;
        let departure = (index..end).find(|&next| facts[next].fingers < most).unwrap_or(end);
        leaving[index..departure].fill(false);
        index = end;
    }
    leaving
}

/// Gives stretches of `name` (of any, when empty) shorter than `shortest` to what follows, or to what came before when it is a push.
fn absorb(labels: &mut [&str], name: &str, shortest: usize) {
    let mut start = 0;
    while start < labels.len() {
        let here = labels[start];
        let end = (start..labels.len()).find(|&index| labels[index] != here).unwrap_or(labels.len());
        if (name.is_empty() || name == here) && end - start < shortest && start > 0 && end < labels.len() {
            let other = if name.is_empty() { labels[end] } else { labels[start - 1] };
            labels[start..end].fill(other);
        }
        start = end;
    }
}
