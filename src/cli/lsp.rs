//! `teachtree lsp`: the language server on standard input and output.

use super::Failure;
use super::rules::HandArg;
use std::path::PathBuf;
use teachtree_base::error::InputError;
use teachtree_base::units::time;
use teachtree_lsp::{Settings, serve};

/// Options of `lsp`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree lsp\n  teachtree lsp --log demonstration.csv --at 8.5s     hover shows values of this recording, at this time\n  teachtree lsp --log log.csv --binding lab.binding.yaml --at 3410ms\n\nHow editors start it: editors/README.md"
)]
pub struct Args {
    /// The recording whose values hover shows
    #[arg(long, value_name = "LOG")]
    log: Option<PathBuf>,
    /// The time in the recording, `3.41s` or `3410ms`; by default its beginning
    #[arg(long, value_name = "TIME", value_parser = check_time)]
    at: Option<String>,
    /// Binding file that maps the columns of a foreign recording to channels
    #[arg(long, value_name = "FILE")]
    binding: Option<PathBuf>,
    /// Scene file; replaces the scene of the recording
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    #[command(flatten)]
    hand: HandArg,
    /// Accepted because some editors pass it to every server; the server always uses standard input and output
    #[arg(long, hide = true)]
    stdio: bool,
}

/// A time, not yet in seconds.
fn check_time(text: &str) -> Result<String, String> {
    time(text).map(|_| text.to_string())
}

/// Runs `lsp`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let Args { log, at, binding, scene, hand, stdio: _ } = args;
    let settings = Settings {
        log: log.clone(),
        at: at.clone(),
        binding: binding.clone(),
        scene: scene.clone(),
        hand: hand.file.clone(),
    };
    match serve(std::io::stdin(), std::io::stdout().lock(), settings, super::inputs::wrong) {
        Ok(true) => Ok(()),
        // The editor went without a word.
        Ok(false) => Err(Failure::Negative),
        Err(error) => Err(InputError::new("the editor", format!("cannot be written to: {error}")).into()),
    }
}
