//! Generates random recordings. Finger contacts, motions of an object and missing rows have random durations.

use crate::numbers::Random;
use std::ops::Range;
use std::sync::LazyLock;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::scene::Scene;
use teachtree_base::units::Dimension;
use teachtree_logs::read::csv::parse_scene;

/// A recording, or a part of it.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordingPart {
    seed: u64,
    /// The range of rows, which may exceed the recording.
    rows: Range<usize>,
}

impl RecordingPart {
    /// A whole recording.
    pub fn whole(seed: u64) -> Self {
        Self { seed, rows: 0..MOST_ROWS }
    }

    /// Returns shorter parts of the recording.
    pub fn shorter(&self) -> Vec<Self> {
        let (start, end) = (self.rows.start, self.rows.end.min(recording(&Self::whole(self.seed)).time.len()));
        let parts = [2, 4, 16, 64].map(|part| (end - start) / part).into_iter().filter(|less| *less > 0);
        let cut = |rows| Self { seed: self.seed, rows };
        parts.flat_map(|less| [cut(start + less..end), cut(start..end - less)]).collect()
    }
}

const RATE_HZ: f64 = 100.0;
const MOST_ROWS: usize = 500;

static SCENE: LazyLock<Scene> = LazyLock::new(|| {
    let text = "bodies:\n  cube: {role: object, mass: 40 g, position: [0 mm, 0 mm, 20 mm], parts: [{box: [40 mm, 40 mm, 40 mm]}]}\n  \
                base: {role: support, position: [0 mm, 0 mm, -10 mm], parts: [{box: [600 mm, 600 mm, 20 mm]}]}\n";
    parse_scene(text, "pairs.yaml").unwrap()
});

/// Returns the recording of a seed.
pub fn recording(cut: &RecordingPart) -> Recording {
    let mut random = Random::new(cut.seed);
    let rows = 150 + random.below(MOST_ROWS - 150);
    let mut made = Recording { scene: SCENE.clone(), ..Recording::default() };
    // In some recordings, a gap divides the rows.
    let hole = if random.chance(25) { 1.0 } else { 0.0 };
    made.time = (0..rows).map(|row| row as f64 / RATE_HZ + if row > rows / 2 { hole } else { 0.0 }).collect();
    let mut add = |name: String, dimension: Dimension, values: Vec<f64>| {
        made.columns.insert(name, Column { dimension, values });
    };
    let hands: &[&str] = if random.chance(50) { &["right"] } else { &["left", "right"] };
    let moving = telegraph(&mut random, rows, &[0.0, 0.0, 0.05, 0.3]);
    let height = telegraph(&mut random, rows, &[0.02, 0.02, 0.06]);
    let mut x = 0.0;
    let path: Vec<f64> = moving
        .iter()
        .map(|speed| {
            x += speed / RATE_HZ;
            x
        })
        .collect();
    for hand in hands {
        for (finger, side) in [("thumb", 1.0), ("index", -1.0)] {
            let touches = telegraph(&mut random, rows, &[0.0, 1.0]);
            let pressed = telegraph(&mut random, rows, &[0.2, 0.8, 2.0]);
            let near = telegraph(&mut random, rows, &[0.03, 0.04, 0.4]);
            // Sensor noise.
            let force: Vec<[f64; 3]> = (0..rows)
                .map(|row| {
                    let noise = 1e-3 * random.below(10) as f64;
                    let size = touches[row] * pressed[row];
                    [side * size + noise, noise, -0.7 * size]
                })
                .collect();
            for (at, axis) in ["x", "y", "z"].into_iter().enumerate() {
                let place = |row: usize| [path[row] + side * near[row], 0.0, height[row]][at];
                let position = (0..rows).map(place).collect();
                add(format!("{hand}.{finger}.position.{axis}"), Dimension::LENGTH, position);
                let force = force.iter().map(|force| force[at]).collect();
                add(format!("{hand}.{finger}.force.{axis}"), Dimension::FORCE, force);
            }
            add(format!("{hand}.{finger}.contact"), Dimension::NONE, touches);
        }
        add(format!("{hand}.gripper.closed"), Dimension::NONE, telegraph(&mut random, rows, &[0.0, 1.0]));
        // A flag that only some rules read and that some rows lack.
        let values: &[f64] = if random.chance(50) { &[0.0, 1.0, f64::NAN] } else { &[0.0, 1.0] };
        let flag = telegraph(&mut random, rows, values);
        // Of a body that the scene lacks.
        add(format!("{hand}.thumb.contact.ghost"), Dimension::NONE, flag.clone());
        add(format!("{hand}.lamp.on"), Dimension::NONE, flag);
    }
    add("cube.position.x".into(), Dimension::LENGTH, path);
    add("cube.position.y".into(), Dimension::LENGTH, vec![0.0; rows]);
    let stands: Vec<f64> = height.iter().map(|height| f64::from(u8::from(*height < 0.03))).collect();
    add("cube.position.z".into(), Dimension::LENGTH, height);
    for (axis, size) in [("x", 0.0), ("y", 0.0), ("z", 0.4)] {
        let force = stands.iter().map(|stands| size * stands).collect();
        add(format!("contact.cube.base.force.{axis}"), Dimension::FORCE, force);
        let normal = stands.iter().map(|stands| if size > 0.0 { *stands } else { 0.0 }).collect();
        add(format!("contact.cube.base.normal.{axis}"), Dimension::NONE, normal);
    }
    let rows = cut.rows.start.min(made.time.len())..cut.rows.end.min(made.time.len());
    made.time = made.time[rows.clone()].to_vec();
    made.columns.values_mut().for_each(|column| column.values = column.values[rows.clone()].to_vec());
    made
}

/// Returns a random sequence of the values, each for 20 ms to 800 ms.
fn telegraph(random: &mut Random, rows: usize, values: &[f64]) -> Vec<f64> {
    let mut all = Vec::with_capacity(rows);
    while all.len() < rows {
        let value = values[random.below(values.len())];
        let frames = if random.chance(40) { 2 + random.below(8) } else { 8 + random.below(72) };
        all.extend(std::iter::repeat_n(value, frames.min(rows - all.len())));
    }
    all
}
