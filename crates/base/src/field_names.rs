//! The field's names of channels: a robot has a tool center point and a wrist where the program has a thumb and a palm.
//!
//! The names are mapped here and nowhere else (docs/logs.md). What reads a log or a binding gives the names to [`FieldNames::take`]; issues and errors pass
//! through [`FieldNames::shown`] before a user reads them.

use super::error::InputError;
use super::hands::Side;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// The field's name of a channel of a hand, and the name inside the program.
const NAMES: [([&str; 2], [&str; 2]); 5] = [
    (["tcp", "position"], ["thumb", "position"]),
    (["tcp", "rotation"], ["palm", "rotation"]),
    (["wrist", "force"], ["palm", "force"]),
    (["wrist", "noise"], ["palm", "noise"]),
    (["wrist", "level"], ["palm", "level"]),
];

/// The same, each as a text: `tcp.position`, for lists of known names.
pub fn all() -> impl Iterator<Item = String> {
    NAMES.iter().map(|(field, _)| field.join("."))
}

/// The name inside the program of a channel of a hand that has one of the field's: `thumb.position` of `tcp.position`.
pub fn inside_of_hand(part: &str, quantity: &str) -> Option<[&'static str; 2]> {
    NAMES.iter().find(|(field, _)| *field == [part, quantity]).map(|(_, inside)| *inside)
}

/// The name inside the program of a channel of a hand, without the hand: `thumb.position` of `tcp.position`; the same name where it is none of the field's.
pub fn of_hand(name: &str) -> Cow<'_, str> {
    let inside = name.split_once('.').and_then(|(part, quantity)| inside_of_hand(part, quantity));
    inside.map_or(Cow::Borrowed(name), |inside| Cow::Owned(inside.join(".")))
}

/// The name inside the program of a channel or of one of its columns: `right.thumb.position.x` of `right.tcp.position.x`.
pub fn inside(name: &str) -> Cow<'_, str> {
    let renamed = || {
        let (side, rest) = name.split_once('.')?;
        Side::from_name(side)?;
        let (part, rest) = rest.split_once('.')?;
        let (quantity, component) =
            rest.split_once('.').map_or((rest, None), |(quantity, last)| (quantity, Some(last)));
        let [part, quantity] = inside_of_hand(part, quantity)?;
        Some(match component {
            Some(component) => format!("{side}.{part}.{quantity}.{component}"),
            None => format!("{side}.{part}.{quantity}"),
        })
    };
    renamed().map_or(Cow::Borrowed(name), Cow::Owned)
}

/// The spelling of the channels of a log.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FieldNames {
    /// Whether a channel with two names has the one of the field, by its name inside the program.
    is_field: BTreeMap<String, bool>,
}

impl FieldNames {
    /// Returns the name inside the program of a channel or of one of its columns, and takes note of the spelling. The first one of a channel counts.
    pub fn take(&mut self, name: &str) -> String {
        let inside = inside(name).into_owned();
        if let Some(channel) = mapped(&inside) {
            self.is_field.entry(channel).or_insert(inside != name);
        }
        inside
    }

    /// Adds the spelling of another part of a log.
    pub fn add(&mut self, other: &Self) {
        for (channel, is_field) in &other.is_field {
            self.is_field.entry(channel.clone()).or_insert(*is_field);
        }
    }

    /// Returns a text with the names of channels as the user writes them. A channel that the log lacks has the field's name if another one of its hand does.
    pub fn shown<'a>(&self, text: &'a str) -> Cow<'a, str> {
        let mut text = Cow::Borrowed(text);
        for side in Side::BOTH {
            let of_hand = format!("{side}.");
            let is_of_robot =
                self.is_field.iter().any(|(channel, is_field)| *is_field && channel.starts_with(&of_hand));
            for (field, inside) in NAMES.iter().filter(|_| is_of_robot) {
                let name = format!("{side}.{}", inside.join("."));
                if self.is_field.get(&name).copied().unwrap_or(true) && text.contains(&name) {
                    text = Cow::Owned(replaced(&text, &name, &format!("{side}.{}", field.join("."))));
                }
            }
        }
        text
    }

    /// Returns an error with the names of channels as the user writes them.
    #[must_use]
    pub fn of_error(&self, error: InputError) -> InputError {
        let shown = |text: &str| self.shown(text).into_owned();
        InputError {
            place: shown(&error.place),
            message: shown(&error.message),
            help: error.help.as_deref().map(shown),
            ..error
        }
    }
}

/// The channel of a name inside the program, if the field has another one for it.
fn mapped(name: &str) -> Option<String> {
    let mut parts = name.split('.');
    let (side, part, quantity) = (parts.next()?, parts.next()?, parts.next()?);
    let is_mapped = NAMES.iter().any(|(_, inside)| *inside == [part, quantity]);
    (Side::from_name(side).is_some() && is_mapped).then(|| format!("{side}.{part}.{quantity}"))
}

/// A text in which a name is replaced wherever it is not part of another one.
fn replaced(text: &str, name: &str, by: &str) -> String {
    let is_of_name = |c: char| c.is_alphanumeric() || c == '_';
    let (mut new, mut rest) = (String::with_capacity(text.len()), text);
    while let Some((before, after)) = rest.split_once(name) {
        let is_whole = !before.ends_with(|c| is_of_name(c) || c == '.') && !after.starts_with(is_of_name);
        new.push_str(before);
        new.push_str(if is_whole { by } else { name });
        rest = after;
    }
    new + rest
}
