//! Compares channels, params, signals, latches, primitives and settling times of two rule sets by name and meaning, and finds trees that only one of
//! them has.

use super::Finding;
use super::labels::CommonLabels;
use crate::formula::canonical_text;
use crate::rules::{Branch, ChannelId, Consequent, Expr, ExprKind, Hand, PrimitiveId, Rules, Tree, TreeScope};
use std::collections::BTreeMap;
use teachtree_base::channels::{Axis, ChannelSpec, Fallback};
use teachtree_base::log_channel::LogChannel;

/// A declaration with its meaning as text.
struct Declaration {
    kind: &'static str,
    name: String,
    meaning: String,
    place: String,
}

/// Returns the declarations of the base that the extension lacks, or to which it gives another meaning for recordings without new primitives.
pub fn changed(base: &Rules, extended: &CommonLabels) -> Vec<Finding> {
    let ours = declared(&CommonLabels::all(base), extended.rules);
    let theirs = by_name(declared(extended, base));
    let finding = |ours: Declaration| {
        let (kind, name) = (ours.kind, &ours.name);
        match theirs.get(&(kind, name.clone())) {
            None => Some(Finding { what: format!("the {kind} `{name}` is gone"), place: ours.place }),
            Some(other) if other.meaning != ours.meaning => {
                Some(Finding { what: format!("the {kind} `{name}` means something else"), place: other.place.clone() })
            }
            Some(_) => None,
        }
    };
    ours.into_iter().filter_map(finding).collect()
}

/// Lists the differences between these declarations.
pub fn differences(one: &Rules, other: &Rules) -> Vec<String> {
    let mut lines: Vec<String> =
        changed(one, &CommonLabels::all(other)).into_iter().map(|finding| finding.what).collect();
    let known = by_name(declared(&CommonLabels::all(one), other));
    let theirs = declared(&CommonLabels::all(other), one);
    let new = theirs.iter().filter(|it| !known.contains_key(&(it.kind, it.name.clone())));
    lines.extend(new.map(|it| format!("the {} `{}` is new", it.kind, it.name)));
    lines
}

fn by_name(declared: Vec<Declaration>) -> BTreeMap<(&'static str, String), Declaration> {
    declared.into_iter().map(|it| ((it.kind, it.name.clone()), it)).collect()
}

/// Returns the declarations of a rule set except trees, tasks and relabeling rules.
fn declared(shared: &CommonLabels, other: &Rules) -> Vec<Declaration> {
    let rules = shared.rules;
    let place = |span| rules.sources.place(span);
    let of = |kind, name: &str, meaning: String, place: String| Declaration { kind, name: name.into(), meaning, place };
    let mut all = Vec::new();
    for (channel, at) in rules.channels.iter().zip(0..) {
        if channel.absent != Fallback::Derived {
            all.push(of("channel", &channel.name, channel_meaning(channel), read_at(rules, ChannelId(at))));
        }
    }
    for param in &rules.params {
        all.push(of("param", &param.name, format!("{:e} {:?}", param.value, param.dimension), place(param.span)));
    }
    for signal in &rules.signals {
        let meaning = canonical_text(&signal.expr, rules, this(signal.per_hand));
        all.push(of("signal", &signal.name, format!("{} {meaning}", signal.per_hand), place(signal.expr.span)));
    }
    for latch in &rules.latches {
        let part = |expr: &Expr| canonical_text(&without_new(expr, shared), rules, this(latch.per_hand));
        let meaning = format!("{} {} / {}", latch.per_hand, part(&latch.set), part(&latch.clear));
        all.push(of("latch", &latch.name, meaning, place(latch.span)));
    }
    for (primitive, id) in rules.primitives.iter().zip((0..).map(PrimitiveId)) {
        let above = rules.lineage(id).nth(1).map(|above| &above.name);
        let meaning = format!("{above:?} {:?} {:?} {}", rules.meaning(id), primitive.other, primitive.sided);
        all.push(of("primitive", &primitive.name, meaning, place(primitive.span)));
    }
    for tree in &rules.trees {
        // A tree that the other rule set lacks is reported separately.
        if other.tree(tree.scope).is_some() {
            let settle = tree.settle.as_ref().map_or("none".to_string(), |settle| format!("{:e}", settle.value));
            all.push(of("settling of", &tree.name, settle, place(tree.span)));
        }
    }
    all
}

const fn this(per_hand: bool) -> Hand {
    if per_hand { Hand::This } else { Hand::Shared }
}

/// Formats the type of a channel and its default.
fn channel_meaning(channel: &ChannelSpec) -> String {
    let absent = match &channel.absent {
        Fallback::Refused | Fallback::Derived => "needed".to_string(),
        Fallback::Constant(value) => format!("{value:e}"),
        // `needed` only determines whether a log without both channels is refused.
        Fallback::NormAbove { channel, on, off, needed: _ } => format!("norm {channel} {on:e} {off:e}"),
    };
    let ChannelSpec { per_hand, axis, shape, dimension, .. } = channel;
    format!("{per_hand} {axis:?} {shape:?} {dimension:?} {absent}")
}

/// Returns the place at which a channel is first read.
fn read_at(rules: &Rules, channel: ChannelId) -> String {
    let signals = rules.signals.iter().map(|signal| &signal.expr);
    let latches = rules.latches.iter().flat_map(|latch| [&latch.set, &latch.clear]);
    let paths: Vec<_> = rules.trees.iter().flat_map(|tree| tree.root.paths()).collect();
    let trees = paths.iter().flat_map(|path| path.asked.iter().map(|(_, condition, _)| *condition));
    let mut found = None;
    for expr in signals.chain(latches).chain(trees) {
        expr.walk(&mut |part| {
            if matches!(&part.kind, ExprKind::Channel(read, _) if *read == channel) {
                found = found.or(Some(part.span));
            }
        });
    }
    found.map_or(String::new(), |span| rules.sources.place(span))
}

/// Removes new primitives from the arguments of `from`: as long as none of them has occurred, the previous leaf is not one of them.
fn without_new(expr: &Expr, shared: &CommonLabels) -> Expr {
    fn cut(expr: &mut Expr, shared: &CommonLabels) {
        if let ExprKind::From { labels, .. } = &mut expr.kind {
            labels.retain(|label| !shared.is_new(*label));
        }
        expr.arguments_mut().into_iter().for_each(|part| cut(part, shared));
    }
    let mut expr = expr.clone();
    cut(&mut expr, shared);
    expr
}

/// Returns the raw channels that only the extension reads and that can change the analysis. A log column without a canonical name is read only if a rule names
/// it, and rows without a sample of it are left out. Contact flags determine the object that a hand handles.
pub fn new_channels(base: &Rules, extended: &Rules) -> Vec<Finding> {
    let why = |channel: &ChannelSpec| {
        if channel.name == "fingers.contact" {
            return Some("determines the object that a hand handles");
        }
        let canonical = match (channel.per_hand, channel.axis, channel.name.strip_prefix("fingers.")) {
            (true, Some(Axis::Fingers), Some(quantity)) => Some(format!("left.thumb.{quantity}")),
            (true, None, _) => Some(format!("left.{}", channel.name)),
            _ => None,
        };
        // A name with a body is canonical only where the scene has that body.
        let is_canonical = |name: &String| {
            LogChannel::parse(name)
                .is_some_and(|known| known.shape() == channel.shape && known.bodies() == [None, None])
        };
        (!canonical.as_ref().is_some_and(is_canonical)).then_some("leaves out rows in which it is not measured")
    };
    let all = extended.channels.iter().zip(0..).filter(|(channel, _)| channel.absent != Fallback::Derived);
    let new = all.filter(|(channel, _)| !base.channels.iter().any(|other| other.name == channel.name));
    let finding = |(channel, at): (&ChannelSpec, u32)| {
        let what = format!("the channel `{}`, which the base does not read, {}", channel.name, why(channel)?);
        Some(Finding { what, place: read_at(extended, ChannelId(at)) })
    };
    new.filter_map(finding).collect()
}

/// Returns the trees of the base that the extension lacks, and the new trees that may label hands without a new primitive.
pub fn new_trees(base: &Rules, extended: &CommonLabels) -> Vec<Finding> {
    let rules = extended.rules;
    let mut findings = Vec::new();
    for tree in base.trees.iter().filter(|tree| rules.tree(tree.scope).is_none()) {
        let place = base.sources.place(tree.span);
        findings.push(Finding { what: format!("the tree `{}` is gone", tree.name), place });
    }
    for tree in rules.trees.iter().filter(|tree| base.tree(tree.scope).is_none()) {
        if tree.scope == TreeScope::EachHand {
            let what = format!("the tree `{}` is new, and labels hands that the base does not label", tree.name);
            findings.push(Finding { what, place: rules.sources.place(tree.span) });
            continue;
        }
        old_leaves(&tree.root, tree, extended, &mut findings);
        let reads_from = |expr: &Expr| {
            let mut reads = false;
            expr.walk(&mut |part| reads |= matches!(part.kind, ExprKind::From { .. }));
            reads
        };
        let latches = base.latches.iter().filter(|latch| !latch.per_hand);
        for latch in latches.filter(|latch| reads_from(&latch.set) || reads_from(&latch.clear)) {
            let what = format!("the latch `{}` reads `from`, which is of the tree `{}`", latch.name, tree.name);
            findings.push(Finding { what, place: base.sources.place(latch.span) });
        }
    }
    findings
}

/// Finds primitives of the base in a new tree over both hands. They replace the labels of each hand.
fn old_leaves(branch: &Branch, tree: &Tree, extended: &CommonLabels, findings: &mut Vec<Finding>) {
    for choice in &branch.choices {
        match &choice.then {
            Consequent::Primitive(label) if !extended.is_new(*label) => {
                let name = extended.rules.label_name(*label);
                let what =
                    format!("the tree `{}` is new, and its `{name}` replaces the labels of both hands", tree.name);
                if !findings.iter().any(|known| known.what == what) {
                    findings.push(Finding { what, place: extended.rules.sources.place(choice.span) });
                }
            }
            Consequent::Branch(below) => old_leaves(below, tree, extended, findings),
            Consequent::Primitive(_) | Consequent::Stay | Consequent::Separate => {}
        }
    }
}
