//! Resolves the names of a binding in the header of a foreign table: the columns of each channel, with the factors that convert them to SI.

use super::linear::LinearForm;
use super::pattern::{Columns, Pattern, PlaceholderValues, Representation};
use super::{BindingFile, Template, Threshold};
use crate::inspect;
use indexmap::IndexMap;
use std::f64::consts::PI;
use teachtree_base::channels::Shape;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_base::log_channel::LogChannel;
use teachtree_base::spelling::nearest;
use teachtree_base::units::{Dimension, compound_of_log};
use teachtree_logs::names;
use teachtree_logs::read::table::{NAME_TIME, Source};

/// One canonical column and its source terms.
pub(super) struct BoundColumn {
    pub name: String,
    /// The channel or joint that the column is a component of, and the form of its components.
    pub channel: String,
    pub representation: Representation,
    pub dimension: Dimension,
    /// Flags are combined with "or", numbers are added.
    pub flag: bool,
    pub terms: Vec<Term>,
    /// The weight of each term.
    pub weight: f64,
}

/// A column of the table times a factor for the SI unit, the scale and the sign, plus an offset. Without a column, the offset is the value.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Term {
    pub column: Option<usize>,
    pub factor: f64,
    /// SI.
    pub offset: f64,
    /// The size of the unit, SI.
    unit: f64,
    pub threshold: Option<Threshold>,
}

impl Term {
    /// The same value in every row, SI.
    const fn constant(value: f64) -> Self {
        Self { column: None, factor: 0.0, offset: value, unit: 1.0, threshold: None }
    }

    /// Whether an angle is assumed to be in radians.
    pub fn is_of_radians(&self) -> bool {
        self.column.is_none() || self.unit > 2.0 * (PI / 180.0)
    }

    /// Converts a number of the column to SI, before a threshold converts it to a flag.
    pub fn measured(&self, number: f64) -> f64 {
        // A sum with 0 would lose the sign of zeros.
        if self.offset == 0.0 { number * self.factor } else { number * self.factor + self.offset }
    }

    pub fn value(&self, number: f64) -> f64 {
        let value = self.measured(number);
        self.threshold.map_or(value, |threshold| threshold.flag(value))
    }
}

/// The names of the whole seconds of a stamp and of its rest, with the unit of the rest, s.
const SECONDS_AND_REST: [(&str, &str, f64); 7] = [
    ("sec", "nanosec", 1e-9),
    ("sec", "nsec", 1e-9),
    ("secs", "nsecs", 1e-9),
    ("seconds", "nanoseconds", 1e-9),
    ("seconds", "nanos", 1e-9),
    ("tv_sec", "tv_usec", 1e-6),
    ("tv_sec", "tv_nsec", 1e-9),
];

/// The header of a foreign table: names, and units in the syntax of this project.
pub struct Header {
    pub(super) titles: Vec<String>,
    /// The columns of each name; several columns may share one.
    columns: IndexMap<String, Vec<usize>>,
    /// The unit of each column, if the header contains one.
    units: Vec<Option<String>>,
    /// The name and the number of columns of each sheet.
    sheets: Vec<(String, usize)>,
    /// Sheets that cannot be read, with the reason.
    refused: Vec<(String, String)>,
    /// Whether it is the header of an assumed log, whose columns may have units.
    is_assumed: bool,
    /// Whether the first column of each sheet has the stamps of messages.
    has_stamps: bool,
}

impl Header {
    /// The header of a log.
    pub fn new(source: &Source) -> Self {
        let sheets = source.sheets.iter().map(|sheet| (sheet.name.clone(), sheet.header.len())).collect();
        Self { has_stamps: source.clock.is_some(), ..Self::of(source.header(), sheets, source.refused.clone()) }
    }

    /// Creates a header from the full names of all columns, the name and number of columns of each sheet, and the unreadable sheets with their
    /// reasons.
    pub fn of(titles: Vec<String>, sheets: Vec<(String, usize)>, refused: Vec<(String, String)>) -> Self {
        let mut columns: IndexMap<String, Vec<usize>> = IndexMap::new();
        let mut units = vec![];
        for (index, title) in titles.iter().enumerate() {
            let (name, unit) = names::split_known_unit(title);
            columns.entry(name.to_string()).or_default().push(index);
            units.push(unit.map(str::to_string));
        }
        Self { titles, columns, units, sheets, refused, is_assumed: false, has_stamps: false }
    }

    /// The header of a log that has these columns, and may have units for them.
    pub(super) fn assumed(names: Vec<String>) -> Self {
        let columns = (0..).zip(&names).map(|(column, name)| (name.clone(), vec![column])).collect();
        let (units, sheets) = (vec![None; names.len()], vec![(String::new(), names.len())]);
        Self { titles: names, columns, units, sheets, refused: vec![], is_assumed: true, has_stamps: false }
    }

    /// Returns the time columns: the one that the binding names, otherwise one per sheet.
    pub(super) fn times(&self, file: &BindingFile) -> Result<Vec<Term>, InputError> {
        let pattern = &file.binding.time;
        let name = pattern.name.fill(PlaceholderValues::default());
        let alone = std::iter::once(name.clone());
        let of_sheets =
            self.sheets.iter().filter(|(sheet, _)| !sheet.is_empty()).map(|(sheet, _)| format!("{sheet}.{name}"));
        let mut times = vec![];
        for name in alone.chain(of_sheets) {
            if let Some(parts) = self.seconds_and_rest(&name).filter(|_| pattern.unit.is_none()) {
                times.extend(parts);
                continue;
            }
            let pattern = Pattern { name: Template::text(&name), ..pattern.clone() };
            let term = self.term(&pattern, PlaceholderValues::default(), Dimension::TIME);
            times.extend(term.map_err(|message| file.error("time", message))?);
        }
        if !times.is_empty() {
            return Ok(times);
        }
        match inspect::stamps(&self.titles, None) {
            Some(stamps) => {
                Err(file
                    .error("time", format!("the log has no column `{name}`; did you mean `time: {}`?", stamps.title)))
            }
            None => Err(file.error("time", self.lacks(&name)).help(NAME_TIME)),
        }
    }

    /// Returns the columns of stamps that are written as two numbers, whole seconds and the rest, if a name is that of the seconds, or precedes both.
    fn seconds_and_rest(&self, name: &str) -> Option<[Term; 2]> {
        let term = |title: String, unit: f64| {
            let column = self.columns.get(&title).filter(|columns| columns.len() == 1)?.first().copied();
            Some(Term { column, factor: unit, offset: 0.0, unit, threshold: None })
        };
        SECONDS_AND_REST.into_iter().find_map(|(seconds, rest, unit)| {
            let stems =
                [name.strip_suffix(seconds).map(str::to_string), Some(format!("{name}.")), Some(format!("{name}_"))];
            let both =
                |stem: String| Some([term(format!("{stem}{seconds}"), 1.0)?, term(format!("{stem}{rest}"), unit)?]);
            stems.into_iter().flatten().find_map(both)
        })
    }

    /// Returns the column of this name, if the log has it. If several columns share the name, a unit may select one.
    ///
    /// # Errors
    /// Several columns have the name. The message contains their numbers.
    pub(super) fn find(&self, name: &str, unit: Option<&str>) -> Result<Option<usize>, String> {
        let whole = || (0..).zip(&self.titles).filter(|(_, title)| *title == name).map(|(at, _)| at).collect();
        let mut found: Vec<usize> = self.columns.get(name).cloned().unwrap_or_else(whole);
        if found.is_empty() {
            return Ok(self.numbered(name));
        }
        let in_unit = |at: &usize| unit.is_some() && self.units.get(*at).and_then(Option::as_deref) == unit;
        if found.iter().filter(|at| in_unit(at)).count() == 1 {
            found.retain(in_unit);
        }
        if found.len() < 2 {
            return Ok(found.pop());
        }
        // A field of a message may be called as the stamps are.
        if let Some(stamps) = found.first().filter(|at| self.has_stamps && self.number(**at) == 1) {
            return Ok(Some(*stamps));
        }
        let numbers: Vec<String> = found.iter().map(|at| self.number(*at).to_string()).collect();
        Err(format!(
            "`{name}` is the name of columns {}, expected a name that one column has: rename the others in the log, or bind the number",
            numbers.join(" and ")
        ))
    }

    /// Returns the column with this number, counted from 1, of a log that is one sheet.
    fn numbered(&self, name: &str) -> Option<usize> {
        let is_number = name.bytes().all(|byte| byte.is_ascii_digit()) && self.sheets.len() == 1;
        let column = name.parse::<usize>().ok().filter(|_| is_number)?.checked_sub(1)?;
        (column < self.titles.len()).then_some(column)
    }

    /// Returns the name of a column.
    pub(super) fn title(&self, column: usize) -> &str {
        self.titles.get(column).map_or("", |title| names::split_known_unit(title).0)
    }

    /// Returns the number of a column in its sheet, counted from 1.
    fn number(&self, column: usize) -> usize {
        let mut first = 0;
        let ends = self.sheets.iter().map(|(_, width)| {
            first += width;
            first
        });
        1 + column - ends.take_while(|end| *end <= column).last().unwrap_or(0)
    }

    pub(super) fn lacks(&self, name: &str) -> String {
        let of_sheet = |sheet: &str| {
            name.strip_prefix(sheet).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[', '/']))
        };
        if let Some((sheet, why)) = self.refused.iter().find(|(sheet, _)| of_sheet(sheet)) {
            return format!("`{sheet}` cannot be read: {why}");
        }
        let of_sheets = self.sheets.iter().filter(|(sheet, _)| !sheet.is_empty());
        let mut same =
            of_sheets.map(|(sheet, _)| format!("{sheet}.{name}")).filter(|full| self.columns.contains_key(full));
        if let Some(full) = same.next() {
            return match self.sheets.as_slice() {
                [_] => format!("the log has no column `{name}`; bind `{full}`"),
                _ => format!(
                    "the log has no column `{name}`; `{full}` has other rows than most columns: bind it, and `resample` the log"
                ),
            };
        }
        if let Some(title) = self.titles.iter().find(|title| is_with_unit(title, name)) {
            return format!(
                "the log has no column `{name}`; `{title}` has a unit that is not known: bind it with a scale, `{title} * SCALE [UNIT]`"
            );
        }
        if self.columns.contains_key(&format!("{name}[0]")) {
            let count = (0..).take_while(|at| self.columns.contains_key(&format!("{name}[{at}]"))).count();
            let last = count.saturating_sub(1);
            let all = if count == 1 { String::new() } else { format!(" to `{name}[{last}]`") };
            return format!("the log has no column `{name}`, which is an array: bind `{name}[0]`{all}");
        }
        if name.contains('*') || name.contains(" + ") {
            return format!(
                "the log has no column `{name}`; scale and offset are numbers with blanks around `*` and `+`, and the unit follows: `x * 0.1 + 3 [mm]`"
            );
        }
        match nearest(name, self.columns.keys().map(String::as_str)) {
            Some(near) => format!("the log has no column `{name}`; did you mean `{near}`?"),
            None if self.sheets.len() > 1 => {
                let parts: Vec<String> = self.sheets.iter().map(|(sheet, _)| format!("`{sheet}`")).collect();
                format!("the log has no column `{name}`; its parts are {}", parts.join(", "))
            }
            None => format!("the log has no column `{name}`"),
        }
    }

    /// Returns the column of a pattern with filled placeholders, if the log has it.
    fn term(
        &self,
        pattern: &Pattern,
        filling: PlaceholderValues,
        dimension: Dimension,
    ) -> Result<Option<Term>, String> {
        let mut name = pattern.name.fill(filling);
        if let Some((value, found)) = pattern.constant {
            return match found == dimension {
                true => Ok(Some(Term::constant(value))),
                false => Err(format!("`{}` is {found}, expected {dimension}", name.trim())),
            };
        }
        let mut linear = pattern.linear;
        if linear.is_some() && self.find(&pattern.title.fill(filling), pattern.unit.as_deref())?.is_some() {
            (name, linear) = (pattern.title.fill(filling), None);
        }
        let Some(column) = self.find(&name, pattern.unit.as_deref())? else { return Ok(None) };
        let dimension = pattern.threshold.map_or(dimension, |threshold| threshold.dimension);
        let of_header = self.units.get(column).and_then(Option::as_deref);
        let of_header = of_header.filter(|header| pattern.unit.is_none() || !is_converted(linear, header, dimension));
        let to_si = match (pattern.unit.as_deref(), of_header) {
            (Some(said), Some(header)) if said != header => {
                return Err(format!("`{name}` is in `{header}` as the header says, not in `{said}`"));
            }
            (Some(unit), _) | (None, Some(unit)) => {
                let (to_si, found) = compound_of_log(unit).map_err(|part| unknown_unit(&part, &name, dimension))?;
                match pattern.threshold {
                    Some(_) if found != dimension && dimension == Dimension::NONE => {
                        return Err(format!(
                            "the column `{name}` is in `{unit}` and its threshold has no unit, expected one such as `30 {unit}`"
                        ));
                    }
                    _ if found != dimension => return Err(format!("`{unit}` is {found}, expected {dimension}")),
                    _ => {}
                }
                to_si
            }
            // A threshold in meters for values in millimeters would produce a constant flag without any message.
            (None, None) if pattern.threshold.is_some() && dimension != Dimension::NONE && !self.is_assumed => {
                return Err(format!(
                    "the column `{name}` has no unit to compare with the limit's, expected `{name} [unit]`"
                ));
            }
            (None, None) => 1.0,
        };
        let (scale, offset) = linear.map_or((1.0, 0.0), |form| (form.scale, form.offset));
        let (factor, offset) = (to_si * pattern.sign * scale, to_si * offset);
        Ok(Some(Term { column: Some(column), factor, offset, unit: to_si, threshold: pattern.threshold }))
    }

    /// Refuses a column with a unit as a flag.
    fn check_flag(&self, channel: &str, pattern: &Pattern, filling: PlaceholderValues) -> Result<(), String> {
        let name = pattern.name.fill(filling);
        let Some(column) = self.find(&name, pattern.unit.as_deref())? else { return Ok(()) };
        let of_header = self.units.get(column).and_then(Option::as_deref);
        let Some(unit) = pattern.unit.as_deref().or(of_header) else { return Ok(()) };
        match compound_of_log(unit) {
            Ok((_, found)) if found != Dimension::NONE => Err(format!(
                "`{channel}` is a flag and `{name}` is {found}, expected a threshold such as `{name} < 40 {unit}`"
            )),
            _ => Ok(()),
        }
    }

    /// Returns the column of a label.
    pub(super) fn text_column(&self, columns: &Columns) -> Result<usize, String> {
        let pattern = columns.component(0).0.first();
        let name = pattern.map(|pattern| pattern.title.fill(PlaceholderValues::default())).unwrap_or_default();
        self.find(&name, None)?.ok_or_else(|| self.lacks(&name))
    }

    /// Returns the column of a joint.
    pub(super) fn joint(&self, name: String, columns: &Columns, dimension: Dimension) -> Result<BoundColumn, String> {
        let (patterns, weight) = match columns {
            Columns::Pattern(_) | Columns::Mean(_) => columns.component(0),
            _ => return Err("expected a column, or `{mean: [...]}`".into()),
        };
        let mut terms = vec![];
        for pattern in patterns {
            if pattern.threshold.is_some() || pattern.optional {
                return Err("a joint has neither a threshold nor a `?`".into());
            }
            let term = self.term(pattern, PlaceholderValues::default(), dimension)?;
            terms.push(term.ok_or_else(|| self.lacks(&pattern.name.fill(PlaceholderValues::default())))?);
        }
        let channel = name.clone();
        Ok(BoundColumn { name, channel, representation: Representation::Scalar, dimension, flag: false, terms, weight })
    }

    /// Returns the canonical columns of one key of `channels`.
    pub(super) fn channel(&self, key: &str, columns: &Columns, objects: &[&str]) -> Result<Vec<BoundColumn>, String> {
        let name = Template::parse(key)?;
        let mut bound = vec![];
        let mut missing = None;
        for filling in fillings(&name, objects) {
            let channel = name.fill(filling);
            let (representation, dimension) = representation_of(&channel, columns)?;
            let flag = is_flag(&channel);
            if !flag && columns.patterns().iter().any(|pattern| pattern.threshold.is_some()) {
                return Err(format!("`{channel}` is not a flag; only flags have a threshold"));
            }
            // The object placeholder is on the right-hand side only: the columns of all objects are combined.
            let joined: Vec<PlaceholderValues> =
                match (columns.patterns().iter().any(|pattern| pattern.name.has_object()), name.has_object()) {
                    (true, false) => objects.iter().map(|object| PlaceholderValues { object, ..filling }).collect(),
                    _ => vec![filling],
                };
            let mut parts: Vec<BoundColumn> = vec![];
            for (component, letter) in representation.components().iter().enumerate() {
                let (patterns, weight) = columns.component(component);
                let full = if letter.is_empty() { channel.clone() } else { format!("{channel}.{letter}") };
                let channel = channel.clone();
                let mut part =
                    BoundColumn { name: full, channel, representation, dimension, flag, terms: vec![], weight };
                for (filling, pattern) in joined.iter().flat_map(|it| patterns.iter().map(move |pattern| (it, pattern)))
                {
                    let filling = PlaceholderValues { component, ..*filling };
                    if flag && pattern.threshold.is_none() {
                        self.check_flag(&part.channel, pattern, filling)?;
                    }
                    match self.term(pattern, filling, dimension)? {
                        Some(term) => part.terms.push(term),
                        None => missing = missing.or_else(|| Some(pattern.name.fill(filling))),
                    }
                }
                // A mean requires all of its columns or none.
                if patterns.len() > 1 && !part.terms.is_empty() && part.terms.len() < joined.len() * patterns.len() {
                    return Err(missing.map_or_else(String::new, |name| self.lacks(&name)));
                }
                parts.push(part);
            }
            let widths: Vec<usize> = parts.iter().map(|part| part.terms.len()).collect();
            match (widths.iter().min(), widths.iter().max()) {
                // This object has no column; other objects may have one.
                (_, Some(0)) => {}
                (least, most) if least == most => bound.append(&mut parts),
                _ => return Err(missing.map_or_else(String::new, |name| self.lacks(&name))),
            }
        }
        if bound.is_empty() && !columns.patterns().iter().all(|pattern| pattern.optional) {
            return Err(missing.map_or_else(
                || "the scene has no objects for `<object>` to stand for".into(),
                |name| self.lacks(&name),
            ));
        }
        Ok(bound)
    }
}

/// Whether a title is this name and a text in brackets after it.
fn is_with_unit(title: &str, name: &str) -> bool {
    let Some(unit) = title.strip_prefix(name).map(str::trim).filter(|_| !name.is_empty()) else { return false };
    let is_index = |unit: &str| unit.bytes().all(|byte| byte.is_ascii_digit());
    let inner = |open: char, close: char| unit.strip_prefix(open)?.strip_suffix(close);
    inner('(', ')').or_else(|| inner('[', ']').filter(|unit| !is_index(unit))).is_some()
}

/// Whether a scale makes this quantity of a column that the header says to be of another one, such as newtons of `[s]`.
fn is_converted(linear: Option<LinearForm>, header: &str, dimension: Dimension) -> bool {
    linear.is_some_and(|form| form.scale != 1.0) && compound_of_log(header).is_ok_and(|(_, found)| found != dimension)
}

/// The message about a unit that is not known, with the form that converts it.
fn unknown_unit(unit: &str, name: &str, dimension: Dimension) -> String {
    let message = format!("`{unit}` is not a known unit, expected one of {dimension}");
    match dimension.si_unit() {
        known if known.is_empty() => message,
        known => format!("{message}; a scale converts others: `{name} * 0.001 [{known}]`"),
    }
}

/// Returns all values of the placeholders of a name.
pub(super) fn fillings<'a>(name: &Template, objects: &[&'a str]) -> Vec<PlaceholderValues<'a>> {
    match (name.has_object(), name.has_other()) {
        (false, _) => vec![PlaceholderValues::default()],
        (true, false) => {
            objects.iter().map(|object| PlaceholderValues { object, ..PlaceholderValues::default() }).collect()
        }
        (true, true) => {
            let pairs = objects.iter().flat_map(|object| objects.iter().map(move |other| (object, other)));
            pairs
                .filter(|(object, other)| object != other)
                .map(|(object, other)| PlaceholderValues { object, other, component: 0 })
                .collect()
        }
    }
}

/// Whether the values of a channel are 0 and 1.
fn is_flag(channel: &str) -> bool {
    LogChannel::parse(channel).is_some_and(|channel| channel.shape() == Shape::Bool)
}

/// Returns the form and dimension of a channel: from its name, otherwise from its columns.
fn representation_of(channel: &str, columns: &Columns) -> Result<(Representation, Dimension), String> {
    let (wanted, dimension) = match LogChannel::parse(channel) {
        Some(channel) => (Some(channel.shape()), channel.dimension()),
        None => {
            let (side, rest) = channel.split_once('.').unwrap_or((channel, ""));
            if Side::from_name(side).is_none() || rest.is_empty() {
                return Err(format!(
                    "`{channel}` is not a channel, expected a name such as `right.thumb.force`, `<object>.position`, `contact.<object>.table.force`"
                ));
            }
            let unit = columns.patterns().first().and_then(|pattern| pattern.unit.as_deref()).unwrap_or_default();
            let (_, dimension) = compound_of_log(unit).map_err(|part| format!("`{part}` is not a known unit"))?;
            (None, dimension)
        }
    };
    let representation = columns.representation(wanted);
    let (found, wanted) = (
        representation.shape().components().len(),
        wanted.map_or(representation.shape(), |shape| shape).components().len(),
    );
    match representation {
        Representation::Vector if wanted == 4 => Err(format!(
            "`{channel}` has 4 components, found columns for 3; roll, pitch and yaw are `<rpy>`, a rotation vector is `<rotvec>`"
        )),
        _ if found != wanted => Err(format!("`{channel}` has {wanted} components, found columns for {found}")),
        Representation::Angles | Representation::RotationVector => Ok((representation, Dimension::ANGLE)),
        _ => Ok((representation, dimension)),
    }
}
