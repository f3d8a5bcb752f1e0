//! An array in chunks: which chunks some rows are in, and their values.

use super::super::array_log::MissingRows;
use super::super::elements::Element;
use super::codecs::DimensionOrder;
use super::metadata::Layout;
use super::store::Store;
use std::ops::Range;
use std::rc::Rc;
use teachtree_base::error::InputError;

/// How many bytes more than its values a chunk may have on the way: heads and check sums.
const AROUND: usize = 1 << 16;

/// An array whose chunks are not read yet.
pub(super) struct ChunkedArray {
    store: Rc<Store>,
    place: String,
    path: String,
    shape: Vec<usize>,
    layout: Layout,
}

impl ChunkedArray {
    /// The array of a path.
    pub fn new(store: Rc<Store>, place: &str, path: &str, shape: Vec<usize>, layout: Layout) -> Self {
        Self { store, place: place.into(), path: path.into(), shape, layout }
    }

    /// Its path in the store.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Its first dimension.
    pub fn rows(&self) -> usize {
        self.shape.first().copied().unwrap_or(0)
    }

    /// The dimensions behind the first one.
    pub fn dimensions(&self) -> &[usize] {
        self.shape.get(1..).unwrap_or_default()
    }

    /// How its elements are stored.
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

    /// The file of a chunk.
    fn key(&self, chunk: &[usize]) -> String {
        let Layout { prefix, separator, .. } = &self.layout;
        let numbers: Vec<String> = chunk.iter().map(ToString::to_string).collect();
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
        Ok(places(&self.grid(&rows)).map(|chunk| self.key(&chunk)).collect())
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
            // What of the chunk is in the rows.
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
        let chunks: Vec<Vec<usize>> = places(&self.grid(rows)).collect();
        let missing: Vec<&Vec<usize>> = chunks.iter().filter(|chunk| !self.store.has(&self.key(chunk))).collect();
        let (first, last) = (missing.first()?, missing.last()?);
        let size = self.layout.chunk.first().copied().unwrap_or(1);
        let row = |chunk: usize| (chunk * size).clamp(rows.start, rows.end) - rows.start;
        let [first_row, last_row] = [first, last].map(|chunk| chunk.first().copied().unwrap_or(0));
        let (key, fill) = (self.key(first), self.layout.fill);
        let read = if fill.is_nan() { "not measured".to_string() } else { format!("the fill value {fill}") };
        let message = format!(
            "missing chunks: {} of {}, first `{key}`; they read as {read}, which is correct only if the writer omitted them because all values are equal to that",
            missing.len(),
            chunks.len()
        );
        Some(MissingRows { rows: row(first_row)..row(last_row + 1), message })
    }

    /// The bytes of a chunk, if it is there.
    fn chunk(&self, chunk: &[usize]) -> Result<Option<Vec<u8>>, InputError> {
        let key = self.key(chunk);
        let wrong = |message: String| InputError::new(format!("{} chunk {key}", self.place), message);
        let wanted = self.chunk_bytes().ok_or_else(|| wrong("is too large".into()))?;
        // What does not pack well is a little longer than it was.
        let around = wanted.saturating_add(wanted / 8).saturating_add(AROUND);
        let Some(mut bytes) = self.store.get(&key, around as u64)? else { return Ok(None) };
        for (after, codec) in self.layout.codecs.iter().enumerate().rev() {
            bytes = codec.undo(&bytes, if after == 0 { wanted } else { around }).map_err(wrong)?;
        }
        if bytes.len() != wanted {
            return Err(wrong(format!("has {} bytes of values, expected {wanted}", bytes.len())));
        }
        Ok(Some(bytes))
    }
}

/// How many elements apart those next to each other in each dimension are.
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
