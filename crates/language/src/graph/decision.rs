//! The tests of a tree: a branch in, a shared graph of two-way tests out.

use super::ValueId;
use crate::rules::Label;
use std::collections::HashMap;

/// The target of a test.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Target {
    /// Another test, by its position in [`Decision::tests`].
    Test(u32),
    /// A leaf.
    Leaf(Leaf),
}

/// The end of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Leaf {
    /// This primitive.
    Primitive(Label),
    /// The leaf of the frame before.
    Stay,
    /// No coordination.
    Separate,
}

/// A two-way test of a condition: a value of the graph, or what becomes of it when the graph is opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Test<Condition = ValueId> {
    /// The condition, a single bool.
    pub condition: Condition,
    /// The target if it holds.
    pub yes: Target,
    /// The target if it does not hold.
    pub no: Target,
}

/// The tests of one tree.
#[derive(Clone, Debug)]
pub struct Decision<Condition = ValueId> {
    /// The tests; targets stand before the tests that lead to them.
    pub tests: Vec<Test<Condition>>,
    /// The first test.
    pub root: Target,
}

impl<Condition> Decision<Condition> {
    /// The longest path, in tests.
    pub fn depth(&self) -> usize {
        let mut depths = Vec::with_capacity(self.tests.len());
        for test in &self.tests {
            let below = |target| match target {
                Target::Test(at) => depths.get(at as usize).copied().unwrap_or(0),
                Target::Leaf(_) => 0,
            };
            let depth: usize = 1 + below(test.yes).max(below(test.no));
            depths.push(depth);
        }
        match self.root {
            Target::Test(at) => depths.get(at as usize).copied().unwrap_or(0),
            Target::Leaf(_) => 0,
        }
    }

    /// Which tests some frame may come to, where the results of some are known.
    pub fn reached(&self, known: impl Fn(usize) -> Option<bool>) -> Vec<bool> {
        let mut reached = vec![false; self.tests.len()];
        let mark = |target: Target, reached: &mut [bool]| {
            if let Target::Test(at) = target {
                reached[at as usize] = true;
            }
        };
        mark(self.root, &mut reached);
        for (at, test) in self.tests.iter().enumerate().rev() {
            match known(at) {
                _ if !reached[at] => {}
                Some(true) => mark(test.yes, &mut reached),
                Some(false) => mark(test.no, &mut reached),
                None => [test.yes, test.no].into_iter().for_each(|target| mark(target, &mut reached)),
            }
        }
        reached
    }
}

impl Decision {
    /// Drops the tests that nothing leads to any more and closes the ranks.
    #[must_use]
    pub(super) fn pruned(self) -> Self {
        let used = self.reached(|_| None);
        let mut place = vec![0_u32; self.tests.len()];
        let mut tests = Vec::new();
        let moved = |target: Target, place: &[u32]| match target {
            Target::Test(at) => Target::Test(place[at as usize]),
            leaf @ Target::Leaf(_) => leaf,
        };
        for (at, test) in self.tests.iter().enumerate().filter(|(at, _)| used[*at]) {
            place[at] = u32::try_from(tests.len()).unwrap_or(u32::MAX);
            tests.push(Test { yes: moved(test.yes, &place), no: moved(test.no, &place), ..*test });
        }
        Self { root: moved(self.root, &place), tests }
    }
}

/// Builds tests from the leaves up and shares equal ones.
#[derive(Default)]
pub(super) struct Builder {
    tests: Vec<Test>,
    known: HashMap<Test, u32>,
}

impl Builder {
    /// The test of `condition`, or its target when both are the same. What is known is not asked again right after.
    pub fn test(&mut self, condition: ValueId, yes: Target, no: Target) -> Target {
        let yes = self.known(yes, condition, |again| again.yes);
        let no = self.known(no, condition, |again| again.no);
        if yes == no {
            return yes;
        }
        let test = Test { condition, yes, no };
        let next = u32::try_from(self.tests.len()).unwrap_or(u32::MAX);
        let at = *self.known.entry(test).or_insert(next);
        if at == next {
            self.tests.push(test);
        }
        Target::Test(at)
    }

    fn known(&self, target: Target, condition: ValueId, answer: impl Fn(&Test) -> Target) -> Target {
        match target {
            Target::Test(at) => {
                self.tests.get(at as usize).filter(|test| test.condition == condition).map_or(target, answer)
            }
            leaf @ Target::Leaf(_) => leaf,
        }
    }

    /// The finished graph.
    pub fn finish(self, root: Target) -> Decision {
        Decision { tests: self.tests, root }.pruned()
    }
}
