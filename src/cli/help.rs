//! The list of commands in `teachtree --help`, by what they are for; completions for shells and the manual.

use super::{Failure, output};
use clap::Command;
use clap::builder::StyledStr;
use std::fmt::Write;

/// The commands by group. The test `each_command_is_listed_once` holds it against the commands that there are.
const GROUPS: &[(&str, &[&str])] = &[
    (
        "Recognize",
        &[
            "demo", "init", "inspect", "analyze", "live", "annotate", "export", "audit", "explain", "score", "agree",
            "studio",
        ],
    ),
    ("Write rules", &["check", "fmt", "graph", "test", "fit", "learn", "prove", "diff"]),
    ("Robot", &["teach", "retarget", "simulate", "certify"]),
    ("Tools", &["config", "list", "show", "lsp", "completions", "man"]),
];

/// The command line with its commands listed by group.
pub fn grouped(command: Command) -> Command {
    let styles = command.get_styles().clone();
    let (header, literal) = (styles.get_header(), styles.get_literal());
    let mut list = String::new();
    for (heading, names) in GROUPS {
        let known: Vec<&Command> = names.iter().filter_map(|name| command.find_subcommand(name)).collect();
        if known.is_empty() {
            continue;
        }
        let _ = writeln!(list, "{header}{heading}:{header:#}");
        for one in known {
            let about = one.get_about().map(ToString::to_string).unwrap_or_default();
            let _ = writeln!(list, "  {literal}{:<12}{literal:#}{about}", one.get_name());
        }
        list.push('\n');
    }
    let template =
        format!("{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{list}{header}Options:{header:#}\n{{options}}");
    command.help_template(StyledStr::from(template))
}

/// Options of `completions`.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  teachtree completions bash > ~/.local/share/bash-completion/completions/teachtree
  teachtree completions zsh > ~/.zfunc/_teachtree
  teachtree completions fish > ~/.config/fish/completions/teachtree.fish")]
pub struct CompletionsArgs {
    /// The shell
    #[arg(value_enum)]
    shell: clap_complete::Shell,
}

/// Prints the completion script of a shell.
pub fn completions(args: &CompletionsArgs, mut command: Command) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, "teachtree", &mut script);
    Ok(output::print_data(&String::from_utf8_lossy(&script))?)
}

/// Options of `man`.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  teachtree man | man -l -\n  teachtree man analyze > teachtree-analyze.1")]
pub struct ManArgs {
    /// The command; by default the overview
    command: Option<String>,
}

/// Prints a manual page.
pub fn man(args: &ManArgs, mut command: Command) -> Result<(), Failure> {
    use teachtree_base::error::InputError;
    let failed = |error: std::io::Error| InputError::new("the manual", error.to_string());
    command.build();
    let page = match &args.command {
        None => command,
        Some(name) => command.find_subcommand(name).cloned().ok_or_else(|| {
            InputError::new("the command line", format!("there is no command `{name}`"))
                .help("`teachtree --help` lists the commands")
        })?,
    };
    let mut text = Vec::new();
    clap_mangen::Man::new(page).render(&mut text).map_err(failed)?;
    Ok(output::print_data(&String::from_utf8_lossy(&text))?)
}
