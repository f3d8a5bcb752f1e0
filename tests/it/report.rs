//! Tests of `report`: the page, seen as text (the timeline is tested with `analysis`).

use crate::analysis::build::{chapter, leaves};
use std::ops::Range;
use teachtree::analysis::{Analysis, analyse, json::Meta};
use teachtree::base::channels::{Absent, Axis, ChannelSpec, Shape};
use teachtree::base::hands::{Finger, Side};
use teachtree::base::units::Dimension;
use teachtree::language::rules::Rules;
use teachtree::report::{CHANNELS, channels, html};
use teachtree::stream::frames::{ColumnKey, Frames, HandLayout, Issue, Layout};

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

fn touch_channel() -> ChannelSpec {
    ChannelSpec {
        name: "fingers.contact".into(),
        per_hand: true,
        axis: Some(Axis::Fingers),
        shape: Shape::Bool,
        dimension: Dimension::NONE,
        absent: Absent::Refused,
    }
}

/// The signals of a pick-and-follow as they may be measured, for both hands and these stretches.
fn measured(stretches: &[Range<usize>]) -> Frames {
    let len = stretches.last().unwrap().end;
    let hand = |side| HandLayout {
        side,
        fingers: vec![Finger::Thumb, Finger::Index, Finger::Middle],
        contacts: vec!["base".into(), "wall".into()],
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

fn meta() -> Meta {
    Meta {
        log: "demos/<pick> & follow.csv".into(),
        rules: vec!["rules/contact.rules".into()],
        digest: "5a17c0de".into(),
        ..Meta::default()
    }
}

/// A pick-and-follow with a gap before it is placed, both hands alike, and the analysis of it.
fn experiment() -> (Analysis, Frames) {
    let stretches = [0..5000, 5200..8000];
    let rules = chapter();
    let own = "Move 1400 Approach 640 Slide 90 Grasp 570 Translate 1500 Follow 800";
    let rest = "Follow 400 Place 420 Release 900 Move 1080";
    let mut frames = measured(&stretches);
    frames.issues.push(Issue {
        kind: "gap".into(),
        start_s: 5.0,
        end_s: 5.2,
        channel: String::new(),
        message: "no rows for 200 ms; everything starts anew after it".into(),
    });
    let both = [("left", own), ("right", own), ("both", "- 3000 Fit 400 - 1600")];
    let parts =
        [leaves(&rules, 0, &both), leaves(&rules, 5200, &[("left", rest), ("right", rest), ("both", "- 2800")])];
    (analyse(&rules, &frames, &parts), frames)
}

#[test]
fn the_channels_of_the_rules_come_first() {
    let mut rules = chapter();
    rules.channels = vec![touch_channel()];
    let names = |channels: &[ChannelSpec]| channels.iter().map(|channel| channel.name.clone()).collect::<Vec<_>>();
    let judged = names(&teachtree::analysis::channels(&rules));
    assert_eq!(judged, ["fingers.contact", "target", "target.position", "target.spin"]);
    let drawn = names(&channels(&rules));
    assert_eq!(drawn[..4], judged);
    assert!(CHANNELS.iter().all(|name| drawn.iter().filter(|channel| channel == name).count() == 1));
}

#[test]
fn the_page_stands_alone_and_is_small() {
    let (analysis, frames) = experiment();
    let page = html(&analysis, &frames, &meta());
    for outside in ["http:", "https:", "src=", "@import", "url("] {
        assert!(!page.contains(outside), "the page reaches for {outside}");
    }
    assert!(page.contains("demos/&lt;pick&gt; &amp; follow.csv") && !page.contains("<pick>"));
    assert!(page.contains("Grasp\n2.040 – 2.700 s, 660 ms\nwas Slide, Grasp\nby Slide Turn + between"));
    assert!(page.contains("Approach → Slide at 2.040 s"));
    assert!(page.contains("cut off at the end"));
    assert!(page.contains("no rows for 200 ms"));
    assert!(page.len() < 300_000, "{} bytes", page.len());
    assert_eq!(page, html(&analysis, &frames, &meta()), "same input, same bytes");
}

#[test]
fn elements_are_closed_in_order() {
    let (analysis, frames) = experiment();
    let page = html(&analysis, &frames, &meta());
    let mut open: Vec<&str> = Vec::new();
    for tag in page.split('<').skip(1) {
        let (tag, _) = tag.split_once('>').unwrap();
        let name = tag.split([' ', '/']).find(|part| !part.is_empty()).unwrap_or("");
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') && !["!DOCTYPE", "meta"].contains(&name) {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

#[test]
fn a_minute_of_noise_stays_small() {
    let stretch = 0..60_000;
    let mut frames = measured(std::slice::from_ref(&stretch));
    for (key, column) in &mut frames.columns {
        // A jagged value that never repeats.
        let mut state = u64::from(key.channel) * 31 + u64::from(key.slot) * 7 + u64::from(key.component) + 1;
        for value in column {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            *value = (state >> 33) as f64 / f64::from(u32::MAX);
        }
    }
    let rules = chapter();
    let own = "Move 300 Approach 300 Grasp 400 Translate 500 Place 300 Release 200 ".repeat(30);
    let leaves = leaves(&rules, 0, &[("left", &own), ("right", &own)]);
    let analysis = analyse(&rules, &frames, &[leaves]);
    let page = html(&analysis, &frames, &meta());
    assert!(page.len() < 500_000, "{} bytes for two hands", page.len());
}

#[test]
fn what_cannot_be_drawn_is_said() {
    let (analysis, mut frames) = experiment();
    let position = frames.channel("fingers.position").unwrap();
    for (key, column) in &mut frames.columns {
        if key.channel == position {
            column.fill(f64::NAN);
        }
    }
    let normal = frames.channel("contacts.normal").unwrap();
    frames.columns.retain(|key, _| key.channel != normal);
    let page = html(&analysis, &frames, &meta());
    assert!(page.contains("No |P̄| hand to target: the recording has no fingers.position and target.position."));
    assert!(page.contains("No contacts of the target: the recording has no contacts.force and contacts.normal."));
    assert!(!page.contains("NaN") && !page.contains("null"));
}

#[test]
fn a_recording_of_nothing_has_a_page() {
    let empty = Analysis::default();
    let page = html(&empty, &Frames::default(), &Meta::default());
    assert!(page.contains("No task was found."));
}
