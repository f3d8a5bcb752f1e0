//! What the replay moves: bodies with their shapes and poses, fingertips with their forces, what touches the targets. Lengths in meters, forces in
//! newtons, reference frame.

use super::decimation::{Decimation, DecimationMode, curve, rounded, toggles};
use serde_json::{Value, json};
use std::cell::Cell;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::recording::Recording;
use teachtree_base::scene::{Body, Part, Role, Shape};
use teachtree_frames::frames::{ColumnKey, Frames, HandLayout};

/// Maximum position error of the drawing, m: smaller errors are invisible.
const WITHIN_M: f64 = 3e-4;
/// Maximum error of a component of a quaternion.
const WITHIN_TURN: f64 = 2e-3;
/// Maximum error of a component of a force, N.
const WITHIN_N: f64 = 5e-3;
/// Maximum error of a component of a normal.
const WITHIN_NORMAL: f64 = 0.05;
/// Knots of all curves together, about, for each [`FRAMES`] of the recording.
const KNOTS: usize = 120_000;
/// Frames for which there are that many knots.
const FRAMES: usize = 20_000;
/// How many times that many knots a page holds at most.
const TIMES: usize = 8;
/// The minimum force, N: a contact that never exceeds it is not drawn.
const LEAST_FORCE: f64 = 1e-3;
/// A hand that changes its target more often has none.
const MAX_TARGETS: usize = 2000;
/// The radius of a fingertip of which the scene says nothing, m.
const TIP_RADIUS: f64 = 0.010;

/// The replay; a sentence under `why` where there is nothing to move.
pub(super) fn replay(frames: &Frames, recording: &Recording) -> Value {
    let room = KNOTS * frames.len.div_ceil(FRAMES).clamp(1, TIMES);
    let mut replay_builder = ReplayBuilder {
        frames,
        recording,
        rows: rows(frames, recording),
        keep: DecimationMode::Line,
        room,
        taken: KnotUsage::default(),
    };
    let mut drawn = replay_builder.all();
    if replay_builder.taken.knots.get() > room {
        // Bodies and hands stay whole only if all are known on the same frames.
        let step = (replay_builder.taken.curves.get() * frames.len).div_ceil(room).max(2);
        replay_builder =
            ReplayBuilder { keep: DecimationMode::Every(step), taken: KnotUsage::default(), ..replay_builder };
        drawn = replay_builder.all();
    }
    let (bodies, hands) = drawn;
    let moves = |name: &str| recording.columns.contains_key(&format!("{name}.position.x"));
    if hands.is_empty() && !recording.scene.bodies.keys().any(|name| moves(name)) {
        let lacking = if recording.scene.bodies.is_empty() { "scene" } else { "poses of objects" };
        return json!({ "why": format!("There is no replay: the recording has no positions of fingertips and no {lacking}.") });
    }
    let mut replay = json!({ "bodies": bodies, "hands": hands, "objects": frames.objects });
    if let (DecimationMode::Every(step), Some(fields)) = (replay_builder.keep, replay.as_object_mut()) {
        let KnotUsage { off_m, off_n, .. } = &replay_builder.taken;
        fields.insert("every".into(), json!({ "frames": step, "m": rounded(off_m.get()), "n": rounded(off_n.get()) }));
    }
    replay
}

/// The row of the recording of each frame: frames are rows that could be trusted.
fn rows(frames: &Frames, recording: &Recording) -> Vec<usize> {
    let row = |time: &f64| recording.time.partition_point(|at| at < time);
    frames.time.iter().map(row).collect()
}

struct ReplayBuilder<'a> {
    frames: &'a Frames,
    recording: &'a Recording,
    rows: Vec<usize>,
    keep: DecimationMode,
    /// Knots that may be taken.
    room: usize,
    taken: KnotUsage,
}

/// What the curves took so far, and how far the farthest of them are from a sample.
#[derive(Default)]
struct KnotUsage {
    knots: Cell<usize>,
    curves: Cell<usize>,
    off_m: Cell<f64>,
    off_n: Cell<f64>,
}

/// What a curve is a component of.
#[derive(Clone, Copy)]
enum CurveQuantity {
    Position,
    Turn,
    Force,
    Normal,
}

impl ReplayBuilder<'_> {
    /// Bodies and hands.
    fn all(&self) -> (Vec<Value>, Vec<Value>) {
        let bodies = self.recording.scene.bodies.iter().filter_map(|(name, body)| self.body(name, body));
        (bodies.collect(), self.frames.layout.hands.iter().filter_map(|hand| self.hand(hand)).collect())
    }

    fn curve(&self, values: &[f64], of: CurveQuantity) -> Value {
        let KnotUsage { knots, curves, off_m, off_n } = &self.taken;
        let within = match of {
            CurveQuantity::Position => WITHIN_M,
            CurveQuantity::Turn => WITHIN_TURN,
            CurveQuantity::Force => WITHIN_N,
            CurveQuantity::Normal => WITHIN_NORMAL,
        };
        if values.windows(2).any(|pair| pair.first() != pair.last()) {
            curves.set(curves.get() + 1);
        }
        // There are too many already: all are made anew, with fewer.
        if matches!(self.keep, DecimationMode::Line) && knots.get() > self.room {
            return Value::Null;
        }
        let decimated = curve(values, &self.frames.stretches, Decimation { within, drawn: None, keep: self.keep });
        knots.set(knots.get() + decimated.knots);
        match of {
            CurveQuantity::Position => off_m.set(off_m.get().max(decimated.off)),
            CurveQuantity::Force => off_n.set(off_n.get().max(decimated.off)),
            CurveQuantity::Turn | CurveQuantity::Normal => {}
        }
        decimated.json
    }

    /// A column of the recording, by frame.
    fn column(&self, name: &str) -> Option<Vec<f64>> {
        let column = self.recording.columns.get(name)?;
        Some(self.rows.iter().map(|row| column.values.get(*row).copied().unwrap_or(f64::NAN)).collect())
    }

    fn columns<const N: usize>(&self, channel: &str, components: [&str; N]) -> Option<[Vec<f64>; N]> {
        let columns: Option<Vec<Vec<f64>>> =
            components.iter().map(|component| self.column(&format!("{channel}.{component}"))).collect();
        columns?.try_into().ok()
    }

    /// Position and rotation, a curve or a number each: as recorded, else as given.
    fn pose(&self, name: &str, position: Option<[f64; 3]>, rotation: Option<[f64; 4]>) -> Option<Vec<Value>> {
        let fixed = |number: f64| json!({ "v": rounded(number) });
        let mut pose: Vec<Value> = match (self.columns(&format!("{name}.position"), ["x", "y", "z"]), position) {
            (Some(columns), _) => columns.iter().map(|column| self.curve(column, CurveQuantity::Position)).collect(),
            (None, Some(position)) => position.into_iter().map(fixed).collect(),
            (None, None) => return None,
        };
        match (self.columns(&format!("{name}.rotation"), ["w", "x", "y", "z"]), rotation) {
            (Some(mut columns), _) => {
                one_sign(&mut columns);
                pose.extend(columns.iter().map(|column| self.curve(column, CurveQuantity::Turn)));
            }
            (None, Some(rotation)) => pose.extend(rotation.into_iter().map(fixed)),
            (None, None) => {}
        }
        Some(pose)
    }

    /// A body; nothing of one that has no size.
    fn body(&self, name: &str, body: &Body) -> Option<Value> {
        let radius = body.bounding_radius();
        if body.parts.is_empty() && radius <= 0.0 {
            return None;
        }
        let pose = self.pose(name, Some(body.position.map(|length| length.0)), Some(body.rotation))?;
        let role = match body.role {
            Role::Object => "object",
            Role::Support => "support",
            Role::Wall => "wall",
            Role::Socket => "socket",
        };
        let parts: Vec<Value> = body.parts.iter().map(part).collect();
        Some(json!({ "name": name, "role": role, "radius": rounded(radius), "parts": parts, "pose": pose }))
    }

    /// A hand; nothing of one whose fingertips are nowhere.
    fn hand(&self, hand: &HandLayout) -> Option<Value> {
        let side = hand.side;
        let finger = |(slot, finger): (u32, &Finger)| {
            let position = self.vector("fingers.position", side, slot)?;
            position.iter().all(|axis| axis.iter().any(|value| value.is_finite())).then_some(())?;
            let position: Vec<Value> = position.iter().map(|axis| self.curve(axis, CurveQuantity::Position)).collect();
            let force = self.force(self.vector("fingers.force", side, slot));
            let touches = self.channel("fingers.contact", side, slot, 0).map(|touches| {
                let touches: Vec<bool> = touches.iter().map(|touches| *touches > 0.5).collect();
                toggles(&touches)
            });
            Some(json!({ "name": finger.name(), "position": position, "force": force, "touches": touches }))
        };
        let fingers: Vec<Value> = (0..).zip(&hand.fingers).filter_map(finger).collect();
        if fingers.is_empty() {
            return None;
        }
        let contact = |(slot, name): (u32, &String)| {
            let force = self.force(self.vector("contacts.force", side, slot));
            if force.is_null() {
                return None;
            }
            let normal = self.vector("contacts.normal", side, slot)?;
            let normal: Vec<Value> = normal.iter().map(|axis| self.curve(axis, CurveQuantity::Normal)).collect();
            Some(json!({ "name": name, "force": force, "normal": normal }))
        };
        let contacts: Vec<Value> = (0..).zip(&hand.contacts).filter_map(contact).collect();
        let radius = self.recording.scene.hands.get(&side).map_or(TIP_RADIUS, |hand| hand.tip_radius.0);
        let palm = self.pose(&format!("{side}.palm"), None, None);
        Some(json!({ "side": side.name(), "radius": rounded(radius), "palm": palm, "fingers": fingers,
            "contacts": contacts, "target": self.target(side) }))
    }

    /// Which object is the target, wherever it changes: `[frame, position among the objects]`.
    fn target(&self, side: Side) -> Vec<Value> {
        let column = self.channel("target", side, 0, 0).unwrap_or(&[]);
        let mut changes = Vec::new();
        let mut last = f64::NAN;
        for (frame, target) in column.iter().enumerate() {
            if changes.len() > MAX_TARGETS {
                return Vec::new();
            }
            if target.to_bits() != last.to_bits() {
                changes.push(json!([frame, rounded(*target)]));
                last = *target;
            }
        }
        changes
    }

    /// A force as three curves; nothing of one that is never felt.
    fn force(&self, force: Option<[&[f64]; 3]>) -> Value {
        let felt = |axis: &&[f64]| axis.iter().any(|value| value.abs() > LEAST_FORCE);
        match force.filter(|force| force.iter().any(felt)) {
            Some(force) => force.iter().map(|axis| self.curve(axis, CurveQuantity::Force)).collect(),
            None => Value::Null,
        }
    }

    fn channel(&self, name: &str, side: Side, slot: u32, component: u32) -> Option<&[f64]> {
        let channel = self.frames.channel(name)?;
        self.frames.column(ColumnKey { channel, side: Some(side), slot, component })
    }

    fn vector(&self, name: &str, side: Side, slot: u32) -> Option<[&[f64]; 3]> {
        let axis = |component| self.channel(name, side, slot, component);
        Some([axis(0)?, axis(1)?, axis(2)?])
    }
}

/// A part of a body as the page draws it.
pub fn part(part: &Part) -> Value {
    let (shape, size) = match part.shape {
        Shape::Box(edges) => ("box", edges.map(|edge| rounded(edge.0)).to_vec()),
        Shape::Cylinder(sizes) => ("cylinder", sizes.map(|size| rounded(size.0)).to_vec()),
        Shape::Ball(radius) => ("ball", vec![rounded(radius.0)]),
    };
    json!({ "shape": shape, "size": size, "at": part.at.map(|length| rounded(length.0)), "turned": part.turned.map(rounded) })
}

/// A quaternion and its negative are one rotation: neighbors get the same sign, so that what lies between them does too.
pub fn one_sign(columns: &mut [Vec<f64>; 4]) {
    let len = columns.iter().map(Vec::len).min().unwrap_or(0);
    let mut last = [0.0; 4];
    for frame in 0..len {
        let now: [f64; 4] = std::array::from_fn(|at| columns[at].get(frame).copied().unwrap_or(f64::NAN));
        if now.iter().any(|part| !part.is_finite()) {
            continue;
        }
        let sign = if now.iter().zip(last).map(|(a, b)| a * b).sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
        last = now.map(|part| sign * part);
        for (column, part) in columns.iter_mut().zip(last) {
            if let Some(value) = column.get_mut(frame) {
                *value = part;
            }
        }
    }
}
