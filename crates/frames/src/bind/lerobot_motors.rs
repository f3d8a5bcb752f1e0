//! Converts the numbers that LeRobot logs for a motor into degrees of its joint, by a linear form from the calibration file.
//!
//! `_normalize` in `lerobot/motors/motors_bus.py` is the definition: percent are those of the range in the calibration file, degrees count from the middle of
//! that range, and only percent are turned by `drive_mode`.

use super::LinearForm;
use indexmap::IndexMap;
use serde::Deserialize;
use teachtree_base::error::InputError;
use teachtree_base::yaml;

/// Degrees of a tick: LeRobot divides a turn by the largest tick.
const TICK: f64 = 360.0 / 4095.0;

/// What the numbers of the motors of an arm mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MotorNorm {
    /// Degrees from the middle of the range; the gripper 0 to 100. LeRobot's default.
    #[default]
    Degrees,
    /// −100 to 100 of the range; the gripper 0 to 100. LeRobot's `use_degrees=false`.
    Percent,
    /// Ticks of the encoder, 0 to 4095.
    Ticks,
}

/// A motor with the joint that it turns.
#[derive(Debug)]
pub struct Motor {
    /// The joint, and the motor in a calibration file.
    pub joint: &'static str,
    /// Its range as published, degrees of the joint.
    range: [f64; 2],
    /// Whether it is logged as 0 to 100, and 0 is the lower end of its range.
    is_gripper: bool,
}

/// A motor in a calibration file of LeRobot; other keys do not count.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct MotorCalibration {
    /// 1 if the joint turns against its motor.
    drive_mode: u8,
    /// Ticks at the ends of the range.
    range_min: u16,
    /// See `range_min`.
    range_max: u16,
}

impl MotorCalibration {
    fn is_reversed(self) -> bool {
        self.drive_mode != 0
    }

    /// Degrees between the ends.
    fn travel(self) -> f64 {
        f64::from(self.range_max - self.range_min) * TICK
    }
}

/// The calibration of an arm, by motor.
pub type Calibration = IndexMap<String, MotorCalibration>;

/// Reads the text of a calibration file of LeRobot; `name` is its name in messages.
///
/// # Errors
/// The text is not a calibration, or a range has no extent.
pub fn parse(text: &str, name: &str) -> Result<Calibration, InputError> {
    let calibration: Calibration = yaml::read(text, name).map_err(|error| {
        error.help("expected a calibration file of LeRobot: `drive_mode`, `range_min` and `range_max` of each motor")
    })?;
    for (motor, found) in &calibration {
        if found.range_min >= found.range_max || found.range_max > 4095 {
            let message = format!(
                "`{motor}` has the range {} to {}, expected two ticks in order, up to 4095",
                found.range_min, found.range_max
            );
            return Err(InputError::new(yaml::place(text, name, &[motor, "range_min"]), message));
        }
    }
    Ok(calibration)
}

impl Motor {
    /// A motor of the arm.
    pub const fn of_arm(joint: &'static str, range: [f64; 2]) -> Self {
        Self { joint, range, is_gripper: false }
    }

    /// The motor of the gripper.
    pub const fn of_gripper(joint: &'static str, range: [f64; 2]) -> Self {
        Self { joint, range, is_gripper: true }
    }

    /// The form that makes degrees of its numbers; without a calibration, percent are those of the published range.
    ///
    /// # Errors
    /// Ticks without a calibration.
    pub fn degrees(&self, norm: MotorNorm, calibration: Option<MotorCalibration>) -> Result<LinearForm, &'static str> {
        let [low, high] = self.range;
        let travel = calibration.map_or(high - low, MotorCalibration::travel);
        let reversed = calibration.is_some_and(MotorCalibration::is_reversed);
        let middle = if calibration.is_some() { 0.0 } else { f64::midpoint(low, high) };
        let form = |scale: f64, offset: f64| LinearForm { scale, offset };
        match (norm, calibration) {
            (MotorNorm::Ticks, None) => Err("`norm: ticks` needs the `calibration` of the arm, a file of LeRobot"),
            (MotorNorm::Ticks, Some(found)) => {
                let [first, last] = [found.range_min, found.range_max].map(f64::from);
                let sign = if reversed { -1.0 } else { 1.0 };
                let (zero, at_zero) = match (self.is_gripper, reversed) {
                    (false, _) => (f64::midpoint(first, last), 0.0),
                    (true, false) => (first, low),
                    (true, true) => (last, low),
                };
                Ok(form(sign * TICK, at_zero - sign * TICK * zero))
            }
            _ if self.is_gripper => Ok(form(travel / 100.0, low)),
            (MotorNorm::Percent, _) => Ok(form(travel / 200.0, middle)),
            (MotorNorm::Degrees, _) => Ok(form(if reversed { -1.0 } else { 1.0 }, 0.0)),
        }
    }
}
