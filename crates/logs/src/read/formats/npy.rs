//! NumPy's files: `.npz`, `.npy`, and folders of `.npy`. Each array with a row a sample has columns by its name, as the data sets of HDF5 have; the fields
//! of structured arrays are arrays of their own. A file with one array calls it `arr_0`, as `numpy.savez` does.

use super::array_attributes::ArrayAttributes;
use super::array_columns::width;
use super::array_log::{self, Array, MAX_RATE_HZ, Recording, rows};
use super::budget::Budget;
use super::elements::Element;
use crate::allowed_folders::AllowedFolders;
use crate::read::table::{MAX_COLUMNS, Source};
use npyz::{DType, NpyHeader, Order};
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;
use teachtree_base::guard::guarded;

/// The first bytes of a file with one array.
pub(super) const MAGIC: [u8; 6] = [0x93, b'N', b'U', b'M', b'P', b'Y'];
/// The longest description of an array, in bytes, and the deepest brackets in it.
const MAX_HEADER: usize = 1 << 16;
const DEEPEST: usize = 16;
/// The name of an array without a name.
const UNNAMED: &str = "arr_0";
/// Arrays of one number that are a step in s.
const STEPS: [&str; 2] = ["dt", "timestep"];

/// Opens a file with one array, which must be in `folders`.
///
/// # Errors
/// When it is damaged, is outside of the folders, or holds no array with a row a sample.
pub(super) fn open(path: &Path, folders: &AllowedFolders) -> Result<Source, InputError> {
    let place = path.display().to_string();
    guarded(&place, || arrays(&place, vec![(UNNAMED.into(), ArrayLocation::new(path, None, folders))], size_of(path)?))
}

/// Opens a file with several arrays, by their names in the archive.
///
/// # Errors
/// As [`open`].
pub(super) fn open_archive(path: &Path, folders: &AllowedFolders) -> Result<Source, InputError> {
    let place = path.display().to_string();
    guarded(&place, || {
        let archive = super::zip_archive::open(path, folders)?;
        let found: Vec<(String, usize)> = (0..archive.len())
            .filter_map(|at| Some((archive.name_for_index(at)?.ok()?.strip_suffix(".npy")?.to_string(), at)))
            .collect();
        let in_archive = |(name, at)| (name, ArrayLocation::new(path, Some(at), folders));
        arrays(&place, found.into_iter().map(in_archive).collect(), size_of(path)?)
    })
}

/// Opens a folder whose files are arrays, by their names without ending.
///
/// # Errors
/// As [`open`].
pub(super) fn open_folder(folder: &Path, files: &[PathBuf], folders: &AllowedFolders) -> Result<Source, InputError> {
    let place = folder.display().to_string();
    guarded(&place, || {
        let name = |file: &PathBuf| file.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        let place_of = |file: &PathBuf| ArrayLocation::new(file, None, folders);
        let found: Vec<_> = files.iter().filter_map(|file| Some((name(file)?, place_of(file)))).collect();
        let size = files.iter().map(|file| size_of(file)).sum::<Result<u64, InputError>>()?;
        arrays(&place, found, size)
    })
}

fn size_of(path: &Path) -> Result<u64, InputError> {
    let read = std::fs::metadata(path).map(|file| file.len());
    read.map_err(|error| InputError::unreadable(path.display().to_string(), &error))
}

/// The location of an array.
#[derive(Clone)]
struct ArrayLocation {
    path: PathBuf,
    /// The number of the file, if the path is an archive.
    in_archive: Option<usize>,
    /// The folders that the path must be in.
    folders: AllowedFolders,
}

impl ArrayLocation {
    fn new(path: &Path, in_archive: Option<usize>, folders: &AllowedFolders) -> Self {
        Self { path: path.into(), in_archive, folders: folders.clone() }
    }

    /// Does something with the bytes.
    fn with<T>(&self, place: &str, read: impl FnOnce(&mut dyn Read) -> Result<T, InputError>) -> Result<T, InputError> {
        match self.in_archive {
            None => read(&mut BufReader::new(self.folders.open(&self.path)?)),
            Some(at) => {
                let mut archive: super::zip_archive::Archive = super::zip_archive::open(&self.path, &self.folders)?;
                let mut file = archive.by_index(at).map_err(|error| super::zip_archive::damaged(place, &error))?;
                read(&mut file)
            }
        }
    }
}

/// The arrays as a recording; `size` is that of the file.
fn arrays(place: &str, mut found: Vec<(String, ArrayLocation)>, size: u64) -> Result<Source, InputError> {
    if found.len() > MAX_COLUMNS {
        let message = format!("found {} arrays, at most {MAX_COLUMNS} are read", found.len());
        return Err(InputError::new(place, message));
    }
    found.sort_by(|(a, _), (b, _)| a.cmp(b));
    let alone = found.len() == 1;
    let (mut arrays, mut rate_hz) = (vec![], None);
    let mut budget = Budget::new(size);
    for (name, at) in found {
        let of = if alone { place.to_string() } else { format!("{place} array {name}") };
        let header = at.with(&of, |bytes| header(&of, bytes))?;
        let Some((rows, inner)) = header.shape.split_first() else {
            rate_hz = rate_hz.or(rate(&of, &name, &at, &header)?);
            continue;
        };
        for mut field in header.fields() {
            let name = match field.name.as_str() {
                "" => name.clone(),
                field if alone => field.to_string(),
                field => format!("{name}/{field}"),
            };
            let dimensions: Vec<usize> = inner.iter().chain(&field.dimensions).copied().collect();
            let element = match field.element.clone() {
                Ok(element) => element,
                Err(reason) => {
                    arrays.push(Array::refused(name, *rows, &dimensions, reason));
                    continue;
                }
            };
            let texts = element.is_text();
            let Some(width) = width(&dimensions).filter(|width| !texts || *width == 1) else { continue };
            let fits = budget.take(rows.checked_mul(width), element.size, texts) && budget.has(header.bytes());
            if !fits {
                arrays.push(Array::refused(name, *rows, &dimensions, Budget::REFUSED));
                continue;
            }
            field.dimensions = dimensions.clone();
            let values = Box::new(Values { place: of.clone(), at: at.clone(), header: header.clone(), field, element });
            arrays.push(Array::new(name, *rows, &dimensions, texts, &ArrayAttributes::default(), values)?);
        }
    }
    let rows = rows(&arrays, None);
    let most = budget.whole;
    Recording { place: place.into(), arrays, rows, most, rate_hz, time: None, computed: None }.source()
}

/// The rate that an array of one number says, by its name.
fn rate(place: &str, name: &str, at: &ArrayLocation, header: &Header) -> Result<Option<f64>, InputError> {
    let is_step = STEPS.contains(&name);
    let fields = header.fields();
    let [Field { element: Ok(element), .. }] = fields.as_slice() else { return Ok(None) };
    let element = *element;
    if !is_step && !super::array_log::RATES.contains(&name) || element.is_text() {
        return Ok(None);
    }
    let bytes = at.with(place, |bytes| data(place, bytes, header, element.size))?;
    let value = element.number(&bytes);
    let rate = if is_step { 1.0 / value } else { value };
    Ok(Some(rate).filter(|rate| *rate > 0.0 && *rate <= MAX_RATE_HZ))
}

/// The storage of an array.
#[derive(Clone)]
struct Header {
    /// Number of bytes before its values.
    length: usize,
    shape: Vec<usize>,
    fortran: bool,
    dtype: DType,
    /// The bytes of an element, with all its fields.
    element_size: usize,
}

/// A part of the elements of an array: a field of a structured array, or all of them.
#[derive(Clone)]
struct Field {
    /// Empty for an array without fields.
    name: String,
    /// Its offset in an element.
    offset: usize,
    element: Result<Element, String>,
    /// Its own dimensions; then those of the array after the first one as well.
    dimensions: Vec<usize>,
}

/// Reads the description of an array.
fn header(place: &str, bytes: &mut dyn Read) -> Result<Header, InputError> {
    let wrong = |message: String| InputError::new(place, message);
    let damaged = |error: std::io::Error| InputError::new(place, format!("cannot be read as an array: {error}"));
    let mut text = vec![0; 12];
    bytes.read_exact(text.get_mut(..10).unwrap_or_default()).map_err(damaged)?;
    if !text.starts_with(&MAGIC) {
        return Err(wrong("begins like no array of NumPy".into()));
    }
    let [.., major, _, a, b, _, _] = text.as_slice() else { return Err(wrong("is not an array".into())) };
    let (begin, length) = match *major {
        1 => (10, usize::from(u16::from_le_bytes([*a, *b]))),
        2 | 3 => {
            let (a, b) = (*a, *b);
            bytes.read_exact(text.get_mut(10..).unwrap_or_default()).map_err(damaged)?;
            let [.., c, d] = text.as_slice() else { return Err(wrong("is not an array".into())) };
            (12, u32::from_le_bytes([a, b, *c, *d]) as usize)
        }
        other => return Err(wrong(format!("is of version {other} of the format, expected 1 to 3"))),
    };
    if length > MAX_HEADER {
        return Err(wrong(format!("has a description of {length} bytes, at most {MAX_HEADER} are read")));
    }
    text.resize(begin + length, 0);
    bytes.read_exact(text.get_mut(begin..).unwrap_or_default()).map_err(damaged)?;
    // The parser is recursive in brackets.
    let mut depth = 0_usize;
    for byte in text.get(begin..).unwrap_or_default() {
        depth = match byte {
            b'(' | b'[' | b'{' => depth + 1,
            b')' | b']' | b'}' => depth.saturating_sub(1),
            _ => depth,
        };
        if depth > DEEPEST {
            return Err(wrong(format!("has a description with more than {DEEPEST} nested brackets")));
        }
    }
    let read = NpyHeader::from_reader(text.as_slice()).map_err(damaged)?;
    let shape = read.shape().iter().map(|size| usize::try_from(*size).unwrap_or(usize::MAX)).collect();
    let (dtype, fortran) = (read.dtype(), read.order() == Order::Fortran);
    let element_size = dtype.num_bytes().unwrap_or(0);
    Ok(Header { length: begin + length, shape, fortran, dtype, element_size })
}

impl Header {
    /// The bytes of all its values.
    fn bytes(&self) -> Option<usize> {
        self.shape.iter().try_fold(self.element_size, |product, size| product.checked_mul(*size))
    }

    /// The fields of its elements; one without a name where they have none.
    fn fields(&self) -> Vec<Field> {
        let mut fields = vec![];
        spread(&self.dtype, String::new(), &mut 0, vec![], &mut fields);
        fields
    }
}

/// Finds the fields of a type, with those of fields that are structured themselves.
fn spread(dtype: &DType, name: String, offset: &mut usize, mut dimensions: Vec<usize>, fields: &mut Vec<Field>) {
    if fields.len() > MAX_COLUMNS {
        return;
    }
    match dtype {
        DType::Plain(of) => {
            let element = Element::of_numpy(of);
            let size = of.num_bytes().unwrap_or(0);
            // Padding between fields has no name.
            let fills = name.is_empty() && !fields.is_empty() || name.ends_with('/');
            if !fills {
                fields.push(Field { name, offset: *offset, element, dimensions: dimensions.clone() });
            }
            let count = dimensions.iter().fold(1_usize, |product, size| product.saturating_mul(*size));
            *offset = offset.saturating_add(size.saturating_mul(count));
        }
        DType::Array(count, inner) => {
            dimensions.push(usize::try_from(*count).unwrap_or(usize::MAX));
            if matches!(**inner, DType::Record(_)) {
                let reason = "has fields in an array in a field, which are not read".to_string();
                fields.push(Field { name, offset: *offset, element: Err(reason), dimensions });
                *offset = offset.saturating_add(dtype.num_bytes().unwrap_or(0));
            } else {
                spread(inner, name, offset, dimensions, fields);
            }
        }
        DType::Record(of) => {
            for field in of {
                let name = if name.is_empty() { field.name.clone() } else { format!("{name}/{}", field.name) };
                spread(&field.dtype, name, offset, vec![], fields);
            }
        }
    }
}

/// Reads the first `size` bytes of the values of an array.
fn data(place: &str, bytes: &mut dyn Read, header: &Header, size: usize) -> Result<Vec<u8>, InputError> {
    let failed = |error: std::io::Error| InputError::new(place, format!("cannot be read: {error}"));
    std::io::copy(&mut bytes.take(header.length as u64), &mut std::io::sink()).map_err(failed)?;
    let mut values = Vec::new();
    bytes.take(size as u64).read_to_end(&mut values).map_err(failed)?;
    if values.len() < size {
        let message = format!("ends after {} bytes of values, expected {size}", values.len());
        return Err(InputError::new(place, message));
    }
    Ok(values)
}

/// The values of an array, or of a field of it.
struct Values {
    place: String,
    at: ArrayLocation,
    header: Header,
    field: Field,
    element: Element,
}

impl Values {
    /// Does something with the bytes of each value, row by row.
    fn each(&self, first_row: bool, mut each: impl FnMut(&[u8])) -> Result<(), InputError> {
        let Self { place, at, header, field, element } = self;
        let rows = header.shape.first().copied().unwrap_or(0);
        let width: usize = header.shape.iter().skip(1).product();
        let first_row = first_row && !header.fortran;
        let all = header.bytes().unwrap_or(0);
        let bytes = if first_row { all.checked_div(rows).unwrap_or(0) } else { all };
        let bytes = at.with(place, |source| data(place, source, header, bytes))?;
        let of_field: usize = field.dimensions.iter().skip(header.shape.len().saturating_sub(1)).product();
        // The stride of each dimension, in elements.
        let mut strides = vec![0; header.shape.len()];
        let mut step = 1;
        let last = header.shape.len();
        for at in 0..last {
            let at = if header.fortran { at } else { last - 1 - at };
            if let (Some(stride), Some(size)) = (strides.get_mut(at), header.shape.get(at)) {
                *stride = step;
                step *= *size;
            }
        }
        for row in 0..if first_row { rows.min(1) } else { rows } {
            for inner in 0..width {
                let (mut place, mut rest) = (row * strides.first().copied().unwrap_or(0), inner);
                for (size, stride) in header.shape.iter().zip(&strides).skip(1).rev() {
                    place += rest % size * stride;
                    rest /= size;
                }
                for part in 0..of_field {
                    let from = place * header.element_size + field.offset + part * element.size;
                    each(bytes.get(from..from + element.size).unwrap_or_default());
                }
            }
        }
        Ok(())
    }
}

impl array_log::ArrayValues for Values {
    fn numbers(&self, first_row: bool) -> Result<Vec<f64>, InputError> {
        let mut numbers = vec![];
        self.each(first_row, |bytes| numbers.push(self.element.number(bytes)))?;
        Ok(numbers)
    }

    fn texts(&self) -> Result<Vec<String>, InputError> {
        let mut texts = vec![];
        self.each(false, |bytes| texts.push(self.element.text(bytes)))?;
        Ok(texts)
    }
}
