//! Three columns that turn something: a rotation vector, or roll, pitch and yaw. Names tell them apart, else values.

use super::column_groups::{Form, Group};
use super::parts::unit_in_name;
use super::words;
use crate::inspect::ColumnReport;
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use teachtree_base::units::compound_of_log;

/// How far values may be beyond the bound of an angle.
const SLACK: f64 = 1.02;
/// The share of samples that are more than bad ones.
const SHARE: f64 = 0.01;

/// A change of the values by more than this in a step is a jump, rad: they are ambiguous at half a turn.
const JUMP_RAD: f64 = 2.0;
/// A jump of the values is none of the rotation, or is one, rad.
const SAME_RAD: f64 = 0.3;
const OTHER_RAD: f64 = 0.6;
/// What turns about the vertical tilts less than what is tilted: by this share of its angle, which is at least this, rad.
const UPRIGHT: f64 = 0.3;
const TILTED_RAD: f64 = 0.05;

/// What the values show.
struct Extent {
    /// Longer than a rotation vector in rad: in degrees, where the log has no unit.
    is_long: bool,
    /// Longer than half a turn.
    is_beyond_half_turn: bool,
    /// It passes half a turn without a jump.
    passes_half_turn: bool,
    /// The second is beyond the range of a pitch.
    is_beyond_pitch: bool,
    /// The values, rad.
    values: Vec<Vector3<f64>>,
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
        let values: Vec<Vector3<f64>> =
            (0..rows).map(|row| Vector3::new(value(0, row), value(1, row), value(2, row))).collect();
        let is_often =
            |is: &dyn Fn(&Vector3<f64>) -> bool| values.iter().filter(|at| is(at)).count() as f64 > SHARE * rows as f64;
        let is_beyond_half_turn = is_often(&|at| at.norm() > PI * SLACK);
        let jumps = values.windows(2).any(|pair| (pair[1] - pair[0]).norm() > JUMP_RAD);
        Self {
            is_long: is_often(&|at| at.norm() > TAU * SLACK),
            is_beyond_half_turn,
            passes_half_turn: is_beyond_half_turn && is_often(&|at| at.norm() < PI) && !jumps,
            is_beyond_pitch: is_often(&|at| at.y.abs() > FRAC_PI_2 * SLACK),
            values: values.into_iter().filter(|at| at.iter().all(|part| part.is_finite())).collect(),
        }
    }

    /// The form as which the values turn smoothly where they jump; none where they do not, or where neither form or both are smooth.
    fn smooth_form(&self) -> Option<Form> {
        let jumps = self.values.windows(2).filter(|pair| (pair[1] - pair[0]).norm() > JUMP_RAD);
        let (mut of_vectors, mut of_angles) = (0, 0);
        for pair in jumps {
            let [as_vector, as_angles] = FORMS.map(|form| turn(form, pair[0]).angle_to(&turn(form, pair[1])));
            of_vectors += usize::from(as_vector < SAME_RAD && as_angles > OTHER_RAD);
            of_angles += usize::from(as_angles < SAME_RAD && as_vector > OTHER_RAD);
        }
        match (of_vectors, of_angles) {
            (1.., 0) => Some(Form::RotationVector),
            (0, 1..) => Some(Form::Angles),
            _ => None,
        }
    }

    /// The form as which the values turn about the vertical, and by how much they tilt as the other one, rad; none where neither does so.
    fn upright_form(&self) -> Option<(Form, f64)> {
        let [as_vector, as_angles] = FORMS.map(|form| self.tilt(form));
        let is_upright = |one: f64, other: f64| other > TILTED_RAD && one < UPRIGHT * other;
        match () {
            () if is_upright(as_vector, as_angles) => Some((Form::RotationVector, as_angles)),
            () if is_upright(as_angles, as_vector) => Some((Form::Angles, as_vector)),
            () => None,
        }
    }

    /// How far the vertical is from its mean direction in the turned frame, root mean square, rad.
    fn tilt(&self, form: Form) -> f64 {
        let verticals: Vec<Vector3<f64>> =
            self.values.iter().map(|at| turn(form, *at).inverse() * Vector3::z()).collect();
        let mean: Vector3<f64> = verticals.iter().sum();
        let squares: f64 = verticals.iter().map(|vertical| vertical.angle(&mean).powi(2)).sum();
        (squares / verticals.len().max(1) as f64).sqrt()
    }
}

/// The forms of three values.
const FORMS: [Form; 2] = [Form::RotationVector, Form::Angles];

/// The rotation by three values in a form, rad.
fn turn(form: Form, at: Vector3<f64>) -> UnitQuaternion<f64> {
    match form {
        Form::RotationVector => UnitQuaternion::from_scaled_axis(at),
        _ => UnitQuaternion::from_euler_angles(at.x, at.y, at.z),
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
    let is_in_other_unit = compound_of_log(unit).is_ok_and(|(factor, _)| !unit.is_empty() && factor != 1.0);
    let upright = extent.upright_form();
    let is_upright = matches!(upright, Some((Form::Angles, _)));
    // Some vectors of UR are not wrapped at half a turn: the names of its interface show them, or that the angles turn about no vertical.
    let is_unwrapped =
        says(&["ur"]) || says(&["actual"]) && says(&["tcp"]) || is_r && extent.passes_half_turn && !is_upright;
    let (form, why) = match (extent.smooth_form(), upright) {
        _ if is_rotvec => (Form::RotationVector, " by its name".into()),
        _ if is_rpy => (Form::Angles, " by its name".into()),
        _ if extent.is_long => (Form::Angles, String::new()),
        (Some(form), _) => (form, format!(": as {}, the values would jump at half a turn", other_name(form))),
        _ if extent.is_beyond_pitch => {
            (Form::RotationVector, ", since the second is beyond the range of a pitch".into())
        }
        _ if extent.is_beyond_half_turn && is_unwrapped && !is_in_other_unit => {
            (Form::RotationVector, ", as UR writes it, also beyond half a turn".into())
        }
        _ if extent.is_beyond_half_turn => {
            (Form::Angles, ", since a rotation vector is not longer than half a turn".into())
        }
        _ if is_in_other_unit => (Form::Angles, ", since rotation vectors are usually in radians".into()),
        (None, Some((form, tilt_rad))) => {
            let (other, tilt_deg) = (other_name(form), tilt_rad.to_degrees());
            (form, format!(": the rotation is about the vertical; as {other}, it would tilt by {tilt_deg:.0}°"))
        }
        _ if is_of_ur => (Form::RotationVector, ", as UR writes it".into()),
        _ if says(&["ori"]) => (Form::RotationVector, ", as robosuite writes it".into()),
        (None, None) => (Form::Angles, String::new()),
    };
    let reason = format!("{}{why}", name(form));
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

/// A form of three values in words.
fn name(form: Form) -> &'static str {
    if form == Form::RotationVector { "a rotation vector" } else { "roll, pitch and yaw" }
}

/// The other form of three values in words.
fn other_name(form: Form) -> &'static str {
    name(if form == Form::RotationVector { Form::Angles } else { Form::RotationVector })
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
