//! In which order a frame can be worked out when numbers come before conditions: most numbers read the log alone, but a count reads conditions, and so
//! does a rate that begins anew. These have to wait: they have a higher *rank*.

use crate::compiled::plan::{Plan, Step};

/// The rank of a step: the number of rounds of conditions of conditions that precede it.
pub struct Ranks {
    numbers: Vec<u32>,
    conditions: Vec<u32>,
}

impl Ranks {
    /// The ranks of a plan's steps.
    pub fn of(plan: &Plan) -> Self {
        let mut ranks = Self { numbers: vec![0; plan.numbers.len()], conditions: vec![0; plan.conditions.len()] };
        for step in &plan.steps {
            let (numbers, conditions) = plan.reads(*step);
            let of_numbers = numbers.iter().map(|id| ranks.numbers[id.index()]).max().unwrap_or(0);
            let of_conditions = conditions.iter().map(|id| ranks.conditions[id.index()]);
            match step {
                Step::Number(id) => {
                    let waits = of_conditions.map(|rank| rank + 1).max().unwrap_or(0);
                    ranks.numbers[id.index()] = of_numbers.max(waits);
                }
                Step::Condition(id) => {
                    ranks.conditions[id.index()] = of_numbers.max(of_conditions.max().unwrap_or(0));
                }
            }
        }
        ranks
    }

    /// The rank of a step.
    pub fn of_step(&self, step: Step) -> u32 {
        match step {
            Step::Number(id) => self.numbers[id.index()],
            Step::Condition(id) => self.conditions[id.index()],
        }
    }

    /// The highest rank there is.
    pub fn highest(&self) -> u32 {
        self.numbers.iter().chain(&self.conditions).copied().max().unwrap_or(0)
    }
}
