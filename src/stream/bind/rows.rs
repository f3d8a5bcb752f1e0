//! A binding of a log that is being made: each row is bound by itself.
//!
//! What a binding learns from the whole log, or computes from the rows around a row, is refused: a row has to be bound when it comes.

use super::{BindingFile, ToolMass, bind};
use crate::base::error::InputError;
use crate::base::scene::Scene;
use crate::stream::issue::Issue;
use crate::stream::open::hand_file_of;
use crate::stream::read::sheet::{Cells, InMemoryTable};
use crate::stream::read::table::Source;
use indexmap::IndexSet;
use std::path::Path;

/// A binding that takes row by row.
pub struct RowBinder {
    file: BindingFile,
    scene: Scene,
    /// The columns that any row had so far, so that a row that lacks one of them is a row without its value.
    titles: IndexSet<String>,
    hand_file: Option<String>,
}

impl RowBinder {
    /// Reads a binding; `scene` replaces its own.
    ///
    /// # Errors
    /// What the binding says that no row alone can show, at `file:line:column`; a binding without a scene where none is given.
    pub fn open(path: &Path, scene: Option<Scene>) -> Result<Self, InputError> {
        let file = BindingFile::read(path)?;
        let binding = &file.binding;
        let whole = |key: &str, fix: &str| {
            Err(file.error(key, format!("`{key}` needs the whole log, and a live log is bound row by row")).help(fix))
        };
        if binding.rate.is_some() {
            return whole("rate", "send a stamp with each row, and name its column as `time`");
        }
        if binding.resample.is_some() {
            return whole("resample", "send rows at an even rate; `live` bridges short drop-outs by itself");
        }
        if binding.tare.is_some() {
            return whole("tare", "leave it out; `live` learns the bias of force sensors from the first seconds");
        }
        if !binding.places.is_empty() {
            return whole("places", "give the bodies their positions in the scene");
        }
        for (channel, sensor) in &binding.sensors {
            if sensor.time_offset.0 != 0.0 {
                return whole(channel, "correct the stamps where the rows are made");
            }
            if matches!(sensor.tool, Some(ToolMass::Learned(_))) {
                return whole(channel, "give the mass of the tool, such as `tool: 430 g`");
            }
        }
        let scene = scene.or_else(|| binding.scene.clone()).ok_or_else(|| {
            InputError::new(path.display().to_string(), "has no `scene`").help("name a scene with --scene")
        })?;
        file.check(&scene)?;
        let hand_file = binding.hand_file.clone().map(|name| hand_file_of(path, name));
        Ok(Self { file, scene, titles: IndexSet::new(), hand_file })
    }

    /// The bodies and hands.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The hand file that the binding names: beside it, or a shipped one.
    pub fn hand_file(&self) -> Option<&str> {
        self.hand_file.as_deref()
    }

    /// The params that the binding sets, each with its value and unit.
    pub fn params(&self) -> impl Iterator<Item = (&str, &str)> {
        self.file.binding.params.iter().map(|(name, value)| (name.as_str(), value.as_str()))
    }

    /// Binds the only row of a table: canonical names, SI, `time` in s.
    ///
    /// # Errors
    /// A column that the binding names and no row had so far; a value that is no number.
    pub fn bind(&mut self, row: &InMemoryTable) -> Result<(InMemoryTable, Vec<Issue>), InputError> {
        for title in row.columns().keys() {
            if !self.titles.contains(title) {
                self.titles.insert(title.clone());
            }
        }
        let mut whole = InMemoryTable::new(row.place.clone());
        whole.begin_row()?;
        for title in &self.titles {
            match row.columns().get(title) {
                Some(Cells::Texts(texts)) => whole.put_text(title, texts.first().map_or("", String::as_str))?,
                Some(cells) => {
                    let value = cells.numbers().and_then(|values| values.first()).copied();
                    whole.put(title, value.unwrap_or(f64::NAN))?
                }
                None => whole.put(title, f64::NAN)?,
            };
        }
        let source = Source::one(&row.place, whole.header(), Box::new(whole));
        let bound = bind(source, &self.file, self.scene.clone())?;
        let mut canonical = InMemoryTable::new(row.place.clone());
        canonical.begin_row()?;
        let first = |values: &[f64]| values.first().copied().unwrap_or(f64::NAN);
        canonical.put("time", first(&bound.recording.time))?;
        for (name, column) in &bound.recording.columns {
            canonical.put(name, first(&column.values))?;
        }
        Ok((canonical, bound.issues))
    }
}
