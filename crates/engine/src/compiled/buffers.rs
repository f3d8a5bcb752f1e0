//! Where the numbers of a block stand while they are needed. A buffer is used again as soon as its number has been read for the last time, so that
//! they all stay in the processor's nearest cache.

use super::bits::BLOCK;
use super::plan::{Condition, Number, NumberId, Plan, Step, position};

/// The buffers of a plan, a block long each.
#[derive(Clone, Debug)]
pub struct Buffers {
    buffers: Vec<Vec<f64>>,
    /// The buffer of each number.
    place: Vec<u32>,
}

/// The numbers that a step reads frame by frame: not the constants that its loop has in a register ([`super::columns`]).
fn columns_read(plan: &Plan, step: Step) -> Vec<NumberId> {
    let is_constant = |id: &NumberId| plan.constant(*id).is_some();
    let in_register = match step {
        Step::Number(id) => match &plan.numbers[id.index()].0 {
            Number::Arithmetic(_, a, b) => is_constant(b) && !is_constant(a),
            _ => false,
        },
        Step::Condition(id) => matches!(plan.conditions[id.index()].0, Condition::Compare(..)),
    };
    let mut read = plan.reads(step).0;
    read.retain(|id| !(in_register && is_constant(id)));
    read
}

impl Buffers {
    /// Room for the numbers of a plan; constants are filled in.
    pub fn new(plan: &Plan) -> Self {
        let mut last_read = vec![None; plan.numbers.len()];
        for (at, step) in plan.steps.iter().enumerate() {
            for id in columns_read(plan, *step) {
                last_read[id.index()] = Some(at);
            }
        }
        for output in &plan.outputs {
            // Read after the last step. Constants are known without a buffer.
            if let Step::Number(id) = output
                && plan.constant(*id).is_none()
            {
                last_read[id.index()] = Some(plan.steps.len());
            }
        }
        let mut buffers: Vec<Vec<f64>> = Vec::new();
        let (mut place, mut free) = (vec![0; plan.numbers.len()], Vec::new());
        for (at, step) in plan.steps.iter().enumerate() {
            if let Step::Number(id) = step {
                let constant = match plan.numbers[id.index()].0 {
                    Number::Input(_) => continue,
                    // Rules have many thresholds, and hardly one is read as a column.
                    Number::Constant(_) if last_read[id.index()].is_none() => continue,
                    Number::Constant(number) => Some(number.get()),
                    _ => None,
                };
                let reused = if constant.is_none() { free.pop() } else { None };
                place[id.index()] = reused.unwrap_or_else(|| {
                    buffers.push(vec![constant.unwrap_or_default(); BLOCK]);
                    position(buffers.len() - 1)
                });
            }
            // The numbers that this step reads last. A number that is read twice is freed once.
            let mut read: Vec<NumberId> =
                columns_read(plan, *step).into_iter().filter(|id| last_read[id.index()] == Some(at)).collect();
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
