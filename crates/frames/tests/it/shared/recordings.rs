//! Recordings that tests make.

use teachtree_base::recording::{Column, Event, Recording};
use teachtree_base::units::Dimension;
use teachtree_base::yaml;
use teachtree_logs::names;

/// A recording of `rows` samples at `rate` Hz in this scene; columns by canonical name, each a function of time.
pub fn recording(scene: &str, rate: f64, rows: usize, columns: &[(&str, &dyn Fn(f64) -> f64)]) -> Recording {
    let time: Vec<f64> = (0..rows).map(|row| row as f64 / rate).collect();
    let column = |(name, value): &(&str, &dyn Fn(f64) -> f64)| {
        let dimension = names::meaning(name).map_or(Dimension::NONE, |meaning| meaning.dimension);
        ((*name).to_string(), Column { dimension, values: time.iter().map(|t| value(*t)).collect() })
    };
    Recording {
        columns: columns.iter().map(column).collect(),
        scene: yaml::read(scene, "scene").unwrap(),
        time,
        ..Recording::default()
    }
}

/// A scene with a cube.
pub const CUBE: &str = "bodies: {cube: {role: object, parts: [{box: [120 mm, 120 mm, 120 mm]}]}}";

/// A canonical log with everything that one can have.
pub fn log() -> Recording {
    let mut log = recording(
        CUBE,
        100.0,
        5,
        &[
            ("right.thumb.force.x", &|time| if time > 0.02 { 1.0 / 3.0 } else { -0.0 }),
            ("cube.position.z", &|time| time * 1e-7),
            ("mystery", &|time| time),
        ],
    );
    log.labels.insert("right.label".into(), ["Move", "Move", "", "Grasp, firmly", "Größe"].map(String::from).to_vec());
    log.events.push(Event {
        time_s: 0.03,
        kind: "contact_made".into(),
        subjects: vec!["right.thumb".into(), "cube".into()],
    });
    log
}

/// A scene with a hand, a cube and a ball.
pub const CUBE_AND_BALL: &str = "
bodies:
  cube: {role: object, mass: 50 g, parts: [{box: [120 mm, 120 mm, 120 mm]}]}
  ball: {role: object, position: [0.5 m, 0 m, 40 mm], parts: [{ball: 40 mm}]}
  base: {role: support}
hands:
  right: {fingers: [thumb, index]}
";

/// A hand that stands over the cube for 0.5 s, passes to the ball while the thumb presses from 0.2 s to 0.8 s, and the cube that slides along x.
pub fn passing() -> Recording {
    let thumb = |t: f64| if t < 0.5 { 0.0 } else { 0.5 };
    recording(
        CUBE_AND_BALL,
        100.0,
        100,
        &[
            ("right.thumb.position.x", &thumb),
            ("right.thumb.position.y", &|_| 0.0),
            ("right.thumb.position.z", &|_| 0.2),
            ("right.index.position.x", &thumb),
            ("right.index.position.y", &|_| 0.02),
            ("right.index.position.z", &|_| 0.2),
            ("right.thumb.force.x", &|t| if (0.2..0.8).contains(&t) { 0.3 + 0.1 * t } else { 0.0 }),
            ("right.thumb.force.y", &|_| 0.0),
            ("right.thumb.force.z", &|t| if (0.2..0.8).contains(&t) { -0.4 } else { 0.0 }),
            ("cube.position.x", &|t| 0.05 * t * t),
            ("cube.position.y", &|_| 0.0),
            ("cube.position.z", &|_| 0.06),
            ("contact.cube.base.force.x", &|_| 0.0),
            ("contact.cube.base.force.y", &|_| 0.0),
            ("contact.cube.base.force.z", &|_| 0.49),
        ],
    )
}
