//! `teachtree prove`: that an extension only adds to a rule set.

use super::output_args::FormatArg;
use super::rules::load_files;
use super::{Failure, diff};
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use teachtree_analysis::json::{VERSION, printed};
use teachtree_language::DEFAULT_HAND;
use teachtree_language::graph::compare::{ExtensionProof, prove_extension};
use teachtree_session::RulesInternals;

/// Options of `prove`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree prove additive single_hand.rules contact.rules\n  teachtree prove additive contact.rules tap.rules --hand hand_flags.rules\nExit status: 0 proved, 1 not proved, 2 bad input."
)]
pub struct Args {
    /// The claim to prove
    #[arg(value_enum)]
    claim: Claim,
    /// The rules that are extended
    base: PathBuf,
    /// The rules that use and extend them
    extended: PathBuf,
    /// The hand model that implements the abstract signals of both
    #[arg(long, value_name = "FILE")]
    hand: Option<String>,
    #[command(flatten)]
    form: FormatArg<Format>,
}

/// What can be proved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Claim {
    /// Base and extension analyze every recording alike until a primitive of the extension occurs
    Additive,
}

/// Forms of a proof.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// Lines for the terminal
    Text,
    /// `teachtree.proof/1`
    Json,
}

/// Runs `prove`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let Claim::Additive = args.claim;
    let read = |file: &PathBuf| load_files(std::slice::from_ref(file), args.hand.as_deref());
    let rules = read(&args.base)?;
    let proof = prove_extension(rules.set(), read(&args.extended)?.set());
    let hand = args.hand.as_deref().unwrap_or(DEFAULT_HAND);
    let hand = rules.files().any(|file| Path::new(file).ends_with(hand)).then_some(hand);
    args.form.print(&match args.form.format {
        Format::Text => text(args, &proof, hand),
        Format::Json => printed(&json(args, &proof, hand)),
    })?;
    if proof.is_proved() { Ok(()) } else { Err(Failure::Negative) }
}

/// The result for people.
fn text(args: &Args, proof: &ExtensionProof, hand: Option<&str>) -> String {
    let (base, extended) = (args.base.display(), args.extended.display());
    let mut text = String::new();
    if proof.is_proved() {
        let _ = writeln!(text, "proved: {extended} only adds to {base}");
        write_proof(proof, hand, &mut text);
        return text;
    }
    let is_undecided = proof.findings.is_empty() && proof.trees.differences.is_empty();
    let _ = if is_undecided {
        writeln!(text, "not proved: whether {extended} only adds to {base} is undecided")
    } else {
        writeln!(text, "not proved: {extended} does not only add to {base}")
    };
    for finding in &proof.findings {
        let _ = writeln!(text, "  {}   {}", finding.what, finding.place);
    }
    diff::write_tree_differences(&proof.trees, &mut text);
    if proof.of_one_hand {
        text.push_str("  for recordings of one hand, it is proved\n");
    }
    text
}

/// The result as `teachtree.proof/1` (docs/formats.md).
fn json(args: &Args, proof: &ExtensionProof, hand: Option<&str>) -> Value {
    let findings = proof.findings.iter().map(|finding| json!({"what": finding.what, "place": finding.place}));
    let mut document = json!({
        "schema": "teachtree.proof/1",
        "version": VERSION,
        "base": args.base.display().to_string(),
        "extended": args.extended.display().to_string(),
        "hand_model": hand,
        "proved": proof.is_proved(),
        "proved_for_one_hand": proof.is_proved() || proof.of_one_hand,
        "new": proof.new,
        "findings": findings.collect::<Vec<_>>(),
    });
    diff::add_tree_differences(&proof.trees, &mut document);
    document
}

/// Formats the result of a proof and the hand model that it holds for.
fn write_proof(proof: &ExtensionProof, hand: Option<&str>, printed: &mut String) {
    let new = if proof.new.is_empty() { "none".to_string() } else { proof.new.join(", ") };
    let _ = writeln!(printed, "  new primitives: {new}");
    for tree in &proof.trees.trees {
        let _ =
            writeln!(printed, "  {tree}: on every frame and in every state of the base, its leaf or a new primitive");
    }
    for tree in &proof.trees.alone {
        let _ = writeln!(printed, "  {tree}: a new tree, which gives `separate` or a new primitive");
    }
    printed.push_str("  channels, params, signals, latches, primitives and settling of the base keep their meaning\n");
    printed.push_str("  relabeling and tasks are those of the base where no new primitive occurs\n");
    let hand = hand.map_or(String::new(), |hand| format!(" the hand model {hand} and"));
    let _ = writeln!(
        printed,
        "  this holds for every recording that both analyze, with{hand} the declared values of params;"
    );
    printed.push_str(
        "  in a gap-free interval, leaves are equal up to the first new primitive; after it, the previous leaf differs, and so may `from`\n",
    );
}
