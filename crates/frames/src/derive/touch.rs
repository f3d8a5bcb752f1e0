//! Contacts that a log does not have, from shapes, poses and the balance of forces.
//!
//! Two bodies touch while the gap between their shapes is less than a tolerance, which grows with the noise of the poses. Scenes are measured by
//! hand: what an object rests on while no hand touches it is as far from it as the scene is wrong there, and gaps count from that.
//! Where the balance of forces is known, a touch without load is distinguished from a contact that bears a load.

use super::balance::Balance;
use super::contacts::Contact;
use super::hands::HandTrack;
use super::motion::Motion;
use crate::clean::preprocess::{CleanLog, State, TouchPair, Touches};
use crate::derive::convex_gap::{Gap, gaps};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use teachtree_base::contact_threshold;

/// Bodies touch when the gap is less than this, m …
const TOUCH_GAP: f64 = 0.3e-3;
/// … until it is more than this many times as wide.
const LEAVES_AT: f64 = 1.7;
/// How many times the noise of a gap the tolerance is at least.
const ABOVE_NOISE: f64 = 4.0;
/// How wrong a scene may be, m.
const SCENE_ERROR: f64 = 5e-3;
/// An object with a gap wider than this on all sides touches nothing, m.
const CLEAR: f64 = 5e-3;
/// An object slower than this rests, m/s.
const RESTS: f64 = 5e-3;
/// What carries an object has a normal that points at least this much up.
const CARRIES: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// The force of a contact that is known by its place only, of an object of unknown mass, N.
pub const NOMINAL: f64 = 1.0;

/// The gaps between an object and one other body.
struct Pair {
    other: usize,
    /// The first frame of the gaps.
    first: usize,
    gaps: Vec<Gap>,
    /// The gap at which they touch in truth, m.
    offset: f64,
    /// The tolerance, m.
    within: f64,
}

/// The contacts of an object with all bodies that it comes to touch; both need shapes. What the log shows of them is put into `learned`; of a window
/// it is known.
pub fn contacts<'a>(
    measured: &CleanLog,
    motions: &[Motion],
    tracks: &[HandTrack],
    object: usize,
    learned: &mut BTreeMap<usize, Touches>,
) -> BTreeMap<usize, Contact<'a>> {
    let known = measured.window.as_ref().and_then(|window| window.touches.get(&object));
    let (pairs, balance) = match known {
        Some(known) => placed(measured, motions, tracks, object, known),
        None => learn(measured, motions, tracks, object),
    };
    let touching: Vec<Vec<bool>> = pairs.iter().map(|pair| pair.touching(measured, object)).collect();
    let touched: Vec<bool> = match known {
        Some(_) => vec![true; pairs.len()],
        None => touching.iter().map(|touches| touches.contains(&true)).collect(),
    };
    if known.is_none() {
        let pairs = pairs.iter().zip(&touched).map(|(pair, touched)| TouchPair {
            other: pair.other,
            offset: pair.offset,
            within: pair.within,
            touched: *touched,
        });
        let noise = balance.as_ref().map(|balance| balance.noise);
        learned.insert(object, Touches { pairs: pairs.collect(), noise, supports: vec![] });
    }
    let nominal = nominal(measured, object);
    let mut contacts = BTreeMap::new();
    for ((pair, touches), _) in pairs.iter().zip(&touching).zip(touched).filter(|(_, touched)| *touched) {
        // Bodies that bear in the same direction share the load.
        let sharing = |frame: usize| {
            let normal = pair.normal(frame);
            let same = |(it, touches): &(&Pair, &Vec<bool>)| {
                touches.get(frame) == Some(&true) && it.normal(frame).dot(&normal) > CARRIES
            };
            pairs.iter().zip(&touching).filter(same).count().max(1) as f64
        };
        let mut forces = vec![Vector3::zeros(); measured.len()];
        measured.follow_averaged(&format!("load {object} {}", pair.other), |frame, before| {
            let touches = touches.get(frame) == Some(&true);
            let load = match &balance {
                Some(balance) if touches => balance.force(frame).dot(&pair.normal(frame)) / sharing(frame),
                None if touches => nominal,
                _ => 0.0,
            };
            let noise = balance.as_ref().map_or(0.0, |balance| balance.noise);
            let on = load
                > if before.on {
                    contact_threshold::OFF_N.max(noise / 2.0)
                } else {
                    contact_threshold::ON_N.max(noise)
                };
            if let (true, Some(force)) = (on, forces.get_mut(frame)) {
                // However small, it is a load: what counts as one is decided here.
                *force = pair.normal(frame) * load.max(2.0 * contact_threshold::ON_N);
            }
            State { on, ..before }
        });
        let normals = (0..measured.len())
            .map(|frame| if touches.get(frame) == Some(&true) { pair.normal(frame) } else { Vector3::zeros() });
        contacts.insert(pair.other, Contact::derived(&forces, normals, touches));
    }
    contacts
}

/// The pairs of an object, and the balance of the forces on it, as the log shows them.
fn learn(measured: &CleanLog, motions: &[Motion], tracks: &[HandTrack], object: usize) -> (Vec<Pair>, Option<Balance>) {
    let others = (0..measured.scene.bodies.len()).filter(|other| *other != object);
    let mut pairs: Vec<Pair> = others.filter_map(|other| Pair::new(measured, motions, object, other)).collect();
    let held = |frame: usize| {
        let holds = |track: &HandTrack| {
            track.touching.get(frame) == Some(&true) && track.target.get(frame) == Some(&Some(object))
        };
        tracks.iter().any(holds)
    };
    let rests = |frame: &usize| {
        motions.get(object).is_some_and(|motion| motion.velocity(*frame).norm() < RESTS) && !held(*frame)
    };
    let at_rest: Vec<usize> = measured.core().filter(rests).collect();
    calibrate(&mut pairs, &at_rest);
    let clear = |frame: usize| pairs.iter().all(|pair| pair.width(frame) > CLEAR);
    let balance = Balance::of(measured, motions, tracks, object, clear);
    (pairs, balance)
}

/// The same in a window of a log of which it is known.
fn placed(
    measured: &CleanLog,
    motions: &[Motion],
    tracks: &[HandTrack],
    object: usize,
    known: &Touches,
) -> (Vec<Pair>, Option<Balance>) {
    let place = |known: &TouchPair| {
        let pair = Pair::new(measured, motions, object, known.other)?;
        Some(Pair { offset: known.offset, within: known.within, ..pair })
    };
    let balance = known.noise.and_then(|noise| Balance::known(measured, motions, tracks, object, noise));
    (known.pairs.iter().filter_map(place).collect(), balance)
}

/// What a contact of an object bears when only its place is known: the object's weight, if that is known, N.
pub fn nominal(measured: &CleanLog, object: usize) -> f64 {
    let gravity = measured.scene.gravity.iter().map(|part| part.0 * part.0).sum::<f64>().sqrt();
    let mass = measured.scene.bodies.get_index(object).and_then(|(_, body)| body.mass);
    mass.map_or(NOMINAL, |mass| mass.0 * gravity).max(2.0 * contact_threshold::ON_N)
}

/// The gap of two bodies at a frame: of the parts that touch, the one that carries, else of the nearest ones.
pub fn gap_at(measured: &CleanLog, motions: &[Motion], object: usize, other: usize, frame: usize) -> Option<Gap> {
    let placed = |body: usize| Some((measured.scene.bodies.get_index(body)?.1, motions.get(body)?.pose(frame)));
    let ((body, at), (its, there)) = (placed(object)?, placed(other)?);
    let gaps = gaps((body, &at), (its, &there), TOUCH_GAP);
    let nearest = gaps.iter().copied().min_by(|a, b| a.width.total_cmp(&b.width))?;
    let carries = |gap: &&Gap| gap.normal.z > CARRIES && gap.width < TOUCH_GAP;
    Some(gaps.iter().filter(carries).max_by(|a, b| a.normal.z.total_cmp(&b.normal.z)).copied().unwrap_or(nearest))
}

impl Pair {
    fn new(measured: &CleanLog, motions: &[Motion], object: usize, other: usize) -> Option<Self> {
        let frames = measured.core();
        let first = frames.start;
        let gaps = frames.map(|frame| gap_at(measured, motions, object, other, frame)).collect::<Option<_>>()?;
        Some(Self { other, first, gaps, offset: 0.0, within: TOUCH_GAP })
    }

    fn gap(&self, frame: usize) -> Option<&Gap> {
        self.gaps.get(frame.checked_sub(self.first)?)
    }

    fn width(&self, frame: usize) -> f64 {
        self.gap(frame).map_or(f64::INFINITY, |gap| gap.width - self.offset)
    }

    fn normal(&self, frame: usize) -> Vector3<f64> {
        self.gap(frame).map_or_else(Vector3::zeros, |gap| gap.normal)
    }

    fn touching(&self, measured: &CleanLog, object: usize) -> Vec<bool> {
        let mut touching = vec![false; measured.len()];
        measured.follow(&format!("touch {object} {}", self.other), |frame, before| {
            let on = self.width(frame) < self.within * if before.on { LEAVES_AT } else { 1.0 };
            if let Some(flag) = touching.get_mut(frame) {
                *flag = on;
            }
            State { on, ..before }
        });
        touching
    }
}

/// Learns from an object at rest how wrong the scene is below it, and how noisy its gaps are.
fn calibrate(pairs: &mut [Pair], at_rest: &[usize]) {
    let mut resting: Vec<Vec<f64>> = vec![vec![]; pairs.len()];
    for frame in at_rest {
        let below = |pair: &Pair| pair.normal(*frame).z > CARRIES && pair.width(*frame).abs() < SCENE_ERROR;
        let candidates = pairs.iter().enumerate().filter(|(_, pair)| below(pair));
        let carrier = candidates.min_by(|(_, a), (_, b)| a.width(*frame).total_cmp(&b.width(*frame)));
        if let Some((at, width)) = carrier.map(|(at, pair)| (at, pair.width(*frame)))
            && let Some(widths) = resting.get_mut(at)
        {
            widths.push(width);
        }
    }
    let mut noise = 0.0_f64;
    for (pair, widths) in pairs.iter_mut().zip(&mut resting) {
        let Some(offset) = median(widths) else { continue };
        pair.offset = offset;
        widths.iter_mut().for_each(|width| *width = (*width - offset).abs());
        // The median of what is normally distributed is 0.6745 standard deviations from the mean.
        noise = noise.max(median(widths).unwrap_or_default() / 0.6745);
    }
    pairs.iter_mut().for_each(|pair| pair.within = TOUCH_GAP.max(ABOVE_NOISE * noise));
}

fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
