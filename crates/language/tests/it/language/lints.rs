//! Comments that allow a warning.

use teachtree_language as language;

/// A comment that allows a warning is used up by it, at the end of its line and above it, and others stay.
#[test]
fn what_is_allowed_is_undetectable() {
    let printed = |text: &str| -> Vec<&str> {
        let tree = "primitive Move\ntree t for each hand { else => Move }\n";
        let loaded = language::load_text("my.rules", &format!("{text}\n{tree}"));
        assert!(loaded.rules.is_some());
        loaded.diagnostics.iter().map(|finding| finding.code).collect()
    };
    assert_eq!(printed("param a = 1"), ["W201"]);
    assert_eq!(printed("param a = 1 // allow W201"), [""; 0]);
    assert_eq!(printed("param a = 1 // allow W301, W201: for later"), ["W202"]);
    assert_eq!(printed("// allow W201\n\n// one more\nparam a = 1\nparam b = 1"), ["W201"]);
    assert_eq!(printed("// allow W201 and more\nparam a = 1 //allow W201"), [""; 0]);
    assert_eq!(printed("param a = 1 // allowed: W201"), ["W201"]);
    // Where something is wrong nothing is warned of, so that nothing can be said about what is allowed.
    let wrong = language::load_text("my.rules", "param a = b // allow W201\n");
    assert_eq!(wrong.diagnostics.iter().map(|finding| finding.code).collect::<Vec<_>>(), ["E201"]);
}
