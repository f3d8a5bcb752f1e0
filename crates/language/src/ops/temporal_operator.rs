//! Operators on a condition over time. The layers differ only in the type of the constants, so they share one generic type.

use super::{Operand, Operator, by_name};

/// An operator over time on a condition, with its constants as the layer has them: syntax, [`Constant`](crate::rules::Constant), numbers by
/// their bits, or samples.
///
/// With `n` the samples of a duration, the current one among them:
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TemporalOperator<C> {
    /// True on each of the last `n` frames; false until `n` frames have been seen.
    For(C),
    /// True on at least one of the last `n` frames.
    WithinLast(C),
    /// True on at least one of the `n` frames that begin with this one; cut at the end.
    WithinNext(C),
    /// True on at least one of the last `n` frames, and on at least one of the `n` frames that begin with this one.
    Bridging(C),
    /// The frame is one of `n` frames in a row on which it is true.
    Lasting(C),
    /// The condition began on at least `times` of the last `n` frames. It begins on a frame on which it holds when it did not hold on the frame before, or
    /// when this is the first frame of a stretch or of what a restart begins.
    AtLeast {
        /// The required number of beginnings.
        times: C,
        /// The duration.
        within: C,
    },
    /// True now, false on the frame before; false on a first frame.
    Rises,
    /// False now, true on the frame before; false on a first frame.
    Falls,
}

impl<C> TemporalOperator<C> {
    /// Returns the operator with this name, [`Operator::name`]; `None` for an unknown name or other constants.
    pub fn new(name: &str, constants: Vec<C>) -> Option<Self> {
        let mut constants = constants.into_iter();
        let temporal = match (name, constants.next(), constants.next()) {
            ("for", Some(duration), None) => Self::For(duration),
            ("within last", Some(duration), None) => Self::WithinLast(duration),
            ("within next", Some(duration), None) => Self::WithinNext(duration),
            ("bridging", Some(duration), None) => Self::Bridging(duration),
            ("lasting", Some(duration), None) => Self::Lasting(duration),
            ("at least times within last", Some(times), Some(within)) => Self::AtLeast { times, within },
            ("rises", None, None) => Self::Rises,
            ("falls", None, None) => Self::Falls,
            _ => return None,
        };
        if constants.next().is_none() { Some(temporal) } else { None }
    }

    /// Its words joined by blanks.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::For(_) => "for",
            Self::WithinLast(_) => "within last",
            Self::WithinNext(_) => "within next",
            Self::Bridging(_) => "bridging",
            Self::Lasting(_) => "lasting",
            Self::AtLeast { .. } => "at least times within last",
            Self::Rises => "rises",
            Self::Falls => "falls",
        }
    }

    /// Its constants, in the order in which they are written.
    pub fn constants(&self) -> Vec<&C> {
        match self {
            Self::For(one)
            | Self::WithinLast(one)
            | Self::WithinNext(one)
            | Self::Bridging(one)
            | Self::Lasting(one) => vec![one],
            Self::AtLeast { times, within } => vec![times, within],
            Self::Rises | Self::Falls => Vec::new(),
        }
    }

    /// Returns the constants mutably.
    pub fn constants_mut(&mut self) -> Vec<&mut C> {
        match self {
            Self::For(one)
            | Self::WithinLast(one)
            | Self::WithinNext(one)
            | Self::Bridging(one)
            | Self::Lasting(one) => vec![one],
            Self::AtLeast { times, within } => vec![times, within],
            Self::Rises | Self::Falls => Vec::new(),
        }
    }

    /// Returns the operator with the constants mapped by `f`, in their order; `None` if `f` returns `None` for one. `f` is called for all of them.
    pub fn map<D>(&self, mut f: impl FnMut(&C) -> Option<D>) -> Option<TemporalOperator<D>> {
        let constants: Vec<Option<D>> = self.constants().into_iter().map(&mut f).collect();
        TemporalOperator::new(self.name(), constants.into_iter().collect::<Option<Vec<D>>>()?)
    }

    /// Whether its value depends on later frames.
    pub const fn looks_ahead(&self) -> bool {
        matches!(self, Self::WithinNext(_) | Self::Bridging(_) | Self::Lasting(_))
    }

    /// Returns the text of the operator on a condition; `text` formats a constant.
    pub fn written(&self, condition: &str, text: impl Fn(&C, Operand) -> String) -> String {
        let duration = |duration: &C| text(duration, Operand::Duration);
        match self {
            Self::For(time)
            | Self::WithinLast(time)
            | Self::WithinNext(time)
            | Self::Bridging(time)
            | Self::Lasting(time) => {
                format!("({condition}) {} {}", self.name(), duration(time))
            }
            Self::AtLeast { times, within } => {
                format!("({condition}) at least {} times within last {}", text(times, Operand::Times), duration(within))
            }
            Self::Rises | Self::Falls => format!("{}({condition})", self.name()),
        }
    }

    /// Its row in the table.
    pub fn operator(&self) -> Option<&'static Operator> {
        by_name(self.name())
    }

    /// The kinds of its constants, in the order of [`TemporalOperator::constants`].
    pub fn kinds(&self) -> impl Iterator<Item = Operand> + use<C> {
        let signature = self.operator().and_then(|operator| operator.signatures.first());
        signature.into_iter().flat_map(|signature| signature.takes).skip(1).copied()
    }
}
