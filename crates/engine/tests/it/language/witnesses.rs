//! Frames that findings show are run: the reference evaluator gets a log of their numbers, and does what the finding says.

use crate::engine::random;
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use teachtree_base::channels::{ChannelSpec, Fallback, Shape};
use teachtree_base::diagnostic::Span;
use teachtree_base::hands::Side;
use teachtree_base::units::Dimension;
use teachtree_engine::evaluator::evaluate;
use teachtree_engine::reference;
use teachtree_frames::frames::{ColumnKey, Frames, HandLayout, Layout};
use teachtree_language::formula::{Frame, canonical_text};
use teachtree_language::graph::lower;
use teachtree_language::lints::choices::dead_choices;
use teachtree_language::rules::*;
use teachtree_language::tree::gaps::gaps;

/// A log of a frame, with the frame before that gives the leaf before, and rules whose conditions read that log.
struct Replay<'a> {
    rules: &'a Rules,
    frame: &'a Frame,
    channels: Vec<ChannelSpec>,
    values: Vec<f64>,
}

fn of(kind: ExprKind, shape: Shape) -> Expr {
    Expr { kind, ty: Type { shape, dimension: Dimension::NONE, axis: None }, span: Span::default() }
}

fn not(expr: Expr) -> Expr {
    of(ExprKind::Not(Box::new(expr)), Shape::Bool)
}

fn is_constant(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Number(_) | ExprKind::Param(_) => true,
        ExprKind::Negate(_) | ExprKind::Arithmetic(..) => expr.arguments().into_iter().all(is_constant),
        _ => false,
    }
}

impl Replay<'_> {
    /// A channel that has this value on the frame.
    fn channel(&mut self, shape: Shape, value: f64) -> Expr {
        let (name, at) = (format!("c{}", self.channels.len()), self.channels.len() as u32);
        let (per_hand, axis, dimension, absent) = (false, None, Dimension::NONE, Fallback::Refused);
        self.channels.push(ChannelSpec { name, per_hand, axis, shape, dimension, absent });
        self.values.push(value);
        of(ExprKind::Channel(ChannelId(at), Hand::Shared), shape)
    }

    /// A number of the frame; 0 for one of which the frame says nothing.
    fn number(&mut self, expr: &Expr, this: Hand) -> Expr {
        if is_constant(expr) {
            return expr.clone();
        }
        let value = self.frame.numbers.get(&canonical_text(expr, self.rules, this)).copied();
        self.channel(Shape::Scalar, value.unwrap_or(0.0))
    }

    fn holds(&mut self, expr: &Expr, this: Hand) -> Option<Expr> {
        let value = *self.frame.holds.get(&canonical_text(expr, self.rules, this))?;
        Some(self.channel(Shape::Bool, f64::from(u8::from(value))))
    }

    /// A condition that reads the log of the frame: numbers where it has them, else whether it is said to hold.
    fn condition(&mut self, expr: &Expr, this: Hand) -> Expr {
        let mut all = |parts: &[Expr]| parts.iter().map(|part| self.condition(part, this)).collect();
        let boolean = |kind| of(kind, Shape::Bool);
        match &expr.kind {
            ExprKind::Bool(_) | ExprKind::From { .. } => expr.clone(),
            ExprKind::And(parts) => boolean(ExprKind::And(all(parts))),
            ExprKind::Or(parts) => boolean(ExprKind::Or(all(parts))),
            ExprKind::Not(inner) => not(self.condition(inner, this)),
            ExprKind::Signal(id, hand) => match self.holds(expr, this) {
                Some(held) => held,
                None => {
                    let this = if *hand == Hand::This { this } else { *hand };
                    let rules = self.rules;
                    self.condition(&rules.signals[id.index()].expr, this)
                }
            },
            ExprKind::Compare(Comparison::NotEqual, a, b) if a.ty.shape == Shape::Object => {
                let kind = ExprKind::Compare(Comparison::Equal, a.clone(), b.clone());
                not(self.condition(&Expr { kind, ..expr.clone() }, this))
            }
            ExprKind::Compare(comparison, a, b) if a.ty.shape == Shape::Scalar => {
                let (a, b) = (self.number(a, this), self.number(b, this));
                boolean(ExprKind::Compare(*comparison, Box::new(a), Box::new(b)))
            }
            ExprKind::Hysteresis { value, on, off, rising } => {
                let held = self.holds(expr, this);
                let value = self.number(value, this);
                let beyond = |limit: &Constant, above: bool| {
                    let comparison = if above { Comparison::Greater } else { Comparison::Less };
                    let limit = of(ExprKind::Number(limit.value), Shape::Scalar);
                    boolean(ExprKind::Compare(comparison, Box::new(value.clone()), Box::new(limit)))
                };
                // Its state is the reported one, unless the number excludes that.
                match held {
                    Some(held) => {
                        let on = boolean(ExprKind::And(vec![not(held.clone()), beyond(on, *rising)]));
                        let still = boolean(ExprKind::And(vec![held, not(beyond(off, !*rising))]));
                        boolean(ExprKind::Or(vec![still, on]))
                    }
                    None => beyond(on, *rising),
                }
            }
            ExprKind::Call(Function::Any, args) => {
                let count = of(ExprKind::Call(Function::Count, args.clone()), Shape::Scalar);
                let count = self.number(&count, this);
                let one = Box::new(of(ExprKind::Number(1.0), Shape::Scalar));
                boolean(ExprKind::Compare(Comparison::GreaterEqual, Box::new(count), one))
            }
            _ => self.holds(expr, this).unwrap_or_else(|| boolean(ExprKind::Bool(false))),
        }
    }

    fn branch(&mut self, branch: &Branch, this: Hand) -> Branch {
        let mut choice = |choice: &Choice| {
            let condition = choice.condition.as_ref().map(|condition| self.condition(condition, this));
            let then = match &choice.then {
                Consequent::Branch(below) => Consequent::Branch(self.branch(below, this)),
                leaf => leaf.clone(),
            };
            Choice { condition, then, ..choice.clone() }
        };
        Branch { choices: branch.choices.iter().map(&mut choice).collect(), span: branch.span }
    }

    /// Whether a tree gives a label that nothing else gives on the frame.
    fn gives(mut self, scope: TreeScope, mut root: Branch, marked: Label) -> bool {
        let mut primitives = self.rules.primitives.clone();
        let plain = |condition, then| Choice { name: None, condition, then, span: Span::default() };
        let mut frames = 1;
        if let Some(before) = self.frame.before.as_deref().filter(|before| *before != "none") {
            // On the frame before, and only there, the tree gives the leaf before.
            let then = match (before, self.label(before)) {
                ("separate", _) => Consequent::Separate,
                (_, Some(label)) => Consequent::Primitive(label),
                (_, None) => {
                    primitives.push(Primitive {
                        name: before.into(),
                        sided: false,
                        is: None,
                        does: None,
                        other: None,
                        span: Span::default(),
                    });
                    Consequent::Primitive(Label { primitive: PrimitiveId(primitives.len() as u32 - 1), side: None })
                }
            };
            let now = self.channel(Shape::Bool, 1.0);
            root.choices.insert(0, plain(Some(not(now)), then));
            frames = 2;
        }
        let tree = Tree { name: "t".into(), scope, settle: None, root, span: Span::default() };
        let rules = Rules {
            params: self.rules.params.clone(),
            channels: self.channels.clone(),
            primitives,
            trees: vec![tree],
            ..Rules::default()
        };
        let side = |side| HandLayout { side, fingers: Vec::new(), contacts: Vec::new(), knows_distance: false };
        let hands = if scope == TreeScope::BothHands {
            vec![side(Side::Left), side(Side::Right)]
        } else {
            vec![side(Side::Right)]
        };
        let column = |(value, channel): (&f64, u32)| {
            let key = ColumnKey { channel, side: None, slot: 0, component: 0 };
            let mut values = vec![*value; frames];
            if frames == 2 && channel as usize + 1 == self.values.len() {
                values[0] = 0.0;
            }
            (key, values)
        };
        let columns: BTreeMap<ColumnKey, Vec<f64>> = self.values.iter().zip(0..).map(column).collect();
        let log = Frames {
            layout: Layout { rate_hz: 100.0, hands },
            channels: self.channels.clone(),
            columns,
            len: frames,
            time: (0..frames).map(|frame| frame as f64 / 100.0).collect(),
            stretches: std::iter::once(0..frames).collect(),
            ..Frames::default()
        };
        let leaves = reference::evaluate(&rules, &log).unwrap();
        let runs = leaves[0].hands.values().flatten().chain(&leaves[0].both);
        runs.filter(|run| run.end == frames).any(|run| run.label == Some(marked))
    }

    fn label(&self, name: &str) -> Option<Label> {
        let sides = [None, Some(Side::Left), Some(Side::Right)];
        let all = (0..self.rules.primitives.len() as u32).map(PrimitiveId);
        let mut all = all.flat_map(|primitive| sides.map(|side| Label { primitive, side }));
        all.find(|label| self.rules.label_name(*label) == name)
    }
}

const fn this(scope: TreeScope) -> Hand {
    match scope {
        TreeScope::EachHand => Hand::This,
        TreeScope::BothHands => Hand::Shared,
    }
}

/// Whether all of these come out so on a frame.
fn come_out(rules: &Rules, scope: TreeScope, asked: &[(&Expr, bool)], frame: &Frame) -> bool {
    let mut replay = Replay { rules, frame, channels: Vec::new(), values: Vec::new() };
    let all = asked.iter().map(|(expr, wanted)| {
        let condition = replay.condition(expr, this(scope));
        if *wanted { condition } else { not(condition) }
    });
    let all = of(ExprKind::And(all.collect()), Shape::Bool);
    let choice = |condition, then| Choice { name: None, condition, then, span: Span::default() };
    let choices = vec![choice(Some(all), Consequent::Primitive(MARKED)), choice(None, Consequent::Primitive(PLAIN))];
    replay.gives(scope, Branch { choices, span: Span::default() }, MARKED)
}

/// Given by nothing but what is to be seen.
const MARKED: Label = Label { primitive: PrimitiveId(4), side: None };
const PLAIN: Label = Label { primitive: PrimitiveId(0), side: None };

fn case(seed: u64, depth: u32) -> (Rules, Frames) {
    let (mut rules, frames) = random::case_of_few_numbers(seed, depth);
    rules.primitives.push(Primitive {
        name: "Marked".into(),
        sided: false,
        is: None,
        does: None,
        other: None,
        span: Span::default(),
    });
    (rules, frames)
}

/// Takes the `else` from every branch that has two choices more, and gives each branch a place of its own.
fn without_else(branch: &mut Branch, next: &mut u32) {
    *next += 1;
    branch.span = Span { file: 0, start: *next, end: *next };
    if branch.choices.len() > 2 {
        branch.choices.pop();
    }
    for choice in &mut branch.choices {
        if let Consequent::Branch(below) = &mut choice.then {
            without_else(below, next);
        }
    }
}

/// Puts an `else` that gives the marked label where a branch has none and no gap was told.
fn marked_else(branch: &mut Branch, printed: &BTreeSet<Span>, marked: &mut usize) {
    for choice in &mut branch.choices {
        if let Consequent::Branch(below) = &mut choice.then {
            marked_else(below, printed, marked);
        }
    }
    if branch.choices.iter().all(|choice| choice.condition.is_some()) {
        let then = if printed.contains(&branch.span) {
            Consequent::Primitive(PLAIN)
        } else {
            *marked += 1;
            Consequent::Primitive(MARKED)
        };
        branch.choices.push(Choice { name: None, condition: None, then, span: Span::default() });
    }
}

/// Runs the gaps of a rule set: how many were shown, and how many branches were proved to have none.
fn run_gaps(seed: u64, depth: u32) -> (usize, usize) {
    let (mut rules, frames) = case(seed, depth);
    let mut next = 0;
    rules.trees.iter_mut().for_each(|tree| without_else(&mut tree.root, &mut next));
    let (mut printed, mut shown) = (BTreeSet::new(), 0);
    for tree in &rules.trees {
        for gap in gaps(&rules, tree) {
            printed.insert(gap.branch.span);
            if let Some(frame) = &gap.frame {
                shown += 1;
                assert!(come_out(&rules, tree.scope, &gap.asked, frame), "{frame:?}");
            }
        }
    }
    // What is reported to leave nothing out leaves nothing out.
    let mut proved = 0;
    rules.trees.iter_mut().for_each(|tree| marked_else(&mut tree.root, &printed, &mut proved));
    if proved > 0 {
        // The compiled evaluator: a few random conditions nest so deeply that the literal one takes minutes for a log.
        let leaves = evaluate(&lower(&rules), &frames).unwrap();
        let mut runs = leaves.iter().flat_map(|leaves| leaves.hands.values().flatten().chain(&leaves.both));
        assert!(!runs.any(|run| run.label == Some(MARKED)));
    }
    (shown, proved)
}

/// The condition at a place, with its tree.
fn find(rules: &Rules, place: Span) -> Option<(&Tree, &Expr)> {
    fn in_branch(branch: &Branch, place: Span) -> Option<&Expr> {
        branch.choices.iter().find_map(|choice| {
            let own = choice.condition.as_ref().filter(|condition| condition.span == place);
            own.or_else(|| match &choice.then {
                Consequent::Branch(below) => in_branch(below, place),
                _ => None,
            })
        })
    }
    rules.trees.iter().find_map(|tree| Some((tree, in_branch(&tree.root, place)?)))
}

/// Makes the choice whose condition stands at a place give the marked label.
fn mark(branch: &mut Branch, place: Span) {
    for choice in &mut branch.choices {
        if choice.condition.as_ref().is_some_and(|condition| condition.span == place) {
            choice.then = Consequent::Primitive(MARKED);
        }
        if let Consequent::Branch(below) = &mut choice.then {
            mark(below, place);
        }
    }
}

/// Runs the frames of choices that are never taken; how many there were.
fn run_taken(seed: u64, depth: u32) -> usize {
    let (rules, _) = case(seed, depth);
    let rules = super::lints::with_places(rules);
    let mut shown = 0;
    for dead in dead_choices(&rules, &BTreeSet::from([0])) {
        let Some((frame, taker)) = &dead.taken else { continue };
        shown += 1;
        let (tree, _) = find(&rules, *taker).unwrap();
        let mut replay = Replay { rules: &rules, frame, channels: Vec::new(), values: Vec::new() };
        let mut root = tree.root.clone();
        mark(&mut root, *taker);
        let root = replay.branch(&root, this(tree.scope));
        assert!(replay.gives(tree.scope, root, MARKED), "not taken where it is said: {dead:?}");
        if let Some((tree, condition)) = find(&rules, dead.choice) {
            assert!(come_out(&rules, tree.scope, &[(condition, true)], frame), "not meant for it: {dead:?}");
        }
    }
    shown
}

proptest! {
    // PROPTEST_CASES asks for more than the usual 256.
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn frames_without_a_choice_are_as_they_are_shown(seed in any::<u64>(), depth in 1_u32..4) {
        run_gaps(seed, depth);
    }

    #[test]
    fn frames_that_another_choice_takes_are_taken_there(seed in any::<u64>(), depth in 1_u32..4) {
        run_taken(seed, depth);
    }
}

#[test]
fn random_gaps_and_takers_are_worth_running() {
    let runs: Vec<(usize, usize, usize)> = (0..100)
        .map(|seed| {
            let (shown, proved) = run_gaps(seed, 3);
            (shown, proved, run_taken(seed, 3))
        })
        .collect();
    let sum = |of: fn(&(usize, usize, usize)) -> usize| runs.iter().map(of).sum::<usize>();
    let sums = [sum(|run| run.0), sum(|run| run.1), sum(|run| run.2)];
    assert!(sums.iter().zip([100, 10, 10]).all(|(sum, least)| *sum >= least), "{sums:?}");
}
