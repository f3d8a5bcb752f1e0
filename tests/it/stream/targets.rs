//! The target of a hand that touches nothing, against its definition at every frame.

use super::{ask, column, recording};
use nalgebra::Point3;
use proptest::prelude::*;
use teachtree::base::geometry::{pose, surface_distance};
use teachtree::stream::frames;

const BODIES: &str = "
bodies:
  cube: {role: object, parts: [{box: [60 mm, 80 mm, 40 mm]}, {ball: 20 mm, at: [50 mm, 0 mm, 0 mm]}]}
  rod: {role: object, parts: [{cylinder: [15 mm, 120 mm]}]}
  ball: {role: object, position: [20 mm, 10 mm, 0 mm], parts: [{ball: 30 mm}]}
hands:
  right: {fingers: [thumb, index]}
";
/// Another object is the target when it is nearer by this much, m (LANGUAGE.md section 3, point 1).
const NEARER_BY: f64 = 0.010;

type Way = Box<dyn Fn(f64) -> f64>;

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_target_is_the_nearest_object_however_things_move(
        phases in prop::collection::vec(0.0..6.3_f64, 12),
        speeds in prop::collection::vec(0.5..12.0_f64, 12),
        size in 0.01..0.12_f64,
    ) {
        // A way to and fro that now and then leaps.
        let way = |at: usize| {
            let (phase, speed) = (phases[at], speeds[at]);
            move |t: f64| size * ((speed * t + phase).sin() + if (t * 7.0 + phase).fract() < 0.02 { 0.5 } else { 0.0 })
        };
        let (half, half_too) = (way(10), way(10));
        let turn = |t: f64, half: &dyn Fn(f64) -> f64| half(t) * 20.0;
        let (w, z) = (|t: f64| turn(t, &half).cos(), |t: f64| turn(t, &half_too).sin());
        let none = |_: f64| 0.0;
        let names = ["right.thumb.position", "right.index.position", "cube.position"];
        let ways: Vec<(String, Way)> = (0..9)
            .map(|at| (format!("{}.{}", names[at / 3], ["x", "y", "z"][at % 3]), Box::new(way(at)) as Way))
            .collect();
        let mut columns: Vec<(&str, &dyn Fn(f64) -> f64)> = ways.iter().map(|(name, way)| (name.as_str(), &**way)).collect();
        columns.extend([
            ("cube.rotation.w", &w as &dyn Fn(f64) -> f64), ("cube.rotation.x", &none), ("cube.rotation.y", &none), ("cube.rotation.z", &z),
        ]);
        let recording = recording(BODIES, 500.0, 1500, &columns);

        let found = frames(&recording, &[ask("target")]).unwrap();
        let value = |name: &str, row: usize| recording.columns[name].values[row];
        let vector = |name: &str, row: usize| ["x", "y", "z"].map(|axis| value(&format!("{name}.{axis}"), row));
        let mut target: Option<usize> = None;
        for row in 0..recording.time.len() {
            let distance = |(at, body): (usize, &teachtree::base::scene::Body)| {
                let world_from_body = if at == 0 {
                    pose(vector("cube.position", row), ["w", "x", "y", "z"].map(|part| value(&format!("cube.rotation.{part}"), row)))
                } else {
                    pose(body.position.map(|length| length.0), body.rotation)
                };
                let tips = ["right.thumb.position", "right.index.position"].map(|tip| Point3::from(vector(tip, row)));
                tips.map(|tip| surface_distance(body, &world_from_body.inverse_transform_point(&tip))).into_iter().fold(f64::INFINITY, f64::min)
            };
            let distances: Vec<f64> = recording.scene.bodies.values().enumerate().map(distance).collect();
            let nearest = (0..distances.len()).min_by(|a, b| distances[*a].total_cmp(&distances[*b])).unwrap();
            if target.is_none_or(|target| distances[target] - distances[nearest] >= NEARER_BY) {
                target = Some(nearest);
            }
            prop_assert_eq!(column(&found, "target", 0, 0)[row], target.unwrap() as f64, "row {}", row);
        }
    }
}
