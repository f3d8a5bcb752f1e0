//! Loops over a block that the compiler turns into vector instructions. They are inlined into [`super::columns::Columns::run`], which is compiled
//! once for every instruction set of the processor family and picks one at run time; no product is fused with a sum, so all give the same bits.
//!
//! Loops are composed of [`Lanes`]: the differences and squares of a length are never stored.

use teachtree_language::rules::Comparison;

/// Frames that a loop takes at once: what the widest registers hold.
pub const ROW: usize = 8;

/// A number per frame of a block: a column, or what is made of some.
///
/// Loops go over rows by their position: iterators are not always inlined into code for other instructions than the program's own.
pub trait Lanes: Copy {
    /// The frames, a row at a time.
    type Rows: Rows;
    /// The first `count` rows; all of them are there.
    fn rows(self, count: usize) -> Self::Rows;
    /// The first `len` frames; all of them are there.
    fn first(self, len: usize) -> Self;
    /// The number of a frame.
    fn at(self, frame: usize) -> f64;
}

/// Rows of [`ROW`] frames.
pub trait Rows: Copy {
    /// The numbers of a row.
    fn row(self, at: usize) -> [f64; ROW];
}

impl<'a> Lanes for &'a [f64] {
    type Rows = &'a [[f64; ROW]];

    #[inline(always)]
    fn rows(self, count: usize) -> Self::Rows {
        &self.as_chunks().0[..count]
    }

    #[inline(always)]
    fn first(self, len: usize) -> Self {
        &self[..len]
    }

    #[inline(always)]
    fn at(self, frame: usize) -> f64 {
        self[frame]
    }
}

impl Rows for &[[f64; ROW]] {
    #[inline(always)]
    fn row(self, at: usize) -> [f64; ROW] {
        self[at]
    }
}

/// `f` of the numbers of some lanes.
#[derive(Clone, Copy)]
pub struct Map<L, F>(pub L, pub F);

macro_rules! of {
    ($($part:ident: $kind:ident $number:ty),+) => {
        impl<$($kind: Lanes,)+ F: Copy + Fn($($number),+) -> f64> Lanes for Map<($($kind,)+), F> {
            type Rows = Map<($($kind::Rows,)+), F>;

            #[inline(always)]
            fn rows(self, count: usize) -> Self::Rows {
                let Self(($($part,)+), f) = self;
                Map(($($part.rows(count),)+), f)
            }

            #[inline(always)]
            fn first(self, len: usize) -> Self {
                let Self(($($part,)+), f) = self;
                Self(($($part.first(len),)+), f)
            }

            #[inline(always)]
            fn at(self, frame: usize) -> f64 {
                let Self(($($part,)+), f) = self;
                f($($part.at(frame)),+)
            }
        }

        impl<$($kind: Rows,)+ F: Copy + Fn($($number),+) -> f64> Rows for Map<($($kind,)+), F> {
            #[inline(always)]
            fn row(self, at: usize) -> [f64; ROW] {
                let Self(($($part,)+), f) = self;
                $(let $part = $part.row(at);)+
                let mut row = [0.0; ROW];
                let mut lane = 0;
                while lane < ROW {
                    row[lane] = f($($part[lane]),+);
                    lane += 1;
                }
                row
            }
        }
    };
}

of!(a: A f64);
of!(a: A f64, b: B f64);
of!(a: A f64, b: B f64, c: C f64);
of!(a: A f64, b: B f64, c: C f64, d: D f64, e: E f64, g: G f64);

/// The sum of some lanes, from the first to the last.
#[derive(Clone, Copy)]
pub struct Sum<L, const N: usize>(pub [L; N]);

impl<L: Lanes, const N: usize> Lanes for Sum<L, N> {
    type Rows = Sum<L::Rows, N>;

    #[inline(always)]
    fn rows(self, count: usize) -> Self::Rows {
        Sum(self.0.map(|part| part.rows(count)))
    }

    #[inline(always)]
    fn first(self, len: usize) -> Self {
        Self(self.0.map(|part| part.first(len)))
    }

    #[inline(always)]
    fn at(self, frame: usize) -> f64 {
        let mut sum = self.0[0].at(frame);
        let mut part = 1;
        while part < N {
            sum += self.0[part].at(frame);
            part += 1;
        }
        sum
    }
}

impl<L: Rows, const N: usize> Rows for Sum<L, N> {
    #[inline(always)]
    fn row(self, at: usize) -> [f64; ROW] {
        let mut sums = self.0[0].row(at);
        let mut part = 1;
        while part < N {
            let row = self.0[part].row(at);
            let mut lane = 0;
            while lane < ROW {
                sums[lane] += row[lane];
                lane += 1;
            }
            part += 1;
        }
        sums
    }
}

/// Writes lanes down.
#[inline(always)]
pub fn write(lanes: impl Lanes, out: &mut [f64]) {
    put(lanes, out, |_, number| number);
}

/// Adds lanes to what is written.
#[inline(always)]
pub fn add(lanes: impl Lanes, out: &mut [f64]) {
    put(lanes, out, |sum, number| sum + number);
}

#[inline(always)]
fn put(lanes: impl Lanes, out: &mut [f64], f: impl Fn(f64, f64) -> f64) {
    let len = out.len();
    let numbers = lanes.first(len);
    let mut frame = 0;
    while frame < len {
        out[frame] = f(out[frame], numbers.at(frame));
        frame += 1;
    }
}

/// `x² + y² + z²`.
#[inline(always)]
pub fn squares<L: Lanes>([x, y, z]: [L; 3]) -> impl Lanes {
    Map((x, y, z), |x: f64, y: f64, z: f64| x * x + y * y + z * z)
}

/// The squared length of a difference.
#[inline(always)]
pub fn squared_distance<A: Lanes, B: Lanes>([ax, ay, az]: [A; 3], [bx, by, bz]: [B; 3]) -> impl Lanes {
    Map((ax, ay, az, bx, by, bz), |ax: f64, ay: f64, az: f64, bx: f64, by: f64, bz: f64| {
        let (x, y, z) = (ax - bx, ay - by, az - bz);
        x * x + y * y + z * z
    })
}

/// `ax * bx + ay * by + az * bz`.
#[inline(always)]
pub fn dot<A: Lanes, B: Lanes>([ax, ay, az]: [A; 3], [bx, by, bz]: [B; 3]) -> impl Lanes {
    Map((ax, ay, az, bx, by, bz), |ax: f64, ay: f64, az: f64, bx: f64, by: f64, bz: f64| ax * bx + ay * by + az * bz)
}

/// `lanes op constant` on the first `len` frames, a bit a frame.
#[inline(always)]
pub fn compare(comparison: Comparison, lanes: impl Lanes, constant: f64, len: usize, out: &mut [u64]) {
    match comparison {
        Comparison::Less => test(lanes, len, out, |number| number < constant),
        Comparison::LessEqual => test(lanes, len, out, |number| number <= constant),
        Comparison::Greater => test(lanes, len, out, |number| number > constant),
        Comparison::GreaterEqual => test(lanes, len, out, |number| number >= constant),
        Comparison::Equal => test(lanes, len, out, |number| number == constant),
        Comparison::NotEqual => test(lanes, len, out, |number| number != constant),
    }
}

/// `lanes op lanes` on the first `len` frames, a bit a frame. Which comparison it is must be known outside of the loop.
#[inline(always)]
pub fn compare_both(comparison: Comparison, a: impl Lanes, b: impl Lanes, len: usize, out: &mut [u64]) {
    let one = |holds: bool| if holds { 1.0 } else { 0.0 };
    let is_one = |number: f64| number > 0.0;
    match comparison {
        Comparison::Less => test(Map((a, b), |a: f64, b: f64| one(a < b)), len, out, is_one),
        Comparison::LessEqual => test(Map((a, b), |a: f64, b: f64| one(a <= b)), len, out, is_one),
        Comparison::Greater => test(Map((a, b), |a: f64, b: f64| one(a > b)), len, out, is_one),
        Comparison::GreaterEqual => test(Map((a, b), |a: f64, b: f64| one(a >= b)), len, out, is_one),
        Comparison::Equal => test(Map((a, b), |a: f64, b: f64| one(a == b)), len, out, is_one),
        Comparison::NotEqual => test(Map((a, b), |a: f64, b: f64| one(a != b)), len, out, is_one),
    }
}

/// Each lane of a row gathers the bits of its own frames, so that nothing goes from lane to lane but at the end of a word.
#[inline(always)]
fn test(lanes: impl Lanes, len: usize, out: &mut [u64], f: impl Fn(f64) -> bool) {
    let count = len / ROW;
    let rows = lanes.rows(count);
    let mut word = 0;
    while word * 64 < len {
        let (mut gathered, mut bits) = ([0_u64; ROW], [1_u64; ROW]);
        let mut lane = 1;
        while lane < ROW {
            bits[lane] = bits[lane - 1] << 1;
            lane += 1;
        }
        let end = count.min((word + 1) * (64 / ROW));
        let mut at = word * (64 / ROW);
        while at < end {
            let row = rows.row(at);
            let mut lane = 0;
            while lane < ROW {
                gathered[lane] |= if f(row[lane]) { bits[lane] } else { 0 };
                bits[lane] <<= ROW;
                lane += 1;
            }
            at += 1;
        }
        let [a, b, c, d, e, f, g, h] = gathered;
        out[word] = a | b | c | d | e | f | g | h;
        word += 1;
    }
    for frame in count * ROW..len {
        out[frame / 64] |= u64::from(f(lanes.at(frame))) << (frame % 64);
    }
}

/// Whether all frames are one number, bit for bit.
#[inline(always)]
pub fn stands_still(lanes: impl Lanes, number: f64, len: usize) -> bool {
    let lanes = lanes.first(len);
    let (mut differs, mut frame) = (0, 0);
    while frame < len {
        differs |= lanes.at(frame).to_bits() ^ number.to_bits();
        frame += 1;
    }
    differs == 0
}

/// Whether at least `wanted` of these bits are set, frame by frame; at most 255 of them.
#[inline(always)]
pub fn at_least<'a>(conditions: impl Iterator<Item = &'a [u64]> + Clone, wanted: u32, out: &mut [u64]) {
    for (word, out) in out.iter_mut().enumerate() {
        // The counts of 64 frames, in binary: one word a digit.
        let mut digits = [0_u64; 8];
        for condition in conditions.clone() {
            let mut carry = condition[word];
            for digit in &mut digits {
                (*digit, carry) = (*digit ^ carry, *digit & carry);
            }
        }
        let (mut more, mut same) = (0, u64::MAX);
        for (place, digit) in digits.iter().enumerate().rev() {
            if wanted >> place & 1 != 0 {
                same &= digit;
            } else {
                more |= same & digit;
                same &= !digit;
            }
        }
        *out = more | same;
    }
}
