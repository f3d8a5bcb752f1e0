//! Numbers over time.

use super::stateful_nodes::Targets;
use super::{Instantiation, Item};
use crate::compiled::plan::{Number, NumberId};
use crate::semantics::internal;
use teachtree_base::error::InputError;
use teachtree_language::graph::FloatBits;
use teachtree_language::ops::{Samples, Summary};

impl Instantiation<'_> {
    /// Returns the summary of the samples of each component, over a duration or since the second argument began.
    pub(super) fn summary(
        &mut self,
        summary: Summary,
        duration: Option<FloatBits>,
        args: &[&[Item]],
        targets: Targets,
    ) -> Result<Vec<Item>, InputError> {
        let samples = match (duration, args.get(1).and_then(|arg| arg.first())) {
            (Some(duration), _) => Samples::Last(self.frames(duration)?),
            (None, Some(Item::Bit(bit))) => Samples::Since(*bit),
            (None, _) => return Err(internal("`since` looks at what is known only frame by frame")),
        };
        let mut out = Vec::new();
        for item in args.first().copied().unwrap_or_default() {
            let number = self.measured(*item)?;
            let (own, of_condition) =
                (self.number_delay(number), samples.since().map_or(0, |condition| self.bit_delay(*condition)));
            let delay = own.max(of_condition);
            let number = self.late_number(number, delay);
            let samples = match samples {
                Samples::Last(frames) => Samples::Last(frames),
                Samples::Since(condition) => Samples::Since(self.late_bit(condition, delay)),
            };
            let restart = self.restart_on(targets, delay);
            out.push(Item::Number(self.number(Number::Summary { summary, number, samples, restart }, delay)));
        }
        Ok(out)
    }

    /// A number, or a condition as one: 1 where it holds, 0 elsewhere.
    fn measured(&mut self, item: Item) -> Result<NumberId, InputError> {
        match item {
            Item::Number(number) => Ok(number),
            Item::Bit(bit) => {
                let delay = self.bit_delay(bit);
                Ok(self.number(Number::Count(vec![bit]), delay))
            }
            Item::Stateful(_) | Item::Tally(_) => {
                Err(internal("a number over time looks at what is known only frame by frame"))
            }
        }
    }
}
