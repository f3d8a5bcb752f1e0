//! The text of a proposed binding.

use super::contacts::Line;
use super::hands::Hand;
use super::hold_points::{HoldPoint, Kind};
use super::parts::Part;
use super::rounded_yaml::{plain, point_mm};
use super::timing::Timing;
use super::words;
use super::wrist_forces::{self, UNKNOWN_SIGN};
use super::yaml_scalar::{comment, quoted, scalar};
use super::{Answers, Survey, param_text, unused_columns};
use nalgebra::Vector3;
use std::fmt::Write as _;
use teachtree_base::hands::Side;

/// Why the other end of a gripper is a comment.
const OTHER_END: &str = "if it is closed at the other end";
/// How far from the middle of a small object a hand touches it, m.
const SURFACE_M: f64 = 0.025;
/// The flag of a hand that never holds anything.
const NEVER: &str = "= 0";

/// Writes the binding. `refused` are lines about the columns of a log without any channel.
pub fn binding(survey: &Survey, timing: &Timing, answers: &Answers, refused: &[String]) -> String {
    let mut text = String::from(
        "# Guessed by `teachtree init` from the names, units and values of the columns. Comments give reasons and alternatives\n# (docs/bindings.md); `teachtree inspect LOG` lists what can be detected.\nabout: describe this log\n",
    );
    if survey.is_pair() {
        text.push_str("hand_file: hand_gripper_pair.rules    # two grippers, and no pose of an object\n");
    }
    if survey.contacts.are_simulated {
        text.push_str(
            "hand_file: hand_flags.rules    # flags decide what fingers hold; without this line, forces do\n",
        );
    } else if survey.fixed.values().any(|side| survey.hands.get(side).is_some_and(|hand| hand.force.is_none())) {
        text.push_str("hand_file: hand_holding.rules    # each hand has its object all the time\n");
    }
    text.push_str(&param_text::params(survey));
    for line in &timing.lines {
        let _ = writeln!(text, "{line}");
    }
    // Poses in one frame are not composed.
    let carried = survey.hands.values().find_map(|hand| hand.tool.as_ref()?.carried_in.as_ref());
    if let Some(root) = carried.filter(|_| survey.bodies.is_empty()) {
        let _ = writeln!(
            text,
            "frame: {}    # the root of the transforms: the tool stays in the frame of its link",
            scalar(root)
        );
    }
    text.push_str(&robots(survey));
    let lines = lines(survey, answers);
    if !has_channels(survey, answers) && survey.arms.is_empty() {
        text.push_str(&unused_columns::blanks(refused));
        return text;
    }
    text.push_str(if lines.is_empty() { "\nchannels: {}\n" } else { "\nchannels:\n" });
    for line in &lines {
        let reason = if line.reason.is_empty() { String::new() } else { format!("    # {}", comment(&line.reason)) };
        let columns = scalar(&line.columns);
        let _ = writeln!(text, "  {}: {columns}{reason}", scalar(&line.channel));
    }
    for (side, gripper) in &survey.grippers {
        let channel = format!("{side}.gripper.closed");
        let (other, why) = match &gripper.alternative {
            _ if lines.iter().all(|line| line.channel != channel) => {
                (&gripper.closed, "left out: flags show what the fingers hold")
            }
            Some(_) if is_reversed(*side, answers) => (&gripper.closed, OTHER_END),
            Some(alternative) => (alternative, OTHER_END),
            None => continue,
        };
        let _ = writeln!(text, "  # {channel}: {}    # {why}", scalar(other));
    }
    text.push_str(&left_out(survey));
    text.push_str(&unused_columns::unused(survey));
    if !survey.contacts.supports.is_empty() {
        text.push_str("\nnormals: by_role    # contacts have no normals in the log: a support carries from below\n");
    }
    text.push_str(&wrist_forces::tare(survey));
    text.push_str(&sensors(survey));
    text
}

/// What was guessed of the log as a whole and what has no channel for it, as comments.
fn left_out(survey: &Survey) -> String {
    let mut text = String::new();
    if let Some(unit) = survey.guessed_unit {
        let others: Vec<&str> = ["m", "cm", "mm"].into_iter().filter(|other| *other != unit).collect();
        let written: Vec<String> = others.iter().map(|other| format!("`[{other}]`")).collect();
        let _ = writeln!(
            text,
            "  # positions without a unit are in {unit} by their range; if they are in {}, write {} after each",
            others.join(" or "),
            written.join(" or ")
        );
    }
    if let Some(why) = survey.y_up_reason {
        let _ = writeln!(text, "  # y points up: {why}; if z does, take the columns after `else`");
    }
    let turned = |columns: &str, what: &str| {
        format!("  # left out: {}: y points up, and {what} cannot be turned to z up\n", comment(&scalar(columns)))
    };
    text.extend(survey.unturned.iter().map(|columns| turned(columns, "three columns of a rotation")));
    let forces = survey.contacts.lines.iter().filter(|line| is_unturned(survey, line));
    text.extend(forces.map(|line| turned(&line.columns, "the forces of contacts")));
    if let Some(why) = &survey.contacts.left_out {
        let _ = writeln!(text, "  # left out: {why}");
    }
    text
}

/// Whether it is a force of a contact in a log with y up.
fn is_unturned(survey: &Survey, line: &Line) -> bool {
    survey.is_y_up() && line.channel.ends_with(".force")
}

/// The arms.
fn robots(survey: &Survey) -> String {
    let mut text = String::new();
    let is_comment = survey.arms.iter().all(|arm| arm.is_incomplete);
    if !survey.arms.is_empty() {
        text.push_str(if is_comment { "# robots:\n" } else { "robots:\n" });
    }
    for arm in &survey.arms {
        let name = if survey.arms.len() > 1 { format!("{}_arm", arm.side) } else { "arm".into() };
        let sign = if arm.is_incomplete { "# " } else { "" };
        let _ = writeln!(text, "{sign}  {name}: {{{}}}    # {}", arm.entry, arm.reason);
    }
    text
}

fn is_reversed(side: Side, answers: &Answers) -> bool {
    answers.is_reversed.get(&side).copied().unwrap_or_default()
}

/// Whether a binding has a channel, or an arm whose joints give one.
pub fn has_channels(survey: &Survey, answers: &Answers) -> bool {
    survey.arms.iter().any(|arm| !arm.is_incomplete) || !lines(survey, answers).is_empty()
}

/// The channels.
fn lines(survey: &Survey, answers: &Answers) -> Vec<Line> {
    let mut lines = vec![];
    let line = |channel: String, part: &Part, reason: &str| {
        let reasons = [reason, part.reason.as_deref().unwrap_or_default(), unit_reason(part)];
        let reason = reasons.iter().filter(|reason| !reason.is_empty()).copied().collect::<Vec<_>>().join("; ");
        let line = Line { channel, columns: part.columns(), reason };
        // A pose in a plane has its vertical by definition.
        if survey.is_y_up() && part.members.len() > 2 { upright(line, part) } else { line }
    };
    let is_fixed = survey.is_fixed_tool();
    for (side, hand) in &survey.hands {
        of_hand(survey, *side, hand, is_fixed, survey.is_pair(), &line, &mut lines);
        let is_force = |line: &&mut Line| {
            line.channel == format!("{side}.wrist.force") || line.channel == format!("{side}.palm.force")
        };
        if let Some(force) = lines.iter_mut().find(is_force) {
            wrist_forces::turn(force, *side, hand, survey);
        }
        if let Some(level) = survey.levels.get(side).filter(|_| !is_fixed) {
            let columns = format!("= {:.2} N", level.begins_n);
            let reason = format!(
                "contact begins at this force: {} moves only while the force is above it; without this line, the level is that of the rules",
                level.object
            );
            lines.push(Line { channel: format!("{side}.wrist.level"), columns, reason });
        }
        if let Some(gripper) = survey.grippers.get(side) {
            of_gripper(*side, gripper, answers, &mut lines);
            // Flags of the fingers show when the gripper holds something.
            let has_opening = lines.iter().any(|line| line.channel == format!("{side}.gripper.opening"));
            if survey.contacts.are_of_grasp(*side) && has_opening {
                lines.retain(|line| line.channel != format!("{side}.gripper.closed"));
            }
        }
    }
    for (side, gripper) in survey.grippers.iter().filter(|(side, _)| !survey.hands.contains_key(*side)) {
        of_gripper(*side, gripper, answers, &mut lines);
    }
    for body in &survey.bodies {
        let name = &body.name;
        let markers: Vec<&Part> = body.positions.iter().collect();
        lines.extend(point(survey, format!("{name}.position"), &markers, &line));
        lines.extend(body.rotation.iter().map(|part| line(format!("{name}.rotation"), part, "")));
        if let Some(angle) = &survey.mechanism
            && survey.bodies.first().is_some_and(|first| first.name == *name)
        {
            lines.push(line(format!("{name}.angle.bearing"), angle, "the angle of the mechanism"));
        }
    }
    lines.extend(survey.contacts.lines.iter().filter(|line| !is_unturned(survey, line)).cloned());
    if let Some(labels) = &survey.labels {
        lines.push(Line {
            channel: "right.label".into(),
            columns: labels.clone(),
            reason: "labels, for `score`".into(),
        });
    }
    lines
}

/// A point, the middle of its markers.
fn point(
    survey: &Survey,
    channel: String,
    markers: &[&Part],
    line: &dyn Fn(String, &Part, &str) -> Line,
) -> Option<Line> {
    match markers {
        [] => None,
        [one] => Some(line(channel, one, "")),
        // A mean of turned columns has no form.
        [first, ..] if survey.is_y_up() => Some(line(channel, first, "the first of several markers")),
        several => {
            let columns: Vec<String> = several.iter().map(|part| quoted(&part.columns())).collect();
            let columns = format!("{{mean: [{}]}}", columns.join(", "));
            Some(Line { channel, columns, reason: "markers that keep their distance".into() })
        }
    }
}

fn of_hand(
    survey: &Survey,
    side: Side,
    hand: &Hand,
    is_fixed: bool,
    is_pair: bool,
    line: &dyn Fn(String, &Part, &str) -> Line,
    lines: &mut Vec<Line>,
) {
    let has_tips = !hand.tips.is_empty();
    for (finger, part) in &hand.tips {
        lines.push(line(format!("{side}.{}.position", finger.name()), part, ""));
    }
    let length_m = survey.flange_lengths_m.get(&side).copied();
    if let Some(tool) = &hand.tool {
        match () {
            () if is_fixed => {
                lines.push(line(format!("{side}.palm.position"), tool, ""));
                lines.push(line("tool.position".into(), tool, "the tool is fixed to the hand"));
            }
            () if length_m.is_some() => {
                lines.push(line(format!("{side}.palm.position"), tool, words::flange_reason(&tool.words)));
                lines.extend(length_m.map(|length_m| of_flange(side, length_m)));
            }
            () if has_tips || !is_pair => {
                let markers: Vec<&Part> = std::iter::once(tool).chain(&hand.markers).collect();
                let hold = survey.hold_points.get(&side);
                let part = if has_tips || hold.is_some_and(|hold| !hold.is_at_pose()) { "palm" } else { "tcp" };
                lines.extend(point(survey, format!("{side}.{part}.position"), &markers, line));
                lines.extend(hold.into_iter().flat_map(|hold| of_hold(side, hold)));
                if hold.is_none() && survey.hold_points.values().any(|hold| hold.kind == Kind::Carried) {
                    lines.push(Line {
                        channel: format!("{side}.gripper.closed"),
                        columns: NEVER.into(),
                        reason: "the log does not show when this hand holds something".into(),
                    });
                }
            }
            // Each gripper of a pair is its two fingers.
            () => {
                lines.push(line(format!("{side}.thumb.position"), tool, ""));
                lines.push(line(format!("{side}.index.position"), tool, ""));
            }
        }
    }
    if let Some(rotation) = &hand.rotation {
        let has_palm = length_m.is_some() || survey.hold_points.get(&side).is_some_and(|hold| !hold.is_at_pose());
        let is_of_palm = has_tips || is_fixed || is_pair || has_palm;
        let part = if is_of_palm { "palm" } else { "tcp" };
        lines.push(line(
            if is_fixed { "tool.rotation".into() } else { format!("{side}.{part}.rotation") },
            rotation,
            "",
        ));
    }
    if let Some(force) = &hand.force {
        let channel = if has_tips || is_fixed { format!("{side}.palm.force") } else { format!("{side}.wrist.force") };
        lines.push(line(channel, force, UNKNOWN_SIGN));
    }
    if let Some(torque) = hand.torque.as_ref().filter(|_| !is_fixed) {
        lines.push(line(format!("{side}.wrist.torque"), torque, ""));
    }
}

/// The tool point of a flange, this far in front of it, m.
fn of_flange(side: Side, length_m: f64) -> Line {
    Line {
        channel: format!("{side}.tcp.position"),
        columns: format!("{{at: {}, of: {side}.palm}}", point_mm([0.0, 0.0, length_m])),
        reason: format!(
            "as far in front of the flange as the gripper holds objects: give the length of the gripper; if the columns of the palm are those of the point between the fingertips, bind them as `{side}.tcp.position` and `{side}.tcp.rotation` instead"
        ),
    }
}

/// The tool point of a hand at the place where it holds an object, and the flag that it is there.
fn of_hold(side: Side, hold: &HoldPoint) -> Vec<Line> {
    let HoldPoint { at, near_m, kind, .. } = hold;
    let object = hold.object.as_deref().unwrap_or("an object");
    let point = |at: [f64; 3], reason: String| Line {
        channel: format!("{side}.tcp.position"),
        columns: format!("{{at: {}, of: {side}.palm}}", point_mm(at)),
        reason: format!("{reason}: the log has no fingertips and no gripper"),
    };
    let is_there = format!("{{between: [{side}.tcp, {object}], below: {} mm}}", plain((near_m * 1e3).ceil()));
    let point = |at: [f64; 3], reason: String| (!hold.is_at_pose()).then(|| point(at, reason));
    let flag = |columns: String, reason: String| Line { channel: format!("{side}.gripper.closed"), columns, reason };
    let surface = || {
        let at = Vector3::from(*at);
        at * (1.0 - SURFACE_M / at.norm())
    };
    let surface_mm = plain(SURFACE_M * 1e3);
    let (point, flag) = match kind {
        Kind::Carried => (
            point(*at, format!("where {object} is while the hand carries it")),
            Some(flag(is_there, format!("the hand holds {object} while it does not move against it"))),
        ),
        // A hold that moves nothing would end in a Miss.
        Kind::Kept => (
            point(*at, format!("where {object} is while the hand keeps it")),
            Some(flag(
                NEVER.into(),
                format!("the hand moves nothing; if it holds {object} while it stays there, `{}`", scalar(&is_there)),
            )),
        ),
        Kind::Moved => (
            point(
                surface().into(),
                format!("{surface_mm} mm before the place where {object} is while the hand moves it"),
            ),
            None,
        ),
    };
    point.into_iter().chain(flag).collect()
}

/// How sensors that turn with their hands are bound; as a comment where the log does not name their frames.
fn sensors(survey: &Survey) -> String {
    let may_turn = |hand: &&Hand| hand.force.is_some() && hand.rotation.is_some() && hand.tips.is_empty();
    let (mut known, mut possible) = (String::new(), String::new());
    let hands = survey.hands.iter().filter(|(_, hand)| may_turn(hand) && !survey.is_fixed_tool());
    for (side, hand) in hands {
        let part = if survey.is_pair() || survey.flange_lengths_m.contains_key(side) { "palm" } else { "tcp" };
        let line = format!("  {side}.wrist.force: {{frame: {side}.{part}.rotation}}");
        let _ = match wrist_forces::sensor_rotation(hand) {
            Some(_) => writeln!(known, "{line}    # the log names another frame for the force than for the poses"),
            None => writeln!(possible, "# {line}"),
        };
    }
    let mut text = String::new();
    if !known.is_empty() {
        let _ = write!(text, "\nsensors:\n{known}");
    }
    if !possible.is_empty() {
        let head = if known.is_empty() { "# sensors:\n" } else { "" };
        let _ = write!(text, "\n# If the sensor at the wrist turns with the hand:\n{head}{possible}");
    }
    text
}

fn of_gripper(side: Side, gripper: &super::Gripper, answers: &Answers, lines: &mut Vec<Line>) {
    if let Some((columns, reason)) = gripper.opening.as_ref().filter(|_| !is_reversed(side, answers)) {
        lines.push(Line {
            channel: format!("{side}.gripper.opening"),
            columns: columns.clone(),
            reason: reason.clone(),
        });
    }
    let (closed, reason) = match &gripper.alternative {
        Some(alternative) if is_reversed(side, answers) => (alternative, "as it was answered"),
        _ => (&gripper.closed, gripper.reason.as_str()),
    };
    lines.push(Line { channel: format!("{side}.gripper.closed"), columns: closed.clone(), reason: reason.into() });
}

/// A position, a rotation or a force with z up, where the log has y up, and the columns without that as the alternative.
fn upright(line: Line, part: &Part) -> Line {
    let unit = part.columns().strip_prefix(&part.pattern).unwrap_or_default().to_string();
    let full = |name: &str| {
        if part.sheet.name.is_empty() { format!("{name}{unit}") } else { format!("{}.{name}{unit}", part.sheet.name) }
    };
    let columns = match &part.members[..] {
        [x, y, z] => format!("[\"{}\", \"-{}\", \"{}\"]", full(&x.name), full(&z.name), full(&y.name)),
        [w, x, y, z] => {
            let [w, x, y, z] = [w, x, y, z].map(|column| full(&column.name));
            format!("[\"{w}\", \"{x}\", \"-{z}\", \"{y}\"]")
        }
        matrix => {
            let names: Vec<String> = matrix.iter().map(|column| full(&column.name)).collect();
            turned_matrix(&names)
        }
    };
    let reasons = [line.reason.as_str(), "turned, since y points up in the log"];
    let reason = reasons.into_iter().filter(|reason| !reason.is_empty()).collect::<Vec<_>>().join("; ");
    let reason = format!("{reason}; else `{}`", scalar(&line.columns));
    Line { columns, reason, ..line }
}

/// The elements of a rotation matrix, row by row, with z up: those of the same turn about turned axes.
fn turned_matrix(names: &[String]) -> String {
    const FROM: [(usize, &str); 3] = [(0, ""), (2, "-"), (1, "")];
    let element = |(row, one): (usize, &str), (column, other): (usize, &str)| {
        let sign = if one == other { "" } else { "-" };
        format!("\"{sign}{}\"", names.get(3 * row + column).map_or("", String::as_str))
    };
    let elements: Vec<String> =
        FROM.iter().flat_map(|row| FROM.iter().map(move |column| element(*row, *column))).collect();
    format!("[{}]", elements.join(", "))
}

/// Why positions are taken for mm or cm.
fn unit_reason(part: &Part) -> &'static str {
    match part.guessed_unit {
        "mm" => "mm by the range of the positions",
        "cm" => "cm by the range of the positions",
        _ => "",
    }
}
