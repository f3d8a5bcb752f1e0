//! Soft and external links, which name a path in place of an object. `hdf5_pure` passes over them, so that a copy lacks them without an error: they are
//! found in the bytes that it reads of groups.

use super::{DEEPEST, damaged, number_of};
use crate::allowed_folders::AllowedFolders;
use ::hdf5_pure::{Error, File, FormatError, Group, ReadSeekSource, Source};
use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use teachtree_base::error::InputError;

/// The most groups whose links are looked for.
const MAX_GROUPS: usize = 1 << 22;
/// The types of links that have no object of their own: soft and external.
const SOFT: u8 = 1;
const EXTERNAL: u8 = 64;

/// Refuses a file with links that a copy would lack.
///
/// # Errors
/// When it has one, or cannot be read.
pub(super) fn refuse(path: &Path) -> Result<(), InputError> {
    let place = path.display().to_string();
    let links = found(path, &AllowedFolders::default(), "", DEEPEST)?;
    let Some(Link { words: link, .. }) = links.first() else { return Ok(()) };
    let help = "replace it by its target, as `h5copy` of the HDF5 tools does";
    Err(InputError::new(place, format!("has {link}, which a copy would lack")).help(help))
}

/// Refuses a file that has a link in the place of a recording, in the group `parent`.
///
/// # Errors
/// When it has one, or cannot be read.
pub(super) fn refuse_recordings(path: &Path, folders: &AllowedFolders, parent: &str) -> Result<(), InputError> {
    let links = found(path, folders, parent, 0)?;
    match links.into_iter().find(|link| link.name.as_deref().is_some_and(|name| number_of(name).is_some())) {
        Some(link) => Err(unread(path.display().to_string(), &link)),
        None => Ok(()),
    }
}

/// Returns the reason why a file cannot be read: a soft link in a group of the first version.
pub(super) fn explained(path: &Path, folders: &AllowedFolders, error: InputError) -> InputError {
    match found(path, folders, "", DEEPEST) {
        Ok(links) => links.first().map_or_else(|| error.clone(), |link| unread(error.place.clone(), link)),
        Err(_) => error,
    }
}

fn unread(place: String, link: &Link) -> InputError {
    InputError::new(place, format!("has {}, which is not read here", link.words))
        .help("replace it by its target, as `h5copy` of the HDF5 tools does")
}

/// A link of a group.
struct Link {
    /// Its name, where its message says it.
    name: Option<String>,
    words: String,
}

/// The links in a group of a file and in those in it, down to a depth; `""` is the whole file.
fn found(path: &Path, folders: &AllowedFolders, group: &str, deepest: usize) -> Result<Vec<Link>, InputError> {
    let place = path.display().to_string();
    let failed = |error: Error| damaged(&place, &error);
    let source = || ReadSeekSource::new(folders.open(path)?).map_err(|error| failed(error.into()));
    let ranges = Arc::new(Mutex::new(Vec::new()));
    let file = File::from_source(TracedSource { source: source()?, ranges: Arc::clone(&ranges) }).map_err(failed)?;
    // A link may be why it fails.
    let visited = if group.is_empty() { Ok(file.root()) } else { file.group(group) };
    if deepest == 0 {
        // Links of the groups on the way are none of this one.
        ranges.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }
    let visited = visited.and_then(|group| visit(&group, DEEPEST - deepest, &mut 0));
    drop(file);
    let ranges = std::mem::take(&mut *ranges.lock().unwrap_or_else(PoisonError::into_inner));
    let source = source()?;
    let mut links = vec![];
    for Range { start, end } in merged(ranges) {
        let bytes = source.read_exact_at(start, usize::try_from(end - start).unwrap_or(usize::MAX));
        let bytes = bytes.map_err(|error| failed(error.into()))?;
        links.extend((0..bytes.len()).filter_map(|at| link(bytes.get(at..)?)));
    }
    if links.is_empty() { visited.map(|()| links).map_err(failed) } else { Ok(links) }
}

/// A file that records the ranges that were read.
struct TracedSource {
    source: ReadSeekSource<std::fs::File>,
    ranges: Arc<Mutex<Vec<Range<u64>>>>,
}

impl Source for TracedSource {
    fn len(&self) -> u64 {
        self.source.len()
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> Result<(), FormatError> {
        self.source.read_at(offset, buffer)?;
        let mut ranges = self.ranges.lock().unwrap_or_else(PoisonError::into_inner);
        ranges.push(offset..offset + buffer.len() as u64);
        Ok(())
    }
}

/// Has all groups read.
fn visit(group: &Group, depth: usize, groups: &mut usize) -> Result<(), Error> {
    *groups += 1;
    // Links may lead round in a circle.
    if depth > DEEPEST || *groups > MAX_GROUPS {
        return Ok(());
    }
    for (_, inner) in group.iter_groups()? {
        visit(&inner, depth + 1, groups)?;
    }
    Ok(())
}

/// Ranges that touch are one: a header may be read in parts.
fn merged(mut ranges: Vec<Range<u64>>) -> Vec<Range<u64>> {
    ranges.sort_by_key(|range| (range.start, range.end));
    let mut all: Vec<Range<u64>> = Vec::new();
    for range in ranges {
        match all.last_mut() {
            Some(last) if range.start <= last.end => last.end = last.end.max(range.end),
            _ => all.push(range),
        }
    }
    all
}

/// The link that these bytes of a group begin with.
fn link(bytes: &[u8]) -> Option<Link> {
    message(bytes).or_else(|| in_symbol_table(bytes).then(|| Link { name: None, words: "a soft link".into() }))
}

/// A link message (HDF5 file format, IV.A.2.g).
fn message(bytes: &[u8]) -> Option<Link> {
    const VERSION: u8 = 1;
    let &[VERSION, flags, kind @ (SOFT | EXTERNAL), ref rest @ ..] = bytes else { return None };
    // The type of the link is there, and no flag is set that means nothing.
    if flags & 0b1110_1000 != 0b1000 {
        return None;
    }
    let rest = if flags & 4 == 0 { rest } else { rest.get(8..)? };
    let rest = if flags & 16 == 0 { rest } else { rest.get(1..)? };
    let (length, rest) = rest.split_at_checked(1 << (flags & 3))?;
    let length =
        length.iter().rev().try_fold(0_usize, |length, byte| length.checked_mul(256)?.checked_add((*byte).into()))?;
    let (name, rest) = rest.split_at_checked(length)?;
    let (length, rest) = rest.split_first_chunk::<2>()?;
    let target = rest.get(..usize::from(u16::from_le_bytes(*length)))?;
    let name = text(name)?;
    let words = if kind == SOFT {
        format!("the soft link `{name}` to `{}`", text(target)?)
    } else {
        let target = target.strip_prefix(&[0])?.strip_suffix(&[0])?;
        let (file, object) = std::str::from_utf8(target).ok()?.split_once('\0')?;
        format!("the external link `{name}` to `{object}` in `{file}`")
    };
    Some(Link { name: Some(name.into()), words })
}

/// Letters without control characters, at least one.
fn text(bytes: &[u8]) -> Option<&str> {
    let text = std::str::from_utf8(bytes).ok()?;
    (!text.is_empty() && !text.contains(char::is_control)).then_some(text)
}

/// Whether these are the entries of a group of the first version (HDF5 file format, III.B and III.C), with offsets of 8 bytes, and one of them is a soft
/// link.
fn in_symbol_table(bytes: &[u8]) -> bool {
    const HEAD: usize = 8;
    const ENTRY: usize = 40;
    const CACHE: usize = 16;
    const CACHED_SOFT_LINK: u32 = 2;
    let Some(&[b'S', b'N', b'O', b'D', 1, _, a, b]) = bytes.first_chunk::<HEAD>() else { return false };
    (0..usize::from(u16::from_le_bytes([a, b]))).any(|entry| {
        let cached = bytes.get(HEAD + ENTRY * entry + CACHE..).and_then(|entry| entry.first_chunk::<4>());
        cached.is_some_and(|cached| u32::from_le_bytes(*cached) == CACHED_SOFT_LINK)
    })
}
