//! What the replay moves: bodies with their shapes and poses, fingertips with their forces, what touches the targets. Lengths in metres, forces in
//! newtons, reference frame.

use super::thin::{Thinning, curve, rounded, toggles};
use crate::base::hands::{Finger, Side};
use crate::base::recording::Recording;
use crate::base::scene::{Body, Part, Role, Shape};
use crate::stream::frames::{ColumnKey, Frames, HandLayout, Values};
use serde_json::{Value, json};

/// How far what is drawn may be from where it was, m; less is not seen.
const WITHIN_M: f64 = 3e-4;
/// The same for a component of a quaternion.
const WITHIN_TURN: f64 = 2e-3;
/// The same for a component of a force, N.
const WITHIN_N: f64 = 5e-3;
/// Knots of all curves together, about.
const KNOTS: usize = 60_000;
/// Less than this is no force, N: what never has more is not drawn.
const LEAST_FORCE: f64 = 1e-3;
/// A hand that changes its target more often has none.
const MAX_TARGETS: usize = 2000;
/// The radius of a fingertip of which the scene says nothing, m.
const TIP_RADIUS: f64 = 0.010;

/// The replay; a sentence under `why` where there is nothing to move.
pub(super) fn replay(frames: &Frames, recording: &Recording) -> Value {
    let moved = Moved { frames, recording, rows: rows(frames, recording), most: most(frames, recording) };
    let bodies: Vec<Value> = recording.scene.bodies.iter().filter_map(|(name, body)| moved.body(name, body)).collect();
    let hands: Vec<Value> = frames.layout.hands.iter().filter_map(|hand| moved.hand(hand)).collect();
    let moves = |name: &str| recording.columns.contains_key(&format!("{name}.position.x"));
    if hands.is_empty() && !recording.scene.bodies.keys().any(|name| moves(name)) {
        let lacking = if recording.scene.bodies.is_empty() { "scene" } else { "poses of objects" };
        return json!({ "why": format!("There is no replay: the recording has no positions of fingertips and no {lacking}.") });
    }
    json!({ "bodies": bodies, "hands": hands, "objects": frames.objects })
}

/// The row of the recording of each frame: frames are rows that could be trusted.
fn rows(frames: &Frames, recording: &Recording) -> Vec<usize> {
    let row = |time: &f64| recording.time.partition_point(|at| at < time);
    frames.time.iter().map(row).collect()
}

/// Knots of one curve.
fn most(frames: &Frames, recording: &Recording) -> usize {
    let tips: usize = frames.layout.hands.iter().map(|hand| 6 * hand.fingers.len() + 3 * hand.contacts.len() + 7).sum();
    (KNOTS / (7 * recording.scene.bodies.len() + tips).max(1)).clamp(100, 3000)
}

struct Moved<'a> {
    frames: &'a Frames,
    recording: &'a Recording,
    rows: Vec<usize>,
    most: usize,
}

impl Moved<'_> {
    fn curve(&self, values: &[f64], within: f64) -> Value {
        curve(values, &self.frames.stretches, Thinning { within, drawn: None, most: self.most })
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
            (Some(columns), _) => columns.iter().map(|column| self.curve(column, WITHIN_M)).collect(),
            (None, Some(position)) => position.into_iter().map(fixed).collect(),
            (None, None) => return None,
        };
        match (self.columns(&format!("{name}.rotation"), ["w", "x", "y", "z"]), rotation) {
            (Some(mut columns), _) => {
                one_sign(&mut columns);
                pose.extend(columns.iter().map(|column| self.curve(column, WITHIN_TURN)));
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
            let position: Vec<Value> = position.iter().map(|axis| self.curve(&axis.to_vec(), WITHIN_M)).collect();
            let force = self.force(self.vector("fingers.force", side, slot));
            let touches = self.channel("fingers.contact", side, slot, 0).map(|touches| {
                let touches: Vec<bool> = touches.iter().map(|touches| touches > 0.5).collect();
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
            let normal: Vec<Value> = normal.iter().map(|axis| self.curve(&axis.to_vec(), 0.05)).collect();
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
        let column = self.channel("target", side, 0, 0).unwrap_or(Values::NONE);
        let mut changes = Vec::new();
        let mut last = f64::NAN;
        for (frame, target) in column.iter().enumerate() {
            if changes.len() > MAX_TARGETS {
                return Vec::new();
            }
            if target.to_bits() != last.to_bits() {
                changes.push(json!([frame, rounded(target)]));
                last = target;
            }
        }
        changes
    }

    /// A force as three curves; nothing of one that is never felt.
    fn force(&self, force: Option<[Values<'_>; 3]>) -> Value {
        let felt = |axis: &Values<'_>| axis.iter().any(|value| value.abs() > LEAST_FORCE);
        match force.filter(|force| force.iter().any(felt)) {
            Some(force) => force.iter().map(|axis| self.curve(&axis.to_vec(), WITHIN_N)).collect(),
            None => Value::Null,
        }
    }

    fn channel(&self, name: &str, side: Side, slot: u32, component: u32) -> Option<Values<'_>> {
        let channel = self.frames.channel(name)?;
        self.frames.column(ColumnKey { channel, side: Some(side), slot, component })
    }

    fn vector(&self, name: &str, side: Side, slot: u32) -> Option<[Values<'_>; 3]> {
        let axis = |component| self.channel(name, side, slot, component);
        Some([axis(0)?, axis(1)?, axis(2)?])
    }
}

fn part(part: &Part) -> Value {
    let (shape, size) = match part.shape {
        Shape::Box(edges) => ("box", edges.map(|edge| rounded(edge.0)).to_vec()),
        Shape::Cylinder(sizes) => ("cylinder", sizes.map(|size| rounded(size.0)).to_vec()),
        Shape::Ball(radius) => ("ball", vec![rounded(radius.0)]),
    };
    json!({ "shape": shape, "size": size, "at": part.at.map(|length| rounded(length.0)), "turned": part.turned.map(rounded) })
}

/// A quaternion and its negative are one rotation: neighbours get the same sign, so that what lies between them does too.
fn one_sign(columns: &mut [Vec<f64>; 4]) {
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
