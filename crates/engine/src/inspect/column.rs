//! The value of an expression on frames of a stretch.

use crate::compiled::bits::{frames_of, get};
use std::rc::Rc;

/// The values of an expression, frame by frame. Truth is 1.0 and 0.0, an object its number; a value that is not an array has one slot.
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

    /// Whether it has a value per finger or contact.
    pub const fn is_array(&self) -> bool {
        self.is_array
    }

    /// Returns the number of slots.
    pub const fn slots(&self) -> usize {
        self.slots.len()
    }

    /// The numbers of a slot on a frame, counted from the first; empty beyond either.
    pub fn at(&self, slot: usize, frame: usize) -> &[f64] {
        let slot = self.slots.get(slot);
        slot.and_then(|slot| slot.get(frame * self.width..(frame + 1) * self.width)).unwrap_or(&[])
    }

    /// Returns the number of a slot on a frame; 0 without a number.
    pub fn number(&self, slot: usize, frame: usize) -> f64 {
        self.at(slot, frame).first().copied().unwrap_or(0.0)
    }

    /// Whether a slot holds on a frame.
    pub fn holds(&self, slot: usize, frame: usize) -> bool {
        self.number(slot, frame) > 0.5
    }
}

/// The bits of a condition over a stretch, a bit a frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Bits {
    words: Vec<u64>,
    len: usize,
}

impl Bits {
    /// Adds the first `len` bits.
    pub fn extend(&mut self, bits: &[u64], len: usize) {
        let shift = self.len % 64;
        for (word, bits) in bits.iter().enumerate().take(len.div_ceil(64)) {
            let bits = bits & frames_of(len, word);
            match self.words.last_mut().filter(|_| shift > 0) {
                Some(last) => {
                    *last |= bits << shift;
                    self.words.push(bits >> (64 - shift));
                }
                None => self.words.push(bits),
            }
        }
        self.len += len;
        self.words.truncate(self.len.div_ceil(64));
    }
}

/// A condition on every frame of a stretch.
#[derive(Clone, Debug)]
pub struct ConditionColumn {
    is_array: bool,
    /// The bits of each slot, and the offset of a frame's bit.
    slots: Vec<(Rc<Bits>, usize)>,
}

impl ConditionColumn {
    pub(super) const fn new(is_array: bool, slots: Vec<(Rc<Bits>, usize)>) -> Self {
        Self { is_array, slots }
    }

    /// As [`Column::is_array`].
    pub const fn is_array(&self) -> bool {
        self.is_array
    }

    /// Whether a slot holds on a frame, counted from the beginning of the stretch; false beyond either.
    pub fn holds(&self, slot: usize, frame: usize) -> bool {
        self.slots.get(slot).is_some_and(|(bits, delay)| frame + delay < bits.len && get(&bits.words, frame + delay))
    }

    /// The bits of a slot on the first `len` frames of the stretch, 64 frames a word, the first one lowest; bits beyond them are zero.
    pub fn words(&self, slot: usize, len: usize) -> Vec<u64> {
        let Some((bits, delay)) = self.slots.get(slot) else { return vec![0; len.div_ceil(64)] };
        let (skip, shift) = (delay / 64, delay % 64);
        let at = |word: usize| bits.words.get(word + skip).copied().unwrap_or(0);
        let next = |word: usize| if shift > 0 { at(word + 1) << (64 - shift) } else { 0 };
        (0..len.div_ceil(64)).map(|word| (at(word) >> shift | next(word)) & frames_of(len, word)).collect()
    }

    /// The last frame before this one on which a slot is otherwise than `holds`.
    pub fn last_otherwise(&self, slot: usize, frame: usize, holds: bool) -> Option<usize> {
        let (bits, delay) = self.slots.get(slot)?;
        let (first, end) = (*delay, (frame + delay).min(bits.len));
        let mut word = end.div_ceil(64);
        while word > first / 64 {
            word -= 1;
            let otherwise = if holds { !bits.words.get(word)? } else { *bits.words.get(word)? };
            let before = frames_of(end, word);
            let after = if word == first / 64 { !frames_of(first, word) } else { u64::MAX };
            let found = otherwise & before & after;
            if found != 0 {
                return Some(word * 64 + 63 - found.leading_zeros() as usize - delay);
            }
        }
        None
    }
}
