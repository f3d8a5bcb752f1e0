//! Any leaves and any relabeling rules: it ends, tracks stay whole, trails say what was there.

use super::build::*;
use proptest::prelude::*;
use std::ops::Range;
use teachtree_analysis::{Analysis, Segment, TrackId, analyze};
use teachtree_base::diagnostic::Span;
use teachtree_base::hands::Side;
use teachtree_engine::runs::{Leaves, Run, append};
use teachtree_language::rules::*;

/// Few labels, so that patterns meet: the first ones of the chapter, and MainGrasp with its sides.
pub fn any_label() -> impl Strategy<Value = Label> {
    let plain = (0..5_u32).prop_map(|at| Label { primitive: PrimitiveId(at), side: None });
    let sided = any::<bool>().prop_map(|left| {
        let side = if left { Side::Left } else { Side::Right };
        Label { primitive: PrimitiveId(15), side: Some(side) }
    });
    prop_oneof![4 => plain, 1 => Just(Label { primitive: PrimitiveId(7), side: None }), 1 => sided]
}

pub fn any_labels() -> impl Strategy<Value = Vec<Label>> {
    prop::collection::vec(any_label(), 1..4)
}

fn any_pair() -> impl Strategy<Value = (Vec<Label>, Vec<Label>)> {
    (any_labels(), any_labels())
}

fn any_limit() -> impl Strategy<Value = Option<Constant>> {
    prop::option::of((1..20_u32).prop_map(|frames| seconds(f64::from(frames) / RATE_HZ)))
}

fn any_kind() -> impl Strategy<Value = RelabelKind> {
    let repeat = prop_oneof![Just(Repetition::Once), Just(Repetition::ZeroOrMore), Just(Repetition::OneOrMore)];
    prop_oneof![
        (any_labels(), any::<bool>(), any_limit(), any_pair(), any_label()).prop_map(
            |(what, run, shorter, between, becomes)| RelabelKind::Between { what, run, shorter, between, becomes }
        ),
        (any_labels(), any::<bool>(), any_limit(), any_pair(), any_pair(), prop::option::of(any_label())).prop_map(
            |(what, run, shorter, one, other, becomes)| RelabelKind::BetweenInHands {
                what,
                run,
                shorter,
                one,
                other,
                becomes
            }
        ),
        (any_labels(), any_label()).prop_map(|(what, becomes)| RelabelKind::Become { what, becomes }),
        (prop::collection::vec((any_labels(), repeat), 1..5), any_label())
            .prop_map(|(elements, becomes)| RelabelKind::Sequence { elements, becomes }),
        (any_label(), any_labels()).prop_map(|(what, without)| RelabelKind::Separate { what: vec![what], without }),
    ]
}

pub fn any_rules() -> impl Strategy<Value = Rules> {
    let relabel = (any_kind(), prop::option::of(0..3_u32));
    (0..8_u32, prop::collection::vec(relabel, 0..6), any::<bool>()).prop_map(|(settle, relabels, joined)| {
        let mut rules = bare(f64::from(settle) / RATE_HZ);
        task(&mut rules, "translate", "Translate", "Slide").joined = joined;
        task(&mut rules, "slide", "Slide travelling 0.003", "");
        task(&mut rules, "grasp", "Grasp", "").last = Pattern::of(label(&rules, "Approach"));
        for (at, (kind, of)) in relabels.into_iter().enumerate() {
            rules.relabels.push(RelabelRule {
                task: of.map(TaskId),
                kind,
                text: format!("rule {at}"),
                span: Span::default(),
            });
        }
        rules
    })
}

fn any_runs(len: usize) -> impl Strategy<Value = Vec<(Label, usize)>> {
    prop::collection::vec((any_label(), 1..12_usize), len..len + 1)
}

/// Runs over exactly these frames.
fn over(frames: Range<usize>, parts: impl Iterator<Item = (Option<Label>, usize)>) -> Vec<Run> {
    let mut runs = Vec::new();
    let mut start = frames.start;
    for (label, length) in parts {
        let end = (start + length).min(frames.end);
        append(&mut runs, Run { start, end, label });
        start = end;
    }
    match runs.last_mut() {
        Some(last) => last.end = frames.end,
        None => runs.push(Run { start: frames.start, end: frames.end, label: None }),
    }
    runs
}

prop_compose! {
    pub fn any_leaves(from: usize)(
        length in 1..120_usize,
        left in any_runs(30),
        right in any_runs(30),
        both in prop::collection::vec((prop::option::of(any_label()), 1..25_usize), 1..12),
    ) -> Leaves {
        let frames = from..from + length;
        let own = |parts: Vec<(Label, usize)>| over(frames.clone(), parts.into_iter().map(|(label, length)| (Some(label), length)));
        Leaves {
            hands: [(Side::Left, own(left)), (Side::Right, own(right))].into_iter().collect(),
            both: over(frames.clone(), both.into_iter()),
            frames,
        }
    }
}

fn is_whole(segments: &[Segment], frames: &Range<usize>) -> bool {
    segments.first().is_some_and(|first| first.frames.start == frames.start)
        && segments.last().is_some_and(|last| last.frames.end == frames.end)
        && segments
            .windows(2)
            .all(|pair| pair[0].frames.end == pair[1].frames.start && pair[0].primitive != pair[1].primitive)
        && segments.iter().all(|segment| !segment.frames.is_empty() && segment.start_s < segment.end_s)
}

fn is_ordered(segments: &[Segment]) -> bool {
    segments.windows(2).all(|pair| pair[0].frames.end <= pair[1].frames.start)
}

fn check(rules: &Rules, analysis: &Analysis, frames: &Range<usize>) {
    let separates = rules.relabels.iter().any(|rule| rule.kind.becomes().is_none());
    for track in &analysis.tracks {
        let hand = track.who != TrackId::Both;
        for segments in [&track.segments, &track.relabeled] {
            assert!(if hand { is_whole(segments, frames) } else { is_ordered(segments) }, "{segments:?}");
        }
        for segment in &track.relabeled {
            let there = track
                .segments
                .iter()
                .filter(|raw| raw.frames.start < segment.frames.end && segment.frames.start < raw.frames.end);
            let there: Vec<&str> = there.map(|raw| raw.primitive.as_str()).collect();
            if segment.by.is_empty() {
                assert!(segment.was.is_empty());
                assert_eq!(there, [segment.primitive.as_str()], "what no rule changed is as it was: {segment:?}");
            } else {
                // Where coordination is given back to the hands, what is left of it may settle where there was none.
                assert!(!there.is_empty() || separates && !hand);
                assert_eq!(segment.was, there, "{segment:?}");
            }
        }
        assert!(track.tasks.windows(2).all(|pair| pair[0].frames.end <= pair[1].frames.start));
        for task in &track.tasks {
            assert!(is_whole(&task.segments, &task.frames), "{task:?}");
            assert!(!task.open_start || task.frames.start == frames.start);
            assert!(!task.open_end || task.frames.end == frames.end);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn tracks_stay_whole_and_trails_are_true(rules in any_rules(), leaves in any_leaves(0)) {
        let whole = leaves.frames.clone();
        let analysis = analyze(&rules, &moving(std::slice::from_ref(&whole)), std::slice::from_ref(&leaves));
        check(&rules, &analysis, &whole);
        let without = Rules { relabels: Vec::new(), ..rules };
        let untouched = analyze(&without, &moving(std::slice::from_ref(&whole)), std::slice::from_ref(&leaves));
        for (one, other) in analysis.tracks.iter().zip(&untouched.tracks) {
            prop_assert_eq!(&one.segments, &other.segments);
            prop_assert_eq!(&other.segments, &other.relabeled);
        }
    }

    #[test]
    fn stretches_know_nothing_of_each_other(rules in any_rules(), first in any_leaves(0), second in any_leaves(150)) {
        let stretches = [first.frames.clone(), second.frames.clone()];
        let frames = moving(&stretches);
        let together = analyze(&rules, &frames, &[first.clone(), second.clone()]);
        let (one, two) = (analyze(&rules, &frames, &[first]), analyze(&rules, &frames, &[second]));
        for ((together, one), two) in together.tracks.iter().zip(&one.tracks).zip(&two.tracks) {
            prop_assert_eq!(&together.segments, &[one.segments.clone(), two.segments.clone()].concat());
            prop_assert_eq!(&together.relabeled, &[one.relabeled.clone(), two.relabeled.clone()].concat());
            prop_assert_eq!(&together.tasks, &[one.tasks.clone(), two.tasks.clone()].concat());
        }
    }
}
