//! The one kind of error that a user sees about an input that is not a rule file: file, place, what was found, what was wanted.

use std::fmt;

/// Something wrong with an input; ends the command with exit status 2.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputError {
    /// Where: `demo.csv`, `demo.csv row 12 column right.thumb.force.x`, `scene.yaml:4:7`.
    pub place: String,
    /// What was found and what was wanted, one sentence, lower case.
    pub message: String,
    /// What to do about it, if there is something.
    pub help: Option<String>,
}

impl InputError {
    /// An error at a place.
    pub fn new(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self { place: place.into(), message: message.into(), help: None }
    }

    /// The same with advice.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.message)?;
        if let Some(help) = &self.help {
            write!(f, "\n  help: {help}")?;
        }
        Ok(())
    }
}

impl std::error::Error for InputError {}
