//! The places of a tree at which an extension may insert a choice, and the frames on which the tree gets there.

use teachtree_language::Rules;
use teachtree_language::rules::{Branch, Choice, Consequent, Expr, Label, Tree};

/// A place between the choices of a branch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Place {
    /// As it is written behind `extend`: `single_hand.held before Place`.
    pub text: String,
    /// The condition of the choice behind it, where that is asked too: the new primitive then only replaces what the choice gives.
    pub condition: Option<String>,
    /// The conditions on the way, by their position among all conditions of the tree, and how they come out.
    asked: Vec<(usize, bool)>,
}

impl Place {
    /// The frames on which the tree gets there: `held` has the bits of each condition of the tree, of `words` words.
    pub fn reached(&self, held: &[Vec<u64>], words: usize) -> Vec<u64> {
        let mut reached = vec![u64::MAX; words];
        for (condition, wanted) in &self.asked {
            for (bits, held) in reached.iter_mut().zip(&held[*condition]) {
                *bits &= if *wanted { *held } else { !held };
            }
        }
        reached
    }
}

/// The places of a tree in their order, and all its conditions.
pub(super) fn places<'r>(rules: &Rules, tree: &'r Tree) -> (Vec<Place>, Vec<&'r Expr>) {
    let mut walk = Walk { rules, tree: &tree.name, places: Vec::new(), conditions: Vec::new() };
    walk.branch(&tree.root, Some(&tree.name), &mut Vec::new());
    (walk.places, walk.conditions)
}

struct Walk<'r, 'w> {
    rules: &'w Rules,
    tree: &'w str,
    places: Vec<Place>,
    conditions: Vec<&'r Expr>,
}

impl<'r> Walk<'r, '_> {
    /// Visits a branch; one without a name cannot be extended.
    fn branch(&mut self, branch: &'r Branch, name: Option<&str>, asked: &mut Vec<(usize, bool)>) {
        let before = asked.len();
        let last = branch.choices.len().saturating_sub(1);
        for (at, choice) in branch.choices.iter().enumerate() {
            if let (Some(name), Some(anchor)) = (name, self.anchor(branch, at)) {
                let tree = if name == self.tree { name.to_string() } else { format!("{}.{name}", self.tree) };
                let text = format!("{tree} {anchor}");
                let place = Place { text, condition: None, asked: asked.clone() };
                if let (true, Some(condition), Consequent::Primitive(Label { side: None, .. })) =
                    (at < last, &choice.condition, &choice.then)
                {
                    let narrow = [asked.as_slice(), &[(self.conditions.len(), true)]].concat();
                    let condition = Some(self.rules.text_of(condition));
                    self.places.push(Place { condition, asked: narrow, ..place.clone() });
                }
                self.places.push(place);
            }
            // The last choice of a branch is taken whenever the others are not.
            let condition = choice.condition.as_ref().filter(|_| at < last);
            if let Some(condition) = condition {
                asked.push((self.conditions.len(), true));
                self.conditions.push(condition);
            }
            if let Consequent::Branch(below) = &choice.then {
                self.branch(below, choice.name.as_deref(), asked);
            }
            if condition.is_some()
                && let Some((_, wanted)) = asked.last_mut()
            {
                *wanted = false;
            }
        }
        asked.truncate(before);
    }

    /// How a place before a choice is named; `None` inside the two choices of a `(side)`.
    fn anchor(&self, branch: &Branch, at: usize) -> Option<String> {
        let choice = branch.choices.get(at)?;
        let before = at.checked_sub(1).and_then(|before| branch.choices.get(before));
        if before.is_some_and(|before| before.span == choice.span) {
            return None;
        }
        let named = |choice: &Choice| match (&choice.name, &choice.then) {
            (Some(name), _) => Some(name.clone()),
            (None, Consequent::Primitive(label)) => {
                let leads_there = |other: &&Choice| matches!(other.then, Consequent::Primitive(it) if it.primitive == label.primitive);
                let mut all = branch.choices.iter().filter(leads_there);
                let is_only = all.all(|other| other.span == choice.span);
                is_only.then(|| self.rules.primitives.get(label.primitive.index()).map(|it| it.name.clone()))?
            }
            _ => None,
        };
        if let Some(name) = named(choice) {
            return Some(format!("before {name}"));
        }
        if choice.condition.is_none() {
            return Some("last".into());
        }
        match before {
            None => Some("first".into()),
            Some(before) => named(before).map(|name| format!("after {name}")),
        }
    }
}
