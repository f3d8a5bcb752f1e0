//! Conditions over a block of frames as bits, 64 frames a word, and the operators with memory on them.
//!
//! Bits beyond the end of a block are garbage: readers of single bits mask them ([`frames_of`]).
//! A *restart* bit makes its frame the first one: what came before is forgotten.

/// The most frames that are evaluated at once.
pub const BLOCK: usize = 4096;
/// Words of a block.
pub const WORDS: usize = BLOCK / 64;

/// The bits of a condition over one block.
pub type Bits = [u64; WORDS];

/// Returns the number of words for `len` frames.
#[inline]
pub const fn words(len: usize) -> usize {
    len.div_ceil(64)
}

/// The bits of word `word` that are frames of a block of `len` frames.
#[inline]
pub const fn frames_of(len: usize, word: usize) -> u64 {
    let left = len.saturating_sub(word * 64);
    if left >= 64 { u64::MAX } else { (1 << left) - 1 }
}

/// One bit.
#[inline]
pub const fn get(bits: &[u64], at: usize) -> bool {
    bits[at / 64] >> (at % 64) & 1 != 0
}

/// Sets or clears one bit.
pub const fn put(bits: &mut Bits, at: usize, value: bool) {
    let mask = 1 << (at % 64);
    bits[at / 64] = if value { bits[at / 64] | mask } else { bits[at / 64] & !mask };
}

/// The bits one frame later: bit 0 is `before`, the last bit of the block before.
pub fn shifted(bits: &[u64], before: bool, out: &mut [u64]) {
    let mut carry = u64::from(before);
    for (out, word) in out.iter_mut().zip(bits) {
        *out = word << 1 | carry;
        carry = word >> 63;
    }
}

/// A flip-flop: on where `set`, else as on the frame before where `keep`, else off. Hysteresis and latches are this.
///
/// The chain "as on the frame before" runs through a word like the carry of an addition, so a word costs one addition.
pub fn flip_flop(set: &[u64], keep: &[u64], len: usize, memory: &mut bool, out: &mut [u64]) {
    let mut carry = *memory;
    for word in 0..words(len) {
        let (generate, propagate) = (set[word], set[word] | keep[word]);
        let (sum, over1) = generate.overflowing_add(propagate);
        let (sum, over2) = sum.overflowing_add(u64::from(carry));
        // The carry into each bit is what differs from the sum without carries; the carry out of a bit is its state.
        let carries_in = sum ^ generate ^ propagate;
        out[word] = generate | (propagate & carries_in);
        carry = over1 | over2;
    }
    if len > 0 {
        *memory = get(out, len - 1);
    }
}

/// Returns a word with `len` ones from the bit `start` on.
pub const fn ones(start: u64, len: u64) -> u64 {
    if len == 0 { 0 } else { (u64::MAX >> (64 - len)) << start }
}

/// The runs of equal bits of a word; a restart begins a new one.
pub struct Runs {
    bits: u64,
    restarts: u64,
    start: u64,
    end: u64,
}

/// A run of equal bits.
pub struct BitRun {
    /// Which.
    pub on: bool,
    /// Whether its first frame is a first one.
    pub restarts: bool,
    /// Its first bit.
    pub start: u64,
    /// Returns the number of bits.
    pub len: u64,
}

impl Runs {
    /// The runs of the first `len` bits.
    pub const fn of(bits: u64, restarts: u64, len: u32) -> Self {
        Self { bits, restarts, start: 0, end: len as u64 }
    }
}

impl Iterator for Runs {
    type Item = BitRun;

    fn next(&mut self) -> Option<BitRun> {
        if self.start >= self.end {
            return None;
        }
        let (start, rest) = (self.start, self.bits >> self.start);
        let on = rest & 1 != 0;
        let same = u64::from(if on { (!rest).trailing_zeros() } else { rest.trailing_zeros() });
        let anew = self.restarts >> start;
        let until = u64::from((anew >> 1).trailing_zeros()) + 1;
        let len = same.min(until).min(self.end - start);
        self.start += len;
        Some(BitRun { on, restarts: anew & 1 != 0, start, len })
    }
}

/// A delay line of bits: what goes in comes out `frames` frames later, false before.
#[derive(Clone, Debug)]
pub struct BitDelay {
    /// Returns the remaining bits, the oldest first; zero after the last one.
    held: Vec<u64>,
    frames: usize,
}

impl BitDelay {
    /// A line of this many frames, at least 1.
    pub fn new(frames: usize) -> Self {
        Self { held: vec![0; words(frames)], frames }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.held.fill(0);
    }

    /// Moves a block through.
    pub fn run(&mut self, bits: &[u64], len: usize, out: &mut [u64]) {
        // The held bits and the block form one sequence: its beginning is returned, its end is held.
        for (word, out) in out.iter_mut().enumerate() {
            let held = self.held.get(word).copied().unwrap_or(0);
            *out = held | (word * 64 + 64).checked_sub(self.frames).map_or(0, |end| up_to(bits, end));
        }
        for word in 0..self.held.len() {
            let from = len + word * 64;
            let held = word_at(&self.held, from);
            let fresh = (from + 64).checked_sub(self.frames).map_or(0, |end| up_to(bits, end));
            self.held[word] = (held | fresh) & frames_of(self.frames, word);
        }
    }
}

/// The 64 bits from one on; zeros beyond the last word.
fn word_at(bits: &[u64], from: usize) -> u64 {
    let (word, shift) = (from / 64, from % 64);
    let low = bits.get(word).map_or(0, |bits| bits >> shift);
    if shift == 0 { low } else { low | bits.get(word + 1).map_or(0, |bits| bits << (64 - shift)) }
}

/// The 64 bits that end before `end`; zeros before the first.
fn up_to(bits: &[u64], end: usize) -> u64 {
    match end.checked_sub(64) {
        Some(from) => word_at(bits, from),
        None if end == 0 => 0,
        None => bits.first().map_or(0, |bits| bits << (64 - end)),
    }
}

/// A delay line of numbers: what goes in comes out `frames` frames later, 0 before.
#[derive(Clone, Debug)]
pub struct NumberDelay {
    ring: Vec<f64>,
    at: usize,
}

impl NumberDelay {
    /// A line of this many frames, at least 1.
    pub fn new(frames: usize) -> Self {
        Self { ring: vec![0.0; frames], at: 0 }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.ring.fill(0.0);
        self.at = 0;
    }

    /// Moves a block through.
    pub fn run(&mut self, numbers: &[f64], out: &mut [f64]) {
        let (frames, len) = (self.ring.len(), numbers.len());
        let mut done = 0;
        while done < len {
            let step = (frames - self.at).min(len - done);
            let held = &mut self.ring[self.at..self.at + step];
            out[done..done + step].copy_from_slice(held);
            held.copy_from_slice(&numbers[done..done + step]);
            self.at = (self.at + step) % frames;
            done += step;
        }
    }

    /// Advances the state by a block without returning its result.
    pub fn pass(&mut self, numbers: &[f64]) {
        // Only what is still inside afterwards counts.
        let frames = self.ring.len();
        let mut done = numbers.len().saturating_sub(frames);
        while done < numbers.len() {
            let step = (frames - self.at).min(numbers.len() - done);
            self.ring[self.at..self.at + step].copy_from_slice(&numbers[done..done + step]);
            self.at = (self.at + step) % frames;
            done += step;
        }
    }
}
