//! What holds for every truth and every result.

use super::build::*;
use proptest::prelude::*;
use teachtree_analysis::score::{Row, Score, Share, Stage, Tally, TrackTruth, Truth};

const NAMES: [&str; 5] = ["Move", "Approach", "Grasp", "Translate", "Release"];

/// Segments with lengths in tenths of a second; neighbors may have one name.
fn texts() -> impl Strategy<Value = Vec<(usize, u32)>> {
    prop::collection::vec((0..NAMES.len(), 1_u32..40), 1..25)
}

fn text(parts: &[(usize, u32)]) -> String {
    parts.iter().map(|(name, tenths)| format!("{} {} ", NAMES[*name], f64::from(*tenths) / 10.0)).collect()
}

fn rates(tally: &Tally) -> Vec<f64> {
    let primitives = tally.primitives();
    let each = primitives.iter().flat_map(|name| [tally.precision(name), tally.recall(name)]);
    let f1 = tally.segments.values().flat_map(|matches| matches.f1());
    let all = [tally.accuracy(), tally.edit()].into_iter().chain(tally.f1()).chain(each).chain(f1);
    let share = |share: Share| share.bounds().map(|(low, high)| [low, share.rate().unwrap(), high]);
    all.flatten().chain(share(tally.sequences).into_iter().flatten()).collect()
}

proptest! {
    #[test]
    fn the_truth_itself_is_perfect(parts in texts()) {
        let text = text(&parts);
        let tally = tally(&text, &text);
        prop_assert!(rates(&tally).iter().take(5).all(|rate| (rate - 1.0).abs() < 1e-12));
        prop_assert_eq!(tally.sequences, Share { right: 1, of: 1 });
        let errors = tally.boundary_errors();
        prop_assert_eq!(errors.found.right, errors.found.of);
        prop_assert!(errors.off_s.iter().all(|off| *off == 0.0));
    }

    #[test]
    fn rates_lie_between_0_and_1(truth in texts(), result in texts()) {
        let tally = tally(&text(&truth), &text(&result));
        for rate in rates(&tally) {
            prop_assert!((-1e-12..=1.0 + 1e-12).contains(&rate), "{}", rate);
        }
        let [ten, quarter, half] = tally.f1();
        prop_assert!(ten >= quarter && quarter >= half);
        let longest = truth.iter().map(|(_, tenths)| tenths).sum::<u32>().min(result.iter().map(|(_, tenths)| tenths).sum());
        prop_assert!((tally.scored_s() - f64::from(longest) / 10.0).abs() < 1e-6);
    }

    #[test]
    fn truth_and_result_can_be_exchanged(truth in texts(), result in texts()) {
        let (there, back) = (tally(&text(&truth), &text(&result)), tally(&text(&result), &text(&truth)));
        prop_assert!((there.accuracy().unwrap() - back.accuracy().unwrap()).abs() < 1e-9);
        prop_assert_eq!(&there.edits, &back.edits);
        for name in NAMES {
            let (one, other) = (there.precision(name), back.recall(name));
            prop_assert_eq!(one.is_some(), other.is_some());
            prop_assert!((one.unwrap_or(0.0) - other.unwrap_or(0.0)).abs() < 1e-9);
        }
    }

    #[test]
    fn a_result_that_is_late_is_late_at_every_boundary(parts in prop::collection::vec((0..NAMES.len(), 2_u32..40), 2..20)) {
        // Every start but the first one is 0.1 s late, which leaves every segment in its place.
        let mut late = parts.clone();
        late[0].1 += 1;
        late.last_mut().unwrap().1 -= 1;
        let different = parts.windows(2).all(|pair| pair[0].0 != pair[1].0);
        let tally = tally(&text(&parts), &text(&late));
        prop_assert_eq!(tally.edits[0], 1.0);
        let errors = tally.boundary_errors();
        prop_assert_eq!(errors.found.right, errors.found.of);
        prop_assert!(errors.late_s.iter().all(|late| (late - 0.1).abs() < 1e-9));
        prop_assert!(!different || errors.found.of == parts.len() - 1);
    }

    #[test]
    fn shifting_both_changes_nothing(truth in texts(), result in texts(), shift in 1_u32..100) {
        let shift = f64::from(shift) / 4.0;
        let shifted = |parts: &[(usize, u32)]| format!("- {shift} {}", text(parts));
        let (here, there) = (tally(&text(&truth), &text(&result)), tally(&shifted(&truth), &shifted(&result)));
        prop_assert!((here.accuracy().unwrap() - there.accuracy().unwrap()).abs() < 1e-9);
        prop_assert_eq!(here.segments, there.segments);
        prop_assert_eq!(here.edits, there.edits);
        prop_assert_eq!(here.boundaries.len(), there.boundaries.len());
    }

    #[test]
    fn counts_add_up_in_any_grouping(cases in prop::collection::vec((texts(), texts()), 1..5), cut in 0_usize..5) {
        let rows: Vec<Row> = cases
            .iter()
            .map(|(truth, result)| Row { log: "log.csv".into(), who: RIGHT, tally: tally(&text(truth), &text(result)) })
            .collect();
        let all = Score::new(Stage::Raw, rows.clone()).all;
        let (one, other) = rows.split_at(cut.min(rows.len()));
        let mut sum = Score::new(Stage::Raw, one.to_vec()).all;
        sum.add(&Score::new(Stage::Raw, other.to_vec()).all);
        prop_assert_eq!(&all.segments, &sum.segments);
        prop_assert_eq!(all.boundary_errors(), sum.boundary_errors());
        prop_assert!((all.accuracy().unwrap() - sum.accuracy().unwrap()).abs() < 1e-9);
    }

    #[test]
    fn every_task_is_counted_once(truth in texts(), result in texts()) {
        let spans = spans(&text(&truth));
        let track = TrackTruth { who: RIGHT, primitives: Vec::new(), tasks: Some(spans.clone()) };
        let analysis = with_tasks("Move 1", &text(&result));
        let tally = rows(&Truth { tracks: vec![track] }, &analysis).remove(0).tally;
        let of_side = |none: fn(&teachtree_analysis::score::TaskPair) -> bool| tally.task_pairs().iter().filter(|pair| !none(pair)).count();
        prop_assert_eq!(of_side(|pair| pair.truth == "none"), spans.len());
        prop_assert_eq!(of_side(|pair| pair.result == "none"), result.len());
    }
}
