//! The program as a user runs it.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::SystemTime;

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

/// Writes what `teach SCENE OPERATOR OPTIONS` records as a CSV file, with its scene and its events beside it. Each build of the program makes a shipped
/// demonstration once, in the first test that needs it; other tests copy it.
pub fn demonstrate(scene: &str, options: &[&str], log: impl AsRef<Path>) {
    let made = demonstrations().join([&[scene], options].concat().join("_"));
    fs::create_dir_all(&made).unwrap();
    let lock = fs::File::create(made.join("lock")).unwrap();
    lock.lock().unwrap();
    let done = made.join("log.csv");
    if !done.exists() {
        let output = teachtree_in(&made, &[&["teach", scene, scene], options, &["-o", "log.csv"]].concat());
        assert!(output.status.success(), "{}", all_said(&output));
    }
    for ending in ["csv", "scene.yaml", "events.csv"] {
        fs::copy(made.join("log").with_extension(ending), log.as_ref().with_extension(ending)).unwrap();
    }
}

/// Returns the folder for demonstrations of this build of the program. Demonstrations of other builds are deleted.
fn demonstrations() -> PathBuf {
    let program = fs::metadata(env!("CARGO_BIN_EXE_teachtree")).unwrap();
    let since = program.modified().unwrap().duration_since(SystemTime::UNIX_EPOCH).unwrap();
    let all = Path::new(env!("CARGO_TARGET_TMPDIR")).join("demonstrations");
    let own = all.join(since.as_nanos().to_string());
    if !own.exists() {
        fs::create_dir_all(&own).unwrap();
        let others = fs::read_dir(&all).unwrap().flatten().filter(|entry| entry.path() != own);
        // Another test may delete them at the same time.
        others.for_each(|other| drop(fs::remove_dir_all(other.path())));
    }
    own
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
