//! Conditions over a block of frames as bits, 64 frames a word, and the operators with memory on them.
//!
//! Bits beyond the end of a block are garbage: whoever looks at single bits masks them away ([`frames_of`]).
//! A *restart* bit makes its frame the first one: what came before is forgotten.

/// The most frames that are evaluated at once.
pub const BLOCK: usize = 512;
/// Words of a block.
pub const WORDS: usize = BLOCK / 64;

/// The bits of a condition over one block.
pub type Bits = [u64; WORDS];

/// How many words `len` frames take.
pub const fn words(len: usize) -> usize {
    len.div_ceil(64)
}

/// The bits of word `word` that are frames of a block of `len` frames.
pub const fn frames_of(len: usize, word: usize) -> u64 {
    let left = len.saturating_sub(word * 64);
    if left >= 64 { u64::MAX } else { (1 << left) - 1 }
}

/// One bit.
pub const fn get(bits: &Bits, at: usize) -> bool {
    bits[at / 64] >> (at % 64) & 1 != 0
}

/// Sets or clears one bit.
pub const fn put(bits: &mut Bits, at: usize, value: bool) {
    let mask = 1 << (at % 64);
    bits[at / 64] = if value { bits[at / 64] | mask } else { bits[at / 64] & !mask };
}

/// The bits one frame later: bit 0 is `before`, the last bit of the block before.
pub fn shifted(bits: &Bits, before: bool, out: &mut Bits) {
    let mut carry = u64::from(before);
    for (out, word) in out.iter_mut().zip(bits) {
        *out = word << 1 | carry;
        carry = word >> 63;
    }
}

/// A flip-flop: on where `set`, else as on the frame before where `keep`, else off. Hysteresis and latches are this.
///
/// The chain "as on the frame before" runs through a word like the carry of an addition, so a word costs one addition.
pub fn flip_flop(set: &Bits, keep: &Bits, len: usize, memory: &mut bool, out: &mut Bits) {
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

/// Counts how long a condition has held, up to a limit: the memory of `for` and `within last`.
///
/// `count` is the number of frames since the condition was last false (for `for`) or true (for `within last`).
pub struct Held<'a> {
    /// The frames so far, at most `limit`.
    pub count: &'a mut u64,
    /// The window, in frames, at least 1.
    pub limit: u64,
}

impl Held<'_> {
    /// True on each of the last `limit` frames.
    pub fn throughout(self, condition: &Bits, restart: Option<&Bits>, len: usize, out: &mut Bits) {
        let Self { count, limit } = self;
        for word in 0..words(len) {
            let inside = frames_of(len, word);
            let restarts = restart.map_or(0, |bits| bits[word]) & inside;
            let held = condition[word] & inside;
            if restarts == 0 && held == 0 {
                *count = 0;
                out[word] = 0;
            } else if restarts == 0 && held == u64::MAX && *count >= limit {
                out[word] = u64::MAX;
            } else {
                let mut result = 0;
                for run in Runs::of(held, restarts, inside.count_ones()) {
                    *count = if run.restarts { 0 } else { *count };
                    // The frame of the run on which the window is full.
                    let full = limit.saturating_sub(*count + 1);
                    if run.on && full < run.len {
                        result |= ones(run.start + full, run.len - full);
                    }
                    *count = if run.on { (*count + run.len).min(limit) } else { 0 };
                }
                out[word] = result;
            }
        }
    }

    /// True on at least one of the last `limit` frames. `count` begins at `limit`: nothing has been true yet.
    pub fn at_least_once(self, condition: &Bits, restart: Option<&Bits>, len: usize, out: &mut Bits) {
        let Self { count, limit } = self;
        for word in 0..words(len) {
            let inside = frames_of(len, word);
            let restarts = restart.map_or(0, |bits| bits[word]) & inside;
            let held = condition[word] & inside;
            if restarts == 0 && held == 0 && *count >= limit {
                out[word] = 0;
            } else if restarts == 0 && held == u64::MAX {
                *count = 0;
                out[word] = u64::MAX;
            } else {
                let mut result = 0;
                for run in Runs::of(held, restarts, inside.count_ones()) {
                    *count = if run.restarts { limit } else { *count };
                    // For how many frames of the run the last true one is near enough.
                    let near = if run.on { run.len } else { limit.saturating_sub(*count + 1).min(run.len) };
                    result |= ones(run.start, near);
                    *count = if run.on { 0 } else { (*count + run.len).min(limit) };
                }
                out[word] = result;
            }
        }
    }
}

/// So many ones from a bit on.
const fn ones(start: u64, len: u64) -> u64 {
    if len == 0 { 0 } else { (u64::MAX >> (64 - len)) << start }
}

/// The runs of equal bits of a word; a restart begins a new one.
struct Runs {
    bits: u64,
    restarts: u64,
    start: u64,
    end: u64,
}

struct BitRun {
    on: bool,
    /// Whether its first frame is a first one.
    restarts: bool,
    start: u64,
    len: u64,
}

impl Runs {
    const fn of(bits: u64, restarts: u64, len: u32) -> Self {
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
    ring: Vec<u64>,
    frames: usize,
    at: usize,
}

impl BitDelay {
    /// A line of this many frames, at least 1.
    pub fn new(frames: usize) -> Self {
        Self { ring: vec![0; words(frames)], frames, at: 0 }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.ring.fill(0);
        self.at = 0;
    }

    /// Moves a block through.
    pub fn run(&mut self, bits: &Bits, len: usize, out: &mut Bits) {
        let mut frame = 0;
        while frame < len {
            // As many bits as lie in one word of the ring, one word of the block, and before the ring's end.
            let (word, bit) = (self.at / 64, self.at % 64);
            let step = (64 - bit).min(64 - frame % 64).min(self.frames - self.at).min(len - frame);
            let mask = if step == 64 { u64::MAX } else { (1 << step) - 1 };
            let incoming = bits[frame / 64] >> (frame % 64) & mask;
            let outgoing = self.ring[word] >> bit & mask;
            self.ring[word] = self.ring[word] & !(mask << bit) | incoming << bit;
            out[frame / 64] = out[frame / 64] & !(mask << (frame % 64)) | outgoing << (frame % 64);
            self.at = (self.at + step) % self.frames;
            frame += step;
        }
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
        if frames <= len {
            // All that is held comes out, then what has just gone in.
            let (later, first) = self.ring.split_at(self.at);
            out[..first.len()].copy_from_slice(first);
            out[first.len()..frames].copy_from_slice(later);
            out[frames..len].copy_from_slice(&numbers[..len - frames]);
            self.ring.copy_from_slice(&numbers[len - frames..]);
            self.at = 0;
            return;
        }
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
}
