//! `teachtree graph`: the trees of rules as diagrams, and which leaf can follow which; with what a recording shows of them.

use super::analysis::AnalysisArgs;
use super::output_args::{FormatArg, OutArg};
use super::rules::{HandArg, RuleArgs, SetArg, load_files};
use super::source::SourceArgs;
use super::truth::TrackArg;
use super::{Failure, output};
use std::path::{Path, PathBuf};
use teachtree_analysis::TrackId;
use teachtree_analysis::explain::{self, TreeTrace, tree_trace};
use teachtree_base::error::InputError;
use teachtree_base::units::time;
use teachtree_language::graph::transitions::{NONE, SEPARATE, transitions};
use teachtree_language::graph::{lower, text};
use teachtree_language::rules::{Label, TreeScope};
use teachtree_report::diagram::{self, CurrentLeaf, DiagramFormat, Outline, TakenPath};
use teachtree_session::{Analysis, Track};
use teachtree_session::{AnalysisInternals, RulesInternals};

/// Options of `graph`.
#[derive(clap::Args)]
#[command(
    mut_arg("set", |arg| arg.requires("log")),
    after_help = "Examples:\n  teachtree graph\n  teachtree graph tap.rules --format svg -o tap.svg\n  teachtree graph --log demonstration.csv --at 8.5s --format svg -o at.svg\n  teachtree graph tap.rules --transitions --format mermaid\n  teachtree graph --transitions --log demonstration.csv"
)]
pub struct Args {
    /// Rule files; by default the shipped `contact.rules`, or `bimanual.rules` for a log of two hands, and `failures.rules`
    files: Vec<PathBuf>,
    /// Draw which leaf can follow which, instead of the trees
    #[arg(long)]
    transitions: bool,
    #[command(flatten)]
    form: FormatArg<Format>,
    #[command(flatten)]
    out: OutArg,
    /// A recording: its path through the tree at `--at` is marked, its transitions are counted
    #[arg(long, value_name = "LOG")]
    log: Option<PathBuf>,
    /// The time in the recording, `3.41s` or `3410ms`
    #[arg(long, value_name = "TIME", value_parser = time, requires = "log")]
    at: Option<f64>,
    /// The track whose tree is drawn; by default all trees
    #[arg(long, value_enum, value_name = "TRACK", requires = "log")]
    track: Option<TrackArg>,
    #[command(flatten)]
    hand: HandArg,
    #[command(flatten)]
    set: SetArg,
    #[command(flatten)]
    source: SourceArgs,
    /// Print the compiled form that the engine runs: shared values and two-way tests, as text
    #[arg(long, conflicts_with_all = ["transitions", "log", "format"])]
    compiled: bool,
}

/// Forms of a diagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// For terminals
    Text,
    /// For Graphviz
    Dot,
    /// For Markdown
    Mermaid,
    /// A picture
    Svg,
}

impl From<Format> for DiagramFormat {
    fn from(format: Format) -> Self {
        match format {
            Format::Text => Self::Text,
            Format::Dot => Self::Dot,
            Format::Mermaid => Self::Mermaid,
            Format::Svg => Self::Svg,
        }
    }
}

/// Runs `graph`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let drawn = match &args.log {
        Some(log) => of_recording(args, log)?,
        None if args.source.binding.is_some() || args.source.scene.is_some() => {
            let message = "--binding and --scene are for a recording, found none";
            return Err(InputError::new("the command line", message).help("add `--log LOG`").into());
        }
        None => {
            let loaded = load_files(&args.files, args.hand.file.as_deref())?;
            let rules = loaded.set();
            if args.compiled {
                text(&lower(rules))
            } else if args.transitions {
                let all: Vec<_> =
                    transitions(rules).iter().map(|of| diagram::transition_diagram(rules, of, None, None)).collect();
                diagram::transitions(&all, args.form.format.into())
            } else {
                let trees: Vec<Outline> = rules.trees.iter().map(|tree| diagram::outline(rules, tree, None)).collect();
                diagram::trees(&trees, args.form.format.into())
            }
        }
    };
    match &args.out.file {
        Some(path) => output::write(path, &drawn, &analysis(args).inputs(args.log.as_slice()))?,
        None => args.form.print(&drawn)?,
    }
    Ok(())
}

/// The rules that the diagram is of, and how the recording is read.
fn analysis(args: &Args) -> AnalysisArgs {
    let rules = RuleArgs { rules: args.files.clone(), hand: args.hand.clone(), set: args.set.clone() };
    AnalysisArgs { rules, source: args.source.clone() }
}

/// The diagram with what a recording took.
fn of_recording(args: &Args, log: &Path) -> Result<String, Failure> {
    if args.at.is_none() && !args.transitions {
        return Err(InputError::new("--log", "found no time at which the tree is marked")
            .help("add `--at 2.5s`, or `--transitions` to count transitions")
            .into());
    }
    let analysis = analysis(args);
    let found = analysis.analyze(&analysis.read(log)?)?;
    let rules = found.rules().set();
    let tracks: Vec<TrackId> = match args.track {
        Some(track) => vec![track.into()],
        None => found.tracks().map(Track::who).collect(),
    };
    let mut moments = Vec::new();
    for who in &tracks {
        let taken = match args.at {
            Some(at) => taken(&found, *who, at)?,
            None => None,
        };
        moments.extend(taken);
    }
    if args.at.is_some() && moments.is_empty() {
        let whom = args.track.map_or("any track".to_string(), |track| format!("`{}`", TrackId::from(track)));
        let message = format!("there is no tree that labels {whom} in this recording");
        return Err(InputError::new("--track", message).help("tracks are left, right and both").into());
    }
    let scope = |who: TrackId| if who == TrackId::Both { TreeScope::BothHands } else { TreeScope::EachHand };
    if !args.transitions {
        let tree = |(who, taken, _): &(TrackId, TakenPath, CurrentLeaf)| {
            rules.tree(scope(*who)).map(|tree| diagram::outline(rules, tree, Some(taken)))
        };
        let trees: Vec<Outline> = moments.iter().filter_map(tree).collect();
        return Ok(diagram::trees(&trees, args.form.format.into()));
    }
    let only = args.track.map(TrackId::from);
    let side = match only {
        Some(TrackId::Hand(side)) => Some(side),
        _ => None,
    };
    let name = log.display().to_string();
    let mut all = Vec::new();
    for of in transitions(rules) {
        if tracks.iter().any(|who| scope(*who) == of.scope) {
            let mut transition_diagram =
                diagram::transition_diagram(rules, &of, Some((&name, &found.run()?.leaves)), side);
            let now = moments.iter().filter(|(who, ..)| scope(*who) == of.scope).map(|(.., now)| now.clone());
            transition_diagram.now = now.collect();
            all.push(transition_diagram);
        }
    }
    Ok(diagram::transitions(&all, args.form.format.into()))
}

/// The path through the tree of a track at a time.
fn taken(found: &Analysis, who: TrackId, at_s: f64) -> Result<Option<(TrackId, TakenPath, CurrentLeaf)>, Failure> {
    let analyzed = found.explained()?;
    let explain::AnalyzedRecording { rules, frames, .. } = analyzed;
    let name = |label: Option<Label>| label.map_or(SEPARATE.to_string(), |label| rules.label_name(label));
    Ok(tree_trace(&analyzed, who, at_s)?.map(|TreeTrace { path, frame, leaf, before }| {
        let leaf = name(leaf);
        let time_s = frames.time.get(frame).copied().unwrap_or_default();
        let caption = format!("{who} at {time_s:.3} s: {leaf}");
        let before = before.map_or(NONE.to_string(), name);
        (who, TakenPath { path, caption: caption.clone() }, CurrentLeaf { caption, before, leaf })
    }))
}
