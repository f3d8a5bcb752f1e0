//! Poses in a plane: x, y and an angle of each body, as planar pushing is logged. Their height is not logged.

use super::parts::{Part, Quantity};
use super::quantiles::median;
use super::words;
use crate::inspect::{ColumnReport, ValueKind};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

/// The endings of x and y; those of an array have no third element.
const PAIRS: [[&str; 3]; 4] = [["x", "y", "z"], ["X", "Y", "Z"], ["[0]", "[1]", "[2]"], ["_0", "_1", "_2"]];
/// Words for the angle beside them.
const ANGLES: [&str; 10] = ["theta", "yaw", "angle", "phi", "psi", "rot", "rotation", "orientation", "heading", "th"];
/// Words for what pushes, where no other name is that of a tool.
const PUSHERS: [&str; 6] = ["pusher", "tip", "probe", "stick", "rod", "finger"];
/// Words for pairs of columns that are not the position of a body.
const OTHERS: [&str; 24] = [
    "force",
    "torque",
    "wrench",
    "moment",
    "velocity",
    "vel",
    "speed",
    "acceleration",
    "acc",
    "error",
    "current",
    "qpos",
    "joint",
    "joints",
    "motor",
    "keypoint",
    "keypoints",
    "px",
    "pixel",
    "image",
    "mouse",
    "joystick",
    "joy",
    "gaze",
];
/// Words for poses of x, y and an angle.
const PLANAR: [&str; 5] = ["planar", "pose2d", "2d", "se2", "xytheta"];
/// Angles are at most this, rad, unless they are in degrees.
const TURN: f64 = 1.05 * TAU;
/// Positions in pixels are beyond this, and not below zero.
const PIXELS: f64 = 20.0;
/// The lengths of an unnamed array: places of a tool and of a block, the angle of the block, and at most two numbers more.
const UNNAMED: std::ops::RangeInclusive<usize> = 5..=7;
/// The commands of a tool are nearer to it than this share of its way.
const NEAR: f64 = 0.3;

/// A column in a pose.
#[derive(Clone, Debug)]
struct Cell<'a> {
    /// The place of its part.
    part: usize,
    /// As a binding names it.
    title: String,
    column: &'a ColumnReport,
}

/// The columns of a pose.
struct PlanarPose<'a> {
    /// The name without what differs.
    name: String,
    at: [Cell<'a>; 2],
    angle: Option<Cell<'a>>,
    /// Whether y points down, as in an image.
    is_mirrored: bool,
    reason: String,
}

/// Puts the columns of planar poses together, in logs that have the angle of a body in the plane.
pub fn join(parts: &mut Vec<Part<'_>>) {
    let mut poses = pairs(parts);
    let has_pair = !poses.is_empty();
    poses.extend(arrays(parts, has_pair));
    poses.extend(unnamed(parts));
    // Without the angle of a body, places may be those of anything, and the pose of a tool may lack its other numbers.
    let is_tool = |pose: &PlanarPose| words::tool_rank(&words::words(&pose.name)).is_some();
    if poses.len() < 2 || poses.iter().all(|pose| pose.angle.is_none() || is_tool(pose)) {
        return;
    }
    // The `T` of Push-T names no body elsewhere.
    for pose in poses.iter_mut().filter(|pose| pose.angle.is_some() && words::body(&pose.name).is_none()) {
        pose.name.push_str(" block");
    }
    let tool = tool(parts, &poses);
    let mut taken = BTreeSet::new();
    let mut joined: Vec<Part> = vec![];
    for (at, pose) in poses.iter().enumerate() {
        taken.extend(pose.at.iter().chain(&pose.angle).map(|cell| cell.part));
        joined.extend(pose.parts(parts, tool == Some(at)));
    }
    let mut place = 0;
    parts.retain(|_| {
        place += 1;
        !taken.contains(&(place - 1))
    });
    parts.extend(joined);
}

impl<'a> PlanarPose<'a> {
    /// The position, and the rotation about the vertical.
    fn parts(&self, parts: &[Part<'a>], is_tool: bool) -> Vec<Part<'a>> {
        let [x, y] = &self.at;
        let Some(first) = parts.get(x.part) else { return vec![] };
        let sign = if self.is_mirrored { "-" } else { "" };
        let mut own = words::words(&self.name);
        own.extend(is_tool.then(|| "tcp".to_string()));
        let part = |pattern: String, members: Vec<&'a ColumnReport>, quantity, unit: &str, reason: String| Part {
            pattern,
            name: self.name.clone(),
            words: own.clone(),
            quantity,
            unit: unit.into(),
            guessed_unit: "",
            members,
            sheet: first.sheet,
            reason: Some(reason),
            left_out: None,
            carried_in: None,
        };
        let pattern = format!("[\"{}\", \"{sign}{}\", \"= 0 m\"]", x.title, y.title);
        let unit = if first.members.len() == 1 { first.unit.as_str() } else { "" };
        let position = part(pattern, vec![x.column, y.column], Quantity::Position, unit, self.reason.clone());
        let rotation = self.angle.as_ref().map(|angle| {
            let stated = parts.get(angle.part).filter(|part| part.members.len() == 1).map_or("", |part| &part.unit);
            let is_long = stated.is_empty() && most(angle.column) > TURN;
            let unit = if is_long { "deg" } else { stated };
            let why = if is_long { "; in degrees is a guess, since the angle exceeds a turn in radians" } else { "" };
            let pattern = format!("[\"= 0 rad\", \"= 0 rad\", \"{sign}{}\"]", angle.title);
            part(pattern, vec![angle.column], Quantity::Rotation, unit, format!("the angle about the vertical{why}"))
        });
        std::iter::once(position).chain(rotation).collect()
    }
}

fn most(column: &ColumnReport) -> f64 {
    column.min.abs().max(column.max.abs())
}

/// The scalars of a log, by sheet and title.
fn scalars<'a>(parts: &[Part<'a>]) -> BTreeMap<(String, String), Cell<'a>> {
    let is_scalar = |part: &Part| matches!(part.quantity, Quantity::Number | Quantity::Flag);
    let all = parts.iter().enumerate().filter(|(_, part)| is_scalar(part));
    let cell = |(part, it): (usize, &Part<'a>)| match it.members[..] {
        [column] => {
            Some(((it.sheet.name.clone(), it.pattern.clone()), Cell { part, title: it.pattern.clone(), column }))
        }
        _ => None,
    };
    all.filter_map(cell).collect()
}

/// Pairs of columns that differ in x and y only, and the angle of the same name.
fn pairs<'a>(parts: &[Part<'a>]) -> Vec<PlanarPose<'a>> {
    let scalars = scalars(parts);
    let mut found: Vec<PlanarPose> = vec![];
    for ((sheet, title), x) in &scalars {
        let parted = PAIRS.iter().flat_map(|endings| {
            let [first, ..] = endings;
            title.rmatch_indices(first).map(move |(at, _)| (endings, at, first.len()))
        });
        let pair = parted.into_iter().find_map(|([_, second, third], at, length)| {
            let (head, tail) = (title.get(..at)?, title.get(at + length..)?);
            let of = |ending: &str| scalars.get(&(sheet.clone(), format!("{head}{ending}{tail}")));
            let is_component = !tail.starts_with(char::is_alphanumeric) && (*second != "y" || !ends_with_word(head));
            let y = of(second).filter(|_| is_component && of(third).is_none())?;
            Some((y.clone(), format!("{head} {tail}")))
        });
        let Some((y, name)) = pair else { continue };
        let own = words::words(&name);
        if words::has(&own, &OTHERS) {
            continue;
        }
        let is_angle = |part: &Part| {
            let words = words::words(part.name.strip_prefix(&format!("{sheet}.")).unwrap_or(&part.name));
            let others: Vec<&String> = words.iter().filter(|word| !is_quantity(word)).collect();
            part.sheet.name == *sheet
                && words.iter().any(|word| ANGLES.contains(&word.as_str()))
                && others == own_words(&own, sheet)
        };
        let angle = scalars.values().find(|cell| parts.get(cell.part).is_some_and(is_angle)).cloned();
        let reason = "x and y in a plane; the log has no height, 0 m is a guess".to_string();
        found.push(PlanarPose { name, at: [x.clone(), y], angle, is_mirrored: false, reason });
    }
    found
}

/// Whether a name ends within a word, such as `block_ma` of `block_max`.
fn ends_with_word(head: &str) -> bool {
    let letters = head.chars().rev().take_while(|letter| letter.is_lowercase()).count();
    letters > 1 || letters == 1 && !head.ends_with(['p', 'd'])
}

/// Whether a word says which quantity of a body a column is, or in which unit.
fn is_quantity(word: &str) -> bool {
    ANGLES.contains(&word) || ["pos", "position", "pose", "xy", "deg", "rad", "mm", "cm", "m"].contains(&word)
}

/// The words of a name without those of its sheet and its unit.
fn own_words<'w>(own: &'w [String], sheet: &str) -> Vec<&'w String> {
    let of_sheet = words::words(sheet).len();
    own.iter().skip(of_sheet).filter(|word| !is_quantity(word)).collect()
}

/// Arrays of three numbers that are called poses, in logs without grippers: a place in space has no angle, and is called position.
fn arrays<'a>(parts: &[Part<'a>], has_pair: bool) -> Vec<PlanarPose<'a>> {
    let has_gripper = parts.iter().any(|part| words::has(&part.words, &["gripper", "opening", "closed", "width"]));
    let body = |part: &Part| words::body(&part.name);
    let is_turned =
        |part: &Part| parts.iter().any(|other| other.quantity == Quantity::Rotation && body(other) == body(part));
    let is_pose = |part: &Part| {
        let is_called = words::has(&part.words, &PLANAR) || words::has(&part.words, &["pose", "poses"]);
        let is_array = part.pattern.ends_with("<xyz=[0] [1] [2]>") || part.pattern.ends_with("<xyz=_0 _1 _2>");
        part.quantity == Quantity::Position && part.unit.is_empty() && is_array && is_called && !is_turned(part)
    };
    let pose = |(place, part): (usize, &Part<'a>)| {
        let [x, y, angle] = part.members[..] else { return None };
        let prefix = if part.sheet.name.is_empty() { String::new() } else { format!("{}.", part.sheet.name) };
        let cell = |column: &'a ColumnReport| Cell { part: place, title: format!("{prefix}{}", column.name), column };
        let is_named = words::has(&part.words, &PLANAR);
        // A larger number is a height in millimeters.
        if !is_named && most(angle) > TURN {
            return None;
        }
        let reason = match has_pair || is_named {
            true => "x and y in a plane; the log has no height, 0 m is a guess".to_string(),
            false => {
                format!("a pose of three numbers: x, y and an angle; if the third is a height, `{}`", part.pattern)
            }
        };
        Some(PlanarPose {
            name: part.name.clone(),
            at: [cell(x), cell(y)],
            angle: Some(cell(angle)),
            is_mirrored: false,
            reason,
        })
    };
    let all = parts.iter().enumerate().filter(|(_, part)| !has_gripper && is_pose(part));
    all.filter_map(pose).collect()
}

/// The tool and the block in an array without names, as Push-T writes its state: x and y of each, and the angle of the block. The values are pixels, or the
/// commands beside them are near the tool.
fn unnamed<'a>(parts: &[Part<'a>]) -> Vec<PlanarPose<'a>> {
    let mut states: BTreeMap<(String, String), BTreeMap<usize, Cell<'a>>> = BTreeMap::new();
    for ((sheet, title), cell) in scalars(parts) {
        let element = title.strip_suffix(']').and_then(|title| title.rsplit_once('['));
        let Some((base, Ok(at))) = element.map(|(base, at)| (base, at.parse::<usize>())) else { continue };
        let words = words::words(base);
        if words::has(&words, &["state", "obs", "observation"]) && !words::has(&words, &["joint", "joints", "robot"]) {
            states.entry((sheet, base.to_string())).or_default().insert(at, cell);
        }
    }
    let poses = states.into_iter().filter_map(|((_, base), cells)| {
        let count = cells.len();
        let cells: Vec<Cell> = (0..count).map_while(|at| cells.get(&at).cloned()).collect();
        let [tool_x, tool_y, x, y, angle, ..] = &cells[..] else { return None };
        let places = [tool_x, tool_y, x, y];
        let is_in_pixels = places.iter().all(|cell| cell.column.min >= 0.0 && cell.column.max > PIXELS);
        let is_angle = most(angle.column) <= TURN && angle.column.kind == ValueKind::Number;
        let is_state = UNNAMED.contains(&count) && is_angle && rests_while_moves(x.column, tool_x.column);
        if !is_state || !is_in_pixels && !is_commanded(parts, tool_x) {
            return None;
        }
        let of = "an array without names, as Push-T writes it: x and y of the tool, then x, y and the angle of the block";
        let of = match is_in_pixels {
            true => format!(
                "{of}; they look like pixels, with y down: 1 mm each is a guess, write the size of a pixel, such as `{} * 0.5 [mm]`",
                x.title
            ),
            false => of.to_string(),
        };
        let pose = |name: &str, at: [&Cell<'a>; 2], angle: Option<&Cell<'a>>| PlanarPose {
            name: format!("{base} {name}"),
            at: at.map(Clone::clone),
            angle: angle.cloned(),
            is_mirrored: is_in_pixels,
            reason: of.clone(),
        };
        Some([pose("agent", [tool_x, tool_y], None), pose("block", [x, y], Some(angle))])
    });
    poses.flatten().collect()
}

/// Whether a place changes by less than 0.01 % in a tenth of the steps in which a tool moves: what nothing touches rests.
fn rests_while_moves(place: &ColumnReport, tool: &ColumnReport) -> bool {
    let steps = place.samples.windows(2).zip(tool.samples.windows(2));
    let (moves, rests) = steps.filter(|(_, tool)| tool[0] != tool[1]).fold((0, 0), |(moves, rests), (place, _)| {
        (moves + 1, rests + usize::from((place[1] - place[0]).abs() < 1e-4 * (place[0].abs() + 1e-3)))
    });
    moves > 0 && rests * 10 >= moves
}

/// Whether the log has commands of two numbers that are near a tool.
fn is_commanded(parts: &[Part], tool: &Cell) -> bool {
    let is_first = |column: &ColumnReport| column.name.ends_with("action[0]") || column.name.ends_with("action_0");
    let columns = || parts.iter().flat_map(|part| part.members.iter().copied());
    let has_third = columns().any(|column| column.name.ends_with("action[2]") || column.name.ends_with("action_2"));
    let way = tool.column.max - tool.column.min;
    let is_near = |command: &ColumnReport| {
        let pairs = command.samples.iter().zip(&tool.column.samples);
        median(pairs.map(|(command, at)| (command - at).abs()).collect()).is_some_and(|apart| apart < NEAR * way)
    };
    !has_third && columns().filter(|column| is_first(column)).any(is_near)
}

/// The pose of the tool: by a name of tools, else the only one without an angle, else by a name of what pushes.
fn tool(parts: &[Part], poses: &[PlanarPose]) -> Option<usize> {
    let words = |pose: &PlanarPose| words::words(&pose.name);
    let is_known = poses.iter().any(|pose| words::tool_rank(&words(pose)).is_some())
        || parts.iter().any(|part| part.quantity == Quantity::Position && words::tool_rank(&part.words).is_some());
    if is_known {
        return None;
    }
    let only = |is_it: &dyn Fn(&PlanarPose) -> bool| {
        let mut found = (0..).zip(poses).filter(|(_, pose)| is_it(pose)).map(|(at, _)| at);
        found.next().filter(|_| found.next().is_none())
    };
    only(&|pose| pose.angle.is_none()).or_else(|| only(&|pose| words::has(&words(pose), &PUSHERS)))
}
