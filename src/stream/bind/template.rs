//! A binding to fill in: what was found in a log in, the text of a binding out, with the columns that belong together as patterns.

use crate::base::hands::{Finger, Side};
use crate::base::shown::Shown;
use crate::stream::inspect::{ColumnReport, Inspection, Kind};
use crate::stream::names;
use std::fmt::Write as _;

/// Columns that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// As a binding names them: `tool_p<xyz> [mm]`.
    pub pattern: String,
    /// How many they are.
    pub width: usize,
    /// Whether they are flags.
    pub flag: bool,
}

/// Endings that components have, and the placeholder for them; longer ones first.
const ENDINGS: [(&[&str], &str); 7] = [
    (&["w", "x", "y", "z"], "wxyz"),
    (&["W", "X", "Y", "Z"], "WXYZ"),
    (&["x", "y", "z"], "xyz"),
    (&["X", "Y", "Z"], "XYZ"),
    (&["[0]", "[1]", "[2]"], "xyz=[0] [1] [2]"),
    (&["_0", "_1", "_2"], "xyz=_0 _1 _2"),
    (&["_1", "_2", "_3"], "xyz=_1 _2 _3"),
];

/// Puts columns that differ in a component only together.
pub fn groups(columns: &[(String, String, bool)]) -> Vec<Group> {
    let mut taken = vec![false; columns.len()];
    let mut groups = vec![];
    for (index, (name, unit, flag)) in columns.iter().enumerate() {
        if taken.get(index).copied().unwrap_or(true) {
            continue;
        }
        let found = ENDINGS.iter().find_map(|(endings, placeholder)| {
            let (head, tail) = endings.iter().find_map(|ending| around(name, ending))?;
            let member = |ending: &&str| {
                let wanted = format!("{head}{ending}{tail}");
                columns.iter().position(|(other, other_unit, _)| *other == wanted && other_unit == unit)
            };
            let members: Vec<usize> = endings.iter().filter_map(member).collect();
            let free = members.iter().all(|at| !taken.get(*at).copied().unwrap_or(true));
            (members.len() == endings.len() && free).then(|| (members, format!("{head}<{placeholder}>{tail}")))
        });
        let (members, name) = found.unwrap_or_else(|| (vec![index], name.clone()));
        for member in &members {
            if let Some(taken) = taken.get_mut(*member) {
                *taken = true;
            }
        }
        let unit = if unit.is_empty() { unit_in_name(&name) } else { unit };
        let pattern = if unit.is_empty() { name } else { format!("{name} [{unit}]") };
        groups.push(Group { pattern, width: members.len(), flag: *flag && members.len() == 1 });
    }
    groups
}

/// The unit that a name ends with, as of `tip_x_mm`; empty without one.
fn unit_in_name(name: &str) -> &'static str {
    const UNITS: [(&str, &str); 8] = [
        ("_um", "um"),
        ("_mm", "mm"),
        ("_cm", "cm"),
        ("_m", "m"),
        ("_deg", "deg"),
        ("_rad", "rad"),
        ("_N", "N"),
        ("_mN", "mN"),
    ];
    UNITS.iter().find(|(ending, _)| name.ends_with(ending)).map_or("", |(_, unit)| unit)
}

/// A name around the last place where a component stands, which no letter follows: `p` and `` of `px`, `R_f` and `_world` of `R_fx_world`.
fn around<'a>(name: &'a str, ending: &str) -> Option<(&'a str, &'a str)> {
    let at = name.rfind(ending)?;
    let (head, tail) = (name.get(..at)?, name.get(at + ending.len()..)?);
    (!tail.starts_with(char::is_alphanumeric) && !head.is_empty()).then_some((head, tail))
}

/// What a column may be, as far as its name and unit show; `?` for what has to be filled in.
fn channel(pattern: &str, width: usize, flag: bool) -> String {
    let (name, unit) = names::split_known_unit(pattern);
    let name = name.split('<').next().unwrap_or(name).to_lowercase();
    let words: Vec<&str> = name.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
    let says = |known: &[&str]| words.iter().any(|word| known.contains(word));
    let last = |known: &[&str]| words.last().is_some_and(|word| known.iter().any(|ending| word.ends_with(ending)));
    let side = if says(&["l", "left"]) { Side::Left } else { Side::Right };
    let finger = Finger::ALL.into_iter().find(|finger| name.contains(finger.name())).map_or("?", Finger::name);
    match (width, unit) {
        (4, _) => "?.rotation".into(),
        (3, Some("N" | "mN")) => format!("{side}.{finger}.force"),
        (3, Some("m" | "mm" | "cm" | "um")) if finger != "?" => format!("{side}.{finger}.position"),
        (3, Some("m" | "mm" | "cm" | "um")) => "?.position".into(),
        (3, None) if says(&["f", "force", "forces"]) => format!("{side}.{finger}.force"),
        (3, None) if last(&["torque", "linear", "angular", "t", "v", "w"]) => "?".into(),
        (3, None) if last(&["p", "pos", "position", "translation"]) && finger != "?" => {
            format!("{side}.{finger}.position")
        }
        (3, None) if last(&["p", "pos", "position", "translation"]) => "?.position".into(),
        (1, _) if flag && name.contains("clos") => format!("{side}.gripper.closed"),
        (1, _) if !flag && name.contains("opening") => format!("{side}.gripper.opening"),
        _ => "?".into(),
    }
}

/// The flag that an opening makes whose values fall into two groups: closed is below the middle between them.
fn closed(column: &ColumnReport, pattern: &str) -> Option<String> {
    let name = column.name.to_lowercase();
    let is_opening =
        ["opening", "gripper", "grip", "width", "jaw", "finger_joint"].iter().any(|word| name.contains(word));
    let [low, high] = column.groups.filter(|_| is_opening)?;
    let side = if name.starts_with("l_") || name.starts_with("left") { Side::Left } else { Side::Right };
    // Three digits are more than the middle is worth.
    let short = |number: f64| format!("{number:.2e}").parse().unwrap_or(number);
    let middle: f64 = short((low + high) / 2.0);
    let limit = format!("{pattern} < {middle} {}", column.unit);
    let [low, high] = [low, high].map(|mean| Shown(short(mean)));
    Some(format!(
        "  # {side}.gripper.closed: {}    # closed about {low}, open about {high}\n",
        scalar(limit.trim_end())
    ))
}

/// The text of a binding for a log like this one.
pub fn skeleton(log: &Inspection) -> String {
    let mut text = String::from("about: what this log is, for people\n");
    let sheets = log.sheets.len();
    let time = log.sheets.iter().find_map(|sheet| sheet.time.as_deref());
    match time {
        Some("time" | "time [s]") => {}
        Some(time) => {
            let _ = writeln!(text, "time: {}", scalar(time));
        }
        None => text
            .push_str("rate: \"? Hz\"                # the rows have no stamps: say how many there are in a second\n"),
    }
    let fastest = log.sheets.iter().map(|sheet| sheet.rate_hz).fold(0.0, f64::max);
    let odd = log.sheets.iter().any(|sheet| sheet.uneven > 0.01);
    if (sheets > 1 || odd) && fastest > 0.0 {
        let why = if sheets > 1 { "its parts have stamps of their own" } else { "its steps are uneven" };
        let _ = writeln!(text, "resample: {} Hz             # {why}", fastest.round().max(1.0));
    }
    text.push_str("\n# Canonical name to column; keep what the rules need and remove the rest. Forces of fingers act on the object: turn the\n");
    text.push_str("# sign with `-` where the log says otherwise. A flag can be made by a threshold: `right.gripper.closed: opening [mm] < 30 mm`.\n");
    text.push_str("channels:\n  # right.thumb.position, right.thumb.force, right.thumb.contact, right.palm.rotation, right.gripper.opening,\n");
    text.push_str("  # <object>.position, <object>.rotation, contact.<object>.table.force, right.label\n");
    for sheet in &log.sheets {
        let full = |name: &str| if sheet.name.is_empty() { name.to_string() } else { format!("{}.{name}", sheet.name) };
        let numbers: Vec<(String, String, bool)> = sheet
            .columns
            .iter()
            .filter(|column| column.kind != Kind::Text)
            .map(|column| (full(&column.name), column.unit.clone(), column.kind == Kind::Flag))
            .collect();
        for Group { pattern, width, flag } in groups(&numbers) {
            let kind = match (width, flag) {
                (3, _) => "a vector",
                (4, _) => "a rotation",
                (_, true) => "a flag",
                _ => "a number",
            };
            let _ = writeln!(text, "  # {}: {}    # {kind}", channel(&pattern, width, flag), scalar(&pattern));
            let report = sheet.columns.iter().find(|column| names::split_unit(&pattern).0 == full(&column.name));
            if let Some(line) = report.and_then(|report| closed(report, &pattern)) {
                text.push_str(&line);
            }
        }
        let texts = |column: &&ColumnReport| column.kind == Kind::Text && column.texts.len() > 1;
        for column in sheet.columns.iter().filter(texts) {
            let _ = writeln!(text, "  # right.label: {}    # text", scalar(&full(&column.name)));
        }
    }
    text.push_str(
        "\n# What the log does not say: what is handled, what carries it, and which fingers the hands have.\n",
    );
    text.push_str("scene:\n  bodies:\n    object: {role: object, radius: 50 mm}\n    table: {role: support}\n");
    text.push_str("  hands:\n    right: {fingers: [thumb, index]}\n");
    text
}

/// A text as YAML takes it.
fn scalar(text: &str) -> String {
    let plain = text.chars().all(|c| c.is_alphanumeric() || " _-./<>=+[]".contains(c))
        && text.starts_with(|c: char| c.is_alphanumeric() || c == '/' || c == '_');
    if plain { text.to_string() } else { format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\"")) }
}
