//! The fields by which programs see whether a recording of an HDF5 file succeeded: the attribute `success` of Isaac Lab, and `rewards` and `dones` of
//! robomimic, which are 1 in each row whose action led to a state in which the task has succeeded.

use super::super::Container;
use super::{NewValues, Paths, Request, damaged};
use crate::allowed_folders::AllowedFolders;
use ::hdf5_pure::{AttrValue, Error, FormatError, Group};
use std::collections::BTreeMap;
use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_base::guard::guarded;

/// The list of recordings that are successes; robomimic selects recordings by such keys.
pub const SUCCESSES: &str = "mask/teachtree_success";
/// The list of failures.
pub const FAILURES: &str = "mask/teachtree_failure";
/// The attribute of a recording.
pub const ATTRIBUTE: &str = "success";
/// The data set of a recording with its rewards.
pub const REWARDS: &str = "rewards";
/// The data set of a recording that says where its task is done.
pub const DONES: &str = "dones";
/// The group of recordings in the layout of robomimic and Isaac Lab.
pub(in super::super) const PARENT: &str = "data/";

/// The number of recordings of a file in which a reward of 1 is looked for, and the maximum number of their rows.
const LOOKED_AT: usize = 20;
const LONGEST: u64 = 1 << 20;

impl Paths {
    /// Adds the fields of the recordings whose outcome is known. An attribute that is there is replaced only if that is requested; `rewards` and `dones`
    /// that are there never, since a reward may be of another kind.
    pub(super) fn add_success(&mut self, container: &Container, request: &Request) -> Result<(), InputError> {
        let Container { place, file, parent, .. } = container;
        if *parent != PARENT {
            return Ok(());
        }
        for (name, rows) in request.successes {
            let path = format!("{parent}{name}");
            let group = file.group(&path).map_err(|error| damaged(place, &error))?;
            let has_attribute = group.attr_datatypes().map_err(|error| damaged(place, &error))?.contains_key(ATTRIBUTE);
            if request.replace || !has_attribute {
                let value = AttrValue::I8(i8::from(rows.contains(&true)));
                self.attributes.insert(format!("{path}/"), (ATTRIBUTE, value));
            }
            let has = |name: &str| group.dataset(name).is_ok() || group.group(name).is_ok();
            if !has(REWARDS) && !has(DONES) {
                let rewards = rows.iter().map(|flag| f64::from(u8::from(*flag))).collect();
                let dones = rows.iter().map(|flag| i64::from(*flag)).collect();
                self.new.insert(format!("{path}/{REWARDS}"), NewValues::Numbers(rewards));
                self.new.insert(format!("{path}/{DONES}"), NewValues::Integers(dones));
            }
        }
        Ok(())
    }
}

/// The recordings whose fields contradict these successes, which have a value for each row; by the field: [`ATTRIBUTE`], and [`REWARDS`] where they are 0
/// and 1, and not 0 in all recordings.
///
/// # Errors
/// When the file is damaged.
pub fn contradictions(
    path: &Path,
    successes: &BTreeMap<String, Vec<bool>>,
) -> Result<BTreeMap<&'static str, Vec<String>>, InputError> {
    let place = path.display().to_string();
    guarded(&place, || {
        let container = Container::open(path, &AllowedFolders::default())?;
        let mut found: BTreeMap<&'static str, Vec<String>> = BTreeMap::new();
        for (name, rows) in successes.iter().filter(|_| container.parent == PARENT) {
            let known = known(&container, name, rows.len()).map_err(|error| damaged(&place, &error))?;
            for (field, _) in known.into_iter().filter(|(_, known)| *known != rows.contains(&true)) {
                found.entry(field).or_default().push(name.clone());
            }
        }
        Ok(found)
    })
}

/// Whether a recording of this number of rows succeeded, by each of its fields.
pub(in super::super) fn known(
    container: &Container,
    name: &str,
    rows: usize,
) -> Result<Vec<(&'static str, bool)>, Error> {
    let group = container.file.group(&format!("{}{name}", container.parent))?;
    let mut known = Vec::new();
    if let Some(value) = group.attrs()?.get(ATTRIBUTE) {
        let number = value.as_f64().or(value.as_i64().map(|value| value as f64));
        known.extend(number.map(|number| (ATTRIBUTE, number != 0.0)));
    }
    // Only what has a value for each row is read, so that a damaged file cannot promise more than its recordings have.
    if let Some(is_success) = rewarded(&group, |length| length == rows as u64)? {
        // A recorder without rewards writes zeros into all recordings.
        let mut others = container.names.iter().take(LOOKED_AT);
        let is_filled = |other: &String| {
            let group = container.file.group(&format!("{}{other}", container.parent));
            let found = group.and_then(|group| rewarded(&group, |length| length <= LONGEST));
            found.is_ok_and(|found| found == Some(true))
        };
        known.extend((is_success || others.any(is_filled)).then_some((REWARDS, is_success)));
    }
    Ok(known)
}

/// Whether a recording has a reward of 1; `None` if it has no rewards, others than 0 and 1 or than numbers, or a number of them that is not wanted.
fn rewarded(group: &Group, is_wanted: impl Fn(u64) -> bool) -> Result<Option<bool>, Error> {
    let Ok(rewards) = group.dataset(REWARDS) else { return Ok(None) };
    if !matches!(rewards.shape()?[..], [length] if is_wanted(length)) {
        return Ok(None);
    }
    // Strings and records say nothing; damaged values are an error.
    let values = match rewards.read_f64() {
        Err(Error::Format(FormatError::TypeMismatch { .. })) => return Ok(None),
        values => values?,
    };
    let is_sparse = values.iter().all(|value| *value == 0.0 || *value == 1.0);
    Ok(is_sparse.then(|| values.contains(&1.0)))
}
