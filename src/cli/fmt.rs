//! `teachtree fmt`: rule files in one style.

use super::{Failure, output};
use std::io::Read;
use std::path::{Path, PathBuf};
use teachtree_base::diagnostic::{Source, Sources, render};
use teachtree_base::error::InputError;
use teachtree_language::MAX_BYTES;
use teachtree_language::format::format;
use teachtree_logs::read::text;

/// Options of `fmt`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree fmt tap.rules          write it in the one style\n  teachtree fmt --check rules/     list the files that are not; exit status 1 when there are any\n  teachtree fmt - < tap.rules      from standard input to standard output"
)]
pub struct Args {
    /// Rule files, and folders of them; `-` for standard input
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Write nothing; list the files that would change
    #[arg(long)]
    check: bool,
}

/// Runs `fmt`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let mut failures = Vec::new();
    let mut changed = Vec::new();
    for file in all_rules(&args.files)? {
        let shown = file.display().to_string();
        let text = read(&file)?;
        let formatted = match format(&text) {
            Ok(formatted) => formatted,
            // The other files are worth formatting all the same.
            Err(findings) => {
                let sources = Sources { files: vec![Source { name: shown, text }] };
                failures.push(Failure::Text(render(&findings, &sources, output::color_on_stderr())));
                continue;
            }
        };
        if file == Path::new("-") && !args.check {
            output::print_data(&formatted)?;
        } else if formatted != text {
            if !args.check {
                output::write(&file, &formatted, &[])?;
            }
            changed.push(shown);
        }
    }
    for file in &changed {
        output::print(&format!("{} {file}\n", if args.check { "would change" } else { "changed" }))?;
    }
    Failure::all(failures)?;
    if args.check && !changed.is_empty() { Err(Failure::Negative) } else { Ok(()) }
}

fn read(file: &Path) -> Result<String, InputError> {
    if file == Path::new("-") {
        let mut text = String::new();
        let read = std::io::stdin().lock().read_to_string(&mut text);
        return read.map(|_| text).map_err(|error| InputError::unreadable("standard input", &error));
    }
    text::read(file, MAX_BYTES)
}

/// The files, a folder replaced by the `.rules` files in it, by name.
pub fn all_rules(paths: &[PathBuf]) -> Result<Vec<PathBuf>, InputError> {
    let mut files = Vec::new();
    for path in paths {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let fail = |error: std::io::Error| InputError::unreadable(path.display().to_string(), &error);
        let mut found = Vec::new();
        for entry in std::fs::read_dir(path).map_err(fail)? {
            let file = entry.map_err(fail)?.path();
            if file.extension().is_some_and(|ending| ending == "rules") && file.is_file() {
                found.push(file);
            }
        }
        found.sort();
        files.append(&mut found);
    }
    Ok(files)
}
