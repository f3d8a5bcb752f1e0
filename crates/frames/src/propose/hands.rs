//! The hands of a log: tool points, fingertips, forces at the wrist.

use super::bodies::key;
use super::parts::{Part, Quantity};
use super::{hand_markers, marker_sets, words};
use std::collections::{BTreeMap, BTreeSet};
use teachtree_base::hands::{Finger, Side};

/// The rank of the last link of an arm.
const LINK: usize = 50;
/// The rank of a position without any name.
const UNNAMED: usize = 99;

/// A hand.
#[derive(Clone, Debug, Default)]
pub struct Hand<'a> {
    /// The tool point, the palm where the fingertips are known.
    pub tool: Option<Part<'a>>,
    /// Other markers of the hand, which keep their distances from the tool point.
    pub markers: Vec<Part<'a>>,
    /// How it is turned.
    pub rotation: Option<Part<'a>>,
    /// The fingertips.
    pub tips: BTreeMap<Finger, Part<'a>>,
    /// The force at the wrist.
    pub force: Option<Part<'a>>,
    /// The torque there.
    pub torque: Option<Part<'a>>,
}

/// The hands, and the parts that are of none of them.
pub fn hands<'a>(parts: Vec<Part<'a>>) -> (BTreeMap<Side, Hand<'a>>, Vec<Part<'a>>) {
    let mut hands: BTreeMap<Side, Hand<'a>> = BTreeMap::new();
    let only = only_side(&parts);
    let fingers_of = hands_with_fingers(&parts);
    // `Hand:Middle` is a finger beside `Hand:Thumb`.
    let finger_beside = |part: &Part| {
        let (finger, others) = words::of_finger(&part.words)?;
        (!others.is_empty() && fingers_of.contains(&others)).then_some(finger)
    };
    let mut rest = vec![];
    let mut tools: BTreeMap<Side, Vec<(usize, Part<'a>)>> = BTreeMap::new();
    for part in parts {
        let side = side_of(&part).unwrap_or(only);
        match (part.quantity, words::finger(&part.words).or_else(|| finger_beside(&part))) {
            (Quantity::Position, Some(finger)) if !part.is_constant() => {
                let tips = &mut hands.entry(side).or_default().tips;
                if tips.get(&finger).is_none_or(|known| is_tip(&part) && !is_tip(known)) {
                    tips.insert(finger, part);
                }
            }
            (Quantity::Position, None) if !part.is_constant() => match rank(&part) {
                Some(rank) => tools.entry(side).or_default().push((rank, part)),
                None => rest.push(part),
            },
            // A hand at rest is not an object.
            (Quantity::Position, None) if words::is_only_tool(&part.words) && !words::is_worn(&part.words) => {
                let reason = "it never moves, and its name is that of a hand: if it is an object, bind its position";
                rest.push(Part { quantity: Quantity::Other, left_out: Some(reason.into()), ..part });
            }
            _ => rest.push(part),
        }
    }
    // What lies between a fingertip and the palm is a part of the finger.
    let has_tip = |finger: &Finger| hands.values().any(|hand| hand.tips.len() > 2 && hand.tips.contains_key(finger));
    for part in rest.iter_mut().filter(|part| part.quantity == Quantity::Position) {
        if words::joint_of_finger(&part.words).is_some_and(|finger| has_tip(&finger)) {
            part.quantity = Quantity::Other;
        }
    }
    hand_markers::leave_out(&mut rest, hands.values().map(|hand| &hand.tips));
    // A place without a name is the tool where nothing else is.
    let is_name = |(rank, part): &(usize, Part)| *rank < UNNAMED && !words::is_worn(&part.words);
    let is_named = tools.values().flatten().any(is_name) || hands.values().any(|hand| !hand.tips.is_empty());
    for (side, mut candidates) in tools {
        candidates.sort_by_key(|(rank, part)| (words::is_worn(&part.words), *rank));
        let mut candidates =
            candidates.into_iter().filter(|(rank, _)| !is_named || *rank < UNNAMED).map(|(_, part)| part);
        // `hand_left` may be a marker on the only hand with fingers.
        let is_marker = |tool: &Part| {
            !hands.contains_key(&side)
                && hands.values().flat_map(|hand| hand.tips.values()).any(|tip| hand_markers::is_near(tool, tip))
        };
        let unused = match candidates.next() {
            Some(tool) if is_marker(&tool) => std::iter::once(tool).chain(candidates).collect(),
            Some(tool) => {
                // Two links of an arm keep their distance too.
                let is_point = |part: &Part| words::flange_rank(&part.words).is_none();
                let stem = |part: &Part| {
                    words::numbered_body(&part.name)
                        .filter(|_| is_point(part))
                        .and_then(|name| marker_sets::stem(&name))
                };
                let of_tool = stem(&tool);
                let is_beside =
                    |part: &Part| of_tool.is_some() && stem(part) == of_tool && marker_sets::is_rigid(&tool, part);
                let (markers, others): (Vec<Part>, Vec<Part>) = candidates.partition(is_beside);
                let hand = hands.entry(side).or_default();
                (hand.tool, hand.markers) = (Some(tool), markers);
                others
            }
            None => vec![],
        };
        rest.extend(unused.into_iter().map(|part| match words::is_worn(&part.words) {
            true => part,
            false => Part { quantity: Quantity::Other, ..part },
        }));
    }
    for (side, hand) in &mut hands {
        let Some(tool) = &hand.tool else { continue };
        let is_of = |part: &Part| {
            part.quantity == Quantity::Rotation
                && key(&part.name) == key(&tool.name)
                && side_of(part).unwrap_or(only) == *side
        };
        // The links of an arm may differ in a number only.
        let number = words::numbered_body(&tool.name);
        let is_same = |part: &Part| is_of(part) && words::numbered_body(&part.name) == number;
        hand.rotation = take(&mut rest, is_same).or_else(|| take(&mut rest, is_of));
    }
    (hands, rest)
}

/// Gives hands the forces at their wrists, unless contacts of their fingers are measured.
pub fn wrists<'a>(hands: &mut BTreeMap<Side, Hand<'a>>, rest: &mut Vec<Part<'a>>, are_wanted: bool) {
    let only = match hands.keys().collect::<Vec<_>>()[..] {
        [side] => *side,
        _ => Side::Right,
    };
    for side in Side::BOTH.into_iter().filter(|_| are_wanted) {
        let is_of = |part: &Part, quantity: Quantity| {
            part.quantity == quantity
                && !part.is_constant()
                && side_of(part).unwrap_or(only) == side
                && words::finger(&part.words).is_none()
        };
        let force = take(rest, |part| is_of(part, Quantity::Force));
        let torque = take(rest, |part| is_of(part, Quantity::Torque));
        if force.is_some() {
            let hand = hands.entry(side).or_default();
            (hand.force, hand.torque) = (force, torque);
        }
    }
}

/// The words of the fingers of each hand that has a thumb or an index, without those for the finger.
fn hands_with_fingers(parts: &[Part]) -> BTreeSet<Vec<String>> {
    let positions = parts.iter().filter(|part| part.quantity == Quantity::Position);
    let of_finger = positions.filter_map(|part| words::of_finger(&part.words));
    of_finger.filter(|(finger, _)| [Finger::Thumb, Finger::Index].contains(finger)).map(|(_, others)| others).collect()
}

/// Takes the first part for which this holds.
fn take<'a>(parts: &mut Vec<Part<'a>>, is_it: impl Fn(&Part) -> bool) -> Option<Part<'a>> {
    let at = parts.iter().position(is_it)?;
    Some(parts.remove(at))
}

/// The hand in the name of a part. The fingers of a gripper are called left and right too.
pub fn side_of(part: &Part) -> Option<Side> {
    let is_finger =
        words::has(&part.words, &["finger", "fingertip", "fingerpad", "pad", "leftfinger", "rightfinger", "knuckle"]);
    let others: Vec<String> = part
        .words
        .iter()
        .filter(|word| !(is_finger && ["left", "right", "l", "r"].contains(&word.as_str())))
        .cloned()
        .collect();
    words::side(&others)
}

/// The side of parts without one in their names: that of the only tool.
fn only_side(parts: &[Part]) -> Side {
    let is_hand = |part: &&Part| {
        part.quantity == Quantity::Position
            && (words::tool_rank(&part.words).is_some() || words::finger(&part.words).is_some())
    };
    let mut sides: Vec<Side> = parts.iter().filter(is_hand).filter_map(side_of).collect();
    sides.sort_unstable();
    sides.dedup();
    match sides[..] {
        [side] => side,
        _ => Side::Right,
    }
}

fn is_tip(part: &Part) -> bool {
    part.words.iter().any(|word| word.ends_with("tip"))
}

/// How good a position is as a tool point; none of other places.
fn rank(part: &Part) -> Option<usize> {
    // `gripper0_eef` and `arm/tool` are better than `robot0_hand`; parts of a person are neither.
    let of_tool = words::tool_rank(&part.words).filter(|rank| !words::is_part(&part.words) || *rank < 6);
    let of_link = || words::flange_rank(&part.words).map(|rank| LINK + rank);
    // Numbers without a name count things.
    let is_unnamed = || key(&part.name).is_empty() && !words::has_number(&part.name);
    match words::tool_rank(&part.words) {
        Some(_) => of_tool.or_else(of_link),
        None => of_link().or_else(|| is_unnamed().then_some(UNNAMED)),
    }
}
