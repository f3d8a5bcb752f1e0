//! The quantities of a certificate: their steps and the ranges that are searched.

use crate::simulation::CellVariation;
use std::ops::RangeInclusive;
use teachtree_base::short_number::ShortNumber;

/// A quantity of a [`CellVariation`] that a certificate varies.
pub struct CellQuantity {
    /// Its name in options and outputs.
    pub name: &'static str,
    /// The unit in texts, and the number of units in an SI unit.
    pub unit: &'static str,
    units: f64,
    /// The nominal value and the step, SI.
    nominal: f64,
    step: f64,
    /// The searched range, steps from the nominal value.
    pub range: RangeInclusive<i32>,
    set: fn(&mut CellVariation, f64),
    /// Whether it is varied by default.
    pub usual: bool,
}

const MM: f64 = 1e-3;
const MS: f64 = 1e-3;
const DEG: f64 = std::f64::consts::PI / 180.0;

/// All quantities, in the order of outputs.
pub static QUANTITIES: [CellQuantity; 13] = [
    length("object_offset_x", 5.0 * MM, -10..=10, |cell, value| cell.object_offset[0].0 = value),
    length("object_offset_y", 5.0 * MM, -10..=10, |cell, value| cell.object_offset[1].0 = value),
    angle("object_turn", 5.0 * DEG, -9..=9, |cell, value| cell.object_turn.0 = value),
    unusual(length("pose_error_x", 0.5 * MM, -10..=10, |cell, value| cell.pose_error[0].0 = value)),
    unusual(length("pose_error_y", 0.5 * MM, -10..=10, |cell, value| cell.pose_error[1].0 = value)),
    unusual(length("pose_error_z", 0.5 * MM, -10..=10, |cell, value| cell.pose_error[2].0 = value)),
    length("pose_noise", 0.25 * MM, 0..=12, |cell, value| cell.pose_noise.0 = value),
    angle("rotation_noise", 0.25 * DEG, 0..=12, |cell, value| cell.rotation_noise.0 = value),
    time("pose_delay", 10.0 * MS, 0..=20, |cell, value| cell.pose_delay.0 = value),
    factor("friction", 0.05, -14..=10, |cell, value| cell.friction = value),
    factor("mass", 0.1, -5..=10, |cell, value| cell.mass = value),
    time("motor_delay", MS, 0..=20, |cell, value| cell.motor_delay.0 = value),
    factor("contact_stiffness", 0.1, -8..=20, |cell, value| cell.contact_stiffness = value),
];

/// The same quantity, varied only if it is named.
const fn unusual(quantity: CellQuantity) -> CellQuantity {
    CellQuantity { usual: false, ..quantity }
}

const fn length(
    name: &'static str,
    step: f64,
    range: RangeInclusive<i32>,
    set: fn(&mut CellVariation, f64),
) -> CellQuantity {
    CellQuantity { name, unit: "mm", units: 1.0 / MM, nominal: 0.0, step, range, set, usual: true }
}

const fn angle(
    name: &'static str,
    step: f64,
    range: RangeInclusive<i32>,
    set: fn(&mut CellVariation, f64),
) -> CellQuantity {
    CellQuantity { name, unit: "deg", units: 1.0 / DEG, nominal: 0.0, step, range, set, usual: true }
}

const fn time(
    name: &'static str,
    step: f64,
    range: RangeInclusive<i32>,
    set: fn(&mut CellVariation, f64),
) -> CellQuantity {
    CellQuantity { name, unit: "ms", units: 1.0 / MS, nominal: 0.0, step, range, set, usual: true }
}

const fn factor(
    name: &'static str,
    step: f64,
    range: RangeInclusive<i32>,
    set: fn(&mut CellVariation, f64),
) -> CellQuantity {
    CellQuantity { name, unit: "", units: 1.0, nominal: 1.0, step, range, set, usual: true }
}

impl CellQuantity {
    /// Returns the quantity of this name.
    pub fn of_name(name: &str) -> Option<&'static Self> {
        QUANTITIES.iter().find(|quantity| quantity.name == name)
    }

    /// Returns the value a number of steps from the nominal one, SI, rounded to 10⁻⁶.
    pub fn value(&self, steps: f64) -> f64 {
        ((self.nominal + self.step * steps) * 1e6).round() / 1e6
    }

    /// Returns the step, SI, rounded to 10⁻⁶.
    pub fn step(&self) -> f64 {
        (self.step * 1e6).round() / 1e6
    }

    /// Returns the SI unit of values; empty for a factor.
    pub fn si_unit(&self) -> &'static str {
        match self.unit {
            "mm" => "m",
            "deg" => "rad",
            "ms" => "s",
            other => other,
        }
    }

    /// Sets the quantity of a cell to this number of steps from its nominal value.
    pub fn set(&self, cell: &mut CellVariation, steps: f64) {
        (self.set)(cell, self.value(steps));
    }

    /// Formats the value a number of steps from the nominal one, with its unit: `-7.5 mm`.
    pub fn format(&self, steps: f64) -> String {
        let value = (self.nominal + self.step * steps) * self.units;
        let value = ShortNumber((value * 1e3).round() / 1e3 + 0.0);
        if self.unit.is_empty() { format!("{value}") } else { format!("{value} {}", self.unit) }
    }

    /// Formats the size of a step.
    pub fn format_step(&self) -> String {
        let value = ShortNumber((self.step * self.units * 1e3).round() / 1e3);
        if self.unit.is_empty() { format!("{value}") } else { format!("{value} {}", self.unit) }
    }
}
