//! What editors color is what the language has: the words of `editors/` against the grammar.

use std::collections::BTreeSet;
use teachtree_base::units::UNITS;
use teachtree_language::ops;

fn read(name: &str) -> String {
    std::fs::read_to_string(std::path::Path::new(crate::ROOT).join(name)).unwrap()
}

/// Small words in a text, without what regular expressions write with letters.
fn words(text: &str) -> BTreeSet<String> {
    let mut plain = text.to_string();
    for escape in ["\\ze", "\\zs", "\\b", "\\t", "\\s", "\\w", "[A-Za-z_]", "[a-z_]"] {
        plain = plain.replace(escape, " ");
    }
    let words = plain.split(|c: char| !c.is_ascii_alphanumeric());
    words.filter(|word| word.starts_with(|c: char| c.is_ascii_lowercase())).map(str::to_string).collect()
}

/// Words in quotes in a piece of the grammar.
fn quoted(text: &str) -> BTreeSet<String> {
    let quoted = text.split('"').skip(1).step_by(2);
    quoted.filter(|word| word.chars().all(|c| c.is_ascii_lowercase())).map(str::to_string).collect()
}

/// The words that are never names, and those that are words of the language in their place only.
fn of_the_grammar() -> (BTreeSet<String>, BTreeSet<String>) {
    let tokens = read("grammar/tokens.pest");
    let (_, behind) = tokens.split_once("reserved = _{").unwrap();
    let reserved = quoted(behind.split_once("\n}").unwrap().0);
    assert!(reserved.len() > 30, "{reserved:?}");
    let keywords: BTreeSet<String> = tokens.lines().filter(|line| line.starts_with("kw_")).flat_map(quoted).collect();
    let contextual = keywords.difference(&reserved).cloned().collect();
    assert_eq!(reserved.difference(&keywords).count(), 0, "each has a rule of its own");
    (reserved, contextual)
}

#[test]
fn vs_code_colours_the_words_of_the_grammar() {
    let grammar: serde_json::Value =
        serde_json::from_str(&read("editors/vscode/syntaxes/teachtree.tmLanguage.json")).unwrap();
    let pattern = |name: &str| grammar["repository"][name]["match"].as_str().unwrap().to_string();
    let (reserved, contextual) = of_the_grammar();
    assert_eq!(words(&pattern("reserved")), reserved);
    let mut in_place = words(&pattern("contextual"));
    in_place.extend(words(&pattern("hands")));
    let expected: BTreeSet<String> =
        contextual.union(&reserved).cloned().chain(["side".into(), "either".into()]).collect();
    assert_eq!(in_place, expected, "the reserved ones are what must not follow");
    let functions: BTreeSet<String> = ops::functions().map(|function| function.name.to_string()).collect();
    let named = pattern("functions").replace("\\b(?:", "").replace(")(?=[ \\t]*\\()", "");
    assert_eq!(named.split('|').map(str::to_string).collect::<BTreeSet<_>>(), functions);
    for unit in UNITS {
        let part = format!("{}{}", unit.symbol, if unit.symbol == "%" { ")" } else { "" });
        assert!(
            pattern("quantity").contains(&format!("|{part}")) || pattern("quantity").contains(&format!("(?:{part}|")),
            "{part}"
        );
    }
    // Every pattern is one of the repository.
    for include in grammar["patterns"].as_array().unwrap() {
        let name = include["include"].as_str().unwrap().trim_start_matches('#');
        assert!(grammar["repository"][name].is_object(), "{name}");
    }
}

#[test]
fn vim_colours_the_words_of_the_grammar() {
    let syntax = read("editors/vim/syntax/teachtree.vim");
    let (reserved, contextual) = of_the_grammar();
    let keywords = syntax.lines().find_map(|line| line.strip_prefix("syntax keyword teachtreeKeyword ")).unwrap();
    assert_eq!(keywords.split(' ').map(str::to_string).collect::<BTreeSet<_>>(), reserved);
    let in_place: BTreeSet<String> =
        syntax.lines().filter_map(|line| line.strip_prefix("syntax match teachtreeKeyword ")).flat_map(words).collect();
    let hands = ["left", "right"].map(str::to_string).into_iter().collect();
    let wanted: BTreeSet<String> = contextual.difference(&hands).cloned().collect();
    assert_eq!(in_place.difference(&reserved).cloned().collect::<BTreeSet<_>>(), wanted);
    let functions = syntax.lines().find_map(|line| line.strip_prefix("syntax match teachtreeFunction ")).unwrap();
    let known: BTreeSet<String> = ops::functions().map(|function| function.name.to_string()).collect();
    let inner = functions.split_once("\\(").unwrap().1.split_once("\\)").unwrap().0;
    assert_eq!(inner.split("\\|").map(str::to_string).collect::<BTreeSet<_>>(), known);
    let units = syntax.lines().find_map(|line| line.strip_prefix("syntax match teachtreeUnit ")).unwrap();
    for unit in UNITS.iter().filter(|unit| unit.symbol != "%") {
        let symbol = unit.symbol;
        assert!(units.contains(&format!("|{symbol}\\")) || units.contains(&format!("({symbol}\\")), "{symbol}");
    }
}

/// The generated parser lists its tokens, so that a word that only `grammar.js` has is found too. `test.sh` beside it compares the two.
#[test]
fn tree_sitter_has_the_words_of_the_grammar() {
    let parser = read("editors/tree-sitter-teachtree/src/parser.c");
    let (_, behind) = parser.split_once("ts_symbol_names[] = {").unwrap();
    let (names, _) = behind.split_once("};").unwrap();
    let tokens: BTreeSet<String> = names.lines().filter(|line| line.contains("[anon_sym_")).flat_map(quoted).collect();
    let (reserved, contextual) = of_the_grammar();
    let declarations = read("grammar/declarations.pest");
    let types =
        declarations.lines().filter(|line| line.starts_with("kind  ") || line.starts_with("axis  ")).flat_map(quoted);
    let mut expected: BTreeSet<String> = contextual.union(&reserved).cloned().chain(types).collect();
    for unit in UNITS {
        assert!(names.contains(&format!("] = \"{}\",", unit.symbol)), "{}", unit.symbol);
        expected.extend(quoted(&format!("\"{}\"", unit.symbol)));
    }
    assert_eq!(tokens, expected);
    let grammar = read("editors/tree-sitter-teachtree/grammar.js");
    let (_, behind) = grammar.split_once("const RESERVED = [").unwrap();
    assert_eq!(quoted(behind.split_once("];").unwrap().0), reserved);
    let colored = quoted(&read("editors/tree-sitter-teachtree/queries/highlights.scm"));
    let expected: BTreeSet<String> = contextual.union(&reserved).cloned().chain(["either".into()]).collect();
    let nodes = ["true", "false"].map(str::to_string).into_iter().collect();
    assert_eq!(colored, &expected - &nodes);
}

#[test]
fn the_extension_starts_the_server_with_the_settings_that_it_declares() {
    let package: serde_json::Value = serde_json::from_str(&read("editors/vscode/package.json")).unwrap();
    let declared: BTreeSet<&str> = package["contributes"]["configuration"]["properties"]
        .as_object()
        .unwrap()
        .keys()
        .map(|name| name.strip_prefix("teachtree.").unwrap())
        .collect();
    assert_eq!(declared, ["at", "binding", "command", "hand", "log", "scene"].into_iter().collect());
    let client = read("editors/vscode/extension.js");
    assert!(declared.iter().all(|name| client.contains(&format!("{name},")) || client.contains(&format!("{name} }}"))));
    let language = &package["contributes"]["languages"][0];
    let grammar = &package["contributes"]["grammars"][0];
    for file in [&language["configuration"], &grammar["path"], &package["main"]] {
        assert!(!read(&format!("editors/vscode/{}", file.as_str().unwrap())).is_empty());
    }
    assert_eq!(language["id"], grammar["language"]);
    let _: serde_json::Value = serde_json::from_str(&read("editors/vscode/language-configuration.json")).unwrap();
}
