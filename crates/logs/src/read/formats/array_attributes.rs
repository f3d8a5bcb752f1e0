//! The attributes of an array of HDF5 or Zarr that change its values, as netCDF and xarray write them (Climate and Forecast conventions, section 8.1): scale,
//! offset, the value of missing samples, and the unit.

use super::array_log::{ArrayValues, MissingRows};
use serde_json::Value;
use teachtree_base::error::InputError;
use teachtree_base::units::compound_of_log;

/// The attributes of an array.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct ArrayAttributes {
    /// The unit, if it is known and not that of a plain number.
    pub unit: Option<String>,
    scale: Option<f64>,
    offset: Option<f64>,
    /// The stored values of samples that were not measured.
    unmeasured: Vec<f64>,
}

impl ArrayAttributes {
    /// Reads attributes by their names; one that does not exist is null.
    pub fn of(attribute: &dyn Fn(&str) -> Value) -> Self {
        let number = |key: &str| attribute(key).as_f64().filter(|number| number.is_finite());
        let unit = ["units", "unit"].into_iter().find_map(|key| Some(attribute(key).as_str()?.trim().to_string()));
        let is_known = |unit: &String| !matches!(unit.as_str(), "" | "-" | "1") && compound_of_log(unit).is_ok();
        Self {
            unit: unit.filter(is_known),
            scale: number("scale_factor"),
            offset: number("add_offset"),
            unmeasured: ["_FillValue", "missing_value"].into_iter().filter_map(number).collect(),
        }
    }

    /// The values that the stored ones stand for.
    pub fn applied(&self, stored: Box<dyn ArrayValues>) -> Box<dyn ArrayValues> {
        if self.scale.is_none() && self.offset.is_none() && self.unmeasured.is_empty() {
            return stored;
        }
        Box::new(UnpackedValues { stored, attributes: self.clone() })
    }

    fn unpack(&self, stored: f64) -> f64 {
        if self.unmeasured.contains(&stored) {
            return f64::NAN;
        }
        stored * self.scale.unwrap_or(1.0) + self.offset.unwrap_or(0.0)
    }
}

/// The values of an array with a scale, an offset or a value for missing samples.
struct UnpackedValues {
    stored: Box<dyn ArrayValues>,
    attributes: ArrayAttributes,
}

impl ArrayValues for UnpackedValues {
    fn numbers(&self, first_row: bool) -> Result<Vec<f64>, InputError> {
        let mut numbers = self.stored.numbers(first_row)?;
        numbers.iter_mut().for_each(|number| *number = self.attributes.unpack(*number));
        Ok(numbers)
    }

    fn texts(&self) -> Result<Vec<String>, InputError> {
        self.stored.texts()
    }

    fn missing(&self) -> Option<MissingRows> {
        self.stored.missing()
    }
}
