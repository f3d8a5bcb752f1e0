//! The columns that nothing was found for, and why; in a log without any channel, the lines to fill in.

use super::parts::{Part, Quantity};
use super::yaml_scalar::{comment, scalar};
use super::{Survey, grippers, words};
use crate::bind::BLANK;
use crate::inspect::{Inspection, ValueKind};
use std::fmt::Write as _;

/// The most columns that are listed as unused.
const MAX_UNUSED: usize = 40;
/// The most names in a line, where an array or the joints of an arm are one name, …
const MAX_NAMES: usize = 12;
/// … if there are so many of them.
const FAMILY: usize = 3;

/// The columns that nothing was found for, as comments.
pub fn unused(survey: &Survey) -> String {
    let mut text = String::new();
    let is_listed = |part: &&Part| !part.is_constant() || part.left_out.is_some() || grippers::is_at_rest(part);
    let rest: Vec<&Part> = survey.rest.iter().filter(is_listed).collect();
    if !rest.is_empty() {
        text.push_str("  # not used:\n");
    }
    for part in rest.iter().take(MAX_UNUSED) {
        let why = reason(part).map_or_else(String::new, |why| format!("    ({})", comment(why)));
        let _ = writeln!(text, "  #   {}{why}", comment(&scalar(&part.columns())));
    }
    if rest.len() > MAX_UNUSED {
        let _ = writeln!(text, "  #   and {} more", rest.len() - MAX_UNUSED);
    }
    text
}

/// Why a part has no channel, where its name or its values show it.
fn reason<'a>(part: &'a Part) -> Option<&'a str> {
    match &part.left_out {
        _ if words::is_command(&part.words) => Some("a command"),
        Some(reason) => Some(reason),
        _ if grippers::is_at_rest(part) => Some("a gripper that does not move"),
        _ if words::is_marker_error(&part.words) => Some("the residual of the tracker"),
        _ if words::is_relative(&part.words) => Some("relative to something"),
        _ if part.quantity == Quantity::Rotation => Some("the position of this name is not used, or not in the log"),
        _ => None,
    }
}

/// Why a part of a log without any channel has none.
fn refusal<'a>(part: &'a Part) -> &'a str {
    match part.quantity {
        _ if part.is_constant() => "the same in every row",
        _ if reason(part).is_some() => reason(part).unwrap_or_default(),
        Quantity::Other => "by its name a velocity or another rate, which no channel has",
        _ if is_joint(part) => "joints, which give the place of a hand by the URDF of the arm only",
        Quantity::Number | Quantity::Flag => "a single number, and its name says neither what nor of what it is",
        _ => "its name says neither a hand nor an object",
    }
}

/// Whether it may be one of the joints of an arm.
fn is_joint(part: &Part) -> bool {
    let names = ["joint", "joints", "qpos", "q", "shoulder", "elbow", "motor"];
    let is_numbered = |word: &String| names.contains(&word.trim_end_matches(|c: char| c.is_ascii_digit()));
    part.quantity == Quantity::Number && part.words.iter().any(is_numbered)
}

/// A line for each reason why columns of a log without any channel have none.
pub fn refused(survey: &Survey, log: &Inspection) -> Vec<String> {
    let mut reasons: Vec<(&str, Vec<Vec<&Part>>)> = vec![];
    let family = |part: &Part| -> String { part.pattern.chars().filter(|letter| !letter.is_ascii_digit()).collect() };
    for part in &survey.rest {
        let why = refusal(part);
        let at = reasons.iter().position(|(known, _)| *known == why).unwrap_or_else(|| {
            reasons.push((why, vec![]));
            reasons.len() - 1
        });
        let Some((_, families)) = reasons.get_mut(at) else { continue };
        match families.iter_mut().find(|parts| parts.first().is_some_and(|first| family(first) == family(part))) {
            Some(parts) => parts.push(part),
            None => families.push(vec![part]),
        }
    }
    let name = |parts: &Vec<&Part>| match &parts[..] {
        [first, .., last] if parts.len() >= FAMILY => format!("{} … {}", first.columns(), last.columns()),
        _ => parts.iter().map(|part| part.columns()).collect::<Vec<_>>().join(", "),
    };
    let listed = |names: Vec<String>| {
        let more = names.len().saturating_sub(MAX_NAMES);
        let shown = names.iter().take(MAX_NAMES).cloned().collect::<Vec<_>>().join(", ");
        if more > 0 { format!("{shown} and {more} more") } else { shown }
    };
    let lines =
        reasons.into_iter().map(|(why, families)| format!("{}: {why}", listed(families.iter().map(name).collect())));
    let texts = log.sheets.iter().flat_map(|sheet| &sheet.columns).filter(|column| column.kind == ValueKind::Text);
    let texts: Vec<String> = texts.map(|column| column.name.clone()).collect();
    let of_texts = (!texts.is_empty()).then(|| format!("{}: not numbers", listed(texts)));
    let all: Vec<String> = lines.chain(of_texts).collect();
    if all.is_empty() { vec!["the log has no columns beside its time stamps".into()] } else { all }
}

/// The channels of a log without any, to fill in.
pub fn blanks(refused: &[String]) -> String {
    let place = format!("[\"{BLANK}\", \"{BLANK}\", \"{BLANK}\"]");
    let mut text = format!(
        "\n# Nothing was recognized. Replace each `{BLANK}` by a column of the log; delete the lines for which it has none.\nchannels:\n  \
         right.tcp.position: {place}    # x, y and z of the point between the fingertips, z up; in m, or as `\"x [mm]\"`\n  \
         right.gripper.closed: \"{BLANK} < 30 mm\"    # when the gripper is closed; a flag as `name`\n  \
         object.position: {place}    # x, y and z of what is handled\n"
    );
    text.push_str(
        "# A log of joints needs the URDF of its arm (docs/bindings.md, Joints), with this line in place of the first one:\n\
         #   right.tcp.position: {link: arm.tool0, at: [0 mm, 0 mm, 100 mm]}\n\
         # robots: {arm: {urdf: my_arm.urdf, joints: {name_in_the_urdf: \"column [rad]\"}}}\n",
    );
    text.push_str("# The columns, and why they were not recognized:\n");
    text.extend(refused.iter().map(|line| format!("#   {}\n", comment(line))));
    text
}

/// The scene for these channels.
pub const BLANK_SCENE: &str = "# Written by `teachtree init` to be filled in: the size of the object, and the place of the table below it (docs/scenes.md).\n\
    bodies:\n  object: {role: object, parts: [{box: [50 mm, 50 mm, 50 mm]}]}\n  table: {role: support}\n";
