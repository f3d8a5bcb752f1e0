//! Where the guards of a rule file and the numbers that they read are written, so that one of them can be changed and nothing else: for `learn --from`.

use super::ops::TemporalOperator;
use super::param_sites::written_number;
use super::parse::parse;
use super::rules::Rules;
use super::syntax::{Choice, Consequent, Expr, ExprKind, Item, ItemKind, RelabelKind, Task, TaskExtension};
use std::collections::BTreeSet;
use teachtree_base::diagnostic::Span;

/// The guards and numbers of one file of a rule set.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GuardSites {
    /// The conditions of choices, in their order; a choice with `else` has none.
    pub guards: Vec<GuardSite>,
    /// The values of params that no latch, `settle`, task, relabeling rule, default or other param reads, and the numbers in signals with which a quantity is compared or a duration is given, in their order.
    pub numbers: Vec<NumberSite>,
    /// The byte before which declarations may be inserted: behind the line of the item before the first tree or extension, or before this one on that line.
    /// `None` in a file without choices.
    pub declarations_at: Option<usize>,
}

/// The condition of a choice.
#[derive(Clone, Debug, PartialEq)]
pub struct GuardSite {
    /// Where it is written.
    pub span: Span,
    /// The conditions that hold together, in their order; at least one.
    pub conjuncts: Vec<Conjunct>,
    /// The names in `from(…)` of the choice or of the nearest choice around it, and whether `not` precedes it.
    pub after: Option<(Vec<String>, bool)>,
    /// The primitives of the leaf, or of all leaves of the branch behind it.
    pub leaves: BTreeSet<String>,
    /// Whether its tree labels both hands together.
    pub of_both: bool,
}

/// One of the conditions that hold together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Conjunct {
    /// Where it is written.
    pub span: Span,
    /// As it is written.
    pub text: String,
    /// Whether it reads `from` or a latch.
    pub reads_memory: bool,
    /// Whether it needs parentheses beside other conditions.
    pub is_open: bool,
}

/// A number with its unit.
#[derive(Clone, Debug, PartialEq)]
pub struct NumberSite {
    /// Where it is written, sign and unit included.
    pub span: Span,
    /// The value in the written unit.
    pub value: f64,
    /// The unit; empty for a plain number.
    pub unit: String,
}

/// The sites of a file, by its position among the sources.
pub fn guard_sites(rules: &Rules, file: u32) -> GuardSites {
    let Some(source) = rules.sources.files.get(file as usize) else { return GuardSites::default() };
    let (parsed, _) = parse(&source.text, file);
    let mut sites = Sites { rules, text: &source.text, fixed: fixed_params(rules), found: GuardSites::default() };
    let mut end = 0;
    for item in &parsed.items {
        if matches!(item.kind, ItemKind::Tree(_) | ItemKind::Extension(_)) {
            sites.found.declarations_at.get_or_insert(end.min(item.span.start as usize));
        }
        sites.item(item);
        let rest = source.text.get(item.span.end as usize..).unwrap_or("");
        end = source.text.len() - rest.len() + rest.find('\n').map_or(rest.len(), |newline| newline + 1);
    }
    sites.found
}

/// The numbers in a condition, as [`GuardSites::numbers`]; their spans count from its beginning.
pub fn numbers_in(condition: &str) -> Vec<NumberSite> {
    const HEAD: &str = "signal x = ";
    let text = format!("{HEAD}{condition}");
    let (parsed, _) = parse(&text, 0);
    let mut found = Vec::new();
    for item in &parsed.items {
        if let ItemKind::Signal(signal) = &item.kind {
            signal.value.iter().for_each(|value| numbers(&text, value, &mut found));
        }
    }
    let moved = |at: u32| at.saturating_sub(HEAD.len() as u32);
    for site in &mut found {
        site.span = Span { start: moved(site.span.start), end: moved(site.span.end), ..site.span };
    }
    found
}

struct Sites<'a> {
    rules: &'a Rules,
    text: &'a str,
    fixed: BTreeSet<String>,
    found: GuardSites,
}

impl Sites<'_> {
    fn item(&mut self, item: &Item) {
        match &item.kind {
            ItemKind::Param(param) if !self.fixed.contains(&param.name.text) => {
                self.found.numbers.extend(site(self.text, &param.value));
            }
            ItemKind::Signal(signal) => {
                signal.value.iter().for_each(|value| numbers(self.text, value, &mut self.found.numbers));
            }
            ItemKind::ForEachHand(items) => items.iter().for_each(|item| self.item(item)),
            ItemKind::Tree(tree) => self.choices(&tree.choices, !tree.each_hand, None),
            ItemKind::Extension(extension) => {
                let tree = extension.place.parts.first().map_or("", |name| name.text.as_str());
                let scope = self.rules.trees.iter().find(|it| it.name == tree).map(|it| it.scope);
                self.choices(&extension.choices, scope == Some(super::rules::TreeScope::BothHands), None);
            }
            _ => {}
        }
    }

    fn choices(&mut self, choices: &[Choice], of_both: bool, around: Option<&(Vec<String>, bool)>) {
        for choice in choices {
            let conjuncts = choice.condition.as_ref().map_or_else(Vec::new, conjuncts);
            let own = conjuncts.iter().find_map(|condition| after(condition));
            let after = own.or_else(|| around.cloned());
            if let Some(condition) = &choice.condition {
                let mut leaves = BTreeSet::new();
                add_leaves(&choice.then, &mut leaves);
                let conjuncts = conjuncts.iter().map(|condition| self.conjunct(condition)).collect();
                let guard = GuardSite { span: condition.span, conjuncts, after: after.clone(), leaves, of_both };
                self.found.guards.push(guard);
            }
            if let Consequent::Branch(below) = &choice.then {
                self.choices(below, of_both, after.as_ref());
            }
        }
    }

    fn conjunct(&self, condition: &Expr) -> Conjunct {
        let is_latch = |name: &str| self.rules.latches.iter().any(|latch| latch.name == name);
        let mut reads_memory = false;
        condition.walk(&mut |part| match &part.kind {
            ExprKind::From(..) => reads_memory = true,
            ExprKind::Path(path) => reads_memory |= path.parts.iter().any(|name| is_latch(&name.text)),
            _ => {}
        });
        let text = at(self.text, condition.span).to_string();
        Conjunct { span: condition.span, text, reads_memory, is_open: matches!(condition.kind, ExprKind::Or(_)) }
    }
}

/// The names in declarations that are not guards or signals: their values stay.
fn fixed_params(rules: &Rules) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    let mut add = |expr: &Expr| {
        expr.walk(&mut |part| {
            if let ExprKind::Path(path) = &part.kind {
                names.insert(path.text());
            }
        });
    };
    for source in &rules.sources.files {
        let (parsed, _) = parse(&source.text, 0);
        let items = parsed.items.iter().flat_map(|item| match &item.kind {
            ItemKind::ForEachHand(items) => items.as_slice(),
            _ => std::slice::from_ref(item),
        });
        for item in items {
            match &item.kind {
                ItemKind::Latch(latch) => [&latch.set, &latch.clear].into_iter().for_each(&mut add),
                ItemKind::Param(param) => add(&param.value),
                ItemKind::Stream(channels) => channels.iter().filter_map(|it| it.default.as_ref()).for_each(&mut add),
                ItemKind::Tree(tree) => tree.settle.iter().for_each(&mut add),
                ItemKind::Task(Task { keys, .. }) | ItemKind::TaskExtension(TaskExtension { keys, .. }) => {
                    keys.iter().flat_map(|key| &key.demands).for_each(|(_, demand)| add(demand));
                }
                ItemKind::Relabel(block) => block.rules.iter().for_each(|rule| {
                    if let RelabelKind::Between { shorter: Some(shorter), .. } = &rule.kind {
                        add(shorter);
                    }
                }),
                _ => {}
            }
        }
    }
    names
}

fn conjuncts(condition: &Expr) -> Vec<&Expr> {
    match &condition.kind {
        ExprKind::And(parts) => parts.iter().collect(),
        _ => vec![condition],
    }
}

/// The names in `from(…)` or `not from(…)`.
fn after(condition: &Expr) -> Option<(Vec<String>, bool)> {
    match &condition.bare().kind {
        ExprKind::From(labels, _) => Some((labels.iter().map(|label| label.name.text.clone()).collect(), false)),
        ExprKind::Not(inner) => after(inner).map(|(names, is_not)| (names, !is_not)),
        _ => None,
    }
}

fn add_leaves(then: &Consequent, leaves: &mut BTreeSet<String>) {
    match then {
        Consequent::Primitive(label) | Consequent::EachSide(label) => {
            leaves.insert(label.name.text.clone());
        }
        Consequent::Branch(choices) => choices.iter().for_each(|choice| add_leaves(&choice.then, leaves)),
        Consequent::Stay | Consequent::Separate | Consequent::Broken => {}
    }
}

fn numbers(text: &str, expr: &Expr, found: &mut Vec<NumberSite>) {
    expr.walk(&mut |part| match &part.kind {
        ExprKind::Compare(_, one, two) => found.extend([one, two].into_iter().filter_map(|side| site(text, side))),
        ExprKind::Hysteresis { on, off, .. } => found.extend([on, off].into_iter().filter_map(|side| site(text, side))),
        ExprKind::Temporal(operator, _) => {
            let durations = match operator {
                TemporalOperator::AtLeast { within, .. } => vec![within],
                _ => operator.constants(),
            };
            found.extend(durations.into_iter().filter_map(|duration| site(text, duration)));
        }
        _ => {}
    });
}

/// An expression that is a number.
fn site(text: &str, expr: &Expr) -> Option<NumberSite> {
    let is_number = |expr: &Expr| matches!(expr.kind, ExprKind::Number { .. });
    let is_plain = match &expr.kind {
        ExprKind::Negate(inner) => is_number(inner),
        _ => is_number(expr),
    };
    let (value, unit) = written_number(at(text, expr.span)).filter(|_| is_plain)?;
    Some(NumberSite { span: expr.span, value, unit: unit.to_string() })
}

fn at(text: &str, span: Span) -> &str {
    text.get(span.start as usize..span.end as usize).unwrap_or("")
}
