//! The names of bodies.

use super::{Column, along, binding, channel, lift, still};

#[test]
fn names_of_bodies_are_without_those_of_their_sources() {
    let names =
        ["/perception/drawer/pose", "/vrpn_mocap/block/pose", "datagen_info/object_poses/cubeA.position", "obs/object"];
    let titles: Vec<String> =
        names.iter().flat_map(|name| ["x", "y", "z"].map(|axis| format!("{name}.{axis}"))).collect();
    let ways: [fn(f64) -> f64; 12] = [along, still, lift, lift, still, along, along, along, still, still, still, along];
    let columns: Vec<Column> = titles.iter().map(String::as_str).zip(ways).collect();
    let found = binding(&columns);
    for (name, body) in names.iter().zip(["drawer", "block", "cubeA", "object"]) {
        let is_bound = channel(&found, &format!("{body}.position")).is_some_and(|columns| columns.contains(name));
        assert!(is_bound, "{name}: {found}");
    }
}

#[test]
fn bodies_of_several_sources_keep_their_names() {
    let pairs = [["cube", "perception_cube"], ["tracker_block", "object_block"], ["Vicon_Cube", "optitrack_cube"]];
    for names in pairs {
        let titles: Vec<String> =
            names.iter().flat_map(|name| ["x", "y", "z"].map(|axis| format!("{name}_{axis}"))).collect();
        // The second one moves.
        let ways: [fn(f64) -> f64; 6] = [still, still, still, along, still, lift];
        let columns: Vec<Column> = titles.iter().map(String::as_str).zip(ways).collect();
        let found = binding(&columns);
        for name in names {
            assert_eq!(channel(&found, &format!("{name}.position")), Some(format!("{name}_<xyz>").as_str()), "{found}");
        }
    }
}
