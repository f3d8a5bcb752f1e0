//! Pictures in messages of bags: their bytes, and how these are to be read.

use crate::read::memory_table::{Cells, InMemoryTable};
use std::borrow::Cow;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};

/// The encoding of a picture's bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFormat {
    /// A file of JPEG.
    Jpeg,
    /// A file of PNG.
    Png,
    /// Rows of pixels of `step` bytes.
    Pixels {
        /// Number of rows and of pixels in a row.
        size: [usize; 2],
        /// Bytes from one row to the next.
        step: usize,
        /// The offsets of red, green and blue in a pixel, and its size in bytes.
        order: ([usize; 3], usize),
    },
}

/// A picture in a message.
#[derive(Clone, Debug)]
pub struct Picture<'a> {
    /// Its bytes as the message has them.
    pub bytes: Cow<'a, [u8]>,
    /// Their encoding, or the reason why it is not supported.
    pub format: Result<PictureFormat, String>,
}

impl<'a> Picture<'a> {
    /// The picture of the message in the last row; `None` for messages of other kinds, such as clouds of points.
    pub(super) fn of(rows: &InMemoryTable, bytes: Cow<'a, [u8]>) -> Option<Self> {
        let text = |name: &str| match rows.columns().get(name) {
            Some(Cells::Texts(texts)) if texts.len() == rows.rows() => texts.last().map(String::as_str),
            _ => None,
        };
        let number =
            |name: &str| last(rows, name).filter(|value| (0.0..1e6).contains(value)).map(|value| value as usize);
        if let (Some(encoding), Some(height), Some(width)) = (text("encoding"), number("height"), number("width")) {
            let step = number("step");
            let format = order(encoding)
                .map(|order| PictureFormat::Pixels {
                    size: [height, width],
                    step: step.unwrap_or(width * order.1),
                    order,
                })
                .ok_or_else(|| format!("its pixels are `{encoding}`, expected rgb8, bgr8, rgba8, bgra8 or mono8"));
            return Some(Self { bytes, format });
        }
        let name = text("format")?;
        let format = match &*bytes {
            [0xff, 0xd8, 0xff, ..] => Ok(PictureFormat::Jpeg),
            [0x89, b'P', b'N', b'G', ..] => Ok(PictureFormat::Png),
            _ => Err(format!("its pictures are encoded as `{name}`, expected JPEG or PNG")),
        };
        Some(Self { bytes, format })
    }
}

/// Returns the offsets of the colors in a pixel, and its size in bytes.
fn order(encoding: &str) -> Option<([usize; 3], usize)> {
    match encoding {
        "rgb8" | "8UC3" => Some(([0, 1, 2], 3)),
        "bgr8" => Some(([2, 1, 0], 3)),
        "rgba8" => Some(([0, 1, 2], 4)),
        "bgra8" => Some(([2, 1, 0], 4)),
        "mono8" | "8UC1" => Some(([0, 0, 0], 1)),
        _ => None,
    }
}

/// A number that only equal pictures share, all but surely.
pub fn digest(bytes: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    bytes.hash(&mut hasher);
    hasher.finish()
}

/// The number of a column in the last row.
fn last(rows: &InMemoryTable, name: &str) -> Option<f64> {
    let values = rows.columns().get(name).and_then(Cells::numbers)?;
    values.last().copied().filter(|_| values.len() == rows.rows())
}
