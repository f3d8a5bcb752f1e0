//! Where the values of params are written, so that a number can be changed and nothing else: for `fit`, which proposes other ones, and
//! the studio, which writes them.

use super::parse;
use super::rules::{Expr, ExprKind, ParamId, Rules};
use super::syntax::{self, ItemKind};
use std::collections::BTreeSet;
use teachtree_base::diagnostic::Span;
use teachtree_base::units;

/// A param whose value is one number with a range: `param touch_on = 0.05 N in 0.01 N .. 0.50 N`.
#[derive(Clone, Debug, PartialEq)]
pub struct ParamSite {
    /// Its name.
    pub name: String,
    /// The place of the number with its unit.
    pub span: Span,
    /// The written unit; empty for a plain number.
    pub unit: String,
    /// The value, in that unit.
    pub value: f64,
    /// The range, in that unit.
    pub range: (f64, f64),
}

/// The params of a rule set that have a range and whose value is one number, in their order. Overrides do not count: it is what stands in
/// the files.
pub fn param_sites(rules: &Rules) -> Vec<ParamSite> {
    let mut found: Vec<(usize, ParamSite)> = Vec::new();
    for (source, file) in rules.sources.files.iter().zip(0..) {
        let (parsed, _) = parse::parse(&source.text, file);
        for item in &parsed.items {
            let ItemKind::Param(param) = &item.kind else { continue };
            let at = rules.params.iter().position(|known| known.span == param.name.span);
            let Some((at, range)) = at.and_then(|at| Some((at, rules.params.get(at)?.range?))) else { continue };
            found.extend(one(rules, param, range).map(|one| (at, one)));
        }
    }
    found.sort_by_key(|(at, _)| *at);
    found.into_iter().map(|(_, one)| one).collect()
}

/// The texts of files with other numbers at some sites, by the position of the file; comments, units and columns are kept.
pub fn rewritten(rules: &Rules, changes: &[(&ParamSite, String)]) -> Vec<(usize, String)> {
    let files = rules.sources.files.iter().zip(0_u32..);
    let changed = files.enumerate().filter_map(|(at, (source, file))| {
        let mut own: Vec<&(&ParamSite, String)> = changes.iter().filter(|(site, _)| site.span.file == file).collect();
        // Replaced from the end, so that earlier places stay valid.
        own.sort_by_key(|(site, _)| std::cmp::Reverse(site.span.start));
        let mut text = source.text.clone();
        for (site, number) in &own {
            replace(&mut text, site.span.start as usize, site.span.end as usize, number);
        }
        (!own.is_empty()).then_some((at, text))
    });
    changed.collect()
}

/// Puts a number in the place of another one. Where blanks follow to align what comes next, it stays aligned.
fn replace(text: &mut String, start: usize, end: usize, number: &str) {
    let (Some(old), Some(rest)) = (text.get(start..end), text.get(end..)) else { return };
    let (was, is) = (old.chars().count(), number.chars().count());
    let blanks = rest.len() - rest.trim_start_matches(' ').len();
    let wanted = (blanks + was).saturating_sub(is).max(1);
    let blanks_now = if blanks > 1 { wanted } else { blanks };
    text.replace_range(start..end + blanks, &format!("{number}{}", " ".repeat(blanks_now)));
}

/// `range` is in SI.
fn one(rules: &Rules, param: &syntax::Param, range: (f64, f64)) -> Option<ParamSite> {
    let number = |expr: &syntax::Expr| matches!(expr.kind, syntax::ExprKind::Number { .. });
    let plain = match &param.value.kind {
        syntax::ExprKind::Negate(inner) => number(inner),
        _ => number(&param.value),
    };
    if !plain {
        return None;
    }
    let text = rules.sources.text(param.value.span);
    let (value, unit) = written_number(text)?;
    let (in_si, _) = units::compound(unit).ok()?;
    let span = param.value.span;
    // `0.05 / 1e-3` is not 50 to the last bit.
    let back = |si: f64| format!("{:.9e}", si / in_si).parse::<f64>().unwrap_or(si / in_si);
    let range = (back(range.0), back(range.1));
    Some(ParamSite { name: param.name.text.clone(), span, unit: unit.to_string(), value, range })
}

/// The value of a number as it is written, and its unit.
pub(crate) fn written_number(text: &str) -> Option<(f64, &str)> {
    // The longest head that is a number; an `e` may begin a unit.
    let end = (0..=text.len())
        .rev()
        .find(|end| text.get(..*end).is_some_and(|head| head.trim_end().parse::<f64>().is_ok()))?;
    let (digits, unit) = text.split_at_checked(end)?;
    Some((digits.trim_end().parse().ok()?, unit.trim()))
}

/// The pairs of params that are the two thresholds of an `above … until below …`, or of its contrary, each alone: first the one that begins.
pub fn thresholds(rules: &Rules) -> BTreeSet<(ParamId, ParamId)> {
    let mut pairs = BTreeSet::new();
    let mut look = |expr: &Expr| {
        if let ExprKind::Hysteresis { on, off, .. } = &expr.kind
            && let ([on], [off]) = (on.params.as_slice(), off.params.as_slice())
            && on != off
        {
            pairs.insert((*on, *off));
        }
    };
    let signals = rules.signals.iter().map(|signal| &signal.expr);
    let latches = rules.latches.iter().flat_map(|latch| [&latch.set, &latch.clear]);
    let asked = rules.trees.iter().flat_map(|tree| tree.root.paths()).flat_map(|way| way.asked);
    for expr in signals.chain(latches).chain(asked.map(|(_, condition, _)| condition)) {
        expr.walk(&mut look);
    }
    pairs
}
