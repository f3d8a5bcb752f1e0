//! The syntax tree: exact places, comments and documentation kept.

use teachtree_base::diagnostic::{Source, Sources, Span};
use teachtree_base::units::UNITS;
use teachtree_language::syntax::{Consequent, Expr, ExprKind, ItemKind};
use teachtree_language::{self as language, SHIPPED};

fn sources(text: &str) -> Sources {
    Sources { files: vec![Source { name: "my.rules".to_string(), text: text.to_string() }] }
}

#[test]
fn documentation_stays_with_its_declaration() {
    let text = "\
// no documentation
/// How slow.
/// Ours.
param slow = 3 mm/s   // trailing
/// Not for the next one: a comment stands between.
// this one
signal a = true
for each hand {
  /// Inside.
  signal b = true
}
";
    let (file, findings) = language::parse_text(text);
    assert!(findings.is_empty());
    let sources = sources(text);
    let doc = |span: Option<Span>| span.map(|span| sources.text(span).to_string());
    assert_eq!(doc(file.items[0].doc).unwrap(), "/// How slow.\n/// Ours.");
    assert_eq!(doc(file.items[1].doc), None);
    let ItemKind::ForEachHand(inside) = &file.items[2].kind else { panic!("a block") };
    assert_eq!(doc(inside[0].doc).unwrap(), "/// Inside.");
    assert_eq!(file.comments.len(), 7);
    assert_eq!(sources.text(file.comments[3]), "// trailing");
    assert_eq!(sources.text(file.items[0].span), "param slow = 3 mm/s");
    assert_eq!(sources.text(file.items[2].span).lines().count(), 4);
}

/// Every place of an expression holds exactly what it says: parts lie in order within the whole, without blanks at the ends.
fn check_places(expr: &Expr, sources: &Sources) {
    let text = sources.text(expr.span);
    assert!(!text.is_empty() && text.trim() == text && !text.contains("//") || text.contains('\n'), "{text:?}");
    for part in expr.kind.parts() {
        assert!(expr.span.start <= part.span.start && part.span.end <= expr.span.end, "{text:?}");
        check_places(part, sources);
    }
    if let ExprKind::Path(path) = &expr.kind {
        assert_eq!(path.text(), text);
        assert!(path.parts.iter().all(|part| sources.text(part.span) == part.text));
    }
}

#[test]
fn places_are_exact_in_shipped_files() {
    let mut seen = 0;
    for (_, text) in SHIPPED {
        let (file, findings) = language::parse_text(text);
        assert!(findings.is_empty());
        let sources = sources(text);
        let mut items: Vec<_> = file.items.iter().collect();
        while let Some(item) = items.pop() {
            let words =
                ["use", "stream", "param", "signal", "latch", "for", "primitive", "tree", "extend", "task", "relabel"];
            assert!(words.contains(&sources.text(item.span).split([' ', '\n']).next().unwrap()));
            let mut choices = Vec::new();
            match &item.kind {
                ItemKind::ForEachHand(inside) => items.extend(inside),
                ItemKind::Param(param) => check_places(&param.value, &sources),
                ItemKind::Signal(signal) => signal.value.iter().for_each(|value| check_places(value, &sources)),
                ItemKind::Latch(latch) => {
                    check_places(&latch.set, &sources);
                    check_places(&latch.clear, &sources);
                }
                ItemKind::Tree(tree) => choices.extend(&tree.choices),
                ItemKind::Extension(extend) => choices.extend(&extend.choices),
                ItemKind::Relabel(block) => {
                    for rule in &block.rules {
                        assert!(sources.text(rule.span).contains("become"));
                        seen += 1;
                    }
                }
                _ => {}
            }
            while let Some(choice) = choices.pop() {
                seen += 1;
                choice.condition.iter().for_each(|condition| check_places(condition, &sources));
                match &choice.then {
                    Consequent::Primitive(label) | Consequent::EachSide(label) => {
                        assert!(sources.text(choice.span).ends_with(sources.text(label.span)))
                    }
                    Consequent::Branch(below) => {
                        assert!(sources.text(choice.span).ends_with('{'));
                        choices.extend(below);
                    }
                    _ => assert!(sources.text(choice.span).contains("=> s")),
                }
            }
        }
    }
    assert!(seen > 60, "{seen}");
}

#[test]
fn the_grammar_knows_every_unit() {
    for unit in UNITS {
        let text = format!("param a = 2 {0}\nparam b = 2 {0}/s^2 + 1 {0}/s/s\n", unit.symbol);
        let rules = language::load_text("my.rules", &text).rules.unwrap();
        assert_eq!(rules.params[0].value, 2.0 * unit.in_si, "{}", unit.symbol);
        assert_eq!(rules.params[0].dimension, unit.dimension);
    }
}
