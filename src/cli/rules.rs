//! Which rules a command runs: the options that name them, and loading with all diagnostics.

use super::source::SourceArgs;
use super::{Failure, output};
use crate::base::diagnostic::{Severity, render};
use crate::language::{self, Request, Rules};
use crate::stream::binding::BindingFile;
use crate::stream::{Opened, hand_file_of};
use std::path::{Path, PathBuf};

/// Options that name rules.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct RuleArgs {
    /// Rule files; when left out the shipped `contact.rules`, for logs of two hands `bimanual.rules`
    #[arg(long = "rules", value_name = "FILE")]
    pub rules: Vec<PathBuf>,
    /// The hand file that keeps the promised signals, such as `hand_flags.rules`; overrides the binding's
    #[arg(long, value_name = "FILE")]
    pub hand: Option<String>,
    /// Override a param, such as `touch_on=0.1N`; may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = name_and_value)]
    pub set: Vec<(String, String)>,
}

/// Reads `NAME=VALUE`.
pub fn name_and_value(text: &str) -> Result<(String, String), String> {
    let (name, value) = text.split_once('=').ok_or("wanted NAME=VALUE, such as `touch_on=0.1N`")?;
    Ok((name.trim().to_string(), value.trim().to_string()))
}

/// The rules of two hands.
const OF_TWO_HANDS: &str = "bimanual.rules";

/// The files that these options have a command read, those that rules use too: nothing is written over them.
pub fn read_by(source: &SourceArgs, rules: &RuleArgs) -> Vec<PathBuf> {
    let of_binding = |binding: &Path| Some(hand_file_of(binding, BindingFile::read(binding).ok()?.binding.hand_file?));
    let hand_file = rules.hand.clone().or_else(|| source.binding.as_deref().and_then(of_binding));
    let mut files: Vec<PathBuf> = source.binding.iter().chain(&source.scene).chain(&rules.rules).cloned().collect();
    if !rules.rules.is_empty() || hand_file.is_some() {
        let loaded = language::load(&Request { files: rules.rules.clone(), hand_file, ..Request::default() });
        files.extend(loaded.sources.files.iter().map(|file| PathBuf::from(&file.name)));
    }
    files
}

/// Loads rules for a log; what the command line says wins over what the binding says. Warnings are left to `check`.
pub fn load(args: &RuleArgs, opened: &Opened) -> Result<Rules, Failure> {
    load_request(request(args, opened))
}

/// What is loaded for a log.
pub fn request(args: &RuleArgs, opened: &Opened) -> Request {
    request_for(args, opened.hands().len(), opened.hand_file.clone(), &opened.params)
}

/// Loads rules for a log with so many hands, of which a binding may say the hand file and params.
pub fn load_for(
    args: &RuleArgs,
    hands: usize,
    hand_file: Option<String>,
    params: &[(String, String)],
) -> Result<Rules, Failure> {
    load_request(request_for(args, hands, hand_file, params))
}

fn request_for(args: &RuleArgs, hands: usize, hand_file: Option<String>, params: &[(String, String)]) -> Request {
    let usual = || if hands > 1 { vec![PathBuf::from(OF_TWO_HANDS)] } else { vec![] };
    Request {
        files: if args.rules.is_empty() { usual() } else { args.rules.clone() },
        hand_file: args.hand.clone().or(hand_file),
        overrides: params.iter().chain(&args.set).cloned().collect(),
        needs_tree: true,
        ..Request::default()
    }
}

/// Loads the rules of these files, without a log; a hand file may be named.
pub fn load_files(files: &[PathBuf], hand: Option<&str>) -> Result<Rules, Failure> {
    let hand_file = hand.map(str::to_string);
    load_request(Request { files: files.to_vec(), hand_file, needs_tree: true, ..Request::default() })
}

fn load_request(request: Request) -> Result<Rules, Failure> {
    let loaded = language::load(&request);
    let errors: Vec<_> = loaded.diagnostics.into_iter().filter(|found| found.severity == Severity::Error).collect();
    match loaded.rules {
        Some(rules) if errors.is_empty() => Ok(rules),
        _ => Err(Failure::Text(render(&errors, &loaded.sources, output::color_on_stderr()))),
    }
}
