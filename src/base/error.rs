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

    /// An error about a file that cannot be read, in words for people.
    pub fn unreadable(file: impl Into<String>, error: &std::io::Error) -> Self {
        use std::io::ErrorKind;
        let message = match error.kind() {
            ErrorKind::NotFound => "there is no such file".to_string(),
            ErrorKind::PermissionDenied => "the file may not be read".to_string(),
            ErrorKind::IsADirectory => "found a folder, wanted a file".to_string(),
            ErrorKind::InvalidData => "the file is no text in UTF-8".to_string(),
            // Without the number that the system gives it: `Too many open files (os error 24)`.
            _ => {
                format!("the file cannot be read: {}", error.to_string().split(" (os error").next().unwrap_or_default())
            }
        };
        Self::new(file, message)
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
