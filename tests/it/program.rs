//! The program as a user runs it.

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// A command line, to be run in a folder; lines are as wide as the README shows them.
pub fn program(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_teachtree"));
    command.args(args).current_dir(folder).env("COLUMNS", "90");
    command
}

/// Runs it in a folder.
pub fn teachtree_in(folder: &Path, args: &[&str]) -> Output {
    program(folder, args).output().unwrap()
}

/// Runs it in the folder of the project.
pub fn teachtree(args: &[&str]) -> Output {
    teachtree_in(Path::new(env!("CARGO_MANIFEST_DIR")), args)
}

/// What went to standard output.
pub fn said(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// What went to standard error.
pub fn complained(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// Both, what it said first.
pub fn all_said(output: &Output) -> String {
    said(output) + &complained(output)
}

/// Runs it in the folder of the project, with bytes on its standard input.
pub fn teachtree_fed(args: &[&str], bytes: &[u8]) -> Output {
    let mut command = program(Path::new(env!("CARGO_MANIFEST_DIR")), args);
    let piped = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = piped.spawn().unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let bytes = bytes.to_vec();
    // What refuses its input does not read it.
    let written = std::thread::spawn(move || drop(stdin.write_all(&bytes)));
    let output = child.wait_with_output().unwrap();
    written.join().unwrap();
    output
}

/// The Python that `TEACHTREE_PYTHON` names, if it has a module, which comes with a package.
pub fn python_with(module: &str, package: &str) -> Option<String> {
    let python = std::env::var("TEACHTREE_PYTHON").unwrap_or_else(|_| "python3".into());
    let import = format!("import {module}");
    let has = Command::new(&python).args(["-c", &import]).output().is_ok_and(|it| it.status.success());
    if !has {
        // Not by `println!`: that is shown for failed tests only.
        let _ = writeln!(std::io::stderr(), "skipped: TEACHTREE_PYTHON names no Python with {package}");
    }
    has.then_some(python)
}
