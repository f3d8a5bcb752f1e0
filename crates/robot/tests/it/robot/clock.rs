//! The clock of all hands.

use proptest::prelude::*;
use teachtree_robot::planning::time_scale::{Part, TimeScale};

fn part(from: f64, to: f64, needs_s: f64) -> Part {
    Part { demonstrated: [from, to], needs_s }
}

#[test]
fn one_hand_takes_what_it_needs() {
    // The second one overlaps the first as it was demonstrated; the third was not demonstrated at all.
    let parts = vec![part(0.0, 1.0, 2.0), part(0.0, 1.5, 0.5), part(1.5, 1.5, 0.9), part(4.0, 5.0, 1.0)];
    let clock = TimeScale::of(&[parts], 0.0);
    assert!((clock.duration() - 4.4).abs() < 1e-9, "{}", clock.duration());
    for at in 0..=44 {
        let time = f64::from(at) / 10.0;
        assert!((clock.at(0, time) - time).abs() < 1e-9 && (clock.when(0, time) - time).abs() < 1e-9, "at {time}");
    }
}

#[test]
fn a_hand_waits_for_what_the_other_one_does() {
    // The right hand takes over at 2 s, for which it first closes; the left one lets go at 3 s and needs twice as long to bring it.
    let left = vec![part(0.0, 2.0, 4.0), part(2.0, 3.0, 1.0), part(3.0, 3.5, 1.0)];
    let right = vec![part(0.0, 2.0, 2.0), part(2.0, 2.0, 0.9), part(2.0, 3.0, 1.0), part(3.0, 5.0, 2.0)];
    let clock = TimeScale::of(&[left, right], 0.0);
    // At 2 s of the recording: 4 s; closing until 4.9 s; both hold until 5.9 s.
    for (time, left, right) in
        [(2.0, 2.0, 1.0), (4.0, 4.0, 2.0), (4.5, 4.0, 2.5), (4.9, 4.0, 2.9), (5.9, 5.0, 3.9), (6.9, 6.0, 4.4)]
    {
        assert!((clock.at(0, time) - left).abs() < 1e-9, "left at {time}: {}", clock.at(0, time));
        assert!((clock.at(1, time) - right).abs() < 1e-9, "right at {time}: {}", clock.at(1, time));
    }
    assert!((clock.duration() - 8.4).abs() < 1e-9, "{}", clock.duration());
}

/// Parts of a hand: lengths as demonstrated, some of them zero, gaps between them, and needs.
fn hand() -> impl Strategy<Value = Vec<Part>> {
    let one = (prop_oneof![Just(0.0), 0.05..2.0], prop_oneof![Just(0.0), 0.05..1.0], 0.05..3.0);
    prop::collection::vec(one, 1..6).prop_map(|parts| {
        let mut end = 0.0;
        let laid = parts.into_iter().map(|(length, gap, needs)| {
            let from = end + gap;
            end = from + length;
            part(from, end, needs)
        });
        laid.collect()
    })
}

proptest! {
    /// No hand goes faster than it can, every hand comes to its end, and what was done at the same time is done at the same time.
    #[test]
    fn hands_keep_together_and_none_is_hurried(left in hand(), right in hand(), eased in prop_oneof![Just(0.0), 0.01..0.3]) {
        let hands = [left, right];
        let clock = TimeScale::of(&hands, eased);
        let step = clock.duration() / 500.0;
        for (which, parts) in hands.iter().enumerate() {
            let whole: f64 = parts.iter().map(|part| part.needs_s).sum();
            prop_assert!((clock.at(which, clock.duration() + 1.0) - whole).abs() < 1e-6);
            prop_assert!(clock.at(which, -1.0).abs() < 1e-6);
            for at in 0..500 {
                let time = f64::from(at) * step;
                let went = clock.at(which, time + step) - clock.at(which, time);
                prop_assert!(went >= -1e-9 && went <= step * (1.0 + 1e-6), "{went} in {step}");
            }
        }
        let sharp = TimeScale::of(&hands, 0.0);
        // Where both begin something at the same time as demonstrated, what was demonstrated to take time before is over in both.
        let mut begun = [0.0, 0.0];
        for (one, other) in hands[0].iter().zip(&hands[1]) {
            if one.demonstrated == other.demonstrated && one.demonstrated[0] < one.demonstrated[1] && one == &hands[0][0] {
                let times = [sharp.when(0, begun[0] + one.needs_s), sharp.when(1, begun[1] + other.needs_s)];
                prop_assert!((times[0] - times[1]).abs() < 1e-6, "{times:?}");
            }
            begun = [begun[0] + one.needs_s, begun[1] + other.needs_s];
        }
    }
}
