//! The frames of a video in a file of MP4, by the table of samples in its first video track. Nothing is decoded.
//!
//! A camera that hangs gives the same picture again and again, and its key frames, which stand alone, have the same size; the noise of a camera that works makes
//! these sizes differ. This shows only where key frames are frequent and large, as in videos of LeRobot, in which every second frame is one.

use std::fs::File;
use std::io::{Read as _, Result, Seek as _, SeekFrom};
use std::ops::Range;

/// The largest description of a file that is read, in bytes.
const MAX_DESCRIPTION: u64 = 64 << 20;
/// The most boxes that a file may begin with.
const MAX_BOXES: usize = 1000;

/// Key frames of an unchanged picture: the largest difference of their sizes and the smallest size, bytes, and the largest distance, frames.
const MOST_BYTES_OFF: u32 = 2;
const FEWEST_BYTES: u32 = 500;
const MOST_FRAMES_APART: u64 = 5;
/// The fewest such key frames that show a picture that does not change.
const FEWEST_KEY_FRAMES: usize = 10;

/// A video.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Video {
    /// The number of frames.
    pub frames: u64,
    /// Frames in which the picture does not change.
    pub still: Vec<Range<u64>>,
}

/// The video in a file; `None` for a file without a video track that is described as those of MP4.
///
/// # Errors
/// The file cannot be read.
pub(super) fn video(file: &mut File) -> Result<Option<Video>> {
    let Some(description) = description(file)? else { return Ok(None) };
    Ok(boxes(&description).filter(|(kind, _)| kind == b"trak").find_map(|(_, track)| video_of_track(track)))
}

/// The bytes of the box `moov`, which may be the last one.
fn description(file: &mut File) -> Result<Option<Vec<u8>>> {
    let length = file.metadata()?.len();
    let mut at = 0;
    for _ in 0..MAX_BOXES {
        if at + 8 > length {
            break;
        }
        file.seek(SeekFrom::Start(at))?;
        let mut head = Vec::new();
        file.by_ref().take(16).read_to_end(&mut head)?;
        let (Some(short), Some(kind)) = (number(&head, 0), head.get(4..8)) else { break };
        let long = head.get(8..16).and_then(|bytes| bytes.try_into().ok()).map(u64::from_be_bytes);
        let (size, header) = match short {
            0 => (length - at, 8),
            1 => (long.unwrap_or(0), 16),
            short => (u64::from(short), 8),
        };
        if size < header {
            break;
        }
        if kind == b"moov" {
            let size = (size - header).min(MAX_DESCRIPTION);
            let mut bytes = Vec::new();
            file.seek(SeekFrom::Start(at + header))?;
            file.by_ref().take(size).read_to_end(&mut bytes)?;
            return Ok(Some(bytes));
        }
        at = at.saturating_add(size);
    }
    Ok(None)
}

fn video_of_track(track: &[u8]) -> Option<Video> {
    let media = child(track, b"mdia")?;
    // Four bytes of version and flags, four that are zero, then the kind of the track.
    let is_video = child(media, b"hdlr")?.get(8..12)? == b"vide";
    let table = child(child(media, b"minf")?, b"stbl")?;
    let sizes = child(table, b"stsz")?;
    let frames = u64::from(number(sizes, 8)?);
    let size = |frame: u64| match number(sizes, 4) {
        Some(0) => number(sizes, usize::try_from(frame).ok()?.checked_mul(4)?.checked_add(12)?),
        all => all,
    };
    is_video.then(|| Video { frames, still: child(table, b"stss").map_or(Vec::new(), |keys| still(keys, &size)) })
}

/// The frames between key frames of one size.
fn still(keys: &[u8], size: &dyn Fn(u64) -> Option<u32>) -> Vec<Range<u64>> {
    let frames = keys.get(8..).unwrap_or_default().chunks_exact(4).filter_map(|bytes| number(bytes, 0));
    // Frames are counted from 1 there.
    let keys =
        frames.filter_map(|frame| u64::from(frame).checked_sub(1)).filter_map(|frame| Some((frame, size(frame)?)));
    let mut runs: Vec<Vec<(u64, u32)>> = Vec::new();
    for (frame, bytes) in keys {
        let goes_on = |run: &&mut Vec<(u64, u32)>| {
            let is_near = run.last().is_some_and(|(last, _)| frame.saturating_sub(*last) <= MOST_FRAMES_APART);
            is_near && run.first().is_some_and(|(_, first)| bytes.abs_diff(*first) <= MOST_BYTES_OFF)
        };
        match runs.last_mut().filter(goes_on) {
            Some(run) => run.push((frame, bytes)),
            None => runs.push(vec![(frame, bytes)]),
        }
    }
    let is_still = |run: &Vec<(u64, u32)>| {
        run.len() >= FEWEST_KEY_FRAMES && run.first().is_some_and(|(_, bytes)| *bytes >= FEWEST_BYTES)
    };
    let range = |run: Vec<(u64, u32)>| Some(run.first()?.0..run.last()?.0 + 1);
    runs.into_iter().filter(is_still).filter_map(range).collect()
}

fn child<'a>(parent: &'a [u8], wanted: &[u8; 4]) -> Option<&'a [u8]> {
    boxes(parent).find(|(kind, _)| kind == wanted).map(|(_, bytes)| bytes)
}

/// The boxes in a box, each with its kind.
fn boxes(mut rest: &[u8]) -> impl Iterator<Item = ([u8; 4], &[u8])> {
    std::iter::from_fn(move || {
        let size = number(rest, 0)? as usize;
        let kind = rest.get(4..8)?.try_into().ok()?;
        let size = if size == 0 { rest.len() } else { size };
        let bytes = rest.get(8..size)?;
        rest = rest.get(size..)?;
        Some((kind, bytes))
    })
}

fn number(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..at + 4)?.try_into().ok().map(u32::from_be_bytes)
}
