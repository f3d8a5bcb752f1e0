//! Pages of made-up recordings.

use super::build::{chapter, leaves};
use std::ops::Range;
use teachtree_analysis::json::Meta;
use teachtree_analysis::{Analysis, analyze, explain};
use teachtree_base::channels::{Axis, ChannelSpec, Fallback, Shape};
use teachtree_base::hands::{Finger, Side};
use teachtree_base::recording::Recording;
use teachtree_base::units::Dimension;
use teachtree_engine::runs::Leaves;
use teachtree_frames::frames::{ColumnKey, Frames, HandLayout, Layout};
use teachtree_language::rules::Rules;
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_report::channels;

const RATE_HZ: f64 = 1000.0;

/// A value that goes straight from point to point.
fn along(points: &[(f64, f64)], time: f64) -> f64 {
    let at = points.partition_point(|(at, _)| *at <= time);
    match (at.checked_sub(1).and_then(|at| points.get(at)), points.get(at)) {
        (Some((t0, v0)), Some((t1, v1))) => v0 + (v1 - v0) * (time - t0) / (t1 - t0),
        (Some((_, value)), None) | (None, Some((_, value))) => *value,
        (None, None) => 0.0,
    }
}

pub fn touch_channel() -> ChannelSpec {
    ChannelSpec {
        name: "fingers.contact".into(),
        per_hand: true,
        axis: Some(Axis::Fingers),
        shape: Shape::Bool,
        dimension: Dimension::NONE,
        absent: Fallback::Refused,
    }
}

/// The signals of a pick-and-follow as they may be measured, for both hands and these stretches.
pub fn measured(stretches: &[Range<usize>]) -> Frames {
    let len = stretches.last().unwrap().end;
    let hand = |side| HandLayout {
        side,
        fingers: vec![Finger::Thumb, Finger::Index, Finger::Middle],
        contacts: vec!["base".into(), "wall".into()],
        knows_distance: false,
    };
    let rules = Rules { channels: vec![touch_channel()], ..chapter() };
    let mut frames = Frames {
        layout: Layout { rate_hz: RATE_HZ, hands: Side::BOTH.map(hand).to_vec() },
        channels: channels(&rules),
        len,
        time: (0..len).map(|frame| frame as f64 / RATE_HZ).collect(),
        stretches: stretches.to_vec(),
        ..Frames::default()
    };
    for (channel, spec) in (0..).zip(frames.channels.clone()) {
        let slots = match spec.axis {
            Some(Axis::Fingers) => 3,
            Some(Axis::Contacts) => 2,
            None => 1,
        };
        for side in Side::BOTH {
            for slot in 0..slots {
                for component in 0..u32::try_from(spec.shape.components().len()).unwrap() {
                    let value = |time: &f64| signal(&spec.name, slot, component, *time);
                    let key = ColumnKey { channel, side: Some(side), slot, component };
                    frames.columns.insert(key, frames.time.iter().map(value).collect());
                }
            }
        }
    }
    frames
}

fn signal(channel: &str, slot: u32, component: u32, time: f64) -> f64 {
    let tremor = 0.02 * (time * 57.0 + f64::from(slot)).sin() * (time * 13.0).cos();
    let held = along(&[(2.0, 0.0), (2.2, 1.0), (6.0, 1.0), (6.2, 0.0)], time);
    let lifted = along(&[(2.7, 0.0), (2.9, 1.0), (5.6, 1.0), (5.8, 0.0)], time);
    match (channel, slot, component) {
        ("fingers.contact", _, _) => f64::from(u8::from(held > 0.2 + 0.1 * f64::from(slot))),
        ("fingers.position", _, 0) => {
            along(&[(0.0, 0.4), (1.4, 0.06), (2.0, 0.01), (6.2, 0.01), (7.5, 0.35)], time) + 0.001 * tremor
        }
        ("fingers.force", 0, 1) => 1.2 * held * (1.0 + tremor),
        ("fingers.force", 1 | 2, 1) => -0.6 * held * (1.0 + tremor),
        ("fingers.force", _, 2) => held * (lifted * 0.49 / 3.0 + tremor * 0.2),
        ("fingers.force", 1, 0) if (4.2..5.6).contains(&time) => 0.8 + 10.0 * tremor,
        ("target.velocity", _, 0) => along(&[(2.7, 0.0), (3.4, 0.18), (4.2, 0.0)], time) + 0.02 * tremor * held,
        ("target.velocity", _, 2) => along(&[(4.2, 0.0), (4.9, -0.09), (5.6, 0.0)], time),
        ("contacts.force", 0, 2) => 0.49 * (1.0 - lifted),
        ("contacts.force", 1, 0) if (4.2..5.6).contains(&time) => 0.8 + 10.0 * tremor,
        ("contacts.normal", 0, 2) | ("contacts.normal", 1, 0) => 1.0,
        _ => 0.0,
    }
}

pub fn meta() -> Meta {
    Meta {
        log: "demos/<pick> & follow.csv".into(),
        rules: vec!["rules/contact.rules".into()],
        digest: "5a17c0de".into(),
        ..Meta::default()
    }
}

/// The page of a recording that has only frames.
pub fn html(analysis: &Analysis, frames: &Frames, leaves: &[Leaves], meta: &Meta) -> String {
    let rules = Rules { channels: frames.channels.clone(), ..chapter() };
    let analyzed = explain::AnalyzedRecording { rules: &rules, frames, leaves, analysis };
    teachtree_report::html(&analyzed, &Recording::default(), meta).unwrap()
}

/// A pick-and-follow with a gap before it is placed, both hands alike, and the analysis of it.
pub fn experiment() -> (Analysis, Frames, [Leaves; 2]) {
    let stretches = [0..5000, 5200..8000];
    let rules = chapter();
    let own = "Move 1400 Approach 640 Slide 90 Grasp 570 Translate 1500 Follow 800";
    let rest = "Follow 400 Place 420 Release 900 Move 1080";
    let mut frames = measured(&stretches);
    frames.issues.push(Issue {
        kind: IssueKind::from_name("gap").unwrap(),
        start_s: 5.0,
        end_s: 5.2,
        channel: String::new(),
        message: "no rows for 200 ms; everything starts anew after it".into(),
    });
    let both = [("left", own), ("right", own), ("both", "- 3000 Fit 400 - 1600")];
    let parts =
        [leaves(&rules, 0, &both), leaves(&rules, 5200, &[("left", rest), ("right", rest), ("both", "- 2800")])];
    (analyze(&rules, &frames, &parts), frames, parts)
}

/// A jagged value that never repeats, in every column.
pub fn noise(frames: &mut Frames) {
    for (key, column) in &mut frames.columns {
        let mut state = u64::from(key.channel) * 31 + u64::from(key.slot) * 7 + u64::from(key.component) + 1;
        for value in column {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            *value = (state >> 33) as f64 / f64::from(u32::MAX);
        }
    }
}

/// A page of the experiment: what carries the target of the right hand pushes this hard in these frames, N.
pub fn knocked_page(knocks: &[(Range<usize>, f64)]) -> String {
    let (analysis, mut frames, leaves) = experiment();
    let force = frames.channel("contacts.force").unwrap();
    let key = ColumnKey { channel: force, side: Some(Side::Right), slot: 0, component: 2 };
    let Some(values) = frames.columns.get_mut(&key) else { unreachable!("made above") };
    for (at, newtons) in knocks {
        values[at.clone()].fill(*newtons);
    }
    html(&analysis, &frames, &leaves, &meta())
}

/// The page of a recording that has no positions at all.
pub fn without_poses() -> String {
    let (analysis, mut frames, leaves) = experiment();
    let position = frames.channel("fingers.position").unwrap();
    for (key, column) in &mut frames.columns {
        if key.channel == position {
            *column = vec![f64::NAN; frames.len];
        }
    }
    let normal = frames.channel("contacts.normal").unwrap();
    frames.columns.retain(|key, _| key.channel != normal);
    html(&analysis, &frames, &leaves, &meta())
}
