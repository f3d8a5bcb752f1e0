//! HDF5: the recordings of a file (`data/demo_0`, …), of which one is a log, with its data sets as columns.
//!
//! The layouts of robosuite, robomimic, MimicGen, Isaac Lab, LIBERO and ManiSkill have a group a recording; a file of ALOHA, ACT or EgoDex is one
//! recording. A data set is called by its path below the recording (`obs/robot0_eef_pos[0]`); those with another number of rows than most are a
//! sheet of their own (`rows_1102.user_info/0/zoom`). Shapes are checked before data are read, and no data set is read that promises more than
//! [`EXPANSION`] bytes a byte of the file.

pub mod annotate;
mod mujoco;

use super::arrays::{Spread, width};
use super::guard::guarded;
use super::many::{MAX_RECORDINGS, number_of};
use crate::base::error::InputError;
use crate::stream::read::sheet::{Cells, InMemoryTable};
use crate::stream::read::table::{MAX_COLUMNS, Rows, Sheet, Source, Table, Want, check_size};
use ::hdf5_pure::{AttrValue, DType, Dataset, Error, File, Group, VlenStringReadOptions};
use mujoco::Model;
use serde_json::Value;
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::Path;

/// How many bytes a byte of the file may become, and how many bytes every file may: deflate compresses by a factor of 1032 at best.
const EXPANSION: u64 = 1100;
const ALWAYS: u64 = 1 << 20;
/// How deep groups may be nested.
const DEEPEST: usize = 12;
/// The first bytes of a file.
pub(super) const MAGIC: [u8; 8] = [0x89, b'H', b'D', b'F', b'\r', b'\n', 0x1a, b'\n'];
/// The highest rate that is believed, Hz.
const MAX_RATE_HZ: f64 = 1e5;

/// Opens a recording of a file: `demo_3`, or `3`.
///
/// # Errors
/// When the file is no HDF5, is damaged, or it is not said which of its recordings is meant.
pub(super) fn open(path: &Path, recording: Option<&str>) -> Result<Source, InputError> {
    let name = path.display().to_string();
    guarded(&name, || {
        let container = Container::open(path)?;
        let chosen = container.choose(recording)?;
        container.source(chosen)
    })
}

/// Whether a file is HDF5 by its first bytes.
///
/// # Errors
/// When it cannot be read.
pub(super) fn is_hdf5(path: &Path) -> Result<bool, InputError> {
    let failed = |error: std::io::Error| InputError::unreadable(path.display().to_string(), &error);
    let mut magic = vec![];
    std::fs::File::open(path).map_err(failed)?.take(MAGIC.len() as u64).read_to_end(&mut magic).map_err(failed)?;
    Ok(magic == MAGIC)
}

/// The recordings of a file, by number; none for a file that is one.
///
/// # Errors
/// When the file is damaged.
pub(super) fn names(path: &Path) -> Result<Vec<String>, InputError> {
    guarded(&path.display().to_string(), || Ok(Container::open(path)?.names))
}

/// A file, and which of its groups are recordings.
struct Container {
    place: String,
    file: File,
    /// The path of the group that holds the recordings, with a slash behind it.
    parent: &'static str,
    names: Vec<String>,
}

impl Container {
    fn open(path: &Path) -> Result<Self, InputError> {
        let place = path.display().to_string();
        std::fs::File::open(path).map_err(|error| InputError::unreadable(&place, &error))?;
        let file = File::open_streaming(path).map_err(|error| damaged(&place, &error))?;
        let failed = |error: Error| damaged(&place, &error);
        let root = file.root();
        let groups = root.groups().map_err(failed)?;
        let numbered = |groups: Vec<String>| -> Vec<String> {
            groups.into_iter().filter(|name| number_of(name).is_some()).collect()
        };
        let (mut parent, mut names) = ("", vec![]);
        if groups.iter().any(|name| name == "data") {
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
        Ok(Self { place, file, parent, names })
    }

    /// The recording that is meant; `None` for a file that is one.
    fn choose(&self, asked: Option<&str>) -> Result<Option<&str>, InputError> {
        let (place, names) = (&self.place, &self.names);
        let like = |name: &String| format!("such as `{place}#{name}`");
        match (asked, names.as_slice()) {
            (None, []) => Ok(None),
            (None, [name]) => Ok(Some(name)),
            (None, [first, ..]) => {
                let message = format!("the file has {} recordings, expected the name of one", names.len());
                Err(InputError::new(place, message)
                    .help(format!("choose one behind `#`, {}, or all with `{place}#*`", like(first))))
            }
            (Some(asked), []) => {
                let message = format!("the file is one recording, found `#{asked}` behind its name");
                Err(InputError::new(place, message).help("leave it out"))
            }
            (Some(asked), [first, ..]) => {
                let number = asked.parse::<u64>().ok();
                let by_number = |name: &&String| number.is_some() && number_of(name) == number;
                let found = names.iter().find(|name| *name == asked).or_else(|| names.iter().find(by_number));
                found.map(|name| Some(name.as_str())).ok_or_else(|| {
                    let message = format!("found {} recordings, none of them is called `{asked}`", names.len());
                    InputError::new(place, message).help(format!("choose one of them, {}", like(first)))
                })
            }
        }
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
            Walk::Hdf5(error) => failed(*error),
            Walk::Limit(message) => InputError::new(&place, message),
        })?;
        found.sort_by(|(a, _), (b, _)| a.cmp(b));
        let mut described = vec![group.attrs().map_err(failed)?, self.file.root().attrs().map_err(failed)?];
        if !self.parent.is_empty() {
            described.push(self.file.group("data").and_then(|data| data.attrs()).map_err(failed)?);
        }
        let described: Vec<Described> = described.iter().map(Described::new).collect();
        let most = self.file.file_size().saturating_mul(EXPANSION).saturating_add(ALWAYS);
        let mut arrays: Vec<Array> = found
            .into_iter()
            .filter_map(|(name, dataset)| Array::new(name, dataset, most).transpose())
            .collect::<Result<_, _>>()
            .map_err(failed)?;
        let rows = rows(&arrays, described.first().and_then(|own| own.samples));
        let model = described.iter().find_map(|attrs| attrs.model.clone());
        let states =
            arrays.iter().find(|array| array.name == "states" && array.rows == rows && array.refused.is_none());
        let states = states.map(|states| (states.width(), states.numbers()));
        let mut opened = Opened { place: place.clone(), arrays: vec![], rows, most, time: None, motion: None };
        if let Some((width, states)) = states
            && described.iter().any(|attrs| attrs.robosuite)
        {
            let states = states.map_err(|error| located(&place, "states", error))?;
            let stamps: Vec<f64> = states.chunks_exact(width.max(1)).filter_map(|row| row.first().copied()).collect();
            if stamps.is_sorted_by(|a, b| a < b) {
                opened.time = Some(stamps);
            }
            let model = model.and_then(|text| Model::read(&text, width));
            opened.motion = model.map(|model| (model, states));
        }
        let rate = described.iter().find_map(|attrs| attrs.rate_hz);
        let named = |array: &Array| ["time", "timestamp", "timestamps", "t"].contains(&array.name.as_str());
        if arrays.iter().any(|array| named(array) && array.rows == rows) {
            opened.time = None;
        } else if let (None, Some(rate)) = (&opened.time, rate) {
            opened.time = Some((0..rows).map(|row| row as f64 / rate).collect());
        }
        let mut refused = vec![];
        arrays.retain(|array| {
            refused.extend(array.refused.map(|reason| (array.name.clone(), reason.to_string())));
            array.refused.is_none()
        });
        let mut others: BTreeMap<usize, Vec<Array>> = BTreeMap::new();
        for array in arrays {
            // What is said once holds all along.
            if array.rows == rows || array.rows == 1 {
                opened.arrays.push(array);
            } else if array.rows > 0 {
                others.entry(array.rows).or_default().push(array);
            }
        }
        if rows == 0 || opened.arrays.is_empty() {
            let message = "found no array with a row a sample, expected data sets such as `actions`";
            return Err(InputError::new(place, message));
        }
        let mut sheets = vec![opened.sheet("")];
        for (rows, arrays) in others {
            let other = Opened { place: format!("{place} rows_{rows}"), arrays, rows, most, time: None, motion: None };
            sheets.push(other.sheet(&format!("rows_{rows}")));
        }
        let columns: usize = sheets.iter().map(|sheet| sheet.header.len()).sum();
        if columns > MAX_COLUMNS {
            return Err(InputError::new(place, format!("found {columns} columns, at most {MAX_COLUMNS} are read")));
        }
        Ok(Source { refused, ..Source::many(place, sheets) })
    }
}

/// Whether a data set needs a filter other than deflate, shuffle, Fletcher's check sum, scale-offset and LZF.
fn has_other_filter(dataset: &Dataset) -> bool {
    dataset.filters().iter().any(|filter| ![1, 2, 3, 6, 32_000].contains(filter))
}

/// Why a walk over groups ended.
enum Walk {
    Hdf5(Box<Error>),
    Limit(String),
}

impl From<Error> for Walk {
    fn from(error: Error) -> Self {
        Self::Hdf5(Box::new(error))
    }
}

/// Finds the data sets of a group and of those in it, by path.
fn walk(group: &Group, prefix: &str, depth: usize, found: &mut Vec<(String, Dataset)>) -> Result<(), Walk> {
    if depth > DEEPEST {
        return Err(Walk::Limit(format!("found groups nested deeper than {DEEPEST}, the most that are read")));
    }
    for (name, dataset) in group.iter_datasets()? {
        found.push((format!("{prefix}{name}"), dataset));
    }
    if found.len() > MAX_COLUMNS {
        return Err(Walk::Limit(format!("found more than {MAX_COLUMNS} data sets, the most that are read")));
    }
    for (name, inner) in group.iter_groups()? {
        walk(&inner, &format!("{prefix}{name}/"), depth + 1, found)?;
    }
    Ok(())
}

/// What attributes say of a recording.
#[derive(Default)]
struct Described {
    samples: Option<usize>,
    rate_hz: Option<f64>,
    /// Whether robosuite made it: its `states` begin with the time.
    robosuite: bool,
    /// The model of MuJoCo, XML.
    model: Option<String>,
}

impl Described {
    fn new(attrs: &std::collections::HashMap<String, AttrValue>) -> Self {
        let text = |key: &str| attrs.get(key).and_then(AttrValue::as_str);
        let object =
            |key: &str| text(key).and_then(|text| serde_json::from_str::<Value>(text).ok()).unwrap_or_default();
        let (args, info) = (object("env_args"), object("env_info"));
        let at = |value: &Value, path: &[&str]| {
            path.iter().try_fold(value.clone(), |value, key| value.get(key).cloned())?.as_f64()
        };
        let step = at(&args, &["sim_args", "dt"])
            .zip(at(&args, &["sim_args", "decimation"]))
            .map(|(dt, steps)| 1.0 / (dt * steps));
        let own = ["control_freq", "fps"].iter().find_map(|key| {
            let value = attrs.get(*key)?;
            value.as_f64().or_else(|| value.as_i64().map(|value| value as f64))
        });
        let rate = at(&args, &["env_kwargs", "control_freq"])
            .or_else(|| at(&args, &["control_freq"]))
            .or_else(|| at(&info, &["control_freq"]))
            .or(step)
            .or(own);
        Self {
            samples: attrs.get("num_samples").and_then(AttrValue::as_u64).and_then(|count| usize::try_from(count).ok()),
            rate_hz: rate.filter(|rate| *rate > 0.0 && *rate <= MAX_RATE_HZ),
            robosuite: info.is_object() || args.get("type").and_then(Value::as_u64) == Some(1),
            model: text("model_file").filter(|text| text.trim_start().starts_with('<')).map(str::to_string),
        }
    }
}

/// How many rows the recording has: as many as it says, as its actions have, or as most of its arrays.
fn rows(arrays: &[Array], said: Option<usize>) -> usize {
    let with = |rows: usize| arrays.iter().filter(|array| array.rows == rows).count();
    let actions =
        arrays.iter().find(|array| matches!(array.name.as_str(), "actions" | "action")).map(|array| array.rows);
    let known = said.into_iter().chain(actions).find(|rows| *rows > 0 && with(*rows) > 0);
    let by_count = |a: &&Array, b: &&Array| match with(a.rows).cmp(&with(b.rows)) {
        Ordering::Equal => a.rows.cmp(&b.rows),
        order => order,
    };
    known.or_else(|| arrays.iter().max_by(by_count).map(|array| array.rows)).unwrap_or(0)
}

/// A data set with a row a sample.
struct Array {
    name: String,
    dataset: Dataset,
    rows: usize,
    dimensions: Vec<usize>,
    /// How it becomes columns; `None` for texts.
    spread: Option<Spread>,
    /// Why it cannot be read.
    refused: Option<&'static str>,
}

impl Array {
    /// A data set, if it is of a kind that a log can have.
    fn new(name: String, dataset: Dataset, most: u64) -> Result<Option<Self>, Error> {
        let shape: Vec<usize> =
            dataset.shape()?.iter().map(|size| usize::try_from(*size).unwrap_or(usize::MAX)).collect();
        let Some((rows, dimensions)) = shape.split_first() else { return Ok(None) };
        let texts = match dataset.dtype()? {
            DType::String | DType::VariableLengthString => true,
            DType::Compound(_) | DType::Array(..) | DType::ObjectReference => return Ok(None),
            _ => false,
        };
        let Some(width) = width(dimensions).filter(|width| !texts || *width == 1) else { return Ok(None) };
        let (rows, dimensions) = (*rows, dimensions.to_vec());
        let fits = |elements: Option<u64>, size: u64| {
            elements.and_then(|count| count.checked_mul(size)).is_some_and(|bytes| bytes <= most)
        };
        let size = dataset.element_size()?;
        let chunk = dataset.chunk_shape()?.unwrap_or_default();
        let chunk = chunk.iter().try_fold(1_u64, |product, size| product.checked_mul(*size));
        let mut array = Self { name, dataset, rows, dimensions, spread: None, refused: None };
        if has_other_filter(&array.dataset) {
            array.refused =
                Some("is compressed by a filter that is not read here, expected gzip, lzf, shuffle or scale-offset");
        } else if !fits((rows as u64).checked_mul(width as u64), size) || !fits(chunk, size) {
            array.refused = Some("promises more data than the file can hold");
        } else if !texts {
            let first = if array.dimensions.ends_with(&[4, 4]) && rows > 0 {
                array.dataset.read_f64_rows(0, 1)?
            } else {
                vec![]
            };
            array.spread = Spread::new(&array.name, &array.dimensions, &first);
        }
        Ok(Some(array))
    }

    fn width(&self) -> usize {
        self.dimensions.iter().product()
    }

    fn numbers(&self) -> Result<Vec<f64>, Error> {
        self.dataset.read_f64()
    }

    fn titles(&self) -> Vec<String> {
        self.spread.as_ref().map_or_else(|| vec![self.name.clone()], Spread::titles)
    }

    /// Its columns, as long as the recording: what is said once holds all along.
    fn cells(&self, rows: usize, most: u64) -> Result<Vec<Cells>, Error> {
        let Some(spread) = &self.spread else {
            let limit = usize::try_from(most).unwrap_or(usize::MAX);
            let mut texts = match self.dataset.dtype()? {
                DType::VariableLengthString => {
                    self.dataset.read_vlen_strings(VlenStringReadOptions::default().with_max_payload_bytes(limit))?
                }
                _ => self.dataset.read_string()?,
            };
            if let [text] = texts.as_slice() {
                texts = vec![text.clone(); rows];
            }
            return Ok(vec![Cells::Texts(texts)]);
        };
        let columns = spread.columns(&self.numbers()?);
        let held = |column: Vec<f64>| match column.as_slice() {
            [value] => vec![*value; rows],
            _ => column,
        };
        Ok(columns.into_iter().map(|column| Cells::Numbers(held(column))).collect())
    }
}

/// A recording whose columns are known and not read yet.
struct Opened {
    place: String,
    arrays: Vec<Array>,
    rows: usize,
    most: u64,
    /// The stamps, where no data set has them.
    time: Option<Vec<f64>>,
    /// The model of MuJoCo and its states, row by row.
    motion: Option<(Model, Vec<f64>)>,
}

impl Opened {
    /// A sheet of this name.
    fn sheet(self, name: &str) -> Sheet {
        Sheet { name: name.into(), header: self.header(), rows: Box::new(self) }
    }

    fn header(&self) -> Vec<String> {
        let time = self.time.iter().map(|_| "time [s]".to_string());
        let bodies = self.motion.iter().flat_map(|(model, _)| model.titles());
        time.chain(self.arrays.iter().flat_map(Array::titles)).chain(bodies).collect()
    }
}

impl Rows for Opened {
    fn read(self: Box<Self>, header: &[String], wants: &[Want], rate_hz: Option<f64>) -> Result<Table, InputError> {
        let place = self.place.clone();
        let memory = guarded(&place, || self.memory(wants))?;
        Box::new(memory).read(header, wants, rate_hz)
    }
}

impl Opened {
    /// The columns of which something is wanted; the others are empty.
    fn memory(self, wants: &[Want]) -> Result<InMemoryTable, InputError> {
        let wanted = wants.iter().filter(|want| **want != Want::Nothing).count();
        check_size(&self.place, self.rows, wanted)?;
        let mut memory = InMemoryTable::new(&self.place);
        let mut wants = wants.iter();
        let Self { place, arrays, rows, most, time, motion } = self;
        if let Some(time) = time {
            wants.next();
            memory.push_column("time [s]".into(), Cells::Numbers(time));
        }
        for array in arrays {
            let titles = array.titles();
            let wanted = wants.by_ref().take(titles.len()).filter(|want| **want != Want::Nothing).count() > 0;
            let cells = if wanted {
                array.cells(rows, most).map_err(|error| located(&place, &array.name, error))?
            } else {
                vec![]
            };
            let mut cells = cells.into_iter();
            for title in titles {
                memory.push_column(title, cells.next().unwrap_or_else(|| Cells::Numbers(vec![])));
            }
        }
        if let Some((model, states)) = motion {
            let titles = model.titles();
            let wanted = wants.any(|want| *want != Want::Nothing);
            let columns = if wanted { model.columns(&states) } else { vec![] };
            let mut columns = columns.into_iter();
            for title in titles {
                memory.push_column(title, Cells::Numbers(columns.next().unwrap_or_default()));
            }
        }
        Ok(memory)
    }
}

/// What keeps a file from being read.
fn damaged(place: &str, error: &Error) -> InputError {
    InputError::new(place, format!("cannot be read as HDF5: {error}"))
}

/// What keeps a data set from being read.
fn located(place: &str, name: &str, error: Error) -> InputError {
    InputError::new(format!("{place} data set {name}"), format!("cannot be read: {error}"))
}
