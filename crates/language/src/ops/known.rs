//! What is known of values without a log, and what each operator makes of it.

/// What is known of a value on all frames of a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Known {
    /// Every element and component is this number; conditions are 0 and 1.
    Constant(f64),
    /// An array without slots.
    Empty,
    /// Anything.
    Unknown,
}

impl Known {
    /// A condition that never holds, and zero.
    pub const FALSE: Self = Self::Constant(0.0);
    /// A condition that always holds.
    pub const TRUE: Self = Self::Constant(1.0);

    /// A condition.
    pub const fn bool(value: bool) -> Self {
        if value { Self::TRUE } else { Self::FALSE }
    }

    /// Whether a condition holds, where that is known.
    pub fn truth(self) -> Option<bool> {
        match self {
            Self::Constant(value) => Some(value > 0.5),
            Self::Empty | Self::Unknown => None,
        }
    }

    /// A function of each element.
    pub fn each(self, function: impl Fn(f64) -> f64) -> Self {
        match self {
            Self::Constant(value) => Self::Constant(function(value)),
            other => other,
        }
    }
}

fn first(args: &[Known]) -> Known {
    args.first().copied().unwrap_or(Known::Unknown)
}

/// Nothing.
pub fn unknown(_: &[Known]) -> Known {
    Known::Unknown
}

/// What the first place is.
pub fn same(args: &[Known]) -> Known {
    first(args)
}

/// Zero for what does not change.
pub fn unchanging(args: &[Known]) -> Known {
    first(args).each(|_| 0.0)
}

/// What never holds never does so long or so often; what always holds did not hold before the beginning.
pub fn lasting(args: &[Known]) -> Known {
    match first(args) {
        never @ (Known::FALSE | Known::Empty) => never,
        _ => Known::Unknown,
    }
}

/// Whether any element of an array holds.
pub fn any(args: &[Known]) -> Known {
    if first(args) == Known::Empty { Known::FALSE } else { first(args) }
}

/// Whether all elements of an array hold.
pub fn all(args: &[Known]) -> Known {
    if first(args) == Known::Empty { Known::TRUE } else { first(args) }
}

/// The absolute value.
pub fn abs(args: &[Known]) -> Known {
    first(args).each(f64::abs)
}

/// What is zero when all of it is zero, or when there is nothing.
pub fn total(args: &[Known]) -> Known {
    let zero = |known: &Known| matches!(*known, Known::Empty | Known::FALSE);
    if args.iter().all(zero) { Known::FALSE } else { Known::Unknown }
}

/// The length of each element.
pub fn length(args: &[Known]) -> Known {
    if first(args) == Known::Empty { Known::Empty } else { total(args) }
}

/// A product of elements.
pub fn product(args: &[Known]) -> Known {
    if args.contains(&Known::FALSE) {
        Known::FALSE
    } else if args.contains(&Known::Empty) {
        Known::Empty
    } else {
        Known::Unknown
    }
}

/// A part of the first place.
pub fn part(args: &[Known]) -> Known {
    if args.contains(&Known::Empty) {
        Known::Empty
    } else if first(args) == Known::FALSE {
        Known::FALSE
    } else {
        Known::Unknown
    }
}

/// A vector of these components.
pub fn alike(args: &[Known]) -> Known {
    if args.contains(&Known::Empty) {
        Known::Empty
    } else if args.iter().all(|known| *known == first(args)) {
        first(args)
    } else {
        Known::Unknown
    }
}
