//! The target of a hand, against its definition at every frame.

use super::{ask, column};
use crate::shared::recordings::recording;
use nalgebra::Point3;
use proptest::prelude::*;
use teachtree_base::geometry::{pose, surface_distance};
use teachtree_base::scene::Body;
use teachtree_frames::frames;

const BODIES: &str = "
bodies:
  cube: {role: object, parts: [{box: [60 mm, 80 mm, 40 mm]}, {ball: 20 mm, at: [50 mm, 0 mm, 0 mm]}]}
  rod: {role: object, parts: [{cylinder: [15 mm, 120 mm]}]}
  ball: {role: object, position: [20 mm, 10 mm, 0 mm], parts: [{ball: 30 mm}]}
hands:
  right: {fingers: [thumb, index]}
";
/// Another object is the target when it is nearer by this much, m (docs/sources.md, A11).
const NEARER_BY: f64 = 0.010;

type Trajectory = Box<dyn Fn(f64) -> f64>;

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
        let ways: Vec<(String, Trajectory)> = (0..9)
            .map(|at| (format!("{}.{}", names[at / 3], ["x", "y", "z"][at % 3]), Box::new(way(at)) as Trajectory))
            .collect();
        let touches = |t: f64| if (t * speeds[11] / 4.0 + phases[11]).sin() > 0.6 { 1.0 } else { 0.0 };
        let mut columns: Vec<(&str, &dyn Fn(f64) -> f64)> =
            ways.iter().map(|(name, way)| (name.as_str(), &**way)).collect();
        columns.extend([
            ("cube.rotation.w", &w as &dyn Fn(f64) -> f64),
            ("cube.rotation.x", &none),
            ("cube.rotation.y", &none),
            ("cube.rotation.z", &z),
            ("right.thumb.contact", &touches),
        ]);
        let mut recording = recording(BODIES, 500.0, 1500, &columns);
        // A gap, after which everything begins anew.
        let gap = 600..700;
        recording.time.drain(gap.clone());
        recording.columns.values_mut().for_each(|column| drop(column.values.drain(gap.clone())));

        let found = frames(&recording, &[ask("target")]).unwrap();
        let value = |name: &str, row: usize| recording.columns[name].values[row];
        let vector = |name: &str, row: usize| ["x", "y", "z"].map(|axis| value(&format!("{name}.{axis}"), row));
        let (mut target, mut touched): (Option<usize>, bool) = (None, false);
        prop_assert_eq!(&found.stretches, &[0..600, 600..1400]);
        for row in 0..recording.time.len() {
            if row == gap.start {
                (target, touched) = (None, false);
            }
            let distance = |(at, body): (usize, &Body), tips: &[&str]| {
                let world_from_body = if at == 0 {
                    let part = |part: &str| value(&format!("cube.rotation.{part}"), row);
                    pose(vector("cube.position", row), ["w", "x", "y", "z"].map(part))
                } else {
                    pose(body.position.map(|length| length.0), body.rotation)
                };
                let tip = |tip: &&str| {
                    let place = Point3::from(vector(&format!("right.{tip}.position"), row));
                    surface_distance(body, &world_from_body.inverse_transform_point(&place))
                };
                tips.iter().map(tip).fold(f64::INFINITY, f64::min)
            };
            let distances = |tips: &[&str]| -> Vec<f64> {
                recording.scene.bodies.values().enumerate().map(|body| distance(body, tips)).collect()
            };
            let nearest = |distances: &[f64]| {
                (0..distances.len()).min_by(|a, b| distances[*a].total_cmp(&distances[*b])).unwrap()
            };
            let touches = value("right.thumb.contact", row) == 1.0;
            match target {
                Some(_) if touches && touched => {}
                // What the finger that touches is nearest to.
                _ if touches => target = Some(nearest(&distances(&["thumb"]))),
                known => {
                    let distances = distances(&["thumb", "index"]);
                    let least = nearest(&distances);
                    let stays = |target: usize| distances[target] - distances[least] < NEARER_BY;
                    target = known.filter(|target| stays(*target)).or(Some(least));
                }
            }
            touched = touches;
            prop_assert_eq!(column(&found, "target", 0, 0)[row], target.unwrap() as f64, "row {}", row);
        }
    }
}
