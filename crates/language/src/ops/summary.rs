//! Summaries of a number over time: the mean, minimum, maximum, integral and earliest of its samples.

/// What is made of the samples of a number, scalar or vec3; of a condition, which is 1 where it holds and 0 elsewhere, a mean or an integral.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Summary {
    /// Their sum divided by how many they are.
    Mean,
    /// The least; NaN loses.
    Min,
    /// The largest; NaN loses.
    Max,
    /// Their sum divided by the rate of the log.
    Integral,
    /// The earliest.
    Earliest,
}

impl Summary {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Mean, Self::Min, Self::Max, Self::Integral, Self::Earliest];

    /// The one that is called so.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|summary| summary.name() == name)
    }

    /// Its name in the language.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mean => "mean",
            Self::Min => "min",
            Self::Max => "max",
            Self::Integral => "integral",
            Self::Earliest => "earliest",
        }
    }
}

/// The samples up to the current one over which a summary is computed. The types of duration and condition depend on the layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Samples<D, C> {
    /// `over last 200 ms`: the last `n`, as far as they are there; `n` is how many the duration has.
    Last(D),
    /// `since touching`: those from where the condition last began. Until it has begun, the current one alone, and an integral is zero.
    Since(C),
}

impl<D, C> Samples<D, C> {
    /// The duration.
    pub const fn last(&self) -> Option<&D> {
        match self {
            Self::Last(duration) => Some(duration),
            Self::Since(_) => None,
        }
    }

    /// The condition.
    pub const fn since(&self) -> Option<&C> {
        match self {
            Self::Last(_) => None,
            Self::Since(condition) => Some(condition),
        }
    }
}
