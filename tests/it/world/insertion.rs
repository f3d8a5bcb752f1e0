//! The truth of an insertion: a peg goes in by its depth in the hole, at any speed.

use teachtree::base::recording::Recording;
use teachtree::world::{self, Operator};

/// The rim of the hole of both scenes, and how far the plug point is below the middle of its peg, m.
const RIM_M: f64 = 0.040;
const PLUG_M: f64 = 0.040;
/// Where the hole is, and how far the middle of a peg that goes in may be beside it, m.
const HOLE_M: [f64; 2] = [0.090, 0.020];
const BESIDE_M: f64 = 0.006;
/// Nothing is asked for so near to the rim and to the depth at which the peg comes to rest, m: the hand trembles by a millimeter.
const MARGIN_M: f64 = 0.004;

fn taught(scene: &str, from: &str, to: &str, seed: u64) -> Recording {
    let (_, _, shipped) = world::shipped::texts().find(|(name, ..)| *name == scene).unwrap();
    assert!(shipped.contains(from), "{shipped}");
    let operator = Operator::read(&shipped.replace(from, to), "own.operator.yaml").unwrap();
    world::teach(&world::scene(scene).unwrap(), &operator, seed).unwrap()
}

/// What the hand did while the peg was over the hole or in it and had not been let go, and how deep the plug point was below the rim, m.
fn depths(recording: &Recording) -> Vec<(&str, f64)> {
    let [x, y, z] = ["x", "y", "z"].map(|part| &recording.columns[&format!("peg.position.{part}")].values);
    let rows = recording.labels["right.label"].iter().map(String::as_str).enumerate();
    let at_the_hole = rows.filter(|(row, _)| (x[*row] - HOLE_M[0]).hypot(y[*row] - HOLE_M[1]) < BESIDE_M);
    at_the_hole
        .map(|(row, label)| (label, RIM_M - (z[row] - PLUG_M)))
        .take_while(|(label, _)| *label != "Release")
        .collect()
}

#[test]
fn a_peg_goes_in_at_any_speed() {
    for speed in [2, 4, 10, 40] {
        let recording = taught("peg_in_hole", "speed: 40 mm/s}}", &format!("speed: {speed} mm/s}}}}"), 1);
        let tasks = &recording.labels["right.task"];
        assert!(tasks.iter().any(|task| task == "peg_in_hole"), "{speed} mm/s");
        assert!(tasks.iter().all(|task| task == "peg_in_hole" || task.is_empty()), "{speed} mm/s");
        let depths = depths(&recording);
        let deepest = depths.iter().map(|(_, depth)| *depth).fold(0.0, f64::max);
        assert!(deepest > 0.03, "{speed} mm/s: {deepest} m");
        let going = |depth: f64| (MARGIN_M..deepest - MARGIN_M).contains(&depth);
        let others = depths.iter().filter(|(label, depth)| going(*depth) && *label != "Insert");
        assert_eq!(others.count(), 0, "{speed} mm/s: {depths:?}");
        assert!(depths.iter().all(|(label, depth)| *label != "Insert" || *depth > 0.0), "{speed} mm/s");
    }
}

/// It comes out as slowly.
#[test]
fn a_peg_comes_out_at_any_speed() {
    for speed in [4, 40] {
        let (from, to) = ("above: 20 mm, speed: 60 mm/s", format!("above: 20 mm, speed: {speed} mm/s"));
        let recording = taught("peg_pullout_from_hole", from, &to, 1);
        let depths = depths(&recording);
        let rests = depths[0].1;
        let going = |depth: f64| (MARGIN_M..rests - MARGIN_M).contains(&depth);
        let others = depths.iter().filter(|(label, depth)| going(*depth) && *label != "Pullout");
        assert_eq!(others.count(), 0, "{speed} mm/s: {depths:?}");
        assert!(recording.labels["right.task"].iter().any(|task| task == "peg_pullout_from_hole"), "{speed} mm/s");
    }
}
