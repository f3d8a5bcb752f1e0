//! Two rule sets held against each other: where their trees give different leaves, and whether one only adds to the other.
//!
//! Every way through one tree is paired with every way through the other. A pair with different leaves counts only if its conditions can
//! hold together (`formula`), so a proof holds for every log; a difference comes with the case that shows it.

use crate::language::formula::{Answer, Formula, Reader, possible, written};
use crate::language::rules::{
    self, Expr, ExprKind, Hand, Label, Labels, PrimitiveId, Relabel, RelabelKind, Rules, Task, Then, Tree, TreeScope,
};
use std::collections::{BTreeMap, BTreeSet};

/// Differences of one pair of trees that are reported.
const MAX_TOLD: usize = 20;
/// Pairs of ways that may be too much work; the rest is not looked at then.
const MAX_CUT: usize = 10;

/// A case in which two trees give different leaves on a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// The tree.
    pub tree: String,
    /// What holds and what does not, as it is written.
    pub conditions: Vec<(String, bool)>,
    /// A leaf before, where it matters.
    pub before: Option<String>,
    /// What the first rule set gives.
    pub one: String,
    /// What the second one gives.
    pub other: String,
    /// Where the second one says so.
    pub place: String,
}

/// What came of comparing two trees.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Compared {
    /// The trees that were compared, by name.
    pub trees: Vec<String>,
    /// The trees that only one of them has.
    pub alone: Vec<String>,
    /// Where they differ.
    pub differences: Vec<Difference>,
    /// Whether some pair of ways was too much work: then unreported trees may differ too.
    pub is_cut: bool,
}

/// Whether a rule set only adds to another one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Additive {
    /// The primitives that are new.
    pub new: Vec<String>,
    /// The trees; differences are those into a leaf that is not new.
    pub trees: Compared,
    /// Declarations of the base that are gone or mean something else.
    pub changed: Vec<String>,
    /// Tasks and relabeling rules that may do something where no new primitive occurs.
    pub acts: Vec<String>,
}

impl Additive {
    /// Whether it is proved.
    pub fn is_proved(&self) -> bool {
        self.trees.differences.is_empty() && !self.trees.is_cut && self.changed.is_empty() && self.acts.is_empty()
    }
}

/// Tries to prove that, on every frame and in every state of the base, the extension gives the base's leaf or one of its own primitives,
/// and that its tasks and rules do nothing where none of them occurs.
pub fn additive(base: &Rules, extended: &Rules) -> Additive {
    let names = extended.primitives.iter().map(|primitive| primitive.name.clone());
    let new: Vec<String> = names.filter(|name| base.primitive(name).is_none()).collect();
    let new_label = new_in(base, extended);
    let trees = trees(base, extended, &|label| new_label(label));
    let mut changed = changed(base, &without_new(extended, &new_label));
    changed.extend(primitives_changed(base, extended));
    changed.extend(
        trees
            .alone
            .iter()
            .filter(|name| base.trees.iter().any(|tree| tree.name == **name))
            .map(|name| format!("the tree `{name}` is gone")),
    );
    Additive { new, trees, changed, acts: acts(base, extended, &new_label) }
}

/// The rules without new primitives in what `from` lists: while none of them has occurred, the leaf before is none of them.
fn without_new(rules: &Rules, is_new: &dyn Fn(Label) -> bool) -> Rules {
    fn cut(expr: &mut Expr, is_new: &dyn Fn(Label) -> bool) {
        if let ExprKind::From { labels, .. } = &mut expr.kind {
            labels.retain(|label| !is_new(*label));
        }
        expr.arguments_mut().into_iter().for_each(|part| cut(part, is_new));
    }
    let mut rules = rules.clone();
    for latch in &mut rules.latches {
        cut(&mut latch.set, is_new);
        cut(&mut latch.clear, is_new);
    }
    rules
}

/// Primitives of one rule set that are kinds of another primitive, or do something else, in the other one.
fn primitives_changed(one: &Rules, other: &Rules) -> Vec<String> {
    let meaning = |rules: &Rules, id: PrimitiveId| {
        let above = rules.lineage(id).nth(1).map(|above| above.name.clone());
        (above, rules.meaning(id), rules.primitives.get(id.index()).and_then(|one| one.other))
    };
    let both = one.primitives.iter().zip((0..).map(PrimitiveId));
    let both = both.filter_map(|(primitive, id)| Some((primitive, id, other.primitive(&primitive.name)?)));
    both.filter(|(_, ours, theirs)| meaning(one, *ours) != meaning(other, *theirs))
        .map(|(primitive, ..)| format!("the primitive `{}` means something else", primitive.name))
        .collect()
}

/// Whether a label of one rule set is of a primitive that another one does not have.
fn new_in<'r>(base: &'r Rules, extended: &'r Rules) -> impl Fn(Label) -> bool + 'r {
    let named = |label: Label| extended.primitives.get(label.primitive.index());
    move |label| named(label).is_some_and(|primitive| base.primitive(&primitive.name).is_none())
}

/// Where the trees of two rule sets give different leaves.
pub fn differences(one: &Rules, other: &Rules) -> Compared {
    trees(one, other, &|_| false)
}

/// Declarations of one rule set that the other lacks or that mean something else there.
pub fn changed(one: &Rules, other: &Rules) -> Vec<String> {
    let mut changed = Vec::new();
    let mut compare = |kind: &str, ours: BTreeMap<String, String>, theirs: BTreeMap<String, String>| {
        for (name, meaning) in ours {
            match theirs.get(&name) {
                None => changed.push(format!("the {kind} `{name}` is gone")),
                Some(other) if *other != meaning => changed.push(format!("the {kind} `{name}` means something else")),
                Some(_) => {}
            }
        }
    };
    let this = |per_hand: bool| if per_hand { Hand::This } else { Hand::Nobody };
    let params =
        |rules: &Rules| rules.params.iter().map(|param| (param.name.clone(), format!("{:e}", param.value))).collect();
    let signals = |rules: &Rules| {
        let meaning = |signal: &crate::language::rules::Signal| written(&signal.expr, rules, this(signal.per_hand));
        rules.signals.iter().map(|signal| (signal.name.clone(), meaning(signal))).collect()
    };
    let latches = |rules: &Rules| {
        let meaning = |latch: &crate::language::rules::Latch| {
            let this = this(latch.per_hand);
            format!("{} / {}", written(&latch.set, rules, this), written(&latch.clear, rules, this))
        };
        rules.latches.iter().map(|latch| (latch.name.clone(), meaning(latch))).collect()
    };
    let settling = |rules: &Rules| {
        let meaning =
            |tree: &Tree| tree.settle.as_ref().map_or("none".to_string(), |settle| format!("{:e}", settle.value));
        rules
            .trees
            .iter()
            .filter(|tree| other.tree(tree.scope).is_some())
            .map(|tree| (tree.name.clone(), meaning(tree)))
            .collect()
    };
    compare("param", params(one), params(other));
    compare("signal", signals(one), signals(other));
    compare("latch", latches(one), latches(other));
    compare("settling of", settling(one), settling(other));
    let made = |rules: &Rules| composites(rules).into_iter().collect();
    compare("task", made(one), made(other));
    changed
}

/// A way through a tree.
struct Way<'a> {
    asked: Vec<(String, &'a Expr, bool)>,
    /// The label, or `stay`, or `separate`.
    leaf: String,
    label: Option<Label>,
    place: String,
}

fn trees(one: &Rules, other: &Rules, is_new: &dyn Fn(Label) -> bool) -> Compared {
    let mut compared = Compared::default();
    for scope in [TreeScope::EachHand, TreeScope::BothHands] {
        let this = if scope == TreeScope::EachHand { Hand::This } else { Hand::Nobody };
        match (one.tree(scope), other.tree(scope)) {
            (Some(ours), Some(theirs)) => {
                compared.trees.push(theirs.name.clone());
                compare_trees(&Half::new(one, ours, this), &Half::new(other, theirs, this), is_new, &mut compared);
            }
            (Some(tree), None) | (None, Some(tree)) => compared.alone.push(tree.name.clone()),
            (None, None) => {}
        }
    }
    compared
}

/// One of two trees.
struct Half<'a> {
    reader: Reader<'a>,
    name: &'a str,
    this: Hand,
    ways: Vec<Way<'a>>,
}

impl<'a> Half<'a> {
    fn new(rules: &'a Rules, tree: &'a Tree, this: Hand) -> Self {
        let way = |way: rules::Way<'a>| {
            let (leaf, label) = match &way.choice.then {
                Then::Primitive(label) => (rules.label_name(*label), Some(*label)),
                Then::Separate => ("separate".into(), None),
                Then::Stay | Then::Branch(_) => ("stay".into(), None),
            };
            let asked = way
                .asked
                .into_iter()
                .map(|(_, condition, wanted)| (written(condition, rules, this), condition, wanted));
            Way { asked: asked.collect(), leaf, label, place: rules.sources.place(way.choice.span) }
        };
        let ways = tree.root.ways().into_iter().map(way).collect();
        Self { reader: Reader::new(rules), name: &tree.name, this, ways }
    }
}

fn compare_trees(one: &Half, other: &Half, is_new: &dyn Fn(Label) -> bool, compared: &mut Compared) {
    // The leaves before: those that the first tree gives.
    let mut leaves: BTreeSet<String> = one.ways.iter().filter_map(|way| way.label.map(|_| way.leaf.clone())).collect();
    leaves.insert("none".into());
    if one.ways.iter().any(|way| way.leaf == "separate") {
        leaves.insert("separate".into());
    }
    let mut cut = 0;
    for theirs in &other.ways {
        if theirs.label.is_some_and(is_new) {
            continue;
        }
        for ours in &one.ways {
            if ours.leaf == theirs.leaf || opposite(ours, theirs) {
                continue;
            }
            // `stay` is the leaf before: it differs only after another one, and never stands after none.
            let mut before = leaves.clone();
            for (stays, gives) in [(ours, theirs), (theirs, ours)] {
                if stays.leaf == "stay" {
                    before.retain(|leaf| *leaf != gives.leaf && *leaf != "none");
                }
            }
            if before.is_empty() {
                continue;
            }
            let formulas = |half: &Half, way: &Way| -> Vec<(Formula, bool)> {
                way.asked.iter().map(|(_, expr, wanted)| (half.reader.formula(expr, half.this), *wanted)).collect()
            };
            let all: Vec<(Formula, bool)> = formulas(one, ours).into_iter().chain(formulas(other, theirs)).collect();
            let wanted: Vec<(&Formula, bool)> = all.iter().map(|(formula, wanted)| (formula, *wanted)).collect();
            match possible(&wanted, before) {
                Answer::No => {}
                Answer::Perhaps => {
                    compared.is_cut = true;
                    cut += 1;
                    if cut >= MAX_CUT {
                        return;
                    }
                }
                Answer::Yes(_) if compared.differences.len() >= MAX_TOLD => {
                    compared.is_cut = true;
                    return;
                }
                Answer::Yes(case) => {
                    let conditions = case.conditions().map(|(text, holds)| (text.to_string(), holds)).collect();
                    let before = case.before.iter().next().filter(|_| case.before.len() < leaves.len()).cloned();
                    compared.differences.push(Difference {
                        tree: other.name.to_string(),
                        conditions,
                        before,
                        one: ours.leaf.clone(),
                        other: theirs.leaf.clone(),
                        place: theirs.place.clone(),
                    });
                }
            }
        }
    }
}

/// Whether two ways ask the same condition to come out differently.
fn opposite(one: &Way, other: &Way) -> bool {
    one.asked
        .iter()
        .any(|(ours, _, wanted)| other.asked.iter().any(|(theirs, _, other)| ours == theirs && wanted != other))
}

/// Tasks and relabeling rules of one rule set that are gone in another one, or ask for something else there.
pub fn lost(one: &Rules, other: &Rules) -> Vec<String> {
    lost_but(one, other, &|_| false)
}

/// The same, without what tasks ask of new primitives.
fn lost_but(base: &Rules, extended: &Rules, is_new: &dyn Fn(Label) -> bool) -> Vec<String> {
    let mut acts = Vec::new();
    let mut last = None;
    let ours = |task: &Task| asks(task, base, &|_| false);
    let new_label = new_in(base, extended);
    for task in &base.tasks {
        match extended.tasks.iter().position(|other| other.name == task.name) {
            None => acts.push(format!("the task `{}` is gone", task.name)),
            Some(at) => {
                if last.is_some_and(|last| at < last) {
                    acts.push(format!("the task `{}` comes earlier than in the base", task.name));
                }
                last = Some(at);
                let theirs = &extended.tasks[at];
                if ours(task) == asks(theirs, extended, is_new) {
                    continue;
                }
                acts.push(if ours(task) == asks(theirs, extended, &new_label) {
                    format!("the task `{}` differs only in new primitives", task.name)
                } else {
                    format!("the task `{}` asks for something else", task.name)
                });
            }
        }
    }
    let mut last = None;
    for (name, parts) in composites(base) {
        match composites(extended).iter().position(|(other, _)| *other == name) {
            None => acts.push(format!("the task `{name}` is gone")),
            Some(at) => {
                if last.is_some_and(|last| at < last) {
                    acts.push(format!("the task `{name}` comes earlier than in the base"));
                }
                last = Some(at);
                if composites(extended).get(at).is_some_and(|(_, theirs)| *theirs != parts) {
                    acts.push(format!("the task `{name}` is made of other tasks"));
                }
            }
        }
    }
    for rule in &base.relabels {
        if !extended
            .relabels
            .iter()
            .any(|other| other.text == rule.text && task_of(other, extended) == task_of(rule, base))
        {
            acts.push(format!("the rule `{}` is gone", rule.text));
        }
    }
    acts
}

/// Tasks and rules of the extension that may act where no new primitive occurs.
fn acts(base: &Rules, extended: &Rules, is_new: &dyn Fn(Label) -> bool) -> Vec<String> {
    let mut acts = lost_but(base, extended, is_new);
    let is_known = |task: &Task| base.tasks.iter().any(|known| known.name == task.name);
    let needs_new = |task: &Task| {
        let new_keys = task.keys.iter().filter(|key| is_new(key.label.label)).count();
        let needs_new = if task.all_keys { new_keys > 0 } else { new_keys == task.keys.len() };
        needs_new || is_new(task.first.label) || is_new(task.last.label)
    };
    for task in extended.tasks.iter().filter(|task| !is_known(task) && !needs_new(task)) {
        acts.push(format!("the task `{}` needs no new primitive", task.name));
    }
    for composite in &extended.composites {
        let tasks = composite.parts.iter().filter_map(|part| extended.tasks.get(part.task.index()));
        let is_old = base.composites.iter().any(|known| known.name == composite.name);
        if !is_old && !tasks.into_iter().any(|task| !is_known(task) && needs_new(task)) {
            acts.push(format!("the task `{}`, made of tasks, needs no new primitive", composite.name));
        }
    }
    let known = |rule: &Relabel| {
        base.relabels.iter().any(|other| other.text == rule.text && task_of(other, base) == task_of(rule, extended))
    };
    for rule in extended.relabels.iter().filter(|rule| !known(rule)) {
        let old_task = task_of(rule, extended).is_none_or(|task| base.tasks.iter().any(|known| known.name == task));
        if old_task && !is_idle(rule, base, extended, is_new) {
            acts.push(format!("the rule `{}` may act without a new primitive", rule.text));
        }
    }
    acts
}

/// The tasks that are made of tasks: their names, and what they are made of.
fn composites(rules: &Rules) -> Vec<(String, String)> {
    let part = |part: &crate::language::rules::Part| {
        let name = rules.tasks.get(part.task.index()).map_or("", |task| task.name.as_str());
        format!("{name}{}", if part.many { "+" } else { "" })
    };
    let made = |it: &crate::language::rules::Composite| it.parts.iter().map(part).collect::<Vec<_>>().join(", ");
    rules.composites.iter().map(|it| (it.name.clone(), made(it))).collect()
}

fn task_of<'a>(rule: &Relabel, rules: &'a Rules) -> Option<&'a str> {
    rule.task.and_then(|task| rules.tasks.get(task.index())).map(|task| task.name.as_str())
}

/// What a task asks, without what is asked of new primitives by keys of which any is enough.
fn asks(task: &Task, rules: &Rules, is_new: &dyn Fn(Label) -> bool) -> Vec<String> {
    let name = |label: &Label| rules.label_name(*label);
    let value = |constant: &Option<crate::language::rules::Constant>| {
        constant.as_ref().map(|constant| constant.value.to_bits())
    };
    let keys = task.keys.iter().filter(|key| task.all_keys || !is_new(key.label.label));
    let keys = keys.map(|key| {
        format!(
            "{} {:?} {:?} {:?}",
            name(&key.label.label),
            value(&key.lasting),
            value(&key.travelling),
            value(&key.turning)
        )
    });
    let ends = [name(&task.first.label), name(&task.last.label), format!("{} {}", task.all_keys, task.joined)];
    let without = task.without.iter().filter(|label| !is_new(**label)).map(|label| format!("without {}", name(label)));
    ends.into_iter().chain(keys).chain(without).collect()
}

/// Whether a rule does nothing that the base does not do, where no new primitive occurs: without them its pattern matches nothing, or a
/// rule of the base does the same wherever it matches.
fn is_idle(rule: &Relabel, base: &Rules, extended: &Rules, is_new: &dyn Fn(Label) -> bool) -> bool {
    let old = |labels: &Labels| -> Vec<String> {
        labels.iter().filter(|label| !is_new(**label)).map(|label| extended.label_name(*label)).collect()
    };
    let none = |labels: &Labels| old(labels).is_empty();
    match &rule.kind {
        RelabelKind::Between { what, run, shorter, between, becomes } => {
            if none(what) || none(&between.0) || none(&between.1) {
                return true;
            }
            let name = extended.label_name(*becomes);
            base.relabels.iter().any(|other| match &other.kind {
                RelabelKind::Between { what: w, run: r, shorter: s, between: b, becomes: c } => {
                    let within = |ours: &Labels, theirs: &Labels| {
                        let theirs: Vec<String> = theirs.iter().map(|label| base.label_name(*label)).collect();
                        old(ours).iter().all(|label| theirs.contains(label))
                    };
                    let longer = match (shorter, s) {
                        (_, None) => true,
                        (Some(ours), Some(theirs)) => ours.dimension == theirs.dimension && ours.value <= theirs.value,
                        (None, Some(_)) => false,
                    };
                    let same_task = other.task.is_none() || task_of(other, base) == task_of(rule, extended);
                    same_task
                        && within(what, w)
                        && within(&between.0, &b.0)
                        && within(&between.1, &b.1)
                        && (*r || !*run)
                        && longer
                        && base.label_name(*c) == name
                }
                _ => false,
            })
        }
        RelabelKind::BetweenInHands { what, one, other, .. } => {
            none(what) || none(&one.0) || none(&one.1) || none(&other.0) || none(&other.1)
        }
        RelabelKind::Become { what, .. } => none(what),
        RelabelKind::Sequence { elements, .. } => {
            elements.iter().any(|(labels, repeat)| *repeat != crate::language::rules::Repeat::Any && none(labels))
        }
        // It gives back what a tree over both hands took; a base without one has nothing of it.
        RelabelKind::Separate { .. } => base.tree(TreeScope::BothHands).is_none(),
    }
}
