//! URDF: the text of a robot description in, a tree of links and joints out; the only file of this crate that names the XML library.
//!
//! Read are joints (revolute, continuous, prismatic, fixed; `mimic`), their limits, also soft ones, masses and inertias, and collision shapes that are boxes,
//! cylinders (as bars with round ends) and balls. Of meshes the names are given. Where a joint says nothing of its motor, a small one is taken.

use super::limits::{MAX_LINKS, MAX_MESHES, MAX_SOLIDS, SPEEDS_UP_S};
use super::mesh::{MeshName, MeshUse};
use super::shape::{CollisionShape, inertia_of};
use super::tree::{Dof, Joint, JointKind, KinematicTree, Link};
use nalgebra::{Isometry3, Matrix3, Point3, Translation3, Unit, UnitQuaternion, Vector3};
use roxmltree::{Document, Node, ParsingOptions};
use std::borrow::Cow;
use std::f64::consts::PI;
use teachtree_base::error::InputError;
use teachtree_base::short_number::ShortNumber;

/// The largest URDF text that is read, in bytes, and how many nodes it may have.
const MAX_BYTES: usize = 4 << 20;
const MAX_NODES: u32 = 200_000;
/// So many undeclared prefixes are let through.
const MAX_PREFIXES: usize = 8;
/// What a joint has that says nothing of it: torque, N m, speed, rad/s, armature, kg m^2.
const USUAL_TORQUE: f64 = 1.0;
const USUAL_SPEED: f64 = 6.0;
const USUAL_ARMATURE: f64 = 2e-4;

/// Reads a URDF text without its meshes; `file` is its name in errors.
///
/// # Errors
/// What is wrong with it, at its line.
pub fn read(text: &str, file: &str) -> Result<KinematicTree, InputError> {
    Ok(with_meshes(text, file)?.0)
}

/// Reads a URDF text, and the names of the meshes that its links have.
///
/// # Errors
/// What is wrong with it, at its line.
pub fn with_meshes(text: &str, file: &str) -> Result<(KinematicTree, Vec<MeshName>), InputError> {
    if text.len() > MAX_BYTES {
        return Err(InputError::new(file, format!("the file has {} bytes, at most {MAX_BYTES} are read", text.len())));
    }
    let declared = with_prefixes(text);
    let document = Document::parse_with_options(&declared, options()).map_err(|error| {
        let at = error.pos();
        InputError::new(format!("{file}:{}:{}", at.row, at.col), format!("is no XML: {error}"))
    })?;
    let reader = Reader { document: &document, file };
    let root = document.root_element();
    if root.tag_name().name() != "robot" {
        return Err(reader.error(root, format!("found `{}`, expected `robot`", root.tag_name().name())));
    }
    reader.tree(root)
}

const fn options<'a>() -> ParsingOptions<'a> {
    ParsingOptions { nodes_limit: MAX_NODES, allow_dtd: false, entity_resolver: None }
}

/// The text with declarations of the prefixes that it uses without them: files have elements for simulators, such as `drake:`, which are passed over.
fn with_prefixes(text: &str) -> Cow<'_, str> {
    let mut declared = Cow::Borrowed(text);
    for _ in 0..MAX_PREFIXES {
        let Err(roxmltree::Error::UnknownNamespace(prefix, _)) = Document::parse_with_options(&declared, options())
        else {
            break;
        };
        let Some(at) = declared.find("<robot").map(|at| at + "<robot".len()) else { break };
        declared.to_mut().insert_str(at, &format!(" xmlns:{prefix}=\"{prefix}\""));
    }
    declared
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
}

fn children<'a>(node: Node<'a, 'a>, name: &'static str) -> impl Iterator<Item = Node<'a, 'a>> {
    // Elements of simulators may have the same names under a prefix of their own.
    let wanted = (node.tag_name().namespace(), name);
    node.children().filter(move |child| (child.tag_name().namespace(), child.tag_name().name()) == wanted)
}

impl<'a> Reader<'a> {
    fn place(&self, node: Node<'_, '_>) -> String {
        let at = self.document.text_pos_at(node.range().start);
        format!("{}:{}:{}", self.file, at.row, at.col)
    }

    fn error(&self, node: Node<'_, '_>, message: String) -> InputError {
        InputError::new(self.place(node), message)
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
            .ok_or_else(|| self.error(node, format!("`{key}` is `{text}`, expected a number")))
    }

    fn three(&self, node: Node<'a, 'a>, key: &str, or: [f64; 3]) -> Result<[f64; 3], InputError> {
        let Some(text) = node.attribute(key) else { return Ok(or) };
        let parts: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
        parts
            .ok()
            .and_then(|parts| <[f64; 3]>::try_from(parts).ok())
            .filter(|parts| parts.iter().all(|part| part.is_finite() && part.abs() < 1e3))
            .ok_or_else(|| self.error(node, format!("`{key}` is `{text}`, expected three numbers")))
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
        let mut links: Vec<(Node<'a, 'a>, &'a str)> = Vec::new();
        for node in children(root, "link") {
            let name = self.name(node, "name")?;
            if links.iter().any(|(_, known)| *known == name) {
                return Err(self.error(node, format!("the link `{name}` is there twice")));
            }
            links.push((node, name));
        }
        if links.is_empty() || links.len() > MAX_LINKS {
            return Err(self.error(root, format!("has {} links, expected 1 to {MAX_LINKS}", links.len())));
        }
        let mut joints = Vec::new();
        for node in children(root, "joint") {
            let end = |end: &'static str| match children(node, end).next() {
                Some(end) => self.name(end, "link"),
                None => Err(self.error(node, format!("the joint has no `{end}`"))),
            };
            let (parent, child) = (end("parent")?, end("child")?);
            for link in [parent, child] {
                if !links.iter().any(|(_, known)| *known == link) {
                    return Err(self.error(node, format!("the joint names `{link}`, which is no link")));
                }
            }
            let name = self.name(node, "name")?;
            if joints.iter().any(|(other, ..): &(Node, _, _)| other.attribute("name") == Some(name)) {
                return Err(self.error(node, format!("the joint `{name}` is there twice")));
            }
            if joints.iter().any(|(_, _, other)| *other == child) {
                return Err(self.error(node, format!("the link `{child}` hangs at two joints")));
            }
            joints.push((node, parent, child));
        }
        let top = links.iter().find(|(_, name)| !joints.iter().any(|(_, _, child)| child == name));
        let Some((_, top)) = top else {
            return Err(self.error(root, "no link is the root: the tree does not close".into()));
        };
        let mut tree = KinematicTree { links: Vec::new(), dofs: self.dofs(&joints)? };
        let mut meshes = Vec::new();
        let mut order = vec![*top];
        let mut at = 0;
        while let Some(&name) = order.get(at) {
            order.extend(joints.iter().filter(|(_, parent, _)| *parent == name).map(|(_, _, child)| *child));
            let node = links.iter().find(|(_, known)| *known == name).map_or(root, |(node, _)| *node);
            let mut link = self.link(node, name)?;
            if let Some((joint, parent, _)) = joints.iter().find(|(_, _, child)| *child == name) {
                link.parent = tree.link(parent).unwrap_or(0);
                link.joint = self.joint(*joint, &tree.dofs)?;
                link.parent_from_joint = self.origin(*joint)? * self.offset(*joint, link.joint.as_ref())?;
            }
            self.meshes(node, at, &mut meshes)?;
            tree.links.push(link);
            at += 1;
        }
        if let Some((node, name)) = links.iter().find(|(_, name)| !order.contains(name)) {
            return Err(
                self.error(*node, format!("the link `{name}` does not hang on `{top}`: the tree does not close"))
            );
        }
        Ok((tree, meshes))
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
                        return Err(self.error(mesh, "`scale` has a 0, expected three factors".into()));
                    }
                    let (file, scale) = (self.name(mesh, "filename")?.to_string(), scale.into());
                    meshes.push(MeshName { link, usage, file, scale, at, place: self.place(mesh) });
                }
            }
        }
        Ok(())
    }

    fn dofs(&self, joints: &[(Node<'a, 'a>, &str, &str)]) -> Result<Vec<Dof>, InputError> {
        let mut dofs = Vec::new();
        for (node, ..) in joints {
            let kind = self.name(*node, "type")?;
            let known = ["revolute", "continuous", "prismatic", "fixed"];
            if !known.contains(&kind) {
                return Err(self.error(*node, format!("the joint is `{kind}`, expected one of {}", known.join(", "))));
            }
            if kind == "fixed" || children(*node, "mimic").next().is_some() {
                continue;
            }
            let name = self.name(*node, "name")?;
            let limit = children(*node, "limit").next();
            let of = |key: &str, or: f64| limit.map_or(Ok(or), |limit| self.number(limit, key, or));
            let [low, high] = if kind == "continuous" { [-PI, PI] } else { [of("lower", 0.0)?, of("upper", 0.0)?] };
            let soft = children(*node, "safety_controller").next();
            let soft = |key: &str, or: f64| soft.map_or(Ok(or), |soft| self.number(soft, key, or));
            let range = [low.max(soft("soft_lower_limit", low)?), high.min(soft("soft_upper_limit", high)?)];
            if range[0] >= range[1] {
                let message = format!(
                    "`{name}` goes from {} to {}, expected the smaller end first",
                    ShortNumber(range[0]),
                    ShortNumber(range[1])
                );
                return Err(self.error(*node, message));
            }
            let some = |value: f64, or: f64| if value > 0.0 { value } else { or };
            let dynamics = children(*node, "dynamics").next();
            let moving = |key: &str| dynamics.map_or(Ok(0.0), |dynamics| self.number(dynamics, key, 0.0));
            let speed = some(of("velocity", 0.0)?, USUAL_SPEED);
            let torque = some(of("effort", 0.0)?, USUAL_TORQUE);
            let (damping, friction) = (moving("damping")?.max(0.0), moving("friction")?.max(0.0));
            // A joint that its motor could not bring to its speed has numbers of a simulator, not its own.
            let moves = damping * speed + friction < torque;
            let [damping, friction] = if moves { [damping, friction] } else { [0.0; 2] };
            let acceleration = speed / SPEEDS_UP_S;
            let armature = USUAL_ARMATURE;
            let jerk = f64::INFINITY;
            dofs.push(Dof { name: name.into(), range, torque, speed, acceleration, jerk, armature, damping, friction });
        }
        Ok(dofs)
    }

    fn joint(&self, node: Node<'a, 'a>, dofs: &[Dof]) -> Result<Option<Joint>, InputError> {
        let kind = match self.name(node, "type")? {
            "fixed" => return Ok(None),
            "prismatic" => JointKind::Prismatic,
            _ => JointKind::Revolute,
        };
        let name = self.name(node, "name")?;
        let (mut driver, mut ratio) = (name, 1.0);
        if let Some(mimic) = children(node, "mimic").next() {
            (driver, ratio) = (self.name(mimic, "joint")?, self.number(mimic, "multiplier", 1.0)?);
        }
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
        Ok(Some(Joint { name: name.into(), kind, axis, dof, ratio }))
    }

    /// The motion of a joint by the offset of its `mimic`: about its own axis it is part of the joint's place.
    fn offset(&self, node: Node<'a, 'a>, joint: Option<&Joint>) -> Result<Isometry3<f64>, InputError> {
        let (Some(joint), Some(mimic)) = (joint, children(node, "mimic").next()) else {
            return Ok(Isometry3::identity());
        };
        let offset = self.number(mimic, "offset", 0.0)?;
        Ok(Joint { ratio: 1.0, ..joint.clone() }.motion(offset))
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
                let negative = || {
                    let message = "has an inertia that no body has, expected three moments of which none is negative";
                    self.error(node, format!("`{name}` {message}"))
                };
                let own = balanced(own).ok_or_else(negative)?;
                let turn = at.rotation.to_rotation_matrix();
                turn * own * turn.transpose()
            }
            None => inertia_of(link.mass, &link.solids).1,
        };
        Ok(link)
    }
}
