//! Checks a binding without a log: reports what `analyze` would refuse for every log.

use super::error::Error;
use super::log::Log;
use super::rules::RulesOptions;
use crate::{ErrorInternals, LogInternals, RulesInternals};
use std::path::Path;
use teachtree_analysis as analysis;
use teachtree_base::error::ErrorKind;
use teachtree_frames as stream;
use teachtree_frames::OpenRequest;
use teachtree_frames::bind::BindingFile;

/// The checked parts of a binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BindingCheck {
    /// All but the columns of the log.
    Whole,
    /// Neither bodies nor names of rules: the binding has no scene, or binds no channel, and the log decides which bodies and rules there are. Channels of
    /// hands are checked.
    Form,
}

/// Checks a binding by rules, those of the program unless others are named, and by the scene in it.
///
/// # Errors
/// [`ErrorKind::Binding`], [`ErrorKind::Rules`]: what `analyze` refuses of it, as `analyze` prints it.
pub fn check(binding: &Path, file: &BindingFile, rules: RulesOptions) -> Result<BindingCheck, Error> {
    let in_binding = |error| Error::new(error, ErrorKind::Binding);
    let opened = stream::assume(binding, file).map_err(in_binding)?;
    if file.binding.channels.is_empty() {
        return Ok(BindingCheck::Form);
    }
    let log = Log::assumed(OpenRequest { binding: Some(binding.into()), ..OpenRequest::default() }, opened);
    let rules = rules.for_log(&log);
    if file.binding.scene.is_none() {
        // Rules that do not fit the bodies that the binding mentions may fit those of the log.
        let channels = rules.map_or_else(|_| vec![], |rules| analysis::channels(rules.set()));
        if !channels.is_empty() {
            log.opened()?.check_channels(&channels).map_err(in_binding)?;
        }
        return Ok(BindingCheck::Form);
    }
    let rules = rules?;
    if let Some((tasks, place)) = log.expected() {
        rules.expected_tasks(&tasks, place, ErrorKind::Binding)?;
    }
    log.opened()?.check_channels(&analysis::channels(rules.set())).map_err(in_binding)?;
    Ok(BindingCheck::Whole)
}
