//! `cargo example damage -- 1000` damages recordings of every format in a thousand ways each, analyzes them through the library's interface,
//! and counts what comes of it. Damage that changes labels elsewhere without an issue is listed. The same seed gives the same counts on any number of threads.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command-line program prints")]

mod alteration;
mod outcome;
mod sources;
mod writers;

use alteration::{DamagedFile, Random};
use clap::Parser;
use outcome::{Baseline, Outcome};
use rand::SeedableRng;
use rayon::prelude::*;
use sources::Source;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;

/// Counts what damage to recordings does to their labels
#[derive(Parser)]
struct Args {
    /// Damaged copies of each recording
    #[arg(default_value_t = 100)]
    count: u64,
    /// Seed of the damage
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only recordings whose format or name contains one of these texts
    #[arg(long)]
    only: Vec<String>,
    /// Only damage whose kind contains this text
    #[arg(long, default_value = "")]
    kind: String,
    /// Labels may change so far from the damage, s: as far as the rules look and settle
    #[arg(long, default_value_t = 0.25)]
    margin: f64,
    /// How many cases are listed that changed labels elsewhere
    #[arg(long, default_value_t = 40)]
    show: usize,
    /// Folder for the files of the cases that changed labels elsewhere
    #[arg(long)]
    keep: Option<PathBuf>,
}

/// How many cases had each outcome, in the order of [`outcome::NAMES`].
type Counts = [u64; outcome::NAMES.len()];

fn main() -> ExitCode {
    // Panics are counted; their messages would be printed between.
    std::panic::set_hook(Box::new(|_| {}));
    match run(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

fn run(args: &Args) -> Result<(), String> {
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    let selected = |source: &Source| {
        let name = format!("{} {}", source.format, source.name);
        args.only.is_empty() || args.only.iter().any(|part| name.contains(part.as_str()))
    };
    let sources: Vec<Source> = sources::all(folder.path())?.into_iter().filter(selected).collect();
    let (mut formats, mut kinds) = (BTreeMap::<&str, Counts>::new(), BTreeMap::<&str, Counts>::new());
    let mut listed = Vec::new();
    for (number, source) in sources.iter().enumerate() {
        let plain =
            Baseline::of_plain(source).map_err(|error| format!("{} {}: {error}", source.format, source.name))?;
        let cases: Vec<(DamagedFile, Outcome)> = (0..args.count)
            .into_par_iter()
            .map_init(
                || tempfile::tempdir().map_err(|error| error.to_string()),
                |folder, case| {
                    let folder = folder.as_ref().map_err(Clone::clone)?.path();
                    let mut random = Random::seed_from_u64(args.seed);
                    random.set_stream((number as u64) << 32 | case);
                    let Some(altered) = source.alter(&mut random, &args.kind) else { return Ok(None) };
                    let file = folder.join(source.file_name());
                    std::fs::write(&file, &altered.bytes).map_err(|error| error.to_string())?;
                    let outcome = plain.compare(source, &file, &altered, args.margin);
                    if let (Outcome::Further(_), Some(keep)) = (&outcome, &args.keep) {
                        let to = keep.join(format!("{}-{}-{case}", source.format, source.name));
                        std::fs::create_dir_all(&to).map_err(|error| error.to_string())?;
                        std::fs::copy(&file, to.join(source.file_name())).map_err(|error| error.to_string())?;
                    }
                    Ok(Some((DamagedFile { bytes: Vec::new(), ..altered }, outcome)))
                },
            )
            .filter_map(Result::transpose)
            .collect::<Result<_, String>>()?;
        for (altered, outcome) in cases {
            formats.entry(source.format).or_default()[outcome.index()] += 1;
            kinds.entry(altered.kind).or_default()[outcome.index()] += 1;
            if let Outcome::Further(how) | Outcome::Panicked(how) = outcome {
                listed.push((altered.kind, format!("{} {}: {}: {how}", source.format, source.name, altered.what)));
            }
        }
        eprintln!("{} {}: {} cases", source.format, source.name, args.count);
    }
    print!("{}\n{}\n", table("format", &formats), table("damage", &kinds));
    listed.sort_by_key(|(kind, _)| *kind);
    // As many of each kind, so that a frequent one does not hide the others.
    let each = args.show.div_ceil(kinds.len().max(1));
    let mut shown = BTreeMap::<&str, usize>::new();
    for (kind, text) in &listed {
        let count = shown.entry(kind).or_default();
        *count += 1;
        if *count <= each {
            println!("{kind}: {text}");
        }
    }
    Ok(())
}

/// A table of Markdown.
fn table(first: &str, counts: &BTreeMap<&str, Counts>) -> String {
    let mut text = format!(
        "| {first} | cases | {} |\n|---|{}\n",
        outcome::NAMES.join(" | "),
        "---|".repeat(outcome::NAMES.len() + 1)
    );
    for (name, counts) in counts {
        let cells: Vec<String> = counts.iter().map(u64::to_string).collect();
        text += &format!("| {name} | {} | {} |\n", counts.iter().sum::<u64>(), cells.join(" | "));
    }
    text
}
