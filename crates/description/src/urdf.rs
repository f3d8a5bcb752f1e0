//! URDF: the text of a robot description in, a tree of links and joints out; the only module of this crate that names the XML library.
//!
//! Read are joints (revolute, continuous, prismatic, fixed; `mimic`), their limits, also soft ones, masses and inertias, and collision shapes that are boxes,
//! cylinders (as bars with round ends) and balls. Of meshes the names are given. Where a joint says nothing of its motor, a small one is taken.
//!
//! [`kinematics`] reads links and joints alone. What is odd in a file that other programs load is noted: it matters only if a link that is needed hangs on it. Where all is
//! read, a file that does not close is an error; limits, mimics and inertias of single links are noted.

mod text;

use super::limits::{MAX_LINKS, MAX_MESHES, MAX_SOLIDS, SPEEDS_UP_S};
use super::mesh::{MeshName, MeshUse};
use super::shape::{CollisionShape, inertia_of};
use super::tree::{Dof, Joint, JointKind, KinematicTree, Link};
use nalgebra::{Isometry3, Matrix3, Point3, Translation3, Unit, UnitQuaternion, Vector3};
use roxmltree::{Document, Node};
use std::cell::RefCell;
use std::f64::consts::PI;
use teachtree_base::error::InputError;
use teachtree_base::short_number::ShortNumber;

/// The largest URDF text that is read, in bytes.
const MAX_BYTES: usize = 4 << 20;
/// What a joint has that says nothing of it: torque, N m, speed, rad/s, armature of a joint that turns, kg m^2, and of one that slides, kg.
const USUAL_TORQUE: f64 = 1.0;
const USUAL_SPEED: f64 = 6.0;
const USUAL_ARMATURE: f64 = 2e-4;
const USUAL_SLIDING_ARMATURE: f64 = 0.1;
/// How a file of macros becomes a URDF.
const EXPAND: &str = "expand the macros of the file: `xacro robot.urdf.xacro > robot.urdf`";

/// A part of a file that is ignored or replaced.
#[derive(Clone, Debug)]
pub struct Oddity {
    /// The joint; empty for a link that hangs on none.
    pub joint: String,
    /// The link, or the one that hangs on the joint.
    pub link: String,
    /// What was found, at its line.
    pub error: InputError,
    /// The replacement; `None` where the pose of the link is not known.
    pub instead: Option<&'static str>,
}

/// Reads the links and joints of a URDF text, without masses and shapes; `file` is its name in errors. Limits and motors of joints may be wrong.
///
/// # Errors
/// The text is not a URDF; the error names the line.
pub fn kinematics(text: &str, file: &str) -> Result<(KinematicTree, Vec<Oddity>), InputError> {
    read(text, file, Scope::Kinematics).map(|(tree, _, oddities)| (tree, oddities))
}

/// Reads a URDF text, and the names of the meshes that its links have; and what is not read as it stands.
///
/// # Errors
/// What is wrong with it, at its line.
pub fn with_meshes(text: &str, file: &str) -> Result<(KinematicTree, Vec<MeshName>, Vec<Oddity>), InputError> {
    read(text, file, Scope::Whole)
}

/// What is read of a file.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Scope {
    /// All of it.
    Whole,
    /// Links and joints; oddities are noted.
    Kinematics,
}

fn read(text: &str, file: &str, scope: Scope) -> Result<(KinematicTree, Vec<MeshName>, Vec<Oddity>), InputError> {
    if text.len() > MAX_BYTES {
        return Err(InputError::new(file, format!("the file has {} bytes, at most {MAX_BYTES} are read", text.len())));
    }
    let text = text::parsable(text);
    let document = text::document(&text).map_err(|error| {
        let at = error.pos();
        InputError::new(format!("{file}:{}:{}", at.row, at.col), format!("is not valid XML: {error}"))
    })?;
    let reader = Reader { document: &document, file, scope, oddities: RefCell::default() };
    let root = document.root_element();
    if root.tag_name().name() != "robot" {
        return Err(reader.error(root, format!("found `{}`, expected `robot`", root.tag_name().name())));
    }
    let (tree, meshes) = reader.tree(root)?;
    Ok((tree, meshes, reader.oddities.into_inner()))
}

/// The inertia of a body that is as near to this one as many files are wrong: where one moment is more than the other two together, as in files of
/// well-known hands, each is the mean of the three, as MuJoCo balances them. `None` when a moment is negative; files round, a thousandth is let through.
fn balanced(own: Matrix3<f64>) -> Option<Matrix3<f64>> {
    let moments = own.symmetric_eigenvalues();
    let whole = moments.sum();
    if !moments.iter().all(|moment| *moment >= -1e-3 * whole.abs()) {
        return None;
    }
    let stands = moments.iter().all(|moment| *moment <= whole / 2.0 + 1e-3 * whole);
    Some(if stands { own } else { Matrix3::identity() * (whole / 3.0) })
}

struct Reader<'a> {
    document: &'a Document<'a>,
    file: &'a str,
    scope: Scope,
    oddities: RefCell<Vec<Oddity>>,
}

/// A joint with the links that it connects, parent first.
type JointOfLinks<'a> = (Node<'a, 'a>, &'a str, &'a str);

/// No end stops a joint.
const UNLIMITED: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

fn children<'a>(node: Node<'a, 'a>, name: &'static str) -> impl Iterator<Item = Node<'a, 'a>> {
    // Elements of simulators may have the same names under a prefix of their own.
    let wanted = (node.tag_name().namespace(), name);
    node.children().filter(move |child| (child.tag_name().namespace(), child.tag_name().name()) == wanted)
}

/// A link and those that hang on it, parents first.
fn below<'a>(top: &'a str, joints: &[JointOfLinks<'a>]) -> Vec<&'a str> {
    let mut order = vec![top];
    let mut at = 0;
    while let Some(&name) = order.get(at) {
        order.extend(joints.iter().filter(|(_, parent, _)| *parent == name).map(|(_, _, child)| *child));
        at += 1;
    }
    order
}

impl<'a> Reader<'a> {
    fn place(&self, node: Node<'_, '_>) -> String {
        let at = self.document.text_pos_at(node.range().start);
        format!("{}:{}:{}", self.file, at.row, at.col)
    }

    fn error(&self, node: Node<'_, '_>, message: String) -> InputError {
        InputError::new(self.place(node), message)
    }

    /// The error about an unexpected value.
    fn unexpected(&self, node: Node<'_, '_>, key: &str, text: &str, expected: &str) -> InputError {
        let error = self.error(node, format!("`{key}` is `{text}`, expected {expected}"));
        if text.contains("${") { error.help(EXPAND) } else { error }
    }

    /// Notes an error with the replacement, if only links and joints are read.
    ///
    /// # Errors
    /// This error, where all is read.
    fn note(
        &self,
        joint: &str,
        link: &str,
        error: InputError,
        instead: Option<&'static str>,
    ) -> Result<(), InputError> {
        if self.scope == Scope::Whole {
            return Err(error);
        }
        self.tolerate(joint, link, error, instead);
        Ok(())
    }

    /// Notes the first error about a link, with the replacement.
    fn tolerate(&self, joint: &str, link: &str, error: InputError, instead: Option<&'static str>) {
        let mut oddities = self.oddities.borrow_mut();
        if self.scope == Scope::Kinematics || oddities.iter().all(|oddity| oddity.link != link) {
            oddities.push(Oddity { joint: joint.into(), link: link.into(), error, instead });
        }
    }

    fn name(&self, node: Node<'a, 'a>, key: &str) -> Result<&'a str, InputError> {
        node.attribute(key).ok_or_else(|| self.error(node, format!("`{}` has no `{key}`", node.tag_name().name())))
    }

    fn number(&self, node: Node<'a, 'a>, key: &str, or: f64) -> Result<f64, InputError> {
        let Some(text) = node.attribute(key) else { return Ok(or) };
        text.trim()
            .parse::<f64>()
            .ok()
            .filter(|value| value.is_finite() && value.abs() < 1e6)
            .ok_or_else(|| self.unexpected(node, key, text, "a number"))
    }

    /// A number of a motor, which no pose depends on.
    fn of_motor(&self, node: Option<Node<'a, 'a>>, key: &str) -> Result<f64, InputError> {
        match node.filter(|_| self.scope == Scope::Whole) {
            Some(node) => self.number(node, key, 0.0),
            None => Ok(0.0),
        }
    }

    fn three(&self, node: Node<'a, 'a>, key: &str, or: [f64; 3]) -> Result<[f64; 3], InputError> {
        let Some(text) = node.attribute(key) else { return Ok(or) };
        let parts: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
        parts
            .ok()
            .and_then(|parts| <[f64; 3]>::try_from(parts).ok())
            .filter(|parts| parts.iter().all(|part| part.is_finite() && part.abs() < 1e3))
            .ok_or_else(|| self.unexpected(node, key, text, "three numbers"))
    }

    /// The `origin` of a node.
    fn origin(&self, node: Node<'a, 'a>) -> Result<Isometry3<f64>, InputError> {
        let Some(origin) = children(node, "origin").next() else { return Ok(Isometry3::identity()) };
        let [x, y, z] = self.three(origin, "xyz", [0.0; 3])?;
        let [roll, pitch, yaw] = self.three(origin, "rpy", [0.0; 3])?;
        let turn = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
        Ok(Isometry3::from_parts(Translation3::new(x, y, z), turn))
    }

    fn tree(&self, root: Node<'a, 'a>) -> Result<(KinematicTree, Vec<MeshName>), InputError> {
        let links = self.links(root)?;
        let joints = self.joints(root, &links)?;
        let tops =
            || links.iter().map(|(_, name)| *name).filter(|name| !joints.iter().any(|(_, _, child)| child == name));
        // The first one of those on which the most links hang; only one is the root of a whole robot.
        let top = match self.scope {
            Scope::Whole => tops().next(),
            Scope::Kinematics => tops().rev().max_by_key(|top| below(top, &joints).len()),
        };
        let Some(top) = top else {
            return Err(self.error(root, "every link is the child of a joint: the tree has no root".into()));
        };
        let order = below(top, &joints);
        let mut tree = KinematicTree { links: Vec::new(), dofs: self.dofs(&joints)? };
        let mut meshes = Vec::new();
        for (at, name) in order.iter().copied().enumerate() {
            let node = links.iter().find(|(_, known)| *known == name).map_or(root, |(node, _)| *node);
            let mut link = Link::massless(name, vec![]);
            if self.scope == Scope::Whole {
                link = self.link(node, name)?;
                self.meshes(node, at, &mut meshes)?;
            }
            if let Some((node, parent, child)) = joints.iter().find(|(_, _, child)| *child == name) {
                link.parent = tree.link(parent).unwrap_or(0);
                match self.placed(*node, &joints, &tree.dofs) {
                    Ok((parent_from_joint, joint)) => (link.parent_from_joint, link.joint) = (parent_from_joint, joint),
                    Err(error) => self.tolerate(node.attribute("name").unwrap_or_default(), child, error, None),
                }
            }
            tree.links.push(link);
        }
        for (node, name) in links.iter().filter(|(_, name)| !order.contains(name)) {
            let message = format!("the link `{name}` is not connected to the root `{top}`");
            self.note("", name, self.error(*node, message), None)?;
        }
        Ok((tree, meshes))
    }

    fn links(&self, root: Node<'a, 'a>) -> Result<Vec<(Node<'a, 'a>, &'a str)>, InputError> {
        let mut links: Vec<(Node<'a, 'a>, &'a str)> = Vec::new();
        for node in children(root, "link") {
            let name = self.name(node, "name")?;
            if links.iter().any(|(_, known)| *known == name) {
                let error = self.error(node, format!("the link `{name}` occurs twice"));
                self.note("", name, error, Some("the first one is used"))?;
                continue;
            }
            links.push((node, name));
        }
        if links.is_empty() || links.len() > MAX_LINKS {
            let error = self.error(root, format!("has {} links, expected 1 to {MAX_LINKS}", links.len()));
            let is_macro = |node: Node| node.tag_name().namespace().is_some_and(|name| name.contains("xacro"));
            return Err(if root.children().any(is_macro) { error.help(EXPAND) } else { error });
        }
        Ok(links)
    }

    fn joints(
        &self,
        root: Node<'a, 'a>,
        links: &[(Node<'a, 'a>, &'a str)],
    ) -> Result<Vec<JointOfLinks<'a>>, InputError> {
        let mut joints: Vec<JointOfLinks<'a>> = Vec::new();
        for node in children(root, "joint") {
            let end = |end: &'static str| match children(node, end).next() {
                Some(end) => self.name(end, "link"),
                None => Err(self.error(node, format!("the joint has no `{end}`"))),
            };
            let (parent, child) = (end("parent")?, end("child")?);
            let name = self.name(node, "name")?;
            let lacks = [parent, child].into_iter().find(|link| !links.iter().any(|(_, known)| known == link));
            let message = if let Some(link) = lacks {
                format!("the joint names the unknown link `{link}`")
            } else if joints.iter().any(|(other, ..)| other.attribute("name") == Some(name)) {
                format!("the joint `{name}` occurs twice")
            } else if joints.iter().any(|(_, _, other)| *other == child) {
                format!("the link `{child}` hangs at two joints")
            } else {
                joints.push((node, parent, child));
                continue;
            };
            self.note(name, child, self.error(node, message), None)?;
        }
        Ok(joints)
    }

    /// The meshes of a link.
    fn meshes(&self, node: Node<'a, 'a>, link: usize, meshes: &mut Vec<MeshName>) -> Result<(), InputError> {
        for (element, usage) in [("collision", MeshUse::Clearance), ("visual", MeshUse::Picture)] {
            for part in children(node, element) {
                let at = self.origin(part)?;
                let named = children(part, "geometry").flat_map(|geometry| children(geometry, "mesh"));
                for mesh in named {
                    if meshes.len() == MAX_MESHES {
                        return Err(self.error(mesh, format!("there are more than {MAX_MESHES} meshes")));
                    }
                    let scale = self.three(mesh, "scale", [1.0; 3])?;
                    if scale.contains(&0.0) {
                        return Err(self.error(mesh, "`scale` has a 0, expected three factors other than 0".into()));
                    }
                    let (file, scale) = (self.name(mesh, "filename")?.to_string(), scale.into());
                    meshes.push(MeshName { link, usage, file, scale, at, place: self.place(mesh) });
                }
            }
        }
        Ok(())
    }

    fn dofs(&self, joints: &[JointOfLinks<'a>]) -> Result<Vec<Dof>, InputError> {
        let mut dofs = Vec::new();
        for (node, _, child) in joints {
            match self.dof(*node, child) {
                Ok(dof) => dofs.extend(dof),
                Err(error) => self.tolerate(node.attribute("name").unwrap_or_default(), child, error, None),
            }
        }
        Ok(dofs)
    }

    /// The degree of freedom of a joint; `None` for one that does not move by itself.
    fn dof(&self, node: Node<'a, 'a>, child: &str) -> Result<Option<Dof>, InputError> {
        let (kind, name) = (self.name(node, "type")?, self.name(node, "name")?);
        let known = ["revolute", "continuous", "prismatic", "fixed"];
        if !known.contains(&kind) {
            let message = format!("the joint is `{kind}`, expected one of {}", known.join(", "));
            self.note(name, child, self.error(node, message), Some("it counts as fixed"))?;
            return Ok(None);
        }
        if kind == "fixed" || children(node, "mimic").next().is_some() {
            return Ok(None);
        }
        let limit = children(node, "limit").next();
        let dynamics = children(node, "dynamics").next();
        let range = self.range(node, child, kind)?;
        let some = |value: f64, or: f64| if value > 0.0 { value } else { or };
        let speed = some(self.of_motor(limit, "velocity")?, USUAL_SPEED);
        let torque = some(self.of_motor(limit, "effort")?, USUAL_TORQUE);
        let damping = self.of_motor(dynamics, "damping")?.max(0.0);
        let friction = self.of_motor(dynamics, "friction")?.max(0.0);
        // A joint that its motor could not bring to its speed has numbers of a simulator, not its own.
        let moves = damping * speed + friction < torque;
        let [damping, friction] = if moves { [damping, friction] } else { [0.0; 2] };
        let (acceleration, jerk) = (speed / SPEEDS_UP_S, f64::INFINITY);
        let armature = if kind == "prismatic" { USUAL_SLIDING_ARMATURE } else { USUAL_ARMATURE };
        Ok(Some(Dof { name: name.into(), range, torque, speed, acceleration, jerk, armature, damping, friction }))
    }

    /// The smallest and the largest position of a joint. Of a joint that is locked they are equal.
    fn range(&self, node: Node<'a, 'a>, child: &str, kind: &str) -> Result<[f64; 2], InputError> {
        let limit = children(node, "limit").next();
        let of = |key: &str, or: f64| limit.map_or(Ok(or), |limit| self.number(limit, key, or));
        let soft = children(node, "safety_controller").next();
        let soft = |key: &str, or: f64| soft.map_or(Ok(or), |soft| self.number(soft, key, or));
        let limits = || -> Result<[f64; 2], InputError> {
            let [low, high] = if kind == "continuous" { [-PI, PI] } else { [of("lower", 0.0)?, of("upper", 0.0)?] };
            Ok([low.max(soft("soft_lower_limit", low)?), high.min(soft("soft_upper_limit", high)?)])
        };
        let name = node.attribute("name").unwrap_or_default();
        let (error, range) = match limits() {
            Ok([low, high]) if low < high => return Ok([low, high]),
            Ok([low, high]) => {
                let [from, to] = [low, high].map(ShortNumber);
                let message = format!("`{name}` goes from {from} to {to}, expected the smaller end first");
                (self.error(node, message), if low == high { [low, high] } else { self.unlimited() })
            }
            Err(error) => (error, self.unlimited()),
        };
        self.tolerate(name, child, error, Some("its limits are not used"));
        Ok(range)
    }

    /// The range of a joint whose limits are not known; where all is read, it has a middle.
    fn unlimited(&self) -> [f64; 2] {
        match self.scope {
            Scope::Whole => [-PI, PI],
            Scope::Kinematics => UNLIMITED,
        }
    }

    /// The pose of a joint in the frame of its parent, and its motion.
    fn placed(
        &self,
        node: Node<'a, 'a>,
        joints: &[JointOfLinks<'a>],
        dofs: &[Dof],
    ) -> Result<(Isometry3<f64>, Option<Joint>), InputError> {
        let origin = self.origin(node)?;
        let kind = match self.name(node, "type")? {
            "revolute" | "continuous" => JointKind::Revolute,
            "prismatic" => JointKind::Prismatic,
            _ => return Ok((origin, None)),
        };
        let name = self.name(node, "name")?;
        let (driver, ratio, offset) = self.driver(node, joints)?;
        let dof = dofs
            .iter()
            .position(|dof| dof.name == driver)
            .ok_or_else(|| self.error(node, format!("`{name}` mimics `{driver}`, which does not move by itself")))?;
        let axis = match children(node, "axis").next() {
            Some(axis) => self.three(axis, "xyz", [1.0, 0.0, 0.0])?,
            None => [1.0, 0.0, 0.0],
        };
        let axis = Unit::try_new(Vector3::from(axis), 1e-6)
            .ok_or_else(|| self.error(node, format!("`{name}` has an axis without direction")))?;
        let joint = Joint { name: name.into(), kind, axis, dof, ratio };
        // The motion by the offset is about the joint's own axis: it is part of the joint's place.
        let moved = Joint { ratio: 1.0, ..joint.clone() }.motion(offset);
        Ok((origin * moved, Some(joint)))
    }

    /// The joint that drives a joint, the ratio and the offset of their positions. A joint may mimic one that mimics another.
    fn driver(&self, node: Node<'a, 'a>, joints: &[JointOfLinks<'a>]) -> Result<(&'a str, f64, f64), InputError> {
        let (mut at, mut ratio, mut offset) = (node, 1.0, 0.0);
        for _ in 0..=joints.len() {
            let name = self.name(at, "name")?;
            let Some(mimic) = children(at, "mimic").next() else { return Ok((name, ratio, offset)) };
            offset += ratio * self.number(mimic, "offset", 0.0)?;
            ratio *= self.number(mimic, "multiplier", 1.0)?;
            let driver = self.name(mimic, "joint")?;
            let Some((next, ..)) = joints.iter().find(|(other, ..)| other.attribute("name") == Some(driver)) else {
                return Ok((driver, ratio, offset));
            };
            at = *next;
        }
        Err(self.error(node, format!("`{}` mimics itself", self.name(node, "name")?)))
    }

    fn link(&self, node: Node<'a, 'a>, name: &str) -> Result<Link, InputError> {
        let mut solids = Vec::new();
        for collision in children(node, "collision") {
            let at = self.origin(collision)?;
            let Some(geometry) = children(collision, "geometry").next() else { continue };
            for shape in geometry.children().filter(Node::is_element) {
                let positive = |key: &str| match self.number(shape, key, 0.0)? {
                    size if size > 0.0 && size <= 10.0 => Ok(size),
                    size => Err(self.error(shape, format!("`{key}` is {size}, expected more than 0 and at most 10 m"))),
                };
                match shape.tag_name().name() {
                    "box" => {
                        let [x, y, z] = self.three(shape, "size", [0.0; 3])?;
                        if x.min(y).min(z) <= 0.0 {
                            return Err(self.error(shape, "a box needs three edges of more than 0 m".into()));
                        }
                        solids.push(CollisionShape::Box(at, Vector3::new(x, y, z) / 2.0));
                    }
                    "cylinder" => {
                        let (radius, length) = (positive("radius")?, positive("length")?);
                        let half = Vector3::z() * (length / 2.0 - radius).max(0.0);
                        solids.push(CollisionShape::Capsule(at * Point3::from(-half), at * Point3::from(half), radius));
                    }
                    "sphere" => {
                        let centre = at * Point3::origin();
                        solids.push(CollisionShape::Capsule(centre, centre, positive("radius")?));
                    }
                    _ => {}
                }
            }
        }
        if solids.len() > MAX_SOLIDS {
            let message = format!("`{name}` has {} shapes, at most {MAX_SOLIDS} are read", solids.len());
            return Err(self.error(node, message));
        }
        let mut link = Link::massless(name, solids);
        let Some(inertial) = children(node, "inertial").next() else { return Ok(link) };
        let at = self.origin(inertial)?;
        link.mass = children(inertial, "mass").next().map_or(Ok(0.0), |mass| self.number(mass, "value", 0.0))?;
        if !(0.0..=1e3).contains(&link.mass) {
            return Err(self.error(
                inertial,
                format!("`{name}` has a mass of {} kg, expected 0 to 1000 kg", ShortNumber(link.mass)),
            ));
        }
        link.centre = at * Point3::origin();
        link.inertia = match children(inertial, "inertia").next() {
            Some(node) => {
                let of = |key: &str| self.number(node, key, 0.0);
                let (xy, xz, yz) = (of("ixy")?, of("ixz")?, of("iyz")?);
                let own = Matrix3::new(of("ixx")?, xy, xz, xy, of("iyy")?, yz, xz, yz, of("izz")?);
                let turn = at.rotation.to_rotation_matrix();
                match balanced(own) {
                    Some(own) => turn * own * turn.transpose(),
                    None => {
                        let message = "has an impossible inertia, expected three moments of 0 or more";
                        let error = self.error(node, format!("`{name}` {message}"));
                        self.tolerate("", name, error, Some("the inertia of its shapes is used"));
                        inertia_of(link.mass, &link.solids).1
                    }
                }
            }
            None => inertia_of(link.mass, &link.solids).1,
        };
        Ok(link)
    }
}
