//! `teachtree teach`: an operator script in a scene, recorded.

use super::progress::Progress;
use super::{Failure, output};
use crate::base::error::InputError;
use crate::base::recording::Recording;
use crate::stream::csv;
use crate::stream::formats;
use crate::world::{self, Operator};
use std::path::{Path, PathBuf};

/// Options of `teach`.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  teachtree teach paper_box paper_box -o demonstration.csv --seed 7")]
pub struct Args {
    /// A shipped scene by name, or a scene file
    scene: String,
    /// A shipped operator by name, or an operator file
    operator: String,
    /// Where to write the recording; its scene goes beside it
    #[arg(long, short, value_name = "LOG")]
    out: PathBuf,
    /// The person: the same seed does the same, byte for byte
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Runs `teach`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let recording = record(&args.scene, &args.operator, args.seed)?;
    formats::write(&recording, &args.out)?;
    let duration = recording.time.last().copied().unwrap_or_default();
    output::print(&format!("{}: {} frames, {duration:.1} s\n", args.out.display(), recording.time.len()))?;
    Ok(())
}

/// Records an operator in a scene, with a progress bar.
pub fn record(scene: &str, operator: &str, seed: u64) -> Result<Recording, Failure> {
    let scene = if is_file(scene) { csv::read_scene(Path::new(scene))? } else { world::scene(scene)? };
    let operator = match read(operator)? {
        Some(text) => Operator::read(&text, operator)?,
        None => world::operator(operator)?,
    };
    let progress = Progress::new("teaching");
    Ok(world::teach_with_progress(&scene, &operator, seed, &mut |part| progress.set(part))?)
}

/// The text of a file; `None` for what is no path but the name of something shipped.
fn read(name: &str) -> Result<Option<String>, InputError> {
    if !is_file(name) {
        return Ok(None);
    }
    let text = std::fs::read_to_string(name);
    text.map(Some).map_err(|error| InputError::new(name, format!("the file cannot be read: {error}")))
}

/// Whether a name is a path rather than the name of something shipped.
fn is_file(name: &str) -> bool {
    Path::new(name).extension().is_some_and(|ending| ending == "yaml" || ending == "yml")
}
