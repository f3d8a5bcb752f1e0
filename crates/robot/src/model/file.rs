//! Robot files: YAML text in, a [`Robot`] out.
//!
//! A file describes a tree of links and joints, with a hand on it or not; or names a URDF file (`urdf`) and its fingertips; or puts such files
//! together (`parts`). Every link, joint
//! and finger says where its numbers come from. Unknown keys, missing units, impossible numbers and trees that do not close are refused at
//! their line.

mod assembly;
mod joint_names;
mod joints;

use super::mesh::{self, BytesOf, Meshes, Packages};
use super::shipped;
use crate::kinematics::finger::FingerSpec;
use crate::model::hand::{self, HandModel};
use crate::model::robot::Robot;
use assembly::assembly;
use indexmap::IndexMap;
use joint_names::rename_joints;
use joints::{JointFile, LimitFile, dofs, limit, made_joint};
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_base::geometry::pose;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::quantity::{Force, Length, Mass};
use teachtree_base::short_number::ShortNumber;
use teachtree_base::spelling::nearest;
use teachtree_base::yaml;
use teachtree_description::limits::{MAX_LINKS, MAX_SOLIDS};
use teachtree_description::shape::{CollisionShape, inertia_of};
use teachtree_description::tree::{KinematicTree, Link};
use teachtree_description::urdf;

/// The largest robot file that is read, bytes.
pub const MAX_BYTES: u64 = 4 << 20;
/// No fingertip presses harder, N. Ours: strong grippers for the table reach it, hands have a tenth of it.
const MAX_FORCE_N: f64 = 200.0;
/// Assemblies stand at most this deep in each other.
const MAX_DEPTH: usize = 4;

/// A robot: links and joints, or a URDF file with its fingertips, or such files put together.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct RobotFile {
    /// A name to show.
    name: String,
    /// The fixed link; by default the only link that is not a child.
    #[serde(default)]
    root: Option<String>,
    /// The links by name.
    #[serde(default)]
    links: IndexMap<String, LinkFile>,
    /// The joints by name.
    #[serde(default)]
    joints: IndexMap<String, JointFile>,
    /// A URDF file beside this one, in place of links and joints.
    #[serde(default)]
    urdf: Option<String>,
    /// Where the root of the URDF is, reference frame.
    #[serde(default)]
    at: [Length; 3],
    /// How it is turned there, quaternion w x y z.
    #[serde(default = "no_turn")]
    turned: [f64; 4],
    /// Which of its meshes are read.
    #[serde(default)]
    meshes: Meshes,
    /// The folders of packages that its meshes are in, by package, from the folder of this file.
    #[serde(default)]
    packages: IndexMap<String, String>,
    /// What the URDF does not say of its joints, by joint.
    #[serde(default)]
    limits: IndexMap<String, LimitFile>,
    /// The names of joints at their controllers, as `/joint_states` has them, by the names in this file: `part/joint` for a joint of a part.
    #[serde(default)]
    joint_names: IndexMap<String, String>,
    /// Its hand.
    #[serde(default)]
    hand: Option<HandFile>,
    /// Robots that it is put together of, by name.
    #[serde(default)]
    parts: IndexMap<String, PartFile>,
}

impl RobotFile {
    /// A key that only a file with `urdf` may have, and that is there.
    fn of_urdf(&self) -> Option<&'static str> {
        let there = [
            ("limits", !self.limits.is_empty()),
            ("at", self.at != [Length::default(); 3]),
            ("turned", self.turned != no_turn()),
            ("meshes", self.meshes != Meshes::All),
            ("packages", !self.packages.is_empty()),
        ];
        there.into_iter().find(|(_, there)| *there).map(|(key, _)| key)
    }
}

/// A rigid link.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct LinkFile {
    /// Its mass.
    mass: Mass,
    /// Its solid shapes, frame of the link.
    #[serde(default)]
    parts: Vec<SolidFile>,
    /// Where the numbers come from.
    source: String,
}

/// A capsule from the origin along x: length, radius. Or a box of these edges.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct SolidFile {
    /// From the origin along x: length and radius.
    #[serde(default)]
    capsule: Option<[Length; 2]>,
    /// Edges.
    #[serde(default, rename = "box")]
    cuboid: Option<[Length; 3]>,
    /// Where it is, frame of the link.
    #[serde(default)]
    at: [Length; 3],
    /// How it is turned there, quaternion w x y z.
    #[serde(default = "no_turn")]
    turned: [f64; 4],
}

/// A hand of the robot.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct HandFile {
    /// Left or right.
    side: Side,
    /// The link of the palm.
    palm: String,
    /// The fingertips by finger.
    fingers: IndexMap<Finger, FingerFile>,
}

/// A fingertip.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct FingerFile {
    /// The link that it is on.
    link: String,
    /// The middle of the fingertip, frame of the link.
    tip: [Length; 3],
    /// Its radius.
    radius: Length,
    /// The direction out of its pad, frame of the link.
    pad: [f64; 3],
    /// The radius of a disc of the same area, for a flat pad; by default a soft fingertip.
    #[serde(default)]
    pad_radius: Option<Length>,
    /// The largest force that it presses with.
    force: Force,
    /// Where the numbers come from.
    source: String,
}

/// A robot that is part of this one.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct PartFile {
    /// A shipped robot, or a file.
    robot: String,
    /// The side of its hand, for a hand that both sides may have, such as a gripper.
    #[serde(default)]
    side: Option<Side>,
    /// The link on which it is mounted, `part.link`; by default the ground.
    #[serde(default)]
    on: Option<String>,
    /// Where its root is there.
    #[serde(default)]
    at: [Length; 3],
    /// How its root is turned there, quaternion w x y z.
    #[serde(default = "no_turn")]
    turned: [f64; 4],
    /// Where the numbers come from.
    source: String,
}

const fn no_turn() -> [f64; 4] {
    [1.0, 0.0, 0.0, 0.0]
}

/// The schema of robot files.
pub fn schema() -> schemars::Schema {
    schemars::schema_for!(RobotFile)
}

/// Returns the text of a file.
pub type TextOf<'a> = &'a dyn Fn(&str) -> Result<String, InputError>;

/// How the files of a robot are read.
#[derive(Clone, Copy)]
pub struct RobotFiles<'a> {
    /// Texts.
    pub text_of: TextOf<'a>,
    /// Meshes; without it they are left out.
    pub bytes_of: Option<BytesOf<'a>>,
}

/// The robot of this name without its meshes: a shipped one, or a file whose text `text_of` gives.
///
/// # Errors
/// What is wrong with the file, at its line; that there is no such robot.
pub fn open(name: &str, text_of: TextOf<'_>) -> Result<Robot, InputError> {
    nested(name, RobotFiles { text_of, bytes_of: None }, 0)
}

/// The robot of this name with its meshes.
///
/// # Errors
/// As [`open`]; a mesh that is not there, damaged, or too large.
pub fn open_with_meshes(name: &str, text_of: TextOf<'_>, bytes_of: BytesOf<'_>) -> Result<Robot, InputError> {
    nested(name, RobotFiles { text_of, bytes_of: Some(bytes_of) }, 0)
}

fn nested(name: &str, files: RobotFiles<'_>, depth: usize) -> Result<Robot, InputError> {
    if let Some(text) = shipped::text(name) {
        return from_text(text, &format!("robots/{name}.yaml"), files, depth);
    }
    if !(name.ends_with(".yaml") || name.ends_with(".yml")) {
        let known: Vec<_> = shipped::names().map(|name| format!("`{name}`")).collect();
        return Err(InputError::new(name, "is neither a shipped robot nor a file that ends in .yaml").help(
            if name.ends_with(".urdf") {
                "name the URDF and its fingertips in a YAML file: docs/robot_files.md".into()
            } else if let Some(near) = nearest(name, shipped::names()) {
                format!("did you mean `{near}`?")
            } else {
                format!("shipped are {}", known.join(", "))
            },
        ));
    }
    from_text(&(files.text_of)(name)?, name, files, depth)
}

/// Reads a robot; `file` is its name in errors. Parts may be shipped robots only.
///
/// # Errors
/// What is wrong with it, at its line.
pub fn read(text: &str, file: &str) -> Result<Robot, InputError> {
    let text_of = |part: &str| Err(InputError::new(part, "is not a shipped robot"));
    from_text(text, file, RobotFiles { text_of: &text_of, bytes_of: None }, 0)
}

fn from_text(text: &str, file: &str, files: RobotFiles<'_>, depth: usize) -> Result<Robot, InputError> {
    let mut parsed: RobotFile = yaml::read(text, file)?;
    let places = SourceMap { text, file };
    let joint_names = std::mem::take(&mut parsed.joint_names);
    let mut built = if let Some(urdf) = &parsed.urdf {
        if parsed.root.is_some() || parsed.links.len() + parsed.joints.len() + parsed.parts.len() > 0 {
            let message = "is given beside `root`, `links`, `joints` or `parts`, expected one of them";
            return Err(places.error("urdf", "", message.into()));
        }
        let beside = beside(file, urdf);
        let (mut tree, meshes, oddities) = urdf::with_meshes(&(files.text_of)(&beside)?, &beside)?;
        if let Some(bytes_of) = files.bytes_of {
            let own = parsed.packages.iter();
            let named = own.map(|(package, folder)| (package.clone(), self::beside(file, folder).into())).collect();
            let folder = Path::new(&beside).parent().unwrap_or(Path::new(""));
            mesh::load(&mut tree, &meshes, parsed.meshes, &Packages { folder, named }, bytes_of)?;
        }
        let place = placed(parsed.at, parsed.turned, &places, "turned", "")?;
        if let Some(root) = tree.links.first_mut() {
            root.parent_from_joint = place * root.parent_from_joint;
        }
        limit(&mut tree, &parsed.limits, &places)?;
        // Within parts, these joints keep their names.
        let joint_names = tree.dofs.iter().map(|dof| (dof.name.clone(), dof.name.clone())).collect();
        let mut built = Robot { name: parsed.name, tree, hands: IndexMap::new(), joint_names, oddities };
        if let Some(hand) = parsed.hand {
            let side = hand.side;
            let links: Vec<String> = hand.fingers.values().map(|finger| finger.link.clone()).collect();
            // A finger may not move since its joint was not read.
            let made = made_hand(&built, hand, &places).map_err(|error| built.oddity_above(&links).unwrap_or(error))?;
            built.hands.insert(side, made);
        }
        built
    } else if let Some(key) = parsed.of_urdf() {
        return Err(places.error(key, "", "is given without `urdf`, expected both".into()));
    } else if parsed.parts.is_empty() {
        single(parsed, &places)?
    } else {
        let beside = [
            ("root", parsed.root.is_some()),
            ("links", !parsed.links.is_empty()),
            ("joints", !parsed.joints.is_empty()),
            ("hand", parsed.hand.is_some()),
        ];
        if let Some((key, _)) = beside.iter().find(|(_, there)| *there) {
            return Err(places.error(key, "", "is given beside `parts`, expected one of the two".into()));
        }
        assembly(parsed, &places, files, depth)?
    };
    rename_joints(&mut built, joint_names, &places)?;
    // A part may be the arm of another one.
    if depth == 0 {
        built.check_oddities()?;
        built.add_motors();
    }
    if built.tree.links.len() > MAX_LINKS {
        return Err(InputError::new(
            file,
            format!("has {} links, at most {MAX_LINKS} are read", built.tree.links.len()),
        ));
    }
    Ok(built)
}

/// A file that another one names: it lies beside it.
fn beside(file: &str, name: &str) -> String {
    let folder = Path::new(file).parent();
    folder.map_or_else(|| name.into(), |folder| folder.join(name).display().to_string())
}

/// Where things stand in a text: what is wrong between entries has no place of its own in the YAML crate.
struct SourceMap<'a> {
    text: &'a str,
    file: &'a str,
}

impl SourceMap<'_> {
    /// An error at the entry `key` of `section`, or at the section when `key` is empty.
    fn error(&self, section: &str, key: &str, message: String) -> InputError {
        let starts = |line: &str, word: &str| {
            let line = line.trim_start();
            line.strip_prefix(word).is_some_and(|rest| rest.trim_start().starts_with(':'))
        };
        let from = self.text.lines().position(|line| starts(line, section));
        let line = match (from, key.is_empty()) {
            (Some(from), false) => self
                .text
                .lines()
                .skip(from + 1)
                .position(|line| starts(line, key))
                .map(|at| from + 1 + at)
                .or(Some(from)),
            (from, _) => from,
        };
        let place = line.map_or_else(|| self.file.to_string(), |line| format!("{}:{}", self.file, line + 1));
        let what = if key.is_empty() { String::new() } else { format!("`{key}` ") };
        InputError::new(place, format!("{what}{message}"))
    }
}

/// A tree of links and joints.
fn single(file: RobotFile, places: &SourceMap<'_>) -> Result<Robot, InputError> {
    let RobotFile { name, root, links, joints, hand, .. } = file;
    let root = root.ok_or_else(|| InputError::new(places.file, "the key `root` is missing: the fixed link"))?;
    if links.len() > MAX_LINKS {
        return Err(places.error("links", "", format!("there are {}, at most {MAX_LINKS} are read", links.len())));
    }
    if !links.iter().any(|(name, _)| *name == root) {
        return Err(places.error("root", "", format!("found `{root}`, expected the name of a link")));
    }
    // Every link but the root hangs at one joint.
    for (at, (name, joint)) in joints.iter().enumerate() {
        for (end, link) in [("parent", &joint.parent), ("child", &joint.child)] {
            if !links.iter().any(|(known, _)| known == link) {
                return Err(places.error("joints", name, format!("has the {end} `{link}`, which is not a link")));
            }
        }
        if joint.child == root {
            return Err(places.error("joints", name, format!("has the child `{root}`, but that is the root")));
        }
        if let Some((other, _)) = joints.iter().take(at).find(|(_, one)| one.child == joint.child) {
            let message = format!("has the child `{}`, which is a child of `{other}` already", joint.child);
            return Err(places.error("joints", name, message));
        }
    }
    // Parents first: whatever cannot be reached from the root is a loop or hangs in the air.
    let mut order = vec![root.clone()];
    let mut at = 0;
    while let Some(parent) = order.get(at).cloned() {
        order.extend(joints.iter().filter(|(_, joint)| joint.parent == parent).map(|(_, joint)| joint.child.clone()));
        at += 1;
    }
    if let Some((name, _)) = links.iter().find(|(name, _)| !order.contains(name)) {
        let message = format!("is not connected to the root `{root}`: {}", above(name, &joints));
        return Err(places.error("links", name, message));
    }
    let dofs = dofs(&joints, places)?;
    let tree = KinematicTree { links: Vec::new(), dofs };
    let mut built = Robot { name, tree, hands: IndexMap::new(), joint_names: BTreeMap::new(), oddities: Vec::new() };
    for name in &order {
        let Some((_, link)) = links.get_key_value(name) else { continue };
        let (mut made, hangs) = (made_link(name, link, places)?, joints.iter().find(|(_, joint)| joint.child == *name));
        if let Some((joint_name, joint)) = hangs {
            made.parent = built.tree.link(&joint.parent).unwrap_or(0);
            made.parent_from_joint = placed(joint.at, joint.turned, places, "joints", joint_name)?;
            made.joint = Some(made_joint(joint_name, joint, &joints, &built.tree.dofs, places)?);
        }
        built.tree.links.push(made);
    }
    if let Some(file) = hand {
        let side = file.side;
        let made = made_hand(&built, file, places)?;
        built.hands.insert(side, made);
    }
    Ok(built)
}

/// Describes the parent of a link that is not connected to the root.
fn above(link: &str, joints: &IndexMap<String, JointFile>) -> String {
    let mut way = vec![link];
    loop {
        let at = way[way.len() - 1];
        let Some((joint, file)) = joints.iter().find(|(_, joint)| joint.child == at) else {
            return format!("`{at}` is the child of no joint");
        };
        if file.parent == at {
            return format!("`{at}` is its own parent, by `{joint}`");
        }
        if let Some(begins) = way.iter().position(|known| *known == file.parent) {
            let ring: Vec<String> =
                way[begins..].iter().chain([&way[begins]]).map(|link| format!("`{link}`")).collect();
            return format!("{} form a cycle", ring.join(", "));
        }
        way.push(&file.parent);
    }
}

fn made_link(name: &str, link: &LinkFile, places: &SourceMap<'_>) -> Result<Link, InputError> {
    let refuse = |message: String| places.error("links", name, message);
    if link.source.trim().is_empty() {
        return Err(refuse("has an empty `source`, expected where its numbers come from, such as `ours`".into()));
    }
    if !(0.0..=1e3).contains(&link.mass.0) {
        return Err(refuse(format!("has a mass of {} kg, expected 0 to 1000 kg", ShortNumber(link.mass.0))));
    }
    let size = |size: Length| {
        if size.0 > 0.0 && size.0 <= 10.0 {
            Ok(size.0)
        } else {
            Err(refuse(format!("has a part of {} m, expected more than 0 and at most 10 m", ShortNumber(size.0))))
        }
    };
    let mut solids = Vec::new();
    if link.parts.len() > MAX_SOLIDS {
        return Err(refuse(format!("has {} parts, at most {MAX_SOLIDS} are read", link.parts.len())));
    }
    for part in &link.parts {
        let at = placed(part.at, part.turned, places, "links", name)?;
        solids.push(match (part.capsule, part.cuboid) {
            (Some([length, radius]), None) => {
                CollisionShape::Capsule(at * Point3::origin(), at * Point3::new(size(length)?, 0.0, 0.0), size(radius)?)
            }
            (None, Some([x, y, z])) => CollisionShape::Box(at, Vector3::new(size(x)?, size(y)?, size(z)?) / 2.0),
            _ => return Err(refuse("has a part with neither or both of `capsule` and `box`, expected one".into())),
        });
    }
    let (centre, inertia) = inertia_of(link.mass.0, &solids);
    Ok(Link { mass: link.mass.0, centre, inertia, ..Link::massless(name, solids) })
}

fn placed(
    at: [Length; 3],
    turned: [f64; 4],
    places: &SourceMap<'_>,
    section: &str,
    key: &str,
) -> Result<Isometry3<f64>, InputError> {
    let length = turned.iter().map(|part| part * part).sum::<f64>().sqrt();
    if !(length > 1e-6 && length.is_finite()) {
        return Err(places.error(section, key, format!("is turned by {turned:?}, expected a quaternion w x y z")));
    }
    if at.iter().any(|part| part.0.abs() > 10.0) {
        return Err(places.error(section, key, "is more than 10 m away".into()));
    }
    Ok(pose(at.map(|part| part.0), turned))
}

fn made_hand(robot: &Robot, file: HandFile, places: &SourceMap<'_>) -> Result<HandModel, InputError> {
    let refuse = |key: &str, message: String| places.error("hand", key, message);
    let palm = robot
        .tree
        .link(&file.palm)
        .ok_or_else(|| refuse("palm", format!("found `{}`, expected the name of a link", file.palm)))?;
    let mut specs = Vec::new();
    for (finger, file) in &file.fingers {
        let name = finger.name();
        let link = robot
            .tree
            .link(&file.link)
            .ok_or_else(|| refuse(name, format!("ends at the link `{}`, which does not exist", file.link)))?;
        if file.source.trim().is_empty() {
            return Err(refuse(name, "has an empty `source`".into()));
        }
        if *finger == Finger::Palm {
            return Err(refuse(name, "is not a finger".into()));
        }
        if !(1e-4..=0.1).contains(&file.radius.0) {
            return Err(refuse(
                name,
                format!("has a tip of radius {} m, expected 0.1 mm to 100 mm", ShortNumber(file.radius.0)),
            ));
        }
        if !(file.force.0 > 0.0 && file.force.0 <= MAX_FORCE_N) {
            let found = ShortNumber(file.force.0);
            return Err(refuse(
                name,
                format!("has a force of {found} N, expected more than 0 and at most {MAX_FORCE_N} N"),
            ));
        }
        if let Some(pad_radius) = file.pad_radius.filter(|radius| !(1e-3..=0.05).contains(&radius.0)) {
            let found = ShortNumber(pad_radius.0);
            return Err(refuse(name, format!("has a `pad_radius` of {found} m, expected 1 mm to 50 mm")));
        }
        let pad = Unit::try_new(Vector3::from(file.pad), 1e-6)
            .ok_or_else(|| refuse(name, "has a `pad` without direction".into()))?;
        specs.push(FingerSpec {
            finger: *finger,
            link,
            tip: Point3::from(file.tip.map(|part| part.0)),
            radius: file.radius.0,
            pad,
            pad_radius: file.pad_radius.map(|radius| radius.0),
            force: file.force.0,
        });
    }
    hand::build(&robot.tree, palm, &specs)
        .map_err(|(finger, message)| refuse(finger.map_or("palm", Finger::name), message))
}
