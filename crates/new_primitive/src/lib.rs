//! One new primitive from labeled recordings, for the command line and the studio: what labels say about it (`marks`), the rules that it extends (`base_rules`),
//! recordings of other tasks (`demonstrations`), the rule file and what is known of it (`summary`). `learn` does the learning.

mod base_rules;
mod demonstrations;
mod marks;
mod summary;

pub use base_rules::BaseRules;
pub use marks::{declaration, marks};

use demonstrations::demonstrations;
use teachtree_analysis::TrackId;
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_learn::{Declaration, Extension, MarkedTrack, ShownRecording, extend};
use teachtree_session::{Error, ErrorInternals, Log, LogInternals};

/// A recording with what its labels say about the primitive; without labels it has no tracks.
pub struct MarkedRecording {
    /// The recording.
    pub log: Log,
    /// What is known.
    pub tracks: Vec<MarkedTrack>,
}

/// What was learned.
pub struct NewPrimitive {
    /// The name of the primitive.
    pub name: String,
    /// The rule file.
    pub text: String,
    /// The extension with its proof and its measures; the demonstrations are behind the recordings.
    pub extension: Extension,
    /// The number of recordings with marks.
    pub marked: usize,
    /// The recordings.
    pub recordings: Vec<MarkedRecording>,
    /// The shipped demonstrations in which the primitive was looked for.
    pub demonstrations: Vec<Log>,
}

/// Learns a primitive from recordings, beside the shipped demonstrations if these measure what the rules read. Marks of both hands together exclude those of
/// single hands. `shown` receives the share that is done, 0 to 1.
///
/// # Errors
/// Rules with errors, recordings that need different hand models, and the errors of [`extend`].
pub fn learn_primitive(
    new: &Declaration,
    recordings: &[MarkedRecording],
    rules: &BaseRules,
    shown: &(dyn Fn(f64) + Sync),
) -> Result<NewPrimitive, Error> {
    let of_both = |track: &MarkedTrack| track.who == TrackId::Both && !track.marked.is_empty();
    let is_of_both = recordings.iter().flat_map(|one| &one.tracks).any(of_both);
    let of_kind = |one: &MarkedRecording| MarkedRecording {
        log: one.log.clone(),
        tracks: one.tracks.iter().filter(|track| (track.who == TrackId::Both) == is_of_both).cloned().collect(),
    };
    let recordings: Vec<MarkedRecording> = recordings.iter().map(of_kind).collect();
    recordings.iter().try_for_each(|one| rules.check(&one.log))?;
    let demonstrations = demonstrations(rules)?;
    shown(0.1);
    let labeled = recordings.iter().map(|one| shown_recording(&one.log, &one.tracks));
    let all: Vec<ShownRecording> =
        labeled.chain(demonstrations.iter().map(|log| shown_recording(log, &[]))).collect::<Result<_, Error>>()?;
    let load = |text: &str| rules.load(text).map_err(ErrorInternals::into_input);
    let extension = extend(new, &all, &load, &|part| shown(0.1 + 0.9 * part)).map_err(mismatch)?;
    drop(all);
    let marked = recordings.iter().filter(|one| one.tracks.iter().any(|track| !track.marked.is_empty())).count();
    let text = format!(
        "/// *{}*, learned from {} labeled intervals in {marked} recordings.\n{}\n{}",
        new.name,
        extension.learned.marked,
        rules.uses(),
        extension.text
    );
    Ok(NewPrimitive { name: new.name.clone(), text, extension, marked, recordings, demonstrations })
}

fn shown_recording<'a>(log: &'a Log, tracks: &[MarkedTrack]) -> Result<ShownRecording<'a>, Error> {
    let opened = log.opened()?;
    Ok(ShownRecording {
        name: log.name(),
        hands: log.hands(),
        duration_s: duration_s(log)?,
        frames: Box::new(move |channels| opened.frames(channels)),
        tracks: tracks.to_vec(),
    })
}

/// How long a recording is, s.
///
/// # Errors
/// A recording that cannot be read.
fn duration_s(log: &Log) -> Result<f64, Error> {
    let time = &log.opened()?.recording.time;
    Ok(time.last().zip(time.first()).map_or(0.0, |(last, first)| last - first))
}

/// An error of recordings, labels and rules that do not fit each other.
fn mismatch(error: InputError) -> Error {
    Error::new(error, ErrorKind::Mismatch)
}
