//! Recordings that may not be committed: their tests run when `TEACHTREE_DATA` names the folder that holds them, and say so when it does not.

use super::{analysis, json, near, of, raw, segments, tasks, turns_with_the_latch};
use serde_json::Value;
use std::io::Write as _;
use std::path::Path;

/// The path of a recording, if the data is given.
pub(super) fn given(log: &str) -> Option<String> {
    let Some(folder) = std::env::var_os("TEACHTREE_DATA") else {
        // Not by `println!`: that is shown for failed tests only.
        let _ = writeln!(std::io::stderr(), "skipped: set TEACHTREE_DATA to the folder that holds `{log}`");
        return None;
    };
    let path = Path::new(&folder).join(log);
    assert!(path.exists(), "TEACHTREE_DATA has no {}", path.display());
    path.to_str().map(str::to_string)
}

const WIPING: &str = "demos/bindings/icsc_wiping.binding.yaml";
const SNAP: &str = "demos/bindings/hiro_snap.binding.yaml";

#[test]
fn wiping_is_approach_trace_move() {
    for log in ["wiping_rim_2", "wiping_circular_0"] {
        let Some(path) = given(&format!("icsc_hmm/{log}.csv")) else { return };
        let labels = path.replace(".csv", "_segments.csv");
        // The last 70 ms of one recording are labeled as the beginning of another pass.
        let map = "1=Approach|Move,2=Trace|Slide,3=Approach|Move";
        let score = json(&[
            "score",
            &path,
            "--binding",
            WIPING,
            "--labels",
            &labels,
            "--track",
            "right",
            "--map",
            map,
            "--format",
            "json",
        ]);
        assert_eq!(score["results"][0]["all"]["f1"]["50"], 1.0, "{log}: {}", score["results"][0]["all"]);
    }
}

#[test]
fn a_stuck_wrist_sensor_is_reported_and_makes_no_contact() {
    for log in ["wiping_rim_4", "wiping_fender_1"] {
        let Some(path) = given(&format!("icsc_hmm/{log}.csv")) else { return };
        let analysis = analysis(&path, WIPING);
        let dead = |issue: &&Value| issue["kind"] == "stuck_sensor" && issue["channel"] == "right.palm.force";
        assert_eq!(analysis["issues"].as_array().unwrap().iter().filter(dead).count(), 1, "{log}");
        assert!(raw(&analysis).iter().all(|(name, ..)| name == "Move"), "{log}: {:?}", raw(&analysis));
    }
}

/// Start of the alignment, which is the first contact, from the state files, s; whether the part goes in.
#[test]
fn a_snap_assembly_ends_its_approach_at_the_first_contact() {
    let trials = [
        ("S-02", 7.08, true),
        ("S-05", 7.065, true),
        ("S-10", 7.065, true),
        ("S-30", 5.205, true),
        ("ERROR-02", 3.6, false),
    ];
    for (trial, contact, inserted) in trials {
        let Some(path) = given(&format!("hiro_snap/{trial}")) else { return };
        let analysis = analysis(&path, SNAP);
        let raw = raw(&analysis);
        near(of(&raw, &["Approach"])[0].2, contact, 0.15);
        assert_eq!(!of(&raw, &["Insert"]).is_empty(), inserted, "{trial}: {raw:?}");
        assert_eq!(tasks(&analysis).contains(&"peg_in_hole".to_string()), inserted, "{trial}");
    }
}

#[test]
fn a_failed_assembly_is_not_a_peg_in_hole() {
    for trial in ["ERROR-02", "ERROR-05"] {
        let Some(path) = given(&format!("hiro_snap/{trial}")) else { return };
        let analysis = analysis(&path, SNAP);
        assert!(!tasks(&analysis).contains(&"peg_in_hole".to_string()), "{trial}");
        // These trials have no positions: that is said.
        let lacks = |issue: &Value| issue["kind"] == "missing_channel" && issue["channel"] == "male.position";
        assert!(analysis["issues"].as_array().unwrap().iter().any(lacks), "{trial}");
    }
}

#[test]
fn every_latch_is_turned() {
    for door in 0..4 {
        let Some(path) = given(&format!("dapg_door/door_0{door}.csv")) else { return };
        turns_with_the_latch(&path, "demos/bindings/dapg_door.binding.yaml");
    }
}

#[test]
fn each_reach_for_the_pillow_is_a_grasp_and_a_release() {
    let Some(path) = given("dfki_hand/recording.tsv") else { return };
    let analysis = analysis(&path, "demos/bindings/dfki_hand.binding.yaml");
    let segments = segments(&analysis);
    assert!(of(&segments, &["Release"]).len() >= 15, "{segments:?}");
    assert!(of(&segments, &["Grasp", "Translate"]).len() >= 15, "{segments:?}");
}
