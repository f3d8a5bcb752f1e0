//! No rule file, however broken, may panic, hang or eat memory.

use super::report;
use proptest::prelude::*;
use teachtree_language::{self as language, SHIPPED};

/// Loads a text and formats its diagnostics. A text that takes exponential time would not end.
fn survives(text: &str) {
    let loaded = language::load_text("garbage.rules", text);
    let drawn = report(&loaded);
    assert_eq!(drawn.is_empty(), loaded.diagnostics.is_empty());
    for finding in &loaded.diagnostics {
        assert!(!finding.message.is_empty() && !finding.message.contains("Rule::"));
        for label in &finding.labels {
            assert!(label.span.start <= label.span.end);
            let source = &loaded.sources.files[label.span.file as usize];
            assert!(source.text.get(label.span.start as usize..label.span.end as usize).is_some(), "{finding:?}");
        }
    }
}

/// Words of the language in any order.
fn words() -> impl Strategy<Value = String> {
    let word = prop::sample::select(vec![
        "use",
        "\"stream.rules\"",
        "stream",
        "{",
        "}",
        "for",
        "each",
        "hand",
        "param",
        "a",
        "b.c",
        "=",
        "3",
        "mm/s",
        "in",
        "..",
        "signal",
        "latch",
        "set",
        "clear",
        "primitive",
        "A",
        "B(side)",
        "(left)",
        "tree",
        "t",
        "left",
        ",",
        "right",
        "settle",
        "=>",
        "stay",
        "separate",
        "else",
        "extend",
        "t.a",
        "first",
        "last",
        "before",
        "after",
        "task",
        "with",
        "without",
        "or",
        "and",
        "not",
        "joined",
        "relabel",
        "sequence",
        "becomes",
        "between",
        "shorter",
        "than",
        "(",
        ")",
        "[",
        "]",
        "+",
        "-",
        "*",
        "/",
        "<",
        ">",
        "==",
        "above",
        "until",
        "below",
        "within",
        "next",
        "from",
        "none",
        "thumb",
        "norm",
        "any",
        "target.velocity",
        "fingers.force",
        ":",
        "bool",
        "per",
        "finger",
        "\n",
        "// x\n",
        "/// doc\n",
        "true",
        "%",
        "optional",
        "é",
        "\"",
    ]);
    prop::collection::vec(word, 0..120).prop_map(|words| words.join(" "))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_text(text in "\\PC{0,300}") {
        survives(&text);
    }

    #[test]
    fn any_bytes(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        survives(&String::from_utf8_lossy(&bytes));
    }

    #[test]
    fn any_words(text in words()) {
        survives(&text);
    }

    #[test]
    fn shipped_files_cut_and_mixed(
        file in 0..SHIPPED.len(),
        cut in any::<prop::sample::Index>(),
        from in any::<prop::sample::Index>(),
        length in 0..60_usize,
        put in words(),
        keep_end in any::<bool>(),
    ) {
        let text: Vec<char> = SHIPPED[file].1.chars().collect();
        let cut = cut.index(text.len());
        let from = from.index(text.len());
        let taken: String = text[from..(from + length).min(text.len())].iter().collect();
        let head: String = text[..cut].iter().collect();
        let end: String = if keep_end { text[(cut + length).min(text.len())..].iter().collect() } else { String::new() };
        survives(&format!("{head}{taken}{put}{end}"));
        survives(&format!("{head}{taken}{end}"));
        survives(&format!("{head}{end}"));
    }
}

#[test]
fn deep_and_long_texts_are_refused_cleanly() {
    let many = 200_000;
    for text in [
        "(".repeat(many),
        "{".repeat(many),
        ")".repeat(many),
        format!("signal a = {}", "(".repeat(many)),
        format!("signal a = {}true{}", "(".repeat(many), ")".repeat(many)),
        format!("signal a = {}true", "not ".repeat(many)),
        format!("signal a = {}3", "- ".repeat(many)),
        format!("signal a = {}3", "-".repeat(3900)),
        format!("signal a = 1{}", " + 1".repeat(1900)),
        format!("signal a = 1{}", " * (1".repeat(1900)),
        format!("signal a = b{}", "[thumb]".repeat(1200)),
        format!("signal a = b{}", ".x".repeat(many)),
        format!("signal a = (b){}", " for 1 s".repeat(1200)),
        format!("signal a = {}", "norm(".repeat(many)),
        format!("tree t for each hand {{ {}", "a { ".repeat(many)),
        format!("tree t for each hand {{ {} {}", "a { ".repeat(40), "b => C ".repeat(10_000)),
        format!("relabel {{ {}", "(A or B)+ ".repeat(20_000)),
        format!("primitive A{}", ", A".repeat(1900)),
        "primitive A, B, C\n".repeat(9000),
        (0..6000).map(|at| format!("signal s{at} = s{}\n", at + 1)).collect(),
        (0..6000).map(|at| format!("signal s{at} = s{}\n", (at + 1) % 6000)).collect(),
        (0..6000).map(|at| format!("param p{} = p{at} + 1\n", at + 1)).collect(),
        (0..5000).map(|at| format!("task t{at} = A .. B with C before t{}\n", at + 1)).collect(),
        format!("/* {}", "*".repeat(many)),
        "\u{feff}param a = 3\r\nsignal b = a > 1\r\n".to_string(),
    ] {
        survives(&text);
    }
}
