//! The robot's recording: the columns of the operator's, measured without noise, and the joints of each limb.
//!
//! ```text
//! <hand>.joint.<joint>.position      rad or m
//! <hand>.joint.<joint>.velocity      rad/s or m/s
//! <hand>.joint.<joint>.effort        N m or N, of the motor
//! ```
//!
//! Joints have the names of the robot's joint states. The palm of a hand without an arm has a pose and no joints.

use crate::model::robot::Robot;
use crate::simulation::observer::{Observer, Step};
use crate::simulation::trace::Limb;
use nalgebra::{Isometry3, Vector3};
use teachtree_base::hands::Side;
use teachtree_base::log_channel::columns;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::scene::{Role, Scene};
use teachtree_base::units::Dimension;
use teachtree_description::tree::JointKind;
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
    /// Returns the recorder of limbs in a scene before any step.
    pub(crate) fn new(limbs: &[Limb], scene: &Scene, seen: &Observation) -> Self {
        let bodies: Vec<_> = scene.bodies.iter().collect();
        let mut names = columns(&recorded(scene, seen, &MeasurementSpec::default()));
        let objects: Vec<usize> = (0..bodies.len()).filter(|&body| bodies[body].1.role == Role::Object).collect();
        for limb in limbs {
            names.extend(joint_columns(limb.side, &limb.robot));
        }
        Self { columns: vec![Vec::new(); names.len()], names, objects, rows: 0 }
    }

    fn record(&mut self, step: &Step<'_>) {
        let seen = step.seen;
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
        for hand in step.hands {
            let executor = &hand.executor;
            for dof in 0..executor.motion.q.len() {
                row.extend([executor.motion.q[dof], executor.motion.rates[dof], executor.torques()[dof]]);
            }
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

/// Returns the columns of a limb's joints, with their dimensions.
fn joint_columns(side: Side, robot: &Robot) -> Vec<(String, Dimension)> {
    let slides = |dof: usize| {
        let mut joints = robot.tree.links.iter().filter_map(|link| link.joint.as_ref());
        joints.any(|joint| joint.dof == dof && joint.kind == JointKind::Prismatic)
    };
    let of = |(dof, name): (usize, &str)| {
        let [position, velocity, effort] = if slides(dof) {
            [Dimension::LENGTH, Dimension::SPEED, Dimension::FORCE]
        } else {
            [Dimension::ANGLE, Dimension::ANGULAR_SPEED, Dimension::TORQUE]
        };
        let parts = [("position", position), ("velocity", velocity), ("effort", effort)];
        parts.map(|(part, dimension)| (format!("{side}.joint.{name}.{part}"), dimension))
    };
    let names = robot.tree.dofs.iter().map(|dof| robot.controller_name(&dof.name));
    names.enumerate().flat_map(of).collect()
}

impl Observer for Recorder {
    fn observe(&mut self, step: &Step<'_>) {
        if step.in_group.is_multiple_of(RECORDED) {
            self.record(step);
        }
    }
}
