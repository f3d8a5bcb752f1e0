//! What a log measures: each group of columns as a quantity, with its words and its values.

use super::column_groups::{self, Form, Group};
use super::quantiles::quantile;
use super::{images, words};
use crate::inspect::{ColumnReport, Inspection, SheetReport, ValueKind};
use std::collections::BTreeSet;
use teachtree_base::units::{Dimension, compound_of_log};
use teachtree_logs::read::element_names::ElementPlace;

/// Columns that count rows and times.
const COUNTERS: [&str; 14] = [
    "seq",
    "sec",
    "nsec",
    "nanosec",
    "timestamp",
    "index",
    "frame",
    "frame_index",
    "episode_index",
    "task_index",
    "sub frame",
    "row",
    "step",
    "rdtsequence",
];

/// The share of positions that is in reach, …
const USUAL: f64 = 0.9;
/// … this far at most in m: what is beyond it is in mm or cm.
const FARTHEST_M: f64 = 20.0;
/// Positions within this range whose motion has at most this extent are in cm: 2 m and 1.2 m. In mm nothing would be carried so far.
const FARTHEST_CM: f64 = 200.0;
const EXTENT_CM: f64 = 120.0;
/// Arms and hands usually move slower than this in m/s and in cm/s.
const FASTEST_M: f64 = 5.0;
const FASTEST_CM: f64 = 100.0;
/// The share of the steps of what moves that is at most usually fast.
const USUALLY: f64 = 0.95;

/// What a group of columns measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Where something is.
    Position,
    /// How something is turned.
    Rotation,
    /// A force.
    Force,
    /// A torque.
    Torque,
    /// A flag.
    Flag,
    /// A number of its own: an opening, a joint.
    Number,
    /// Something else, such as a velocity or a command.
    Other,
}

/// A group of columns.
#[derive(Clone, Debug)]
pub struct Part<'a> {
    /// As a binding names it, without a unit.
    pub pattern: String,
    /// The name without what differs.
    pub name: String,
    /// The words of the name and of its sheet.
    pub words: Vec<String>,
    /// What it measures.
    pub quantity: Quantity,
    /// The unit that the log has, a name ends with or values of angles show; empty without one.
    pub unit: String,
    /// The unit of a position without one, by the positions of the log: `m`, `cm` or `mm`. Empty of everything else.
    pub guessed_unit: &'static str,
    /// Its columns, x y z or w x y z.
    pub members: Vec<&'a ColumnReport>,
    /// Its sheet.
    pub sheet: &'a SheetReport,
    /// Why it is taken for this, where the names do not show it.
    pub reason: Option<String>,
    /// Why its values have no channel, where they show it.
    pub left_out: Option<String>,
    /// The root of the transforms that carry it about, if its values never change in the frame of a moving link.
    pub carried_in: Option<String>,
}

impl Part<'_> {
    /// The factor to SI: of the unit, else that of all positions of the log.
    pub fn scale(&self) -> f64 {
        let unit = if self.unit.is_empty() { self.guessed_unit } else { self.unit.as_str() };
        if unit.is_empty() { 1.0 } else { compound_of_log(unit).map_or(1.0, |(factor, _)| factor) }
    }

    /// As a binding names it, with the unit that its values show.
    pub fn columns(&self) -> String {
        let unit = match () {
            () if !["", "m"].contains(&self.guessed_unit) => self.guessed_unit,
            // The unit of a header need not be repeated.
            () if self.members.iter().any(|column| !column.unit.is_empty()) => "",
            () => &self.unit,
        };
        match self.pattern.strip_prefix('[').and_then(|list| list.strip_suffix(']')) {
            _ if unit.is_empty() => self.pattern.clone(),
            // Constants in a list have units.
            Some(list) => {
                let is_constant = |column: &str| column.starts_with("\"=");
                let with_unit = |column: &str| format!("{} [{unit}]\"", column.trim_end_matches('"'));
                let columns = list.split(", ");
                let columns = columns.map(|it| if is_constant(it) { it.to_string() } else { with_unit(it) });
                format!("[{}]", columns.collect::<Vec<_>>().join(", "))
            }
            None => format!("{} [{unit}]", self.pattern),
        }
    }

    /// Whether it is a position of x and y in a plane, at the height 0.
    pub fn is_planar(&self) -> bool {
        self.quantity == Quantity::Position && self.members.len() == 2
    }

    /// Whether it is a position without a unit.
    pub fn is_unitless_position(&self) -> bool {
        self.quantity == Quantity::Position && self.unit.is_empty()
    }

    /// Whether it never changes.
    pub fn is_constant(&self) -> bool {
        self.carried_in.is_none() && self.members.iter().all(|column| column.kind == ValueKind::Constant)
    }

    /// Its values in a row of the samples, SI.
    pub fn at(&self, row: usize) -> Vec<f64> {
        let scale = self.scale();
        let values = self.members.iter().map(|column| column.samples.get(row).copied().unwrap_or(f64::NAN) * scale);
        values.chain(self.is_planar().then_some(0.0)).collect()
    }

    /// The position in a row of the samples, m.
    pub fn position(&self, row: usize) -> Option<[f64; 3]> {
        let [x, y, z] = self.at(row)[..] else { return None };
        (x.is_finite() && y.is_finite() && z.is_finite()).then_some([x, y, z])
    }

    /// Number of samples.
    pub fn rows(&self) -> usize {
        self.members.iter().map(|column| column.samples.len()).min().unwrap_or_default()
    }

    /// When a row of the samples was taken, s.
    pub fn time_s(&self, row: usize) -> f64 {
        self.sheet.start_s + self.sheet.duration_s * row as f64 / self.rows().saturating_sub(1).max(1) as f64
    }

    /// Number of rows of the samples in a time, s; at least one.
    pub fn rows_in(&self, time_s: f64) -> usize {
        let step_s = self.sheet.duration_s / self.rows().max(2) as f64;
        if step_s > 0.0 { ((time_s / step_s).round() as usize).max(1) } else { 1 }
    }

    /// The row of the samples of another sheet at the time of one of this sheet.
    pub fn row_in(&self, row: usize, other: &Self) -> usize {
        if std::ptr::eq(self.sheet, other.sheet) || self.rows() < 2 || self.sheet.duration_s <= 0.0 {
            return row;
        }
        let share = (self.time_s(row) - other.sheet.start_s) / other.sheet.duration_s.max(f64::MIN_POSITIVE);
        let last = other.rows().saturating_sub(1);
        ((share.clamp(0.0, 1.0) * last as f64).round() as usize).min(last)
    }

    /// The largest part of the rows without a value. A position of exactly zero in some rows is that of a lost body.
    pub fn missing(&self) -> f64 {
        let missing = self.members.iter().map(|column| column.missing).fold(0.0, f64::max);
        if self.quantity != Quantity::Position || self.is_constant() {
            return missing;
        }
        let lost = (0..self.rows()).filter(|row| self.at(*row).iter().all(|value| *value == 0.0)).count();
        missing.max(lost as f64 / self.rows().max(1) as f64)
    }

    /// How far it moves: the diagonal of the box of its positions, m.
    pub fn extent(&self) -> f64 {
        self.members.iter().map(|column| (column.max - column.min).powi(2)).sum::<f64>().sqrt() * self.scale()
    }
}

/// The distance of two points.
pub fn distance(one: [f64; 3], other: [f64; 3]) -> f64 {
    one.iter().zip(other).map(|(one, other)| (one - other).powi(2)).sum::<f64>().sqrt()
}

/// The distances of two points in the rows of the first one, m.
pub fn distances(one: &Part, other: &Part) -> Vec<f64> {
    let apart = |row: usize| Some(distance(one.position(row)?, other.position(one.row_in(row, other))?));
    (0..one.rows()).filter_map(apart).collect()
}

/// The groups of columns of a log.
pub fn parts(log: &Inspection) -> Vec<Part<'_>> {
    let mut parts: Vec<Part> = log.sheets.iter().flat_map(of_sheet).collect();
    images::leave_out(&mut parts);
    parts
}

/// Guesses the unit of the positions without one.
pub fn guess_unit(parts: &mut [Part]) {
    let unit = usual_unit(parts);
    parts.iter_mut().filter(|part| part.is_unitless_position()).for_each(|part| part.guessed_unit = unit);
}

/// The unit of the positions of a log without one, by how far from the origin they are, and how far and how fast they move.
fn usual_unit(parts: &[Part]) -> &'static str {
    let (mut norms, mut speeds, mut extent) = (vec![], vec![], 0.0_f64);
    for part in parts.iter().filter(|part| part.is_unitless_position()) {
        let points = (0..part.rows()).filter_map(|row| part.position(row));
        norms.extend(points.map(|at| distance(at, [0.0; 3])));
        extent = extent.max(part.extent());
        let step_s = part.time_s(1) - part.time_s(0);
        let steps = (1..part.rows()).filter_map(|row| Some(distance(part.position(row - 1)?, part.position(row)?)));
        speeds.extend(steps.map(|step| step / step_s).filter(|speed| speed.is_finite() && *speed > 0.0));
    }
    let [far, fast] = [quantile(norms, USUAL), quantile(speeds, USUALLY)].map(Option::unwrap_or_default);
    match () {
        () if far <= FARTHEST_M && fast <= FASTEST_M => "m",
        () if far <= FARTHEST_CM && extent <= EXTENT_CM && fast <= FASTEST_CM => "cm",
        () if far <= FARTHEST_M => "m",
        () => "mm",
    }
}

/// The vector at the beginning of a table without names, by the name of the table: forces or the place of the tool.
fn unnamed(sheet: &SheetReport) -> Option<Part<'_>> {
    let is_number = |column: &ColumnReport| column.name.parse::<u32>().is_ok();
    let [x, y, z, ..] = &sheet.columns[..] else { return None };
    let words = words::words(&sheet.name);
    let quantity = match () {
        () if !sheet.columns.iter().all(is_number) || words::is_command(&words) => return None,
        () if words::has(&words, &["force", "forces", "torques", "wrench", "ft"]) => Quantity::Force,
        () if words::has(&words, &["pos", "pose", "position", "cart", "tcp"]) => Quantity::Position,
        () => return None,
    };
    let name = format!("{}.tcp", sheet.name);
    Some(Part {
        pattern: format!("{}.<xyz={} {} {}>", sheet.name, x.name, y.name, z.name),
        words: words::words(&name),
        name,
        quantity,
        unit: String::new(),
        guessed_unit: "",
        members: vec![x, y, z],
        sheet,
        reason: Some("the columns have no names: the first three by the name of the table".into()),
        left_out: None,
        carried_in: None,
    })
}

fn of_sheet(sheet: &SheetReport) -> Vec<Part<'_>> {
    if let Some(part) = unnamed(sheet) {
        return vec![part];
    }
    let numbers: Vec<(String, &ColumnReport)> = columns(sheet)
        .into_iter()
        .filter(|column| column.kind != ValueKind::Text)
        .map(|column| (column.name.clone(), column))
        .collect();
    let sheet_words = words::words(&sheet.name);
    let groups = column_groups::groups(&numbers);
    let names: Vec<Vec<String>> = groups.iter().map(|group| words::words(&group.name)).collect();
    let mut parts: Vec<Part> = groups
        .into_iter()
        .map(|group| {
            let members: Vec<&ColumnReport> =
                group.members.iter().filter_map(|at| numbers.get(*at)).map(|(_, column)| *column).collect();
            let full =
                |text: &str| if sheet.name.is_empty() { text.to_string() } else { format!("{}.{text}", sheet.name) };
            let of_log = members.first().map_or("", |column| column.unit.as_str());
            let unit = if of_log.is_empty() { unit_in_name(&group) } else { of_log };
            let own = words::words(&group.name);
            let words: Vec<String> = sheet_words.iter().chain(&own).cloned().collect();
            // A topic of commands has the columns of what it commands.
            let is_other = words::is_command(&words) || words::is_relative(&words);
            let measured = without_letter(&own, &names);
            let quantity = if is_other { Quantity::Other } else { quantity(group.form, unit, measured, &members) };
            let unit = if unit.is_empty() { group.unit } else { unit };
            // A list names its columns in full.
            let pattern =
                if group.pattern.starts_with('[') { in_full(&group.pattern, &full) } else { full(&group.pattern) };
            let (name, unit) = (full(&group.name), unit.to_string());
            let reason = group.reason;
            Part {
                pattern,
                name,
                words,
                quantity,
                unit,
                guessed_unit: "",
                members,
                sheet,
                reason,
                left_out: None,
                carried_in: None,
            }
        })
        .collect();
    torques_beside_forces(&mut parts);
    parts
}

/// The words of a name without the letter of the first of several things: `cube_a` beside `cube_b` is not an acceleration.
fn without_letter<'a>(words: &'a [String], names: &[Vec<String>]) -> &'a [String] {
    let Some((letter, stem)) = words.split_last() else { return words };
    let is_next = |name: &Vec<String>| name.split_last().is_some_and(|(last, others)| last == "b" && others == stem);
    if letter == "a" && !stem.is_empty() && names.iter().any(is_next) { stem } else { words }
}

/// Vectors whose names differ from that of a force in a letter of torques, such as `Tx_ext` beside `Fx_ext`, are its torques.
fn torques_beside_forces(parts: &mut [Part]) {
    let without = |part: &Part, letters: &[&str]| -> Option<Vec<String>> {
        let others: Vec<String> = part.words.iter().filter(|word| !letters.contains(&word.as_str())).cloned().collect();
        (others.len() + 1 == part.words.len()).then_some(others)
    };
    let of_forces = parts.iter().filter(|part| part.quantity == Quantity::Force);
    let forces: Vec<Vec<String>> = of_forces.filter_map(|part| without(part, &["f", "force"])).collect();
    for part in parts.iter_mut().filter(|part| part.quantity == Quantity::Position && part.unit.is_empty()) {
        if without(part, &["t", "m", "tau"]).is_some_and(|others| forces.contains(&others)) {
            part.quantity = Quantity::Torque;
        }
    }
}

/// A list of quoted columns with their full names.
fn in_full(list: &str, full: &dyn Fn(&str) -> String) -> String {
    let inner = list.strip_prefix('[').and_then(|list| list.strip_suffix(']')).unwrap_or(list);
    let columns: Vec<String> =
        inner.split(", ").map(|column| format!("\"{}\"", full(column.trim_matches('"')))).collect();
    format!("[{}]", columns.join(", "))
}

/// What columns measure, by their form, unit and words.
fn quantity(form: Form, unit: &str, words: &[String], members: &[&ColumnReport]) -> Quantity {
    let dimension = (!unit.is_empty()).then(|| compound_of_log(unit).ok()).flatten().map(|(_, dimension)| dimension);
    let says = |known: &[&str]| words::has(words, known);
    let last = |known: &[&str]| words.last().is_some_and(|word| known.contains(&word.as_str()));
    let is_rate = says(&[
        "vel",
        "velocity",
        "velocities",
        "speed",
        "twist",
        "qvel",
        "acc",
        "accel",
        "acceleration",
        "gyro",
        "linear",
        "angular",
        "imu",
        "effort",
        "jacobian",
        "qd",
    ]);
    // `current_pose` is the pose at present.
    let is_electrical = says(&["current"]) && (form == Form::Scalar || last(&["current"]));
    if is_rate || is_electrical {
        return Quantity::Other;
    }
    match form {
        Form::Quaternion | Form::Matrix | Form::RotationVector | Form::Angles => Quantity::Rotation,
        Form::Vector => match dimension {
            Some(Dimension::FORCE) => Quantity::Force,
            Some(Dimension::LENGTH) => Quantity::Position,
            Some(Dimension::TORQUE) => Quantity::Torque,
            Some(_) => Quantity::Other,
            None if says(&["torque", "torques", "moment", "moments"]) || last(&["t", "m", "mom"]) => Quantity::Torque,
            None if says(&["f", "force", "forces", "ft", "wrench", "grf"]) => Quantity::Force,
            // `pad_a` is not an acceleration.
            None if last(&["v", "w", "a", "q", "ori", "scale"]) && words::finger(words).is_none() => Quantity::Other,
            None if says(&["axis", "angle", "angles", "euler", "rpy", "rotvec"]) => Quantity::Other,
            None => Quantity::Position,
        },
        Form::Scalar if members.iter().all(|column| column.kind == ValueKind::Flag) => Quantity::Flag,
        Form::Scalar => Quantity::Number,
    }
}

/// The unit that a name ends with, after the component of a vector or before it: `mm` of `tip_x_mm` and `tip_mm_x`, none of the torque `ft_mx`; empty without
/// one.
pub fn unit_in_name(group: &Group) -> &'static str {
    const UNITS: [(&str, &str); 9] = [
        ("_um", "um"),
        ("_mm", "mm"),
        ("_cm", "cm"),
        ("_m", "m"),
        ("_deg", "deg"),
        ("_rad", "rad"),
        ("_N", "N"),
        ("_mN", "mN"),
        ("_Nm", "N m"),
    ];
    let behind = || group.pattern.rsplit_once('>').map_or("", |(_, behind)| behind);
    let text = if group.form == Form::Scalar { &group.name } else { behind() };
    let at_end = UNITS.iter().find(|(ending, _)| text.trim_end().ends_with(ending)).map(|(_, unit)| *unit);
    let words = words::words(&group.name);
    let before = || {
        ["mm", "cm"]
            .into_iter()
            .find(|unit| group.form == Form::Vector && words.last().is_some_and(|word| word == unit))
    };
    at_end.or_else(before).unwrap_or_default()
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
    let is_counter = |title: &str| {
        let last = title.rsplit('.').next().unwrap_or(title).to_lowercase();
        COUNTERS.contains(&last.as_str())
    };
    sheet.columns.iter().filter(|column| !is_left_out(&column.name) && !is_counter(&column.name)).collect()
}
