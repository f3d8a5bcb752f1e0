//! How often the labels of newest frames are right that a live log gives with some confidence: on recordings, and on simulated operators.

use crate::confidence::demonstrations;
use crate::kind::Kind;
use std::collections::BTreeMap;
use std::path::Path;
use teachtree::{Calibration, Column, Live, LiveEvent, Log, Rules, Scene, TrackId};
use teachtree_base::recording::Recording;
use teachtree_measure::confidence::ConfidenceSample;

/// What is held against the label of a frame: the segments of the whole log as the trees returned them, and after relabeling.
pub const AGAINST: [&str; 2] = ["segments before relabeling", "final segments"];

/// A label that a frame had while it was the newest one.
struct LiveLabel {
    who: TrackId,
    at_s: f64,
    primitive: Option<String>,
    confidence: f64,
}

/// The labels of a recording, each held against [`AGAINST`].
pub fn of_recording(kind: Kind, path: &Path, root: &Path) -> Result<[Vec<ConfidenceSample>; 2], String> {
    let binding = root.join("demos").join(format!("{}.binding.yaml", kind.binding()));
    let opened = crate::recording_result::opened(path, &binding)?;
    let rules = Log::options().binding(&binding).open(path).and_then(|log| Rules::for_log(&log));
    labels(&opened.recording, &rules.map_err(|error| error.to_string())?)
}

/// The labels of simulated operators, those of all scenes of one hand with these seeds.
pub fn of_simulation(seeds: u64) -> Result<[Vec<ConfidenceSample>; 2], String> {
    let rules = Rules::options().load().map_err(|error| error.to_string())?;
    let mut all = [vec![], vec![]];
    demonstrations(seeds, &mut |_, _, recording| {
        all.iter_mut().zip(labels(&recording, &rules)?).for_each(|(all, found)| all.extend(found));
        Ok(())
    })?;
    Ok(all)
}

/// Pushes a recording row by row, with the calibration of the whole of it.
fn labels(recording: &Recording, rules: &Rules) -> Result<[Vec<ConfidenceSample>; 2], String> {
    let scene = serde_json::to_string(&recording.scene).map_err(|error| error.to_string())?;
    let titles: Vec<&str> = std::iter::once("time").chain(recording.columns.keys().map(String::as_str)).collect();
    let columns: Vec<&[f64]> = std::iter::once(recording.time.as_slice())
        .chain(recording.columns.values().map(|column| column.values.as_slice()))
        .collect();
    let run = || -> Result<(Vec<LiveEvent>, Vec<LiveLabel>), teachtree::Error> {
        let scene = Scene::parse("scene", &scene)?;
        let named = titles.iter().zip(&columns).map(|(title, values)| Column::new(*title, "", values.to_vec()));
        let log = Log::from_columns("log", named, &scene)?;
        let calibration = Calibration::of_whole(&log, rules)?;
        let mut live = Live::new(rules, &titles, &scene, &calibration)?.with_confidence();
        let (mut events, mut given, mut now) = (vec![], vec![], BTreeMap::new());
        for (row, at_s) in recording.time.iter().enumerate() {
            let row: Vec<f64> = columns.iter().map(|values| values.get(row).copied().unwrap_or(f64::NAN)).collect();
            let new = live.push(&row)?;
            for event in &new {
                if let (Some((who, primitive, _)), Some(confidence)) = (event.label(), event.confidence()) {
                    now.insert(who, (primitive.map(str::to_string), confidence));
                }
            }
            events.extend(new);
            given.extend(now.iter().map(|(who, (primitive, confidence))| LiveLabel {
                who: *who,
                at_s: *at_s,
                primitive: primitive.clone(),
                confidence: *confidence,
            }));
        }
        events.extend(live.finish()?);
        Ok((events, given))
    };
    let (events, given) = run().map_err(|error| error.to_string())?;
    Ok([false, true].map(|is_final| {
        let segments: Vec<_> =
            events.iter().filter(|it| it.is_final() == is_final).filter_map(LiveEvent::segment).collect();
        let sure = |label: &LiveLabel| {
            let at =
                |it: &&teachtree::Segment| it.track() == label.who && (it.start_s()..it.end_s()).contains(&label.at_s);
            let found = segments.iter().find(at).map(|it| it.primitive());
            ConfidenceSample { share: label.confidence, right: found == label.primitive.as_deref() }
        };
        given.iter().map(sure).collect()
    }))
}
