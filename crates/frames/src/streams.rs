//! Numbers of a bag at one rate: columns of topics, interpolated between their messages. Rotations are interpolated as such.

use crate::raw_log::{RawLog, RawTable};
use teachtree_base::error::InputError;
use teachtree_base::spelling::nearest;

/// Numbers between messages that are farther apart are not known, s.
pub const FARTHEST_S: f64 = 0.5;
/// The fewest messages of a topic that measures.
const FEWEST: usize = 10;
/// Words before `x`, `y`, `z` and `w` in names of columns that are a place, and of those that are a rotation.
const PLACES: [&str; 2] = ["position", "translation"];
const ROTATIONS: [&str; 2] = ["orientation", "rotation"];
/// What a message of joints calls their angles.
const JOINTS: &str = "position";

/// A column of a topic.
#[derive(Clone, Debug, PartialEq)]
pub struct Stream {
    /// The topic and the column.
    pub name: String,
    time_s: Vec<f64>,
    values: Vec<f64>,
}

impl Stream {
    fn new(table: &RawTable, column: &str, values: &[f64]) -> Self {
        let measured = table.stamps_s.iter().copied().zip(values.iter().copied()).filter(|(_, value)| !value.is_nan());
        let mut samples: Vec<(f64, f64)> = measured.collect();
        samples.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let (time_s, values) = samples.into_iter().unzip();
        Self { name: table.title(column), time_s, values }
    }

    /// The first and the last stamp, s.
    pub fn span(&self) -> Option<[f64; 2]> {
        self.time_s.first().zip(self.time_s.last()).map(|(first, last)| [*first, *last])
    }

    /// The number at a time; `None` where none is known.
    fn at(&self, time_s: f64) -> Option<f64> {
        let after = self.time_s.partition_point(|stamp| *stamp < time_s);
        let sample = |at: usize| Some((*self.time_s.get(at)?, *self.values.get(at)?));
        let (to, next) = sample(after)?;
        if to <= time_s {
            return Some(next);
        }
        let (from, last) = sample(after.checked_sub(1)?)?;
        (to - from <= FARTHEST_S).then(|| last + (next - last) * (time_s - from) / (to - from))
    }
}

/// Columns that are read together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Streams {
    all: Vec<Stream>,
    /// The places of the parts of each rotation.
    rotations: Vec<[usize; 4]>,
}

impl Streams {
    /// The columns that begin with one of these texts, in the order of the bag: `/joint_states` for all of a topic, `/joint_states.position` for some.
    ///
    /// # Errors
    /// No column begins with one of them.
    pub fn chosen(log: &RawLog, option: &str, wanted: &[String]) -> Result<Self, InputError> {
        let begins = |title: &str, wanted: &String| {
            title.strip_prefix(wanted.as_str()).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        };
        let titles: Vec<String> =
            log.tables.iter().flat_map(|table| table.columns.iter().map(|(name, _)| table.title(name))).collect();
        if let Some(unknown) = wanted.iter().find(|wanted| !titles.iter().any(|title| begins(title, wanted))) {
            let error = InputError::new(option, format!("no column of numbers begins with `{unknown}`"));
            return Err(match nearest(unknown, titles.iter().map(String::as_str)) {
                Some(near) => error.help(format!("did you mean `{near}`? `teachtree inspect` lists the columns")),
                None => error.help("`teachtree inspect` lists the columns"),
            });
        }
        Ok(Self::of(log, &|table, name| wanted.iter().any(|wanted| begins(&table.title(name), wanted))))
    }

    /// The columns of positions: joints and poses, without constant columns and those of a few messages.
    pub fn places(log: &RawLog, except: &Self) -> Self {
        let is_place = |table: &RawTable, name: &str| {
            let parts: Vec<&str> = name.split('.').collect();
            let is_axis = |axes: &[&str]| parts.last().is_some_and(|last| axes.contains(last));
            let before = parts.len().checked_sub(2).and_then(|at| parts.get(at)).copied().unwrap_or_default();
            let is_pose = PLACES.contains(&before) && is_axis(&["x", "y", "z"])
                || ROTATIONS.contains(&before) && is_axis(&["x", "y", "z", "w"]);
            // An element that has a name has it in another column.
            let has_names = || table.columns.iter().any(|(other, _)| other.starts_with(&format!("{JOINTS}.")));
            let is_joint = match name.strip_prefix(JOINTS) {
                Some(rest) if rest.starts_with('.') => parts.len() == 2,
                Some(rest) => rest.starts_with('[') && !has_names(),
                None => false,
            };
            table.stamps_s.len() >= FEWEST && (is_pose || is_joint) && !name.contains("covariance")
        };
        let is_other = |title: &str| except.all.iter().any(|stream| stream.name == title);
        let mut places = Self::of(log, &|table, name| is_place(table, name) && !is_other(&table.title(name)));
        places.all.retain(|stream| stream.values.len() >= FEWEST);
        places.find_rotations();
        places
    }

    fn of(log: &RawLog, is_wanted: &dyn Fn(&RawTable, &str) -> bool) -> Self {
        let columns = log.tables.iter().flat_map(|table| table.columns.iter().map(move |column| (table, column)));
        let wanted = columns.filter(|(table, (name, _))| is_wanted(table, name));
        let all = wanted.map(|(table, (name, values))| Stream::new(table, name, values)).collect();
        let mut streams = Self { all, rotations: Vec::new() };
        streams.find_rotations();
        streams
    }

    /// Finds the parts of rotations, and gives equal rotations equal signs.
    fn find_rotations(&mut self) {
        let place = |name: String| self.all.iter().position(|stream| stream.name == name);
        let parts = |stream: &Stream| -> Option<[usize; 4]> {
            let of = stream.name.strip_suffix(".w")?;
            let is_rotation = ROTATIONS.iter().any(|word| of.ends_with(&format!(".{word}")) || of == *word);
            let [w, x, y, z] = ["w", "x", "y", "z"].map(|part| place(format!("{of}.{part}")));
            is_rotation.then_some([w?, x?, y?, z?])
        };
        self.rotations = self.all.iter().filter_map(parts).collect();
        for parts in &self.rotations {
            let count = parts.iter().filter_map(|at| self.all.get(*at)).map(|stream| stream.values.len()).min();
            for row in 1..count.unwrap_or(0) {
                let value = |at: &usize, row: usize| self.all.get(*at).and_then(|it| it.values.get(row)).copied();
                let product: f64 = parts.iter().filter_map(|at| Some(value(at, row)? * value(at, row - 1)?)).sum();
                if product < 0.0 {
                    for at in parts {
                        let slot = self.all.get_mut(*at).and_then(|it| it.values.get_mut(row));
                        slot.into_iter().for_each(|value| *value = -*value);
                    }
                }
            }
        }
    }

    /// Whether it is empty.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// The names of the columns.
    pub fn names(&self) -> Vec<String> {
        self.all.iter().map(|stream| stream.name.trim_start_matches('/').to_string()).collect()
    }

    /// The columns.
    pub fn iter(&self) -> impl Iterator<Item = &Stream> {
        self.all.iter()
    }

    /// The numbers at a time.
    ///
    /// # Errors
    /// The name of the first column without a number there.
    pub fn at(&self, time_s: f64) -> Result<Vec<f64>, &str> {
        let number = |stream: &'_ Stream| stream.at(time_s);
        let mut row = Vec::with_capacity(self.all.len());
        for stream in &self.all {
            row.push(number(stream).ok_or(stream.name.as_str())?);
        }
        for parts in &self.rotations {
            let length = parts.iter().filter_map(|at| row.get(*at)).map(|part| part * part).sum::<f64>().sqrt();
            if length > 0.0 {
                parts.iter().for_each(|at| row.get_mut(*at).into_iter().for_each(|part| *part /= length));
            }
        }
        Ok(row)
    }
}
