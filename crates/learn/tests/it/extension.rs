//! Primitives that were learned from marked intervals, as extensions of a small rule set.

use crate::synthetic::{HandSignals, RATE_HZ, SplitMix64, Synthetic};
use rayon::ThreadPoolBuilder;
use std::collections::BTreeMap;
use teachtree_base::error::InputError;
use teachtree_base::hands::{Side, TrackId};
use teachtree_language::rules::Rules;
use teachtree_language::{Request, load};
use teachtree_learn::{Declaration, Extension, MarkedTrack, ShownRecording, extend};

/// Rules that know two of the three states of [`Synthetic::cycles`].
const BASE: &str = "use \"stream.rules\"
stream { for each hand { gripper.closed : bool } }
for each hand {
  signal closed = gripper.closed
  signal height = mean(fingers.position).z
}
primitive Wait does free, Hold does carry
tree skills for each hand, settle 100 ms {
  not closed => Wait
  else       => Hold
}
task hold = Wait .. Wait with Hold lasting 100 ms
";

fn extended(text: &str) -> Result<Rules, InputError> {
    extended_rules(BASE, text)
}

fn extended_rules(base: &str, text: &str) -> Result<Rules, InputError> {
    let texts = vec![("base.rules".into(), base.into()), ("extension.rules".into(), text.into())];
    let loaded = load(&Request { texts, needs_tree: true, ..Request::default() });
    let message = || loaded.diagnostics.first().map_or_else(String::new, |found| found.message.clone());
    loaded.rules.clone().ok_or_else(|| InputError::new("the test", message()))
}

/// The times of a label, s.
fn times(recording: &Synthetic, label: usize) -> Vec<[f64; 2]> {
    let mut times: Vec<[f64; 2]> = Vec::new();
    for (frame, _) in recording.labels.iter().enumerate().filter(|(_, it)| **it == Some(label)) {
        let (start_s, end_s) = (frame as f64 / RATE_HZ, (frame + 1) as f64 / RATE_HZ);
        match times.last_mut() {
            Some(last) if (last[1] - start_s).abs() < 1e-9 => last[1] = end_s,
            _ => times.push([start_s, end_s]),
        }
    }
    times
}

fn shown(recording: &Synthetic, is_marked: bool) -> ShownRecording<'_> {
    let marked = times(recording, 2);
    let track = MarkedTrack { who: TrackId::Hand(Side::Right), side: None, marked, known: None };
    ShownRecording {
        name: "a recording".into(),
        hands: vec![Side::Right],
        duration_s: recording.labels.len() as f64 / RATE_HZ,
        frames: Box::new(|channels| Ok(recording.frames(channels))),
        tracks: if is_marked { vec![track] } else { Vec::new() },
    }
}

fn lift() -> Declaration {
    Declaration { name: "Lift".into(), sided: false, meaning: None }
}

/// Learns from the first `marked` of some recordings.
fn learned(recordings: &[Synthetic], marked: usize) -> Result<Extension, InputError> {
    let shown: Vec<ShownRecording> =
        recordings.iter().enumerate().map(|(at, recording)| shown(recording, at < marked)).collect();
    extend(&lift(), &shown, &extended, &|_| ())
}

fn cycles(count: u64) -> Vec<Synthetic> {
    (0..count).map(|seed| Synthetic::cycles(seed, seed as usize)).collect()
}

#[test]
fn a_planted_primitive_is_found_and_proved_additive() {
    let extension = learned(&cycles(3), 3).unwrap();
    assert_eq!((extension.learned.marked, extension.learned.matched, extension.learned.found), (18, 18, 18));
    assert_eq!((extension.held_out.marked, extension.held_out.matched, extension.held_out.found), (18, 18, 18));
    assert!(extension.learned.overlap() > 0.99, "{extension:#?}");
    assert!(extension.proof.is_proved(), "{extension:#?}");
    assert_eq!(extension.proof.new, ["Lift"]);
    assert!(extension.text.contains("primitive Lift is Hold"), "{}", extension.text);
    // Heights are up to 10 mm, or from 80 mm on.
    let threshold = extension.text.split_once("height > ").and_then(|(_, rest)| rest.split_once(" mm")).unwrap().0;
    let threshold: f64 = threshold.parse().unwrap();
    assert!((25.0..65.0).contains(&threshold), "{}", extension.text);
    assert!(
        extension.text.contains("// learned: 18 intervals of 3 recordings, held out 18 of 18"),
        "{}",
        extension.text
    );
    assert!(extension.text.contains("task lift = Wait .. Wait with Lift lasting"), "{}", extension.text);
}

/// A hand that closes, goes up, comes down and opens; the primitive lasts from the top until it opens.
fn lifts(seed: u64) -> Synthetic {
    let mut chance = SplitMix64(seed.wrapping_mul(7919) + 5);
    let (mut hand, mut labels) = (HandSignals::default(), Vec::new());
    for _ in 0..6 {
        for (label, height, closed) in [(0, 0.0, false), (1, 0.0, true), (2, 0.08, true), (2, 0.0, true)] {
            let frames = 30 + chance.below(60);
            labels.extend(std::iter::repeat_n(Some(label), frames));
            hand.closed.extend(std::iter::repeat_n(closed, frames));
            hand.height.extend((0..frames).map(|_| height + 0.01 * chance.next()));
        }
    }
    let hands = BTreeMap::from([(Side::Right, hand)]);
    Synthetic { group: 0, who: TrackId::Hand(Side::Right), hands, labels, present: None, gap: None, has_gripper: true }
}

/// No condition of the moment holds as long as the primitive lasts.
#[test]
fn another_condition_sustains_what_one_begins() {
    let recordings: Vec<Synthetic> = (0..3).map(lifts).collect();
    let extension = learned(&recordings, 3).unwrap();
    assert!(extension.text.contains("from(Lift) and "), "{}", extension.text);
    assert_eq!((extension.held_out.marked, extension.held_out.matched, extension.held_out.found), (18, 18, 18));
    assert!(extension.learned.overlap() > 0.98, "{extension:#?}");
    assert!(extension.proof.is_proved(), "{extension:#?}");
}

#[test]
fn it_is_found_in_recordings_without_labels() {
    let recordings = cycles(5);
    let extension = learned(&recordings, 3).unwrap();
    for (at, recording) in recordings.iter().enumerate().skip(3) {
        let found = extension.intervals.iter().filter(|it| it.recording == at && it.is_found);
        let mut found: Vec<[f64; 2]> = found.map(|it| it.time_s).collect();
        found.sort_by(|one, other| one[0].total_cmp(&other[0]));
        let expected = times(recording, 2);
        assert_eq!(found.len(), expected.len(), "{found:?} {expected:?}");
        for (found, expected) in found.iter().zip(&expected) {
            assert!(
                (found[0] - expected[0]).abs() < 0.11 && (found[1] - expected[1]).abs() < 0.11,
                "{found:?} {expected:?}"
            );
        }
    }
    assert!(extension.intervals.iter().all(|it| it.is_marked == (it.recording < 3) || !it.is_found));
    let agreements: Vec<f64> = extension.intervals.iter().map(|it| it.agreement).collect();
    assert!(agreements.is_sorted(), "{agreements:?}");
}

/// In recordings without labels the hand lifts half as high, and most of the time.
#[test]
fn a_threshold_leaves_out_what_other_recordings_have_all_the_time() {
    let halfway = |seed: u64| {
        let mut made = Synthetic::cycles(seed, seed as usize);
        let heights = made.hands.values_mut().flat_map(|hand| &mut hand.height);
        heights.filter(|height| **height > 0.05).for_each(|height| *height -= 0.03);
        made
    };
    let recordings = [cycles(3), (10..14).map(halfway).collect()].concat();
    let extension = learned(&recordings, 3).unwrap();
    let threshold = extension.text.split_once("height > ").and_then(|(_, rest)| rest.split_once(" mm")).unwrap().0;
    let threshold: f64 = threshold.parse().unwrap();
    assert!((60.0..80.0).contains(&threshold), "{}", extension.text);
    assert!(extension.intervals.iter().all(|it| it.recording < 3 || !it.is_found), "{extension:#?}");
    assert_eq!((extension.held_out.marked, extension.held_out.matched, extension.held_out.found), (18, 18, 18));
}

/// Rules of both hands together that know two of the three states of [`Synthetic::of_both`].
const BOTH: &str = "use \"stream.rules\"
stream { for each hand { gripper.closed : bool } }
for each hand {
  signal closed = gripper.closed
  signal height = mean(fingers.position).z
}
primitive Idle does free, Hold does carry
tree skills for left, right, settle 100 ms {
  not either.closed => Idle
  else              => Hold
}
";

#[test]
fn a_primitive_of_both_hands_together_needs_no_side() {
    let recordings: Vec<Synthetic> = (0..3).map(|seed| Synthetic::of_both(seed, seed as usize)).collect();
    let shown: Vec<ShownRecording> = recordings
        .iter()
        .map(|recording| {
            let track = MarkedTrack { who: TrackId::Both, side: None, marked: times(recording, 2), known: None };
            let one = shown(recording, false);
            ShownRecording { hands: Side::BOTH.to_vec(), tracks: vec![track], ..one }
        })
        .collect();
    let load = |text: &str| extended_rules(BOTH, text);
    let extension = extend(&lift(), &shown, &load, &|_| ()).unwrap();
    assert_eq!((extension.held_out.marked, extension.held_out.matched, extension.held_out.found), (18, 18, 18));
    assert!(extension.proof.is_proved(), "{extension:#?}");
    assert!(extension.text.contains("either.lift_1 => Lift"), "{}", extension.text);
    assert!(extension.text.contains("signal lift_1 = height > "), "{}", extension.text);
}

#[test]
fn marks_that_nothing_tells_apart_are_not_found_when_held_out() {
    let recordings: Vec<Synthetic> = (0..3).map(|seed| Synthetic::of_noise_of_one_hand(seed, seed as usize)).collect();
    if let Ok(extension) = learned(&recordings, 3) {
        let it = extension.held_out;
        assert!(2 * it.matched < it.marked, "{extension:#?}");
    }
}

#[test]
fn two_recordings_are_too_few() {
    let error = learned(&cycles(4), 2).unwrap_err().to_string();
    assert!(error.contains("mark `Lift` in 2 recordings, expected 3 or more"), "{error}");
}

#[test]
fn the_number_of_threads_changes_no_extension() {
    let recordings = cycles(4);
    let with = |threads: usize| {
        ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| learned(&recordings, 3).unwrap())
    };
    assert_eq!(with(1), with(3));
}
