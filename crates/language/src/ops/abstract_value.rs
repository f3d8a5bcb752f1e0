//! Abstract values: the properties of values that hold on every log, and how each operator changes them.

/// An abstraction of an expression's value on all frames, independent of the log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AbstractValue {
    /// Every element and component is this number; conditions are 0 and 1.
    Constant(f64),
    /// An array without slots.
    Empty,
    /// Anything.
    Unknown,
}

impl AbstractValue {
    /// A condition that never holds, and zero.
    pub const FALSE: Self = Self::Constant(0.0);
    /// A condition that always holds.
    pub const TRUE: Self = Self::Constant(1.0);

    /// A condition.
    pub const fn bool(value: bool) -> Self {
        if value { Self::TRUE } else { Self::FALSE }
    }

    /// Returns the value of a condition, or `None` if it depends on the log.
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

fn first(args: &[AbstractValue]) -> AbstractValue {
    args.first().copied().unwrap_or(AbstractValue::Unknown)
}

/// Nothing.
pub fn unknown(_: &[AbstractValue]) -> AbstractValue {
    AbstractValue::Unknown
}

/// What the first place is.
pub fn same(args: &[AbstractValue]) -> AbstractValue {
    first(args)
}

/// Zero for a constant value.
pub fn unchanging(args: &[AbstractValue]) -> AbstractValue {
    first(args).each(|_| 0.0)
}

/// A condition that never holds never reaches a duration or a count; one that always holds did not hold before the beginning.
pub fn lasting(args: &[AbstractValue]) -> AbstractValue {
    match first(args) {
        never @ (AbstractValue::FALSE | AbstractValue::Empty) => never,
        _ => AbstractValue::Unknown,
    }
}

/// Whether any element of an array holds.
pub fn any(args: &[AbstractValue]) -> AbstractValue {
    if first(args) == AbstractValue::Empty { AbstractValue::FALSE } else { first(args) }
}

/// Whether all elements of an array hold.
pub fn all(args: &[AbstractValue]) -> AbstractValue {
    if first(args) == AbstractValue::Empty { AbstractValue::TRUE } else { first(args) }
}

/// The absolute value.
pub fn abs(args: &[AbstractValue]) -> AbstractValue {
    first(args).each(f64::abs)
}

/// A value that is zero if all elements are zero, or without elements.
pub fn total(args: &[AbstractValue]) -> AbstractValue {
    let zero = |known: &AbstractValue| matches!(*known, AbstractValue::Empty | AbstractValue::FALSE);
    if args.iter().all(zero) { AbstractValue::FALSE } else { AbstractValue::Unknown }
}

/// The length of each element.
pub fn length(args: &[AbstractValue]) -> AbstractValue {
    if first(args) == AbstractValue::Empty { AbstractValue::Empty } else { total(args) }
}

/// A product of elements.
pub fn product(args: &[AbstractValue]) -> AbstractValue {
    if args.contains(&AbstractValue::FALSE) {
        AbstractValue::FALSE
    } else if args.contains(&AbstractValue::Empty) {
        AbstractValue::Empty
    } else {
        AbstractValue::Unknown
    }
}

/// A part of the first place.
pub fn part(args: &[AbstractValue]) -> AbstractValue {
    if args.contains(&AbstractValue::Empty) {
        AbstractValue::Empty
    } else if first(args) == AbstractValue::FALSE {
        AbstractValue::FALSE
    } else {
        AbstractValue::Unknown
    }
}

/// A vector of these components.
pub fn alike(args: &[AbstractValue]) -> AbstractValue {
    if args.contains(&AbstractValue::Empty) {
        AbstractValue::Empty
    } else if args.iter().all(|known| *known == first(args)) {
        first(args)
    } else {
        AbstractValue::Unknown
    }
}
