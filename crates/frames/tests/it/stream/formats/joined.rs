//! Columns that are joined, columns that may be lacking, sensors that are dead before they are tared.

use super::{bound_text, values};
use teachtree_frames::bind::BindingFile;

#[test]
fn the_middle_of_several_markers_is_a_point() {
    let text = "time,ax,ay,az,bx,by,bz\n0,0,0,0,2,4,6\n1,1,1,1,,4,6\n";
    let binding = "channels: {cube.position: {mean: [a<xyz>, b<xyz>]}}\n";
    let (recording, _) = bound_text("log.csv", text, binding).unwrap();
    assert_eq!(["x", "y", "z"].map(|axis| values(&recording, &format!("cube.position.{axis}"))[0]), [1.0, 2.0, 3.0]);
    assert!(values(&recording, "cube.position.x")[1].is_nan(), "a marker is lost: the middle is not known");
    let refused = |text: &str| bound_text("log.csv", text, binding).unwrap_err();
    insta::assert_snapshot!(refused("time,ax,ay,az\n0,0,0,0\n"), @"binding.yaml:1:12: the log has no column `bx`; did you mean `ax`?");
    insta::assert_snapshot!(refused("time,ax,ay,az,bx,by\n0,0,0,0,1,1\n"), @"binding.yaml:1:12: the log has no column `bz`; did you mean `az`?");
}

#[test]
fn a_mean_is_of_two_columns_or_more() {
    for wrong in ["{mean: [a<xyz>]}", "{sum: [a<xyz>, b<xyz>]}", "{}", "{mean: [a<xyz>, b<xyz>], of: c}"] {
        let text = format!("channels: {{cube.position: {wrong}}}\n");
        let error = BindingFile::parse(text, "binding.yaml".into()).unwrap_err().to_string();
        assert!(error.contains("expected `{mean: [left <xyz>, right <xyz>]}`"), "{wrong}: {error}");
    }
}

#[test]
fn logs_may_lack_what_ends_in_a_question_mark() {
    let binding = "channels: {right.thumb.position: \"p<xyz> [mm]?\", cube.position: c<xyz>?}\n";
    let (recording, _) = bound_text("log.csv", "time,px,py,pz\n0,1,2,3\n1,1,2,3\n", binding).unwrap();
    assert_eq!(values(&recording, "right.thumb.position.z"), [0.003, 0.003]);
    assert!(!recording.columns.contains_key("cube.position.x"));
    // A part of a vector is a mistake all the same.
    let error = bound_text("log.csv", "time,px,py\n0,1,2\n", binding).unwrap_err();
    insta::assert_snapshot!(error, @"binding.yaml:1:12: the log has no column `pz`; did you mean `px`?");
}

/// What is tared reads zero at rest, so that a stuck sensor would pass for one at rest.
#[test]
fn a_dead_sensor_is_reported_before_it_is_tared() {
    let rows: String =
        (0..300).map(|row| format!("{},{},0,0,-2.3,-1.1,-12.4\n", f64::from(row) / 100.0, row)).collect();
    let text = format!("time,px,py,pz,fx,fy,fz\n{rows}");
    let binding = "
channels: {right.palm.position: 'p<xyz> [mm]', right.palm.force: f<xyz>}
tare: {channels: [right.palm.force], from: 0 s, to: 0.3 s}
";
    let (recording, issues) = bound_text("log.csv", &text, binding).unwrap();
    let dead: Vec<(&str, &str)> = issues.iter().map(|issue| (issue.kind.name(), issue.channel.as_str())).collect();
    assert_eq!(dead, [("stuck_sensor", "right.palm.force")]);
    assert!(values(&recording, "right.palm.force.z").iter().all(|force| *force == 0.0));
}

#[test]
fn taring_measures_the_noise() {
    let rows: String = (0..200)
        .map(|row| format!("{},0,0,0,{},0,7\n", f64::from(row) / 100.0, [1.0, 3.0][row as usize % 2]))
        .collect();
    let text = format!("time,px,py,pz,fx,fy,fz\n{rows}");
    let binding = "
channels: {right.palm.position: p<xyz>, right.palm.force: f<xyz>}
tare: {channels: [right.palm.force], from: 0 s, to: 1 s}
";
    let (recording, _) = bound_text("log.csv", &text, binding).unwrap();
    assert_eq!(values(&recording, "right.palm.noise")[0], 1.0);
    assert_eq!(values(&recording, "right.palm.force.z")[0], 0.0);
}
