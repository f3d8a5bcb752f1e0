//! Links and pipes among the files of a data set: a copy contains only files of the set and of its cache.

use crate::annotate::annotate;
use crate::pipes::pipe;
use crate::program::{all_said, complained};
use crate::sets::with_set;
use crate::shared::folders::copy;
use std::collections::BTreeMap;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

/// Collects the files of a folder and its subfolders by path.
fn files(root: &Path, below: &Path, found: &mut BTreeMap<PathBuf, Vec<u8>>) {
    for entry in std::fs::read_dir(root.join(below)).unwrap() {
        let path = below.join(entry.unwrap().file_name());
        let there = root.join(&path);
        assert!(!there.is_symlink(), "{}", there.display());
        if there.is_dir() {
            files(root, &path, found);
        } else {
            found.insert(path, std::fs::read(there).unwrap());
        }
    }
}

fn all(root: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    files(root, Path::new(""), &mut found);
    found
}

/// Each case has the change of a set, the path in the message, and the reason.
type Case = (fn(&Path), &'static str, &'static str);

#[test]
fn links_out_of_a_set_and_broken_links_are_refused_before_anything_is_written() {
    const FILE: &str = "set/data/chunk-000/file-000.parquet";
    let cases: [Case; 9] = [
        (|at| symlink(at.join("secret.txt"), at.join("set/notes")).unwrap(), "set/notes", "leads out of set"),
        (|at| symlink("../secret.txt", at.join("set/notes")).unwrap(), "set/notes", "leads out of set"),
        (|at| symlink("../elsewhere", at.join("set/more")).unwrap(), "set/more", "leads out of set"),
        (
            |at| symlink("/nonexistent", at.join("set/notes")).unwrap(),
            "set/notes",
            "is a link to /nonexistent, which does not exist",
        ),
        (
            |at| symlink("..", at.join("set/meta/around")).unwrap(),
            "set/meta/around",
            "is a link to a folder that it is in",
        ),
        (|at| pipe(&at.join("set/notes")), "set/notes", "is a pipe, expected a file"),
        (
            |at| {
                pipe(&at.join("set/pipe"));
                symlink("pipe", at.join("set/notes")).unwrap();
            },
            "set/notes",
            "is a pipe, expected a file",
        ),
        (
            |at| {
                // A link to a link that leads out of the set.
                symlink("two", at.join("set/notes")).unwrap();
                symlink("../secret.txt", at.join("set/two")).unwrap();
            },
            "set/notes",
            "leads out of set",
        ),
        (
            |at| {
                std::fs::rename(at.join(FILE), at.join("elsewhere/a.parquet")).unwrap();
                symlink(at.join("elsewhere/a.parquet"), at.join(FILE)).unwrap();
            },
            FILE,
            "leads out of set",
        ),
    ];
    for (put, place, why) in cases {
        let folder = with_set();
        std::fs::write(folder.path().join("secret.txt"), "TOP SECRET").unwrap();
        std::fs::create_dir(folder.path().join("elsewhere")).unwrap();
        put(folder.path());
        let names = || -> Vec<_> {
            let mut names: Vec<_> =
                std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
            names.sort();
            names
        };
        let before = names();
        let output = annotate(folder.path(), "set", "copy", &[]);
        assert_eq!(output.status.code(), Some(2), "{place}: {}", all_said(&output));
        let said = complained(&output);
        assert!(said.starts_with(&format!("error: {place}: {why}")) && !said.contains("copy:"), "{place}: {said}");
        assert!(said.contains("help: "), "{place}: {said}");
        assert_eq!(names(), before, "{place}");
    }
}

/// Links as in the cache of the Hugging Face hub, and links between files of a set.
#[test]
fn links_within_a_set_and_its_cache_are_followed() {
    let folder = with_set();
    let output = annotate(folder.path(), "set", "plain", &[]);
    assert!(output.status.success(), "{}", all_said(&output));
    let hub = folder.path().join("hub/datasets--a--b");
    let (blobs, snapshot) = (hub.join("blobs"), hub.join("snapshots/7628"));
    std::fs::create_dir_all(&blobs).unwrap();
    copy(&folder.path().join("set"), &snapshot);
    for (path, number) in all(&snapshot).keys().zip(0..) {
        let blob = blobs.join(format!("{number:04x}"));
        std::fs::rename(snapshot.join(path), &blob).unwrap();
        let up = "../".repeat(path.components().count() + 1);
        symlink(format!("{up}blobs/{number:04x}"), snapshot.join(path)).unwrap();
    }
    // The set is opened by its path and by a link to it.
    symlink(&snapshot, folder.path().join("linked")).unwrap();
    for (set, out) in [("hub/datasets--a--b/snapshots/7628", "one"), ("linked", "two")] {
        let output = annotate(folder.path(), set, out, &[]);
        assert!(output.status.success(), "{}", all_said(&output));
        assert_eq!(all(&folder.path().join(out)), all(&folder.path().join("plain")), "{set}");
    }
    std::fs::write(folder.path().join("set/README.md"), "A set.").unwrap();
    symlink("README.md", folder.path().join("set/notes")).unwrap();
    symlink("../meta", folder.path().join("set/data/meta")).unwrap();
    let output = annotate(folder.path(), "set", "three", &[]);
    assert!(output.status.success(), "{}", all_said(&output));
    let three = all(&folder.path().join("three"));
    assert_eq!(three[Path::new("notes")], b"A set.");
    assert!(three.contains_key(Path::new("data/meta/info.json")));
    // The cache of another set is not accessible.
    let other = folder.path().join("hub/datasets--c--d/blobs");
    std::fs::create_dir_all(&other).unwrap();
    std::fs::write(other.join("0000"), "another set").unwrap();
    symlink("../../../datasets--c--d/blobs/0000", snapshot.join("notes")).unwrap();
    let output = annotate(folder.path(), "linked", "four", &[]);
    assert_eq!(output.status.code(), Some(2), "{}", all_said(&output));
    assert!(complained(&output).contains("linked/notes: leads out of linked"), "{}", complained(&output));
}
