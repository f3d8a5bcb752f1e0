//! Files of pictures: raw pixels become PNG, PNG and JPEG stay as they are; and the sizes that files say.

use super::picture::{Picture, PictureFormat};
use ::flate2::Compression;
use ::flate2::write::ZlibEncoder;
use std::borrow::Cow;
use std::io::Write as _;

/// The most pixels of a picture.
const MAX_PIXELS: usize = 1 << 26;

/// A picture as a file of PNG or JPEG.
///
/// # Errors
/// The reason why the picture has no file.
pub fn file<'a>(picture: &'a Picture) -> Result<Cow<'a, [u8]>, String> {
    match picture.format.clone()? {
        PictureFormat::Jpeg | PictureFormat::Png => Ok(Cow::Borrowed(&picture.bytes)),
        PictureFormat::Pixels { size, step, order } => png(&picture.bytes, size, step, order).map(Cow::Owned),
    }
}

/// Rows of pixels as PNG.
fn png(pixels: &[u8], [height, width]: [usize; 2], step: usize, order: ([usize; 3], usize)) -> Result<Vec<u8>, String> {
    let (colors, bytes) = order;
    let needed = height.saturating_sub(1).saturating_mul(step).saturating_add(width.saturating_mul(bytes));
    let is_size = (1..=MAX_PIXELS).contains(&height.saturating_mul(width)) && step >= width.saturating_mul(bytes);
    if !is_size || pixels.len() < needed {
        return Err(format!("a picture of {width} x {height} pixels has {} bytes, expected {needed}", pixels.len()));
    }
    let is_gray = bytes == 1;
    let mut rows = Vec::with_capacity(height * (1 + width * if is_gray { 1 } else { 3 }));
    for row in pixels.chunks(step).take(height) {
        // No filter.
        rows.push(0);
        for pixel in row.chunks_exact(bytes).take(width) {
            let color = |at: &usize| pixel.get(*at).copied().unwrap_or_default();
            let count = if is_gray { 1 } else { 3 };
            rows.extend(colors.iter().take(count).map(color));
        }
    }
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::fast());
    let packed = packed.write_all(&rows).and_then(|()| packed.finish());
    let packed = packed.map_err(|error| format!("a picture cannot be compressed: {error}"))?;
    let number = |value: usize| u32::try_from(value).unwrap_or(u32::MAX).to_be_bytes();
    let kind = if is_gray { 0 } else { 2 };
    let header = [&number(width)[..], &number(height), &[8, kind, 0, 0, 0]].concat();
    let mut file = vec![0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n'];
    for (name, bytes) in [(b"IHDR", header), (b"IDAT", packed), (b"IEND", Vec::new())] {
        file.extend(number(bytes.len()));
        let named = [&name[..], &bytes].concat();
        file.extend(&named);
        file.extend(crc32fast::hash(&named).to_be_bytes());
    }
    Ok(file)
}

/// Height, width and number of colors of a file of PNG or JPEG.
pub fn size(file: &[u8]) -> Option<[usize; 3]> {
    match file {
        [0x89, b'P', b'N', b'G', ..] => size_of_png(file),
        [0xff, 0xd8, rest @ ..] => size_of_jpeg(rest),
        _ => None,
    }
}

fn size_of_png(file: &[u8]) -> Option<[usize; 3]> {
    let number = |at: usize| file.get(at..at + 4)?.try_into().ok().map(u32::from_be_bytes).map(|value| value as usize);
    // The kind of colors: gray, rgb, palette, gray with alpha, rgb with alpha.
    let colors = match file.get(25)? {
        0 => 1,
        4 | 6 => return None,
        _ => 3,
    };
    Some([number(20)?, number(16)?, colors])
}

/// Reads the size from the header of the first frame, which follows segments with lengths.
fn size_of_jpeg(mut rest: &[u8]) -> Option<[usize; 3]> {
    loop {
        match rest {
            [0xff, 0xff, ..] => rest = rest.get(1..)?,
            // All kinds of frames but the three markers among them that are none.
            [0xff, 0xc0..=0xc3 | 0xc5..=0xc7 | 0xc9..=0xcb | 0xcd..=0xcf, _, _, _, h0, h1, w0, w1, colors, ..] => {
                let number = |high: u8, low: u8| usize::from(u16::from_be_bytes([high, low]));
                return Some([number(*h0, *h1), number(*w0, *w1), usize::from(*colors)]);
            }
            [0xff, _, high, low, ..] => {
                let length = usize::from(u16::from_be_bytes([*high, *low])).max(2);
                rest = rest.get(2 + length..)?;
            }
            _ => return None,
        }
    }
}
