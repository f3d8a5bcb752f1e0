//! Loops over a block that the compiler turns into vector instructions. They are inlined into [`super::columns::Columns::run`], which is compiled
//! once for every instruction set of the processor family and picks one at run time; no product is fused with a sum, so all give the same bits.
//!
//! What a loop computes is put together from [`Lanes`] and written once, for numbers of either [width](crate::engine::width): columns of the other one are converted
//! in a register, and the differences and squares of a length are never written down.

use crate::engine::width::{Reads, Real};
use crate::language::rules::Comparison;
use crate::stream::frames::Values;

/// Frames that a loop takes at once: what the widest registers hold.
pub const ROW: usize = 8;

/// A number per frame of a block: a column, or what is made of some.
///
/// Loops go over rows by their position: iterators are not always inlined into code for other instructions than the program's own.
pub trait Lanes<R: Real>: Copy {
    /// The frames, a row at a time.
    type Rows: Rows<R>;
    /// The first `count` rows; all of them are there.
    fn rows(self, count: usize) -> Self::Rows;
    /// The first `len` frames; all of them are there.
    fn first(self, len: usize) -> Self;
    /// The number of a frame.
    fn at(self, frame: usize) -> R;
}

/// Rows of [`ROW`] frames.
pub trait Rows<R: Real>: Copy {
    /// The numbers of a row.
    fn row(self, at: usize) -> [R; ROW];
}

impl<'a, R: Real, T: Reads> Lanes<R> for &'a [T] {
    type Rows = &'a [[T; ROW]];

    #[inline(always)]
    fn rows(self, count: usize) -> Self::Rows {
        &self.as_chunks().0[..count]
    }

    #[inline(always)]
    fn first(self, len: usize) -> Self {
        &self[..len]
    }

    #[inline(always)]
    fn at(self, frame: usize) -> R {
        self[frame].read()
    }
}

impl<R: Real, T: Reads> Rows<R> for &[[T; ROW]] {
    #[inline(always)]
    fn row(self, at: usize) -> [R; ROW] {
        let mut row = [R::ZERO; ROW];
        let mut lane = 0;
        while lane < ROW {
            row[lane] = self[at][lane].read();
            lane += 1;
        }
        row
    }
}

/// Columns of different widths, which are asked one by one: for the few vectors that are made of such.
impl<'a, R: Real> Lanes<R> for Values<'a> {
    type Rows = Values<'a>;

    #[inline(always)]
    fn rows(self, _: usize) -> Self::Rows {
        self
    }

    #[inline(always)]
    fn first(self, _: usize) -> Self {
        self
    }

    #[inline(always)]
    fn at(self, frame: usize) -> R {
        R::of(self.get(frame).unwrap_or_default())
    }
}

impl<R: Real> Rows<R> for Values<'_> {
    fn row(self, at: usize) -> [R; ROW] {
        std::array::from_fn(|lane| R::of(self.get(at * ROW + lane).unwrap_or_default()))
    }
}

/// `f` of the numbers of some lanes.
#[derive(Clone, Copy)]
pub struct Of<L, F>(pub L, pub F);

macro_rules! of {
    ($($part:ident: $kind:ident $number:ident),+) => {
        impl<R: Real, $($kind: Lanes<R>,)+ F: Copy + Fn($($number),+) -> R> Lanes<R> for Of<($($kind,)+), F> {
            type Rows = Of<($($kind::Rows,)+), F>;

            #[inline(always)]
            fn rows(self, count: usize) -> Self::Rows {
                let Self(($($part,)+), f) = self;
                Of(($($part.rows(count),)+), f)
            }

            #[inline(always)]
            fn first(self, len: usize) -> Self {
                let Self(($($part,)+), f) = self;
                Self(($($part.first(len),)+), f)
            }

            #[inline(always)]
            fn at(self, frame: usize) -> R {
                let Self(($($part,)+), f) = self;
                f($($part.at(frame)),+)
            }
        }

        impl<R: Real, $($kind: Rows<R>,)+ F: Copy + Fn($($number),+) -> R> Rows<R> for Of<($($kind,)+), F> {
            #[inline(always)]
            fn row(self, at: usize) -> [R; ROW] {
                let Self(($($part,)+), f) = self;
                $(let $part = $part.row(at);)+
                let mut row = [R::ZERO; ROW];
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

of!(a: A R);
of!(a: A R, b: B R);
of!(a: A R, b: B R, c: C R);
of!(a: A R, b: B R, c: C R, d: D R, e: E R, g: G R);

/// The sum of some lanes, from the first to the last.
#[derive(Clone, Copy)]
pub struct Sum<L, const N: usize>(pub [L; N]);

impl<R: Real, L: Lanes<R>, const N: usize> Lanes<R> for Sum<L, N> {
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
    fn at(self, frame: usize) -> R {
        let mut sum = self.0[0].at(frame);
        let mut part = 1;
        while part < N {
            sum = sum + self.0[part].at(frame);
            part += 1;
        }
        sum
    }
}

impl<R: Real, L: Rows<R>, const N: usize> Rows<R> for Sum<L, N> {
    #[inline(always)]
    fn row(self, at: usize) -> [R; ROW] {
        let mut sums = self.0[0].row(at);
        let mut part = 1;
        while part < N {
            let row = self.0[part].row(at);
            let mut lane = 0;
            while lane < ROW {
                sums[lane] = sums[lane] + row[lane];
                lane += 1;
            }
            part += 1;
        }
        sums
    }
}

/// Runs an expression with columns as slices of the width that they have. Lists of columns are of one width, or else asked one by one.
macro_rules! with_slices {
    ([] $body:expr) => { $body };
    ([$name:ident = each $columns:expr; $($rest:tt)*] $body:expr) => {{
        let columns = $columns;
        if let Some($name) = columns.wide() {
            with_slices!([$($rest)*] $body)
        } else if let Some($name) = columns.narrow() {
            with_slices!([$($rest)*] $body)
        } else {
            let $name = columns;
            with_slices!([$($rest)*] $body)
        }
    }};
    ([$name:ident = $column:expr; $($rest:tt)*] $body:expr) => {
        match $column {
            Values::Wide($name) => with_slices!([$($rest)*] $body),
            Values::Narrow($name) => with_slices!([$($rest)*] $body),
        }
    };
}
pub(super) use with_slices;

/// Several columns.
pub trait Several<'a, const N: usize> {
    /// Their slices, when all are of 64 bits.
    fn wide(&self) -> Option<[&'a [f64]; N]>;
    /// Their slices, when all are of 32 bits.
    fn narrow(&self) -> Option<[&'a [f32]; N]>;
}

impl<'a, const N: usize> Several<'a, N> for [Values<'a>; N] {
    #[inline(always)]
    fn wide(&self) -> Option<[&'a [f64]; N]> {
        let mut slices: [&[f64]; N] = [&[]; N];
        for (slice, values) in slices.iter_mut().zip(self) {
            let Values::Wide(values) = values else { return None };
            *slice = values;
        }
        Some(slices)
    }

    #[inline(always)]
    fn narrow(&self) -> Option<[&'a [f32]; N]> {
        let mut slices: [&[f32]; N] = [&[]; N];
        for (slice, values) in slices.iter_mut().zip(self) {
            let Values::Narrow(values) = values else { return None };
            *slice = values;
        }
        Some(slices)
    }
}

/// Writes lanes down.
#[inline(always)]
pub fn write<R: Real>(lanes: impl Lanes<R>, out: &mut [R]) {
    put(lanes, out, |_, number| number);
}

/// Adds lanes to what is written.
#[inline(always)]
pub fn add<R: Real>(lanes: impl Lanes<R>, out: &mut [R]) {
    put(lanes, out, |sum, number| sum + number);
}

#[inline(always)]
fn put<R: Real>(lanes: impl Lanes<R>, out: &mut [R], f: impl Fn(R, R) -> R) {
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
pub fn squares<R: Real, L: Lanes<R>>([x, y, z]: [L; 3]) -> impl Lanes<R> {
    Of((x, y, z), |x: R, y: R, z: R| x * x + y * y + z * z)
}

/// The squared length of a difference.
#[inline(always)]
pub fn squared_distance<R: Real, A: Lanes<R>, B: Lanes<R>>(
    [ax, ay, az]: [A; 3],
    [bx, by, bz]: [B; 3],
) -> impl Lanes<R> {
    Of((ax, ay, az, bx, by, bz), |ax: R, ay: R, az: R, bx: R, by: R, bz: R| {
        let (x, y, z) = (ax - bx, ay - by, az - bz);
        x * x + y * y + z * z
    })
}

/// `ax * bx + ay * by + az * bz`.
#[inline(always)]
pub fn dot<R: Real, A: Lanes<R>, B: Lanes<R>>([ax, ay, az]: [A; 3], [bx, by, bz]: [B; 3]) -> impl Lanes<R> {
    Of((ax, ay, az, bx, by, bz), |ax: R, ay: R, az: R, bx: R, by: R, bz: R| ax * bx + ay * by + az * bz)
}

/// `lanes op constant` on the first `len` frames, a bit a frame.
#[inline(always)]
pub fn compare<R: Real>(comparison: Comparison, lanes: impl Lanes<R>, constant: R, len: usize, out: &mut [u64]) {
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
pub fn compare_both<R: Real>(comparison: Comparison, a: impl Lanes<R>, b: impl Lanes<R>, len: usize, out: &mut [u64]) {
    let one = |holds: bool| R::of(if holds { 1.0 } else { 0.0 });
    let is_one = |number: R| number > R::ZERO;
    match comparison {
        Comparison::Less => test(Of((a, b), |a: R, b: R| one(a < b)), len, out, is_one),
        Comparison::LessEqual => test(Of((a, b), |a: R, b: R| one(a <= b)), len, out, is_one),
        Comparison::Greater => test(Of((a, b), |a: R, b: R| one(a > b)), len, out, is_one),
        Comparison::GreaterEqual => test(Of((a, b), |a: R, b: R| one(a >= b)), len, out, is_one),
        Comparison::Equal => test(Of((a, b), |a: R, b: R| one(a == b)), len, out, is_one),
        Comparison::NotEqual => test(Of((a, b), |a: R, b: R| one(a != b)), len, out, is_one),
    }
}

/// Each lane of a row gathers the bits of its own frames in as many bits as its numbers have, so that nothing goes from lane to lane but at the end of a mask.
#[inline(always)]
fn test<R: Real>(lanes: impl Lanes<R>, len: usize, out: &mut [u64], f: impl Fn(R) -> bool) {
    let count = len / ROW;
    let rows = lanes.rows(count);
    let mut mask = 0;
    while mask * R::FRAMES < len {
        let (mut gathered, mut bits) = ([R::NONE; ROW], [R::FIRST; ROW]);
        let mut lane = 1;
        while lane < ROW {
            bits[lane] = bits[lane - 1] << 1;
            lane += 1;
        }
        let end = count.min((mask + 1) * (R::FRAMES / ROW));
        let mut at = mask * (R::FRAMES / ROW);
        while at < end {
            let row = rows.row(at);
            let mut lane = 0;
            while lane < ROW {
                gathered[lane] |= if f(row[lane]) { bits[lane] } else { R::NONE };
                bits[lane] = bits[lane] << ROW as u32;
                lane += 1;
            }
            at += 1;
        }
        let [a, b, c, d, e, f, g, h] = gathered;
        let found: u64 = (a | b | c | d | e | f | g | h).into();
        let first = mask * R::FRAMES;
        // A mask of half a word comes after the other half.
        out[first / 64] = if first % 64 == 0 { found } else { out[first / 64] | found << (first % 64) };
        mask += 1;
    }
    for frame in count * ROW..len {
        out[frame / 64] |= u64::from(f(lanes.at(frame))) << (frame % 64);
    }
}

/// Whether all frames are one number, bit for bit.
#[inline(always)]
pub fn stands_still(lanes: impl Lanes<f64>, number: f64, len: usize) -> bool {
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
