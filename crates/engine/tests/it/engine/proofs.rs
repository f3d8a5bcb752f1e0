//! What `prove additive` and `diff` prove, checked by running: the reference evaluator, which shares no code with them, runs both rule sets on random logs.

use super::random;
use crate::numbers::Random;
use rayon::prelude::*;
use teachtree_base::channels::Shape;
use teachtree_base::diagnostic::Span;
use teachtree_base::units::Dimension;
use teachtree_engine::reference;
use teachtree_engine::runs::{Leaves, Run};
use teachtree_language::graph::compare::{declarations, differences, prove_extension};
use teachtree_language::rules::{
    Branch, Choice, Consequent, Expr, ExprKind, Label, Primitive, PrimitiveId, Rules, Type,
};

/// How many cases were proved to only add, proved to be the same, and not proved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct ProofCounts {
    adds: usize,
    same: usize,
    neither: usize,
}

#[test]
fn what_is_proved_holds_on_logs() {
    let ProofCounts { adds, same, neither } = of_seeds(0, 400);
    // Both verdicts are given, so that the test can fail.
    assert!(adds > 40 && same > 20 && neither > 40, "{adds} {same} {neither}");
}

/// Checks `PROGRAMS` random pairs of rule sets, from `SEED` on, on all cores.
#[test]
#[ignore = "minutes: `PROGRAMS=100000 cargo test --release -p teachtree-engine -- --ignored --nocapture many_proofs`"]
fn many_proofs_hold_on_logs() {
    let number = |name: &str, default: u64| std::env::var(name).map_or(default, |text| text.parse().unwrap());
    let (programs, first) = (number("PROGRAMS", 10_000), number("SEED", 0));
    let ProofCounts { adds, same, neither } = of_seeds(first, programs);
    let report = format!(
        "{programs} pairs: {adds} proved to only add, {same} of them to be the same, {neither} not proved; no log says otherwise\n"
    );
    std::io::Write::write_all(&mut std::io::stderr(), report.as_bytes()).unwrap();
}

fn of_seeds(first: u64, programs: u64) -> ProofCounts {
    let sum = |a: ProofCounts, b: ProofCounts| ProofCounts {
        adds: a.adds + b.adds,
        same: a.same + b.same,
        neither: a.neither + b.neither,
    };
    (first..first + programs).into_par_iter().map(checked).reduce(ProofCounts::default, sum)
}

/// Fails where a run contradicts what is proved of a pair of rule sets.
fn checked(seed: u64) -> ProofCounts {
    let (base, frames) = random::case_of_few_numbers(seed, 1 + (seed % 3) as u32);
    let (extended, new) = extended(&base, &mut Random::new(!seed));
    let adds = prove_extension(&base, &extended).is_proved();
    let compared = differences(&base, &extended);
    let same = compared.differences.is_empty()
        && !compared.is_cut
        && declarations(&base, &extended) == ["the primitive `New` is new"];
    let run = |rules: &Rules| reference::evaluate(rules, &frames).unwrap();
    for (one, other) in run(&base).iter().zip(&run(&extended)) {
        if same {
            assert_eq!(one, other, "seed {seed}: proved to be the same");
        }
        if adds {
            // After a new primitive the leaf before is another one, for this hand and for latches.
            let until = first_new(other, new).unwrap_or(one.frames.end);
            for frame in one.frames.start..until {
                assert_eq!(at(one, frame), at(other, frame), "seed {seed}, frame {frame}: proved to only add");
            }
        }
    }
    ProofCounts { adds: usize::from(adds), same: usize::from(same), neither: usize::from(!adds && !same) }
}

/// The rules with one more choice somewhere in the tree of a hand, for a new primitive or for one of the base.
fn extended(base: &Rules, random: &mut Random) -> (Rules, PrimitiveId) {
    let mut rules = base.clone();
    let new = PrimitiveId(rules.primitives.len() as u32);
    let (name, span) = ("New".into(), Span::default());
    rules.primitives.push(Primitive { name, sided: false, is: None, does: None, other: None, span });
    let ways = rules.trees[0].root.paths();
    let conditions: Vec<Expr> =
        ways.iter().flat_map(|way| way.asked.iter().map(|(_, condition, _)| (*condition).clone())).collect();
    let mut any = || conditions[random.below(conditions.len())].clone();
    let (one, other) = (any(), any());
    let of = |kind| Expr { kind, ty: Type { shape: Shape::Bool, dimension: Dimension::NONE, axis: None }, span };
    let condition = match random.below(3) {
        0 => one,
        1 => of(ExprKind::And(vec![one, other])),
        _ => of(ExprKind::And(vec![one, of(ExprKind::Not(Box::new(other)))])),
    };
    let primitive = if random.chance(30) { new } else { PrimitiveId(random.below(3) as u32) };
    let then = Consequent::Primitive(Label { primitive, side: None });
    // At the root the first choice is for `none`, after which nothing can stay.
    let mut branch = &mut rules.trees[0].root;
    let mut least = 1;
    while let Some(inner) = inner(branch).filter(|_| random.chance(50)) {
        let Consequent::Branch(next) = &mut branch.choices[inner].then else { unreachable!() };
        (branch, least) = (next, 0);
    }
    let place = least + random.below(branch.choices.len() - least);
    branch.choices.insert(place, Choice { name: None, condition: Some(condition), then, span });
    (rules, new)
}

/// The first choice of a branch that has choices of its own.
fn inner(branch: &Branch) -> Option<usize> {
    branch.choices.iter().position(|choice| matches!(choice.then, Consequent::Branch(_)))
}

fn tracks(leaves: &Leaves) -> impl Iterator<Item = &Vec<Run>> {
    leaves.hands.values().chain([&leaves.both])
}

/// The leaf of each tree on a frame.
fn at(leaves: &Leaves, frame: usize) -> Vec<Option<Label>> {
    let leaf =
        |runs: &Vec<Run>| runs.iter().find(|run| (run.start..run.end).contains(&frame)).and_then(|run| run.label);
    tracks(leaves).map(leaf).collect()
}

/// The first frame on which some tree gives a new primitive.
fn first_new(leaves: &Leaves, new: PrimitiveId) -> Option<usize> {
    let is_new = |run: &&Run| run.label.is_some_and(|label| label.primitive == new);
    tracks(leaves).flatten().filter(is_new).map(|run| run.start).min()
}
