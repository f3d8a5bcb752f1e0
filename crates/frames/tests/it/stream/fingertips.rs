//! Fingertip sensors that do not rest at zero, where no distance shows when they touch.

use super::{ask_contact, column};
use crate::shared::recordings::recording;
use teachtree_base::recording::Recording;
use teachtree_frames::frames;
use teachtree_frames::frames::Frames;

/// A thing that no fingertip leaves as far as the log shows.
const SCENE: &str = "
bodies:
  thing: {role: object, radius: 50 mm}
hands:
  right: {fingers: [thumb, index]}
";
const RATE_HZ: f64 = 100.0;
/// When the hand holds something, s.
const HOLDS: [(f64, f64); 5] = [(3.0, 5.0), (8.0, 9.0), (14.0, 18.0), (21.0, 21.8), (25.0, 28.5)];

fn holds(time: f64) -> bool {
    HOLDS.iter().any(|(from, to)| (*from..*to).contains(&time))
}

/// Noise of about this standard deviation, N, the same in each run.
fn noise(time: f64, channel: u64, deviation: f64) -> f64 {
    let mut bits =
        ((time * RATE_HZ).round() as u64).wrapping_mul(6).wrapping_add(channel).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let uniform = (0..3).map(|_| {
        bits ^= bits >> 29;
        bits = bits.wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits ^= bits >> 32;
        (bits >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    });
    // The sum of three has a variance of a quarter.
    2.0 * deviation * uniform.sum::<f64>()
}

/// 30 s of a hand whose fingertips rest at `rests`, N, while they hold something with a force that varies from 0.5 to 6 N.
fn log(rests: [&dyn Fn(f64) -> f64; 2], deviation: f64, force: &dyn Fn(f64) -> f64) -> Recording {
    let [thumb, index] = rests;
    let zero = |_: f64| 0.0;
    let thumb_force = |t: f64| -thumb(t) - force(t) + noise(t, 0, deviation);
    let index_force = |t: f64| index(t) + 0.5 * force(t) + noise(t, 3, deviation);
    let mut columns: Vec<(&str, &dyn Fn(f64) -> f64)> =
        vec![("right.thumb.force.x", &thumb_force), ("right.index.force.x", &index_force)];
    let others: [(&str, &dyn Fn(f64) -> f64); 4] = [
        ("right.thumb.force.y", &|t| noise(t, 1, deviation)),
        ("right.thumb.force.z", &|t| noise(t, 2, deviation)),
        ("right.index.force.y", &|t| noise(t, 4, deviation)),
        ("right.index.force.z", &|t| noise(t, 5, deviation)),
    ];
    columns.extend(others);
    for name in [
        "right.thumb.position.x",
        "right.thumb.position.y",
        "right.thumb.position.z",
        "right.index.position.x",
        "right.index.position.y",
        "right.index.position.z",
    ] {
        columns.push((name, &zero));
    }
    recording(SCENE, RATE_HZ, 3000, &columns)
}

/// Holds with forces that differ, and vary.
fn grip(t: f64) -> f64 {
    if holds(t) { 1.0 + 2.5 * (t * 0.7).sin().abs() * (1.0 + (3.0 * t).sin()) } else { 0.0 }
}

/// The share of the frames in which a finger touches if and only if the hand holds something; frames near a change are left out.
fn agreement(frames: &Frames, slot: u32) -> f64 {
    let flags = column(frames, "fingers.contact", slot, 0);
    let is_clear = |time: f64| holds(time - 0.1) == holds(time + 0.1);
    let judged: Vec<bool> = (frames.time.iter().zip(flags))
        .filter(|(time, _)| is_clear(**time))
        .map(|(time, flag)| (*flag > 0.5) == holds(*time))
        .collect();
    judged.iter().filter(|right| **right).count() as f64 / judged.len() as f64
}

fn kinds(frames: &Frames) -> Vec<(String, String)> {
    frames.issues.iter().map(|issue| (issue.kind.to_string(), issue.channel.clone())).collect()
}

#[test]
fn sensors_that_rest_at_an_offset_touch_while_the_hand_holds() {
    for (thumb, index, deviation) in [(0.08, 0.3, 0.02), (0.02, 0.15, 0.01), (0.3, 0.1, 0.04)] {
        let frames = frames(&log([&|_| thumb, &|_| index], deviation, &grip), &[ask_contact()]).unwrap();
        for slot in [0, 1] {
            let found = agreement(&frames, slot);
            assert!(found > 0.99, "rest at {thumb} and {index} N: finger {slot} is right on {found} of the frames");
        }
        let biased = ("biased".to_string(), "right.index.force".to_string());
        assert!(kinds(&frames).contains(&biased), "{:?}", kinds(&frames));
    }
}

#[test]
fn sensors_that_drift_touch_while_the_hand_holds() {
    let (thumb, index) = (|t: f64| 0.05 + 0.012 * t, |t: f64| 0.15 + 0.12 * (0.15 * t).sin());
    let frames = frames(&log([&thumb, &index], 0.01, &grip), &[ask_contact()]).unwrap();
    for slot in [0, 1] {
        let found = agreement(&frames, slot);
        assert!(found > 0.99, "finger {slot} is right on {found} of the frames");
    }
    assert!(frames.issues.iter().any(|issue| issue.message.contains("drifts by")), "{:?}", frames.issues);
}

#[test]
fn a_drift_is_learned_although_the_distance_is_known() {
    let mut log = log([&|t| 0.05 + 0.004 * t, &|t| 0.2 - 0.004 * t], 0.01, &grip);
    // The fingertips are 200 mm away from the thing while they do not hold it.
    for finger in ["thumb", "index"] {
        let away = log.time.iter().map(|time| if holds(*time) { 0.0 } else { 0.2 }).collect();
        log.columns[&format!("right.{finger}.position.z")].values = away;
    }
    let frames = frames(&log, &[ask_contact()]).unwrap();
    for slot in [0, 1] {
        let found = agreement(&frames, slot);
        assert!(found > 0.99, "finger {slot} is right on {found} of the frames");
    }
}

#[test]
fn a_finger_that_is_not_used_never_touches() {
    let frames = frames(&log([&|_| 0.1, &|_| 0.2], 0.02, &|_| 0.0), &[ask_contact()]).unwrap();
    for slot in [0, 1] {
        assert!(column(&frames, "fingers.contact", slot, 0).iter().all(|flag| *flag == 0.0));
    }
}

#[test]
fn sensors_without_a_level_are_reported() {
    // Forces of all sizes: nothing is without contact.
    let spread = |t: f64| 0.2 + 2.0 * (0.37 * t).sin().abs();
    let frames = frames(&log([&|_| 0.0, &|_| 0.0], 0.01, &spread), &[ask_contact()]).unwrap();
    let unclear = ("no_contact_level".to_string(), "right.thumb.force".to_string());
    assert!(kinds(&frames).contains(&unclear), "{:?}", kinds(&frames));
}

#[test]
fn sensors_at_zero_keep_the_thresholds_of_the_rules() {
    // 0.06 N begins a contact, 0.03 N does not end it.
    let light = |t: f64| {
        if !holds(t) {
            0.0
        } else if holds(t - 0.2) {
            0.03
        } else {
            0.06
        }
    };
    let frames = frames(&log([&|_| 0.0, &|_| 0.0], 0.0, &light), &[ask_contact()]).unwrap();
    let found = agreement(&frames, 0);
    assert!(found > 0.999, "{found}");
}

#[test]
fn a_level_that_the_log_has_counts() {
    let mut log = log([&|_| 0.1, &|_| 0.1], 0.01, &grip);
    let level = teachtree_base::recording::Column {
        dimension: teachtree_base::units::Dimension::FORCE,
        values: vec![50.0; log.time.len()],
    };
    log.columns.insert("right.thumb.level".into(), level);
    let frames = frames(&log, &[ask_contact()]).unwrap();
    assert!(column(&frames, "fingers.contact", 0, 0).iter().all(|flag| *flag == 0.0));
    assert!(agreement(&frames, 1) > 0.99);
}
