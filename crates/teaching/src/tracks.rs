//! The displayed labels.

use serde_json::{Value, json};
use std::collections::BTreeMap;
use teachtree_session::LiveEvent;

/// Maximum number of segments and tasks of a track that are kept for display.
const MOST_SHOWN: usize = 400;

/// The appearance of a primitive.
pub(super) struct PrimitiveStyle {
    /// `#rrggbb`.
    pub(super) color: String,
    /// Whether the hand holds an object during the primitive.
    pub(super) holds: bool,
}

/// The labels that are shown.
#[derive(Default)]
pub(super) struct Tracks {
    /// Changes with each change.
    pub(super) version: u64,
    of: BTreeMap<String, TrackLabels>,
    /// Why there are no labels.
    pub(super) trouble: Option<String>,
}

#[derive(Default)]
struct TrackLabels {
    /// The primitive of the newest frame, and its start, s.
    label: Option<(String, f64)>,
    segments: Vec<(String, f64, f64)>,
    /// Task, start and end, s, and whether it may still change.
    tasks: Vec<(String, f64, f64, bool)>,
}

impl Tracks {
    /// Returns the labels as a message.
    pub(super) fn json(&self, primitives: &BTreeMap<String, PrimitiveStyle>) -> Value {
        let look = |name: &str| {
            let base = name.split('(').next().unwrap_or(name);
            primitives.get(name).or_else(|| primitives.get(base))
        };
        let color = |name: &str| look(name).map_or("#9aa4b2", |look| look.color.as_str());
        let holds = |name: &str| look(name).is_some_and(|look| look.holds);
        let tracks: Vec<Value> = self
            .of
            .iter()
            .map(|(who, track)| {
                let segments = track.segments.iter().map(|(name, start, end)| json!([name, start, end, color(name)]));
                json!({
                    "who": who,
                    "label": track.label.as_ref().map(|(name, since)| json!([name, since, color(name), holds(name)])),
                    "segments": segments.collect::<Vec<_>>(),
                    "tasks": track.tasks,
                })
            })
            .collect();
        json!({ "type": "labels", "tracks": tracks, "trouble": self.trouble })
    }

    /// Drops all labels at the beginning of a recording.
    pub(super) fn restart(&mut self) {
        *self = Self { version: self.version + 1, ..Self::default() };
    }

    /// Takes new events.
    pub(super) fn take(&mut self, event: &LiveEvent) {
        self.version += 1;
        if let Some((who, primitive, time_s)) = event.label() {
            self.of.entry(who.to_string()).or_default().label = primitive.map(|name| (name.to_string(), time_s));
        }
        if let Some(segment) = event.segment().filter(|_| !event.is_final()) {
            let track = self.of.entry(segment.track().to_string()).or_default();
            track.segments.push((segment.primitive().to_string(), segment.start_s(), segment.end_s()));
            if track.segments.len() > MOST_SHOWN {
                track.segments.remove(0);
            }
        }
        if let Some(task) = event.task() {
            let track = self.of.entry(task.track().to_string()).or_default();
            // A final task replaces a provisional one.
            track.tasks.retain(|(_, start_s, ..)| *start_s < task.start_s());
            track.tasks.push((task.name().to_string(), task.start_s(), task.end_s(), event.is_final()));
            if track.tasks.len() > MOST_SHOWN {
                track.tasks.remove(0);
            }
        }
    }
}
