//! Hover: declaration, type, range and comments of the name or sign under the pointer, and its value in the recording.

use super::recording::Recording;
use super::workspace::{RuleSet, Spot};
use lsp_types::{Hover, MarkupContent, MarkupKind};
use teachtree_analysis::explain::quantities;
use teachtree_base::channels::derived;
use teachtree_base::diagnostic::Span;
use teachtree_base::units;
use teachtree_language::evidence::evidence_in;
use teachtree_language::index::{Kind, Symbol};
use teachtree_language::rules::{Expr, ExprKind, Hand, LatchId, Param, PrimitiveId, Rules, SignalId, Type};
use teachtree_language::{describe, ops};

/// Lines of a declaration that are shown.
const MAX_LINES: usize = 12;

/// Returns the hover text of a place.
pub fn hover(spot: &Spot, recording: &mut Recording) -> Option<Hover> {
    let rule_set = &spot.rule_set;
    let here = Span { file: spot.file, start: spot.offset, end: spot.offset };
    let evidence = evidence_of_line(rule_set, here);
    if let Some((comment, text)) = evidence.as_ref().filter(|(comment, _)| comment.start <= here.start) {
        return Some(shown(rule_set, text.clone(), *comment));
    }
    let mention = spot.mention();
    let span = mention.map_or(here, |mention| mention.span);
    let checked = rule_set.survey.rules.expr_at(span);
    let symbol = mention.and_then(|mention| rule_set.symbol(mention));
    let mut parts = Vec::new();
    let (range, value) = match symbol {
        Some(symbol) => {
            parts.extend(declaration(rule_set, symbol));
            parts.extend(kind(&rule_set.survey.rules, symbol));
            parts.extend(Some(prose(&symbol.doc())).filter(|doc| !doc.is_empty()));
            // Where it stands says whose it is; in its declaration it is its own.
            let expr = checked
                .filter(|(expr, _)| names(rule_set, symbol, expr))
                .map(|(expr, per_hand)| (expr.clone(), per_hand));
            (span, expr.or_else(|| own(&rule_set.survey.rules, symbol, span)))
        }
        None => match unit(rule_set, here) {
            Some((span, text)) => {
                parts.push(text);
                (span, None)
            }
            None => {
                let (expr, per_hand) = checked?;
                let text = rule_set.survey.sources.text(expr.span);
                parts.push(code(text));
                parts.push(describe(expr.ty));
                parts.extend(ops::of(&expr.kind).map(|operator| prose(operator.doc)));
                (expr.span, Some((expr.clone(), per_hand)))
            }
        },
    };
    let rules = &rule_set.survey.rules;
    match (value, symbol) {
        (Some((expr, per_hand)), _) => {
            parts.extend(lines_of(rule_set, recording, |it| it.value(rules, &expr, per_hand)))
        }
        (None, Some(Symbol { kind: Kind::Param, name, .. })) => {
            parts.extend(rules.param(name).map(|param| format!("now {}", quantity(param.value, param))));
        }
        (None, Some(Symbol { kind: Kind::Tree | Kind::Primitive, .. })) => {
            parts.extend(lines_of(rule_set, recording, |it| it.leaves(rules)));
        }
        _ => {}
    }
    // The comments of a declaration contain its evidence.
    parts.extend(evidence.map(|(_, text)| text).filter(|text| !parts.iter().any(|part| part.contains(text))));
    Some(shown(rule_set, parts.join("\n\n"), range))
}

fn shown(rule_set: &RuleSet, value: String, range: Span) -> Hover {
    let content = MarkupContent { kind: MarkupKind::Markdown, value };
    Hover { contents: content.into(), range: Some(rule_set.range(range)) }
}

/// The comment with the evidence that `learn` wrote on the line of a place, and its text.
fn evidence_of_line(rule_set: &RuleSet, here: Span) -> Option<(Span, String)> {
    let (before, after) = rule_set.text(here.file).split_at_checked(here.start as usize)?;
    let start = before.rfind('\n').map_or(0, |newline| newline + 1);
    let end = here.start as usize + after.lines().next().map_or(0, str::len);
    let (at, evidence) = evidence_in(rule_set.text(here.file).get(start..end)?)?;
    let comment = Span { start: u32::try_from(start + at).ok()?, end: u32::try_from(end).ok()?, ..here };
    Some((comment, format!("learned: {}", prose(evidence))))
}

/// The type of a thing, as far as it has one.
pub fn kind(rules: &Rules, symbol: &Symbol) -> Option<String> {
    match symbol.kind {
        Kind::Param => {
            let param = rules.param(&symbol.name)?;
            let range = param.range.map_or(String::new(), |(low, high)| {
                format!(", from {} to {}", quantity(low, param), quantity(high, param))
            });
            Some(format!("{}{range}", param.dimension))
        }
        Kind::Signal => {
            let signal = rules.signals.iter().find(|signal| signal.name == symbol.name)?;
            Some(of_hands(describe(signal.ty), signal.per_hand))
        }
        Kind::Latch => {
            let latch = rules.latches.iter().find(|latch| latch.name == symbol.name)?;
            Some(of_hands(describe(Type::BOOL), latch.per_hand))
        }
        Kind::Channel => {
            let known = rules.channels.iter().find(|channel| channel.name == symbol.name).cloned();
            let channel =
                known.or_else(|| derived(&symbol.name).map(teachtree_base::channels::DerivedChannel::spec))?;
            let axis = channel.axis.map(|axis| (axis, Hand::This));
            let ty = Type { shape: channel.shape, dimension: channel.dimension, axis };
            Some(of_hands(describe(ty), channel.per_hand))
        }
        Kind::Primitive => rules.primitive(&symbol.name).and_then(|primitive| meant(rules, primitive)),
        Kind::Task => is_failure(rules, &symbol.name).then(|| "a task that is a failure".to_string()),
        _ => None,
    }
}

/// Returns the parent of a primitive, and the action of a hand in it.
fn meant(rules: &Rules, primitive: PrimitiveId) -> Option<String> {
    let above: Vec<String> = rules.lineage(primitive).skip(1).map(|one| format!("`{}`", one.name)).collect();
    let does = rules.meaning(primitive).map(|meaning| format!("does `{}`: {}", meaning.name(), meaning.doc()));
    let is = (!above.is_empty()).then(|| format!("a kind of {}", above.join(", a kind of ")));
    let text: Vec<String> = is.into_iter().chain(does).collect();
    (!text.is_empty()).then(|| text.join("; "))
}

/// Whether a task of this name is a failure.
fn is_failure(rules: &Rules, name: &str) -> bool {
    rules.tasks.iter().any(|task| task.failure && task.name == name)
        || rules.composites.iter().any(|task| task.failure && task.name == name)
}

fn of_hands(ty: String, per_hand: bool) -> String {
    if per_hand { format!("{ty}, of each hand") } else { ty }
}

fn quantity(value: f64, param: &Param) -> String {
    let [text] = quantities([value], &param.dimension.si_unit());
    text
}

/// How it is declared, or called.
fn declaration(rule_set: &RuleSet, symbol: &Symbol) -> Option<String> {
    if symbol.kind == Kind::Function {
        let function = ops::function(&symbol.name)?;
        return Some(code(&function.calls().join("\n")));
    }
    if symbol.kind == Kind::File {
        return Some(format!("the file `{}`", symbol.name));
    }
    // The implementation of an abstract signal, rather than its declaration.
    let sources = &rule_set.survey.sources;
    let texts: Vec<&str> = symbol.declared.iter().map(|at| sources.text(at.extent)).collect();
    let text = texts.iter().find(|text| text.contains('=')).or_else(|| texts.first());
    match text {
        Some(text) => Some(code(text.trim_end_matches('{').trim_end())),
        None => Some(code(&format!("{} {}", symbol.kind.word(), symbol.name))),
    }
}

fn code(text: &str) -> String {
    let lines: Vec<&str> = text.lines().map(str::trim_end).collect();
    // Further lines keep their places below each other.
    let indent = |line: &&str| line.len() - line.trim_start().len();
    let left = lines.iter().skip(1).filter(|line| !line.is_empty()).map(indent).min().unwrap_or(0);
    let further = lines.iter().skip(1).take(MAX_LINES - 1).map(|line| line.get(left.saturating_sub(2)..).unwrap_or(""));
    let mut shown: Vec<&str> = lines.first().copied().into_iter().chain(further).collect();
    if lines.len() > MAX_LINES {
        shown.push("…");
    }
    format!("```teachtree\n{}\n```", shown.join("\n"))
}

/// Comments as Markdown: signs that Markdown would take for its own stay what they are.
fn prose(doc: &str) -> String {
    let mut out = String::with_capacity(doc.len());
    for c in doc.chars() {
        if matches!(c, '*' | '_' | '<' | '[' | ']' | '#') {
            out.push('\\');
        }
        out.push(c);
    }
    out
}

/// Whether an expression is just this name.
fn names(rule_set: &RuleSet, symbol: &Symbol, expr: &Expr) -> bool {
    let rules = &rule_set.survey.rules;
    match (&expr.kind, symbol.kind) {
        (ExprKind::Signal(id, _), Kind::Signal) => {
            rules.signals.get(id.index()).is_some_and(|it| it.name == symbol.name)
        }
        (ExprKind::Latch(id, _), Kind::Latch) => rules.latches.get(id.index()).is_some_and(|it| it.name == symbol.name),
        (ExprKind::Channel(id, _), Kind::Channel) => {
            rules.channels.get(id.index()).is_some_and(|it| it.name == symbol.name)
        }
        // A call is what its function's name stands for.
        (_, Kind::Function) => true,
        _ => false,
    }
}

/// Returns the declared item as an expression.
fn own(rules: &Rules, symbol: &Symbol, span: Span) -> Option<(Expr, bool)> {
    let made = |kind, ty, per_hand| Some((Expr { kind, ty, span }, per_hand));
    let whose = |per_hand| if per_hand { Hand::This } else { Hand::Shared };
    match symbol.kind {
        Kind::Signal => {
            let at = rules.signals.iter().position(|signal| signal.name == symbol.name)?;
            let signal = rules.signals.get(at)?;
            let id = SignalId(u32::try_from(at).ok()?);
            made(ExprKind::Signal(id, whose(signal.per_hand)), signal.ty, signal.per_hand)
        }
        Kind::Latch => {
            let at = rules.latches.iter().position(|latch| latch.name == symbol.name)?;
            let per_hand = rules.latches.get(at)?.per_hand;
            made(ExprKind::Latch(LatchId(u32::try_from(at).ok()?), whose(per_hand)), Type::BOOL, per_hand)
        }
        _ => None,
    }
}

/// Returns the value in the recording.
fn lines_of(
    rule_set: &RuleSet,
    recording: &mut Recording,
    values: impl FnOnce(&mut Recording) -> Option<Result<String, String>>,
) -> Option<String> {
    recording.log()?;
    if !rule_set.survey.sound {
        return Some("no value: the rules have mistakes".to_string());
    }
    match values(recording)? {
        Ok(text) => Some(text),
        Err(error) => Some(format!("no value: {error}")),
    }
}

/// The unit at a place.
fn unit(rule_set: &RuleSet, here: Span) -> Option<(Span, String)> {
    let text = rule_set.text(here.file);
    let letter = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '%');
    let head = text.get(..here.start as usize)?;
    let start = head.len() - head.chars().rev().take_while(|c| letter(*c)).count();
    let end = start + text.get(start..)?.chars().take_while(|c| letter(*c)).count();
    let word = text.get(start..end)?;
    // `30ms` is a number and its unit.
    let symbol = word.trim_start_matches(|c: char| c.is_ascii_digit());
    let unit = units::unit(symbol)?;
    let span = Span { start: u32::try_from(end - symbol.len()).ok()?, end: u32::try_from(end).ok()?, ..here };
    let si = unit.dimension.si_unit();
    Some((span, format!("`{symbol}`: {}, {} {si}", unit.dimension.word().unwrap_or("a quantity"), unit.in_si)))
}
