//! `cargo example outcomes -- 1..50` prints which share of failures the default rules find, for each kind of failure and each sensor set. The shipped
//! operators that fail on purpose are recorded with and without their failures; each recording is reduced to the signals of a sensor set and analyzed.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command-line program prints")]

mod sensors;
mod tables;
mod trial;

use clap::Parser;
use rayon::prelude::*;
use sensors::SensorSet;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::process::ExitCode;
use teachtree_measure::seeds;
use teachtree_world::shipped;
use trial::Trial;

/// Measures which failures of simulated operators the rules find
#[derive(Parser)]
struct Args {
    /// Seeds of the operators, the last one included
    #[arg(value_parser = seeds::parse, default_value = "1..50")]
    seeds: RangeInclusive<u64>,
    /// Only operators whose name contains one of these texts
    #[arg(long)]
    operators: Vec<String>,
    /// Only sensor sets whose name contains one of these texts
    #[arg(long)]
    sensors: Vec<String>,
    /// Rule files instead of the default ones
    #[arg(long)]
    rules: Vec<PathBuf>,
    /// Also prints a line for each failure that is not found, and for each false one
    #[arg(long)]
    each: bool,
    /// Prints only how many failures the ground truth contains
    #[arg(long)]
    truth: bool,
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
    let selected = |name: &str, parts: &[String]| parts.is_empty() || parts.iter().any(|part| name.contains(part));
    let sets: Vec<&SensorSet> =
        sensors::SETS.iter().filter(|set| !args.truth && selected(set.name, &args.sensors)).collect();
    let cases: Vec<(&str, &str, u64)> = shipped::failing()
        .filter(|(operator, _)| selected(operator, &args.operators))
        .flat_map(|(operator, scene)| args.seeds.clone().map(move |seed| (operator, scene, seed)))
        .collect();
    let trials: Result<Vec<Trial>, String> = cases
        .par_iter()
        .map(|&(operator, scene, seed)| {
            let trial = Trial::run(operator, scene, seed, &sets, &args.rules);
            trial.map_err(|error| format!("{operator} {seed}: {error}"))
        })
        .collect();
    let trials = trials?;
    if args.each {
        trials.iter().flat_map(|trial| trial.errors(&sets)).for_each(|line| println!("{line}"));
    }
    println!("{}", tables::injected(&trials));
    if !args.truth {
        println!("{}\n{}", tables::found(&trials, &sets), tables::undetectable(&trials, &sets));
    }
    Ok(())
}
