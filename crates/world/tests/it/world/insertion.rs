//! The ground truth of an insertion follows from the depth of the peg in the hole, at any speed.

use teachtree_base::recording::Recording;
use teachtree_world::{self as world, Operator};

/// Height of the rim in both scenes, and distance of the plug point below the center of the peg, m.
const RIM_M: f64 = 0.040;
const PLUG_M: f64 = 0.040;
/// Position of the hole, and maximum lateral distance of the center of an inserted peg, m.
const HOLE_M: [f64; 2] = [0.090, 0.020];
const BESIDE_M: f64 = 0.006;
/// Distance from the rim and from the resting depth within which labels are not checked, m. The hand trembles by a millimeter.
const MARGIN_M: f64 = 0.004;

fn taught(scene: &str, from: &str, to: &str, seed: u64) -> Recording {
    let (_, _, shipped) = world::shipped::texts().find(|(name, ..)| *name == scene).unwrap();
    assert!(shipped.contains(from), "{shipped}");
    let operator = Operator::read(&shipped.replace(from, to), "own.operator.yaml").unwrap();
    world::teach(&world::scene(scene).unwrap(), &operator, seed).unwrap()
}

/// Returns the primitive and the depth of the plug point below the rim (m) while the peg is over or in the hole and not released.
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

/// Slow extractions.
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
