//! `cargo example real -- [FOLDER…]` measures the accuracy of the shipped rules on recordings of other operators: those in `demos`, and
//! those of the same kinds in the named folders. All recordings are analyzed with the same rules and params.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program says what it does")]

mod confidence;
mod gold;
mod kind;
mod live;
mod peer;
mod recording_result;
mod robustness;
mod spread;
mod tables;
mod variants;

use clap::Parser;
use kind::{Kind, Set};
use rayon::prelude::*;
use recording_result::{RecordingResult, RuleChoice};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use teachtree_measure::confidence::{CLASSES, ConfidenceSample, LIVE_CLASSES, table};

/// Measures recognition on real recordings
#[derive(Parser)]
struct Args {
    /// Folders with recordings of the kinds that have a binding in `demos`, in folders of any depth; besides the project's own `demos`
    folders: Vec<PathBuf>,
    /// Rule files in this folder replace the shipped ones of the same name
    #[arg(long, value_name = "FOLDER")]
    rules: Option<PathBuf>,
    /// Also a line for each recording
    #[arg(long)]
    each: bool,
    /// Measure how often boundaries of each confidence are right, on the recordings and on SEEDS simulated operators of each scene
    #[arg(long, value_name = "SEEDS")]
    confidence: Option<u64>,
    /// Measure how often labels of the newest frames of each confidence are right, on the recordings and on SEEDS simulated operators of each scene
    #[arg(long, value_name = "SEEDS")]
    live: Option<u64>,
    /// Measure how much worse the results get for variants of the recordings, as another laboratory would have made them
    #[arg(long)]
    variants: bool,
    /// Measure the spread of the figures over DRAWS random draws of all values of the rules, each within 30 %, and over the recordings
    #[arg(long, value_name = "DRAWS")]
    spread: Option<u64>,
    /// Only the variants whose name contains this
    #[arg(long, value_name = "TEXT", requires = "variants")]
    variant: Option<String>,
    /// Only recordings whose path contains this
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
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
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let mut logs = Vec::new();
    for folder in std::iter::once(&root.join("demos")).chain(&args.folders) {
        kind::recordings(folder, &mut logs)?;
    }
    let wanted = |path: &Path| args.only.as_ref().is_none_or(|part| path.to_string_lossy().contains(part.as_str()));
    logs.retain(|(_, path)| wanted(path));
    if let Some(seeds) = args.confidence {
        let mut real: BTreeMap<Set, Vec<ConfidenceSample>> = BTreeMap::new();
        for (kind, path) in &logs {
            real.entry(kind.set()).or_default().extend(confidence::of_recording(*kind, path, root)?);
        }
        let simulated = confidence::of_simulation(seeds)?;
        let real = real.iter().filter(|(_, samples)| !samples.is_empty());
        let mut rows: Vec<(&str, &[ConfidenceSample])> =
            real.map(|(set, samples)| (set.about().0, &samples[..])).collect();
        rows.push(("simulated operators", &simulated));
        println!("{}", table("stability", "boundaries", &CLASSES, &rows));
        let calibrated = rows.iter().map(|(name, samples)| (*name, confidence::calibrated(samples)));
        let calibrated: Vec<(&str, Vec<ConfidenceSample>)> = calibrated.collect();
        let rows: Vec<(&str, &[ConfidenceSample])> = calibrated.iter().map(|(name, of)| (*name, &of[..])).collect();
        println!("{}", table("confidence", "boundaries", &CLASSES, &rows));
        return Ok(());
    }
    if let Some(seeds) = args.live {
        let simulated = live::of_simulation(seeds)?;
        let mut real = [vec![], vec![]];
        for (kind, path) in &logs {
            match live::of_recording(*kind, path, root) {
                Ok(found) => real.iter_mut().zip(found).for_each(|(real, found)| real.extend(found)),
                Err(error) => eprintln!("{}: {error}", path.display()),
            }
        }
        for ((against, real), simulated) in live::AGAINST.iter().zip(&real).zip(&simulated) {
            let sets: [(&str, &[ConfidenceSample]); 2] =
                [("real recordings", real), ("simulated operators", simulated)];
            println!("{}", table("confidence", &format!("labels of frames, by {against},"), &LIVE_CLASSES, &sets));
        }
        return Ok(());
    }
    let rules = RuleChoice { folder: args.rules.as_deref(), draw: None };
    if let Some(draws) = args.spread {
        println!("{}", spread::table(&logs, root, rules, draws)?);
        return Ok(());
    }
    if args.variants {
        let wanted = args.variant.as_deref().unwrap_or_default();
        println!("{}", robustness::table(&logs, root, rules, wanted, args.each));
        return Ok(());
    }
    let results: Vec<(Kind, PathBuf, Result<RecordingResult, String>)> = logs
        .into_par_iter()
        .map(|(kind, path)| {
            let found = recording_result::found(kind, &path, root, rules);
            (kind, path, found)
        })
        .collect();
    let mut all = Vec::new();
    let mut failures = 0;
    for (kind, path, found) in results {
        let given = !path.starts_with(root);
        let name = if given { &path } else { path.strip_prefix(root).unwrap_or(&path) };
        match found {
            Ok(found) => {
                if args.each {
                    println!("{}", tables::line(&name.display().to_string(), &found));
                }
                all.push((kind, given, found));
            }
            Err(error) => {
                failures += 1;
                eprintln!("{}: {error}", name.display());
            }
        }
    }
    println!("{}", tables::table(&all));
    if failures > 0 { Err(format!("{failures} recordings could not be analyzed")) } else { Ok(()) }
}
