//! How far two people label alike, against examples that are computed by hand.

use teachtree_analysis::agreement::{Agreement, Span};

fn spans(rows: &[(&str, f64, f64)]) -> Vec<Span> {
    rows.iter()
        .map(|(label, start_s, end_s)| Span { label: (*label).into(), start_s: *start_s, end_s: *end_s })
        .collect()
}

#[test]
fn what_chance_gives_is_not_agreement() {
    let time: Vec<f64> = (0..100).map(f64::from).collect();
    // Independent labels of equal frequencies.
    let one = spans(&[("A", 0.0, 50.0), ("B", 50.0, 100.0)]);
    let other = spans(&[("A", 0.0, 25.0), ("B", 25.0, 50.0), ("A", 50.0, 75.0), ("B", 75.0, 100.0)]);
    let agreement = Agreement::new(&one, &other, &time);
    assert_eq!((agreement.share(), agreement.kappa()), (Some(0.5), Some(0.0)));
    // The same labels agree wholly, contrary ones not at all; of one label nothing can be said.
    assert_eq!(Agreement::new(&one, &one, &time).kappa(), Some(1.0));
    let contrary = spans(&[("B", 0.0, 50.0), ("A", 50.0, 100.0)]);
    assert_eq!(Agreement::new(&one, &contrary, &time).kappa(), Some(-1.0));
    let same = spans(&[("A", 0.0, 100.0)]);
    assert_eq!(Agreement::new(&same, &same, &time).kappa(), None);
    // What only one person labeled does not count for kappa.
    let part = Agreement::new(&one, &spans(&[("A", 0.0, 10.0)]), &time);
    assert_eq!((part.both(), part.alone), (10, [90, 0]));
    assert_eq!(Agreement::new(&[], &[], &time).kappa(), None);
}

#[test]
fn boundaries_pair_with_their_nearest_within_a_second() {
    let one = spans(&[("A", 0.0, 2.0), ("B", 2.0, 4.0), ("A", 4.0, 6.0), ("B", 6.0, 9.0)]);
    let other = spans(&[("A", 0.0, 2.25), ("B", 2.25, 5.25), ("A", 5.25, 6.5), ("B", 6.5, 9.0)]);
    let all = Agreement::new(&one, &other, &[]).all_boundaries();
    assert_eq!((all.distances_s.clone(), all.alone), (vec![0.25, 0.5], [1, 1]));
    assert_eq!((all.quantile_s(0.5), all.quantile_s(0.9)), (Some(0.375), Some(0.475)));
}
