//! `teachtree studio`: a page on this machine to look at recordings, correct what was found, and tune the rules.

use super::rules::RuleArgs;
use super::source::SourceArgs;
use super::{Failure, browser, on_interrupt, output};
use std::path::PathBuf;
use std::sync::Arc;
use teachtree_logs::atomic_write;
use teachtree_serve::Server;
use teachtree_session::RulesOptions;
use teachtree_studio::{Options, Studio};

/// Options of `studio`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree studio recordings/ --rules my.rules\n  teachtree studio my_set --binding arm.binding.yaml\n  teachtree studio recordings/ --rules new.rules --against old.rules\n  teachtree studio demonstration.csv --no-open --port 8000\n\nThe page is served on this machine only, at the printed address; Ctrl-C ends it. Guide: docs/studio.md"
)]
pub struct Args {
    /// Recordings; a folder, a data set or an HDF5 file stands for all its recordings; by default the current folder
    #[arg(value_name = "LOG")]
    logs: Vec<PathBuf>,
    #[command(flatten)]
    rules: RuleArgs,
    /// Rule files to compare with: their lanes are below those of the rules, differences are marked and counted; may be repeated
    #[arg(long, value_name = "FILE")]
    against: Vec<PathBuf>,
    #[command(flatten)]
    source: SourceArgs,
    /// The port of the page; by default any free port
    #[arg(long, value_name = "PORT", default_value_t = 0, hide_default_value = true)]
    port: u16,
    /// The name of the person who corrects labels; by default the user name
    #[arg(long, value_name = "NAME")]
    by: Option<String>,
    /// Print the address without opening a browser
    #[arg(long)]
    no_open: bool,
}

/// Runs `studio`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let paths = if args.logs.is_empty() { vec![PathBuf::from(".")] } else { args.logs.clone() };
    let options = Options {
        paths,
        source: args.source.options(),
        binding: args.source.binding.clone(),
        rules: args.rules.options(),
        against: args.against(),
        who: args.by.clone().or_else(user).unwrap_or_default(),
    };
    let studio = Arc::new(Studio::new(options)?);
    let server = Server::new(args.port)?;
    let recordings = studio.recordings.len();
    let count = if recordings == 1 { "1 recording".into() } else { format!("{recordings} recordings") };
    output::print(&format!("{}\n{count}; Ctrl-C ends the studio\n", server.address()))?;
    on_interrupt(|| {
        let _nothing_is_written = atomic_write::abort_writes();
        std::process::exit(0);
    });
    if !args.no_open {
        browser::open(&server.address());
    }
    studio.work();
    server.run(&studio);
    Ok(())
}

impl Args {
    /// The rules that the others are held against, with the same hand model.
    fn against(&self) -> Option<(String, RulesOptions)> {
        let rules = RuleArgs::of_files(&self.against, self.rules.hand.file.as_deref());
        let names: Vec<String> = self.against.iter().map(|file| file.display().to_string()).collect();
        (!names.is_empty()).then(|| (names.join(", "), rules.options()))
    }
}

/// The name that the system knows the user by.
fn user() -> Option<String> {
    ["USER", "USERNAME"].iter().find_map(|name| std::env::var(name).ok()).filter(|name| !name.is_empty())
}
