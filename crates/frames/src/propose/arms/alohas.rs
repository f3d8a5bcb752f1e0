//! The two arms of ALOHA, by the array of its recorder or by the names of the joints.

use super::super::hands::side_of;
use super::super::parts::{Part, Quantity};
use super::super::yaml_scalar::quoted;
use super::Arm;
use std::f64::consts::PI;
use teachtree_base::hands::Side;

/// The joints of an arm with their limits, rad.
const JOINTS: [(&str, [f64; 2]); 6] = [
    ("waist", [-PI, PI]),
    ("shoulder", [-1.85, 1.2566]),
    ("elbow", [-1.7628, 1.6057]),
    ("forearm_roll", [-PI, PI]),
    ("wrist_angle", [-1.8675, 2.234]),
    ("wrist_rotate", [-PI, PI]),
];
/// Joints may be this far beyond their limits, rad.
const BEYOND: f64 = 0.1;
/// The poses of the arms in the simulated ALOHA, as entries of `robots`: they face each other.
const BASES: [&str; 2] = ["position: [-469 mm, 0 mm, 0 mm]", "position: [469 mm, 0 mm, 0 mm], rotation: [0, 0, 0, 1]"];
/// The finger of a gripper by its share of the way from shut to open, as the constants of ALOHA normalize it.
const OF_SHARE: &str = " * 0.03956 + 0.01844 [m]";

/// The arms with their sides and the places of their joints among the parts.
pub fn alohas(parts: &[Part]) -> Vec<(Side, Vec<usize>, Arm)> {
    Side::BOTH.into_iter().filter_map(|side| of_array(parts, side).or_else(|| of_names(parts, side))).collect()
}

/// An arm of `observations/qpos` or `observation.state`: six joints and the gripper of the left arm, then those of the right one.
fn of_array(parts: &[Part], side: Side) -> Option<(Side, Vec<usize>, Arm)> {
    let heads = ["observations/qpos[", "observation.state["];
    let head = parts.iter().find_map(|part| {
        let head = part.pattern.strip_suffix("0]")?;
        heads.iter().any(|known| head.ends_with(known)).then_some(head)
    })?;
    let place = |at: usize| parts.iter().position(|part| part.pattern == format!("{head}{at}]"));
    // The grippers are taken already.
    if place(12).is_none() || place(14).is_some() {
        return None;
    }
    let first = 7 * side.index();
    let places: Vec<usize> = (first..first + JOINTS.len()).filter_map(place).collect();
    let gripper = format!("{head}{}]", first + JOINTS.len());
    let arm = arm(parts, side, &places, &gripper, "by the array of ALOHA's recorder")?;
    Some((side, places, arm))
}

/// An arm whose joints have their names: `observation.state.left_waist`.
fn of_names(parts: &[Part], side: Side) -> Option<(Side, Vec<usize>, Arm)> {
    let is_here = |part: &Part| part.quantity != Quantity::Other && side_of(part) == Some(side);
    let (first, ..) = JOINTS[0];
    let (head, tail) = parts.iter().filter(|part| is_here(part)).find_map(|part| part.pattern.split_once(first))?;
    let named = |name: &str| format!("{head}{name}{tail}");
    let place = |(name, _): &(&str, _)| parts.iter().position(|part| part.pattern == named(name));
    let places: Vec<usize> = JOINTS.iter().filter_map(place).collect();
    let arm = arm(parts, side, &places, &named("gripper"), "by the names of the joints")?;
    Some((side, places, arm))
}

fn arm(parts: &[Part], side: Side, places: &[usize], gripper: &str, why: &str) -> Option<Arm> {
    let joints: Vec<&Part> = places.iter().filter_map(|place| parts.get(*place)).collect();
    let sheet = joints.first()?.sheet;
    let is_within = |(part, (_, [low, high])): (&&Part, &(&str, [f64; 2]))| {
        let scale = part.scale();
        part.members.iter().all(|it| it.min * scale >= low - BEYOND && it.max * scale <= high + BEYOND)
    };
    if joints.len() != JOINTS.len() || !joints.iter().zip(&JOINTS).all(is_within) {
        return None;
    }
    let columns = joints.iter().zip(JOINTS);
    let mut columns: Vec<String> =
        columns.map(|(part, (joint, _))| format!("{joint}: {}", quoted(&part.columns()))).collect();
    let of_sheet = gripper.strip_prefix(&format!("{}.", sheet.name)).unwrap_or(gripper);
    let range = sheet.columns.iter().find(|column| column.name == of_sheet).map(|column| [column.min, column.max]);
    let form = match range {
        Some([low, high]) if low >= 0.0 && high <= 0.07 => Some(" [m]"),
        Some([low, high]) if low >= -0.2 && high <= 1.3 => Some(OF_SHARE),
        _ => None,
    };
    columns.extend(form.map(|form| format!("left_finger: {}", quoted(&format!("{gripper}{form}")))));
    let base = BASES[side.index()];
    Some(Arm {
        side,
        entry: format!("model: vx300s, hand: {side}, {base}, joints: {{{}}}", columns.join(", ")),
        reason: format!("{why}; it stands where it does in the simulated ALOHA, measure yours"),
        has_gripper: form.is_some(),
        is_incomplete: false,
        sheet: sheet.name.clone(),
    })
}
