//! Arms that come with the program, found by the names, the number and the range of the joints that a log has.

mod alohas;

use super::grippers::Gripper;
use super::hands::side_of;
use super::parts::{Part, Quantity};
use super::words;
use super::yaml_scalar::quoted;
use std::collections::BTreeMap;
use teachtree_base::hands::Side;

/// The joints of an SO-101 as LeRobot names them, without the gripper.
const SO101: [&str; 5] = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll"];
/// What LeRobot writes around the names of joints.
const LEROBOT: [&str; 2] = ["observation.state.", ".pos"];
/// Percent at the end of a range are 100 but for rounding.
const STOPS: f64 = 1e-4;
/// Percent are within this.
const PERCENT: f64 = 100.5;
/// Degrees are within this, ticks of an encoder are not.
const DEGREES: f64 = 370.0;
/// The limits of the joints of a Panda, rad.
const PANDA: [[f64; 2]; 7] = [
    [-2.8973, 2.8973],
    [-1.7628, 1.7628],
    [-2.8973, 2.8973],
    [-3.0718, -0.0698],
    [-2.8973, 2.8973],
    [-0.0175, 3.7525],
    [-2.8973, 2.8973],
];
/// Joints may be this far beyond their limits, rad.
const BEYOND: f64 = 0.05;

/// An arm.
#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    /// The hand that its tool is.
    pub side: Side,
    /// Its entry of `robots`, without its name.
    pub entry: String,
    /// Why it is this arm.
    pub reason: String,
    /// Whether a joint of its model gives the opening of its gripper.
    pub has_gripper: bool,
    /// Whether a file that is not in the log is needed: then the entry is a comment.
    pub is_incomplete: bool,
    /// The sheet of its columns.
    pub sheet: String,
}

/// The arms of hands without a measured point, and the parts that belong to none of them. `lerobot_version` is the version of a data set of LeRobot.
pub fn arms<'a>(
    parts: Vec<Part<'a>>,
    grippers: &BTreeMap<Side, Gripper>,
    is_measured: impl Fn(Side) -> bool,
    lerobot_version: Option<&str>,
) -> (Vec<Arm>, Vec<Part<'a>>) {
    let mut arms: Vec<Arm> = vec![];
    let mut taken = vec![];
    for (side, places, arm) in alohas::alohas(&parts) {
        if !is_measured(side) {
            arms.push(arm);
            taken.extend(places);
        }
    }
    let families =
        so101s(&parts).into_iter().map(|of| (of, true)).chain(sevens(&parts).into_iter().map(|of| (of, false)));
    for (places, is_so101) in families {
        let joints: Vec<&Part> = places.iter().filter_map(|at| parts.get(*at)).collect();
        let side = joints.first().and_then(|joint| side_of(joint)).unwrap_or(Side::Right);
        if is_measured(side) || arms.iter().any(|arm| arm.side == side) {
            continue;
        }
        let gripper = grippers.get(&side);
        let arm = match is_so101 {
            true => so101(side, &joints, gripper, lerobot_version),
            false => panda(side, &joints, gripper),
        };
        if let Some(arm) = arm {
            arms.push(arm);
            taken.extend(places);
        }
    }
    arms.sort_by_key(|arm| arm.side);
    let rest = parts.into_iter().enumerate().filter(|(at, _)| !taken.contains(at)).map(|(_, part)| part).collect();
    (arms, rest)
}

fn is_joint(part: &Part) -> bool {
    let others = ["torque", "torques", "tau", "current", "temperature", "load", "desired", "external"];
    part.quantity == Quantity::Number && !words::has(&part.words, &others)
}

/// What stands before and after the name of a joint of an SO-101, with its place.
fn so101_joint(pattern: &str) -> Option<(&str, &str, usize)> {
    SO101.iter().enumerate().find_map(|(at, joint)| {
        let (head, tail) = pattern.split_once(joint)?;
        Some((head, tail, at))
    })
}

/// The places of the joints of each SO-101.
fn so101s(parts: &[Part]) -> Vec<Vec<usize>> {
    let mut families: BTreeMap<(&str, &str), BTreeMap<usize, usize>> = BTreeMap::new();
    // Joints of an arm that stands still are constant.
    for (place, part) in parts.iter().enumerate().filter(|(_, part)| part.quantity != Quantity::Other) {
        if let Some((head, tail, joint)) = so101_joint(&part.pattern) {
            families.entry((head, tail)).or_default().insert(joint, place);
        }
    }
    let whole = families.into_values().filter(|joints| joints.len() == SO101.len());
    whole.map(|joints| joints.into_values().collect()).collect()
}

fn so101(side: Side, joints: &[&Part], gripper: Option<&Gripper>, lerobot_version: Option<&str>) -> Option<Arm> {
    let first = joints.first()?;
    let (head, tail, _) = so101_joint(&first.pattern)?;
    let has_gripper = gripper.is_some_and(|gripper| gripper.closed.starts_with(&format!("{head}gripper{tail}")));
    let mut entry = format!("model: so101, hand: {side}");
    if let Some(head) = head.strip_suffix("main_") {
        let column = |joint: &str, of: &str| format!("{joint}: {}", quoted(&format!("{head}main_{joint}{tail}{of}")));
        let joints = [
            column("shoulder_pan", " [deg]"),
            column("shoulder_lift", " * -1 + 90 [deg]"),
            column("elbow_flex", " - 90 [deg]"),
            column("wrist_flex", " [deg]"),
            column("wrist_roll", " [deg]"),
            column("gripper", ""),
        ];
        entry.push_str(&format!(", joints: {{{}}}", joints.join(", ")));
        let reason = "by the names of the joints, which are those before LeRobot's new calibration".into();
        return Some(Arm { side, entry, reason, has_gripper, is_incomplete: false, sheet: first.sheet.name.clone() });
    }
    if [head, tail] != LEROBOT {
        entry.push_str(&format!(", joints: {}", quoted(&format!("{head}<joint>{tail}"))));
    }
    let norm = if first.unit.is_empty() { so101_norm(joints, lerobot_version) } else { Norm::Stated };
    let (key, scale) = norm.text();
    entry.push_str(key);
    let reason = format!("by the names of the joints{scale}");
    let is_incomplete = norm == Norm::Ticks;
    Some(Arm { side, entry, reason, has_gripper, is_incomplete, sheet: first.sheet.name.clone() })
}

/// What the numbers of the joints of an SO-101 mean, and what shows it. LeRobot cuts percent off at 100. It wrote percent by default from its new calibration in
/// June 2025 (pull request 777) until version 0.4.4 in February 2026 (pull request 2968), and degrees since; data sets are of version 2 until September 2025.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Norm {
    /// The log has the unit.
    Stated,
    /// Beyond degrees.
    Ticks,
    /// Degrees, since percent are not beyond 100.
    DegreesByValue,
    /// Percent, since a joint stops at exactly 100.
    PercentByValue,
    /// Percent, since the data set is of version 2.
    PercentByVersion,
    /// Degrees, as usual now.
    Degrees,
}

impl Norm {
    /// The key of an entry of `robots`, and the reason.
    fn text(self) -> (&'static str, &'static str) {
        const PERCENT: &str = ", norm: percent";
        match self {
            Self::Stated => ("", ""),
            Self::Ticks => (
                ", norm: ticks, calibration: my_follower.json",
                "; ticks need the calibration file of the arm beside this file",
            ),
            Self::DegreesByValue => ("", "; in degrees, since a joint is beyond 100"),
            Self::PercentByValue => {
                (PERCENT, "; in percent of the range, since a joint stops at exactly 100; else delete `norm`")
            }
            Self::PercentByVersion => (
                PERCENT,
                "; -100 to 100 of the range, as LeRobot wrote data sets of version 2 by default; delete `norm` if they were recorded with `use_degrees=true`",
            ),
            Self::Degrees => (
                "",
                "; in degrees, as LeRobot writes them since version 0.4.4; with `norm: percent` if they are from -100 to 100, as before",
            ),
        }
    }
}

/// What the numbers of the joints of an SO-101 mean.
fn so101_norm(joints: &[&Part], lerobot_version: Option<&str>) -> Norm {
    let columns = || joints.iter().flat_map(|part| &part.members);
    let most = columns().map(|it| it.min.abs().max(it.max.abs())).fold(0.0, f64::max);
    let stops = columns().any(|it| [it.min, it.max].iter().any(|end| (end.abs() - 100.0).abs() < STOPS));
    match () {
        () if most > DEGREES => Norm::Ticks,
        () if most > PERCENT => Norm::DegreesByValue,
        () if stops => Norm::PercentByValue,
        () if lerobot_version.is_some_and(|version| version.starts_with("v2")) => Norm::PercentByVersion,
        () => Norm::Degrees,
    }
}

/// The text before and after the last number of a name, and the number.
fn numbered(pattern: &str) -> Option<(&str, &str, usize)> {
    let end = pattern.rfind(|letter: char| letter.is_ascii_digit())? + 1;
    let digits = pattern.get(..end)?.chars().rev().take_while(char::is_ascii_digit).count();
    let start = end - digits;
    Some((pattern.get(..start)?, pattern.get(end..)?, pattern.get(start..end)?.parse().ok()?))
}

/// The places of each seven joints in a row, numbered from 0 or 1.
fn sevens(parts: &[Part]) -> Vec<Vec<usize>> {
    let mut families: BTreeMap<(usize, &str, &str), BTreeMap<usize, usize>> = BTreeMap::new();
    for (place, part) in parts.iter().enumerate() {
        if let (true, Some((head, tail, number))) = (is_joint(part), numbered(&part.pattern)) {
            // The shortest name is that of the measured joints: `q` rather than `q_d`.
            families.entry((head.len(), head, tail)).or_default().insert(number, place);
        }
    }
    let of = |numbers: BTreeMap<usize, usize>| -> Option<Vec<usize>> {
        let first = *numbers.keys().next().filter(|first| **first < 2)?;
        let seven: Vec<usize> = (first..first + PANDA.len()).filter_map(|at| numbers.get(&at).copied()).collect();
        (seven.len() == PANDA.len() && numbers.len() <= PANDA.len() + 2).then_some(seven)
    };
    families.into_values().filter_map(of).collect()
}

fn panda(side: Side, joints: &[&Part], gripper: Option<&Gripper>) -> Option<Arm> {
    let first = joints.first()?;
    let is_within = |factor: f64| {
        joints.iter().zip(PANDA).all(|(joint, [low, high])| {
            joint.members.iter().all(|it| it.min * factor >= low - BEYOND && it.max * factor <= high + BEYOND)
        })
    };
    let (factor, unit) = match () {
        () if !first.unit.is_empty() => (first.scale(), ""),
        () if is_within(1.0) => (1.0, ""),
        () => (1_f64.to_radians(), " [deg]"),
    };
    if !is_within(factor) || joints.iter().any(|joint| joint.members.len() != 1) {
        return None;
    }
    let says = |known: &[&str]| {
        words::has(&first.words, known) || known.iter().any(|word| first.pattern.to_lowercase().contains(word))
    };
    let reason = match () {
        () if says(&["panda", "franka", "fr3"]) => "by the names of the joints",
        () => {
            "by the number and the ranges of the joints; an arm of another kind with `urdf` (docs/bindings.md, Joints)"
        }
    };
    let column = |(index, joint): (usize, &&Part)| {
        format!("panda_joint{}: {}", index + 1, quoted(&format!("{}{unit}", joint.columns())))
    };
    let columns: Vec<String> = joints.iter().enumerate().map(column).collect();
    let mut columns = format!("joints: {{{}", columns.join(", "));
    if let Some((opening, _)) = gripper.and_then(|gripper| gripper.opening.as_ref()) {
        columns.push_str(&format!(", panda_finger_joint1: {}", half(opening)));
    }
    let entry = format!("model: panda, hand: {side}, {columns}}}");
    Some(Arm {
        side,
        entry,
        reason: reason.into(),
        has_gripper: false,
        is_incomplete: false,
        sheet: first.sheet.name.clone(),
    })
}

/// Half of an opening: the way of a finger.
fn half(opening: &str) -> String {
    match opening.split_once(" * 2") {
        Some((finger, unit)) => quoted(&format!("{finger}{unit}")),
        None => format!("{{mean: [{}, \"= 0 m\"]}}", quoted(opening)),
    }
}
