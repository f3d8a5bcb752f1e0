//! The program on files of HDF5.

use crate::program::{all_said, complained, said, teachtree, teachtree_in};
use crate::shared::files::{fixture, folder};
use serde_json::Value;
use std::path::PathBuf;

fn file(name: &str) -> PathBuf {
    fixture("arrays").join(name)
}

#[test]
fn a_recording_is_inspected() {
    let folder = folder(&[]);
    std::fs::copy(file("robomimic.hdf5"), folder.path().join("robomimic.hdf5")).unwrap();
    let inspected = teachtree_in(folder.path(), &["inspect", "robomimic.hdf5#demo_0"]);
    insta::assert_snapshot!(said(&inspected));
    let none = teachtree_in(folder.path(), &["analyze", "robomimic.hdf5"]);
    assert_eq!(none.status.code(), Some(2), "{}", all_said(&none));
    insta::assert_snapshot!(complained(&none));
}

/// The states alone give the segments that the contacts of the same recording give.
#[test]
fn a_recording_of_robosuite_is_analyzed_as_it_is() {
    let segments = |log: &str, binding: &str| -> Vec<(String, f64)> {
        let binding = format!("demos/robosuite/{binding}.binding.yaml");
        let analyzed =
            teachtree(&["analyze", &format!("demos/robosuite/{log}"), "--binding", &binding, "--format", "json"]);
        let analysis: Value =
            serde_json::from_str(&said(&analyzed)).unwrap_or_else(|_| panic!("{}", all_said(&analyzed)));
        let segments = analysis["tracks"][0]["segments"].as_array().unwrap();
        let start = |segment: &Value| {
            (segment["primitive"].as_str().unwrap().to_string(), segment["start_s"].as_f64().unwrap())
        };
        segments.iter().map(start).filter(|(primitive, at)| *at > 13.5 && primitive != "Approach").collect()
    };
    let found = segments("lift.hdf5#1", "lift_hdf5");
    let wanted = segments("lift_demo_1.csv", "panda_lift");
    assert_eq!(wanted.len(), 2);
    for ((found, at), (wanted, wanted_at)) in found.iter().zip(&wanted) {
        assert!(found == wanted && (at - wanted_at).abs() < 0.051, "{found} at {at} s, {wanted} at {wanted_at} s");
    }
    assert_eq!(found.len(), wanted.len());
}
