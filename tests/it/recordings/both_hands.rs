//! Two hands in real recordings: who gives, who takes, who holds, and when.

use super::given::given;
use super::{NamedInterval, SHIPPED, analysis, json, named, near, of, shipped};
use serde_json::Value;

fn track<'a>(analysis: &'a Value, name: &str) -> &'a Value {
    analysis["tracks"].as_array().unwrap().iter().find(|track| track["track"] == name).unwrap()
}

fn listed(track: &Value, list: &str) -> Vec<NamedInterval> {
    track[list].as_array().unwrap().iter().map(|it| named(it, "primitive")).collect()
}

/// The relabeled primitives of each task of a hand, and what the task is called.
fn printed(analysis: &Value, hand: &str) -> Vec<(String, Vec<String>)> {
    let tasks = track(analysis, hand)["tasks"].as_array().unwrap();
    let names = |task: &Value| {
        let segments = task["segments"].as_array().unwrap().iter();
        segments.map(|it| it["primitive"].as_str().unwrap().to_string()).collect()
    };
    tasks.iter().map(|task| (task["task"].as_str().unwrap().to_string(), names(task))).collect()
}

/// From the receiver's touch that was not lost again to the giver's last one, s.
fn is_handed_over(analysis: &Value, from: f64, to: f64) {
    let both = listed(track(analysis, "both"), "relabeled");
    let [(_, start, end)] = of(&both, &["Pass"])[..] else { panic!("{both:?}") };
    near(*start, from, 0.25);
    near(*end, to, 0.25);
    let (giver, receiver) = (printed(analysis, "right"), printed(analysis, "left"));
    for hand in [&giver, &receiver] {
        let (task, segments) = hand.last().unwrap();
        assert_eq!(task, "pick_and_place");
        assert_eq!(segments.iter().filter(|name| *name == "Pass").count(), 1, "{segments:?}");
    }
    assert!(giver.last().unwrap().1.ends_with(&["Pass".into(), "Release".into()]), "{giver:?}");
    assert!(receiver.last().unwrap().1.ends_with(&["Pass".into(), "Translate".into()]), "{receiver:?}");
}

#[test]
fn a_hammer_is_handed_over_from_the_right_to_the_left() {
    let analysis = shipped("handover_panda_panda_demo_5.csv");
    is_handed_over(&analysis, 9.80, 12.15);
    assert_eq!(printed(&analysis, "right")[0].1, ["Move", "Approach", "Grasp", "Translate", "Pass", "Release"]);
    assert_eq!(printed(&analysis, "left")[0].1, ["Move", "Approach", "Pass", "Translate"]);
    assert_eq!(listed(track(&analysis, "both"), "relabeled").len(), 1);
}

#[test]
fn every_hand_over_is_found_among_touches_that_come_to_nothing() {
    for (demo, from, to) in [(0, 30.30, 31.90), (1, 24.95, 25.95), (5, 9.80, 12.15)] {
        let Some(path) = given(&format!("robosuite/handover_panda_panda_demo_{demo}.csv")) else { return };
        is_handed_over(&analysis(&path, "demos/robosuite/handover.binding.yaml"), from, to);
    }
}

/// Both arms grasp the pot, which leaves the table at 12.75 s.
fn is_lifted_together(analysis: &Value) {
    let both = track(analysis, "both");
    for list in ["segments", "relabeled"] {
        let segments = listed(both, list);
        near(segments[0].1, 12.75, 0.25);
        assert!(segments.len() <= 5, "{segments:?}");
        let grasps = ["EqualGrasp", "MainGrasp(left)", "MainGrasp(right)"];
        assert_eq!(of(&segments, &grasps).len(), segments.len(), "{segments:?}");
    }
    for hand in ["left", "right"] {
        assert_eq!(printed(analysis, hand).last().unwrap().0, "carry_together");
    }
}

#[test]
fn a_pot_is_lifted_with_both_arms() {
    is_lifted_together(&shipped("BaxterLift_demo_1.csv"));
    let Some(path) = given("robosuite/BaxterLift_demo_1.csv") else { return };
    is_lifted_together(&analysis(&path, "demos/robosuite/baxter_lift.binding.yaml"));
}

/// Peg and plate touch from 13.00 s to the end; they bump into each other before, for up to 1.6 s.
fn is_mated(analysis: &Value) {
    let both = listed(track(analysis, "both"), "relabeled");
    let mated = of(&both, &["Fit", "Insert"]);
    near(mated[0].1, 13.00, 0.30);
    near(mated.last().unwrap().2, 14.07, 0.05);
    assert!(mated.windows(2).all(|pair| pair[0].2 == pair[1].1), "{both:?}");
    for hand in ["left", "right"] {
        let tasks = printed(analysis, hand);
        assert_eq!(tasks.iter().map(|(task, _)| task.as_str()).collect::<Vec<_>>(), ["fit"], "{hand}");
    }
}

#[test]
fn bumps_are_not_a_fit() {
    is_mated(&shipped("BaxterPegInHole_demo_1.csv"));
    let Some(path) = given("robosuite/BaxterPegInHole_demo_1.csv") else { return };
    is_mated(&analysis(&path, "demos/robosuite/baxter_peg_in_hole.binding.yaml"));
}

const YUMI: &str = "demos/bindings/desk_yumi.binding.yaml";

/// Three pegs go from hand to hand.
#[test]
fn a_peg_that_goes_from_gripper_to_gripper_is_passed() {
    for log in ["S4_T1", "S4_T4", "S4_T5", "S2_T3", "S3_T6"] {
        let Some(path) = given(&format!("desk_yumi/{log}.csv")) else { return };
        let analysis = analysis(&path, YUMI);
        let both = listed(track(&analysis, "both"), "relabeled");
        assert_eq!(of(&both, &["Pass"]).len(), 3, "{log}: {both:?}");
    }
}

/// In this recording nothing fails: who gives carries and passes, who takes carries on.
#[test]
fn each_transfer_is_a_task_of_either_arm() {
    let Some(path) = given("desk_yumi/S3_T6.csv") else { return };
    let analysis = analysis(&path, YUMI);
    let names = |names: &[&str]| ("pick_and_place".to_string(), names.iter().map(|name| (*name).to_string()).collect());
    let gives = names(&["Move", "Approach", "Grasp", "Translate", "Pass", "Release"]);
    let takes = names(&["Move", "Approach", "Pass", "Grasp", "Translate", "Release"]);
    assert_eq!(printed(&analysis, "right"), [gives.clone(), gives.clone(), gives]);
    assert_eq!(printed(&analysis, "left"), [takes.clone(), takes.clone(), takes]);
}

/// The left gripper closes in vain before it picks up the first peg, and three times more for the third one.
#[test]
fn failed_grasps_of_a_gripper_are_repeated_grasps() {
    let Some(path) = given("desk_yumi/S2_T1.csv") else { return };
    let analysis = analysis(&path, YUMI);
    let left = listed(track(&analysis, "left"), "segments");
    assert_eq!(of(&left, &["Grasp"]).len(), 6, "{left:?}");
}

/// The arm that holds the vegetable is the main one while the other one peels, which is label 3 of the recording.
#[test]
fn the_holding_arm_is_the_main_grasp_while_the_other_peels() {
    let Some(path) = given("icsc_hmm/peeling_0.csv") else { return };
    let analysis = analysis(&path, "demos/bindings/icsc_peeling.binding.yaml");
    let both = listed(track(&analysis, "both"), "segments");
    assert!(!both.is_empty() && of(&both, &["MainGrasp(left)"]).len() == both.len(), "{both:?}");
    let text = std::fs::read_to_string(&path).unwrap();
    let labels: Vec<&str> = text.lines().skip(1).map(|row| row.rsplit(',').next().unwrap()).collect();
    let contact = |row: usize| {
        let time = row as f64 / 100.0;
        both.iter().any(|(_, from, to)| (*from..*to).contains(&time))
    };
    let right = labels.iter().enumerate().filter(|(row, label)| contact(*row) == (**label == "3")).count();
    let share = right as f64 / labels.len() as f64;
    assert!(share >= 0.94, "{share}");
}

/// The analysis of a recording whose hands are exchanged: the same, with the hands exchanged.
#[test]
fn a_hand_over_to_the_other_side_is_reported_with_the_hands_exchanged() {
    let (log, binding) = SHIPPED.iter().find(|(log, _)| log.contains("handover")).unwrap();
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(root.join(format!("demos/{binding}.binding.yaml"))).unwrap();
    let exchanged = text.replace("  right.", "  other.").replace("  left.", "  right.").replace("  other.", "  left.");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("exchanged.binding.yaml");
    std::fs::write(&path, exchanged).unwrap();
    let found = analysis(&format!("demos/{log}"), path.to_str().unwrap());
    let plain = shipped(log);
    for (one, other) in [("left", "right"), ("right", "left"), ("both", "both")] {
        for list in ["segments", "relabeled", "tasks"] {
            let exchange =
                |text: String| text.replace("(left)", "(?)").replace("(right)", "(left)").replace("(?)", "(right)");
            let exchanged = exchange(track(&found, other)[list].to_string());
            assert_eq!(track(&plain, one)[list].to_string(), exchanged, "{one} {list}");
        }
    }
}

/// Segmental F1 at 50 % overlap of the seven surgemes, and of five of which two are two each (docs/measurements/recordings.md).
#[test]
fn surgemes_are_reported_by_a_rule_set_of_their_own() {
    let logs: Vec<String> = ["S2_T1", "S2_T3", "S3_T6", "S4_T1", "S4_T4", "S4_T5"]
        .iter()
        .filter_map(|log| given(&format!("desk_yumi/{log}.csv")))
        .collect();
    let Some(folder) = logs.first().and_then(|log| std::path::Path::new(log).parent()) else { return };
    let folder = folder.to_str().unwrap();
    let seven = "S1=Approach,S2=Grasp,S3=Lift,S4=Transfer,S5=Exchange,S6=Bring,S7=Place";
    let five = "S1=Approach,S2=Grasp,S3=Lift|Transfer,S4=Lift|Transfer,S5=Exchange,S6=Bring|Place,S7=Bring|Place";
    for (map, least) in [(seven, 0.80), (five, 0.79)] {
        let mut args = vec!["score"];
        args.extend(logs.iter().map(String::as_str));
        args.extend(["--binding", YUMI, "--rules", "examples/desk_surgemes.rules", "--labels", folder]);
        args.extend(["--track", "both", "--map", map, "--format", "json"]);
        let score = json(&args);
        let found = score["results"][0]["all"]["f1"]["50"].as_f64().unwrap();
        assert!(found >= least, "{map}: {found}");
    }
}
