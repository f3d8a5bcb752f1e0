//! A copy of an HDF5 file with step signals for its recordings, in the layouts of MimicGen and of Isaac Lab Mimic, with lists of recordings, and with the
//! fields that say whether a recording succeeded.
//!
//! The file is packed anew under another name, edited there, compared with the original, and then renamed: at any time the copy is there whole or not at
//! all. The file itself is only read.

pub mod success;

use super::{Container, DEEPEST, check_chunks, damaged, links, located};
use crate::allowed_folders::AllowedFolders;
use crate::atomic_write::Folder;
use ::hdf5_pure::{
    AttrValue, DType, Dataset, DatasetBuilder, Error, File, Group, RepackOptions, VlenStringReadOptions, repack,
};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_base::guard::guarded;

/// The groups of signals by which a part of a demonstration ends and begins.
const TERM: &str = "subtask_term_signals";
const START: &str = "subtask_start_signals";
/// The groups of MimicGen and Isaac Lab Mimic for them, below a recording.
const MIMICGEN: &str = "datagen_info";
const ISAAC: &str = "obs/datagen_info";
/// The list of the recordings that have all signals, as robomimic's filter keys.
pub const MASK: &str = "mask/teachtree_ok";
/// The list of the recordings in which an audit finds nothing wrong.
pub const AUDITED: &str = "mask/teachtree_audit";
/// The most data sets that a file may have.
const MAX_DATASETS: usize = 1 << 22;
/// Number of bytes of a data set that are compared at once.
const COMPARED: u64 = 16 << 20;

/// Whose layout it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// `datagen_info/subtask_term_signals`.
    MimicGen,
    /// `obs/datagen_info/subtask_term_signals`, and `subtask_start_signals`.
    Isaac,
}

impl Layout {
    const fn group(self) -> &'static str {
        match self {
            Self::MimicGen => MIMICGEN,
            Self::Isaac => ISAAC,
        }
    }
}

/// The signals of a recording: 0 and 1, one value a row.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Signals {
    /// The signals for ends of its parts.
    pub term: BTreeMap<String, Vec<i64>>,
    /// The signals for starts of its parts.
    pub start: BTreeMap<String, Vec<i64>>,
}

/// The written data.
pub struct Request<'a> {
    /// The layout; by default that of the file, else MimicGen's.
    pub layout: Option<Layout>,
    /// The signals of each recording, by its name.
    pub signals: &'a BTreeMap<String, Signals>,
    /// Lists of recordings by their data sets: [`MASK`] with those that have all signals, or [`AUDITED`].
    pub lists: &'a BTreeMap<&'static str, Vec<String>>,
    /// Whether each recording has succeeded after each of its rows; of those whose outcome is known.
    pub successes: &'a BTreeMap<String, Vec<bool>>,
    /// The provenance of the signals or the list, JSON.
    pub provenance: &'a str,
    /// Whether signals of these names, lists and attributes that are there are replaced.
    pub replace: bool,
}

impl Request<'_> {
    /// The attribute with the provenance: a list of an audit does not replace the entry of the signals.
    fn provenance_name(&self) -> &'static str {
        if self.lists.contains_key(AUDITED) { "teachtree_audit" } else { "teachtree" }
    }
}

/// The values of a new data set.
#[derive(Clone, Debug, PartialEq)]
enum NewValues {
    Integers(Vec<i64>),
    Numbers(Vec<f64>),
}

impl NewValues {
    fn write(&self, data: &mut DatasetBuilder) {
        match self {
            Self::Integers(values) => data.with_i64_data(values),
            Self::Numbers(values) => data.with_f64_data(values),
        };
    }

    fn are_in(&self, dataset: &Dataset) -> Result<bool, Error> {
        Ok(match self {
            Self::Integers(values) => dataset.read_i64()? == *values,
            Self::Numbers(values) => dataset.read_f64()? == *values,
        })
    }
}

/// Writes a copy of a file with signals.
///
/// # Errors
/// When the file is damaged, has such signals or such a list, has links that a copy would lack, or is of a kind that cannot be written; when the place of the
/// copy is taken or cannot be written.
pub fn annotate(path: &Path, copy: &Path, request: &Request) -> Result<(), InputError> {
    let place = path.display().to_string();
    let folder = Folder::new(copy)?;
    let name = Path::new("copy");
    let target = folder.path().join(name);
    guarded(&place, || {
        let container = Container::open(path, &AllowedFolders::default())?;
        let paths = Paths::new(&container, request)?;
        links::refuse(path)?;
        for (name, dataset) in all(&container.file, &place)? {
            check_chunks(&dataset, container.file.file_size()).map_err(|error| located(&place, &name, error))?;
        }
        let packed = repack(path, &target, &RepackOptions::new());
        packed.map_err(|error| unwritable(&place, copy, &error))?;
        edit(&target, &paths).map_err(|error| unwritable(&place, copy, &error))?;
        drop(container);
        compare(path, &target, &paths)
    })?;
    let sync = std::fs::File::open(&target).and_then(|file| file.sync_all());
    sync.map_err(|error| InputError::unwritable(copy.display().to_string(), &error))?;
    folder.commit_file(name)
}

/// The bodies that the recordings of a file have poses of, as MimicGen or Isaac Lab Mimic keep them; by name, none where there are none.
///
/// # Errors
/// When the file is damaged.
pub fn bodies(path: &Path) -> Result<Vec<String>, InputError> {
    let place = path.display().to_string();
    guarded(&place, || {
        let Container { file, parent, names, .. } = Container::open(path, &AllowedFolders::default())?;
        let groups = [format!("{MIMICGEN}/object_poses"), format!("{ISAAC}/object_pose")];
        let first = names.first().map(|name| format!("{parent}{name}")).unwrap_or_default();
        let found = groups.iter().find_map(|group| file.group(&format!("{first}/{group}")).ok());
        let mut bodies = found.map(|group| group.datasets()).transpose().map_err(|error| damaged(&place, &error))?;
        bodies.iter_mut().for_each(|names| names.sort());
        Ok(bodies.unwrap_or_default())
    })
}

/// What is wrong with the file, or with the place of its copy: errors of the system while the file is packed are those of writing, as it was read before.
fn unwritable(place: &str, copy: &Path, error: &Error) -> InputError {
    if let Error::Io(error) = error
        && error.raw_os_error().is_some()
    {
        return InputError::unwritable(copy.display().to_string(), error);
    }
    let help = "`h5repack` of the HDF5 tools may make a file of it that can be";
    InputError::new(place, format!("cannot be copied with signals: {error}")).help(help)
}

/// The written data and their places.
struct Paths {
    /// Data sets by path, with their values.
    new: BTreeMap<String, NewValues>,
    /// Lists of recordings by path, in order.
    lists: BTreeMap<&'static str, Vec<String>>,
    /// An attribute of a group, by the path of the group with a slash after it; `""` is the root.
    attributes: BTreeMap<String, (&'static str, AttrValue)>,
    /// Data sets that are there and are replaced or dropped.
    old: BTreeSet<String>,
    /// Groups that are made, outer ones first.
    groups: Vec<String>,
}

impl Paths {
    fn new(container: &Container, request: &Request) -> Result<Self, InputError> {
        let Container { place, file, parent, names, .. } = container;
        let made_by = AttrValue::String(request.provenance.into());
        let mut paths = Self {
            new: BTreeMap::new(),
            lists: request.lists.clone(),
            attributes: BTreeMap::from([(String::new(), (request.provenance_name(), made_by))]),
            old: BTreeSet::new(),
            groups: vec![],
        };
        paths.lists.values_mut().for_each(|names| names.sort_unstable());
        if let Some(name) = request.signals.keys().chain(request.successes.keys()).find(|name| !names.contains(name)) {
            return Err(InputError::new(place, format!("there is no recording `{name}`")));
        }
        for (name, signals) in request.signals {
            let recording = format!("{parent}{name}");
            let has = |layout: Layout| file.group(&format!("{recording}/{}", layout.group())).is_ok();
            let found = [Layout::Isaac, Layout::MimicGen].into_iter().find(|layout| has(*layout));
            let layout = request.layout.or(found).unwrap_or(Layout::MimicGen);
            for (kind, signals) in [(TERM, &signals.term), (START, &signals.start)] {
                for (signal, values) in signals {
                    let path = format!("{recording}/{}/{kind}/{signal}", layout.group());
                    paths.new.insert(path, NewValues::Integers(values.clone()));
                }
            }
        }
        if request.replace {
            paths.drop_signals_of_others(container, request);
        }
        paths.add_success(container, request)?;
        let lists = paths.lists.keys().map(ToString::to_string);
        let all: Vec<String> = paths.new.keys().cloned().chain(lists).collect();
        for path in &all {
            let is_dataset = file.dataset(path).is_ok();
            if is_dataset && !request.replace {
                let kind = if paths.lists.contains_key(path.as_str()) { "list" } else { "signal" };
                let message = format!("has the {kind} `{path}` already");
                return Err(InputError::new(place, message).help("--replace leaves it out of the copy"));
            }
            if is_dataset {
                paths.old.insert(path.clone());
            } else if file.group(path).is_ok() {
                return Err(InputError::new(place, format!("`{path}` is a group, expected a data set or nothing")));
            }
            paths.add_groups(file, path);
        }
        Ok(paths)
    }

    /// Drops signals of the written names from recordings that get none now.
    fn drop_signals_of_others(&mut self, container: &Container, request: &Request) {
        let names = |of: fn(&Signals) -> &BTreeMap<String, Vec<i64>>| -> BTreeSet<&String> {
            request.signals.values().flat_map(|signals| of(signals).keys()).collect()
        };
        let kinds = [(TERM, names(|signals| &signals.term)), (START, names(|signals| &signals.start))];
        for recording in container.names.iter().filter(|name| !request.signals.contains_key(*name)) {
            for layout in [Layout::Isaac, Layout::MimicGen] {
                for (kind, signal) in kinds.iter().flat_map(|(kind, names)| names.iter().map(move |it| (*kind, *it))) {
                    let path = format!("{}{recording}/{}/{kind}/{signal}", container.parent, layout.group());
                    if container.file.dataset(&path).is_ok() {
                        self.old.insert(path);
                    }
                }
            }
        }
    }

    fn add_groups(&mut self, file: &File, path: &str) {
        for (at, _) in path.match_indices('/') {
            let group = path.get(..at).unwrap_or_default();
            if !self.groups.iter().any(|known| known == group) && file.group(group).is_err() {
                self.groups.push(group.into());
            }
        }
    }

    /// Whether a path is one that is written or dropped.
    fn has(&self, path: &str) -> bool {
        self.lists.contains_key(path) || self.new.contains_key(path) || self.old.contains(path)
    }
}

fn edit(target: &Path, paths: &Paths) -> Result<(), Error> {
    let file = File::open_rw(target)?;
    let root = file.root();
    for path in &paths.old {
        root.delete(path)?;
    }
    if !paths.old.is_empty() {
        file.commit()?;
    }
    for group in &paths.groups {
        root.create_group(group)?;
    }
    for (path, values) in &paths.new {
        root.create_dataset(path, |data| values.write(data))?;
    }
    for (path, names) in &paths.lists {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let mut failed = None;
        root.create_dataset(path, |data| {
            // A list without names has no length of names.
            let written = if names.is_empty() { data.with_strings_sized(&names, 1) } else { data.with_strings(&names) };
            failed = written.err();
        })?;
        if let Some(error) = failed {
            return Err(error.into());
        }
    }
    for (path, (name, value)) in &paths.attributes {
        let group = if path.is_empty() { file.root() } else { file.group(path)? };
        group.set_attr(name, value.clone())?;
    }
    drop(root);
    file.commit()?;
    file.close()
}

/// Compares a copy with the file: all but what was written is equal, and what was written is there.
fn compare(path: &Path, copy: &Path, paths: &Paths) -> Result<(), InputError> {
    let place = path.display().to_string();
    let failed = |error: Error| damaged(&place, &error);
    let (one, other) = (File::open_streaming(path).map_err(failed)?, File::open_streaming(copy).map_err(failed)?);
    let (ours, theirs) = (all(&one, &place)?, all(&other, &place)?);
    let wrong = |what: &str| InputError::new(&place, format!("the copy differs from the file in `{what}`"));
    let kept = |names: &BTreeMap<String, Dataset>| -> BTreeSet<String> {
        names.keys().filter(|name| !paths.has(name)).cloned().collect()
    };
    if let Some(name) = kept(&ours).symmetric_difference(&kept(&theirs)).next() {
        return Err(wrong(name));
    }
    for (name, mine) in ours.iter().filter(|(name, _)| !paths.has(name)) {
        let same = theirs.get(name).map(|yours| is_same(mine, yours)).transpose().map_err(failed)?;
        if same != Some(true) {
            return Err(wrong(name));
        }
    }
    same_attributes(&one.root(), &other.root(), "", paths, &wrong, &failed)?;
    for (name, values) in &paths.new {
        let written = theirs.get(name).map(|dataset| values.are_in(dataset)).transpose().map_err(failed)?;
        if written != Some(true) {
            return Err(wrong(name));
        }
    }
    Ok(())
}

/// All data sets of a file, by path.
fn all(file: &File, place: &str) -> Result<BTreeMap<String, Dataset>, InputError> {
    let mut found = BTreeMap::new();
    datasets(&file.root(), "", 0, &mut found).map_err(|error| damaged(place, &error))?;
    if found.len() > MAX_DATASETS {
        return Err(InputError::new(
            place,
            format!("found more than {MAX_DATASETS} data sets, the most that are copied"),
        ));
    }
    Ok(found)
}

fn datasets(group: &Group, prefix: &str, depth: usize, all: &mut BTreeMap<String, Dataset>) -> Result<(), Error> {
    // Links may lead round in a circle.
    if depth > DEEPEST || all.len() > MAX_DATASETS {
        return Ok(());
    }
    for (name, dataset) in group.iter_datasets()? {
        all.insert(format!("{prefix}{name}"), dataset);
    }
    for (name, inner) in group.iter_groups()? {
        datasets(&inner, &format!("{prefix}{name}/"), depth + 1, all)?;
    }
    Ok(())
}

fn attributes(attrs: std::collections::HashMap<String, AttrValue>) -> BTreeMap<String, String> {
    attrs.into_iter().map(|(name, value)| (name, format!("{value:?}"))).collect()
}

fn same_attributes(
    one: &Group,
    other: &Group,
    prefix: &str,
    paths: &Paths,
    wrong: &dyn Fn(&str) -> InputError,
    failed: &dyn Fn(Error) -> InputError,
) -> Result<(), InputError> {
    let (ours, mut theirs) = (attributes(one.attrs().map_err(failed)?), attributes(other.attrs().map_err(failed)?));
    if let Some((name, value)) = paths.attributes.get(prefix) {
        let written = theirs.remove(*name);
        if written != Some(format!("{value:?}")) {
            return Err(wrong(&format!("{prefix} attribute {name}")));
        }
        ours.get(*name).iter().for_each(|old| drop(theirs.insert((*name).into(), (*old).clone())));
    }
    if ours != theirs {
        return Err(wrong(&format!("{prefix} attributes")));
    }
    let mut groups: BTreeMap<String, Group> = other.iter_groups().map_err(failed)?.collect();
    for (name, mine) in one.iter_groups().map_err(failed)? {
        let path = format!("{prefix}{name}");
        let yours = groups.remove(&name).ok_or_else(|| wrong(&path))?;
        same_attributes(&mine, &yours, &format!("{path}/"), paths, wrong, failed)?;
    }
    // The remaining objects were made for the signals.
    match groups.keys().map(|name| format!("{prefix}{name}")).find(|path| !paths.groups.contains(path)) {
        Some(path) => Err(wrong(&path)),
        None => Ok(()),
    }
}

/// Whether two data sets are equal in type, shape, values and attributes.
fn is_same(one: &Dataset, other: &Dataset) -> Result<bool, Error> {
    if one.shape()? != other.shape()?
        || format!("{:?}", one.datatype()?) != format!("{:?}", other.datatype()?)
        || attributes(one.attrs()?) != attributes(other.attrs()?)
    {
        return Ok(false);
    }
    let shape = one.shape()?;
    match one.dtype()? {
        DType::VariableLengthString => {
            let options = VlenStringReadOptions::default;
            return Ok(one.read_vlen_strings(options())? == other.read_vlen_strings(options())?);
        }
        // Addresses in the file.
        DType::ObjectReference => return Ok(true),
        _ => {}
    }
    let Some((rows, inner)) = shape.split_first() else { return Ok(one.read_raw()? == other.read_raw()?) };
    let of_row = inner.iter().fold(one.element_size()?, |product, size| product.saturating_mul(*size)).max(1);
    let step = (COMPARED / of_row).max(1);
    let mut row = 0;
    while row < *rows {
        let count = step.min(rows - row);
        if one.read_raw_rows(row, count)? != other.read_raw_rows(row, count)? {
            return Ok(false);
        }
        row += count;
    }
    Ok(true)
}
