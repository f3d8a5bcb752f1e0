//! Intervals of numbers.

use std::cmp::Ordering;

/// An interval: its ends, and whether each is excluded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    low: (f64, bool),
    high: (f64, bool),
}

impl Interval {
    // Ends are never -0, which would be less than 0.

    /// Anywhere.
    pub const ALL: Self = Self { low: (f64::NEG_INFINITY, false), high: (f64::INFINITY, false) };

    /// Above a number, which is left out when `open`.
    pub const fn above(low: f64, open: bool) -> Self {
        Self { low: (low + 0.0, open), ..Self::ALL }
    }

    /// Below a number, which is left out when `open`.
    pub const fn below(high: f64, open: bool) -> Self {
        Self { high: (high + 0.0, open), ..Self::ALL }
    }

    /// At one number.
    pub const fn at(value: f64) -> Self {
        Self { low: (value + 0.0, false), high: (value + 0.0, false) }
    }

    /// Returns the intersection; `None` if it is empty.
    pub fn with(self, other: Self) -> Option<Self> {
        let low = match self.low.0.total_cmp(&other.low.0) {
            Ordering::Less => other.low,
            Ordering::Greater => self.low,
            Ordering::Equal => (self.low.0, self.low.1 || other.low.1),
        };
        let high = match self.high.0.total_cmp(&other.high.0) {
            Ordering::Less => self.high,
            Ordering::Greater => other.high,
            Ordering::Equal => (self.high.0, self.high.1 || other.high.1),
        };
        let empty = low.0 > high.0 || low.0 >= high.0 && (low.1 || high.1);
        (!empty).then_some(Self { low, high })
    }

    /// Returns the interval of the whole numbers in it; `None` without any.
    pub fn whole(self) -> Option<Self> {
        let up = |(low, open): (f64, bool)| if open { low.floor() + 1.0 } else { low.ceil() };
        let down = |(high, open): (f64, bool)| if open { high.ceil() - 1.0 } else { high.floor() };
        Self { low: (up(self.low), false), high: (down(self.high), false) }.with(Self::ALL)
    }

    /// Returns the intervals below and above a number.
    pub fn around(self, number: f64) -> [Option<Self>; 2] {
        [Self::below(number, true), Self::above(number, true)].map(|side| self.with(side))
    }

    /// Whether a number lies here.
    pub fn holds(self, number: f64) -> bool {
        self.with(Self::at(number)).is_some()
    }

    /// Where two numbers are that lie in `one` and `other` and whose difference, the first one less the second one, has a sign of this
    /// interval; `None` for nowhere.
    pub fn between(self, one: Self, other: Self) -> Option<[Self; 2]> {
        let (mut one, mut other) = (one, other);
        // Not above zero: the first one is at most the second one, less when zero is left out.
        if self.high.0 <= 0.0 {
            let open = self.high.0 < 0.0 || self.high.1;
            one = one.with(Self::below(other.high.0, other.high.1 || open))?;
            other = other.with(Self::above(one.low.0, one.low.1 || open))?;
        }
        if self.low.0 >= 0.0 {
            let open = self.low.0 > 0.0 || self.low.1;
            one = one.with(Self::above(other.low.0, other.low.1 || open))?;
            other = other.with(Self::below(one.high.0, one.high.1 || open))?;
        }
        Some([one, other])
    }

    /// A number that lies here, with few digits when there is one; a whole one if asked for.
    pub fn number(self, whole: bool) -> f64 {
        let (low, high) = (self.low.0, self.high.0);
        // A number of the magnitude of the ends, above zero if the interval allows it.
        let number = match (low.is_finite(), high.is_finite()) {
            (true, true) => low + (high - low) / 2.0,
            (true, false) if low > 0.0 => low * 2.0,
            (true, false) if low < 0.0 => -low,
            (false, true) if high > 0.0 => high / 2.0,
            (false, true) if high < 0.0 => high * 2.0,
            (false, true) => -1.0,
            (_, false) => 1.0,
        };
        if whole {
            let down = number.floor() + 0.0;
            return if self.holds(down) { down } else { number.ceil() + 0.0 };
        }
        let short = format!("{number:.2e}").parse().ok().filter(|short| self.holds(*short));
        short.unwrap_or(number) + 0.0
    }
}
