//! Where the numbers of a block stand while they are needed. A buffer is used again as soon as its number has been read for the last time, so that
//! they all stay in the processor's nearest cache.

use super::bits::BLOCK;
use super::plan::{Number, NumberId, Plan, Step};

/// The buffers of a plan, a block long each.
#[derive(Clone, Debug)]
pub struct Buffers {
    buffers: Vec<Vec<f64>>,
    /// The buffer of each number.
    place: Vec<u32>,
}

impl Buffers {
    /// Room for the numbers of a plan; constants are filled in.
    pub fn new(plan: &Plan) -> Self {
        let mut last_read = vec![0; plan.numbers.len()];
        for (at, step) in plan.steps.iter().enumerate() {
            for id in plan.reads(*step).0 {
                last_read[id.index()] = at;
            }
        }
        let mut buffers: Vec<Vec<f64>> = Vec::new();
        let (mut place, mut free) = (vec![0; plan.numbers.len()], Vec::new());
        for (at, step) in plan.steps.iter().enumerate() {
            if let Step::Number(id) = step {
                let constant = match plan.numbers[id.index()].0 {
                    Number::Input(_) => continue,
                    Number::Constant(number) => Some(number.get()),
                    _ => None,
                };
                let reused = if constant.is_none() { free.pop() } else { None };
                place[id.index()] = reused.unwrap_or_else(|| {
                    buffers.push(vec![constant.unwrap_or_default(); BLOCK]);
                    u32::try_from(buffers.len() - 1).unwrap_or(u32::MAX)
                });
            }
            // What this step has read for the last time; a number that is read twice is free once.
            let mut read: Vec<NumberId> =
                plan.reads(*step).0.into_iter().filter(|id| last_read[id.index()] == at).collect();
            read.sort_unstable();
            read.dedup();
            let held = |id: &NumberId| !matches!(plan.numbers[id.index()].0, Number::Input(_) | Number::Constant(_));
            free.extend(read.into_iter().filter(held).map(|id| place[id.index()]));
        }
        Self { buffers, place }
    }

    /// The first `len` values of a number.
    #[inline(always)]
    pub fn get(&self, id: NumberId, len: usize) -> &[f64] {
        &self.buffers[self.place[id.index()] as usize][..len]
    }

    /// A number's buffer, to be written while others are read.
    #[inline(always)]
    pub fn take(&mut self, id: NumberId) -> Vec<f64> {
        std::mem::take(&mut self.buffers[self.place[id.index()] as usize])
    }

    /// The buffer that was taken.
    #[inline(always)]
    pub fn put_back(&mut self, id: NumberId, buffer: Vec<f64>) {
        self.buffers[self.place[id.index()] as usize] = buffer;
    }
}
