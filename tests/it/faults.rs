//! Kills, full disks, interruptions and refused places: files that belong together are all new, all as before, or refused with a message.
//!
//! `TEACHTREE_KILLS=200 cargo test --test it -- faults::` kills each command 200 times; each is killed once by default.

use crate::program::{all_said, complained, demonstrate, program, teachtree_in};
use std::collections::BTreeMap;
use std::os::unix::fs::PermissionsExt as _;
use std::os::unix::process::ExitStatusExt as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Instant;

/// Files by name.
type Files = BTreeMap<String, Vec<u8>>;

/// The files of a folder, those that are hidden apart.
fn files(folder: &Path) -> (Files, Vec<String>) {
    let (mut seen, mut hidden) = (Files::new(), Vec::new());
    for entry in std::fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        let name = entry.file_name().into_string().unwrap();
        if name.starts_with('.') {
            hidden.push(name);
        } else if entry.path().is_file() {
            seen.insert(name, std::fs::read(entry.path()).unwrap());
        }
    }
    (seen, hidden)
}

fn put(folder: &Path, files: &Files) {
    for (name, bytes) in files {
        std::fs::write(folder.join(name), bytes).unwrap();
    }
}

/// Number of kills per command, and number of concurrent writes.
fn kills() -> u32 {
    std::env::var("TEACHTREE_KILLS").ok().and_then(|kills| kills.parse().ok()).unwrap_or(1)
}

/// Runs the program; it must succeed.
fn run(folder: &Path, args: &[&str]) -> Output {
    let output = teachtree_in(folder, args);
    assert!(output.status.success(), "{args:?}: {}", all_said(&output));
    output
}

const TEACH: [&str; 5] = ["teach", "push", "push", "-o", "log.csv"];

/// The files of one recording by another seed.
fn recording(seed: &str) -> Files {
    let folder = tempfile::tempdir().unwrap();
    demonstrate("push", &["--seed", seed], folder.path().join("log.csv"));
    files(folder.path()).0
}

fn says_skipped(why: &str) {
    says(&format!("skipped: {why}"));
}

/// Past the capture of the harness, so that it is always visible.
fn says(text: &str) {
    use std::io::Write as _;
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// `teach` with system calls that fail or kill, as `strace` injects them; `None` where there is no `strace`.
fn injected(folder: &Path, inject: &str, args: &[&str]) -> Option<Output> {
    let calls = inject.split(':').next().unwrap();
    let output = Command::new("strace")
        .args(["-f", "-qqq", "-o", "/dev/null", "-e", &format!("trace={calls}"), "-e", &format!("inject={inject}")])
        .arg(env!("CARGO_BIN_EXE_teachtree"))
        .args(args)
        .current_dir(folder)
        .env("COLUMNS", "90")
        .env("RAYON_NUM_THREADS", "1")
        .output()
        .ok()?;
    // A sandbox may forbid it.
    (!complained(&output).contains("ptrace")).then_some(output)
}

/// Whether a recording is one of two, or is refused where its files are read.
fn whole_or_refused(folder: &Path, old: &Files, new: &Files, what: &str) {
    let (seen, _) = files(folder);
    if seen != *old && seen != *new {
        let output = teachtree_in(folder, &["analyze", "log.csv"]);
        assert_eq!(output.status.code(), Some(2), "{what}: a mix is read: {}", all_said(&output));
        let printed = complained(&output);
        assert!(printed.contains("was being replaced when the program was killed"), "{what}: {printed}");
    }
}

/// At each step of putting the files of a recording in their places, the program is killed once.
#[test]
fn a_kill_between_two_renames_is_detected() {
    let (old, new) = (recording("1"), recording("2"));
    let again = [&TEACH[..], &["--seed", "2"]].concat();
    let (mut mixed, mut done) = (0, false);
    for at in 1..12 {
        let folder = tempfile::tempdir().unwrap();
        put(folder.path(), &old);
        let inject = format!("rename,renameat,renameat2,unlink,unlinkat:signal=KILL:when={at}");
        let Some(output) = injected(folder.path(), &inject, &again) else {
            return says_skipped("no strace is here to kill the program between two system calls");
        };
        whole_or_refused(folder.path(), &old, &new, &inject);
        mixed += usize::from(files(folder.path()).0 != old && files(folder.path()).0 != new);
        done |= output.status.success();
        // The next run finishes it, and leaves nothing.
        run(folder.path(), &again);
        assert_eq!(files(folder.path()), (new.clone(), vec![]), "{inject}");
        run(folder.path(), &["analyze", "log.csv"]);
        if done {
            break;
        }
    }
    assert!(done && mixed > 0, "the program was killed in between {mixed} times");
}

/// Kills the program once at each step of putting the files of an analysis in place: no old file is left beside a new one.
#[test]
fn files_of_two_analyses_are_never_there_together() {
    let args = [
        "analyze", "log.csv", "--mcap", "v.mcap", "--trace", "t.json", "--frames", "f.csv", "--report", "p.html", "-o",
        "o.txt",
    ];
    let outputs = ["v.mcap", "v.foxglove.json", "t.json", "f.csv", "p.html", "o.txt"];
    let of = |seed: &str| {
        let (folder, recording) = (tempfile::tempdir().unwrap(), recording(seed));
        put(folder.path(), &recording);
        run(folder.path(), &args);
        let mut made = files(folder.path()).0;
        made.retain(|name, _| !recording.contains_key(name));
        (recording, made)
    };
    let ((_, old), (recording, new)) = (of("1"), of("2"));
    let differ: Vec<&str> = outputs.into_iter().filter(|name| old.get(*name) != new.get(*name)).collect();
    assert!(differ.len() >= 4 && old.len() == 6 && new.len() == 6, "{differ:?}");
    let mut killed = 0;
    // `strace` counts each system call separately.
    for (call, at) in ["rename", "renameat", "renameat2", "unlink", "unlinkat"]
        .into_iter()
        .flat_map(|call| (1..8).map(move |at| (call, at)))
    {
        let folder = tempfile::tempdir().unwrap();
        put(folder.path(), &recording);
        put(folder.path(), &old);
        let inject = format!("{call}:signal=KILL:when={at}");
        let Some(output) = injected(folder.path(), &inject, &args) else {
            return says_skipped("no strace is here to kill the program between two system calls");
        };
        let (mut seen, _) = files(folder.path());
        seen.retain(|name, _| differ.contains(&name.as_str()));
        let are = |of: &Files| seen.iter().all(|(name, bytes)| of.get(name) == Some(bytes));
        assert!(are(&old) || are(&new), "{inject}: {:?}", seen.keys());
        if output.status.success() {
            continue;
        }
        killed += 1;
        // The next run removes all temporary files.
        run(folder.path(), &args);
        let (mut seen, hidden) = files(folder.path());
        seen.retain(|name, _| new.contains_key(name));
        assert_eq!((seen == new, hidden), (true, vec![]), "{inject}");
    }
    // Six files are moved away and six are put in place.
    assert!(killed >= 12, "the program was killed in between {killed} times");
}

/// If a file cannot be put in place, all files stay unchanged.
#[test]
fn an_analysis_that_cannot_be_put_in_place_leaves_the_previous_one() {
    let folder = tempfile::tempdir().unwrap();
    put(folder.path(), &recording("1"));
    let args = ["analyze", "log.csv", "--trace", "t.json", "--frames", "f.csv", "-o", "o.txt"];
    let old: Files = ["t.json", "f.csv", "o.txt"].map(|name| (name.to_string(), name.as_bytes().to_vec())).into();
    put(folder.path(), &old);
    let before = files(folder.path());
    let mut failed = 0;
    for (call, at) in ["rename", "renameat", "renameat2"].into_iter().flat_map(|call| (1..4).map(move |at| (call, at)))
    {
        let inject = format!("{call}:error=EACCES:when={at}");
        let Some(output) = injected(folder.path(), &inject, &args) else {
            return says_skipped("no strace is here to let system calls fail");
        };
        if output.status.success() {
            // The program makes fewer such calls.
            put(folder.path(), &old);
            continue;
        }
        failed += 1;
        assert_eq!(output.status.code(), Some(2), "{inject}: {}", all_said(&output));
        assert_eq!(files(folder.path()), before, "{inject}");
    }
    assert!(failed >= 6, "a call failed {failed} times");
}

/// From each write on, nothing can be written any more.
#[test]
fn a_full_disk_leaves_what_was_there() {
    let (old, new) = (recording("1"), recording("2"));
    let again = [&TEACH[..], &["--seed", "2"]].concat();
    let folder = tempfile::tempdir().unwrap();
    put(folder.path(), &old);
    for call in ["write", "fsync"] {
        for at in [1, 2, 3, 5, 50] {
            let inject = format!("{call}:error=ENOSPC:when={at}");
            let Some(output) = injected(folder.path(), &inject, &again) else {
                return says_skipped("no strace is here to let system calls fail");
            };
            let (seen, hidden) = files(folder.path());
            assert!(hidden.is_empty(), "{inject}: {hidden:?}");
            match output.status.code() {
                // What was hit was not a file, or there are fewer such calls; the message itself can be what is not written.
                Some(0) => {
                    assert!(seen == new, "{inject}");
                    put(folder.path(), &old);
                }
                Some(2) => {
                    assert!(seen == old || seen == new, "{inject}");
                    assert!(complained(&output).contains("cannot be written"), "{inject}: {}", complained(&output));
                    put(folder.path(), &old);
                }
                other => panic!("{inject}: {other:?} {}", complained(&output)),
            }
        }
    }
}

/// A file system of a few megabytes; unmounted in the end.
struct Disk(tempfile::TempDir);

impl Disk {
    fn of(megabytes: u32) -> Option<Self> {
        let folder = tempfile::tempdir().unwrap();
        let size = format!("size={megabytes}m");
        let mount = Command::new("mount").args(["-t", "tmpfs", "-o", &size, "tmpfs"]).arg(folder.path()).output();
        mount.is_ok_and(|output| output.status.success()).then_some(Self(folder))
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("-l").arg(self.0.path()).status();
    }
}

#[test]
fn on_a_full_file_system_the_old_recording_stays() {
    let Some(disk) = Disk::of(3) else { return says_skipped("no file system can be mounted: this needs root") };
    let old = recording("1");
    put(disk.0.path(), &old);
    let output = teachtree_in(disk.0.path(), &[&TEACH[..], &["--seed", "2"]].concat());
    assert_eq!(output.status.code(), Some(2), "{}", all_said(&output));
    assert!(complained(&output).contains("log.csv: cannot be written: No space left"), "{}", complained(&output));
    assert_eq!(files(disk.0.path()), (old, vec![]));
}

#[test]
fn a_folder_that_may_not_be_written_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let closed = folder.path().join("closed");
    std::fs::create_dir(&closed).unwrap();
    std::fs::set_permissions(&closed, std::fs::Permissions::from_mode(0o555)).unwrap();
    if std::fs::write(closed.join("a"), "").is_ok() {
        return says_skipped("root may write to any folder");
    }
    let output = teachtree_in(&closed, &TEACH);
    assert_eq!(output.status.code(), Some(2), "{}", all_said(&output));
    assert!(complained(&output).contains("the folder cannot be written"), "{}", complained(&output));
}

/// A marker without a program that holds it: as after a kill at the worst moment.
#[test]
fn a_log_that_was_being_replaced_is_refused_until_it_is_written_again() {
    let folder = tempfile::tempdir().unwrap();
    run(folder.path(), &TEACH);
    std::fs::write(folder.path().join(".teachtree-log.csv.replacing"), "").unwrap();
    for args in [&["analyze", "log.csv"][..], &["inspect", "log.csv"], &["analyze", "./log.csv", "--report", "a.html"]]
    {
        let output = teachtree_in(folder.path(), args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        let printed = complained(&output);
        assert!(printed.contains("may be of two recordings") && printed.contains("delete "), "{args:?}: {printed}");
    }
    run(folder.path(), &TEACH);
    run(folder.path(), &["analyze", "log.csv"]);
}

#[test]
fn an_interrupted_program_leaves_nothing_behind() {
    let (old, new) = (recording("1"), recording("2"));
    let again = [&TEACH[..], &["--seed", "2"]].concat();
    let folder = tempfile::tempdir().unwrap();
    for at in 1..4 {
        put(folder.path(), &old);
        // Temporary files are there when they are synchronized with the disk.
        let Some(output) = injected(folder.path(), &format!("fsync:signal=INT:when={at}"), &again) else {
            return says_skipped("no strace is here to send signals at a system call");
        };
        let (seen, hidden) = files(folder.path());
        assert!(seen == old || seen == new, "{}", all_said(&output));
        assert!(hidden.is_empty(), "{hidden:?}");
        assert!(matches!(output.status.code(), Some(0 | 130)), "{:?}", output.status);
    }
}

#[test]
fn files_of_a_killed_program_are_removed_by_the_next_one() {
    let folder = tempfile::tempdir().unwrap();
    let left = folder.path().join(".teachtree-x1Y2z3");
    std::fs::write(&left, "half of a log").unwrap();
    // One is held by a program that is at work.
    let held_path = folder.path().join(".teachtree-a4B5c6");
    let held = std::fs::File::create(&held_path).unwrap();
    held.lock().unwrap();
    run(folder.path(), &TEACH);
    assert!(!left.exists() && held_path.exists());
    drop(held);
    run(folder.path(), &TEACH);
    assert!(!held_path.exists());
}

#[test]
fn modes_and_links_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("log.csv"), "old").unwrap();
    std::fs::set_permissions(path("log.csv"), std::fs::Permissions::from_mode(0o640)).unwrap();
    std::fs::create_dir(path("far")).unwrap();
    // One leads to a file, one to a place where none is yet.
    std::fs::write(path("far/there.txt"), "old").unwrap();
    std::os::unix::fs::symlink("far/there.txt", path("there.txt")).unwrap();
    std::os::unix::fs::symlink("far/new.txt", path("new.txt")).unwrap();
    run(folder.path(), &TEACH);
    assert_eq!(std::fs::metadata(path("log.csv")).unwrap().permissions().mode() & 0o777, 0o640);
    for name in ["there.txt", "new.txt"] {
        run(folder.path(), &["analyze", "log.csv", "-o", name]);
        assert!(path(name).is_symlink(), "{name}");
        assert!(std::fs::read_to_string(path("far").join(name)).unwrap().contains("right"), "{name}");
    }
}

/// Several programs that write one recording at once leave that of one of them.
#[test]
fn two_runs_at_once_leave_one_recording() {
    let seeds = ["1", "2", "3", "4"];
    let all: Vec<Files> = seeds.iter().map(|seed| recording(seed)).collect();
    let folder = tempfile::tempdir().unwrap();
    for _ in 0..kills() {
        let started = seeds.map(|seed| {
            let mut command = program(folder.path(), &[&TEACH[..], &["--seed", seed]].concat());
            command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
        });
        for process in started {
            let output = process.wait_with_output().unwrap();
            assert!(output.status.success(), "{}", complained(&output));
        }
        let (seen, hidden) = files(folder.path());
        assert!(all.contains(&seen) && hidden.is_empty(), "{hidden:?}");
    }
}

#[test]
fn a_reader_that_goes_away_is_not_an_error() {
    let folder = tempfile::tempdir().unwrap();
    run(folder.path(), &TEACH);
    for args in [&["analyze", "log.csv", "--format", "json"][..], &["graph"], &["man"], &["check", "--explain", "W404"]]
    {
        let mut process = program(folder.path(), args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(process.stdout.take());
        let output = process.wait_with_output().unwrap();
        assert_eq!((output.status.code(), complained(&output).as_str()), (Some(0), ""), "{args:?}");
    }
    // Standard error is closed too.
    let mut process =
        program(folder.path(), &["analyze", "none.csv"]).stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    drop(process.stderr.take());
    assert_eq!(process.wait().unwrap().code(), Some(2));
}

/// Each command that writes, killed at moments spread over its run.
#[test]
fn a_kill_leaves_whole_files() {
    let kills = kills();
    let made = tempfile::tempdir().unwrap();
    run(made.path(), &TEACH);
    run(made.path(), &["retarget", "log.csv", "-o", "commands.json"]);
    let inputs = files(made.path()).0;
    for (args, logs) in [
        (&["teach", "push", "push", "-o", "new.csv"][..], true),
        (&["teach", "push", "push", "-o", "new.parquet"], true),
        (&["analyze", "log.csv", "--report", "new.html", "-o", "new.txt"], false),
        (&["score", "log.csv", "--picture", "new.svg", "-o", "new.txt"], false),
        (&["retarget", "log.csv", "-o", "new.json"], false),
        (&["simulate", "commands.json", "--scene", "push", "-o", "new.csv", "--report", "new.html"], true),
        (&["graph", "-o", "new.txt"], false),
    ] {
        let folder = tempfile::tempdir().unwrap();
        put(folder.path(), &inputs);
        let begun = Instant::now();
        let whole = teachtree_in(folder.path(), args);
        assert_ne!(whole.status.code(), Some(2), "{args:?}: {}", all_said(&whole));
        let takes = begun.elapsed();
        let (all, _) = files(folder.path());
        let new: Files = all.into_iter().filter(|(name, _)| !inputs.contains_key(name)).collect();
        assert!(!new.is_empty(), "{args:?}");
        let old: Files = new.keys().map(|name| (name.clone(), b"what was there".to_vec())).collect();
        let (mut killed, mut mixed) = (0, 0);
        for at in 0..kills {
            for name in new.keys() {
                let _ = std::fs::remove_file(folder.path().join(name));
            }
            put(folder.path(), &old);
            let mut process = program(folder.path(), args).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
            std::thread::sleep(takes * (at + 1) / (kills + 1));
            let _ = process.kill();
            let status = process.wait().unwrap();
            killed += usize::from(status.signal().is_some());
            let seen: Files = files(folder.path()).0.into_iter().filter(|(name, _)| new.contains_key(name)).collect();
            for (name, bytes) in &seen {
                assert!(new.get(name) == Some(bytes) || old.get(name) == Some(bytes), "{args:?}: {name} is broken");
            }
            if seen != new && seen != old {
                mixed += 1;
                let marked = files(folder.path()).1.iter().any(|name| name.ends_with(".replacing"));
                assert!(!logs || marked, "{args:?}: a mix of two recordings is not marked");
            }
        }
        // The next run is as the first one, and clears what was left.
        assert_eq!(teachtree_in(folder.path(), args).status.code(), whole.status.code(), "{args:?}");
        let (seen, hidden) = files(folder.path());
        assert!(new.iter().all(|(name, bytes)| seen.get(name) == Some(bytes)), "{args:?}");
        assert!(hidden.is_empty(), "{args:?}: {hidden:?}");
        if kills > 2 {
            says(&format!("{}: killed {killed} times of {kills}, {mixed} times old and new files were left", args[0]));
        }
    }
}
