//! What an analysis learns of a whole log before it looks at a frame: its rate, and bias, noise and contact level of its force sensors.

use crate::base::channels::ChannelSpec;
use crate::base::error::InputError;
use crate::base::recording::Recording;
use crate::stream::clean::preprocess::{CleanLog, Touches};
use crate::stream::derive::{self, Findings, tare};
use crate::stream::issue::Issue;
use std::collections::BTreeMap;

/// What is learned of a recording.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// Frames per second.
    pub rate_hz: f64,
    /// Bias, noise and contact level of the force sensors.
    pub sensors: tare::Sensors,
    /// The columns that were measured.
    pub columns: Vec<String>,
    /// What is known of contacts that are computed from shapes, by object.
    pub touches: BTreeMap<usize, Touches>,
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
        let mut measured = CleanLog::new(recording, &[], |column| derive::asks(channels, column))?;
        let samples: Vec<[usize; 2]> = tare::samples(measured.len()).collect();
        let sensors = tare::sensors(&measured, &samples);
        let mut issues = std::mem::take(&mut measured.issues);
        issues.extend(tare::correct(&mut measured, &sensors));
        let mut findings = Findings::default();
        derive::derived_frames(&measured, channels, &mut findings)?;
        let mut touches = std::mem::take(&mut findings.touches);
        if is_whole {
            touches.values_mut().for_each(|it| it.pairs.retain(|pair| pair.touched));
        }
        let columns = measured.columns.keys().map(|name| name.to_string()).collect();
        Ok((Self { rate_hz: measured.rate_hz, sensors, columns, touches }, issues))
    }
}
