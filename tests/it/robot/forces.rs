//! Demonstrated, commanded and exerted forces: the values that `simulate` reports match the recordings and `commands.json`.

use crate::program::{all_said, said, teachtree};
use serde_json::Value;
use teachtree_base::meaning::Meaning;
use teachtree_base::recording::Recording;
use teachtree_command::Commands;
use teachtree_frames::{self as stream, OpenRequest};

const FINGERS: [&str; 3] = ["thumb", "index", "middle"];

fn run(args: &[&str]) -> String {
    let output = teachtree(args);
    assert!(output.status.success(), "{}", all_said(&output));
    said(&output)
}

/// Returns the mean magnitude of a force (N) between two times of a recording (s).
fn mean(recording: &Recording, finger: &str, [from_s, to_s]: [f64; 2]) -> f64 {
    let parts = ["x", "y", "z"].map(|part| &recording.columns[&format!("right.{finger}.force.{part}")].values);
    let rows = recording.time.iter().enumerate().filter(|(_, time)| (from_s..to_s).contains(*time));
    let norms: Vec<f64> = rows.map(|(row, _)| parts.iter().map(|part| part[row].powi(2)).sum::<f64>().sqrt()).collect();
    norms.iter().sum::<f64>() / norms.len() as f64
}

fn is_near(one: f64, other: f64, share: f64) -> bool {
    (one - other).abs() <= share * other
}

/// Returns how `simulate` names a segment: by its primitive, and by its start where its primitive occurs more than once.
fn name(segments: &[Value], segment: &Value) -> String {
    let primitive = segment["primitive"].as_str().unwrap();
    let count = segments.iter().filter(|it| it["primitive"] == primitive).count();
    let start_s = segment["start_s"].as_f64().unwrap();
    if count == 1 { primitive.into() } else { format!("{primitive} at {:.1} s", start_s + 1e-6) }
}

fn sentence_on_raised(segments: &[Value], segment: &Value) -> String {
    let raised = segment["grip_raised"].as_f64().unwrap() * 100.0;
    format!("grip raised by {raised:.0} % in {}: fingers were about to slip", name(segments, segment))
}

/// Returns the sum of a force over the fingers of a segment, N.
fn sum(segment: &Value, force: &str) -> f64 {
    segment["fingers"].as_array().unwrap().iter().map(|finger| finger[force].as_f64().unwrap()).sum()
}

/// Runs `simulate`; returns its text and the segments of its only task.
fn simulated(commands: &str, scene: &[&str], out: &str) -> (String, Vec<Value>) {
    let args = [&["simulate", commands], scene, &["-o", out]].concat();
    let document: Value = serde_json::from_str(&run(&[&args[..], &["--format", "json"]].concat())).unwrap();
    (run(&args), document["tasks"][0]["segments"].as_array().unwrap().clone())
}

/// Writes a scene whose handled object is heavier by half than the demonstrated one. Returns its file.
fn heavier(scene: &str, file: String) -> String {
    let shipped = teachtree_world::shipped::scenes().find(|(name, _)| *name == scene).unwrap().1;
    assert!(shipped.contains("mass: 40 g"), "{shipped}");
    std::fs::write(&file, shipped.replace("mass: 40 g", "mass: 60 g")).unwrap();
    file
}

/// Each case has a scene, the seed of its operator, the compared primitives, and whether the object is heavier than the demonstrated one: the slip reflex then
/// raises the grip so much that the forces are outside of their profile.
const CASES: [(&str, &str, &[&str], bool); 2] =
    [("pick_and_press", "7001", &["Translate", "Press"], true), ("pick_and_place", "7003", &["Translate"], false)];

#[test]
fn forces_are_compared_with_the_commands_and_the_reflex_is_reported() {
    for (scene, seed, compared, is_firmer) in CASES {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
        let [log, file, robot, page] = ["log.csv", "commands.json", "robot.csv", "robot.html"].map(path);
        run(&["teach", scene, scene, "--seed", seed, "-o", &log]);
        run(&["retarget", &log, "-o", &file]);
        let shown = if is_firmer { heavier(scene, path("scene.yaml")) } else { scene.to_string() };
        let simulate = ["simulate", &file, "--scene", &shown, "-o", &robot];
        let text = run(&[&simulate[..], &["--report", &page]].concat());
        let document: Value = serde_json::from_str(&run(&[&simulate[..], &["--format", "json"]].concat())).unwrap();
        let outcome = &document["tasks"][0];

        let open =
            |log: &str| stream::open(&OpenRequest { log: log.into(), ..OpenRequest::default() }).unwrap().recording;
        let (demonstrated, exerted) = (open(&log), open(&robot));
        let analysis: Value = serde_json::from_str(&run(&["analyze", &robot, "--format", "json"])).unwrap();
        let found = analysis["tracks"][0]["segments"].as_array().unwrap();
        let commands = Commands::read(&std::fs::read_to_string(&file).unwrap(), &file).unwrap();
        let segments = &commands.tasks[0].segments;
        let mut are_far = false;
        for primitive in compared {
            let all = segments.iter().enumerate().filter(|(_, segment)| segment.primitive == *primitive);
            let again = found.iter().filter(|segment| segment["primitive"] == *primitive);
            for ((index, segment), again) in all.zip(again) {
                let reported =
                    outcome["segments"].as_array().unwrap().iter().find(|it| it["segment"] == index).unwrap();
                let begins_s = segment.demonstrated_start_s;
                let [from_s, to_s] = ["start_s", "end_s"].map(|key| again[key].as_f64().unwrap());
                let start_s = reported["start_s"].as_f64().unwrap();
                assert!((start_s - from_s).abs() < 0.5, "{scene} {primitive}: begins after {from_s} s, {reported}");
                for finger in FINGERS {
                    let tip = segment.tips.iter().find(|tip| tip.finger.name() == finger).unwrap();
                    let norms = tip.force.iter().map(|force| force.iter().map(|part| part * part).sum::<f64>().sqrt());
                    let was = mean(&demonstrated, finger, [begins_s, begins_s + segment.duration_s]);
                    let should = norms.sum::<f64>() / tip.force.len() as f64;
                    let is = mean(&exerted, finger, [from_s, to_s]);
                    are_far |= (is - should).abs() > 0.3_f64.max(0.3 * should);
                    let all = reported["fingers"].as_array().unwrap();
                    let says = all.iter().find(|it| it["finger"] == finger).unwrap();
                    let [d, c, e] =
                        ["demonstrated_n", "commanded_n", "exerted_n"].map(|key| says[key].as_f64().unwrap());
                    assert!(is_near(c, should, 0.03), "{scene} {primitive}: {should} N commanded, {says}");
                    assert!(is_near(e, is, 0.1), "{scene} {primitive}: {is} N exerted, {says}");
                    assert!(is_near(d, was, 0.1), "{scene} {primitive}: {was} N demonstrated, {says}");
                }
                let thumb = &reported["fingers"].as_array().unwrap()[0];
                let ratio = thumb["exerted_n"].as_f64().unwrap() / thumb["commanded_n"].as_f64().unwrap();
                let raised = reported["grip_raised"].as_f64().unwrap();
                assert!((1.0 + raised - ratio).abs() < 0.12, "{scene} {primitive}: raised by {raised}, {ratio} times");
            }
        }
        assert_eq!(are_far, is_firmer, "{scene}: {outcome:#}");
        assert_eq!(outcome["forces_kept"], !is_firmer, "{scene}: {outcome:#}");
        let of_compared = |it: &&Value| compared.iter().any(|primitive| it["primitive"] == *primitive);
        let segments = outcome["segments"].as_array().unwrap();
        let raised: Vec<String> =
            segments.iter().filter(of_compared).map(|it| sentence_on_raised(segments, it)).collect();
        let told = |text: &str| raised.iter().all(|sentence| text.contains(sentence));
        assert_eq!(told(&text), is_firmer, "{text}");
        assert_eq!(text.contains("forces outside their profile: "), is_firmer, "{text}");
        assert!(text.contains(" N demonstrated, ") && text.contains(" N commanded, "), "{text}");
        let page = std::fs::read_to_string(&page).unwrap();
        assert_eq!(told(&page), is_firmer, "{scene}");
        for line in [">demonstrated</text>", ">commanded</text>", ">exerted</text>", "[\"demonstrated\","] {
            assert!(page.contains(line), "{line}");
        }
    }
}

/// Two segments of one primitive are reported separately, and each sentence says which of them it is about.
#[test]
fn segments_of_one_primitive_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let [log, file, robot] = ["log.csv", "commands.json", "robot.csv"].map(path);
    run(&["teach", "pick_and_press", "pick_and_press", "--seed", "7001", "-o", &log]);
    run(&["retarget", &log, "-o", &file]);
    let (text, segments) = simulated(&file, &["--scene", &heavier("pick_and_press", path("scene.yaml"))], &robot);
    let translates: Vec<&Value> = segments.iter().filter(|it| it["primitive"] == "Translate").collect();
    assert_eq!(translates.len(), 2, "{text}");
    let worst = |it: &&&Value| sum(it, "exerted_n") - sum(it, "commanded_n");
    let worst = translates.iter().max_by(|one, other| worst(one).total_cmp(&worst(other))).unwrap();
    let thumb = &worst["fingers"][0];
    let [commanded, exerted] = ["commanded_n", "exerted_n"].map(|key| thumb[key].as_f64().unwrap());
    let place = name(&segments, worst);
    let expected = format!("the thumb exerts {exerted:.2} N in {place} on average, commanded are {commanded:.2} N");
    assert!(text.contains(&expected), "{expected}: {text}");
    for segment in &segments {
        let is_raised = segment["grip_raised"].as_f64().unwrap() >= 0.005;
        assert_eq!(text.contains(&sentence_on_raised(&segments, segment)), is_raised, "{segment}: {text}");
    }
}

const LIMITED: &str = "the hand may not press harder";

/// The limit of the hand is named as the cause only where a command exceeds it.
#[test]
fn the_limit_of_the_hand_is_a_cause_where_a_command_exceeds_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let [log, file, robot] = ["log.csv", "commands.json", "robot.csv"].map(path);
    // The commands of this recording are at the limit of 5 N.
    let demos = concat!(env!("CARGO_MANIFEST_DIR"), "/demos/robosuite");
    let [lift, binding, scene] =
        ["lift_demo_1.csv", "panda_lift.binding.yaml", "panda_lift.scene.yaml"].map(|name| format!("{demos}/{name}"));
    let from = ["--binding", &binding, "--scene", &scene, "--robot", "parallel_jaw", "-o", &file];
    run(&[&["retarget", &lift][..], &from].concat());
    let (text, segments) = simulated(&file, &["--scene", &scene, "--robot", "parallel_jaw"], &robot);
    let carried = segments.iter().find(|it| it["primitive"] == "Translate").unwrap();
    let less = (1.0 - sum(carried, "exerted_n") / sum(carried, "commanded_n")) * 100.0;
    let expected = format!("fingers exert {less:.0} % less than commanded in Translate\n");
    assert!(text.contains(&expected) && !text.contains(LIMITED), "{expected}: {text}");
    // These commands ask the thumb for 4.75 N; its limit is 4 N.
    run(&["teach", "peg_in_hole_tight", "peg_in_hole_tight", "--seed", "9712", "-o", &log]);
    run(&["retarget", &log, "-o", &file]);
    let (text, _) = simulated(&file, &["--scene", "peg_in_hole_tight"], &robot);
    for primitive in ["Translate", "Insert"] {
        assert!(text.contains(&format!(" % in {primitive}: {LIMITED}")), "{text}");
    }
}

/// A recording without forces has no demonstrated forces.
#[test]
fn forces_that_were_not_measured_are_not_demonstrated() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let [binding, file] = ["own.binding.yaml", "commands.json"].map(path);
    let demos = concat!(env!("CARGO_MANIFEST_DIR"), "/demos/robosuite");
    let shipped = std::fs::read_to_string(format!("{demos}/panda_lift.binding.yaml")).unwrap();
    let measures = |line: &&str| line.contains("thumb.force") || line.contains("index.force");
    assert_eq!(shipped.lines().filter(measures).count(), 2, "{shipped}");
    let without: Vec<&str> = shipped.lines().filter(|line| !measures(line)).collect();
    std::fs::write(&binding, without.join("\n")).unwrap();
    let [log, scene] = ["lift_demo_1.csv", "panda_lift.scene.yaml"].map(|name| format!("{demos}/{name}"));
    run(&["retarget", &log, "--binding", &binding, "--scene", &scene, "--robot", "parallel_jaw", "-o", &file]);
    let commands = Commands::read(&std::fs::read_to_string(&file).unwrap(), &file).unwrap();
    let held = commands.tasks[0].segments.iter().filter(|segment| segment.does == Meaning::Carry);
    let tips: Vec<_> = held.flat_map(|segment| &segment.tips).collect();
    assert!(!tips.is_empty());
    assert!(tips.iter().all(|tip| tip.force[0] != [0.0; 3] && tip.demonstrated_force.is_empty()), "{tips:?}");
}
