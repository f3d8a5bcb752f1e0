//! Robot files: YAML text in, a [`Robot`] out.
//!
//! A file describes a tree of links and joints, with a hand on it or not; or names a URDF file (`urdf`) and its fingertips; or puts such files
//! together (`parts`). Every link, joint
//! and finger says where its numbers come from. Unknown keys, missing units, impossible numbers and trees that do not close are refused at
//! their line.

mod assembly;

use super::hand::{self, FingerSpec, HandModel};
use super::shipped;
use super::tree::{Dof, Joint, Kind, Link, Robot, Solid};
use super::urdf;
use crate::base::error::InputError;
use crate::base::geometry::pose;
use crate::base::hands::{Finger, Side};
use crate::base::quantity::{Acceleration, Angle, AngularSpeed, Force, Length, Mass, Quantity, Speed};
use crate::base::yaml::{self, Entries};
use assembly::assembly;
use indexmap::IndexMap;
use nalgebra::{Isometry3, Matrix3, Point3, Unit, Vector3};
use serde::Deserialize;
use std::f64::consts::TAU;

type Torque = Quantity<2, 1, -2, 0>;
type Inertia = Quantity<2, 1, 0, 0>;
type AngularAcceleration = Quantity<0, 0, -2, 1>;
type TurningDamping = Quantity<2, 1, -1, -1>;

/// A joint that says nothing of its acceleration comes up to its speed in this time, s.
pub(super) const SPEEDS_UP_S: f64 = 0.25;
/// No robot has more links.
pub const MAX_LINKS: usize = 256;
/// Assemblies stand at most this deep in each other.
const MAX_DEPTH: usize = 4;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RobotFile {
    name: String,
    #[serde(default)]
    root: Option<String>,
    #[serde(default = "none")]
    links: Entries<String, LinkFile>,
    #[serde(default = "none")]
    joints: Entries<String, JointFile>,
    /// A URDF file beside this one, in place of links and joints.
    #[serde(default)]
    urdf: Option<String>,
    #[serde(default)]
    hand: Option<HandFile>,
    #[serde(default = "none")]
    parts: Entries<String, PartFile>,
}

fn none<V>() -> Entries<String, V> {
    Entries(Vec::new())
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LinkFile {
    mass: Mass,
    #[serde(default)]
    parts: Vec<SolidFile>,
    source: String,
}

/// A capsule from the origin along x: length, radius. Or a box of these edges.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SolidFile {
    #[serde(default)]
    capsule: Option<[Length; 2]>,
    #[serde(default, rename = "box")]
    cuboid: Option<[Length; 3]>,
    #[serde(default)]
    at: [Length; 3],
    #[serde(default = "no_turn")]
    turned: [f64; 4],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct JointFile {
    parent: String,
    child: String,
    #[serde(default)]
    at: [Length; 3],
    #[serde(default = "no_turn")]
    turned: [f64; 4],
    #[serde(default)]
    axis: Option<[f64; 3]>,
    #[serde(default)]
    range: Option<[Angle; 2]>,
    #[serde(default)]
    travel: Option<[Length; 2]>,
    #[serde(default)]
    torque: Option<Torque>,
    #[serde(default)]
    force: Option<Force>,
    #[serde(default)]
    speed: Option<AngularSpeed>,
    #[serde(default)]
    slide_speed: Option<Speed>,
    #[serde(default)]
    acceleration: Option<AngularAcceleration>,
    #[serde(default)]
    slide_acceleration: Option<Acceleration>,
    #[serde(default)]
    armature: Inertia,
    #[serde(default)]
    damping: TurningDamping,
    #[serde(default)]
    friction: Torque,
    #[serde(default)]
    coupled: Option<CoupledFile>,
    source: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CoupledFile {
    to: String,
    ratio: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct HandFile {
    side: Side,
    palm: String,
    fingers: IndexMap<Finger, FingerFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FingerFile {
    link: String,
    tip: [Length; 3],
    radius: Length,
    pad: [f64; 3],
    force: Force,
    source: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PartFile {
    robot: String,
    #[serde(default)]
    on: Option<String>,
    #[serde(default)]
    at: [Length; 3],
    #[serde(default = "no_turn")]
    turned: [f64; 4],
    source: String,
}

const fn no_turn() -> [f64; 4] {
    [1.0, 0.0, 0.0, 0.0]
}

/// The robot of this name: a shipped one, or a file whose text `text_of` gives.
///
/// # Errors
/// What is wrong with the file, at its line; that there is no such robot.
pub fn open(name: &str, text_of: &dyn Fn(&str) -> Result<String, InputError>) -> Result<Robot, InputError> {
    nested(name, text_of, 0)
}

fn nested(name: &str, text_of: &dyn Fn(&str) -> Result<String, InputError>, depth: usize) -> Result<Robot, InputError> {
    if let Some(text) = shipped::text(name) {
        return from_text(text, &format!("robots/{name}.yaml"), text_of, depth);
    }
    if !(name.ends_with(".yaml") || name.ends_with(".yml")) {
        let known: Vec<_> = shipped::names().map(|name| format!("`{name}`")).collect();
        return Err(InputError::new(name, "is no shipped robot, and no file that ends in .yaml or .urdf")
            .help(format!("shipped are {}", known.join(", "))));
    }
    from_text(&text_of(name)?, name, text_of, depth)
}

/// Reads a robot; `file` is its name in errors. Parts may be shipped robots only.
///
/// # Errors
/// What is wrong with it, at its line.
pub fn read(text: &str, file: &str) -> Result<Robot, InputError> {
    from_text(text, file, &|part| Err(InputError::new(part, "is no shipped robot")), 0)
}

fn from_text(
    text: &str,
    file: &str,
    text_of: &dyn Fn(&str) -> Result<String, InputError>,
    depth: usize,
) -> Result<Robot, InputError> {
    let parsed: RobotFile = yaml::read(text, file)?;
    let places = Places { text, file };
    let built = if let Some(urdf) = &parsed.urdf {
        if parsed.root.is_some() || !parsed.links.0.is_empty() || !parsed.joints.0.is_empty() {
            return Err(places.error(
                "urdf",
                "",
                "stands beside `root`, `links` or `joints`, wanted one of the two".into(),
            ));
        }
        let beside = std::path::Path::new(file).parent().map_or_else(|| urdf.into(), |folder| folder.join(urdf));
        let beside = beside.display().to_string();
        let mut built = urdf::read(&text_of(&beside)?, &beside)?;
        built.name = parsed.name;
        if let Some(hand) = parsed.hand {
            let side = hand.side;
            let made = made_hand(&built, hand, &places)?;
            built.hands.insert(side, made);
        }
        built
    } else if parsed.parts.0.is_empty() {
        single(parsed, &places)?
    } else {
        if let Some((key, _)) = [("links", parsed.links.0.len()), ("joints", parsed.joints.0.len())]
            .into_iter()
            .find(|(_, count)| *count > 0)
        {
            return Err(places.error(key, "", "stands beside `parts`, wanted one of the two".into()));
        }
        assembly(parsed, &places, text_of, depth)?
    };
    if built.links.len() > MAX_LINKS {
        return Err(InputError::new(file, format!("has {} links, at most {MAX_LINKS} are read", built.links.len())));
    }
    Ok(built)
}

/// Where things stand in a text: what is wrong between entries has no place of its own in the YAML crate.
struct Places<'a> {
    text: &'a str,
    file: &'a str,
}

impl Places<'_> {
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
fn single(file: RobotFile, places: &Places<'_>) -> Result<Robot, InputError> {
    let RobotFile { name, root, links: Entries(links), joints: Entries(joints), hand, .. } = file;
    let root =
        root.ok_or_else(|| InputError::new(places.file, "the key `root` is missing: the link that stands still"))?;
    for (section, names) in [
        ("links", links.iter().map(|(name, _)| name).collect::<Vec<_>>()),
        ("joints", joints.iter().map(|(name, _)| name).collect()),
    ] {
        for (at, name) in names.iter().enumerate() {
            if names[..at].contains(name) {
                return Err(places.error(section, name, "is there twice".into()));
            }
        }
    }
    if !links.iter().any(|(name, _)| *name == root) {
        return Err(places.error("root", "", format!("found `{root}`, wanted the name of a link")));
    }
    // Every link but the root hangs at one joint.
    for (at, (name, joint)) in joints.iter().enumerate() {
        for (end, link) in [("parent", &joint.parent), ("child", &joint.child)] {
            if !links.iter().any(|(known, _)| known == link) {
                return Err(places.error("joints", name, format!("has the {end} `{link}`, which is no link")));
            }
        }
        if joint.child == root {
            return Err(places.error("joints", name, format!("has the child `{root}`, but that is the root")));
        }
        if let Some((other, _)) = joints[..at].iter().find(|(_, one)| one.child == joint.child) {
            let message = format!("has the child `{}`, which hangs at `{other}` already", joint.child);
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
        let message = format!("does not hang on the root `{root}`: the tree does not close");
        return Err(places.error("links", name, message));
    }
    let dofs = dofs(&joints, places)?;
    let mut built = Robot { name, links: Vec::new(), dofs, hands: IndexMap::new() };
    for name in &order {
        let Some((_, link)) = links.iter().find(|(known, _)| known == name) else { continue };
        let (mut made, hangs) = (made_link(name, link, places)?, joints.iter().find(|(_, joint)| joint.child == *name));
        if let Some((joint_name, joint)) = hangs {
            made.parent = built.link(&joint.parent).unwrap_or(0);
            made.parent_from_joint = placed(joint.at, joint.turned, places, "joints", joint_name)?;
            made.joint = Some(made_joint(joint_name, joint, &joints, &built.dofs, places)?);
        }
        built.links.push(made);
    }
    if let Some(file) = hand {
        let side = file.side;
        let made = made_hand(&built, file, places)?;
        built.hands.insert(side, made);
    }
    Ok(built)
}

/// What can be driven: the joints that are not coupled.
fn dofs(joints: &[(String, JointFile)], places: &Places<'_>) -> Result<Vec<Dof>, InputError> {
    let mut dofs = Vec::new();
    for (name, joint) in joints {
        let refuse = |message: String| places.error("joints", name, message);
        if joint.source.trim().is_empty() {
            return Err(refuse("has an empty `source`, wanted where its numbers come from, such as `ours`".into()));
        }
        if let Some(coupled) = &joint.coupled {
            let own = [joint.range.is_some(), joint.travel.is_some(), joint.torque.is_some(), joint.force.is_some()];
            if own.contains(&true) {
                return Err(refuse("is coupled, and has limits of its own".into()));
            }
            match joints.iter().find(|(other, _)| *other == coupled.to) {
                None => return Err(refuse(format!("is coupled to `{}`, which is no joint", coupled.to))),
                Some((_, other)) if other.coupled.is_some() => {
                    return Err(refuse(format!("is coupled to `{}`, which is coupled itself", coupled.to)));
                }
                Some(_) => {}
            }
            if !(coupled.ratio.is_finite() && coupled.ratio != 0.0 && coupled.ratio.abs() <= 100.0) {
                return Err(refuse(format!("is coupled with the ratio {}, wanted up to 100, not 0", coupled.ratio)));
            }
            continue;
        }
        let (range, largest, torque, speed) = match (joint.range, joint.travel) {
            (Some(range), None) => {
                (range.map(|angle| angle.0), TAU, joint.torque.map(|it| it.0), joint.speed.map(|it| it.0))
            }
            (None, Some(travel)) => {
                (travel.map(|length| length.0), 10.0, joint.force.map(|it| it.0), joint.slide_speed.map(|it| it.0))
            }
            _ => return Err(refuse("wants one of `range` (it turns), `travel` (it slides) and `coupled`".into())),
        };
        if !(range[0] < range[1] && range.iter().all(|end| end.abs() <= largest)) {
            let unit = if joint.range.is_some() { "rad" } else { "m" };
            return Err(refuse(format!(
                "goes from {} to {} {unit}, wanted the smaller end first, within {largest:.4} {unit}",
                range[0], range[1]
            )));
        }
        let positive = |what: &str, value: Option<f64>| match value {
            Some(value) if value > 0.0 && value <= 1e5 => Ok(value),
            Some(value) => Err(refuse(format!("has the {what} {value}, wanted more than 0"))),
            None => Err(refuse(format!("has no `{what}`"))),
        };
        let (torque_word, speed_word) =
            if joint.range.is_some() { ("torque", "speed") } else { ("force", "slide_speed") };
        let (torque, speed) = (positive(torque_word, torque)?, positive(speed_word, speed)?);
        let acceleration = match (joint.acceleration, joint.slide_acceleration) {
            (Some(_), _) if joint.range.is_none() => {
                return Err(refuse("slides, wanted a `slide_acceleration`".into()));
            }
            (_, Some(_)) if joint.range.is_some() => return Err(refuse("turns, wanted an `acceleration`".into())),
            (Some(turning), _) => positive("acceleration", Some(turning.0))?,
            (_, Some(sliding)) => positive("slide_acceleration", Some(sliding.0))?,
            (None, None) => speed / SPEEDS_UP_S,
        };
        for (what, value) in
            [("armature", joint.armature.0), ("damping", joint.damping.0), ("friction", joint.friction.0)]
        {
            if !(0.0..=1e4).contains(&value) {
                return Err(refuse(format!("has the {what} {value}, wanted 0 or more")));
            }
        }
        let (armature, damping, friction) = (joint.armature.0, joint.damping.0, joint.friction.0);
        dofs.push(Dof { name: name.clone(), range, torque, speed, acceleration, armature, damping, friction });
    }
    Ok(dofs)
}

fn made_joint(
    name: &str,
    joint: &JointFile,
    joints: &[(String, JointFile)],
    dofs: &[Dof],
    places: &Places<'_>,
) -> Result<Joint, InputError> {
    let refuse = |message: String| places.error("joints", name, message);
    let (driver, ratio) = joint.coupled.as_ref().map_or((name, 1.0), |coupled| (coupled.to.as_str(), coupled.ratio));
    let dof = dofs.iter().position(|dof| dof.name == driver).ok_or_else(|| refuse("is driven by nothing".into()))?;
    let slides = joints.iter().any(|(other, file)| other == driver && file.travel.is_some());
    let axis = joint.axis.ok_or_else(|| refuse("has no `axis`".into()))?;
    let axis = Unit::try_new(Vector3::from(axis), 1e-6)
        .filter(|axis| axis.iter().all(|part| part.is_finite()))
        .ok_or_else(|| refuse(format!("has the axis {axis:?}, wanted a direction")))?;
    Ok(Joint { name: name.into(), kind: if slides { Kind::Slides } else { Kind::Turns }, axis, dof, ratio })
}

fn made_link(name: &str, link: &LinkFile, places: &Places<'_>) -> Result<Link, InputError> {
    let refuse = |message: String| places.error("links", name, message);
    if link.source.trim().is_empty() {
        return Err(refuse("has an empty `source`, wanted where its numbers come from, such as `ours`".into()));
    }
    if !(0.0..=1e3).contains(&link.mass.0) {
        return Err(refuse(format!("has a mass of {} kg, wanted 0 to 1000 kg", link.mass.0)));
    }
    let size = |size: Length| {
        if size.0 > 0.0 && size.0 <= 10.0 {
            Ok(size.0)
        } else {
            Err(refuse(format!("has a part of {} m, wanted more than 0 and at most 10 m", size.0)))
        }
    };
    let mut solids = Vec::new();
    for part in &link.parts {
        let at = placed(part.at, part.turned, places, "links", name)?;
        solids.push(match (part.capsule, part.cuboid) {
            (Some([length, radius]), None) => {
                Solid::Capsule(at * Point3::origin(), at * Point3::new(size(length)?, 0.0, 0.0), size(radius)?)
            }
            (None, Some([x, y, z])) => Solid::Box(at, Vector3::new(size(x)?, size(y)?, size(z)?) / 2.0),
            _ => return Err(refuse("has a part that wants one of `capsule` and `box`".into())),
        });
    }
    let (centre, inertia) = inertia_of(link.mass.0, &solids);
    Ok(Link {
        name: name.into(),
        parent: 0,
        parent_from_joint: Isometry3::identity(),
        joint: None,
        mass: link.mass.0,
        centre,
        inertia,
        solids,
    })
}

/// Centre of mass and inertia about it, of a mass spread evenly over solids. Without any, a ball of 10 mm.
pub(super) fn inertia_of(mass: f64, solids: &[Solid]) -> (Point3<f64>, Matrix3<f64>) {
    let parts: Vec<_> = solids.iter().map(Solid::mass_properties).collect();
    let volume: f64 = parts.iter().map(|(volume, ..)| volume).sum();
    if volume <= 0.0 {
        return (Point3::origin(), Matrix3::identity() * (0.4 * mass * 1e-4));
    }
    let centre =
        Point3::from(parts.iter().map(|(volume, centre, _)| centre.coords * *volume).sum::<Vector3<f64>>() / volume);
    let about = parts.iter().map(|(volume, at, inertia)| {
        let arm = at - centre;
        inertia + (Matrix3::identity() * arm.norm_squared() - arm * arm.transpose()) * *volume
    });
    (centre, about.sum::<Matrix3<f64>>() * (mass / volume))
}

fn placed(
    at: [Length; 3],
    turned: [f64; 4],
    places: &Places<'_>,
    section: &str,
    key: &str,
) -> Result<Isometry3<f64>, InputError> {
    let length = turned.iter().map(|part| part * part).sum::<f64>().sqrt();
    if !(length > 1e-6 && length.is_finite()) {
        return Err(places.error(section, key, format!("is turned by {turned:?}, wanted a quaternion w x y z")));
    }
    if at.iter().any(|part| part.0.abs() > 10.0) {
        return Err(places.error(section, key, "is more than 10 m away".into()));
    }
    Ok(pose(at.map(|part| part.0), turned))
}

fn made_hand(robot: &Robot, file: HandFile, places: &Places<'_>) -> Result<HandModel, InputError> {
    let refuse = |key: &str, message: String| places.error("hand", key, message);
    let palm = robot
        .link(&file.palm)
        .ok_or_else(|| refuse("palm", format!("found `{}`, wanted the name of a link", file.palm)))?;
    let mut specs = Vec::new();
    for (finger, file) in &file.fingers {
        let name = finger.name();
        let link = robot
            .link(&file.link)
            .ok_or_else(|| refuse(name, format!("ends at the link `{}`, which is not there", file.link)))?;
        if file.source.trim().is_empty() {
            return Err(refuse(name, "has an empty `source`".into()));
        }
        if *finger == Finger::Palm {
            return Err(refuse(name, "is no finger".into()));
        }
        if !(1e-4..=0.1).contains(&file.radius.0) {
            return Err(refuse(name, format!("has a tip of radius {} m, wanted 0.1 mm to 100 mm", file.radius.0)));
        }
        if !(file.force.0 > 0.0 && file.force.0 <= 1000.0) {
            return Err(refuse(name, format!("presses with {} N at most, wanted more than 0", file.force.0)));
        }
        let pad = Unit::try_new(Vector3::from(file.pad), 1e-6)
            .ok_or_else(|| refuse(name, "has a `pad` without direction".into()))?;
        specs.push(FingerSpec {
            finger: *finger,
            link,
            tip: Point3::from(file.tip.map(|part| part.0)),
            radius: file.radius.0,
            pad,
            force: file.force.0,
        });
    }
    hand::build(robot, palm, &specs).map_err(|(finger, message)| refuse(finger.map_or("palm", Finger::name), message))
}
