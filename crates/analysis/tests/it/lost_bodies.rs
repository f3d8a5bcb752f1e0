//! A body that is lost for a while, and the labels of two hands that each handle their own.

use teachtree_analysis::{Analysis, Track, TrackId, analyze};
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;
use teachtree_engine::evaluator::evaluate;
use teachtree_language::graph::lower;
use teachtree_language::{Request, load};

/// Two hands that carry a box each, the boxes away from each other.
fn taught() -> Recording {
    let (scene, operator) =
        (teachtree_world::scene("independent").unwrap(), teachtree_world::operator("independent").unwrap());
    teachtree_world::teach(&scene, &operator, 1).unwrap()
}

fn analyzed(recording: &Recording) -> Analysis {
    let request = Request { files: vec!["bimanual.rules".into()], ..Request::default() };
    let rules = load(&request).rules.unwrap();
    let frames = teachtree_frames::frames(recording, &teachtree_analysis::channels(&rules)).unwrap();
    analyze(&rules, &frames, &evaluate(&lower(&rules), &frames).unwrap())
}

fn track(found: &Analysis, side: Side) -> &Track {
    found.track(TrackId::Hand(side)).unwrap()
}

#[test]
fn the_labels_of_the_other_hand_stay() {
    let whole = taught();
    let before = analyzed(&whole);
    // The object of the left hand is not seen for 0.4 s while the hand carries it.
    let carry = track(&before, Side::Left).segments.iter().find(|segment| segment.primitive == "Translate").unwrap();
    let object = carry.subject.object.clone().unwrap();
    let middle = carry.frames.start + carry.frames.len() / 2;
    let lost = middle - 200..middle + 200;
    let mut log = whole.clone();
    for (name, column) in &mut log.columns {
        if name.starts_with(&format!("{object}.")) {
            column.values[lost.clone()].fill(f64::NAN);
        }
    }
    let found = analyzed(&log);
    assert_eq!(found.stretches, before.stretches);
    assert_eq!(track(&found, Side::Right).relabeled, track(&before, Side::Right).relabeled);
    assert_eq!(track(&found, Side::Right).tasks, track(&before, Side::Right).tasks);
    let left = track(&found, Side::Left);
    for segment in left.segments.iter().chain(&left.relabeled) {
        assert!(segment.frames.end <= lost.start || lost.end <= segment.frames.start, "{segment:?}");
    }
    let of = |frame: usize| {
        left.segments.iter().find(|segment| segment.frames.contains(&frame)).map(|it| it.primitive.as_str())
    };
    assert_eq!((of(lost.start - 1), of(lost.end)), (Some("Translate"), Some("Translate")));
}
