//! What the fuzz targets run: a function for each kind of input, bytes in, nothing out. A panic, a hang and an excess of memory are faults.
//!
//! How they are run, and how far they came: docs/measurements/reliability.md.

pub mod language;
pub mod logs;
pub mod protocols;
pub mod texts;

pub use libfuzzer_sys;

use std::panic::{Location, set_hook};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// Bytes that may be allocated at a time: 4 times what docs/logs.md says that a file may become, 1100 bytes a byte and 16 MiB.
fn most_bytes(input: usize) -> u64 {
    4 * (input.max(4096) as u64 * 1100 + (16 << 20))
}

/// A target that runs a function of this crate.
#[macro_export]
macro_rules! target {
    ($run:path) => {
        $crate::libfuzzer_sys::fuzz_target!(|data: &[u8]| $crate::run(data, $run));
    };
}

/// Runs a target on an input.
///
/// # Panics
/// When the target does, or allocates too much.
pub fn run(data: &[u8], target: fn(&[u8])) {
    // The usual hook of libFuzzer ends the process at every panic, also at those of other crates' decoders, which become an error of the file.
    set_hook(Box::new(|panic| {
        eprintln!("{panic}\n{}", std::backtrace::Backtrace::force_capture());
        if panic.location().is_none_or(is_own) {
            std::process::abort();
        }
    }));
    let used = allocation_counter::measure(|| target(data));
    let most = most_bytes(data.len());
    assert!(used.bytes_max <= most, "{} bytes at a time of {}, at most {most}", used.bytes_max, data.len());
}

/// Whether a place is none of a dependency.
fn is_own(place: &Location) -> bool {
    !place.file().contains("/registry/")
}

/// The folder of the repository.
fn repository() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// A folder for the files of this process.
///
/// # Panics
/// When there is none.
fn scratch() -> &'static Path {
    static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
        // Each process clears its own at its next begin: the fuzzer ends without dropping anything.
        let folder = std::env::temp_dir().join(format!("teachtree-fuzz-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).expect("a folder for temporary files");
        folder
    });
    &FOLDER
}

/// Writes a file of this process, and returns its path.
///
/// # Panics
/// When it cannot be written.
fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let path = scratch().join(name);
    std::fs::write(&path, bytes).expect("a file is written");
    path
}

/// A copy of a folder of the repository, one file of which an input replaces.
struct Tree {
    folder: PathBuf,
    /// The files and what is in them, in the order of their paths.
    files: Vec<(PathBuf, Vec<u8>)>,
}

impl Tree {
    /// Copies a folder.
    ///
    /// # Panics
    /// When it cannot be copied.
    fn of(folder: &str) -> Self {
        let from = repository().join(folder);
        let folder = scratch().join(from.file_name().expect("a name"));
        let mut files = Vec::new();
        let mut open = vec![from.clone()];
        while let Some(next) = open.pop() {
            for entry in std::fs::read_dir(&next).expect("a folder") {
                let path = entry.expect("a file").path();
                if path.is_dir() {
                    open.push(path);
                } else {
                    let copy = folder.join(path.strip_prefix(&from).expect("a file of the folder"));
                    std::fs::create_dir_all(copy.parent().expect("a folder")).expect("a folder");
                    files.push((copy, std::fs::read(&path).expect("a file")));
                }
            }
        }
        files.sort();
        files.iter().for_each(|(path, bytes)| std::fs::write(path, bytes).expect("a file is written"));
        Self { folder, files }
    }

    /// Lets the first byte choose a file, which has the others as its content, and puts the file back afterwards.
    fn with(&self, data: &[u8], look: impl FnOnce(&Path)) {
        let Some((which, content)) = data.split_first() else { return };
        let (path, bytes) = &self.files[usize::from(*which) % self.files.len()];
        std::fs::write(path, content).expect("a file is written");
        look(&self.folder);
        std::fs::write(path, bytes).expect("a file is written");
    }
}
