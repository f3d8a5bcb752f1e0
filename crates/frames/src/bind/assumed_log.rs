//! A log with each column that a binding names, and without rows: faults that are found in it occur in every log.

use super::apply::{BoundColumns, unshared_stamps};
use super::header::{Header, fillings};
use super::pattern::{PlaceholderValues, Template};
use super::{BindingFile, fixture_localization, sensors, tare};
use indexmap::IndexSet;
use teachtree_base::error::InputError;
use teachtree_base::recording::Recording;
use teachtree_base::scene::{Body, Role, Scene};
use teachtree_base::yaml;
use teachtree_logs::names;
use teachtree_logs::read::table::Table;

/// The most components that a channel has: those of a rotation matrix.
const COMPONENTS: usize = 9;
/// A body with a known role and no known shape.
const BODY: &str = "role: object";
/// The name of a body that stands for `<object>` where no scene is known.
const OBJECT: &str = "object";

impl BindingFile {
    /// A scene with each body that the binding mentions, for a binding that has none.
    ///
    /// # Errors
    /// When a body with nothing but a role cannot be read.
    pub fn mentioned_bodies(&self) -> Result<Scene, InputError> {
        let object: Body = yaml::read(BODY, "the scene")?;
        let placeholders = PlaceholderValues { object: OBJECT, other: OBJECT, component: 0 };
        let mut bodies = IndexSet::from([OBJECT.to_string()]);
        for channel in
            self.binding.channels.keys().filter_map(|key| Some(Template::parse(key).ok()?.fill(placeholders)))
        {
            let column = [channel.clone(), format!("{channel}.x"), format!("{channel}.w")];
            let meaning = column.iter().find_map(|column| names::meaning(column));
            bodies.extend(meaning.into_iter().flat_map(|it| it.bodies).flatten().map(str::to_string));
        }
        for (name, place) in &self.binding.places {
            bodies.extend([name.clone(), place.by.clone()]);
        }
        Ok(Scene { bodies: bodies.into_iter().map(|body| (body, object.clone())).collect(), ..Scene::default() })
    }

    /// The names of all columns of channels and joints that the binding names.
    ///
    /// # Errors
    /// As [`mentioned_bodies`](Self::mentioned_bodies), which stand for placeholders where the binding has no scene.
    pub fn named_columns(&self) -> Result<Vec<String>, InputError> {
        let scene = self.binding.scene.clone().map_or_else(|| self.mentioned_bodies(), Ok)?;
        Ok(columns(self, &scene))
    }
}

/// The recording of that log; `scene` is the one that counts.
///
/// # Errors
/// What every log is refused for.
pub fn recording(file: &BindingFile, scene: Scene) -> Result<Recording, InputError> {
    let mut recording = Recording::default();
    if !file.binding.channels.is_empty() {
        let header = Header::assumed(columns(file, &scene));
        let bound = BoundColumns::of_stamped(&header, file, &scene)?;
        let empty = || vec![vec![]; header.titles.len()];
        let texts = vec![vec![]; header.titles.len()];
        recording = bound.apply(Table { numbers: empty(), texts, sheets: 1, ..Table::default() }, file)?.recording;
    }
    recording.scene = scene;
    recording.spelling.add(file.spelling());
    if file.binding.channels.is_empty() {
        return Ok(recording);
    }
    if sensors::shift(&mut recording, file)? && file.binding.resample.is_none() {
        return Err(unshared_stamps(file));
    }
    sensors::check(&recording, file)?;
    tare::check(&recording, file)?;
    fixture_localization::check(&recording, file)?;
    Ok(recording)
}

/// The names of all columns that the binding names.
fn columns(file: &BindingFile, scene: &Scene) -> Vec<String> {
    let objects: Vec<&str> =
        scene.bodies.iter().filter(|(_, body)| body.role == Role::Object).map(|(name, _)| name.as_str()).collect();
    let mut names = IndexSet::new();
    for (key, columns) in &file.binding.channels {
        let Ok(channel) = Template::parse(key) else { continue };
        // A channel that is also bound by its own name has no column under the placeholder.
        let is_own = |filling: &PlaceholderValues| {
            !channel.has_object() || !file.binding.channels.contains_key(&channel.fill(*filling))
        };
        let placeholders: Vec<PlaceholderValues> = match channel.has_object() {
            true => fillings(&channel, &objects).into_iter().filter(is_own).collect(),
            false => {
                objects.iter().map(|object| PlaceholderValues { object, ..PlaceholderValues::default() }).collect()
            }
        };
        for filling in placeholders.into_iter().chain((!channel.has_object()).then(PlaceholderValues::default)) {
            let patterns = columns.patterns().iter();
            names.extend(patterns.flat_map(|pattern| {
                (0..COMPONENTS).map(move |component| {
                    let of = if names::is_label(key) { &pattern.title } else { &pattern.name };
                    of.fill(PlaceholderValues { component, ..filling })
                })
            }));
        }
    }
    for (_, _, columns) in file.joints() {
        names.extend(columns.patterns().iter().map(|pattern| pattern.name.fill(PlaceholderValues::default())));
    }
    names.into_iter().collect()
}
