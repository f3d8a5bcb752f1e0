//! What an analysis learns of a whole log before it looks at a frame: its rate, bias, noise and contact level of its force sensors, and the openings at which
//! its grippers are closed.

use crate::clean::closed_grippers::ClosingLimit;
use crate::clean::held_poses;
use crate::clean::preprocess::{CleanLog, Touches};
use crate::derive::{self, Findings, fingertip_bias};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use teachtree_base::channels::ChannelSpec;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_base::json;
use teachtree_base::log_channel::LogChannel;
use teachtree_base::recording::Recording;
use teachtree_base::scene::Scene;
use teachtree_logs::issue::Issue;

/// Rates of logs of hands, frames per second.
const RATES: RangeInclusive<f64> = 1.0..=10_000.0;

/// The form of the file that a calibration is kept in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Schema {
    #[serde(rename = "teachtree.calibration/1")]
    One,
}

/// What is learned of a recording.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// The form of the file.
    schema: Schema,
    /// Frames per second.
    pub rate_hz: f64,
    /// Bias, noise and contact level of the force sensors.
    pub sensors: fingertip_bias::Sensors,
    /// The columns that were measured.
    pub columns: Vec<String>,
    /// The bodies of the scene, in order: `touches` names them by position.
    pub bodies: Vec<String>,
    /// What is known of contacts that are computed from shapes, by object.
    pub touches: BTreeMap<usize, Touches>,
    /// By channel of an opening: the opening below which the gripper is closed, m. Rows with a flag of the gripper do not need it.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub closing_limits: BTreeMap<String, f64>,
    /// By channel of a pose: the number of rows in which the recording repeats it; the rows between two changes are interpolated.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub held: BTreeMap<String, usize>,
}

impl Calibration {
    /// Learns from a recording what rules with these channels need; also what is wrong with the recording. `is_whole`: what never touches in it, never
    /// touches.
    ///
    /// # Errors
    /// The recording has no usable time base.
    pub fn of(
        recording: &Recording,
        channels: &[ChannelSpec],
        is_whole: bool,
    ) -> Result<(Self, Vec<Issue>), InputError> {
        Self::learned(recording, channels, is_whole).map_err(|error| recording.spelling.of_error(error))
    }

    fn learned(
        recording: &Recording,
        channels: &[ChannelSpec],
        is_whole: bool,
    ) -> Result<(Self, Vec<Issue>), InputError> {
        let mut measured = CleanLog::new(recording, &[], |column| derive::asks(channels, column))?;
        // A drift is known of the recording only.
        let fingertips = fingertip_bias::Fingertips { may_drift: false, ..fingertip_bias::Fingertips::of(channels) };
        let sensors = fingertip_bias::of_whole(&measured, fingertips);
        let mut issues = std::mem::take(&mut measured.issues);
        issues.extend(fingertip_bias::correct(&mut measured, &sensors));
        let mut findings = Findings::default();
        derive::derived_frames(&measured, channels, &mut findings)?;
        let mut touches = std::mem::take(&mut findings.touches);
        if is_whole {
            touches.values_mut().for_each(|it| it.pairs.retain(|pair| pair.touched));
        } else {
            touches.values_mut().for_each(|it| it.supports.clear());
        }
        let columns = measured.columns.keys().map(|name| name.to_string()).collect();
        let bodies = recording.scene.bodies.keys().cloned().collect();
        let issues = issues.into_iter().map(|issue| issue.spelled(&recording.spelling)).collect();
        let closing_limits = closing_limits(recording);
        let (schema, rate_hz, held) = (Schema::One, measured.rate_hz, measured.held.iter());
        let held = held.map(|(channel, held)| (channel.clone(), held.rows)).collect();
        Ok((Self { schema, rate_hz, sensors, columns, bodies, touches, closing_limits, held }, issues))
    }

    /// Reads a file; `file` is its name in errors.
    ///
    /// # Errors
    /// The file is not a calibration.
    pub fn parse(text: &str, file: &str) -> Result<Self, InputError> {
        let read: Self = json::read(text, file)?;
        if !RATES.contains(&read.rate_hz) {
            let [from, to] = [RATES.start(), RATES.end()];
            let message = format!("rate_hz: expected {from} to {to} frames per second, found {}", read.rate_hz);
            return Err(InputError::new(file, message));
        }
        let most = held_poses::most_rows(read.rate_hz);
        if let Some((channel, rows)) = read.held.iter().find(|(_, rows)| !(2..=most).contains(*rows)) {
            let message = format!("held.`{channel}`: expected 2 to {most} rows at {} Hz, found {rows}", read.rate_hz);
            return Err(InputError::new(file, message));
        }
        Ok(read)
    }

    /// The text of a file.
    ///
    /// # Errors
    /// A number is not finite.
    pub fn text(&self) -> Result<String, InputError> {
        let text = serde_json::to_string_pretty(self);
        text.map(|text| text + "\n").map_err(|error| InputError::new("the calibration", error.to_string()))
    }

    /// Checks that contacts that are computed from shapes were learned with the bodies of a scene.
    ///
    /// # Errors
    /// They were learned with others.
    pub fn check_bodies(&self, scene: &Scene) -> Result<(), InputError> {
        if self.touches.is_empty() || self.bodies.iter().eq(scene.bodies.keys()) {
            return Ok(());
        }
        let names = |bodies: Vec<&String>| {
            let names: Vec<String> = bodies.into_iter().map(|name| format!("`{name}`")).collect();
            names.join(", ")
        };
        let message = format!(
            "contacts were learned with the bodies {}, the scene has {}",
            names(self.bodies.iter().collect()),
            names(scene.bodies.keys().collect())
        );
        Err(InputError::new("the calibration", message).help("calibrate with a recording in the same scene"))
    }
}

/// The openings below which the grippers of a recording are closed, m, by channel of the opening.
fn closing_limits(recording: &Recording) -> BTreeMap<String, f64> {
    let of_side = |side: Side| {
        let opening = LogChannel::GripperOpening(side).to_string();
        let limit = ClosingLimit::of(&recording.columns.get(&opening)?.values)?;
        Some((opening, limit.opening_m()))
    };
    Side::BOTH.into_iter().filter_map(of_side).collect()
}
