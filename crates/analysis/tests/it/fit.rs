//! Cross-validation of fits: groups are held out together, and the test compares groups.

use std::rc::Rc;
use teachtree_analysis::fit::{CrossValidation, FitParam, HeldGroups, Objective, ParamVector, Space, cross_validation};
use teachtree_analysis::score::{Span, TrackTruth, Truth};
use teachtree_analysis::{TrackId, fit};
use teachtree_base::hands::Side;

/// The cross-validation of one param whose greater values add `gains` to the objectives of the recordings.
fn validated(gains: &[f64], groups: &HeldGroups) -> CrossValidation {
    let param = FitParam { name: "x".into(), unit: String::new(), value: 0.0, range: (0.0, 1.0) };
    let space = Space { params: vec![param], pairs: Vec::new() };
    let of_point = |point: &ParamVector| -> Option<Rc<[Objective]>> {
        let objective =
            |gain: &f64| Objective { objective: if point[0] > 0.5 { *gain } else { 0.0 }, ..Objective::default() };
        Some(gains.iter().map(objective).collect())
    };
    let mut objectives = |points: &[ParamVector]| points.iter().map(of_point).collect::<Vec<_>>();
    cross_validation(&space, groups, &[], &mut objectives, &mut |_| ())
}

#[test]
fn recordings_of_a_group_are_held_out_together_and_count_once() {
    let groups = HeldGroups { of_logs: vec![0, 0, 0, 1, 2], folds: 3 };
    let found = validated(&[0.0, 0.1, 0.2, 0.2, 0.3], &groups);
    let held: Vec<&[usize]> = found.folds.iter().map(|fold| fold.logs.as_slice()).collect();
    assert_eq!(held, [&[0, 1, 2][..], &[3], &[4]]);
    assert_eq!(found.groups, 3);
    // The groups gain 0.1, 0.2 and 0.3: a standard deviation of 0.1, and t = √12 with two degrees of freedom.
    assert!((found.gain - 0.2).abs() < 1e-9, "{found:?}");
    assert!((found.at_least - (0.2 - 2.920 * 0.1 / 3.0_f64.sqrt())).abs() < 1e-4, "{found:?}");
    assert!((found.p_value - 0.037_09).abs() < 1e-4, "{found:?}");
    // More groups than folds: group 2 shares the fold of group 0.
    let found = validated(&[0.0, 0.1, 0.2, 0.2, 0.3], &HeldGroups { folds: 2, ..groups });
    let held: Vec<&[usize]> = found.folds.iter().map(|fold| fold.logs.as_slice()).collect();
    assert_eq!(held, [&[0, 1, 2, 4][..], &[3]]);
    assert_eq!(found.groups, 3);
}

/// The quantiles are those of tables of Student's t. Gains whose lower bound at 95 % is zero are as large by chance in 5 % of all cases.
#[test]
fn the_bound_and_the_p_value_are_those_of_students_t() {
    for (logs, quantile) in [(2, 6.314), (3, 2.920), (6, 2.015), (11, 1.812), (12, 1.796), (31, 1.697)] {
        let gains = |mean: f64| -> Vec<f64> {
            (0..logs).map(|log| mean + if log == 0 { 0.1 } else { -0.1 / (logs - 1) as f64 }).collect()
        };
        let deviations: Vec<f64> = gains(0.0).iter().map(|gain| gain * gain).collect();
        let error = (deviations.iter().sum::<f64>() / (logs - 1) as f64 / logs as f64).sqrt();
        let groups = HeldGroups::of_recordings(logs, logs);
        let far = validated(&gains(2.0), &groups);
        assert!((2.0 - far.at_least - quantile * error).abs() < 6e-4 * error, "{logs}: {}", far.at_least);
        let near = validated(&gains(2.0 - far.at_least), &groups);
        assert!(near.at_least.abs() < 1e-9, "{logs}: {}", near.at_least);
        assert!((near.p_value - 0.05).abs() < 1e-9, "{logs}: {}", near.p_value);
    }
    // Groups without a gain are not evidence for one.
    let none = validated(&[0.0; 4], &HeldGroups::of_recordings(4, 4));
    assert!((none.p_value - 1.0).abs() < 1e-9, "{none:?}");
}

#[test]
fn the_tolerance_of_boundaries_follows_the_labels() {
    let truth = |durations_s: &[f64]| {
        let mut start_s = 0.0;
        let mut span = |name: &str, duration_s: f64| {
            start_s += duration_s;
            Span { names: vec![name.into()], start_s: start_s - duration_s, end_s: start_s }
        };
        let mut primitives: Vec<Span> = durations_s.iter().map(|duration_s| span("Move", *duration_s)).collect();
        primitives.push(span("separate", 1000.0));
        Truth { tracks: vec![TrackTruth { who: TrackId::Hand(Side::Left), primitives, tasks: None }] }
    };
    let tolerance_s = |truths: &[Truth]| fit::tolerance_s(truths.iter());
    assert!((tolerance_s(&[truth(&[1.0, 4.0]), truth(&[9.0])]) - 1.0).abs() < 1e-9);
    assert!((tolerance_s(&[truth(&[0.1, 0.2, 0.3])]) - 0.2).abs() < 1e-9);
    assert!((tolerance_s(&[truth(&[60.0])]) - 2.0).abs() < 1e-9);
    assert!((tolerance_s(&[]) - 0.2).abs() < 1e-9);
}
