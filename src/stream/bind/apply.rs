//! Applying a binding: the columns of a foreign table in, a recording with canonical names out.

use super::normals::normals_by_role;
use super::offsets;
use super::pattern::{Columns, Filling, Form, Pattern};
use super::places;
use super::resample::resample;
use super::robots;
use super::rotations;
use super::sensors;
use super::{BindingFile, Normals, Template, Threshold};
use crate::base::channels::Shape;
use crate::base::error::InputError;
use crate::base::hands::Side;
use crate::base::log_channel::LogChannel;
use crate::base::nearest::nearest;
use crate::base::recording::{Column, Recording};
use crate::base::scene::{Role, Scene};
use crate::base::units::{Dimension, compound};
use crate::stream::clean::spikes;
use crate::stream::clean::stuck_sensors;
use crate::stream::inspect;
use crate::stream::names;
use crate::stream::read::csv::{self, Clock, Read};
use crate::stream::read::table::{Source, Table, Want};
use indexmap::IndexMap;
use std::f64::consts::PI;

/// One canonical column and what it is made of.
struct Bound {
    name: String,
    dimension: Dimension,
    /// Flags are joined, numbers added.
    flag: bool,
    terms: Vec<Term>,
}

/// A column of the table, times a factor that makes it SI and turns its sign; without a column the factor is the value.
struct Term {
    column: Option<usize>,
    factor: f64,
    threshold: Option<Threshold>,
}

impl Term {
    /// Whether an angle is taken for radians, be it as one of several that are averaged.
    fn is_of_radians(&self) -> bool {
        self.column.is_none() || self.factor.abs() > 2.0 * (PI / 180.0)
    }

    fn value(&self, number: f64) -> f64 {
        let value = number * self.factor;
        self.threshold.map_or(value, |threshold| threshold.flag(value))
    }
}

/// Makes a recording of a table as the binding says; `scene` is the one that counts.
///
/// # Errors
/// When the binding names what the table lacks, or the table cannot be read.
pub fn bind(source: Source, file: &BindingFile, scene: Scene) -> Result<Read, InputError> {
    let binding = &file.binding;
    let sheets = source.sheets.len() > 1;
    let place = source.file.clone();
    let canonical = || source.header().iter().any(|title| names::meaning(names::split_unit(title).0).is_some());
    if binding.channels.is_empty() && (sheets || !canonical()) {
        let message = "no channel is bound, and no column of the log has a canonical name";
        return Err(file
            .error("channels", message.into())
            .help("`teachtree inspect LOG --skeleton B.yaml` writes a binding to fill in"));
    }
    let (mut read, merged) = if binding.channels.is_empty() {
        let clock = match binding.rate {
            Some(rate) => Clock::Rate(rate),
            None => Clock::Column(binding.time.name.fill(Filling::default()), binding.time.unit.clone()),
        };
        (csv::columns(source, &clock)?, 1)
    } else {
        foreign(source, file, &scene)?
    };
    read.recording.scene = scene;
    for stamp in read.recording.time.iter_mut().chain(&mut read.row_time) {
        *stamp += binding.time_offset.0;
    }
    // Before anything is computed from their neighbours.
    read.issues.extend(spikes::reject(&mut read.recording));
    let shifted = sensors::shift(&mut read.recording, file)?;
    match binding.resample {
        Some(rate) => {
            let log = read.recording;
            read.recording = resample(log, rate.0, binding.bridge.0)?;
            if merged > 1 || shifted {
                trim(&mut read.recording, binding.bridge.0);
            }
        }
        None if merged > 1 => {
            let message = format!("the bound columns are of {merged} sheets with stamps of their own");
            return Err(
                InputError::new(place, message).help("say the common rate in the binding, such as `resample: 100 Hz`")
            );
        }
        None if shifted => {
            let message = "a sensor with a time offset has stamps between the others".into();
            return Err(file.error("sensors", message).help("say the common rate, such as `resample: 100 Hz`"));
        }
        None => {}
    }
    read.issues.extend(stuck_sensors::silence_uncorrected(&mut read.recording, &binding.trust));
    read.issues.extend(sensors::correct(&mut read.recording, file)?);
    read.issues.extend(places::learn(&mut read.recording, file)?);
    add_normals(&mut read.recording, file);
    Ok(read)
}

/// Adds the normals of contacts as the binding says.
pub fn add_normals(recording: &mut Recording, file: &BindingFile) {
    if file.binding.normals == Normals::ByRole {
        normals_by_role(recording);
    }
}

/// Cuts off the ends at which some sensor is silent still or already, up to `bridge`, s: sensors do not start and stop as one.
fn trim(recording: &mut Recording, bridge: f64) {
    let Some((start, end)) = recording.time.first().copied().zip(recording.time.last().copied()) else { return };
    let (mut from, mut to) = (0, recording.time.len());
    for Column { values, .. } in recording.columns.values() {
        let at = |row: usize| recording.time.get(row).copied().unwrap_or_default();
        if let Some(row) = values.iter().position(|value| !value.is_nan())
            && at(row) - start <= bridge
        {
            from = from.max(row);
        }
        if let Some(row) = values.iter().rposition(|value| !value.is_nan())
            && end - at(row) <= bridge
        {
            to = to.min(row + 1);
        }
    }
    if to.saturating_sub(from) < 2 {
        return;
    }
    let values = recording.columns.values_mut().map(|column| &mut column.values);
    for values in values.chain([&mut recording.time]) {
        values.truncate(to);
        values.drain(..from);
    }
    for texts in recording.labels.values_mut() {
        texts.truncate(to);
        texts.drain(..from);
    }
}

/// The bound columns, and from how many sheets they are.
fn foreign(source: Source, file: &BindingFile, scene: &Scene) -> Result<(Read, usize), InputError> {
    let bound = BoundColumns::of(&Header::new(&source), file, scene)?;
    let table = source.read(&bound.wants, file.binding.rate.map(|rate| rate.0))?;
    let sheets = table.sheets;
    Ok((bound.apply(table, file)?, sheets))
}

/// Which columns of a table become which channels.
pub struct BoundColumns {
    bound: Vec<Bound>,
    /// The column of each label.
    labels: IndexMap<String, usize>,
    /// What is wanted of each column of the table.
    pub wants: Vec<Want>,
    /// The rotations whose angles are taken for radians.
    in_radians: Vec<String>,
}

impl BoundColumns {
    /// Looks up the columns that the binding names.
    ///
    /// # Errors
    /// When the table lacks one, or one has another form than its channel.
    pub fn of(header: &Header, file: &BindingFile, scene: &Scene) -> Result<Self, InputError> {
        let times = if file.binding.rate.is_some() { vec![] } else { header.times(file)? };
        let mut bound = Self::of_stamped(header, file, scene)?;
        for time in times {
            if let Some(want) = time.column.and_then(|column| bound.wants.get_mut(column)) {
                *want = Want::Time(time.factor);
            }
        }
        Ok(bound)
    }

    /// The same of rows whose stamps are known.
    ///
    /// # Errors
    /// As [`of`](Self::of).
    pub fn of_stamped(header: &Header, file: &BindingFile, scene: &Scene) -> Result<Self, InputError> {
        let objects: Vec<&str> =
            scene.bodies.iter().filter(|(_, body)| body.role == Role::Object).map(|(name, _)| name.as_str()).collect();
        let mut wants = vec![Want::Nothing; header.titles.len()];
        let mut bound: Vec<Bound> = vec![];
        let mut labels: IndexMap<String, usize> = IndexMap::new();
        for (key, columns) in &file.binding.channels {
            let wrong = |message: String| file.error(key, message);
            if names::is_label(key) {
                let (patterns, _) = columns.component(0);
                let name = patterns.first().map(|pattern| pattern.name.fill(Filling::default())).unwrap_or_default();
                labels.insert(key.clone(), header.find(&name).ok_or_else(|| wrong(header.lacks(&name)))?);
            } else if !matches!(columns, Columns::Offset(_) | Columns::Link(_) | Columns::Span(_)) {
                bound.extend(header.channel(key, columns, &objects).map_err(wrong)?);
            }
        }
        for (robot, tree) in file.robots() {
            for (joint, columns) in file.binding.robots.get(robot).iter().flat_map(|told| &told.joints) {
                let name = robots::joint_column(robot, joint);
                let column = header.joint(name, columns, robots::dimension(tree, joint));
                let place = || file.place(&["robots", robot, "joints", joint]);
                bound.push(column.map_err(|message| InputError::new(place(), message))?);
            }
        }
        for column in bound.iter().flat_map(|bound| &bound.terms).filter_map(|term| term.column) {
            if let Some(want) = wants.get_mut(column) {
                *want = Want::Number(1.0);
            }
        }
        for (key, column) in &labels {
            match wants.get_mut(*column) {
                Some(want) if *want == Want::Nothing => *want = Want::Text,
                _ => return Err(file.error(key, "its column is bound as numbers too".into())),
            }
        }
        let in_radians = bound
            .iter()
            .filter(|bound| bound.dimension == Dimension::ANGLE && bound.terms.iter().all(Term::is_of_radians))
            .filter_map(|bound| bound.name.strip_suffix(".yaw").map(str::to_string))
            .collect();
        Ok(Self { bound, labels, wants, in_radians })
    }

    /// The channels of rows.
    ///
    /// # Errors
    /// When two columns are bound to one channel, or the frame of a point is not bound.
    pub fn apply(&self, table: Table, file: &BindingFile) -> Result<Read, InputError> {
        let Table { time, numbers, mut texts, mut issues, row_time, .. } = table;
        let mut recording = Recording { time, ..Recording::default() };
        for bound in &self.bound {
            let values = bound.values(&numbers, recording.time.len());
            if recording.columns.insert(bound.name.clone(), Column { dimension: bound.dimension, values }).is_some() {
                return Err(file.error("channels", format!("`{}` is bound twice", bound.name)));
            }
        }
        issues.extend(self.in_radians.iter().filter_map(|channel| rotations::beyond_a_turn(&recording, channel)));
        rotations::to_quaternions(&mut recording);
        issues.extend(robots::place(&mut recording, file)?);
        for (key, columns) in &file.binding.channels {
            if let Columns::Offset(offset) = columns {
                offsets::place(&mut recording, file, key, offset)?;
            }
        }
        for (key, columns) in &file.binding.channels {
            if let Columns::Span(span) = columns {
                robots::measure(&mut recording, file, key, span)?;
            }
        }
        for (name, column) in &self.labels {
            recording.labels.insert(name.clone(), texts.get_mut(*column).map(std::mem::take).unwrap_or_default());
        }
        Ok(Read { recording, issues, row_time })
    }
}

impl Bound {
    fn values(&self, numbers: &[Vec<f64>], rows: usize) -> Vec<f64> {
        let mut values: Vec<f64> = vec![0.0; rows];
        for term in &self.terms {
            let Some(column) = term.column else {
                values.iter_mut().for_each(|value| *value += term.factor);
                continue;
            };
            for (value, number) in values.iter_mut().zip(numbers.get(column).into_iter().flatten()) {
                let number = term.value(*number);
                // A flag that was not measured makes the whole unmeasured, whichever way it is joined.
                *value = if self.flag && !number.is_nan() && !value.is_nan() {
                    f64::max(*value, f64::from(u8::from(number > 0.5)))
                } else {
                    *value + number
                };
            }
        }
        values
    }
}

/// The header of a foreign table: names, and units where they are given as ours are.
pub struct Header {
    titles: Vec<String>,
    /// Where a name is.
    columns: IndexMap<String, usize>,
    /// The unit of each column, where the header says one.
    units: Vec<Option<String>>,
    /// The names of the sheets.
    sheets: Vec<String>,
    /// Sheets that cannot be read, with the reason.
    refused: Vec<(String, String)>,
}

impl Header {
    fn new(source: &Source) -> Self {
        let sheets = source.sheets.iter().map(|sheet| sheet.name.clone()).collect();
        Self::of(source.header(), sheets, source.refused.clone())
    }

    /// The full names of all columns, the names of the sheets, and sheets that cannot be read with the reason.
    pub fn of(titles: Vec<String>, sheets: Vec<String>, refused: Vec<(String, String)>) -> Self {
        let mut columns = IndexMap::new();
        let mut units = vec![];
        for (index, title) in titles.iter().enumerate() {
            let (name, unit) = names::split_known_unit(title);
            columns.entry(name.to_string()).or_insert(index);
            units.push(unit.map(str::to_string));
        }
        Self { titles, columns, units, sheets, refused }
    }

    /// The columns of time: the one of this name, else the one of each sheet.
    fn times(&self, file: &BindingFile) -> Result<Vec<Term>, InputError> {
        let pattern = &file.binding.time;
        let name = pattern.name.fill(Filling::default());
        let alone = std::iter::once(name.clone());
        let of_sheets = self.sheets.iter().filter(|sheet| !sheet.is_empty()).map(|sheet| format!("{sheet}.{name}"));
        let mut times = vec![];
        for name in alone.chain(of_sheets) {
            let pattern = Pattern { name: Template::text(&name), ..pattern.clone() };
            let term = self.term(&pattern, Filling::default(), Dimension::TIME);
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
            None => Err(file.error("time", self.lacks(&name))),
        }
    }

    fn find(&self, name: &str) -> Option<usize> {
        self.columns.get(name).copied().or_else(|| self.titles.iter().position(|title| title == name))
    }

    fn lacks(&self, name: &str) -> String {
        let of_sheet =
            |sheet: &str| name.strip_prefix(sheet).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']));
        if let Some((sheet, why)) = self.refused.iter().find(|(sheet, _)| of_sheet(sheet)) {
            return format!("`{sheet}` cannot be read: {why}");
        }
        match nearest(name, self.columns.keys().map(String::as_str)) {
            Some(near) => format!("the log has no column `{name}`; did you mean `{near}`?"),
            None if self.sheets.len() > 1 => {
                let parts: Vec<String> = self.sheets.iter().map(|sheet| format!("`{sheet}`")).collect();
                format!("the log has no column `{name}`; its parts are {}", parts.join(", "))
            }
            None => format!("the log has no column `{name}`"),
        }
    }

    /// The column that a filled pattern names, if the log has it.
    fn term(&self, pattern: &Pattern, filling: Filling, dimension: Dimension) -> Result<Option<Term>, String> {
        let name = pattern.name.fill(filling);
        if let Some((value, found)) = pattern.constant {
            return match found == dimension {
                true => Ok(Some(Term { column: None, factor: value, threshold: None })),
                false => Err(format!("`{}` is {found}, expected {dimension}", name.trim())),
            };
        }
        let Some(column) = self.find(&name) else { return Ok(None) };
        let dimension = pattern.threshold.map_or(dimension, |threshold| threshold.dimension);
        let of_header = self.units.get(column).and_then(Option::as_deref);
        let to_si = match (pattern.unit.as_deref(), of_header) {
            (Some(said), Some(header)) if said != header => {
                return Err(format!("`{name}` is in `{header}` as the header says, not in `{said}`"));
            }
            (Some(unit), _) | (None, Some(unit)) => {
                let (to_si, found) = compound(unit)
                    .map_err(|part| format!("`{part}` is not a known unit, expected one of {dimension}"))?;
                if found != dimension {
                    return Err(format!("`{unit}` is {found}, expected {dimension}"));
                }
                to_si
            }
            // A number in metres where millimetres are expected makes a flag that never changes, without any message.
            (None, None) if pattern.threshold.is_some() && dimension != Dimension::NONE => {
                return Err(format!(
                    "the column `{name}` has no unit to compare with the limit's, expected `{name} [unit]`"
                ));
            }
            (None, None) => 1.0,
        };
        Ok(Some(Term { column: Some(column), factor: to_si * pattern.sign, threshold: pattern.threshold }))
    }

    /// The column of a joint.
    fn joint(&self, name: String, columns: &Columns, dimension: Dimension) -> Result<Bound, String> {
        let (patterns, weight) = match columns {
            Columns::Pattern(_) | Columns::Mean(_) => columns.component(0),
            _ => return Err("expected a column, or `{mean: [...]}`".into()),
        };
        let mut terms = vec![];
        for pattern in patterns {
            if pattern.threshold.is_some() || pattern.optional {
                return Err("a joint has neither a threshold nor a `?`".into());
            }
            let term = self.term(pattern, Filling::default(), dimension)?;
            let term = term.ok_or_else(|| self.lacks(&pattern.name.fill(Filling::default())))?;
            terms.push(Term { factor: weight * term.factor, ..term });
        }
        Ok(Bound { name, dimension, flag: false, terms })
    }

    /// The canonical columns of one key of `channels`.
    fn channel(&self, key: &str, columns: &Columns, objects: &[&str]) -> Result<Vec<Bound>, String> {
        let name = Template::parse(key)?;
        let mut bound = vec![];
        let mut missing = None;
        for filling in fillings(&name, objects) {
            let channel = name.fill(filling);
            let (form, dimension) = form_of(&channel, columns)?;
            let flag = is_flag(&channel);
            if !flag && columns.patterns().iter().any(|pattern| pattern.threshold.is_some()) {
                return Err(format!("`{channel}` is no flag, only flags have a threshold"));
            }
            // An object that stands on the right only: its columns are joined.
            let joined: Vec<Filling> =
                match (columns.patterns().iter().any(|pattern| pattern.name.has_object()), name.has_object()) {
                    (true, false) => objects.iter().map(|object| Filling { object, ..filling }).collect(),
                    _ => vec![filling],
                };
            let mut parts: Vec<Bound> = vec![];
            for (component, letter) in form.components().iter().enumerate() {
                let (patterns, weight) = columns.component(component);
                let full = if letter.is_empty() { channel.clone() } else { format!("{channel}.{letter}") };
                let mut part = Bound { name: full, dimension, flag, terms: vec![] };
                for (filling, pattern) in joined.iter().flat_map(|it| patterns.iter().map(move |pattern| (it, pattern)))
                {
                    let filling = Filling { component, ..*filling };
                    match self.term(pattern, filling, dimension)? {
                        Some(term) => part.terms.push(Term { factor: weight * term.factor, ..term }),
                        None => missing = missing.or_else(|| Some(pattern.name.fill(filling))),
                    }
                }
                // Of a mean, all or none.
                if patterns.len() > 1 && !part.terms.is_empty() && part.terms.len() < joined.len() * patterns.len() {
                    return Err(missing.map_or_else(String::new, |name| self.lacks(&name)));
                }
                parts.push(part);
            }
            let widths: Vec<usize> = parts.iter().map(|part| part.terms.len()).collect();
            match (widths.iter().min(), widths.iter().max()) {
                // No column for this object: other objects may have one.
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

/// What the placeholders of a name can stand for.
fn fillings<'a>(name: &Template, objects: &[&'a str]) -> Vec<Filling<'a>> {
    match (name.has_object(), name.has_other()) {
        (false, _) => vec![Filling::default()],
        (true, false) => objects.iter().map(|object| Filling { object, ..Filling::default() }).collect(),
        (true, true) => {
            let pairs = objects.iter().flat_map(|object| objects.iter().map(move |other| (object, other)));
            pairs
                .filter(|(object, other)| object != other)
                .map(|(object, other)| Filling { object, other, component: 0 })
                .collect()
        }
    }
}

/// Whether a channel is 0 or 1.
fn is_flag(channel: &str) -> bool {
    LogChannel::parse(channel).is_some_and(|channel| channel.shape() == Shape::Bool)
}

/// What the columns of a channel make, and their dimension: from its name, else from its columns.
fn form_of(channel: &str, columns: &Columns) -> Result<(Form, Dimension), String> {
    let (wanted, dimension) = match LogChannel::parse(channel) {
        Some(channel) => (Some(channel.shape()), channel.dimension()),
        None => {
            let (side, rest) = channel.split_once('.').unwrap_or((channel, ""));
            if Side::from_name(side).is_none() || rest.is_empty() {
                return Err(format!(
                    "`{channel}` is no channel, expected a name such as `right.thumb.force`, `<object>.position`, `contact.<object>.table.force`"
                ));
            }
            let unit = columns.patterns().first().and_then(|pattern| pattern.unit.as_deref()).unwrap_or_default();
            let (_, dimension) = compound(unit).map_err(|part| format!("`{part}` is not a known unit"))?;
            (None, dimension)
        }
    };
    let form = columns.form(wanted);
    let (found, wanted) =
        (form.shape().components().len(), wanted.map_or(form.shape(), |shape| shape).components().len());
    match form {
        Form::Vector if wanted == 4 => {
            Err(format!("`{channel}` has 4 components, found columns for 3; angles are `<rpy>`"))
        }
        _ if found != wanted => Err(format!("`{channel}` has {wanted} components, found columns for {found}")),
        Form::Angles => Ok((form, Dimension::ANGLE)),
        _ => Ok((form, dimension)),
    }
}
