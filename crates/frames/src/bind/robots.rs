//! Robots in a binding: the joints of a log and a URDF in, where the robot's links are out; and how far two points are apart.

use super::arm_models::ArmModel;
use super::joint_columns::JointColumns;
use super::lerobot_motors::{self, MotorNorm};
use super::{BindingFile, Columns, LinkPoint, PointDistance};
use crate::clean::preprocess::over_all;
use indexmap::IndexMap;
use nalgebra::{Isometry3, Point3};
use serde::Deserialize;
use std::f64::consts::TAU;
use std::path::Path;
use teachtree_base::channels::Shape;
use teachtree_base::error::InputError;
use teachtree_base::field_names::inside;
use teachtree_base::geometry::pose;
use teachtree_base::hands::Side;
use teachtree_base::log_channel::LogChannel;
use teachtree_base::quantity::Length;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::short_number::ShortNumber;
use teachtree_base::spelling::nearest;
use teachtree_base::units::Dimension;
use teachtree_description::tree::{JointKind, KinematicTree};
use teachtree_description::urdf::{self, Oddity};
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::read::text;

/// The largest URDF file, in bytes.
const MAX_BYTES: u64 = 4 << 20;
/// A joint may be beyond its limits by this, rad or m, in this share of the samples, at a minimum number of samples.
const BEYOND: [f64; 2] = [0.3, 0.02];
const SHARE: f64 = 0.05;
const FEWEST: usize = 20;

/// A robot whose joints a log has.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Robot {
    /// Its URDF file, beside the binding; or `model`.
    #[serde(default)]
    pub urdf: Option<String>,
    /// An arm that comes with the program; or `urdf`.
    #[serde(default)]
    pub model: Option<ArmModel>,
    /// The columns of the joints that move; other joints stay at zero. For `so101`, the default is the columns of LeRobot.
    #[serde(default)]
    pub joints: Option<JointColumns>,
    /// The column of the joint of the gripper of a `model`, beside one text for all joints of the arm.
    #[serde(default)]
    pub gripper: Option<Columns>,
    /// What the numbers of the motors mean, of an arm of LeRobot.
    #[serde(default)]
    pub norm: Option<MotorNorm>,
    /// The calibration file of an arm of LeRobot, beside the binding.
    #[serde(default)]
    pub calibration: Option<String>,
    /// The hand that the tool of a `model` is: binds pads, palm and opening that `channels` lacks.
    #[serde(default)]
    pub hand: Option<Side>,
    /// Where its root stands, reference frame.
    #[serde(default)]
    pub position: [Length; 3],
    /// The rotation reference_from_root, quaternion w x y z.
    #[serde(default = "upright")]
    pub rotation: [f64; 4],
}

const fn upright() -> [f64; 4] {
    [1.0, 0.0, 0.0, 0.0]
}

/// The name of the temporary column of a joint.
pub fn joint_column(robot: &str, joint: &str) -> String {
    format!("robots.{robot}.{joint}")
}

/// A robot of a binding, as its URDF describes it.
#[derive(Clone, Debug)]
pub struct BoundRobot {
    /// Links and joints.
    pub tree: KinematicTree,
    /// The columns of its joints.
    pub joints: IndexMap<String, Columns>,
    /// Its file, or the name of its model.
    source: String,
    /// Whether the columns are the usual ones of its model.
    has_usual_columns: bool,
    /// The parts of the file that are ignored or replaced.
    oddities: Vec<Oddity>,
}

impl BoundRobot {
    /// Whether a link hangs on another one, or is the same.
    fn hangs_on(&self, link: usize, name: &str) -> bool {
        let parent = |at: &usize| self.tree.links.get(*at).map(|link| link.parent).filter(|parent| parent != at);
        std::iter::successors(Some(link), parent).any(|at| self.tree.links.get(at).is_some_and(|it| it.name == name))
    }

    /// The reason why the pose of a link is not known.
    fn unknown_above(&self, link: usize) -> Option<&InputError> {
        let unknown = self.oddities.iter().filter(|oddity| oddity.instead.is_none());
        unknown.filter(|oddity| self.hangs_on(link, &oddity.link)).map(|oddity| &oddity.error).next()
    }

    /// What keeps a joint or a link of this name from being read.
    fn unread(&self, name: &str) -> Option<&InputError> {
        let mut unread = self.oddities.iter().filter(|oddity| oddity.instead.is_none());
        unread.find(|oddity| oddity.joint == name || oddity.link == name).map(|oddity| &oddity.error)
    }
}

/// Reads the URDF and calibration files that a binding names, finds the columns of the joints, adds the channels of tools, and checks the links that
/// channels name.
///
/// # Errors
/// A file that cannot be read; keys that exclude each other; a joint or a link that a robot lacks; a part of it that a bound link hangs on and that
/// cannot be read.
pub fn resolve(file: &mut BindingFile) -> Result<(), InputError> {
    let mut trees = IndexMap::new();
    for (robot, declared) in &file.binding.robots {
        trees.insert(robot.clone(), bound_robot(file, robot, declared)?);
    }
    file.trees = trees;
    let tools: Vec<(String, Columns)> =
        file.binding.robots.iter().flat_map(|(robot, it)| tool(file, robot, it)).collect();
    for (channel, columns) in tools {
        file.binding.channels.entry(channel).or_insert(columns);
    }
    for (key, columns) in &file.binding.channels {
        let Columns::Link(point) = columns else { continue };
        let Some(robot) = file.trees.get(&point.robot) else {
            let known = nearest(&point.robot, file.trees.keys().map(String::as_str));
            let near = known.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
            return Err(file.error(key, format!("`robots` has no `{}`{near}", point.robot)));
        };
        let link = robot.tree.link(&point.link);
        if let Some(error) = link.map_or_else(|| robot.unread(&point.link), |link| robot.unknown_above(link)) {
            return Err(error.clone());
        }
        if link.is_none() {
            let known = robot.tree.links.iter().map(|link| link.name.as_str());
            return Err(file.error(key, lacks("link", &point.link, &robot.source, known)));
        }
    }
    Ok(())
}

/// A robot with its links, and the columns of its joints.
fn bound_robot(file: &BindingFile, robot: &str, declared: &Robot) -> Result<BoundRobot, InputError> {
    let error = |key: &str, message: String| InputError::new(file.place(&["robots", robot, key]), message);
    let folder = Path::new(&file.name).parent().unwrap_or(Path::new(""));
    let (source, (tree, oddities)) = match (&declared.urdf, declared.model) {
        (Some(urdf), None) => {
            let path = folder.join(urdf);
            let text = text::read(&path, MAX_BYTES).map_err(|found| error("urdf", found.to_string()))?;
            (urdf.clone(), urdf::kinematics(&text, &path.display().to_string())?)
        }
        (None, Some(model)) => {
            let name = model.name();
            (name.to_string(), urdf::kinematics(model.urdf(), &format!("robots/{name}.urdf"))?)
        }
        _ => {
            let message = "expected `urdf` with a file, or `model` with an arm that comes with the program: `so101`, `panda`, `vx300s`";
            return Err(error("urdf", message.into()));
        }
    };
    if declared.hand.is_some() && declared.model.is_none() {
        return Err(error(
            "hand",
            "`hand` is for the tool of a `model`: bind the links of the tool in `channels`".into(),
        ));
    }
    let usual = declared.model.and_then(ArmModel::columns);
    let has_usual_columns = declared.joints.is_none() && usual.is_some();
    let mut bound = BoundRobot { tree, joints: IndexMap::new(), source, has_usual_columns, oddities };
    let columns = match (&declared.joints, usual) {
        (Some(columns), _) => columns.clone(),
        (None, Some(usual)) => JointColumns::All(usual.into()),
        (None, None) => {
            let message = "expected `joints`, the columns of its joints, such as `joints: joint_position[<index>]`";
            return Err(error("model", message.into()));
        }
    };
    let is_numbered = |joint: &&str| declared.model.is_none_or(|model| model.is_numbered(joint));
    let of_tree = bound.tree.dofs.iter().map(|dof| dof.name.as_str()).filter(is_numbered);
    bound.joints = columns.of(of_tree).map_err(|message| error("joints", message))?;
    if let Some(columns) = &declared.gripper {
        let Some(model) = declared.model else {
            return Err(error(
                "gripper",
                "`gripper` is for the gripper of a `model`: name its joint in `joints`".into(),
            ));
        };
        bound.joints.insert(model.tool().gripper.into(), columns.clone());
    }
    if let Some(joint) = bound.joints.keys().find(|joint| bound.tree.dof(joint).is_none()) {
        if let Some(error) = bound.unread(joint) {
            return Err(error.clone());
        }
        let known = bound.tree.dofs.iter().map(|dof| dof.name.as_str());
        let place = file.place(&["robots", robot, "joints", joint]);
        return Err(InputError::new(place, lacks("joint that moves by itself", joint, &bound.source, known)));
    }
    convert(&mut bound.joints, declared, folder, error)?;
    Ok(bound)
}

/// Converts the numbers of motors into degrees of their joints, where a column has no unit of its own.
fn convert(
    joints: &mut IndexMap<String, Columns>,
    declared: &Robot,
    folder: &Path,
    error: impl Fn(&str, String) -> InputError,
) -> Result<(), InputError> {
    let motors = declared.model.map_or(&[][..], ArmModel::motors);
    for (key, is_there) in [("norm", declared.norm.is_some()), ("calibration", declared.calibration.is_some())] {
        if is_there && motors.is_empty() {
            let message =
                format!("`{key}` is for motors of LeRobot, `model: so101`: write a unit after the columns, `q [deg]`");
            return Err(error(key, message));
        }
    }
    let calibration = match &declared.calibration {
        Some(name) => {
            let path = folder.join(name);
            let text = text::read(&path, MAX_BYTES).map_err(|found| error("calibration", found.to_string()))?;
            lerobot_motors::parse(&text, &path.display().to_string())?
        }
        None => IndexMap::new(),
    };
    for motor in motors {
        let Some(columns) = joints.get_mut(motor.joint) else { continue };
        let own = calibration.get(motor.joint).copied();
        if declared.calibration.is_some() && own.is_none() {
            let known = calibration.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
            return Err(error("calibration", format!("the file has no motor `{}`; it has {known}", motor.joint)));
        }
        let form = motor.degrees(declared.norm.unwrap_or_default(), own);
        let form = form.map_err(|message| error("norm", message.into()))?;
        let patterns = match columns {
            Columns::Pattern(pattern) => std::slice::from_mut(pattern),
            Columns::Mean(patterns) => patterns.as_mut_slice(),
            _ => continue,
        };
        for pattern in patterns {
            *pattern = pattern.clone().converted(form, "deg");
        }
    }
    Ok(())
}

/// The channels of the tool of a robot that is a hand.
fn tool(file: &BindingFile, robot: &str, declared: &Robot) -> Vec<(String, Columns)> {
    let (Some(hand), Some(model)) = (declared.hand, declared.model) else { return vec![] };
    let (hand, tool) = (hand.name(), model.tool());
    let [thumb, index] = tool.pads;
    let point = |link: &str| Columns::Link(LinkPoint { robot: robot.into(), link: link.into(), at: [0.0; 3] });
    let mut channels = vec![
        (format!("{hand}.thumb.position"), point(thumb)),
        (format!("{hand}.index.position"), point(index)),
        (format!("{hand}.palm.position"), point(tool.palm)),
        (format!("{hand}.palm.rotation"), point(tool.palm)),
    ];
    if file.trees.get(robot).is_some_and(|bound| bound.joints.contains_key(tool.gripper)) {
        let between = ["thumb", "index"].map(|finger| format!("{hand}.{finger}"));
        let opening = PointDistance { between, less: tool.shut, below: None };
        channels.push((format!("{hand}.gripper.opening"), Columns::PointDistance(opening)));
    }
    channels
}

/// The error about the column of a joint.
pub fn column_error(file: &BindingFile, robot: &str, joint: &str, message: String) -> InputError {
    let error = InputError::new(file.place(&["robots", robot, "joints", joint]), message);
    if file.trees.get(robot).is_some_and(|bound| bound.has_usual_columns) {
        return error.help("the columns are those of LeRobot; name others with `joints`: `joints: state.<joint>`");
    }
    error
}

/// The most parts of a file that a message names.
const NAMED: usize = 3;

/// Returns an issue for each robot whose file has parts that are ignored or replaced.
pub fn unread_parts(file: &BindingFile, time: &[f64]) -> Vec<Issue> {
    let issue = |(name, robot): (&String, &BoundRobot)| {
        let parts = robot.oddities.iter().take(NAMED).map(|oddity| {
            let instead = oddity.instead.unwrap_or("no bound channel depends on it");
            format!("{}: {}; {instead}", oddity.error.place, oddity.error.message)
        });
        let mut parts: Vec<String> = parts.collect();
        match robot.oddities.len().saturating_sub(NAMED) {
            0 => {}
            more => parts.push(format!("and {more} other parts")),
        }
        let message = parts.join("; ");
        (!parts.is_empty()).then(|| over_all(time, IssueKind::UNREAD_PART, &format!("robots.{name}"), message))
    };
    file.trees.iter().filter_map(issue).collect()
}

fn lacks<'a>(what: &str, name: &str, urdf: &str, known: impl Iterator<Item = &'a str> + Clone) -> String {
    match nearest(name, known.clone()) {
        Some(near) => format!("`{urdf}` has no {what} `{name}`; did you mean `{near}`?"),
        None => format!("`{urdf}` has no {what} `{name}`, expected one of {}", known.collect::<Vec<_>>().join(", ")),
    }
}

/// The dimension of a joint: that of an angle, or of a length.
pub fn dimension(tree: &KinematicTree, joint: &str) -> Dimension {
    let slides = |dof: usize| {
        let mut joints = tree.links.iter().filter_map(|link| link.joint.as_ref());
        joints.any(|joint| joint.dof == dof && joint.kind == JointKind::Prismatic)
    };
    if tree.dof(joint).is_some_and(slides) { Dimension::LENGTH } else { Dimension::ANGLE }
}

/// Replaces the columns of the joints by the channels that are bound to links.
///
/// # Errors
/// A channel that is neither a position nor a rotation.
pub fn place(recording: &mut Recording, file: &BindingFile) -> Result<Vec<Issue>, InputError> {
    let mut issues = vec![];
    for (robot, tree) in file.robots() {
        let Some(declared) = file.binding.robots.get(robot) else { continue };
        let joints: Vec<(usize, Vec<f64>)> = file
            .joints()
            .filter(|(of, ..)| of == robot)
            .filter_map(|(_, joint, _)| {
                let column = recording.columns.shift_remove(&joint_column(robot, joint))?;
                Some((tree.dof(joint)?, column.values))
            })
            .collect();
        issues.extend(joints.iter().filter_map(|(dof, values)| beyond(recording, tree, robot, *dof, values)));
        let links: Vec<_> = file
            .binding
            .channels
            .iter()
            .filter_map(|(key, columns)| match columns {
                Columns::Link(point) if point.robot == *robot => Some((key, point, tree.link(&point.link)?)),
                _ => None,
            })
            .collect();
        let reference_from_root = pose(declared.position.map(|length| length.0), declared.rotation);
        // A joint that is locked stays where its limits are.
        let rest = |[low, high]: [f64; 2]| if low == high { low } else { 0.0 };
        let mut q: Vec<f64> = tree.dofs.iter().map(|dof| rest(dof.range)).collect();
        let mut poses: Vec<Vec<Isometry3<f64>>> = vec![vec![]; links.len()];
        for row in 0..recording.time.len() {
            for (dof, values) in &joints {
                if let Some(own) = q.get_mut(*dof) {
                    *own = values.get(row).copied().unwrap_or(f64::NAN);
                }
            }
            let root_from_links = tree.forward_kinematics(&q);
            for (poses, (_, _, link)) in poses.iter_mut().zip(&links) {
                poses.extend(root_from_links.get(*link).map(|root_from_link| reference_from_root * root_from_link));
            }
        }
        for ((key, point, _), poses) in links.into_iter().zip(poses) {
            let channel = LogChannel::parse(key);
            match channel.map(|channel| (channel.shape(), channel.dimension())) {
                Some((Shape::Vec3, Dimension::LENGTH)) => {
                    let at = Point3::from(point.at);
                    let points: Vec<Point3<f64>> = poses.iter().map(|pose| pose * at).collect();
                    for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
                        let values = points.iter().map(|point| point[axis]).collect();
                        put(recording, file, format!("{key}.{letter}"), Dimension::LENGTH, values)?;
                    }
                }
                Some((Shape::Rotation, _)) => {
                    for (place, letter) in ["w", "x", "y", "z"].into_iter().enumerate() {
                        // nalgebra stores x y z w.
                        let values = poses.iter().map(|pose| pose.rotation.coords[(place + 3) % 4]).collect();
                        put(recording, file, format!("{key}.{letter}"), Dimension::NONE, values)?;
                    }
                }
                _ => {
                    let message = format!("`{key}` is neither a position nor a rotation, and a link has only these");
                    return Err(file.error(key, message));
                }
            }
        }
    }
    Ok(issues)
}

/// Adds the distance of two points, or the flag that it is small, to be bound under `key`.
///
/// # Errors
/// A channel that is neither a length nor a flag, or a point that is not bound.
pub fn measure(
    recording: &mut Recording,
    file: &BindingFile,
    key: &str,
    span: &PointDistance,
) -> Result<(), InputError> {
    let shape = LogChannel::parse(key).map(|channel| (channel.shape(), channel.dimension()));
    let is_flag = match shape {
        Some((Shape::Bool, _)) => true,
        Some((Shape::Scalar, Dimension::LENGTH)) => false,
        _ => return Err(file.error(key, format!("`{key}` is neither a length nor a flag, and this is a distance"))),
    };
    if is_flag != span.below.is_some() {
        let message = if is_flag {
            "is a flag, expected a limit such as `below: 30 mm`"
        } else {
            "is not a flag; only flags have a limit"
        };
        return Err(file.error(key, format!("`{key}` {message}")));
    }
    let part = |point: &str, letter: &str| {
        let column = recording.columns.get(&*inside(&format!("{point}.position.{letter}")));
        let message = || format!("`{key}` is a distance from `{point}`, and no channel `{point}.position` is bound");
        column.map(|column| column.values.clone()).ok_or_else(|| file.error(key, message()))
    };
    let mut squares = vec![0.0; recording.time.len()];
    let [one, other] = &span.between;
    for letter in ["x", "y", "z"] {
        for (square, (one, other)) in squares.iter_mut().zip(part(one, letter)?.into_iter().zip(part(other, letter)?)) {
            *square += (one - other).powi(2);
        }
    }
    let value = |square: f64| {
        let apart = square.sqrt() - span.less;
        span.below.map_or(apart, |limit| if apart.is_nan() { apart } else { f64::from(u8::from(apart < limit)) })
    };
    let dimension = if is_flag { Dimension::NONE } else { Dimension::LENGTH };
    put(recording, file, key.to_string(), dimension, squares.into_iter().map(value).collect())
}

fn put(
    recording: &mut Recording,
    file: &BindingFile,
    name: String,
    dimension: Dimension,
    values: Vec<f64>,
) -> Result<(), InputError> {
    match recording.columns.insert(name.clone(), Column { dimension, values }) {
        Some(_) => Err(file.error("channels", format!("`{name}` is bound twice"))),
        None => Ok(()),
    }
}

/// An issue for a joint that is often beyond its limits: in another unit, or counted from another zero.
fn beyond(recording: &Recording, tree: &KinematicTree, robot: &str, dof: usize, values: &[f64]) -> Option<Issue> {
    let joint = tree.dofs.get(dof).filter(|joint| joint.range[0] < joint.range[1])?;
    let turns = dimension(tree, &joint.name) == Dimension::ANGLE;
    let (beyond, unit) = (BEYOND[usize::from(!turns)], if turns { "rad" } else { "m" });
    let range = joint.range[0] - beyond..=joint.range[1] + beyond;
    let measured: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let out = measured.iter().filter(|value| !range.contains(value)).count();
    let counts_turns = turns && joint.range[1] - joint.range[0] > 0.999 * TAU;
    let largest = measured.iter().map(|value| value.abs()).fold(0.0, f64::max);
    if measured.len() < FEWEST || (out as f64) < SHARE * measured.len() as f64 || (counts_turns && largest < 50.0) {
        return None;
    }
    let message = format!(
        "is beyond its limits, {} to {} {unit}, in {out} of {} samples, up to {}: is it in another unit (`[deg]`, `[mm]`), or counted from another zero?",
        ShortNumber(joint.range[0]),
        ShortNumber(joint.range[1]),
        measured.len(),
        ShortNumber((largest * 1e3).round() / 1e3)
    );
    Some(over_all(&recording.time, IssueKind::IMPLAUSIBLE_ROTATION, &joint_column(robot, &joint.name), message))
}
