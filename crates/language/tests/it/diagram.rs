//! Transitions of trees.

use teachtree_language::graph::transitions::transitions;

/// A hand may have nothing that its target touches: of no contacts all are anything, and none is.
#[test]
fn leaves_that_only_an_empty_array_gives_are_reached() {
    let rules = "primitive A, B, C\ntree t for each hand {\n  not any(contacts.handled or true) => A\n  all(contacts.handled and false)     => B\n  else                                => C\n}\n";
    let loaded = teachtree_language::load_text("test.rules", rules);
    let rules = loaded.rules.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics));
    assert_eq!(transitions(&rules)[0].never, Vec::<String>::new());
}
