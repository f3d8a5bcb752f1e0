//! A binding to fill in: what was found in a log in, the text of a binding out, with the columns that belong together as patterns.

use crate::inspect::{ColumnReport, Inspection, SheetReport, ValueKind};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::log_channel::{FingerPart, LogChannel};
use teachtree_base::short_number::ShortNumber;
use teachtree_logs::names;
use teachtree_logs::read::element_names::ElementPlace;

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
            let goes_on = numbers_beside(endings).iter().any(|beside| member(&beside.as_str()).is_some());
            (members.len() == endings.len() && free && !goes_on)
                .then(|| (members, format!("{head}<{placeholder}>{tail}")))
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

/// The endings before and after numbered ones, `_0` and `_4` of `_1 _2 _3`: columns that go on with them, such as joints, are no vector.
fn numbers_beside(endings: &[&str]) -> Vec<String> {
    let number = |ending: Option<&&str>| ending?.strip_prefix('_')?.parse::<u32>().ok();
    let before = number(endings.first()).and_then(|first| first.checked_sub(1));
    let after = number(endings.last()).map(|last| last.saturating_add(1));
    before.into_iter().chain(after).map(|number| format!("_{number}")).collect()
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
        (1, _) if flag && (name.contains("contact") || name.contains("touch")) => format!("{side}.{finger}.contact"),
        (1, _) if !flag && name.contains("opening") => format!("{side}.gripper.opening"),
        _ => "?".into(),
    }
}

/// A line of a binding that a column may be meant for.
struct Suggestion {
    /// The channel; `?` stands for what has to be filled in.
    channel: String,
    columns: String,
    about: String,
}

impl Suggestion {
    /// The channel, where nothing has to be filled in.
    fn named(&self) -> Option<LogChannel<'_>> {
        LogChannel::parse(&self.channel)
    }
}

/// The flag that an opening makes whose values fall into two groups: closed is below the middle between them.
fn closed(column: &ColumnReport, pattern: &str) -> Option<Suggestion> {
    let name = column.name.to_lowercase();
    let is_opening =
        ["opening", "gripper", "grip", "width", "jaw", "finger_joint"].iter().any(|word| name.contains(word));
    let [low, high] = column.groups.filter(|_| is_opening)?;
    let side = if name.starts_with("l_") || name.starts_with("left") { Side::Left } else { Side::Right };
    // Three digits are more than the middle is worth.
    let short = |number: f64| format!("{number:.2e}").parse().unwrap_or(number);
    let middle: f64 = short((low + high) / 2.0);
    // The unit may be the column's own, or stand at the end of its name.
    let limit = format!("{pattern} < {middle} {}", names::split_unit(pattern).1.unwrap_or_default());
    let [low, high] = [low, high].map(|mean| ShortNumber(short(mean)));
    Some(Suggestion {
        channel: format!("{side}.gripper.closed"),
        columns: scalar(limit.trim_end()),
        about: format!("closed about {low}, open about {high}"),
    })
}

/// The text of a binding for a log like this one.
pub fn skeleton(log: &Inspection) -> String {
    let mut text = String::from("about: what this log is, for people\n");
    let suggestions: Vec<Suggestion> = log.sheets.iter().flat_map(suggestions).collect();
    text.push_str("# The channels that are bound decide the hand file (docs/bindings.md, Hand files). One of these lines names another one:\n");
    for (file, about) in hand_files(&suggestions) {
        let _ = writeln!(text, "# hand_file: {file:<23} # {about}");
    }
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
    text.push_str("# Counts, volts and other units are converted by a scale and an offset: `right.gripper.opening: adc * 0.02 - 3 [mm]`.\n");
    text.push_str("channels:\n  # right.thumb.position, right.thumb.force, right.thumb.contact, right.palm.rotation, right.gripper.opening,\n");
    text.push_str("  # <object>.position, <object>.rotation, contact.<object>.table.force, right.label\n");
    for Suggestion { channel, columns, about } in &suggestions {
        let _ = writeln!(text, "  # {channel}: {columns}    # {about}");
    }
    text.push_str(
        "\n# What the log does not say: what is handled, what carries it, and which fingers the hands have.\n",
    );
    text.push_str(
        "scene:\n  bodies:\n    object: {role: object, radius: 50 mm}\n    table: {role: support}\n  hands:\n",
    );
    for (side, fingers) in hands(&suggestions) {
        let _ = writeln!(text, "    {side}: {{fingers: [{}]}}", fingers.join(", "));
    }
    text
}

/// The columns of a sheet without elements of arrays by their places where it has them by their names, and without these names.
fn columns(sheet: &SheetReport) -> Vec<&ColumnReport> {
    let titles: BTreeSet<&str> = sheet.columns.iter().map(|column| column.name.as_str()).collect();
    let name = |place: ElementPlace| place.names().find(|name| !place.is_name() && titles.contains(name.as_str()));
    let names: BTreeSet<String> = titles.iter().filter_map(|title| name(ElementPlace::of(title)?)).collect();
    let is_named = |place: ElementPlace| {
        let begin = format!("{}.", place.array);
        name(place).is_some() && titles.iter().any(|title| title.starts_with(&begin))
    };
    let is_left_out = |title: &str| names.contains(title) || ElementPlace::of(title).is_some_and(is_named);
    sheet.columns.iter().filter(|column| !is_left_out(&column.name)).collect()
}

/// The lines that the columns of a sheet may be meant for.
fn suggestions(sheet: &SheetReport) -> Vec<Suggestion> {
    let columns = columns(sheet);
    let full = |name: &str| if sheet.name.is_empty() { name.to_string() } else { format!("{}.{name}", sheet.name) };
    let numbers: Vec<(String, String, bool)> = columns
        .iter()
        .filter(|column| column.kind != ValueKind::Text)
        .map(|column| (full(&column.name), column.unit.clone(), column.kind == ValueKind::Flag))
        .collect();
    let mut all = vec![];
    for Group { pattern, width, flag } in groups(&numbers) {
        let kind = match (width, flag) {
            (3, _) => "a vector",
            (4, _) => "a rotation",
            (_, true) => "a flag",
            _ => "a number",
        };
        let channel = channel(&pattern, width, flag);
        all.push(Suggestion { channel, columns: scalar(&pattern), about: kind.into() });
        let report = columns.iter().find(|column| names::split_unit(&pattern).0 == full(&column.name));
        all.extend(report.and_then(|report| closed(report, &pattern)));
    }
    let texts = columns.iter().filter(|column| column.kind == ValueKind::Text && column.texts.len() > 1);
    all.extend(texts.map(|column| Suggestion {
        channel: "right.label".into(),
        columns: scalar(&full(&column.name)),
        about: "text".into(),
    }));
    all
}

/// The hands that the suggested channels are of, and the fingers that can have a position: those that are named, or a thumb for the one point of a gripper
/// or a tool.
fn hands(suggestions: &[Suggestion]) -> BTreeMap<Side, Vec<&'static str>> {
    let mut hands: BTreeMap<Side, BTreeSet<Finger>> = BTreeMap::new();
    for channel in suggestions.iter().filter_map(Suggestion::named) {
        match channel {
            LogChannel::Finger(side, finger, _) | LogChannel::Touch(side, finger, _) => {
                hands.entry(side).or_default().insert(finger);
            }
            LogChannel::GripperClosed(side) | LogChannel::GripperOpening(side) => drop(hands.entry(side).or_default()),
            _ => {}
        }
    }
    if hands.is_empty() {
        hands.entry(Side::Right).or_default();
    }
    let named = |fingers: BTreeSet<Finger>| match fingers.is_empty() {
        true => vec![Finger::Thumb.name()],
        false => Finger::ALL.into_iter().filter(|finger| fingers.contains(finger)).map(Finger::name).collect(),
    };
    hands.into_iter().map(|(side, fingers)| (side, named(fingers))).collect()
}

/// The hand files that fit what is measured, with what each is for; the one that fits best first.
fn hand_files(suggestions: &[Suggestion]) -> Vec<(&'static str, &'static str)> {
    let has = |of: &dyn Fn(&LogChannel) -> bool| suggestions.iter().filter_map(Suggestion::named).any(|it| of(&it));
    let of_tip = |part: FingerPart| {
        has(&|channel| matches!(channel, LogChannel::Finger(_, finger, of) if *finger != Finger::Palm && *of == part))
    };
    let of_gripper = |of: Side| {
        has(&|it| matches!(it, LogChannel::GripperClosed(side) | LogChannel::GripperOpening(side) if *side == of))
    };
    let is_mechanism = |it: &Suggestion| it.channel == "?" && it.columns.to_lowercase().contains("angle");
    let of_palm =
        has(&|channel| matches!(channel, LogChannel::Finger(_, Finger::Palm, FingerPart::Force | FingerPart::Contact)));
    let palm_force = has(&|channel| matches!(channel, LogChannel::Finger(_, Finger::Palm, FingerPart::Force)));
    let of_any_gripper = of_gripper(Side::Left) || of_gripper(Side::Right);
    let fits = [
        (of_tip(FingerPart::Force), "hand_force.rules", "forces of the fingertips"),
        (of_tip(FingerPart::Contact), "hand_flags.rules", "contact flags of thumb and fingers"),
        (
            of_any_gripper && palm_force,
            "hand_gripper_wrist.rules",
            "a gripper on a force sensor at the wrist, as palm; a position as thumb",
        ),
        (of_any_gripper, "hand_gripper.rules", "a gripper: its flag `closed`, and a position as thumb"),
        (
            of_gripper(Side::Left) && of_gripper(Side::Right),
            "hand_gripper_pair.rules",
            "two grippers, without poses of the objects",
        ),
        (of_palm, "hand_wrist.rules", "a tool on a force sensor at the wrist, as palm"),
        (of_tip(FingerPart::Position), "hand_vision.rules", "positions of thumb and fingers, without forces"),
        (
            suggestions.iter().any(is_mechanism),
            "hand_mechanism.rules",
            "the position of a hand at a mechanism with an angle",
        ),
    ];
    let fitting: Vec<_> = fits.iter().filter(|(fits, ..)| *fits).map(|(_, file, about)| (*file, *about)).collect();
    // Where no name shows what is measured, any of them may fit.
    if fitting.is_empty() { fits.iter().map(|(_, file, about)| (*file, *about)).collect() } else { fitting }
}

/// A text as YAML takes it.
fn scalar(text: &str) -> String {
    let plain = text.chars().all(|c| c.is_alphanumeric() || " _-./<>=+[]".contains(c))
        && text.starts_with(|c: char| c.is_alphanumeric() || c == '/' || c == '_');
    if plain { text.to_string() } else { format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\"")) }
}
