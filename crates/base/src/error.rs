//! The one kind of error that a user sees about an input that is not a rule file: file, place, what was found, what was wanted.

use std::fmt;
use std::sync::Arc;

/// What an error is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// A file or folder cannot be opened, read or written.
    Io,
    /// A log cannot be read as its format or as the names of its columns require.
    Format,
    /// A binding is wrong, or does not fit its log.
    Binding,
    /// A scene is missing or wrong.
    Scene,
    /// Rule files have mistakes, as their diagnostics say.
    Rules,
    /// Rules and log do not fit together: the log lacks a channel that the rules read, or is sampled too slowly for a duration of the rules.
    Mismatch,
    /// A question or an option has no answer: a time outside the log, an unknown track or primitive.
    Argument,
    /// A robot file is wrong.
    Robot,
    /// What is asked of a robot is out of its reach.
    Infeasible,
    /// A bug of this library.
    Internal,
}

/// Something wrong with an input; ends the command with exit status 2.
#[derive(Clone, Debug)]
pub struct InputError {
    /// Where: `demo.csv`, `demo.csv row 12 column right.thumb.force.x`, `scene.yaml:4:7`.
    pub place: String,
    /// What was found and what was wanted, one sentence, lower case.
    pub message: String,
    /// What to do about it, if there is something.
    pub help: Option<String>,
    /// What it is about, where that is known already; the caller knows it otherwise ([`InputError::or_kind`]).
    pub kind: Option<ErrorKind>,
    /// The underlying error of the system.
    pub cause: Option<Arc<std::io::Error>>,
}

/// Two errors are equal when they say the same.
impl PartialEq for InputError {
    fn eq(&self, other: &Self) -> bool {
        (&self.place, &self.message, &self.help) == (&other.place, &other.message, &other.help)
    }
}

impl Eq for InputError {}

impl InputError {
    /// An error at a place.
    pub fn new(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self { place: place.into(), message: message.into(), help: None, kind: None, cause: None }
    }

    /// An error about a file that cannot be read, in words for people.
    pub fn unreadable(file: impl Into<String>, error: &std::io::Error) -> Self {
        use std::io::ErrorKind;
        let message = match error.kind() {
            ErrorKind::NotFound => "there is no such file".to_string(),
            ErrorKind::PermissionDenied => "no permission to read the file".to_string(),
            ErrorKind::IsADirectory => "found a folder, expected a file".to_string(),
            ErrorKind::InvalidData => "the file is not valid UTF-8".to_string(),
            // Without the number that the system gives it: `Too many open files (os error 24)`.
            _ => {
                format!("the file cannot be read: {}", error.to_string().split(" (os error").next().unwrap_or_default())
            }
        };
        let kind = if error.kind() == ErrorKind::InvalidData { self::ErrorKind::Format } else { self::ErrorKind::Io };
        // An error of the system cannot be cloned; its number makes another one.
        let again = error.raw_os_error().map(std::io::Error::from_raw_os_error);
        let cause = again.unwrap_or_else(|| std::io::Error::new(error.kind(), error.to_string()));
        Self { kind: Some(kind), cause: Some(Arc::new(cause)), ..Self::new(file, message) }
    }

    /// An error about a file or folder that cannot be written, in words for people.
    pub fn unwritable(place: impl Into<String>, error: &std::io::Error) -> Self {
        use std::io::ErrorKind;
        let why = match error.kind() {
            ErrorKind::NotFound => "there is no such folder".to_string(),
            ErrorKind::PermissionDenied => "the folder cannot be written".to_string(),
            ErrorKind::AlreadyExists | ErrorKind::DirectoryNotEmpty => {
                "another program has created this file in the meantime".to_string()
            }
            // Without the number that the system gives it: `No space left on device (os error 28)`.
            _ => error.to_string().split(" (os error").next().unwrap_or_default().to_string(),
        };
        Self { kind: Some(self::ErrorKind::Io), ..Self::new(place, format!("cannot be written: {why}")) }
    }

    /// The same error with a kind, unless it has one already.
    #[must_use]
    pub fn or_kind(mut self, kind: ErrorKind) -> Self {
        self.kind.get_or_insert(kind);
        self
    }

    /// The parts of the place `file:line:column`, lines and columns from 1; a place of another form is the file.
    pub fn file_line_column(&self) -> (&str, Option<usize>, Option<usize>) {
        let cut =
            |text| str::rsplit_once(text, ':').and_then(|(head, number)| Some((head, number.parse::<usize>().ok()?)));
        match cut(&self.place) {
            Some((head, last)) => match cut(head) {
                Some((file, line)) => (file, Some(line), Some(last)),
                None => (head, Some(last), None),
            },
            None => (&self.place, None, None),
        }
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
