//! `teachtree check`: every mistake at once, and what running the rules costs.

use super::rules::name_and_value;
use super::{Failure, output};
use crate::base::diagnostic::{Severity, render};
use crate::base::hands::{Finger, Side};
use crate::engine::open::open;
use crate::graph::lower;
use crate::language::{self, Request, Rules};
use crate::stream::frames::{HandLayout, Layout};
use std::fmt::Write;
use std::path::PathBuf;

/// Options of `check`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree check                          the shipped rules\n  teachtree check tap.rules                your own file and all that it uses\n  teachtree check tap.rules --hand hand_flags.rules"
)]
pub struct Args {
    /// Rule files; the shipped `contact.rules` when left out
    files: Vec<PathBuf>,
    /// The hand file that keeps the promised signals
    #[arg(long, value_name = "FILE")]
    hand: Option<String>,
    /// Override a param, such as `touch_on=0.1N`; may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = name_and_value)]
    set: Vec<(String, String)>,
}

/// Runs `check`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let (files, hand_file, overrides) = (args.files.clone(), args.hand.clone(), args.set.clone());
    let loaded = language::load(&Request { files, hand_file, overrides, needs_tree: false });
    if loaded.unread {
        return Err(Failure::Text(render(&loaded.diagnostics, &loaded.sources, output::color_on_stderr())));
    }
    let count = |severity| loaded.diagnostics.iter().filter(|found| found.severity == severity).count();
    let (errors, warnings) = (count(Severity::Error), count(Severity::Warning));
    output::print(&render(&loaded.diagnostics, &loaded.sources, output::color()))?;
    let plural = |count: usize, word: &str| format!("{count} {word}{}", if count == 1 { "" } else { "s" });
    let files: Vec<&str> = loaded.sources.files.iter().map(|file| file.name.as_str()).collect();
    let mut out = String::new();
    let _ = writeln!(out, "{} in {}: {}", plural(errors, "error"), plural(files.len(), "file"), files.join(", "));
    if warnings > 0 {
        let _ = writeln!(out, "{}", plural(warnings, "warning"));
    }
    if let Some(rules) = &loaded.rules {
        out.push_str(&cost(rules)?);
    }
    output::print(&out)?;
    if errors > 0 || loaded.rules.is_none() { Err(Failure::No) } else { Ok(()) }
}

/// The log for which the cost is said.
fn usual_layout(sides: &[Side]) -> Layout {
    let fingers = vec![Finger::Thumb, Finger::Index, Finger::Middle, Finger::Ring, Finger::Little];
    let contacts = (1..=6).map(|at| format!("body {at}")).collect::<Vec<_>>();
    let hand = |side: &Side| HandLayout { side: *side, fingers: fingers.clone(), contacts: contacts.clone() };
    Layout { rate_hz: 1000.0, hands: sides.iter().map(hand).collect() }
}

fn cost(rules: &Rules) -> Result<String, Failure> {
    let graph = lower(rules);
    let mut out = String::new();
    let _ = writeln!(
        out,
        "\n{} primitives, {} signals, {} latches, {} trees, {} tasks, {} relabelling rules; {} shared values, {} tests",
        rules.primitives.len(),
        rules.signals.len(),
        rules.latches.len(),
        rules.trees.len(),
        rules.tasks.len(),
        rules.relabels.len(),
        graph.values.len(),
        graph.trees.iter().map(|tree| tree.decision.tests.len()).sum::<usize>(),
    );
    let settle =
        rules.trees.iter().filter_map(|tree| tree.settle.as_ref()).map(|settle| settle.value).fold(0.0, f64::max);
    let _ = writeln!(out, "at 1 kHz with five fingers a hand and six bodies to touch:");
    for (name, sides) in [("one hand", &[Side::Right][..]), ("two hands", &Side::BOTH[..])] {
        let layout = usual_layout(sides);
        let cost = open(&graph, &layout)?.cost();
        let look_ahead = f64::from(cost.look_ahead_frames) / layout.rate_hz * 1e3;
        let _ = writeln!(
            out,
            "  {name:<10} {:>4} numbers, {:>4} conditions, {:>3} memories a frame; at most {:>3} tests; {:>6} bytes of state; look-ahead {look_ahead:.0} ms, settling {:.0} ms",
            cost.numbers,
            cost.conditions,
            cost.memories,
            cost.tests,
            cost.state_bytes,
            settle * 1e3,
        );
    }
    Ok(out)
}
