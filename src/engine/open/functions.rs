//! The functions of the language, taken apart into single numbers and conditions.

use super::{Item, Opening, Slots};
use crate::engine::plan::{Number, NumberId, Vector};
use crate::language::rules::{Arithmetic, Function};
use std::rc::Rc;

impl Opening<'_> {
    /// A function that maps over arrays, for one element.
    pub(super) fn call(&mut self, function: Function, args: &[&[Item]]) -> Vec<Item> {
        let numbers = |at: usize| -> Vec<NumberId> {
            let items = args.get(at).copied().unwrap_or(&[]);
            items.iter().filter_map(|item| if let Item::Number(number) = item { Some(*number) } else { None }).collect()
        };
        match function {
            Function::Abs => self.each(args[0], |opening, a| {
                let delay = opening.number_delay(a);
                opening.number(Number::Abs(a), delay)
            }),
            Function::Norm => vec![Item::Number(self.norm(&numbers(0)))],
            Function::Dot => vec![Item::Number(self.dot(&numbers(0), &numbers(1)))],
            Function::Tangential => {
                let (vector, normal) = (numbers(0), numbers(1));
                let along = self.dot(&vector, &normal);
                let across = vector.iter().zip(&normal).map(|(v, n)| {
                    let ([v, n, along], delay) = self.together([*v, *n, along]);
                    Item::Number(self.number(Number::LessProduct(v, n, along), delay))
                });
                across.collect()
            }
            Function::Min | Function::Max => {
                let pairs: Vec<(NumberId, NumberId)> = numbers(0).into_iter().zip(numbers(1)).collect();
                pairs.into_iter().map(|(a, b)| Item::Number(self.extreme(function, a, b))).collect()
            }
            // The rest makes one value of an array: `reduce`.
            _ => Vec::new(),
        }
    }

    /// A function that makes one value of an array, from the first slot to the last.
    pub(super) fn reduce(&mut self, function: Function, args: &[Rc<Slots>]) -> Slots {
        let slots: &[Vec<Item>] = args.first().map_or(&[], |arg| &arg.0);
        let firsts: Vec<Item> = slots.iter().filter_map(|slot| slot.first().copied()).collect();
        Slots(vec![match function {
            Function::Sum => self.sum(slots),
            Function::Mean => {
                let sum = self.sum(slots);
                // The mean of nothing is zero, not NaN.
                #[allow(clippy::cast_precision_loss, reason = "a handful of slots")]
                let count = self.constant(slots.len().max(1) as f64);
                self.each(&sum, |opening, sum| opening.binary(Arithmetic::Divide, sum, count))
            }
            Function::Min | Function::Max => {
                let start = if function == Function::Min { f64::INFINITY } else { f64::NEG_INFINITY };
                let mut extreme = self.constant(start);
                for item in firsts {
                    if let Item::Number(number) = item {
                        extreme = self.extreme(function, extreme, number);
                    }
                }
                vec![Item::Number(extreme)]
            }
            Function::Count => vec![self.count(&firsts)],
            Function::Any => vec![self.any(&firsts)],
            Function::All => vec![self.all(&firsts)],
            Function::SqueezeOf => {
                let forces: Vec<Vec<Item>> = args.iter().flat_map(|arg| arg.0.iter().cloned()).collect();
                vec![Item::Number(self.squeeze(&forces))]
            }
            _ => Vec::new(),
        }])
    }

    fn numbers_of(slot: &[Item]) -> Vec<NumberId> {
        slot.iter().filter_map(|item| if let Item::Number(number) = item { Some(*number) } else { None }).collect()
    }

    fn norm(&mut self, vector: &[NumberId]) -> NumberId {
        let Ok(vector) = <[NumberId; 3]>::try_from(vector) else { return self.constant(0.0) };
        let (vector, delay) = self.together(vector);
        // A difference that only its length is asked of is not written down.
        let difference = vector.map(|id| match self.plan.numbers[id.index()].0 {
            Number::Arithmetic(Arithmetic::Subtract, a, b) => Some((a, b)),
            _ => None,
        });
        let vector = match difference {
            [Some((ax, bx)), Some((ay, by)), Some((az, bz))] => Vector { of: [ax, ay, az], minus: Some([bx, by, bz]) },
            _ => Vector { of: vector, minus: None },
        };
        self.number(Number::Norm(vector), delay)
    }

    fn dot(&mut self, a: &[NumberId], b: &[NumberId]) -> NumberId {
        let (Ok(a), Ok(b)) = (<[NumberId; 3]>::try_from(a), <[NumberId; 3]>::try_from(b)) else {
            return self.constant(0.0);
        };
        let ([ax, ay, az, bx, by, bz], delay) = self.together([a[0], a[1], a[2], b[0], b[1], b[2]]);
        self.number(Number::Dot([ax, ay, az], [bx, by, bz]), delay)
    }

    fn extreme(&mut self, function: Function, a: NumberId, b: NumberId) -> NumberId {
        let ([a, b], delay) = self.together([a, b]);
        self.number(if function == Function::Min { Number::Min(a, b) } else { Number::Max(a, b) }, delay)
    }

    fn sum(&mut self, slots: &[Vec<Item>]) -> Vec<Item> {
        match slots {
            // The checker knows the shape; an empty sum is zero in as many components as anyone asks for.
            [] => vec![Item::Number(self.constant(0.0)); 3],
            [one] => one.clone(),
            [first, ..] => (0..first.len())
                .map(|component| {
                    let all: Vec<Item> = slots.iter().filter_map(|slot| slot.get(component).copied()).collect();
                    let all = Self::numbers_of(&all);
                    let delay = all.iter().map(|id| self.number_delay(*id)).max().unwrap_or(0);
                    let all = all.into_iter().map(|id| self.late_number(id, delay)).collect();
                    Item::Number(self.number(Number::Sum(all), delay))
                })
                .collect(),
        }
    }

    /// `(sum of norms - norm of sum) / 2`: the internal force.
    fn squeeze(&mut self, forces: &[Vec<Item>]) -> NumberId {
        let norms: Vec<Vec<Item>> = forces
            .iter()
            .map(|force| {
                let force = Self::numbers_of(force);
                vec![Item::Number(self.norm(&force))]
            })
            .collect();
        let (sum_of_norms, sum) = (self.sum(&norms), self.sum(forces));
        let (sum_of_norms, sum) = (Self::numbers_of(&sum_of_norms), Self::numbers_of(&sum));
        let norm_of_sum = self.norm(&sum);
        let two = self.constant(2.0);
        let Some(sum_of_norms) = sum_of_norms.first() else { return self.constant(0.0) };
        let difference = self.binary(Arithmetic::Subtract, *sum_of_norms, norm_of_sum);
        self.binary(Arithmetic::Divide, difference, two)
    }

    fn count(&mut self, items: &[Item]) -> Item {
        let Some(bits) = super::only_bits(items) else {
            let memories = items.iter().map(|item| self.memory_of(*item)).collect();
            self.tallies.push(memories);
            return Item::Tally(u32::try_from(self.tallies.len() - 1).unwrap_or(u32::MAX));
        };
        let (bits, delay) = self.bits_together(&bits);
        Item::Number(self.number(Number::Count(bits), delay))
    }
}
