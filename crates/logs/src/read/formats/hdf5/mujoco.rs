//! The states of MuJoCo as poses: the model of a recording (MJCF) says which joint each number of `states` is of, and how bodies hang together.
//!
//! A row of `states` is the time, the positions of all joints and their velocities. Columns are `bodies/<body>.position.x` to `.rotation.z` of each
//! body that moves, in the reference frame, and `joints/<joint>` of hinges (rad) and slides (m).

use nalgebra::{Quaternion, Unit, UnitQuaternion, Vector3};
use roxmltree::{Document, Node, ParsingOptions};

/// The largest model that is read, in bytes, and how many nodes and bodies it may have.
const MAX_BYTES: usize = 4 << 20;
const MAX_NODES: u32 = 200_000;
const MAX_BODIES: usize = 1000;
/// Maximum nesting depth of bodies.
const DEEPEST: usize = 100;
/// Elements that make bodies, or joints, that are not written out.
const MACROS: [&str; 6] = ["include", "composite", "flexcomp", "replicate", "attach", "frame"];
/// The names of the columns of a pose.
const POSE: [&str; 7] =
    ["position.x", "position.y", "position.z", "rotation.w", "rotation.x", "rotation.y", "rotation.z"];

/// The tree of bodies.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Model {
    bodies: Vec<Body>,
    /// Numbers a row of the states.
    width: usize,
}

#[derive(Clone, Debug, PartialEq)]
struct Body {
    name: String,
    /// Its place in the list; a body of the world has none.
    parent: Option<usize>,
    position: Vector3<f64>,
    rotation: UnitQuaternion<f64>,
    joints: Vec<Joint>,
    /// Whether a joint lies between it and the world.
    moves: bool,
}

#[derive(Clone, Debug, PartialEq)]
struct Joint {
    name: String,
    kind: Kind,
    axis: Unit<Vector3<f64>>,
    /// The anchor, in the frame of the body.
    position: Vector3<f64>,
    /// The value at which the body is as the model draws it.
    reference: f64,
    /// The place of its first number in a row of the states.
    at: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Free,
    Ball,
    Slide,
    Hinge,
}

impl Kind {
    /// Number of its positions and velocities.
    fn widths(self) -> (usize, usize) {
        match self {
            Self::Free => (7, 6),
            Self::Ball => (4, 3),
            Self::Slide | Self::Hinge => (1, 1),
        }
    }
}

impl Model {
    /// Reads a model whose states have `width` numbers a row; `None` if it is none of these, or says things that are not read here.
    pub fn read(text: &str, width: usize) -> Option<Self> {
        if text.len() > MAX_BYTES {
            return None;
        }
        let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
        let document = Document::parse_with_options(text, options).ok()?;
        let root = document.root_element();
        let named = |node: &Node, names: &[&str]| names.contains(&node.tag_name().name());
        if root.descendants().any(|node| named(&node, &MACROS)) {
            return None;
        }
        let defaults = root.children().filter(|node| named(node, &["default"]));
        if defaults
            .flat_map(|node| node.descendants())
            .any(|node| named(&node, &["joint"]) && node.attribute("axis").is_some())
        {
            return None;
        }
        let mut reader = Reader { bodies: vec![], next: 1, velocities: 0 };
        for world in root.children().filter(|node| named(node, &["worldbody"])) {
            for body in world.children().filter(|node| named(node, &["body"])) {
                reader.body(body, None, 0)?;
            }
        }
        let Reader { bodies, next, velocities } = reader;
        (next + velocities == width && next > 1).then_some(Self { bodies, width })
    }

    fn moving(&self) -> impl Iterator<Item = (usize, &Body)> {
        self.bodies.iter().enumerate().filter(|(_, body)| body.moves)
    }

    fn joints(&self) -> impl Iterator<Item = &Joint> {
        let joints = self.bodies.iter().flat_map(|body| &body.joints);
        joints.filter(|joint| matches!(joint.kind, Kind::Hinge | Kind::Slide) && !joint.name.is_empty())
    }

    /// The names of the columns.
    pub fn titles(&self) -> Vec<String> {
        let bodies = self.moving().flat_map(|(_, body)| POSE.map(|part| format!("bodies/{}.{part}", body.name)));
        bodies.chain(self.joints().map(|joint| format!("joints/{}", joint.name))).collect()
    }

    /// The columns of states, row by row.
    pub fn columns(&self, states: &[f64]) -> Vec<Vec<f64>> {
        let mut columns = vec![Vec::with_capacity(states.len() / self.width); self.titles().len()];
        for state in states.chunks_exact(self.width) {
            let poses = self.poses(state);
            let pose = |(at, _): (usize, &Body)| {
                let (position, rotation) = poses.get(at).copied().unwrap_or_default();
                let q = rotation.quaternion();
                [position.x, position.y, position.z, q.w, q.i, q.j, q.k]
            };
            let values = self.moving().flat_map(pose);
            let values = values.chain(self.joints().map(|joint| state.get(joint.at).copied().unwrap_or(f64::NAN)));
            columns.iter_mut().zip(values).for_each(|(column, value)| column.push(value));
        }
        columns
    }

    /// The pose of each body in a state, reference_from_body.
    fn poses(&self, state: &[f64]) -> Vec<(Vector3<f64>, UnitQuaternion<f64>)> {
        let mut poses: Vec<(Vector3<f64>, UnitQuaternion<f64>)> = Vec::with_capacity(self.bodies.len());
        for body in &self.bodies {
            let (origin, turned) = body.parent.and_then(|parent| poses.get(parent).copied()).unwrap_or_default();
            let mut position = origin + turned * body.position;
            let mut rotation = turned * body.rotation;
            for joint in &body.joints {
                let number = |offset: usize| state.get(joint.at + offset).copied().unwrap_or(f64::NAN);
                let quaternion = |from: usize| {
                    let q = Quaternion::new(number(from), number(from + 1), number(from + 2), number(from + 3));
                    UnitQuaternion::new_normalize(q)
                };
                let turn = match joint.kind {
                    Kind::Free => {
                        position = Vector3::new(number(0), number(1), number(2));
                        rotation = quaternion(3);
                        continue;
                    }
                    Kind::Slide => {
                        position += rotation * joint.axis.scale(number(0) - joint.reference);
                        continue;
                    }
                    Kind::Ball => quaternion(0),
                    Kind::Hinge => UnitQuaternion::from_axis_angle(&joint.axis, number(0) - joint.reference),
                };
                let anchor = position + rotation * joint.position;
                rotation *= turn;
                position = anchor - rotation * joint.position;
            }
            poses.push((position, rotation));
        }
        poses
    }
}

/// A model while it is read.
struct Reader {
    bodies: Vec<Body>,
    /// The place of the next joint's first number, and how many velocities there are so far.
    next: usize,
    velocities: usize,
}

impl Reader {
    /// Takes a body and those in it, in the order of the text, which is that of the states.
    fn body(&mut self, node: Node, parent: Option<usize>, depth: usize) -> Option<()> {
        if depth > DEEPEST || self.bodies.len() >= MAX_BODIES || has_other_rotation(node) {
            return None;
        }
        let rotation = numbers::<4>(node, "quat", [1.0, 0.0, 0.0, 0.0])?;
        let [w, x, y, z] = rotation;
        let mut body = Body {
            name: node.attribute("name").unwrap_or_default().to_string(),
            parent,
            position: vector(node, "pos", [0.0; 3])?,
            rotation: UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-9)?,
            joints: vec![],
            moves: parent.and_then(|parent| self.bodies.get(parent)).is_some_and(|parent| parent.moves),
        };
        if body.name.is_empty() {
            body.name = format!("{}", self.bodies.len());
        }
        for joint in node.children().filter(|node| matches!(node.tag_name().name(), "joint" | "freejoint")) {
            body.joints.push(self.joint(joint)?);
            body.moves = true;
        }
        let at = self.bodies.len();
        self.bodies.push(body);
        for inner in node.children().filter(|node| node.tag_name().name() == "body") {
            self.body(inner, Some(at), depth + 1)?;
        }
        Some(())
    }

    fn joint(&mut self, node: Node) -> Option<Joint> {
        let kind = match (node.tag_name().name(), node.attribute("type").unwrap_or("hinge")) {
            ("freejoint", _) | (_, "free") => Kind::Free,
            (_, "ball") => Kind::Ball,
            (_, "slide") => Kind::Slide,
            (_, "hinge") => Kind::Hinge,
            _ => return None,
        };
        let (positions, velocities) = kind.widths();
        let at = self.next;
        self.next += positions;
        self.velocities += velocities;
        let [reference] = numbers::<1>(node, "ref", [0.0])?;
        Some(Joint {
            name: node.attribute("name").unwrap_or_default().to_string(),
            kind,
            axis: Unit::try_new(vector(node, "axis", [0.0, 0.0, 1.0])?, 1e-9)?,
            position: vector(node, "pos", [0.0; 3])?,
            reference,
            at,
        })
    }
}

/// Whether the rotation of a body is said otherwise than by a quaternion.
fn has_other_rotation(node: Node) -> bool {
    ["euler", "axisangle", "xyaxes", "zaxis"].iter().any(|key| node.attribute(*key).is_some())
}

fn vector(node: Node, key: &str, usual: [f64; 3]) -> Option<Vector3<f64>> {
    numbers::<3>(node, key, usual).map(Vector3::from)
}

/// Returns the numbers of an attribute, or the default without an attribute.
fn numbers<const N: usize>(node: Node, key: &str, usual: [f64; N]) -> Option<[f64; N]> {
    let Some(text) = node.attribute(key) else { return Some(usual) };
    let numbers: Vec<f64> = text.split_whitespace().map(|word| word.parse().ok()).collect::<Option<_>>()?;
    <[f64; N]>::try_from(numbers).ok().filter(|numbers| numbers.iter().all(|number| number.is_finite()))
}
