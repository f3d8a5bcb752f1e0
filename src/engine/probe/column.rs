//! The value of an expression on every frame of a stretch.

use std::ops::Range;

/// What an expression is, frame by frame. Truth is 1.0 and 0.0, an object its number; a value that is no array has one slot.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Numbers per element: 1, 3 of a vec3, 4 of a rotation.
    width: usize,
    is_array: bool,
    slots: Vec<Vec<f64>>,
}

impl Column {
    /// A column from its slots; each holds `width` numbers a frame.
    pub(super) const fn new(width: usize, is_array: bool, slots: Vec<Vec<f64>>) -> Self {
        Self { width, is_array, slots }
    }

    /// The same numbers on each of `len` frames.
    pub(super) fn constant(numbers: &[f64], len: usize) -> Self {
        Self::new(numbers.len(), false, vec![numbers.repeat(len)])
    }

    /// Whether it has a value per finger or contact.
    pub const fn is_array(&self) -> bool {
        self.is_array
    }

    /// How many slots it has.
    pub const fn slots(&self) -> usize {
        self.slots.len()
    }

    /// The numbers of a slot on a frame, counted from the beginning of the stretch; empty beyond either.
    pub fn at(&self, slot: usize, frame: usize) -> &[f64] {
        let slot = self.slots.get(slot);
        slot.and_then(|slot| slot.get(frame * self.width..(frame + 1) * self.width)).unwrap_or(&[])
    }

    /// The number of a slot on a frame; 0 where there is none.
    pub fn number(&self, slot: usize, frame: usize) -> f64 {
        self.at(slot, frame).first().copied().unwrap_or(0.0)
    }

    /// Whether a slot holds on a frame.
    pub fn holds(&self, slot: usize, frame: usize) -> bool {
        self.number(slot, frame) > 0.5
    }

    /// Some of its frames.
    pub(super) fn part(&self, frames: &Range<usize>) -> Self {
        let slots = self.slots.iter().map(|slot| {
            slot.get(frames.start * self.width..frames.end * self.width).map_or_else(Vec::new, <[f64]>::to_vec)
        });
        Self::new(self.width, self.is_array, slots.collect())
    }

    /// The slots as they are.
    pub(super) fn into_slots(self) -> Vec<Vec<f64>> {
        self.slots
    }

    pub(super) const fn width(&self) -> usize {
        self.width
    }

    /// A function of each element on each frame, which pushes `width` numbers.
    pub(super) fn each(&self, width: usize, f: impl Fn(&[f64], &mut Vec<f64>)) -> Self {
        self.each_slot(width, |slot| {
            let mut out = Vec::with_capacity(slot.len() / self.width * width);
            slot.chunks_exact(self.width).for_each(|element| f(element, &mut out));
            out
        })
    }

    /// A function of each slot over time.
    pub(super) fn each_slot(&self, width: usize, f: impl Fn(&[f64]) -> Vec<f64>) -> Self {
        Self::new(width, self.is_array, self.slots.iter().map(|slot| f(slot)).collect())
    }

    /// A function of two columns, slot by slot; a single value beside an array is used for every slot.
    pub(super) fn with(&self, other: &Self, width: usize, f: impl Fn(&[f64], &[f64], &mut Vec<f64>)) -> Self {
        let count = match (self.is_array, other.is_array) {
            (true, true) => self.slots().min(other.slots()),
            (true, false) => self.slots(),
            (false, true) => other.slots(),
            (false, false) => 1,
        };
        let pick = |column: &Self, slot: usize| if column.is_array { slot } else { 0 };
        let slots = (0..count).map(|slot| {
            let ours = self.slots.get(pick(self, slot)).map_or(&[][..], Vec::as_slice);
            let theirs = other.slots.get(pick(other, slot)).map_or(&[][..], Vec::as_slice);
            let mut out = Vec::with_capacity(ours.len() / self.width * width);
            let pairs = ours.chunks_exact(self.width).zip(theirs.chunks_exact(other.width));
            pairs.for_each(|(ours, theirs)| f(ours, theirs, &mut out));
            out
        });
        Self::new(width, self.is_array || other.is_array, slots.collect())
    }

    /// A number from all slots on each frame.
    pub(super) fn fold(&self, len: usize, f: impl Fn(&mut dyn Iterator<Item = f64>) -> f64) -> Self {
        let on = |frame: usize| f(&mut (0..self.slots()).map(|slot| self.number(slot, frame)));
        Self::new(1, false, vec![(0..len).map(on).collect()])
    }

    /// The sum of all slots, from the first to the last; zeros when there is none.
    pub(super) fn sum(&self, len: usize) -> Self {
        let mut slots = self.slots.iter();
        let mut total = slots.next().cloned().unwrap_or_else(|| vec![0.0; len * self.width]);
        for slot in slots {
            total.iter_mut().zip(slot).for_each(|(sum, number)| *sum += number);
        }
        Self::new(self.width, false, vec![total])
    }
}

/// A column of true and false that is only read any more, a bit a frame.
#[derive(Clone, Debug)]
pub struct Kept {
    is_array: bool,
    /// By slot, 64 frames a word.
    slots: Vec<Vec<u64>>,
}

impl Kept {
    /// Keeps a column whose elements are true or false.
    pub(super) fn of(column: &Column) -> Self {
        let word = |frames: &[f64]| frames.iter().rev().fold(0, |word, truth| word << 1 | u64::from(*truth > 0.5));
        let slots = column.slots.iter().map(|slot| slot.chunks(64).map(word).collect());
        Self { is_array: column.is_array, slots: slots.collect() }
    }

    /// How many words of memory it takes.
    pub(super) fn words(&self) -> usize {
        self.slots.iter().map(Vec::len).sum()
    }

    /// Some of its frames, as a column.
    pub(super) fn part(&self, frames: &Range<usize>) -> Column {
        let number = |slot: usize, frame: usize| if self.holds(slot, frame) { 1.0 } else { 0.0 };
        let slot = |slot: usize| frames.clone().map(|frame| number(slot, frame)).collect();
        Column::new(1, self.is_array, (0..self.slots.len()).map(slot).collect())
    }

    /// As [`Column::is_array`].
    pub const fn is_array(&self) -> bool {
        self.is_array
    }

    /// As [`Column::holds`].
    pub fn holds(&self, slot: usize, frame: usize) -> bool {
        let word = self.slots.get(slot).and_then(|words| words.get(frame / 64)).copied().unwrap_or(0);
        word >> (frame % 64) & 1 == 1
    }

    /// The last frame before this one on which a slot is otherwise than `holds`.
    pub fn last_otherwise(&self, slot: usize, frame: usize, holds: bool) -> Option<usize> {
        let words = self.slots.get(slot)?;
        let otherwise = |word: u64| if holds { !word } else { word };
        let before = |at: usize| if at == frame / 64 { (1 << (frame % 64)) - 1 } else { u64::MAX };
        let found = (0..=frame / 64).rev().filter_map(|at| Some((at, otherwise(*words.get(at)?) & before(at))));
        let (at, word) = { found }.find(|(_, word)| *word != 0)?;
        Some(at * 64 + 63 - word.leading_zeros() as usize)
    }
}
