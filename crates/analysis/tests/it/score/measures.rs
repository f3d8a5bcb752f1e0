//! Each measure against a case that is computed by hand.

use super::build::*;
use teachtree_analysis::score::statistics::quantile;
use teachtree_analysis::score::{MAX_PAIRS, Share, Stage, score};

#[test]
fn accuracy_is_the_share_of_the_time() {
    let tally = tally("Move 2 Grasp 3 Move 5", "Move 3 Grasp 2 Move 4 Grasp 1");
    near(tally.accuracy(), 8.0 / 10.0);
    near(tally.precision("Move"), 6.0 / 7.0);
    near(tally.recall("Move"), 6.0 / 7.0);
    near(tally.precision("Grasp"), 2.0 / 3.0);
    near(tally.recall("Grasp"), 2.0 / 3.0);
    near(Some(tally.scored_s()), 10.0);
}

#[test]
fn a_segment_is_found_when_it_overlaps_enough() {
    // Grasp: 2 to 5 against 3 to 6, two seconds of four: an overlap of one half, which is enough for 50 %.
    // Place: 8 to 12 against 11 to 12, a quarter. The first Move: two of three seconds, the second: two of three.
    let tally = tally("Move 2 Grasp 3 Move 3 Place 4", "Move 3 Grasp 3 Move 5 Place 1");
    assert_eq!(tally.segments["Grasp"].found, [1, 1, 1]);
    assert_eq!(tally.segments["Place"].found, [1, 1, 0]);
    let f1 = tally.f1();
    near(f1[0], 1.0);
    near(f1[1], 1.0);
    // The second Move: 5 to 8 against 6 to 11 is two of six seconds.
    assert_eq!(tally.segments["Move"].found, [2, 2, 1]);
    near(f1[2], 2.0 * 2.0 / 8.0);
}

#[test]
fn a_true_segment_is_found_once() {
    // Two halves of one Grasp: the first has the greater overlap, the second finds it taken.
    let tally = tally("Move 1 Grasp 4 Move 1", "Move 1 Grasp 2 Move 0.1 Grasp 1.9 Move 1");
    assert_eq!(tally.segments["Grasp"].found, [1, 1, 1]);
    assert_eq!((tally.segments["Grasp"].truths, tally.segments["Grasp"].results), (1, 2));
    // Found are two Moves and one Grasp; true are three segments, resulting five.
    near(tally.f1()[0], 2.0 * 3.0 / 8.0);
}

#[test]
fn the_edit_score_counts_edits_of_the_sequence() {
    // One insertion, of five.
    near(
        tally("Move 1 Approach 1 Grasp 1 Translate 1", "Move 1 Approach 1 Slide 0.1 Grasp 0.9 Translate 1").edit(),
        0.8,
    );
    // One replacement, of three; lengths do not matter.
    near(tally("Move 1 Approach 1 Grasp 1", "Move 0.2 Approach 0.3 Turn 2.5").edit(), 2.0 / 3.0);
    // Nothing in common.
    near(tally("Move 1 Approach 1", "Grasp 1 Place 1").edit(), 0.0);
    let equal = tally("Move 1 Approach 1", "Move 0.5 Approach 1.5");
    near(equal.edit(), 1.0);
    assert_eq!(equal.sequences, Share { right: 1, of: 1 });
}

#[test]
fn boundaries_are_starts_that_stand_for_each_other() {
    let tally =
        tally("Move 1 Approach 1 Grasp 1 Translate 1", "Move 1.01 Approach 0.97 Slide 0.2 Grasp 0.85 Translate 0.97");
    let starts: Vec<(String, bool, i64)> = tally
        .boundaries
        .iter()
        .map(|boundary| (boundary.after.clone(), boundary.by_contact, (boundary.late_s.unwrap() * 1e3).round() as i64))
        .collect();
    // The start of the recording is not a boundary.
    assert_eq!(starts, [("Approach".into(), false, 10), ("Grasp".into(), true, 180), ("Translate".into(), true, 30)]);
    let all = tally.boundary_errors();
    near(all.median_s(), 0.030);
    // Between the second and the third of three, nine tenths of the way.
    near(all.p95_s(), 0.030 + 0.9 * 0.150);
    near(tally.contact_errors().median_s(), 0.105);
    near(tally.errors_of("Translate").p95_s(), 0.030);
}

#[test]
fn a_boundary_without_its_segment_is_not_found() {
    let tally = tally("Move 1 Approach 1 Grasp 1 Release 1", "Move 1 Approach 2 Release 1");
    assert_eq!(tally.boundary_errors().found, Share { right: 2, of: 3 });
    assert_eq!(tally.errors_of("Grasp").found, Share { right: 0, of: 1 });
    assert_eq!(tally.errors_of("Grasp").median_s(), None);
}

#[test]
fn a_segment_of_another_time_is_not_the_same() {
    // The only Grasp of the result is alone in its sequence, but it is 5 s late; the Place is 0.9 s late.
    let tally = tally("Move 1 Grasp 1 Place 0.5 Move 7.5", "Move 3.4 Place 0.6 Move 2 Grasp 1 Move 3");
    let found: Vec<(&str, bool)> =
        tally.boundaries.iter().map(|boundary| (boundary.after.as_str(), boundary.late_s.is_some())).collect();
    assert_eq!(found, [("Grasp", false), ("Place", false), ("Move", true)]);
    near(self::tally("Move 1 Place 0.5 Move 3", "Move 1.9 Place 0.6 Move 2").errors_of("Place").median_s(), 0.9);
}

#[test]
fn of_equal_alignments_the_nearest_in_time_counts() {
    // Which of two Trace the one true Trace is cannot be told from the sequence.
    let tally = tally("Push 3 Trace 2 Release 1", "Push 1 Trace 0.5 Push 1.6 Trace 1.9 Release 1");
    assert_eq!(tally.edits, [1.0 - 2.0 / 5.0]);
    near(tally.errors_of("Trace").median_s(), 0.1);
}

/// A kind is right where the truth has its parent, unless the truth names the kind.
#[test]
fn a_kind_counts_for_its_parent() {
    let right = |truth: &str, result: &str| tally(truth, result).accuracy().unwrap();
    near(Some(right("Grasp 1 Translate 2", "Grasp 1 Lift 1 Translate 1")), 1.0);
    near(Some(right("Grasp 1 Translate 2", "Grasp 1 Lift 2")), 1.0);
    near(Some(right("Grasp 1 Lift 1 Translate 1", "Grasp 1 Lift 2")), 2.0 / 3.0);
    near(Some(right("Grasp 1 Lift 1 Translate 1", "Grasp 1 Translate 2")), 2.0 / 3.0);
    let tally = tally("Grasp 1 Lift 2", "Grasp 1 Lift 2");
    assert!(tally.boundaries[0].by_contact, "as between Grasp and Translate");
}

#[test]
fn contacts_make_the_boundaries_of_the_table() {
    let by_contact = |before: &str, after: &str| {
        let text = format!("{before} 1 {after} 1");
        tally(&text, &text).boundaries[0].by_contact
    };
    for (before, after) in [
        ("Approach", "Grasp"),
        ("Grasp", "Translate"),
        ("Translate", "Place"),
        ("Translate", "Follow"),
        ("Translate", "Press"),
        ("Translate", "Insert"),
        ("Follow", "Place"),
        ("Approach", "Push"),
        ("Push", "Trace"),
        ("Trace", "Release"),
        ("Place", "Release"),
        ("Translate", "Pass"),
    ] {
        assert!(by_contact(before, after), "{before} {after}");
    }
    for (before, after) in [
        ("Move", "Approach"),
        ("Release", "Move"),
        ("Slide", "Grasp"),
        ("Grasp", "Turn"),
        ("Grasp", "Pullout"),
        ("Place", "Press"),
        ("Follow", "Press"),
        ("Translate", "Hold"),
        ("Hold", "Wave"),
    ] {
        assert!(!by_contact(before, after), "{before} {after}");
    }
}

#[test]
fn wilson_bounds_are_those_of_the_books() {
    // 95 % bounds from Wilson's formula, to four digits.
    for (right, of, low, high) in
        [(10, 10, 0.7225, 1.0), (0, 10, 0.0, 0.2775), (8, 10, 0.4902, 0.9433), (199, 200, 0.9722, 0.9991)]
    {
        let (found_low, found_high) = Share { right, of }.bounds().unwrap();
        assert!(
            (found_low - low).abs() < 5e-5 && (found_high - high).abs() < 5e-5,
            "{right}/{of}: {found_low} {found_high}"
        );
    }
    assert_eq!(Share::default().rate(), None);
    assert_eq!(Share::default().bounds(), None);
}

#[test]
fn quantiles_go_straight_between_values() {
    let values = [1.0, 2.0, 4.0, 8.0];
    near(quantile(&values, 0.0), 1.0);
    near(quantile(&values, 0.5), 3.0);
    near(quantile(&values, 0.95), 4.0 + 0.85 * 4.0);
    near(quantile(&values, 1.0), 8.0);
    near(quantile(&[7.0], 0.95), 7.0);
    assert_eq!(quantile(&[], 0.5), None);
}

#[test]
fn masked_time_is_cut_out() {
    // Two of the six labeled seconds are wrong; 2 to 4 s are not labeled.
    let tally = tally("Move 2 - 2 Grasp 2 Place 2", "Move 4.5 Grasp 2 Place 1.5");
    near(Some(tally.scored_s()), 6.0);
    near(tally.accuracy(), 5.0 / 6.0);
    near(tally.edit(), 1.0);
    // Where Grasp began is not known: only Place has a boundary.
    let boundaries: Vec<&str> = tally.boundaries.iter().map(|boundary| boundary.after.as_str()).collect();
    assert_eq!(boundaries, ["Place"]);
    near(tally.boundary_errors().median_s(), 0.5);
}

#[test]
fn a_gap_in_the_recording_is_cut_out() {
    let tally = tally("Move 1 Grasp 3 Place 1", "Move 1 Grasp 1 - 1 Grasp 1 Place 1");
    near(Some(tally.scored_s()), 4.0);
    near(tally.accuracy(), 1.0);
    assert_eq!(tally.segments["Grasp"].truths, 1);
    assert_eq!(tally.sequences, Share { right: 1, of: 1 });
}

#[test]
fn each_of_several_alternatives_is_right() {
    let tally = tally("Move|Approach 3 Grasp 1 Move|Release 2", "Move 1 Approach 1.9 Grasp 1.1 Release 1 Move 1");
    near(tally.accuracy(), 5.9 / 6.0);
    // Move and Approach are one segment in the words of this truth.
    assert_eq!(tally.sequences, Share { right: 1, of: 1 });
    near(tally.f1()[2], 1.0);
    near(tally.errors_of("Grasp").median_s(), 0.1);
    near(tally.recall("Move|Approach"), 2.9 / 3.0);
    near(tally.precision("Move|Approach"), 1.0);
}

#[test]
fn a_segment_over_the_end_of_its_alternatives_is_still_one() {
    // The Move lasts 0.2 s longer than in the truth; it is not a second, false Move.
    let tally = tally("Move|Approach 2 Grasp 2", "Approach 1 Move 1.2 Grasp 1.8");
    assert_eq!(tally.sequences, Share { right: 1, of: 1 });
    near(tally.precision("Move|Approach"), 2.0 / 2.2);
    assert_eq!(tally.precision("Move"), None);
}

#[test]
fn a_segment_of_a_merged_class_is_of_it_where_the_truth_has_another() {
    // Move and Approach are one class, also where neither is right: one false segment, not two.
    let tally = tally("Move|Approach 2 Grasp 4", "Move 2 Grasp 2 Move 1 Approach 1");
    let class = tally.segments["Move|Approach"];
    assert_eq!((class.truths, class.results, class.found[2]), (1, 2, 1));
    assert!(!tally.segments.contains_key("Approach"), "{:?}", tally.segments);
}

#[test]
fn coordination_is_scored_where_the_hands_are() {
    use teachtree_analysis::score::{Span, TrackTruth, Truth};
    use teachtree_analysis::{Track, TrackId};
    let mut analysis = result("Move 4 - 1 Move 5");
    let both = segments(0.0, "- 1 Pass 2");
    analysis.tracks.push(Track {
        who: TrackId::Both,
        relabeled: both.clone(),
        segments: both,
        tasks: Vec::new(),
        composites: Vec::new(),
    });
    let primitives: Vec<Span> = spans("separate 1.5 Pass 2 separate 6.5");
    let truth = Truth { tracks: vec![TrackTruth { who: TrackId::Both, primitives, tasks: None }] };
    let tally = rows(&truth, &analysis).remove(0).tally;
    near(Some(tally.scored_s()), 9.0);
    near(tally.accuracy(), 8.0 / 9.0);
    // Primitives that do not occur have no segment.
    assert_eq!(tally.segments.keys().collect::<Vec<_>>(), ["Pass"]);
    near(tally.boundary_errors().median_s(), 0.5);
}

#[test]
fn a_track_that_was_not_analyzed_is_refused() {
    let mut truth = truth("Move 1");
    truth.tracks[0].who = teachtree_analysis::TrackId::Both;
    let error = score(&truth, &result("Move 1"), Stage::Raw, &meta("log.csv")).unwrap_err();
    let message = "log.csv: the true labels are of the track `both`, the analysis has right";
    assert_eq!(error.to_string().lines().next(), Some(message));
    // A recording of one hand, and rules with a tree for both.
    let mut nothing = result("Move 1");
    nothing.tracks.clear();
    truth.tracks[0].who = teachtree_analysis::TrackId::Hand(teachtree_base::hands::Side::Right);
    let error = score(&truth, &nothing, Stage::Raw, &meta("log.csv")).unwrap_err();
    let message =
        "log.csv: the true labels are of the track `right`, the analysis has no track\n  help: use rules with a tree";
    assert!(error.to_string().starts_with(message), "{error}");
}

#[test]
fn too_many_segments_are_refused() {
    let many = "Move 0.01 Grasp 0.01 ".repeat(2600);
    const { assert!(5200 * 5200 > MAX_PAIRS) };
    let error = score(&truth(&many), &result(&many), Stage::Raw, &meta("log.csv")).unwrap_err();
    assert!(error.to_string().contains("too many segments"), "{error}");
}
