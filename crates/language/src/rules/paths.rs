//! The paths through a tree: from its root to each leaf, with the conditions on it.

use super::{Branch, Choice, Consequent, Expr};

/// A path to a leaf.
#[derive(Clone, Debug)]
pub struct LeafPath<'a> {
    /// The choice that gives the leaf.
    pub choice: &'a Choice,
    /// The choices on the path that have a condition, each with how it must come out.
    pub asked: Vec<(&'a Choice, &'a Expr, bool)>,
}

impl Branch {
    /// Returns the paths to all leaves below, in the order of the choices.
    pub fn paths(&self) -> Vec<LeafPath<'_>> {
        let mut paths = Vec::new();
        self.collect(&mut Vec::new(), &mut paths);
        paths
    }

    fn collect<'a>(&'a self, asked: &mut Vec<(&'a Choice, &'a Expr, bool)>, paths: &mut Vec<LeafPath<'a>>) {
        let before = asked.len();
        let last = self.choices.len().saturating_sub(1);
        for (at, choice) in self.choices.iter().enumerate() {
            // The last choice of a branch is taken whenever the others are not.
            let condition = choice.condition.as_ref().filter(|_| at < last);
            if let Some(condition) = condition {
                asked.push((choice, condition, true));
            }
            match &choice.then {
                Consequent::Primitive(_) | Consequent::Stay | Consequent::Separate => {
                    paths.push(LeafPath { choice, asked: asked.clone() })
                }
                Consequent::Branch(below) => below.collect(asked, paths),
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
