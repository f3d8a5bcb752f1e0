//! The robot's recording: the columns of the operator's, measured without noise.

use crate::simulation::observer::{Observer, Step};
use nalgebra::{Isometry3, Vector3};
use teachtree_base::log_channel::columns;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::scene::{Role, Scene};
use teachtree_base::units::Dimension;
use teachtree_world::{MeasurementSpec, Observation, STEP_S, recorded};

/// Number of steps from one recorded step to the next: 250 are recorded in a second.
pub const RECORDED: usize = 4;
/// Values are rounded to this fraction of a unit.
const UNIT: f64 = 1e7;

/// Gathers rows.
pub(crate) struct Recorder {
    names: Vec<(String, Dimension)>,
    columns: Vec<Vec<f64>>,
    objects: Vec<usize>,
    rows: usize,
}

impl Recorder {
    pub(crate) fn new(scene: &Scene, seen: &Observation) -> Self {
        let bodies: Vec<_> = scene.bodies.iter().collect();
        let names = columns(&recorded(scene, seen, &MeasurementSpec::default()));
        let objects = (0..bodies.len()).filter(|&body| bodies[body].1.role == Role::Object).collect();
        Self { columns: vec![Vec::new(); names.len()], names, objects, rows: 0 }
    }

    fn record(&mut self, seen: &Observation) {
        let mut row: Vec<f64> = Vec::with_capacity(self.columns.len());
        let pose = |row: &mut Vec<f64>, pose: &Isometry3<f64>| {
            row.extend(pose.translation.vector.iter());
            row.extend([pose.rotation.w, pose.rotation.i, pose.rotation.j, pose.rotation.k]);
        };
        for hand in &seen.hands {
            for tip in &hand.tips {
                row.extend(tip.position.coords.iter());
                let force: Vector3<f64> = self.objects.iter().map(|&object| tip.force_on(object)).sum();
                row.extend(force.iter());
            }
            pose(&mut row, &hand.palm);
        }
        for &object in &self.objects {
            let body = &seen.bodies[object];
            pose(&mut row, &body.pose);
            row.extend(body.velocity.iter());
            row.extend(body.angular_velocity.iter());
        }
        for contact in &seen.contacts {
            row.extend(contact.force.iter());
            row.extend(contact.normal.iter());
        }
        for (column, value) in self.columns.iter_mut().zip(row) {
            column.push((value * UNIT).round() / UNIT + 0.0);
        }
        self.rows += 1;
    }

    pub(crate) fn finish(self, scene: &Scene) -> Recording {
        let time = (0..self.rows).map(|row| (row * RECORDED) as f64 * STEP_S).collect();
        let columns = self.names.into_iter().zip(self.columns);
        let columns = columns.map(|((name, dimension), values)| (name, Column { dimension, values }));
        Recording { time, columns: columns.collect(), scene: scene.clone(), ..Recording::default() }
    }
}

impl Observer for Recorder {
    fn observe(&mut self, step: &Step<'_>) {
        if step.in_group.is_multiple_of(RECORDED) {
            self.record(step.seen);
        }
    }
}
