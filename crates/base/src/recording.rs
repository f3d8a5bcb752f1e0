//! A recorded demonstration: a table of named channels on one time base. `world` creates recordings, `logs` reads and writes them.

use super::field_names::FieldNames;
use super::scene::Scene;
use super::units::Dimension;
use indexmap::IndexMap;

/// A recording: one row per sample.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// Time of each row, s, strictly increasing.
    pub time: Vec<f64>,
    /// Columns by canonical name, component included (`right.thumb.force.x`), each as long as `time`, in SI.
    /// A value that was not measured is NaN until `frames` bridges or removes it.
    pub columns: IndexMap<String, Column>,
    /// Ground truth by name (`right.label`, `both.label`, `right.task`), one text per row, empty where unknown; rules never read it.
    pub labels: IndexMap<String, Vec<String>>,
    /// The bodies and hands.
    pub scene: Scene,
    /// Named instants of the ground truth (contact made and lost, phases of the operator); rules never read them.
    pub events: Vec<Event>,
    /// How the log spells its channels, for messages.
    pub spelling: FieldNames,
}

/// One column.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// The dimension of the samples.
    pub dimension: Dimension,
    /// The samples, SI.
    pub values: Vec<f64>,
}

/// A named instant of the ground truth.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Event {
    /// Time, s.
    pub time_s: f64,
    /// Kind of the event, a past participle: `contact_made`, `contact_lost`, `phase_started`.
    pub kind: String,
    /// Subjects of the event: `right.thumb`, `right_cube`, `base`, or the name of the phase.
    pub subjects: Vec<String>,
}
