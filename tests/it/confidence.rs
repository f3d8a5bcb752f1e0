//! The confidence of boundaries and the stability of tasks: `analyze --confidence`.

use crate::program::{all_said, demonstrate, said, teachtree_in};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;

fn run(folder: &Path, args: &[&str]) -> String {
    let output = teachtree_in(folder, args);
    assert!(output.status.success(), "{args:?}: {}", all_said(&output));
    said(&output)
}

fn json(folder: &Path, args: &[&str]) -> Value {
    serde_json::from_str(&run(folder, args)).unwrap()
}

#[test]
fn a_boundary_is_where_its_variations_are() {
    let folder = tempfile::tempdir().unwrap();
    demonstrate("push_and_trace", &["--seed", "2"], folder.path().join("log.csv"));
    let sure = json(folder.path(), &["analyze", "log.csv", "--confidence", "--format", "json"]);
    let plain = json(folder.path(), &["analyze", "log.csv", "--format", "json"]);
    let mut starts = 0;
    for (track, without) in sure["tracks"].as_array().unwrap().iter().zip(plain["tracks"].as_array().unwrap()) {
        let segments = track["relabeled"].as_array().unwrap();
        for (segment, without) in segments.iter().zip(without["relabeled"].as_array().unwrap()) {
            let number = |key: &str| segment[key].as_f64().unwrap_or_else(|| panic!("{key}: {segment}"));
            assert_eq!((&segment["primitive"], &segment["start_s"]), (&without["primitive"], &without["start_s"]));
            assert!(without.get("confidence").is_none());
            // On no public set are 90 % of the boundaries right, at any agreement.
            assert!((0.0..0.9).contains(&number("confidence")), "{segment}");
            assert!((number("confidence")..=1.0).contains(&number("stability")), "{segment}");
            assert!(number("earliest_s") <= number("start_s") && number("start_s") <= number("latest_s"), "{segment}");
            starts += 1;
        }
        for task in track["tasks"].as_array().unwrap() {
            assert!(task["stability"].as_f64().unwrap() >= 0.5, "{task}");
            // No public set has tasks to learn the confidence from.
            assert!(task.get("confidence").is_none(), "{task}");
            // The segments of a task are those of its track.
            for segment in task["segments"].as_array().unwrap() {
                let same = segments.iter().find(|it| it["start_s"] == segment["start_s"]).unwrap();
                assert_eq!(same["confidence"], segment["confidence"]);
            }
        }
    }
    assert!(starts >= 5, "{sure:#}");
    // A fingertip that touches is felt far above its noise.
    let segments = sure["tracks"][0]["relabeled"].as_array().unwrap();
    assert!(segments.iter().filter_map(|it| it["margin"].as_f64()).any(|margin| margin > 3.0), "{segments:#?}");
    let text = run(folder.path(), &["analyze", "log.csv", "--confidence"]);
    assert!(text.contains(" %, starts ") && text.contains("   stability > 99 %") && text.contains(" SD\n"), "{text}");
    assert!(!text.contains("100 %"), "{text}");
    run(folder.path(), &["analyze", "log.csv", "--confidence", "--report", "sure.html", "-q"]);
    let page = std::fs::read_to_string(folder.path().join("sure.html")).unwrap();
    assert!(page.contains("<th>confidence</th><th>starts between, s</th>") && page.contains("<th>stability</th>"));
    assert!(page.contains("<td class=\"number\">&gt; 99 %</td>") && !page.contains("\">100 %<"));
    run(folder.path(), &["analyze", "log.csv", "--report", "plain.html", "-q"]);
    assert!(!std::fs::read_to_string(folder.path().join("plain.html")).unwrap().contains("<th>confidence</th>"));
    let table = run(folder.path(), &["analyze", "log.csv", "--confidence", "--format", "csv"]);
    assert!(
        table.lines().next().unwrap().ends_with(",version,confidence,stability,earliest_s,latest_s,margin"),
        "{table}"
    );
    let row = |kind: &str| table.lines().find(|row| row.split(',').nth(2) == Some(kind)).unwrap().rsplit(',');
    let is_empty = |kind: &str| row(kind).take(5).map(str::is_empty).collect::<Vec<_>>();
    // From the last column: margin, latest_s, earliest_s, stability, confidence.
    assert_eq!(is_empty("task"), [true, true, true, false, true], "{table}");
    assert_eq!(is_empty("relabeled")[1..], [false; 4], "{table}");
}

#[test]
fn a_slow_rise_is_less_sure_than_a_step() {
    let folder = tempfile::tempdir().unwrap();
    let binding = "
hand_file: hand_wrist.rules
channels:
  right.palm.position: p<xyz>
  right.palm.force: f<xyz>
  tool.position: p<xyz>
scene: {bodies: {tool: {role: object, radius: 50 mm, fixed_to: right}}}
";
    std::fs::write(folder.path().join("b.yaml"), binding).unwrap();
    let mut text = String::from("time,px,py,pz,fx,fy,fz\n");
    for row in 0..2800 {
        let time = f64::from(row) * 0.01;
        // A step up at 4 s, down at 8 s; a rise from 14 s on that takes 8 s.
        let force = if (4.0..8.0).contains(&time) || time >= 22.0 { 20.0 } else { 2.5 * (time - 14.0).max(0.0) };
        let noise = 0.05 * f64::from((row * 37) % 11 - 5);
        let _ = writeln!(text, "{time},{},0,0.3,0,0,{}", 0.1 * (time * 1.5).sin(), force + noise);
    }
    std::fs::write(folder.path().join("log.csv"), text).unwrap();
    let sure = json(folder.path(), &["analyze", "log.csv", "--binding", "b.yaml", "--confidence", "--format", "json"]);
    let segments = sure["tracks"][0]["relabeled"].as_array().unwrap();
    let traces: Vec<&Value> = segments.iter().filter(|it| it["primitive"] == "Trace").collect();
    let [step, rise] = traces.as_slice() else { panic!("{segments:#?}") };
    let confidence = |segment: &Value| segment["confidence"].as_f64().unwrap();
    assert!(confidence(rise) < confidence(step), "{step:#} {rise:#}");
    let width = |segment: &Value| segment["latest_s"].as_f64().unwrap() - segment["earliest_s"].as_f64().unwrap();
    assert!(width(rise) > width(step) + 0.05, "{step:#} {rise:#}");
    // The level is varied by more than the params: from 2/3 to 3/2.
    let after = |key: &str| rise[key].as_f64().unwrap() - 14.0;
    assert!(after("latest_s") > 1.9 * after("earliest_s"), "{rise:#}");
    let margin = |segment: &Value| segment["margin"].as_f64().unwrap();
    assert!(margin(step) > 5.0 && margin(rise) < margin(step) / 2.0, "{step:#} {rise:#}");
}
