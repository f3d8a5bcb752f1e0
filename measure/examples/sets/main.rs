//! `cargo example sets -- DOWNLOADS` measures the shipped rules and other methods on public sets of recordings, and prints one table over all sets whose
//! download is in the folder. `measure/sets` has a folder for each set: address, license, converter, binding, and the methods it is measured with.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command-line program prints")]

mod confidence;
mod intervals;
mod manifest;
mod measured;
mod method;
mod table;
mod threshold;

use clap::Parser;
use manifest::Set;
use measured::MeasuredSet;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

/// Measures rules and other methods on public sets of recordings
#[derive(Parser)]
struct Args {
    /// The folder of the downloads; converted recordings are written to its subfolder `converted`
    downloads: PathBuf,
    /// The folder of the sets, one subfolder with `set.yaml` for each
    #[arg(long, value_name = "FOLDER")]
    sets: Option<PathBuf>,
    /// Only sets whose folder contains this text
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
    /// Python with the packages that the converters need
    #[arg(long, value_name = "PROGRAM", default_value = "python3")]
    python: PathBuf,
    /// Also prints a line for each recording
    #[arg(long)]
    each: bool,
    /// Instead prints the share of right boundaries by stability, and the calibration of the confidence
    #[arg(long, conflicts_with = "each")]
    confidence: bool,
}

fn main() -> ExitCode {
    match run(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

fn run(args: &Args) -> Result<(), String> {
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("sets");
    let mut sets = manifest::read_all(args.sets.as_deref().unwrap_or(&shipped))?;
    sets.retain(|set| args.only.as_ref().is_none_or(|part| set.id.contains(part.as_str())));
    if args.confidence {
        return print_confidence(&sets, args);
    }
    let mut measured: Vec<(&Set, MeasuredSet)> = Vec::new();
    let mut absent = Vec::new();
    let mut failed = Vec::new();
    for set in &sets {
        match converted(set, args) {
            Ok(Some(folder)) => measured.push((set, measured::measure(set, &folder)?)),
            Ok(None) => absent.push(set),
            Err(error) => failed.push(error),
        }
    }
    if args.each {
        measured.iter().for_each(|(_, found)| println!("{}", table::recordings(found)));
    }
    println!("{}\n\n{}", table::table(&measured), table::explanations(&measured));
    absent.iter().for_each(|set| println!("\n{}", table::instructions(set, &args.downloads)));
    failed.extend(measured.into_iter().flat_map(|(_, found)| found.errors));
    if failed.is_empty() { Ok(()) } else { Err(failed.join("\n")) }
}

fn print_confidence(sets: &[Set], args: &Args) -> Result<(), String> {
    let mut samples = Vec::new();
    for set in sets.iter().filter(|set| !set.manifest.frames_only) {
        if let Some(folder) = converted(set, args)? {
            samples.push((set, confidence::of_set(set, &folder)?));
        }
    }
    println!("{}", confidence::tables(&samples));
    Ok(())
}

/// The folder of the converted recordings of a set, which is made if the download is there; `None` if it is not.
fn converted(set: &Set, args: &Args) -> Result<Option<PathBuf>, String> {
    let folder = args.downloads.join("converted").join(&set.id);
    if folder.is_dir() {
        return Ok(Some(folder));
    }
    let download = set.manifest.folder.as_ref().map(|name| args.downloads.join(name));
    if download.as_ref().is_some_and(|download| !download.is_dir()) || download.is_none() && !args.downloads.is_dir() {
        return Ok(None);
    }
    // A converter that fails leaves no folder that looks complete.
    let unfinished = folder.with_extension("unfinished");
    std::fs::remove_dir_all(&unfinished).ok();
    let converter = set.folder.join("convert.py");
    eprintln!("converting {}", set.manifest.name);
    let status = Command::new(&args.python)
        .arg(&converter)
        .arg(download.unwrap_or_else(|| args.downloads.clone()))
        .arg(&unfinished)
        .status()
        .map_err(|error| format!("{}: {error}", args.python.display()))?;
    if !status.success() {
        let packages = set.manifest.python.join(" ");
        return Err(format!("{}: {status}; it needs the Python packages {packages}", converter.display()));
    }
    std::fs::rename(&unfinished, &folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    Ok(Some(folder))
}
