//! Check of a binding against the scene and the rules: missing bodies, channels without a reader.

use super::{BLANK, BindingFile, Columns, PlaceholderValues, Template};
use crate::clean::unknown_columns::{UnknownColumn, unknown_part};
use teachtree_base::error::InputError;
use teachtree_base::log_channel::{FingerPart, LogChannel};
use teachtree_base::scene::{Role, Scene};
use teachtree_logs::names;

impl BindingFile {
    /// Checks the names on the left side of `channels`, and those in `trust`.
    ///
    /// Returns the channels that only a rule file of its own could read, each with the error that it is when none does: their names are
    /// nearly those of known channels, or have a part that no hand has.
    ///
    /// # Errors
    /// When a channel is not filled in, when it names a body that the scene lacks, or something is trusted that is not a force of a finger.
    pub fn check(&self, scene: &Scene) -> Result<Vec<(String, InputError)>, InputError> {
        self.check_blanks()?;
        let objects: Vec<&str> =
            scene.bodies.iter().filter(|(_, body)| body.role == Role::Object).map(|(name, _)| name.as_str()).collect();
        // Any object will do: what is asked is whether the rest of the name means something.
        let object = objects.first().copied().unwrap_or_default();
        let filling = PlaceholderValues { object, other: objects.get(1).copied().unwrap_or(object), component: 0 };
        let mut suspicious_channels = vec![];
        for key in self.binding.channels.keys().filter(|key| !names::is_label(key)) {
            let Ok(template) = Template::parse(key) else { continue };
            if template.has_object() && objects.is_empty() {
                continue;
            }
            let channel = template.fill(filling);
            let column = LogChannel::parse(&channel)
                .and_then(|channel| channel.columns().into_iter().next())
                .unwrap_or_else(|| channel.clone());
            match UnknownColumn::of(&column, scene) {
                None => {}
                Some(unknown @ UnknownColumn::Body(_)) => {
                    return Err(self.error(key, unknown.message(&column, scene)));
                }
                Some(unknown) => {
                    let message = unknown.message(&channel, scene);
                    if message.contains("did you mean") || unknown_part(&channel).is_some() {
                        suspicious_channels.push((channel, self.error(key, message)));
                    }
                }
            }
        }
        for channel in &self.binding.trust {
            let is_force = matches!(LogChannel::parse(channel), Some(LogChannel::Finger(_, _, FingerPart::Force)));
            if !is_force {
                let message =
                    format!("`{channel}` is not a force of a finger, expected a channel such as `right.thumb.force`");
                return Err(self.error("trust", message));
            }
        }
        Ok(suspicious_channels)
    }

    /// Refuses a channel with a place that is to be filled in.
    fn check_blanks(&self) -> Result<(), InputError> {
        let is_blank = |columns: &Columns| columns.patterns().iter().any(|pattern| pattern.written.contains(BLANK));
        let Some((channel, _)) = self.binding.channels.iter().find(|(_, columns)| is_blank(columns)) else {
            return Ok(());
        };
        let message = format!("`{channel}` is not filled in, expected a column of the log in place of each `{BLANK}`");
        Err(self
            .error(channel, message)
            .help("delete the line if the log has no such column; `teachtree inspect LOG` lists the columns"))
    }
}
