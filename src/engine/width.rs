//! In how many bits numbers are worked out: 64, or 32 where a sensor gives no more, which is twice as many at a time.
//!
//! In 32 bits every number is rounded to 32 bits: columns, the numbers of the rules (with what is made of them alone, like `2 * limit`, which is worked out in
//! 64 before), and what each single operation gives. Since 64 bits are more than twice
//! as many digits as 32, rounding after an operation in 64 bits is the same as the operation in 32: so the literal evaluator says what either means.

use crate::stream::frames::Values;
use std::ops::{Add, BitOr, BitOrAssign, Div, Mul, Neg, RangeInclusive, Shl, Sub};

/// How many bits numbers have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Width {
    /// 64.
    #[default]
    Wide,
    /// 32.
    Narrow,
}

impl Width {
    /// The nearest number of this width.
    #[inline]
    pub fn round(self, number: f64) -> f64 {
        match self {
            Self::Wide => number,
            Self::Narrow => f64::from(number as f32),
        }
    }
}

/// A number of one width.
pub trait Real:
    Copy
    + std::fmt::Debug
    + Default
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + 'static
{
    /// Which.
    const WIDTH: Width;
    /// Between these, the square of a number has all its digits.
    const SQUARES: RangeInclusive<f64>;
    /// Zero.
    const ZERO: Self;
    /// As many bits as it has, one a frame.
    type Mask: Copy + BitOr<Output = Self::Mask> + BitOrAssign + Shl<u32, Output = Self::Mask> + Into<u64>;
    /// No frame.
    const NONE: Self::Mask;
    /// The first frame.
    const FIRST: Self::Mask;
    /// How many frames a mask has.
    const FRAMES: usize;
    /// The nearest to one of 64 bits.
    fn of(number: f64) -> Self;
    /// The same number as one of 32 bits.
    fn of_narrow(number: f32) -> Self;
    /// In 64 bits.
    fn wide(self) -> f64;
    /// The root.
    fn sqrt(self) -> Self;
    /// Without its sign.
    fn abs(self) -> Self;
    /// The smaller; NaN loses.
    fn min(self, other: Self) -> Self;
    /// The larger; NaN loses.
    fn max(self, other: Self) -> Self;
    /// The angle of the point `(x, self)`, rad, worked out in 64 bits and rounded.
    fn atan2(self, x: Self) -> Self;
    /// The next one above.
    fn next_up(self) -> Self;
    /// The next one below.
    fn next_down(self) -> Self;
    /// A buffer of such numbers as values of a column.
    fn values(numbers: &[Self]) -> Values<'_>;
}

/// A number of a column as one that is worked with.
pub trait Reads: Copy {
    /// The nearest.
    fn read<R: Real>(self) -> R;
}

impl Reads for f64 {
    #[inline(always)]
    fn read<R: Real>(self) -> R {
        R::of(self)
    }
}

impl Reads for f32 {
    #[inline(always)]
    fn read<R: Real>(self) -> R {
        R::of_narrow(self)
    }
}

macro_rules! real {
    ($real:ty, $width:ident, $mask:ty, $squares:expr) => {
        impl Real for $real {
            const WIDTH: Width = Width::$width;
            const SQUARES: RangeInclusive<f64> = $squares;
            const ZERO: Self = 0.0;
            type Mask = $mask;
            const NONE: $mask = 0;
            const FIRST: $mask = 1;
            const FRAMES: usize = <$mask>::BITS as usize;

            #[inline(always)]
            fn of(number: f64) -> Self {
                number as Self
            }

            #[inline(always)]
            fn of_narrow(number: f32) -> Self {
                number.into()
            }

            #[inline(always)]
            fn wide(self) -> f64 {
                self.into()
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                self.sqrt()
            }

            #[inline(always)]
            fn abs(self) -> Self {
                self.abs()
            }

            #[inline(always)]
            fn min(self, other: Self) -> Self {
                self.min(other)
            }

            #[inline(always)]
            fn max(self, other: Self) -> Self {
                self.max(other)
            }

            fn atan2(self, x: Self) -> Self {
                Self::of(self.wide().atan2(x.wide()))
            }

            fn next_up(self) -> Self {
                self.next_up()
            }

            fn next_down(self) -> Self {
                self.next_down()
            }

            #[inline(always)]
            fn values(numbers: &[Self]) -> Values<'_> {
                Values::$width(numbers)
            }
        }
    };
}

real!(f64, Wide, u64, 1e-150..=1e150);
real!(f32, Narrow, u32, 1e-15..=1e15);
