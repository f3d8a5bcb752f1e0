//! What a terminal shows while a command works: that it does, and nothing of it once there is a result.

use std::io::{Read as _, Write as _};
use std::process::{Command, Stdio};

#[test]
fn a_command_that_takes_long_says_that_it_works() {
    let there_is =
        |tool: &str| Command::new(tool).arg("--version").output().is_ok_and(|output| output.status.success());
    if !there_is("script") {
        let _ = writeln!(std::io::stderr(), "skipped: `script`, which makes terminals, is not installed");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let program = env!("CARGO_BIN_EXE_teachtree");
    // It waits for its log, as long as this test wants it to.
    let shell = |more: &str| {
        let line = format!("cat pipe | '{program}' analyze - --format json {more}");
        let mut command = Command::new("script");
        command.args(["-qec", &line, "/dev/null"]).current_dir(folder.path()).env("TERM", "xterm");
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null());
        command
    };
    assert!(Command::new("mkfifo").arg(folder.path().join("pipe")).status().unwrap().success());
    let mut child = shell("").spawn().unwrap();
    let mut pipe = std::fs::OpenOptions::new().write(true).open(folder.path().join("pipe")).unwrap();
    let mut terminal = child.stdout.take().unwrap();
    let (mut shown, mut bytes) = (String::new(), [0; 256]);
    while !shown.contains("analyze") {
        let count = terminal.read(&mut bytes).unwrap();
        assert!(count > 0, "the program ended without a sign: {shown}");
        shown += &String::from_utf8_lossy(&bytes[..count]);
    }
    pipe.write_all(b"no log\n").unwrap();
    drop(pipe);
    let mut rest = String::new();
    terminal.read_to_string(&mut rest).unwrap();
    child.wait().unwrap();
    // The sign is gone from the line before the error stands there.
    let error = rest.find("error").unwrap_or_else(|| panic!("{rest}"));
    assert!(
        rest[..error].ends_with("\u{1b}[2K") || rest[..error].ends_with('\r') || !rest[error..].contains("analyze"),
        "{rest:?}"
    );
}
