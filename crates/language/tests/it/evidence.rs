//! The evidence that `learn` writes behind choices.

use teachtree_language::evidence::evidence;
use teachtree_language::rules::{Branch, Consequent, Rules};
use teachtree_language::{Request, load};

const TREE: &str = "use \"stream.rules\"

stream { for each hand { gripper.closed : bool } }

for each hand { signal closed = gripper.closed }

primitive Wait, Hold

tree skills for each hand {
  up: closed    // learned: of the branch
  {
    closed    // learned: of the condition
      => Hold
    not closed
      => Wait    // learned: of the leaf
    else => Wait    // else
  }
  not closed => Wait    closed => Hold    // learned: of one of two
  closed
    => Wait    closed => Hold
  else => Hold    // learned: of the last
}
";

fn all(rules: &Rules, root: &Branch, branch: &Branch, found: &mut Vec<Option<String>>) {
    for choice in &branch.choices {
        found.push(evidence(rules, root, choice));
        if let Consequent::Branch(below) = &choice.then {
            all(rules, root, below, found);
        }
    }
}

#[test]
fn evidence_is_of_the_choice_whose_condition_or_leaf_ends_on_its_line() {
    let loaded =
        load(&Request { texts: vec![("mine.rules".into(), TREE.into())], needs_tree: true, ..Request::default() });
    let rules = loaded.rules.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics));
    let root = &rules.trees[0].root;
    let mut found = Vec::new();
    all(&rules, root, root, &mut found);
    let found: Vec<&str> = found.iter().map(|it| it.as_deref().unwrap_or("")).collect();
    assert_eq!(found, ["of the branch", "of the condition", "of the leaf", "", "", "", "", "", "of the last"]);
}
