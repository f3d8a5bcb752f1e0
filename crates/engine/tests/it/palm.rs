//! Rules that read the rotation of the palm.

use crate::recordings::passing;
use teachtree_base::diagnostic::Severity;
use teachtree_base::hands::Side;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::units::Dimension;
use teachtree_engine::evaluator::evaluate;
use teachtree_frames::frames;
use teachtree_language as language;
use teachtree_language::graph::lower;

#[test]
fn rules_read_the_rotation_of_the_palm_and_logs_may_lack_it() {
    let text = "use \"stream.rules\"\nprimitive Move does free, Tilted does carry\n\
                for each hand { signal upright = angle(from_frame(vec3(0, 0, 1), palm.rotation), vec3(0, 0, 1)) < 20 deg }\n\
                tree hands for each hand, settle 50 ms { upright => Move\n else => Tilted }\n";
    let loaded = language::load_text("palm.rules", text);
    assert!(loaded.diagnostics.iter().all(|it| it.severity != Severity::Error), "{:?}", loaded.diagnostics);
    let rules = loaded.rules.unwrap();
    let found = |log: &Recording| {
        let frames = frames(log, &rules.channels).unwrap();
        let lacks = frames.issues.iter().any(|it| it.kind == "missing_channel" && it.channel == "right.palm.rotation");
        let leaves = evaluate(&lower(&rules), &frames).unwrap();
        let labels = leaves[0].hands[&Side::Right].iter().map(|run| rules.label_name(run.label.unwrap()).to_string());
        (labels.collect::<Vec<_>>(), lacks)
    };
    let mut log = passing();
    assert_eq!(found(&log), (vec!["Move".to_string()], true));
    let len = log.time.len();
    let half = |first: f64, second: f64| (0..len).map(|row| if row < len / 2 { first } else { second }).collect();
    let turned = std::f64::consts::FRAC_1_SQRT_2;
    for (part, values) in
        [("w", half(1.0, turned)), ("x", half(0.0, turned)), ("y", half(0.0, 0.0)), ("z", half(0.0, 0.0))]
    {
        log.columns.insert(format!("right.palm.rotation.{part}"), Column { dimension: Dimension::NONE, values });
    }
    assert_eq!(found(&log), (vec!["Move".to_string(), "Tilted".to_string()], false));
}
