//! Three columns that turn something: a rotation vector, or roll, pitch and yaw. Names tell them apart, else values.

use super::column_groups::{Form, Group};
use super::parts::unit_in_name;
use super::words;
use crate::inspect::ColumnReport;
use std::f64::consts::{FRAC_PI_2, TAU};
use teachtree_base::units::compound_of_log;

/// How far values may be beyond the bound of an angle.
const SLACK: f64 = 1.02;
/// The share of samples that are more than bad ones.
const SHARE: f64 = 0.01;

/// What most values show.
struct Extent {
    /// Longer than a rotation vector in rad: in degrees, where the log has no unit.
    is_long: bool,
    /// The second is beyond the range of a pitch.
    is_beyond_pitch: bool,
}

impl Extent {
    /// The extent of columns in a unit of this factor to rad.
    fn of(columns: &[(String, &ColumnReport)], members: &[usize], factor: f64) -> Self {
        let samples: Vec<&[f64]> =
            members.iter().filter_map(|at| columns.get(*at)).map(|(_, it)| it.samples.as_slice()).collect();
        let rows = samples.iter().map(|samples| samples.len()).min().unwrap_or_default();
        let value = |axis: usize, row: usize| {
            samples.get(axis).and_then(|it| it.get(row)).map_or(f64::NAN, |value| value * factor)
        };
        let is_often =
            |is: &dyn Fn(usize) -> bool| (0..rows).filter(|row| is(*row)).count() as f64 > SHARE * rows as f64;
        let norm = |row: usize| (0..3).map(|axis| value(axis, row).powi(2)).sum::<f64>().sqrt();
        Self {
            is_long: is_often(&|row| norm(row) > TAU * SLACK),
            is_beyond_pitch: is_often(&|row| value(1, row).abs() > FRAC_PI_2 * SLACK),
        }
    }
}

/// The group as a rotation, if its name is that of one.
pub fn rotation(columns: &[(String, &ColumnReport)], group: Group) -> Group {
    let words = words::words(&group.name);
    let says = |known: &[&str]| words::has(&words, known);
    let is_rotvec = says(&["rotvec", "rv", "axisangle"]) || says(&["axis"]) && says(&["angle"]);
    let is_of_components = group.form == Form::Angles;
    let is_rpy = says(&["rpy", "euler"]) || is_of_components;
    let is_r = ends_with_r(&group.name);
    let is_named = says(&["rotation", "rot", "orientation", "ori"]);
    let is_rotation = is_of_components || group.form == Form::Vector && (is_rotvec || is_rpy || is_r || is_named);
    if !is_rotation {
        return group;
    }
    let of_log = group.members.first().and_then(|at| columns.get(*at)).map_or("", |(_, column)| column.unit.as_str());
    let unit = if of_log.is_empty() { unit_in_name(&group) } else { of_log };
    let factor = compound_of_log(unit).map_or(1.0, |(factor, _)| factor);
    let extent = Extent::of(columns, &group.members, if unit.is_empty() { 1.0 } else { factor });
    let is_in_degrees = extent.is_long && unit.is_empty();
    let is_of_ur = is_r || says(&["tcp", "ur"]);
    let (form, reason) = match () {
        () if is_rotvec => (Form::RotationVector, "a rotation vector by its name"),
        () if is_rpy => (Form::Angles, "roll, pitch and yaw by its name"),
        () if extent.is_long => (Form::Angles, "roll, pitch and yaw"),
        () if extent.is_beyond_pitch => {
            (Form::RotationVector, "a rotation vector, since the second is beyond the range of a pitch")
        }
        () if compound_of_log(unit).is_ok_and(|(factor, _)| !unit.is_empty() && factor != 1.0) => {
            (Form::Angles, "roll, pitch and yaw, since rotation vectors are usually in radians")
        }
        () if is_of_ur => (Form::RotationVector, "a rotation vector, as UR writes it"),
        () if says(&["ori"]) => (Form::RotationVector, "a rotation vector, as robosuite writes it"),
        () => (Form::Angles, "roll, pitch and yaw"),
    };
    if is_of_components {
        let reason = is_in_degrees.then(|| "in degrees, since the angles are beyond a turn in radians".to_string());
        return Group { unit: if is_in_degrees { "deg" } else { "" }, reason, ..group };
    }
    let [pattern, other] = match form {
        Form::RotationVector => ["rotvec", "rpy"],
        _ => ["rpy", "rotvec"],
    }
    .map(|placeholder| renamed(&group.pattern, placeholder));
    let is_certain = is_rotvec || is_rpy;
    let degrees = if is_in_degrees { " in degrees, since they are beyond a turn in radians" } else { "" };
    let alternative = if is_certain {
        String::new()
    } else {
        let unit = if is_in_degrees { "deg" } else { unit };
        let unit = if unit.is_empty() || !of_log.is_empty() { String::new() } else { format!(" [{unit}]") };
        format!("; else `{other}{unit}`")
    };
    let reason = Some(format!("{reason}{degrees}{alternative}"));
    Group { pattern, form, unit: if is_in_degrees { "deg" } else { "" }, reason, ..group }
}

/// Whether the components of a name follow an `r`: `tcp_rx` and `tcp_rx_deg`, not `r_x`, which is a place.
fn ends_with_r(name: &str) -> bool {
    let name = name.trim_end();
    let stem = ["_deg", "_rad"].iter().find_map(|unit| name.strip_suffix(unit)).unwrap_or(name).trim_end();
    stem.ends_with(['r', 'R']) && words::words(stem).last().is_some_and(|word| word == "r")
}

/// A pattern with another placeholder for the same three columns.
fn renamed(pattern: &str, placeholder: &str) -> String {
    let letters = |letters: &str| format!("<{placeholder}={letters}>");
    pattern
        .replace("<xyz=", &format!("<{placeholder}="))
        .replace("<xyz>", &letters("x y z"))
        .replace("<XYZ>", &letters("X Y Z"))
}
