//! Labels the current recording row by row, by the library's `Live`.

use super::options::Options;
use super::shared_state::lock;
use super::tracks::{PrimitiveStyle, Tracks};
use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::mpsc::Receiver;
use teachtree_base::error::InputError;
use teachtree_base::meaning::Meaning;
use teachtree_report::palette;
use teachtree_session::{Calibration, Column, Live, Log, Rules, Scene};
use teachtree_session::{RulesInternals, SceneInternals};
use teachtree_world::TeleopWorld;

/// Duration of the scene at rest from which `Live` is calibrated, steps.
const CALIBRATION_STEPS: usize = 1500;

/// A message of the servo.
pub(super) enum LabelerInput {
    /// A recording begins, with these columns.
    Begin(Vec<String>),
    /// A row of the recording.
    Row(Vec<f64>),
    /// The recording has ended.
    End,
    /// The recording was discarded.
    Nothing,
}

/// The labeling of recordings.
pub(super) struct Labeler {
    rules: Rules,
    scene: Scene,
    calibration: Calibration,
}

/// Returns the appearance of the primitives by name.
fn styles(rules: &Rules) -> BTreeMap<String, PrimitiveStyle> {
    let look = |name: &str, does: Option<Meaning>| PrimitiveStyle {
        color: palette::color(name, does).hex(),
        holds: does.is_some_and(Meaning::holds),
    };
    rules.set().primitives.iter().map(|it| (it.name.clone(), look(&it.name, it.does))).collect()
}

/// Returns the recording of a scene at rest, as a log.
fn at_rest(options: &Options) -> Result<Log, InputError> {
    let mut work = TeleopWorld::new(&options.scene)?;
    work.start();
    for _ in 0..CALIBRATION_STEPS {
        work.step();
    }
    let mut columns: Vec<Vec<f64>> = vec![Vec::with_capacity(CALIBRATION_STEPS); work.columns().len()];
    for row in (0..work.recorded()).filter_map(|row| work.row(row)) {
        columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
    }
    // The titles have units.
    let columns = work.columns().into_iter().zip(columns).map(|(title, values)| Column::new(title, "", values));
    let scene = Scene::of(options.scene.clone());
    Log::from_columns("the scene at rest", columns, &scene).map_err(|error| plain(&options.name, &error))
}

fn plain(name: &str, error: &teachtree_session::Error) -> InputError {
    InputError::new(name, error.to_string())
}

/// Loads the rules for recordings of a scene.
///
/// # Errors
/// Rules that cannot be loaded.
pub(super) fn rules(options: &Options) -> Result<(Rules, Log), InputError> {
    let log = at_rest(options)?;
    let rules = options.rules.clone().for_log(&log).map_err(|error| plain("--rules", &error))?;
    Ok((rules, log))
}

impl Labeler {
    /// Calibrates from the scene at rest.
    ///
    /// # Errors
    /// Rules that cannot be loaded, or that need what recordings of the scene do not have.
    pub(super) fn new(options: &Options) -> Result<(Self, BTreeMap<String, PrimitiveStyle>), InputError> {
        let (rules, log) = rules(options)?;
        let calibration = Calibration::of(&log, &rules).map_err(|error| plain(&options.name, &error))?;
        let styles = styles(&rules);
        Ok((Self { rules, scene: Scene::of(options.scene.clone()), calibration }, styles))
    }

    /// Labels rows until the servo ends.
    pub(super) fn run(self, rows: &Receiver<LabelerInput>, tracks: &Mutex<Tracks>) {
        let mut live: Option<Live> = None;
        while let Ok(fed) = rows.recv() {
            let events = match fed {
                LabelerInput::Begin(columns) => {
                    lock(tracks).restart();
                    match Live::new(&self.rules, &columns, &self.scene, &self.calibration) {
                        Ok(begun) => live = Some(begun),
                        Err(error) => trouble(tracks, error.to_string()),
                    }
                    continue;
                }
                LabelerInput::Row(row) => live.as_mut().map(|live| live.push(&row)),
                LabelerInput::End => live.take().map(Live::finish),
                LabelerInput::Nothing => {
                    live = None;
                    lock(tracks).restart();
                    continue;
                }
            };
            match events {
                Some(Ok(events)) if !events.is_empty() => {
                    let mut tracks = lock(tracks);
                    events.iter().for_each(|event| tracks.take(event));
                }
                Some(Err(error)) => {
                    live = None;
                    trouble(tracks, error.to_string());
                }
                _ => {}
            }
        }
    }
}

fn trouble(tracks: &Mutex<Tracks>, why: String) {
    let mut tracks = lock(tracks);
    tracks.version += 1;
    tracks.trouble = Some(why);
}
