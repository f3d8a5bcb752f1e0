//! Columns that belong together: components of a vector or a rotation by their names, elements of arrays by their values.

use crate::inspect::ColumnReport;
use std::collections::BTreeMap;

/// What columns are together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Form {
    /// One number.
    Scalar,
    /// x y z
    Vector,
    /// A quaternion, members in the order w x y z.
    Quaternion,
    /// A rotation vector x y z, its length the angle.
    RotationVector,
    /// Roll, pitch and yaw.
    Angles,
    /// A rotation matrix, row by row.
    Matrix,
}

/// Columns that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// As a binding names them: `tool_p<xyz>`, without a unit; a list `[m[0], m[4], …]` of a matrix.
    pub pattern: String,
    /// The name without what differs.
    pub name: String,
    /// What they are.
    pub form: Form,
    /// Their places among the columns.
    pub members: Vec<usize>,
    /// The unit that their values show; empty where they show none.
    pub unit: &'static str,
    /// Why they are taken for this, where the names do not show it.
    pub reason: Option<String>,
}

/// Endings that components have, and the placeholder for them; longer ones first.
const ENDINGS: [(&[&str], &str); 9] = [
    (&["roll", "pitch", "yaw"], "rpy=roll pitch yaw"),
    (&["Roll", "Pitch", "Yaw"], "rpy=Roll Pitch Yaw"),
    (&["w", "x", "y", "z"], "wxyz"),
    (&["W", "X", "Y", "Z"], "WXYZ"),
    (&["x", "y", "z"], "xyz"),
    (&["X", "Y", "Z"], "XYZ"),
    (&["[0]", "[1]", "[2]"], "xyz=[0] [1] [2]"),
    (&["_0", "_1", "_2"], "xyz=_0 _1 _2"),
    (&["_1", "_2", "_3"], "xyz=_1 _2 _3"),
];
/// How far the norm of a quaternion may be off one.
const NORM: f64 = 0.02;

/// Puts columns together.
pub fn groups(columns: &[(String, &ColumnReport)]) -> Vec<Group> {
    let mut taken = vec![false; columns.len()];
    let mut places: BTreeMap<&str, usize> = BTreeMap::new();
    for (index, (name, _)) in columns.iter().enumerate() {
        places.entry(name).or_insert(index);
    }
    let mut groups = arrays(columns, &mut taken);
    for (index, (name, report)) in columns.iter().enumerate() {
        if taken.get(index).copied().unwrap_or(true) {
            continue;
        }
        let group = components(columns, &places, name, report, &taken).unwrap_or_else(|| scalar(name, index));
        group.members.iter().for_each(|member| taken.iter_mut().skip(*member).take(1).for_each(|taken| *taken = true));
        groups.push(group);
    }
    let mut groups: Vec<Group> = groups.into_iter().map(|group| super::turns::rotation(columns, group)).collect();
    groups.sort_by_key(|group| group.members.iter().min().copied());
    groups
}

fn scalar(name: &str, index: usize) -> Group {
    Group { pattern: name.into(), name: name.into(), form: Form::Scalar, members: vec![index], unit: "", reason: None }
}

/// The columns whose names differ from one in a component only.
fn components(
    columns: &[(String, &ColumnReport)],
    places: &BTreeMap<&str, usize>,
    name: &str,
    report: &ColumnReport,
    taken: &[bool],
) -> Option<Group> {
    // The letter of a component may also stand elsewhere in the name: `w` in `screw_qx`.
    let mut parted = ENDINGS.iter().flat_map(|(endings, placeholder)| {
        let around_each = endings.iter().flat_map(move |ending| around(name, ending));
        around_each.map(move |(head, tail)| (endings, placeholder, head, tail))
    });
    parted.find_map(|(endings, placeholder, head, tail)| {
        let member = |ending: &&str| {
            let at = *places.get(format!("{head}{ending}{tail}").as_str())?;
            columns.get(at).is_some_and(|(_, it)| it.unit == report.unit).then_some(at)
        };
        let members: Vec<usize> = endings.iter().filter_map(member).collect();
        let is_free = members.iter().all(|at| !taken.get(*at).copied().unwrap_or(true));
        let goes_on = numbers_beside(endings).iter().any(|beside| member(&beside.as_str()).is_some());
        let form = match endings.len() {
            4 => Form::Quaternion,
            _ if placeholder.starts_with("rpy") => Form::Angles,
            _ => Form::Vector,
        };
        let is_whole = members.len() == endings.len() && is_free && !goes_on;
        let is_plausible = || form != Form::Quaternion || is_unit(columns, &members);
        (is_whole && is_plausible()).then(|| Group {
            pattern: format!("{head}<{placeholder}>{tail}"),
            name: format!("{head} {tail}"),
            form,
            members,
            unit: "",
            reason: None,
        })
    })
}

/// The endings before and after numbered ones, `_0` and `_4` of `_1 _2 _3`: columns that go on with them, such as joints, are not a vector.
fn numbers_beside(endings: &[&str]) -> Vec<String> {
    let number = |ending: Option<&&str>| ending?.trim_matches(['_', '[', ']']).parse::<u32>().ok();
    let wrap = |number: u32| match endings.first() {
        Some(first) if first.starts_with('[') => format!("[{number}]"),
        Some(first) if first.starts_with('_') => format!("_{number}"),
        _ => number.to_string(),
    };
    let before = number(endings.first()).and_then(|first| first.checked_sub(1));
    let after = number(endings.last()).map(|last| last.saturating_add(1));
    before.into_iter().chain(after).map(wrap).collect()
}

/// A name around each place where a component stands, which no letter follows, the last one first: `p` and `` of `px`, `R_f` and `_world` of
/// `R_fx_world`.
fn around<'a>(name: &'a str, ending: &'a str) -> impl Iterator<Item = (&'a str, &'a str)> {
    let places = name.rmatch_indices(ending);
    let parted = places.filter_map(move |(at, _)| Some((name.get(..at)?, name.get(at + ending.len()..)?)));
    parted.filter(|(_, tail)| !tail.starts_with(char::is_alphanumeric))
}

/// Arrays, `pose[0]` to `pose[6]` or `tcp_0` to `tcp_5`, whose elements their number and their values tell apart.
fn arrays(columns: &[(String, &ColumnReport)], taken: &mut [bool]) -> Vec<Group> {
    let mut all: BTreeMap<(&str, bool), Vec<(usize, usize)>> = BTreeMap::new();
    for (index, (name, _)) in columns.iter().enumerate() {
        if let Some((base, at, is_bracket)) = element(name) {
            all.entry((base, is_bracket)).or_default().push((at, index));
        }
    }
    let mut groups = vec![];
    for ((base, is_bracket), mut elements) in all {
        elements.sort_unstable();
        let is_whole = elements.iter().enumerate().all(|(place, (at, _))| place == *at);
        let indices: Vec<usize> = elements.iter().map(|(_, index)| *index).collect();
        if !is_whole || indices.len() < 4 {
            continue;
        }
        let array = Array { base, is_bracket, columns, indices };
        for group in array.parts() {
            for member in &group.members {
                taken.iter_mut().skip(*member).take(1).for_each(|taken| *taken = true);
            }
            groups.push(group);
        }
    }
    groups
}

/// The array and the place of an element, and whether the place stands in brackets.
fn element(name: &str) -> Option<(&str, usize, bool)> {
    let (base, at, is_bracket) = match name.strip_suffix(']') {
        Some(head) => head.rsplit_once('[').map(|(base, at)| (base, at, true))?,
        None => name.rsplit_once('_').map(|(base, at)| (base, at, false))?,
    };
    Some((base, at.parse().ok()?, is_bracket))
}

/// An array.
struct Array<'a> {
    base: &'a str,
    is_bracket: bool,
    columns: &'a [(String, &'a ColumnReport)],
    indices: Vec<usize>,
}

impl Array<'_> {
    /// The vectors and rotations in it; what is neither is left.
    fn parts(&self) -> Vec<Group> {
        let words = super::words::words(self.base);
        let says = |known: &[&str]| super::words::has(&words, known);
        let count = self.indices.len();
        match count {
            16 if self.is_transform([15, 3, 7, 11]) => {
                vec![self.vector(12), self.matrix([0, 4, 8, 1, 5, 9, 2, 6, 10], "a homogeneous transform by columns")]
            }
            16 if self.is_transform([15, 12, 13, 14]) => vec![
                self.listed([3, 7, 11], Form::Vector),
                self.matrix([0, 1, 2, 4, 5, 6, 8, 9, 10], "a homogeneous transform by rows"),
            ],
            6 if says(&["force", "wrench", "ft", "f_ext", "f"]) => {
                let torque = Group { name: format!("{} torque", self.base), ..self.vector(3) };
                vec![self.vector(0), torque]
            }
            6 | 7 if says(&["pose", "tcp", "eef", "ee", "cartesian"]) && !self.is_rotation(3) => {
                let rotation = Group { name: format!("{} rotation", self.base), ..self.vector(3) };
                vec![self.vector(0), rotation]
            }
            // Joints at rest may have the norm of a rotation.
            _ if says(&["qvel", "velocity", "vel", "action", "actions", "qpos", "joint", "joints"]) => vec![],
            _ => self.poses(),
        }
    }

    /// Quaternions in it, and the positions before them.
    fn poses(&self) -> Vec<Group> {
        let mut groups = vec![];
        let (mut at, count) = (0, self.indices.len());
        let mut number = 0;
        while at + 4 <= count {
            let is_alone = count == 4 && at == 0;
            // A body that is turned by nothing and lies near zero has a number beside its quaternion with which the norm is nearly one too.
            if !(self.is_rotation(at) && (is_alone || at >= 3)) || self.norm_error(at + 1) < self.norm_error(at) {
                at += 1;
                continue;
            }
            number += 1;
            let numbered = |group: Group| {
                // States of MuJoCo have no names of bodies.
                let is_one = number == 1 && !self.is_state();
                let name = if is_one { group.name } else { format!("{} {number}", group.name) };
                Group { name, ..group }
            };
            if at >= 3 {
                groups.push(numbered(self.vector(at - 3)));
            }
            groups.push(numbered(self.quaternion(at)));
            // The next position has three elements of its own.
            at += 7;
        }
        groups
    }

    fn is_transform(&self, [one, zeros @ ..]: [usize; 4]) -> bool {
        let is = |at: usize, value: f64| {
            self.report(at).is_some_and(|report| (report.min - value).abs() < 1e-6 && (report.max - value).abs() < 1e-6)
        };
        is(one, 1.0) && zeros.iter().all(|at| is(*at, 0.0))
    }

    fn report(&self, at: usize) -> Option<&ColumnReport> {
        self.indices.get(at).and_then(|index| self.columns.get(*index)).map(|(_, report)| *report)
    }

    fn is_rotation(&self, at: usize) -> bool {
        self.indices.get(at..at + 4).is_some_and(|members| is_unit(self.columns, members))
    }

    /// How far the norm of four elements is off one, on average; infinite without four.
    fn norm_error(&self, at: usize) -> f64 {
        let members = self.indices.get(at..at + 4).unwrap_or_default();
        if members.len() == 4 { norm_error(self.columns, members) } else { f64::INFINITY }
    }

    /// Whether it is the state of MuJoCo, as robosuite stores it: the time, positions of joints and poses of free bodies, and velocities.
    fn is_state(&self) -> bool {
        super::words::words(self.base) == ["states"]
    }

    fn title(&self, at: usize) -> String {
        if self.is_bracket { format!("{}[{at}]", self.base) } else { format!("{}_{at}", self.base) }
    }

    fn members(&self, places: &[usize]) -> Vec<usize> {
        places.iter().filter_map(|place| self.indices.get(*place).copied()).collect()
    }

    fn placeholder(&self, letters: &str, places: &[usize]) -> String {
        let places: Vec<String> = places.iter().map(ToString::to_string).collect();
        let inner = format!("<{letters}={}>", places.join(" "));
        if self.is_bracket { format!("{}[{inner}]", self.base) } else { format!("{}_{inner}", self.base) }
    }

    fn vector(&self, at: usize) -> Group {
        let places = [at, at + 1, at + 2];
        let pattern = self.placeholder("xyz", &places);
        Group {
            pattern,
            name: self.base.into(),
            form: Form::Vector,
            members: self.members(&places),
            unit: "",
            reason: None,
        }
    }

    fn quaternion(&self, at: usize) -> Group {
        let places: Vec<usize> = (at..at + 4).collect();
        let (is_w_first, reason) = self.order(at);
        let (letters, last) = if is_w_first { ("wxyz", "xyzw") } else { ("xyzw", "wxyz") };
        let mut members = self.members(&places);
        if !is_w_first {
            members.rotate_right(1);
        }
        let pattern = self.placeholder(letters, &places);
        let other = self.placeholder(last, &places);
        let reason = Some(format!("{reason}; else `{other}`"));
        Group { pattern, name: self.base.into(), form: Form::Quaternion, members, unit: "", reason }
    }

    /// Whether w is the first of four elements, and why. A thing on a table turns about z alone.
    fn order(&self, at: usize) -> (bool, &'static str) {
        let is_zero = |place: usize| {
            self.report(at + place).is_some_and(|report| report.min.abs() < 0.1 && report.max.abs() < 0.1)
        };
        let starts_flat = |place: usize| {
            self.report(at + place).and_then(|report| report.samples.first()).is_some_and(|value| value.abs() < 0.1)
        };
        let words = super::words::words(self.base);
        match () {
            () if super::words::has(&words, &["wxyz"]) => (true, "named so"),
            () if super::words::has(&words, &["xyzw"]) => (false, "named so"),
            () if self.is_state() => (true, "w x y z, as MuJoCo writes it"),
            // Tools point down, which looks like the other order.
            () if super::words::tool_rank(&words).is_some() => (false, "x y z w, as robomimic and ROS write it"),
            () if is_zero(1) && is_zero(2) && !is_zero(0) => (true, "w x y z, since it turns about z alone"),
            () if is_zero(0) && is_zero(1) && !is_zero(3) => (false, "x y z w, since it turns about z alone"),
            () if starts_flat(1) && starts_flat(2) => (true, "w x y z, since it begins upright"),
            () if starts_flat(0) && starts_flat(1) => (false, "x y z w, since it begins upright"),
            () => (false, "x y z w, as robomimic and ROS write it"),
        }
    }

    fn listed<const N: usize>(&self, places: [usize; N], form: Form) -> Group {
        let titles: Vec<String> = places.iter().map(|place| format!("\"{}\"", self.title(*place))).collect();
        let pattern = format!("[{}]", titles.join(", "));
        Group { pattern, name: self.base.into(), form, members: self.members(&places), unit: "", reason: None }
    }

    fn matrix(&self, places: [usize; 9], reason: &str) -> Group {
        Group { reason: Some(reason.into()), ..self.listed(places, Form::Matrix) }
    }
}

/// The norms of columns in each row in which they have values.
fn norms(columns: &[(String, &ColumnReport)], members: &[usize]) -> Vec<f64> {
    let samples: Vec<&[f64]> =
        members.iter().filter_map(|member| columns.get(*member)).map(|(_, report)| report.samples.as_slice()).collect();
    let rows = samples.iter().map(|samples| samples.len()).min().unwrap_or_default();
    let norms = (0..rows).map(|row| {
        samples.iter().map(|samples| samples.get(row).copied().unwrap_or(f64::NAN).powi(2)).sum::<f64>().sqrt()
    });
    norms.filter(|norm| norm.is_finite()).collect()
}

/// How far the norm of columns is off one, on average.
fn norm_error(columns: &[(String, &ColumnReport)], members: &[usize]) -> f64 {
    let norms = norms(columns, members);
    norms.iter().map(|norm| (norm - 1.0).abs()).sum::<f64>() / norms.len().max(1) as f64
}

/// Whether four columns are quaternions: their norm is one in all rows.
fn is_unit(columns: &[(String, &ColumnReport)], members: &[usize]) -> bool {
    let (mut seen, mut right) = (0_usize, 0_usize);
    for norm in norms(columns, members) {
        seen += 1;
        right += usize::from((norm - 1.0).abs() < NORM);
    }
    // A tracker that lost the body writes zeros.
    seen > 0 && right * 10 >= seen * 9
}
