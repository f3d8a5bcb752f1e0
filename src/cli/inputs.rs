//! YAML files that people write, scenes, operators, bindings and robots: which kind a file is, and what is wrong with it.

use crate::base::error::InputError;
use crate::base::yaml;
use crate::session::{Error, Scene};
use crate::stream::bind::BindingFile;
use crate::stream::read::text;
use std::path::Path;

/// A kind of files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Bodies and hands.
    Scene,
    /// Who demonstrates.
    #[cfg(feature = "world")]
    Operator,
    /// How the columns of a foreign log become channels.
    Binding,
    /// Links, joints and fingers.
    #[cfg(feature = "world")]
    Robot,
}

impl Kind {
    /// The kind in words, with its article.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Scene => "a scene",
            #[cfg(feature = "world")]
            Self::Operator => "an operator script",
            Self::Binding => "a binding",
            #[cfg(feature = "world")]
            Self::Robot => "a robot file",
        }
    }
}

/// The kind of a file by its ending, else by its keys.
pub fn kind(path: &Path, text: &str) -> Option<Kind> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let named = |kind: &str| [".yaml", ".yml"].iter().any(|ending| name.ends_with(&format!(".{kind}{ending}")));
    let has = |keys: &[&str]| {
        text.lines().any(|line| keys.iter().any(|key| line.strip_prefix(key).is_some_and(|rest| rest.starts_with(':'))))
    };
    match () {
        () if named("scene") => Some(Kind::Scene),
        () if named("binding") => Some(Kind::Binding),
        #[cfg(feature = "world")]
        () if named("operator") || has(&["grips"]) => Some(Kind::Operator),
        #[cfg(feature = "world")]
        () if named("robot") || has(&["links", "urdf"]) => Some(Kind::Robot),
        () if has(&["channels"]) => Some(Kind::Binding),
        () if has(&["bodies"]) => Some(Kind::Scene),
        #[cfg(feature = "world")]
        () if has(&["parts"]) => Some(Kind::Robot),
        () => None,
    }
}

/// Reads a text as a file of its kind.
///
/// # Errors
/// The first thing that is wrong, at `file:line:column` where that is known.
pub fn read(kind: Kind, path: &Path, text: &str) -> Result<(), InputError> {
    let name = path.display().to_string();
    match kind {
        Kind::Scene => Scene::parse(&name, text).map(drop).map_err(Error::into_input),
        Kind::Binding => BindingFile::parse(text.into(), name).map(drop),
        #[cfg(feature = "world")]
        Kind::Operator => crate::world::Operator::read(text, &name).map(drop),
        #[cfg(feature = "world")]
        Kind::Robot => {
            let text_of = |file: &str| match file == name {
                true => Ok(text.into()),
                false => text::read(Path::new(file), crate::robot::MAX_BYTES),
            };
            crate::robot::open(&name, &text_of).map(drop)
        }
    }
}

/// The text of a file.
///
/// # Errors
/// When it cannot be read.
pub fn text(path: &Path) -> Result<String, InputError> {
    text::read(path, yaml::MAX_BYTES as u64)
}

/// What is wrong with a text that an editor shows; nothing where it is of no kind that is known here.
pub fn wrong(path: &Path, text: &str) -> Option<InputError> {
    read(kind(path, text)?, path, text).err()
}
