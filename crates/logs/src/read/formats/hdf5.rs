//! HDF5: the recordings of a file (`data/demo_0`, …), of which one is a log, with its data sets as columns.
//!
//! The layouts of robosuite, robomimic, MimicGen, Isaac Lab, LIBERO and ManiSkill have a group a recording; a file of ALOHA, ACT or EgoDex is one
//! recording. A data set is called by its path below the recording (`obs/robot0_eef_pos[0]`); those with another number of rows than most are a
//! sheet of their own (`rows_1102.user_info/0/zoom`). The dimensions of MATLAB's arrays are reversed (`matlab`). Shapes are checked before data are read, and
//! no data set is read that promises more than [`Budget`] allows for the bytes of the file.

pub mod annotate;
mod compound;
mod floats;
mod links;
mod matlab;
mod mujoco;
mod signature;

use super::array_attributes::ArrayAttributes;
use super::array_columns::width;
use super::array_log::{self, Array, ComputedColumns, MissingRows, Recording, rate, rows};
use super::budget::Budget;
use super::recordings::{MAX_RECORDINGS, choose, number_of};
use crate::allowed_folders::AllowedFolders;
use crate::read::file;
use crate::read::table::{MAX_COLUMNS, Source};
use ::hdf5_pure::{
    AttrValue, DType, Dataset, Datatype, Error, File, FormatError, Group, ReadSeekSource, VlenStringReadOptions,
};
use annotate::success;
use floats::{FloatForm, NumberReader};
use mujoco::Model;
use serde_json::Value;
pub(super) use signature::is_at_start_or_behind_block;
use std::collections::HashMap;
use std::path::Path;
use std::rc::Rc;
use teachtree_base::error::InputError;
use teachtree_base::guard::guarded;

/// Maximum nesting depth of groups.
const DEEPEST: usize = 12;

/// Opens a recording of a file, which must be in `folders`: `demo_3`, or `3`.
///
/// # Errors
/// If the file is not HDF5, is damaged, or is outside the folders, or if several recordings are in it and none is selected.
pub(super) fn open(path: &Path, recording: Option<&str>, folders: &AllowedFolders) -> Result<Source, InputError> {
    let name = path.display().to_string();
    guarded(&name, || {
        let container = Container::open(path, folders)?;
        let chosen = choose(&container.place, "file", &container.names, recording)?;
        container.source(chosen.and_then(|chosen| container.names.get(chosen)).map(String::as_str))
    })
}

/// Whether a file is HDF5 by its signature.
///
/// # Errors
/// When it cannot be read.
pub(super) fn is_hdf5(path: &Path) -> Result<bool, InputError> {
    let failed = |error: std::io::Error| InputError::unreadable(path.display().to_string(), &error);
    is_at_start_or_behind_block(&mut file::open(path)?).map_err(failed)
}

/// The recordings of a file, by number; none for a file that is one.
///
/// # Errors
/// When the file is damaged, or a link stands in the place of a recording: `hdf5_pure` passes over links.
pub(super) fn names(path: &Path, folders: &AllowedFolders) -> Result<Vec<String>, InputError> {
    guarded(&path.display().to_string(), || Ok(Container::open(path, folders)?.names))
}

/// A file, and which of its groups are recordings.
struct Container {
    place: String,
    file: File,
    /// The folders that the file must be in.
    folders: AllowedFolders,
    /// The path of the group that holds the recordings, with a slash after it.
    parent: &'static str,
    names: Vec<String>,
}

impl Container {
    fn open(path: &Path, folders: &AllowedFolders) -> Result<Self, InputError> {
        Self::read(path, folders).map_err(|error| links::explained(path, folders, error))
    }

    fn read(path: &Path, folders: &AllowedFolders) -> Result<Self, InputError> {
        let place = path.display().to_string();
        let failed = |error: Error| damaged(&place, &error);
        let source = ReadSeekSource::new(folders.open(path)?).map_err(|error| failed(error.into()))?;
        let file = File::from_source(source).map_err(failed)?;
        let root = file.root();
        let groups = root.groups().map_err(failed)?;
        let numbered = |groups: Vec<String>| -> Vec<String> {
            groups.into_iter().filter(|name| number_of(name).is_some()).collect()
        };
        let (mut parent, mut names) = ("", vec![]);
        let has_data = groups.iter().any(|name| name == "data");
        links::refuse_recordings(path, folders, if has_data { "data" } else { "" })?;
        if has_data {
            let data = file.group("data").map_err(failed)?;
            (parent, names) = ("data/", numbered(data.groups().map_err(failed)?));
        }
        if names.is_empty() {
            parent = "";
            // Beside arrays, groups with numbers are parts of one recording, such as cameras.
            names = if root.datasets().map_err(failed)?.is_empty() { numbered(groups) } else { vec![] };
        }
        if names.len() > MAX_RECORDINGS {
            return Err(InputError::new(
                place,
                format!("found more than {MAX_RECORDINGS} recordings, the most that are read"),
            ));
        }
        names.sort_by(|a, b| number_of(a).cmp(&number_of(b)).then_with(|| a.cmp(b)));
        Ok(Self { place, file, folders: folders.clone(), parent, names })
    }

    /// A recording as a log.
    fn source(&self, chosen: Option<&str>) -> Result<Source, InputError> {
        let place = chosen.map_or_else(|| self.place.clone(), |name| format!("{}#{name}", self.place));
        let failed = |error: Error| damaged(&place, &error);
        let group = match chosen {
            Some(name) => self.file.group(&format!("{}{name}", self.parent)).map_err(failed)?,
            None => self.file.root(),
        };
        let mut found = vec![];
        walk(&group, "", 0, &mut found).map_err(|error| match error {
            WalkError::Hdf5(error) => links::explained(Path::new(&self.place), &self.folders, failed(*error)),
            WalkError::Limit(message) => InputError::new(&place, message),
        })?;
        found.sort_by(|(a, _), (b, _)| a.cmp(b));
        let mut described = vec![group.attrs().map_err(failed)?, self.file.root().attrs().map_err(failed)?];
        if !self.parent.is_empty() {
            described.push(self.file.group("data").and_then(|data| data.attrs()).map_err(failed)?);
        }
        let described: Vec<RecordingAttributes> = described.iter().map(RecordingAttributes::new).collect();
        let mut budget = Budget::new(self.file.file_size());
        let arrays: Vec<Array> = found
            .into_iter()
            .map(|(name, dataset)| arrays(&place, name, dataset, &mut budget, self.file.file_size()))
            .collect::<Result<Vec<Vec<Array>>, _>>()?
            .into_iter()
            .flatten()
            .collect();
        let rows = rows(&arrays, described.first().and_then(|own| own.samples));
        let model = described.iter().find_map(|attrs| attrs.model.clone());
        let states = arrays.iter().find(|array| array.name == "states" && array.rows == rows);
        let states = states.and_then(|states| Some((states.width(), states.numbers()?)));
        let rate_hz = described.iter().find_map(|attrs| attrs.rate_hz);
        let most = budget.whole;
        let chosen = chosen.filter(|_| self.parent == success::PARENT);
        let success_fields =
            chosen.map(|name| success::known(self, name, rows)).transpose().map_err(failed)?.unwrap_or_default();
        let mut recording = Recording { place, arrays, rows, most, rate_hz, time: None, computed: None };
        if let Some((width, states)) = states
            && described.iter().any(|attrs| attrs.robosuite)
        {
            let states = states?;
            let stamps: Vec<f64> = states.chunks_exact(width.max(1)).filter_map(|row| row.first().copied()).collect();
            if stamps.is_sorted_by(|a, b| a < b) {
                recording.time = Some(stamps);
            }
            let model = model.and_then(|text| Model::read(&text, width));
            recording.computed = model.map(|model| Box::new(Motion { model, states }) as Box<dyn ComputedColumns>);
        }
        Ok(Source { success_fields, ..recording.source()? })
    }
}

/// The reason of a data set that has another filter.
const OTHER_FILTER: &str = "is compressed by a filter that is not read here, expected gzip, lzf, shuffle or scale-offset: `h5repack -f GZIP=4` of the HDF5 tools, with \
    the plugin of the filter, rewrites it";

/// Whether a data set needs a filter other than deflate, shuffle, Fletcher's checksum, scale-offset and LZF.
fn has_other_filter(dataset: &Dataset) -> bool {
    dataset.filters().iter().any(|filter| ![1, 2, 3, 6, 32_000].contains(filter))
}

/// Whether a data set has its checksum (filter 3) before another filter; the library expects it after all others.
fn has_early_check_sum(dataset: &Dataset) -> bool {
    let filters = dataset.filters();
    filters.iter().position(|filter| *filter == 3).is_some_and(|at| at + 1 < filters.len())
}

/// Why a walk over groups ended.
enum WalkError {
    Hdf5(Box<Error>),
    Limit(String),
}

impl From<Error> for WalkError {
    fn from(error: Error) -> Self {
        Self::Hdf5(Box::new(error))
    }
}

/// Finds the data sets of a group and of those in it, by path.
fn walk(group: &Group, prefix: &str, depth: usize, found: &mut Vec<(String, Dataset)>) -> Result<(), WalkError> {
    if depth > DEEPEST {
        return Err(WalkError::Limit(format!("found groups nested deeper than {DEEPEST}, the most that are read")));
    }
    for (name, dataset) in group.iter_datasets()? {
        found.push((format!("{prefix}{name}"), dataset));
    }
    if found.len() > MAX_COLUMNS {
        return Err(WalkError::Limit(format!("found more than {MAX_COLUMNS} data sets, the most that are read")));
    }
    for (name, inner) in group.iter_groups()?.filter(|(name, _)| !matlab::is_internal(name)) {
        walk(&inner, &format!("{prefix}{name}/"), depth + 1, found)?;
    }
    Ok(())
}

/// The metadata of a recording in its attributes.
#[derive(Default)]
struct RecordingAttributes {
    samples: Option<usize>,
    rate_hz: Option<f64>,
    /// Whether robosuite made it: its `states` begin with the time.
    robosuite: bool,
    /// The model of MuJoCo, XML.
    model: Option<String>,
}

impl RecordingAttributes {
    fn new(attrs: &HashMap<String, AttrValue>) -> Self {
        let text = |key: &str| attrs.get(key).and_then(AttrValue::as_str);
        let object = |key: &str| text(key).and_then(|text| serde_json::from_str(text).ok()).unwrap_or(Value::Null);
        Self {
            samples: attrs.get("num_samples").and_then(AttrValue::as_u64).and_then(|count| usize::try_from(count).ok()),
            rate_hz: rate(&|key| attribute(attrs, key)),
            robosuite: object("env_info").is_object()
                || object("env_args").get("type").and_then(Value::as_u64) == Some(1),
            model: text("model_file").filter(|text| text.trim_start().starts_with('<')).map(str::to_string),
        }
    }
}

/// An attribute as a text or a number; null if there is none.
fn attribute(attrs: &HashMap<String, AttrValue>, key: &str) -> Value {
    let Some(value) = attrs.get(key) else { return Value::Null };
    match (value.as_str(), value.as_f64(), value.as_i64()) {
        (Some(text), ..) => text.trim_end_matches('\0').into(),
        (_, Some(number), _) => number.into(),
        (.., number) => number.into(),
    }
}

/// A data set as arrays: one, or one for each of its fields.
fn arrays(
    place: &str,
    name: String,
    dataset: Dataset,
    budget: &mut Budget,
    file_size: u64,
) -> Result<Vec<Array>, InputError> {
    let failed = |error: Error| damaged(place, &error);
    let datatype = dataset.datatype().map_err(failed)?;
    if !matches!(datatype, Datatype::Compound { .. }) {
        return Ok(array(place, name, dataset, budget, file_size)?.into_iter().collect());
    }
    let shape: Vec<usize> =
        dataset.shape().map_err(failed)?.iter().map(|size| usize::try_from(*size).unwrap_or(usize::MAX)).collect();
    let [rows] = *shape.as_slice() else { return Ok(vec![]) };
    if has_other_filter(&dataset) || has_early_check_sum(&dataset) {
        return Ok(vec![Array::refused(name, rows, &[], OTHER_FILTER)]);
    }
    let element_size = datatype.type_size() as usize;
    if !budget.has(chunk_bytes(&dataset, element_size).map_err(failed)?) {
        return Ok(vec![Array::refused(name, rows, &[], Budget::REFUSED)]);
    }
    let dataset = Rc::new(dataset);
    let mut found = vec![];
    for field in compound::fields(&datatype) {
        let name = format!("{name}/{}", field.name);
        let (dimensions, texts) = (field.dimensions.clone(), field.is_text());
        let Some(width) = width(&dimensions).filter(|width| !texts || *width == 1) else { continue };
        // All fields are read for the values of one.
        if !budget.take(rows.checked_mul(width), element_size, texts) {
            found.push(Array::refused(name, rows, &dimensions, Budget::REFUSED));
            continue;
        }
        let values = Box::new(compound::FieldValues {
            place: place.into(),
            name: name.clone(),
            dataset: Rc::clone(&dataset),
            element_size,
            field,
            file_size,
        });
        found.push(Array::new(name, rows, &dimensions, texts, &ArrayAttributes::default(), values)?);
    }
    Ok(found)
}

/// A data set as an array, if it is of a kind that a log can have.
fn array(
    place: &str,
    name: String,
    dataset: Dataset,
    budget: &mut Budget,
    file_size: u64,
) -> Result<Option<Array>, InputError> {
    let failed = |error: Error| damaged(place, &error);
    let shape = dataset.shape().map_err(failed)?;
    let stored: Vec<usize> = shape.iter().map(|size| usize::try_from(*size).unwrap_or(usize::MAX)).collect();
    let matlab = matlab::Kind::of(&dataset, &stored).map_err(failed)?;
    let shape = match matlab {
        matlab::Kind::Other => stored.clone(),
        matlab::Kind::Numbers => matlab::shape(&stored),
        matlab::Kind::Unread => return Ok(None),
    };
    let Some((rows, dimensions)) = shape.split_first() else { return Ok(None) };
    let texts = match dataset.dtype().map_err(failed)? {
        DType::String | DType::VariableLengthString => true,
        DType::Compound(_) | DType::Array(..) | DType::ObjectReference => return Ok(None),
        _ => false,
    };
    let Some(width) = width(dimensions).filter(|width| !texts || *width == 1) else { return Ok(None) };
    let size = usize::try_from(dataset.element_size().map_err(failed)?).unwrap_or(usize::MAX);
    let chunk = chunk_bytes(&dataset, size).map_err(failed)?;
    let refused = |reason: &str| Ok(Some(Array::refused(name.clone(), *rows, dimensions, reason)));
    if has_other_filter(&dataset) {
        return refused(OTHER_FILTER);
    }
    if has_early_check_sum(&dataset) {
        return refused(
            "has a checksum (Fletcher32) before its other filters, expected it after them: write it without a checksum",
        );
    }
    let float = match NumberReader::of(&dataset.datatype().map_err(failed)?) {
        NumberReader::Library => None,
        NumberReader::Own(form) => Some(form),
        NumberReader::Refused(reason) => return refused(&reason),
    };
    if !budget.take(rows.checked_mul(width), size, texts) || !budget.has(chunk) {
        return refused(Budget::REFUSED);
    }
    let stored = (matlab == matlab::Kind::Numbers).then_some(stored);
    let attrs = dataset.attrs().map_err(failed)?;
    let attributes = ArrayAttributes::of(&|key| attribute(&attrs, key));
    let values = Box::new(Values {
        place: place.into(),
        name: name.clone(),
        dataset,
        float,
        stored,
        most: budget.whole,
        file_size,
    });
    Array::new(name, *rows, dimensions, texts, &attributes, values).map(Some)
}

/// The bytes of a chunk of elements of this size; `None` if they are too many for a number.
fn chunk_bytes(dataset: &Dataset, size: usize) -> Result<Option<usize>, Error> {
    let chunk = dataset.chunk_shape()?.unwrap_or_default();
    Ok(chunk.iter().try_fold(size, |product, size| product.checked_mul(usize::try_from(*size).ok()?)))
}

/// Rejects a data set whose chunks lie outside of the file or are larger than the file in total: the library allocates memory for a chunk before it
/// reads the chunk.
fn check_chunks(dataset: &Dataset, file_size: u64) -> Result<(), String> {
    // A data set without a readable chunk index cannot be read either.
    let chunks = if dataset.is_chunked() { dataset.chunks().unwrap_or_default() } else { vec![] };
    let mut left = file_size;
    for chunk in chunks {
        let (size, at) = (chunk.storage_size, chunk.address);
        let is_inside = at.checked_add(size).is_some_and(|end| end <= file_size);
        left = left.checked_sub(size).filter(|_| is_inside).ok_or_else(|| {
            format!("a chunk declares {size} bytes at byte {at}, but the file has {file_size} bytes with all chunks")
        })?;
    }
    Ok(())
}

/// The chunks of a data set that were never written, as where a recorder made room for more rows than it wrote. What has no index that can be listed cannot be
/// read.
fn missing(dataset: &Dataset) -> Option<MissingRows> {
    let (shape, chunk) = (dataset.shape().ok()?, dataset.chunk_shape().ok()??);
    let whole = |size: u64| usize::try_from(size).ok();
    let grid: Vec<u64> = shape.iter().zip(&chunk).map(|(size, chunk)| size.div_ceil((*chunk).max(1))).collect();
    let (across, rows, size) = (grid.iter().skip(1).product::<u64>(), whole(*shape.first()?)?, whole(*chunk.first()?)?);
    // The number of stored chunks, by the index of their first row.
    let mut there = vec![0_u64; whole(*grid.first()?)?];
    for chunk in dataset.chunks().ok()? {
        let place = chunk.offset.first().and_then(|row| whole(*row)?.checked_div(size));
        if let Some(place) = place
            && let Some(count) = there.get_mut(place)
        {
            *count += 1;
        }
    }
    let lacks = |count: &u64| *count < across;
    let (first, last) = (there.iter().position(lacks)?, there.iter().rposition(lacks)?);
    let missing: u64 = there.iter().map(|count| across.saturating_sub(*count)).sum();
    let message = format!(
        "{missing} of {} chunks were never written; they read as the fill value, which is correct only if the writer omitted them because all values are equal to it",
        grid.iter().product::<u64>()
    );
    Some(MissingRows { rows: first * size..((last + 1) * size).min(rows), message })
}

/// The values of a data set.
struct Values {
    place: String,
    name: String,
    dataset: Dataset,
    /// The decoder of its numbers, for types that the library does not read.
    float: Option<FloatForm>,
    /// The dimensions of an array of MATLAB as the file has them.
    stored: Option<Vec<usize>>,
    /// Maximum number of bytes of its texts.
    most: u64,
    file_size: u64,
}

impl Values {
    fn check(&self) -> Result<(), InputError> {
        check_chunks(&self.dataset, self.file_size).map_err(|error| located(&self.place, &self.name, error))
    }

    /// All numbers, as the file orders them.
    fn all(&self) -> Result<Vec<f64>, Error> {
        match &self.float {
            Some(form) => self.dataset.read_raw().map(|bytes| form.decode(&bytes)),
            None => self.dataset.read_f64(),
        }
    }
}

impl array_log::ArrayValues for Values {
    fn numbers(&self, first_row: bool) -> Result<Vec<f64>, InputError> {
        self.check()?;
        let failed = |error| located(&self.place, &self.name, error);
        let Some(stored) = &self.stored else {
            return match (first_row, &self.float) {
                (true, None) => self.dataset.read_f64_rows(0, 1),
                (true, Some(form)) => self.dataset.read_raw_rows(0, 1).map(|bytes| form.decode(&bytes)),
                (false, _) => self.all(),
            }
            .map_err(failed);
        };
        let mut values = matlab::reversed(&self.all().map_err(failed)?, stored);
        if first_row {
            values.truncate(values.len() / matlab::shape(stored).first().copied().unwrap_or(1).max(1));
        }
        Ok(values)
    }

    fn texts(&self) -> Result<Vec<String>, InputError> {
        self.check()?;
        let limit = usize::try_from(self.most).unwrap_or(usize::MAX);
        let options = VlenStringReadOptions::default().with_max_payload_bytes(limit);
        let read = self.dataset.dtype().and_then(|kind| match kind {
            DType::VariableLengthString => self.dataset.read_vlen_strings(options),
            _ => self.dataset.read_string(),
        });
        read.map_err(|error| located(&self.place, &self.name, error))
    }

    fn missing(&self) -> Option<MissingRows> {
        if self.stored.is_some() { None } else { missing(&self.dataset) }
    }
}

/// The poses of bodies that a model of MuJoCo has in its states, row by row.
struct Motion {
    model: Model,
    states: Vec<f64>,
}

impl ComputedColumns for Motion {
    fn titles(&self) -> Vec<String> {
        self.model.titles()
    }

    fn columns(&self) -> Vec<Vec<f64>> {
        self.model.columns(&self.states)
    }
}

/// The reason why a file cannot be read.
fn damaged(place: &str, error: &Error) -> InputError {
    match error {
        Error::FileMarkedInUse(_) => {
            InputError::new(place, "is marked as open: its writer still writes, or ended without closing it")
                .help("where nothing writes it any more, `h5clear -s` of the HDF5 tools removes the mark")
        }
        Error::Format(FormatError::ChecksumMismatch { .. }) => InputError::new(
            place,
            "is damaged: a checksum of its structure is wrong, for example because its recorder ended without closing it",
        ),
        _ => InputError::new(place, format!("cannot be read as HDF5: {error}")),
    }
}

/// The reason why a data set cannot be read.
fn located(place: &str, name: &str, error: impl std::fmt::Display) -> InputError {
    InputError::new(format!("{place} data set {name}"), format!("cannot be read: {error}"))
}
