//! The functions of the language, taken apart into single numbers and conditions.

use super::{Instantiation, Item, Slots};
use crate::compiled::plan::{Number, NumberId, Vector, position};
use crate::semantics::internal;
use std::rc::Rc;
use teachtree_base::error::InputError;
use teachtree_language::rules::{Arithmetic, Function};

impl Instantiation<'_> {
    /// A function that maps over arrays, for one element.
    pub(super) fn call(&mut self, function: Function, args: &[&[Item]]) -> Result<Vec<Item>, InputError> {
        let numbers = |at: usize| numbers_of(args.get(at).copied().unwrap_or(&[]));
        Ok(match function {
            Function::Abs => self.each(args[0], |instantiation, a| {
                let delay = instantiation.number_delay(a);
                instantiation.number(Number::Abs(a), delay)
            }),
            Function::Norm => vec![Item::Number(self.norm(&numbers(0)?)?)],
            Function::Dot => vec![Item::Number(self.dot(&numbers(0)?, &numbers(1)?)?)],
            Function::Tangential => {
                let (vector, normal) = (numbers(0)?, numbers(1)?);
                let along = self.dot(&vector, &normal)?;
                let across = vector.iter().zip(&normal).map(|(v, n)| Item::Number(self.less_product(*v, *n, along)));
                across.collect()
            }
            Function::Vec3 => args.iter().flat_map(|arg| arg.iter().copied()).collect(),
            Function::Cross => self.cross(three(&numbers(0)?)?, three(&numbers(1)?)?).map(Item::Number).to_vec(),
            Function::Angle => vec![Item::Number(self.angle(&numbers(0)?, &numbers(1)?)?)],
            Function::InFrame | Function::FromFrame => {
                let (vector, [w, axis @ ..]) = (three(&numbers(0)?)?, four(&numbers(1)?)?);
                let axis = if function == Function::FromFrame { axis } else { axis.map(|part| self.negated(part)) };
                self.turned(vector, w, axis).map(Item::Number).to_vec()
            }
            Function::Min | Function::Max => {
                let pairs: Vec<(NumberId, NumberId)> = numbers(0)?.into_iter().zip(numbers(1)?).collect();
                pairs.into_iter().map(|(a, b)| Item::Number(self.extreme(function, a, b))).collect()
            }
            _ => return Err(internal("a function of an array is asked of single elements")),
        })
    }

    /// A function that makes one value of an array, from the first slot to the last.
    pub(super) fn reduce(&mut self, function: Function, args: &[Rc<Slots>]) -> Result<Slots, InputError> {
        let slots: &[Vec<Item>] = args.first().map_or(&[], |arg| &arg.0);
        let firsts: Vec<Item> = slots.iter().filter_map(|slot| slot.first().copied()).collect();
        Ok(Slots(vec![match function {
            Function::Sum => self.sum(slots)?,
            Function::Mean => {
                let sum = self.sum(slots)?;
                // The mean of nothing is zero, not NaN.
                #[allow(clippy::cast_precision_loss, reason = "a handful of slots")]
                let count = self.constant(slots.len().max(1) as f64);
                self.each(&sum, |instantiation, sum| instantiation.binary(Arithmetic::Divide, sum, count))
            }
            Function::Min | Function::Max => {
                let start = if function == Function::Min { f64::INFINITY } else { f64::NEG_INFINITY };
                let mut extreme = self.constant(start);
                for number in numbers_of(&firsts)? {
                    extreme = self.extreme(function, extreme, number);
                }
                vec![Item::Number(extreme)]
            }
            Function::Count => vec![self.count(&firsts)?],
            Function::Any => vec![self.any(&firsts)?],
            Function::All => vec![self.all(&firsts)?],
            Function::SqueezeOf => {
                let forces: Vec<Vec<Item>> = args.iter().flat_map(|arg| arg.0.iter().cloned()).collect();
                vec![Item::Number(self.squeeze(&forces)?)]
            }
            _ => return Err(internal("a function of single elements is asked of an array")),
        }]))
    }

    fn norm(&mut self, vector: &[NumberId]) -> Result<NumberId, InputError> {
        let vector = three(vector)?;
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
        Ok(self.number(Number::Norm(vector), delay))
    }

    fn dot(&mut self, a: &[NumberId], b: &[NumberId]) -> Result<NumberId, InputError> {
        let (a, b) = (three(a)?, three(b)?);
        let ([ax, ay, az, bx, by, bz], delay) = self.together([a[0], a[1], a[2], b[0], b[1], b[2]]);
        Ok(self.number(Number::Dot([ax, ay, az], [bx, by, bz]), delay))
    }

    fn negated(&mut self, a: NumberId) -> NumberId {
        let delay = self.number_delay(a);
        self.number(Number::Negate(a), delay)
    }

    fn cross(&mut self, a: [NumberId; 3], b: [NumberId; 3]) -> [NumberId; 3] {
        [0, 1, 2].map(|at| {
            let (next, last) = ((at + 1) % 3, (at + 2) % 3);
            let product = self.binary(Arithmetic::Multiply, a[next], b[last]);
            self.less_product(product, a[last], b[next])
        })
    }

    /// `a - b * c`.
    fn less_product(&mut self, a: NumberId, b: NumberId, c: NumberId) -> NumberId {
        let ([a, b, c], delay) = self.together([a, b, c]);
        self.number(Number::MulSub(a, b, c), delay)
    }

    fn atan2(&mut self, y: NumberId, x: NumberId) -> NumberId {
        let ([y, x], delay) = self.together([y, x]);
        self.number(Number::Atan2(y, x), delay)
    }

    /// The angle between two vec3, or of the turn between two rotations.
    fn angle(&mut self, a: &[NumberId], b: &[NumberId]) -> Result<NumberId, InputError> {
        if a.len() == 3 {
            let (a, b) = (three(a)?, three(b)?);
            let cross = self.cross(a, b);
            let (sine, cosine) = (self.norm(&cross)?, self.dot(&a, &b)?);
            return Ok(self.atan2(sine, cosine));
        }
        let ([aw, a @ ..], [bw, b @ ..]) = (four(a)?, four(b)?);
        let across = self.cross(a, b);
        let turn = [0, 1, 2].map(|at| {
            let product = self.binary(Arithmetic::Multiply, aw, b[at]);
            let both = self.less_product(product, bw, a[at]);
            self.binary(Arithmetic::Subtract, both, across[at])
        });
        let mut cosine = self.binary(Arithmetic::Multiply, aw, bw);
        for (a, b) in a.into_iter().zip(b) {
            let product = self.binary(Arithmetic::Multiply, a, b);
            cosine = self.binary(Arithmetic::Add, cosine, product);
        }
        let delay = self.number_delay(cosine);
        let cosine = self.number(Number::Abs(cosine), delay);
        let sine = self.norm(&turn)?;
        let half = self.atan2(sine, cosine);
        Ok(self.binary(Arithmetic::Add, half, half))
    }

    /// A vec3 turned by the quaternion `(w, u)`: `v + w t + u × t` with `t = 2 u × v`.
    fn turned(&mut self, v: [NumberId; 3], w: NumberId, u: [NumberId; 3]) -> [NumberId; 3] {
        let twice = self.cross(u, v).map(|part| self.binary(Arithmetic::Add, part, part));
        let across = self.cross(u, twice);
        [0, 1, 2].map(|at| {
            let along = self.binary(Arithmetic::Multiply, w, twice[at]);
            let sum = self.binary(Arithmetic::Add, v[at], along);
            self.binary(Arithmetic::Add, sum, across[at])
        })
    }

    fn extreme(&mut self, function: Function, a: NumberId, b: NumberId) -> NumberId {
        let ([a, b], delay) = self.together([a, b]);
        self.number(if function == Function::Min { Number::Min(a, b) } else { Number::Max(a, b) }, delay)
    }

    fn sum(&mut self, slots: &[Vec<Item>]) -> Result<Vec<Item>, InputError> {
        Ok(match slots {
            // The checker knows the shape; an empty sum is zero in as many components as anyone asks for.
            [] => vec![Item::Number(self.constant(0.0)); 3],
            [one] => one.clone(),
            [first, ..] => {
                let mut sums = Vec::with_capacity(first.len());
                for component in 0..first.len() {
                    let all: Vec<Item> = slots.iter().filter_map(|slot| slot.get(component).copied()).collect();
                    let all = numbers_of(&all)?;
                    let delay = all.iter().map(|id| self.number_delay(*id)).max().unwrap_or(0);
                    let all = all.into_iter().map(|id| self.late_number(id, delay)).collect();
                    sums.push(Item::Number(self.number(Number::Sum(all), delay)));
                }
                sums
            }
        })
    }

    /// `(sum of norms - norm of sum) / 2`: the internal force.
    fn squeeze(&mut self, forces: &[Vec<Item>]) -> Result<NumberId, InputError> {
        let mut norms = Vec::with_capacity(forces.len());
        for force in forces {
            norms.push(vec![Item::Number(self.norm(&numbers_of(force)?)?)]);
        }
        let (sum_of_norms, sum) = (numbers_of(&self.sum(&norms)?)?, numbers_of(&self.sum(forces)?)?);
        let norm_of_sum = self.norm(&sum)?;
        let two = self.constant(2.0);
        let sum_of_norms = sum_of_norms.first().ok_or_else(|| internal("a sum has no components"))?;
        let difference = self.binary(Arithmetic::Subtract, *sum_of_norms, norm_of_sum);
        Ok(self.binary(Arithmetic::Divide, difference, two))
    }

    fn count(&mut self, items: &[Item]) -> Result<Item, InputError> {
        let Some(bits) = super::only_bits(items) else {
            let stateful = items.iter().map(|item| self.stateful_of(*item)).collect::<Result<_, _>>()?;
            self.tallies.push(stateful);
            return Ok(Item::Tally(position(self.tallies.len() - 1)));
        };
        let (bits, delay) = self.bits_together(&bits);
        Ok(Item::Number(self.number(Number::Count(bits), delay)))
    }
}

fn numbers_of(items: &[Item]) -> Result<Vec<NumberId>, InputError> {
    let number = |item: &Item| match item {
        Item::Number(number) => Ok(*number),
        _ => Err(internal("a condition stands where a number is asked for")),
    };
    items.iter().map(number).collect()
}

fn three(vector: &[NumberId]) -> Result<[NumberId; 3], InputError> {
    <[NumberId; 3]>::try_from(vector).map_err(|_| internal("a vec3 has other than three components"))
}

fn four(rotation: &[NumberId]) -> Result<[NumberId; 4], InputError> {
    <[NumberId; 4]>::try_from(rotation).map_err(|_| internal("a rotation has other than four components"))
}
