//! An array in chunks: which chunks some rows are in, and their values.

use super::super::array_log::MissingRows;
use super::super::elements::Element;
use super::codecs::DimensionOrder;
use super::metadata::Layout;
use super::shards::Shards;
use super::store::Store;
use std::cell::RefCell;
use std::ops::Range;
use std::rc::Rc;
use teachtree_base::error::InputError;

/// Maximum overhead of an encoded chunk, bytes: headers and checksums.
const AROUND: usize = 1 << 16;

/// An array whose chunks are not read yet.
pub(super) struct ChunkedArray {
    store: Rc<Store>,
    place: String,
    path: String,
    shape: Vec<usize>,
    layout: Layout,
    /// The shard that was read last, with its file: its chunks are mostly read one after the other.
    shard: RefCell<Option<(String, Rc<Vec<u8>>)>>,
}

impl ChunkedArray {
    /// The array of a path.
    pub fn new(store: Rc<Store>, place: &str, path: &str, shape: Vec<usize>, layout: Layout) -> Self {
        Self { store, place: place.into(), path: path.into(), shape, layout, shard: RefCell::default() }
    }

    /// Its path in the store.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Its first dimension.
    pub fn rows(&self) -> usize {
        self.shape.first().copied().unwrap_or(0)
    }

    /// The dimensions after the first one.
    pub fn dimensions(&self) -> &[usize] {
        self.shape.get(1..).unwrap_or_default()
    }

    /// The storage of its elements.
    pub fn element(&self) -> Element {
        self.layout.element
    }

    /// The bytes of a chunk.
    pub fn chunk_bytes(&self) -> Option<usize> {
        self.layout.chunk.iter().try_fold(self.layout.element.size, |product, size| product.checked_mul(*size))
    }

    /// The numbers of the chunks that some rows are in, in each dimension.
    fn grid(&self, rows: &Range<usize>) -> Vec<Range<usize>> {
        let sizes = self.shape.iter().zip(&self.layout.chunk).enumerate();
        sizes
            .map(|(at, (size, chunk))| {
                let (start, end) = if at == 0 { (rows.start, rows.end.min(*size)) } else { (0, *size) };
                start / chunk..end.div_ceil(*chunk)
            })
            .collect()
    }

    /// The shape of the content of a file: a chunk or a shard.
    fn file_shape(&self) -> &[usize] {
        self.layout.shards.as_ref().map_or(&self.layout.chunk, |shards| &shards.shape)
    }

    /// The number of the file of a chunk, in each dimension.
    fn file_of(&self, chunk: &[usize]) -> Vec<usize> {
        match &self.layout.shards {
            Some(shards) => {
                chunk.iter().zip(shards.chunks(&self.layout.chunk)).map(|(at, count)| at / count.max(1)).collect()
            }
            None => chunk.to_vec(),
        }
    }

    /// The numbers of the files that some rows are in, in each dimension.
    fn files(&self, rows: &Range<usize>) -> Vec<Range<usize>> {
        let sizes = self.shape.iter().zip(self.file_shape()).enumerate();
        sizes
            .map(|(at, (size, file))| {
                let (start, end) = if at == 0 { (rows.start, rows.end.min(*size)) } else { (0, *size) };
                start / file..end.div_ceil(*file)
            })
            .collect()
    }

    /// The file of a number.
    fn key(&self, file: &[usize]) -> String {
        let Layout { prefix, separator, .. } = &self.layout;
        let numbers: Vec<String> = file.iter().map(ToString::to_string).collect();
        let numbers = numbers.join(&separator.to_string());
        let name = if prefix.is_empty() { numbers } else { format!("{prefix}{separator}{numbers}") };
        if self.path.is_empty() { name } else { format!("{}/{name}", self.path) }
    }

    /// The files that some rows are read from, whether they are there or not.
    ///
    /// # Errors
    /// When they are more than any array has that can be read.
    pub fn keys(&self, rows: Range<usize>) -> Result<Vec<String>, InputError> {
        let (count, per_row) = (rows.len(), self.dimensions().iter().product::<usize>());
        if per_row > super::super::array_columns::MAX_WIDTH || count == 0 {
            return Ok(vec![]);
        }
        crate::read::table::check_size(&self.place, count, per_row)?;
        Ok(places(&self.files(&rows)).map(|file| self.key(&file)).collect())
    }

    /// The values of some rows, row by row, of which `value` makes each of its bytes.
    fn each<T: Clone>(
        &self,
        rows: &Range<usize>,
        fill: T,
        value: impl Fn(Element, &[u8]) -> T,
    ) -> Result<Vec<T>, InputError> {
        let Layout { chunk: shape, element, order, .. } = &self.layout;
        let width: usize = self.dimensions().iter().product();
        let mut values = vec![fill; rows.len() * width];
        let steps = steps(shape, order);
        for chunk in places(&self.grid(rows)) {
            let Some(bytes) = self.chunk(&chunk)? else { continue };
            let first: Vec<usize> = chunk.iter().zip(shape).map(|(number, size)| number * size).collect();
            // The part of the chunk within the rows.
            let mut spans: Vec<Range<usize>> = vec![];
            for ((first, size), whole) in first.iter().zip(shape).zip(&self.shape) {
                let (start, end) = if spans.is_empty() { (rows.start, rows.end.min(*whole)) } else { (0, *whole) };
                spans.push(start.saturating_sub(*first)..(*size).min(end.saturating_sub(*first)));
            }
            for at in places(&spans) {
                let from = at.iter().zip(&steps).map(|(at, step)| at * step).sum::<usize>() * element.size;
                let mut to = 0;
                for (which, ((at, first), size)) in at.iter().zip(&first).zip(&self.shape).enumerate() {
                    to = if which == 0 { at + first - rows.start } else { to * size + at + first };
                }
                if let (Some(slot), Some(bytes)) = (values.get_mut(to), bytes.get(from..from + element.size)) {
                    *slot = value(*element, bytes);
                }
            }
        }
        Ok(values)
    }

    /// The numbers of some rows, row by row.
    ///
    /// # Errors
    /// When a chunk is damaged.
    pub fn numbers(&self, rows: Range<usize>) -> Result<Vec<f64>, InputError> {
        self.each(&rows, self.layout.fill, Element::number)
    }

    /// The texts of some rows.
    ///
    /// # Errors
    /// When a chunk is damaged.
    pub fn texts(&self, rows: Range<usize>) -> Result<Vec<String>, InputError> {
        self.each(&rows, String::new(), Element::text)
    }

    /// Returns the missing chunks of a range of rows.
    pub fn missing(&self, rows: &Range<usize>) -> Option<MissingRows> {
        let chunks: Vec<Vec<usize>> = places(&self.files(rows)).collect();
        let missing: Vec<&Vec<usize>> = chunks.iter().filter(|file| !self.store.has(&self.key(file))).collect();
        let (first, last) = (missing.first()?, missing.last()?);
        let size = self.file_shape().first().copied().unwrap_or(1);
        let row = |chunk: usize| (chunk * size).clamp(rows.start, rows.end) - rows.start;
        let [first_row, last_row] = [first, last].map(|chunk| chunk.first().copied().unwrap_or(0));
        let (key, fill) = (self.key(first), self.layout.fill);
        let read = if fill.is_nan() { "not measured".to_string() } else { format!("the fill value {fill}") };
        let message = format!(
            "missing chunks: {} of {}, first `{key}`; they read as {read}, which is correct only if the writer omitted them because all values are equal to it",
            missing.len(),
            chunks.len()
        );
        Some(MissingRows { rows: row(first_row)..row(last_row + 1), message })
    }

    /// The packed bytes of a chunk in a shard with this file, at most `most` of them, if it is there.
    fn of_shard(
        &self,
        shards: &Shards,
        key: &str,
        chunk: &[usize],
        most: usize,
    ) -> Result<Option<Vec<u8>>, InputError> {
        let wrong = |message: String| InputError::new(format!("{} chunk {key}", self.place), message);
        let Some(shard) = self.shard(shards, key, most)? else { return Ok(None) };
        let counts = shards.chunks(&self.layout.chunk);
        let within: Vec<usize> = chunk.iter().zip(&counts).map(|(at, count)| at % (*count).max(1)).collect();
        let Some(range) = shards.find(&shard, &self.layout.chunk, &within).map_err(wrong)? else { return Ok(None) };
        if range.len() > most {
            return Err(wrong(format!("has a chunk of {} bytes, expected at most {most}", range.len())));
        }
        Ok(shard.get(range).map(<[u8]>::to_vec))
    }

    /// The bytes of a shard, if it is there; a chunk of it has at most `most`.
    fn shard(&self, shards: &Shards, key: &str, most: usize) -> Result<Option<Rc<Vec<u8>>>, InputError> {
        if let Some((known, shard)) = &*self.shard.borrow()
            && known == key
        {
            return Ok(Some(Rc::clone(shard)));
        }
        let wrong = |message: String| InputError::new(format!("{} chunk {key}", self.place), message);
        let chunks = shards.chunks(&self.layout.chunk).into_iter().fold(1, usize::saturating_mul);
        let whole = chunks.saturating_mul(most).saturating_add(shards.index_bytes(&self.layout.chunk));
        let Some(mut bytes) = self.store.get(key, around(whole) as u64)? else { return Ok(None) };
        for codec in shards.codecs.iter().rev() {
            bytes = codec.undo(&bytes, whole).map_err(wrong)?;
        }
        let shard = Rc::new(bytes);
        *self.shard.borrow_mut() = Some((key.to_string(), Rc::clone(&shard)));
        Ok(Some(shard))
    }

    /// The bytes of a chunk, if it is there.
    fn chunk(&self, chunk: &[usize]) -> Result<Option<Vec<u8>>, InputError> {
        let key = self.key(&self.file_of(chunk));
        let wrong = |message: String| InputError::new(format!("{} chunk {key}", self.place), message);
        let wanted = self.chunk_bytes().ok_or_else(|| wrong("is too large".into()))?;
        let around = around(wanted);
        let found = match &self.layout.shards {
            Some(shards) => self.of_shard(shards, &key, chunk, around)?,
            None => self.store.get(&key, around as u64)?,
        };
        let Some(mut bytes) = found else { return Ok(None) };
        for (after, codec) in self.layout.codecs.iter().enumerate().rev() {
            bytes = codec.undo(&bytes, if after == 0 { wanted } else { around }).map_err(wrong)?;
        }
        if bytes.len() != wanted {
            return Err(wrong(format!("has {} bytes of values, expected {wanted}", bytes.len())));
        }
        Ok(Some(bytes))
    }
}

/// Maximum number of bytes of encoded values: incompressible data become a little longer.
fn around(wanted: usize) -> usize {
    wanted.saturating_add(wanted / 8).saturating_add(AROUND)
}

/// Returns the stride of each dimension, in elements.
fn steps(shape: &[usize], order: &DimensionOrder) -> Vec<usize> {
    let fastest: Vec<usize> = match order {
        DimensionOrder::RowMajor => (0..shape.len()).rev().collect(),
        DimensionOrder::ColumnMajor => (0..shape.len()).collect(),
        DimensionOrder::Transposed(order) => order.iter().rev().copied().collect(),
    };
    let (mut steps, mut step) = (vec![0; shape.len()], 1);
    for at in fastest {
        if let (Some(slot), Some(size)) = (steps.get_mut(at), shape.get(at)) {
            *slot = step;
            step *= *size;
        }
    }
    steps
}

/// All places in these ranges, the last number changing fastest.
fn places(ranges: &[Range<usize>]) -> impl Iterator<Item = Vec<usize>> {
    let count: usize = ranges.iter().map(Range::len).product();
    (0..count).map(move |number| {
        let mut rest = number;
        let mut place: Vec<usize> = ranges.iter().map(|range| range.start).collect();
        for (slot, range) in place.iter_mut().zip(ranges).rev() {
            *slot += rest % range.len();
            rest /= range.len();
        }
        place
    })
}
