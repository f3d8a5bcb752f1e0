//! Signals by which demonstrations are divided, as a binding or the command line names them: `grasp: start of Grasp of cube`.

use super::error::Error;
use super::log::Log;
use super::rules::Rules;
use crate::{ErrorInternals, LogInternals, RulesInternals};
use std::collections::BTreeSet;
use std::path::Path;
use teachtree_analysis::steps::Step;
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_base::spelling::nearest;
use teachtree_frames::bind::BindingFile;

/// A signal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Signal {
    /// Its name: letters, digits, `_`, `-`.
    pub name: String,
    /// When it rises.
    pub step: Step,
    /// Whether a part of a demonstration begins by it, not ends.
    pub starts: bool,
    /// Where it is named, for messages: a line of a binding, or an option.
    place: String,
}

impl Signal {
    /// Reads a signal.
    ///
    /// # Errors
    /// A name that a data set could not be called by, a step of another form.
    pub fn read(place: String, name: &str, step: &str, starts: bool) -> Result<Self, InputError> {
        if name.is_empty() || !name.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '-')) {
            let message = format!("found `{name}`, expected the name of a signal: letters, digits, `_`, `-`");
            return Err(InputError::new(place, message));
        }
        let read = Step::read(step).map_err(|message| InputError::new(&place, format!("signal `{name}`: {message}")));
        Ok(Self { name: name.into(), step: read?, starts, place })
    }

    /// Refuses primitives, tasks and bodies that there are none of.
    ///
    /// # Errors
    /// The first one, with the known name that is nearest.
    pub fn check(&self, rules: &Rules, bodies: &BTreeSet<String>) -> Result<(), InputError> {
        let mut names: BTreeSet<String> = rules.primitives().chain(rules.tasks()).map(str::to_string).collect();
        names.extend(rules.set().label_names());
        let Self { name, step, place, .. } = self;
        let subject = step.subject.object.iter().chain(&step.subject.partner).map(|body| (body, bodies, "body"));
        for (word, known, what) in std::iter::once((&step.name, &names, "primitive or task")).chain(subject) {
            if known.contains(word) {
                continue;
            }
            let error = InputError::new(place, format!("signal `{name}`: there is no {what} `{word}`"));
            return Err(match nearest(word, known.iter().map(String::as_str)) {
                Some(near) => error.help(format!("did you mean `{near}`?")),
                None if known.is_empty() => error.help("the scene has no bodies"),
                None => error.help(format!("there are {}", known.iter().cloned().collect::<Vec<_>>().join(", "))),
            });
        }
        Ok(())
    }
}

/// The signals of a binding, those that end parts first, in its order.
///
/// # Errors
/// A binding that cannot be read, and what [`Signal::read`] refuses, at `file:line:column`.
pub fn of_binding(binding: &Path) -> Result<Vec<Signal>, InputError> {
    let file = BindingFile::read(binding)?;
    let of = [("signals", &file.binding.signals, false), ("start_signals", &file.binding.start_signals, true)];
    let each =
        of.into_iter().flat_map(|(key, signals, starts)| signals.iter().map(move |signal| (key, signal, starts)));
    each.map(|(key, (name, step), starts)| Signal::read(file.place(&[key, name]), name, step, starts)).collect()
}

/// Checks the signals of the binding of a log against rules and the scene.
///
/// # Errors
/// [`ErrorKind::Binding`]: what [`of_binding`] and [`Signal::check`] refuse.
pub(crate) fn check_binding(log: &Log, rules: &Rules) -> Result<(), Error> {
    let Some(binding) = log.binding() else { return Ok(()) };
    let failed = |error| Error::new(error, ErrorKind::Binding);
    let signals = of_binding(binding).map_err(failed)?;
    if signals.is_empty() {
        return Ok(());
    }
    let bodies = log.opened()?.recording.scene.bodies.keys().cloned().collect();
    signals.iter().try_for_each(|signal| signal.check(rules, &bodies)).map_err(failed)
}
