//! Applying a binding: the columns of a foreign table in, a recording with canonical names out.

use super::adjust::{normals_by_role, tare};
use super::pattern::{Columns, Filling, Pattern};
use super::resample::resample;
use super::{BindingFile, Normals, Template};
use crate::base::channels::Shape;
use crate::base::error::InputError;
use crate::base::hands::Side;
use crate::base::recording::{Column, Recording};
use crate::base::scene::{Role, Scene};
use crate::base::units::{Dimension, compound};
use crate::stream::csv::{self, Read};
use crate::stream::names;
use crate::stream::table::{Source, Table, Want};
use indexmap::IndexMap;

/// One canonical column and what it is made of.
struct Bound {
    name: String,
    dimension: Dimension,
    /// Flags are joined, numbers added.
    flag: bool,
    terms: Vec<Term>,
}

/// A column of the table, times a factor that makes it SI and turns its sign.
struct Term {
    column: usize,
    factor: f64,
}

/// Makes a recording of a table as the binding says; `scene` is the one that counts.
///
/// # Errors
/// When the binding names what the table lacks, or the table cannot be read.
pub fn bind(source: Source, file: &BindingFile, scene: Scene) -> Result<Read, InputError> {
    let binding = &file.binding;
    let mut read = if binding.channels.is_empty() { csv::columns(source)? } else { foreign(source, file, &scene)? };
    read.recording.scene = scene;
    for stamp in read.recording.time.iter_mut().chain(&mut read.row_time) {
        *stamp += binding.time_offset.0;
    }
    tare(&mut read.recording, file)?;
    if binding.normals == Normals::ByRole {
        normals_by_role(&mut read.recording);
    }
    if let Some(rate) = binding.resample {
        let log = read.recording;
        read.recording = resample(log, rate.0, binding.bridge.0)?;
    }
    Ok(read)
}

fn foreign(source: Source, file: &BindingFile, scene: &Scene) -> Result<Read, InputError> {
    let header = Header::new(&source);
    let objects: Vec<&str> =
        scene.bodies.iter().filter(|(_, body)| body.role == Role::Object).map(|(name, _)| name.as_str()).collect();
    let mut wants = vec![Want::Nothing; header.titles.len()];
    let time = header
        .term(&file.binding.time, Filling::default(), Dimension::TIME)
        .map_err(|message| file.error("time", message))?;
    let time =
        time.ok_or_else(|| file.error("time", header.lacks(&file.binding.time.name.fill(Filling::default()))))?;
    let mut bound: Vec<Bound> = vec![];
    let mut labels: IndexMap<String, usize> = IndexMap::new();
    for (key, columns) in &file.binding.channels {
        let wrong = |message: String| file.error(key, message);
        if names::is_label(key) {
            let name = columns.component(0).map(|pattern| pattern.name.fill(Filling::default())).unwrap_or_default();
            labels.insert(key.clone(), header.find(&name).ok_or_else(|| wrong(header.lacks(&name)))?);
        } else {
            bound.extend(header.channel(key, columns, &objects).map_err(wrong)?);
        }
    }
    for term in bound.iter().flat_map(|bound| &bound.terms) {
        if let Some(want) = wants.get_mut(term.column) {
            *want = Want::Number(1.0);
        }
    }
    for (key, column) in &labels {
        match wants.get_mut(*column) {
            Some(want) if *want == Want::Nothing => *want = Want::Text,
            _ => return Err(file.error(key, "its column is bound as numbers too".into())),
        }
    }
    if let Some(want) = wants.get_mut(time.column) {
        *want = Want::Time(time.factor);
    }
    let Table { time, row_time, numbers, mut texts, issues } = source.read(&wants)?;
    let mut recording = Recording { time, ..Recording::default() };
    for bound in bound {
        let values = bound.values(&numbers, recording.time.len());
        if recording.columns.insert(bound.name.clone(), Column { dimension: bound.dimension, values }).is_some() {
            return Err(file.error("channels", format!("`{}` is bound twice", bound.name)));
        }
    }
    for (name, column) in labels {
        recording.labels.insert(name, texts.get_mut(column).map(std::mem::take).unwrap_or_default());
    }
    Ok(Read { recording, issues, row_time })
}

impl Bound {
    fn values(&self, numbers: &[Vec<f64>], rows: usize) -> Vec<f64> {
        let mut values: Vec<f64> = vec![0.0; rows];
        for term in &self.terms {
            for (value, number) in values.iter_mut().zip(numbers.get(term.column).into_iter().flatten()) {
                let number = number * term.factor;
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
struct Header {
    titles: Vec<String>,
    columns: IndexMap<String, (usize, Option<String>)>,
}

impl Header {
    fn new(source: &Source) -> Self {
        let mut columns = IndexMap::new();
        for (index, title) in source.header.iter().enumerate() {
            let (name, unit) = names::split_unit(title);
            // A bracket that holds no unit is part of the name: `state[3]`.
            let (name, unit) =
                if unit.is_some_and(|unit| compound(unit).is_ok()) { (name, unit) } else { (title.as_str(), None) };
            columns.entry(name.to_string()).or_insert((index, unit.map(str::to_string)));
        }
        Self { titles: source.header.clone(), columns }
    }

    fn find(&self, name: &str) -> Option<usize> {
        self.columns.get(name).map(|(index, _)| *index).or_else(|| self.titles.iter().position(|title| title == name))
    }

    fn lacks(&self, name: &str) -> String {
        match names::nearest(name, self.columns.keys().map(String::as_str)) {
            Some(near) => format!("the log has no column `{name}`; did you mean `{near}`?"),
            None => format!("the log has no column `{name}`"),
        }
    }

    /// The column that a filled pattern names, if the log has it.
    fn term(&self, pattern: &Pattern, filling: Filling, dimension: Dimension) -> Result<Option<Term>, String> {
        let name = pattern.name.fill(filling);
        let Some(column) = self.find(&name) else { return Ok(None) };
        let of_header = self.columns.get(&name).and_then(|(_, unit)| unit.as_deref());
        let to_si = match (pattern.unit.as_deref(), of_header) {
            (Some(said), Some(header)) if said != header => {
                return Err(format!("`{name}` is in `{header}` as the header says, not in `{said}`"));
            }
            (Some(unit), _) | (None, Some(unit)) => {
                let (to_si, found) = compound(unit)
                    .map_err(|part| format!("`{part}` is no unit that I know, wanted one of {dimension}"))?;
                if found != dimension {
                    return Err(format!("`{unit}` is {found}, wanted {dimension}"));
                }
                to_si
            }
            (None, None) => 1.0,
        };
        Ok(Some(Term { column, factor: to_si * pattern.sign }))
    }

    /// The canonical columns of one key of `channels`.
    fn channel(&self, key: &str, columns: &Columns, objects: &[&str]) -> Result<Vec<Bound>, String> {
        let name = Template::parse(key)?;
        let mut bound = vec![];
        let mut missing = None;
        for filling in fillings(&name, objects) {
            let channel = name.fill(filling);
            let (shape, dimension) = shape_of(&channel, columns)?;
            // An object that stands on the right only: its columns are joined.
            let joined: Vec<Filling> =
                match (columns.patterns().iter().any(|pattern| pattern.name.has_object()), name.has_object()) {
                    (true, false) => objects.iter().map(|object| Filling { object, ..filling }).collect(),
                    _ => vec![filling],
                };
            let mut parts: Vec<Bound> = vec![];
            for (component, letter) in shape.components().iter().enumerate() {
                let pattern = columns.component(component).ok_or("a component has no column")?;
                let full = if letter.is_empty() { channel.clone() } else { format!("{channel}.{letter}") };
                let mut part = Bound { name: full, dimension, flag: shape == Shape::Bool, terms: vec![] };
                for filling in &joined {
                    let filling = Filling { component, ..*filling };
                    match self.term(pattern, filling, dimension)? {
                        Some(term) => part.terms.push(term),
                        None => missing = missing.or_else(|| Some(pattern.name.fill(filling))),
                    }
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
        if bound.is_empty() {
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

/// Shape and dimension of a channel: from its name, else from its columns.
fn shape_of(channel: &str, columns: &Columns) -> Result<(Shape, Dimension), String> {
    let (shape, dimension) = match names::channel(channel) {
        Some((shape, dimension, _)) => (shape, dimension),
        None => {
            let (side, rest) = channel.split_once('.').unwrap_or((channel, ""));
            if Side::from_name(side).is_none() || rest.is_empty() {
                return Err(format!(
                    "`{channel}` is no channel, wanted a name such as `right.thumb.force`, `<object>.position`, `contact.<object>.table.force`"
                ));
            }
            let unit = columns.patterns().first().and_then(|pattern| pattern.unit.as_deref()).unwrap_or_default();
            let (_, dimension) = compound(unit).map_err(|part| format!("`{part}` is no unit that I know"))?;
            (columns.shape(), dimension)
        }
    };
    let found = columns.shape();
    let whole = shape.components().len() == found.components().len();
    if whole {
        Ok((shape, dimension))
    } else {
        Err(format!(
            "`{channel}` has {} components, found columns for {}",
            shape.components().len(),
            found.components().len()
        ))
    }
}
