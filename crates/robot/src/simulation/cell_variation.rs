//! What a real cell varies against its scene: the places of objects, their measured poses, friction, mass, motors and fingertips.

use crate::planning::schedule::at_task;
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;
use teachtree_base::error::InputError;
use teachtree_base::pose::unit;
use teachtree_base::quantity::{Angle, Length, Numbers, Quantity, Time};
use teachtree_base::scene::{Body, Scene};
use teachtree_base::short_number::ShortNumber;
use teachtree_base::yaml;
use teachtree_command::Task;
use teachtree_description::shape::solids;
use teachtree_world::{Fingertips, STEP_S, TouchLaw};

/// The maximum penetration of a displaced object into another body, m, if the scene itself has less. The contacts of the simulation are as soft.
const PENETRATES_M: f64 = 1e-3;

/// The differences of a real cell from its scene. The default is no difference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CellVariation {
    /// Displacement of each object of the tasks along x and y of the reference frame; at most 0.5 m each. Measured poses follow it.
    pub object_offset: [Length; 2],
    /// Rotation of each object of the tasks about the vertical axis through its origin, counterclockwise from above; at most 180 deg. Measured poses follow it.
    pub object_turn: Angle,
    /// Constant error of all measured positions, reference frame; at most 0.1 m along each axis.
    pub pose_error: [Length; 3],
    /// Noise of measured positions: standard deviation along each axis, 0 to 50 mm, with a correlation time of 20 ms.
    pub pose_noise: Length,
    /// Noise of measured orientations: standard deviation about each axis, 0 to 30 deg, with a correlation time of 20 ms.
    pub rotation_noise: Angle,
    /// Delay of measured poses, 0 to 1 s, in whole milliseconds.
    pub pose_delay: Time,
    /// Factor of all coefficients of friction, those of fingertips and those of bodies; 0 to 5.
    pub friction: f64,
    /// Factor of the masses of the objects of the tasks; 0.1 to 10.
    pub mass: f64,
    /// Delay of the torques of all motors, 0 to 100 ms, in whole milliseconds.
    pub motor_delay: Time,
    /// Factor of the contact stiffness of fingertips, at the same damping ratio; 0.1 to 5.
    pub contact_stiffness: f64,
    /// Seed of the noise.
    pub seed: u64,
}

impl Default for CellVariation {
    fn default() -> Self {
        let none = Quantity(0.0);
        Self {
            object_offset: [none; 2],
            object_turn: Quantity(0.0),
            pose_error: [none; 3],
            pose_noise: none,
            rotation_noise: Quantity(0.0),
            pose_delay: Quantity(0.0),
            friction: 1.0,
            mass: 1.0,
            motor_delay: Quantity(0.0),
            contact_stiffness: 1.0,
            seed: 0,
        }
    }
}

/// The schema of files with a variation.
pub fn schema() -> schemars::Schema {
    schemars::schema_for!(CellVariation)
}

impl CellVariation {
    /// Reads a variation from YAML; `file` is its name in errors.
    ///
    /// # Errors
    /// Unknown keys, wrong units, values out of range; at `file:line:column`.
    pub fn read(text: &str, file: &str) -> Result<Self, InputError> {
        let read: Self = yaml::read(text, file)?;
        let Err((key, message)) = read.check() else { return Ok(read) };
        Err(InputError::new(yaml::place(text, file, &[key]), format!("{key}: {message}")))
    }

    /// Checks the ranges; returns the first key with a value out of range, and a message.
    fn check(&self) -> Result<(), (&'static str, String)> {
        let half_turn = std::f64::consts::PI;
        within("object_offset", &self.object_offset, -0.5..=0.5)?;
        within("object_turn", &self.object_turn, -half_turn..=half_turn)?;
        within("pose_error", &self.pose_error, -0.1..=0.1)?;
        within("pose_noise", &self.pose_noise, 0.0..=0.05)?;
        within("rotation_noise", &self.rotation_noise, 0.0..=half_turn / 6.0)?;
        within("pose_delay", &self.pose_delay, 0.0..=1.0)?;
        within("friction", &self.friction, 0.0..=5.0)?;
        within("mass", &self.mass, 0.1..=10.0)?;
        within("motor_delay", &self.motor_delay, 0.0..=0.1)?;
        within("contact_stiffness", &self.contact_stiffness, 0.1..=5.0)
    }

    /// Returns the scene with displaced objects, and with the masses and coefficients of friction of this variation.
    ///
    /// # Errors
    /// A task whose object is displaced into another body.
    pub fn scene(&self, scene: &Scene, tasks: &[Task]) -> Result<Scene, InputError> {
        let mut varied = scene.clone();
        varied.bodies.values_mut().for_each(|body| body.friction *= self.friction);
        let mut handled: Vec<(usize, &str)> =
            tasks.iter().enumerate().map(|(number, task)| (number, task.object.as_str())).collect();
        handled.sort_by_key(|(number, object)| (*object, *number));
        handled.dedup_by_key(|(_, object)| *object);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.object_turn.0);
        for (_, object) in &handled {
            let Some(body) = varied.bodies.get_mut(*object) else { continue };
            for (at, offset) in body.position.iter_mut().zip(self.object_offset) {
                at.0 += offset.0;
            }
            if self.object_turn.0 != 0.0 {
                let turned = turn * unit(body.rotation);
                body.rotation = [turned.w, turned.i, turned.j, turned.k];
            }
            body.mass = body.mass.map(|mass| Quantity(mass.0 * self.mass));
        }
        if self.object_offset.iter().any(|offset| offset.0 != 0.0) || self.object_turn.0 != 0.0 {
            for (number, object) in handled {
                if let Some((other, depth)) = deeper(scene, &varied, object) {
                    let message = format!(
                        "the varied place of `{object}` is {} mm inside `{other}`",
                        ShortNumber((depth * 1e4).round() / 10.0)
                    );
                    return Err(at_task(tasks, number, message)
                        .help("give a smaller `object_offset` or `object_turn` in the variation"));
                }
            }
        }
        Ok(varied)
    }

    /// Returns the fingertips with the friction and stiffness of this variation.
    pub(super) fn fingertips(&self) -> Fingertips {
        let law = TouchLaw::default();
        let (stiffer, damped) = (self.contact_stiffness, self.contact_stiffness.sqrt());
        let touch = TouchLaw {
            stiffness: law.stiffness * stiffer,
            damping: law.damping * damped,
            tangential_stiffness: law.tangential_stiffness * stiffer,
            tangential_damping: law.tangential_damping * damped,
            static_friction: law.static_friction * self.friction,
            dynamic_friction: law.dynamic_friction * self.friction,
            ..law
        };
        Fingertips { touch, ..Fingertips::default() }
    }

    /// Returns the delay of the motors as a number of steps.
    pub(super) fn motor_delay_steps(&self) -> usize {
        steps(self.motor_delay)
    }

    /// Returns the delay of the measured poses as a number of steps.
    pub(super) fn pose_delay_steps(&self) -> usize {
        steps(self.pose_delay)
    }
}

fn steps(time: Time) -> usize {
    (time.0 / STEP_S).round().max(0.0) as usize
}

/// Checks that all numbers of a value are in a range, SI.
fn within<T: Numbers>(key: &'static str, value: &T, range: RangeInclusive<f64>) -> Result<(), (&'static str, String)> {
    let unit = T::DIMENSION.si_unit();
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    let [low, high] = [*range.start(), *range.end()].map(ShortNumber);
    match value.numbers().find(|number| !range.contains(number)) {
        Some(found) => Err((key, format!("found {}{unit}, expected {low} to {high}{unit}", ShortNumber(found)))),
        None => Ok(()),
    }
}

/// Returns the body into which the variation puts an object, and the depth, m; `None` if the object is as clear of all bodies as in the scene.
fn deeper<'s>(scene: &'s Scene, varied: &Scene, object: &str) -> Option<(&'s str, f64)> {
    let gap = |scene: &Scene, other: &str| -> f64 {
        let placed = |body: &Body| {
            let pose = body.pose();
            solids(body).into_iter().map(move |solid| solid.moved(&pose)).collect::<Vec<_>>()
        };
        let [own, others] = [object, other].map(|name| scene.bodies.get(name).map(placed).unwrap_or_default());
        own.iter().flat_map(|one| others.iter().map(|other| one.gap(other))).fold(f64::INFINITY, f64::min)
    };
    scene.bodies.keys().filter(|other| *other != object).find_map(|other| {
        let now = gap(varied, other);
        (now < -PENETRATES_M && now < gap(scene, other) - PENETRATES_M).then_some((other.as_str(), -now))
    })
}
