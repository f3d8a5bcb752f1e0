//! `teachtree fmt`: rule files in one style.

use super::output_args::FormatArg;
use super::{Failure, output};
use serde_json::json;
use std::io::Read;
use std::path::{Path, PathBuf};
use teachtree_analysis::json::{VERSION, printed};
use teachtree_base::diagnostic::{Source, Sources, render};
use teachtree_base::error::InputError;
use teachtree_language::MAX_BYTES;
use teachtree_language::format::format;
use teachtree_logs::read::text;

/// Options of `fmt`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  teachtree fmt tap.rules          format the file\n  teachtree fmt --check rules/     list unformatted files; exit status 1 if there are any\n  teachtree fmt - < tap.rules      from standard input to standard output"
)]
pub struct Args {
    /// Rule files, and folders of them; `-` for standard input
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Write nothing; list the files that would change
    #[arg(long)]
    check: bool,
    #[command(flatten)]
    form: FormatArg<Format>,
}

/// Forms of the list of files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// A line for each file that changes
    Text,
    /// `teachtree.fmt/1`, with all files
    Json,
}

/// Runs `fmt`.
pub fn run(args: &Args) -> Result<(), Failure> {
    let files = all_rules(&args.files)?;
    let is_stream = |file: &Path| file == Path::new("-") && !args.check;
    if args.form.format == Format::Json && files.iter().any(|file| is_stream(file)) {
        let message = "standard input goes to standard output, which --format json needs";
        return Err(InputError::new("-", message).help("add --check, or name a file").into());
    }
    let (mut failures, mut formatted) = (Vec::new(), Vec::new());
    for file in files {
        let shown = file.display().to_string();
        let text = read(&file)?;
        let new = match format(&text) {
            Ok(new) => new,
            // The other files are still formatted.
            Err(findings) => {
                let sources = Sources { files: vec![Source { name: shown, text }] };
                failures.push(Failure::Text(render(&findings, &sources, output::color_on_stderr())));
                continue;
            }
        };
        if is_stream(&file) {
            output::print_data(&new)?;
            continue;
        }
        let changes = new != text;
        if changes && !args.check {
            output::write(&file, &new, &[])?;
        }
        formatted.push((shown, changes));
    }
    let changed: Vec<&str> =
        formatted.iter().filter(|(_, changes)| *changes).map(|(shown, _)| shown.as_str()).collect();
    let what = if args.check { "would change" } else { "changed" };
    match args.form.format {
        Format::Text => output::print(&changed.iter().map(|file| format!("{what} {file}\n")).collect::<String>())?,
        Format::Json => {
            let files = formatted.iter().map(|(file, changes)| json!({"file": file, "changes": changes}));
            let files: Vec<_> = files.collect();
            let document =
                json!({"schema": "teachtree.fmt/1", "version": VERSION, "written": !args.check, "files": files});
            args.form.print(&printed(&document))?;
        }
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
