//! The ways through a tree: from its root to each leaf, with the conditions on it.

use super::{Branch, Choice, Expr, Then};

/// A way to a leaf.
#[derive(Clone, Debug)]
pub struct Way<'a> {
    /// The choice that gives the leaf.
    pub choice: &'a Choice,
    /// The choices on the way that have a condition, each with how it must come out.
    pub asked: Vec<(&'a Choice, &'a Expr, bool)>,
}

impl Branch {
    /// All ways to the leaves below, in the order of the choices.
    pub fn ways(&self) -> Vec<Way<'_>> {
        let mut ways = Vec::new();
        self.collect(&mut Vec::new(), &mut ways);
        ways
    }

    fn collect<'a>(&'a self, asked: &mut Vec<(&'a Choice, &'a Expr, bool)>, ways: &mut Vec<Way<'a>>) {
        let before = asked.len();
        let last = self.choices.len().saturating_sub(1);
        for (at, choice) in self.choices.iter().enumerate() {
            // The last choice of a branch is taken whenever the others are not.
            let condition = choice.condition.as_ref().filter(|_| at < last);
            if let Some(condition) = condition {
                asked.push((choice, condition, true));
            }
            match &choice.then {
                Then::Primitive(_) | Then::Stay | Then::Separate => ways.push(Way { choice, asked: asked.clone() }),
                Then::Branch(below) => below.collect(asked, ways),
            }
            if condition.is_some()
                && let Some((.., wanted)) = asked.last_mut()
            {
                *wanted = false;
            }
        }
        asked.truncate(before);
    }
}
