//! The worked examples: their pages show what the program prints, and their logs are small.

use crate::program::{all_said, program};
use std::path::{Path, PathBuf};

/// The longest page, in lines, and the largest log, in bytes.
const PAGE: usize = 80;
const LOG: u64 = 200_000;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples")
}

/// Folders of worked examples, by name: those with a page and a binding.
fn examples() -> Vec<String> {
    let folders = std::fs::read_dir(root()).unwrap().map(|entry| entry.unwrap().path());
    let has_binding = |folder: &PathBuf| {
        let mut files = std::fs::read_dir(folder).into_iter().flatten().flatten();
        files.any(|file| file.file_name().to_string_lossy().ends_with(".binding.yaml"))
    };
    let worked = folders.filter(|folder| folder.join("README.md").exists() && has_binding(folder));
    let mut names: Vec<String> =
        worked.map(|folder| folder.file_name().unwrap().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Blocks of a page: language and text.
fn blocks(page: &str) -> Vec<(&str, &str)> {
    let fenced = page.split("\n```").skip(1).step_by(2);
    fenced.filter_map(|block| block.split_once('\n')).collect()
}

/// The arguments of a line of a shell that runs the program; quotes keep an argument together.
fn arguments(line: &str) -> Vec<String> {
    let command = line.split("   #").next().unwrap_or_default().trim();
    let words = command.split('\'').enumerate().flat_map(|(at, part)| match at % 2 {
        0 => part.split_whitespace().map(str::to_string).collect(),
        _ => vec![part.to_string()],
    });
    words.skip(1).collect()
}

/// What a command prints where no terminal gives the width, as on a page.
fn printed(folder: &Path, line: &str) -> std::process::Output {
    let arguments = arguments(line);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    program(folder, &arguments).env("COLUMNS", "100").output().unwrap()
}

/// Copies the files of a folder, and returns the copy.
fn copied(folder: &Path) -> tempfile::TempDir {
    fn copy(from: &Path, to: &Path) {
        std::fs::create_dir_all(to).unwrap();
        for entry in std::fs::read_dir(from).unwrap().flatten() {
            let (from, to) = (entry.path(), to.join(entry.file_name()));
            if from.is_dir() {
                copy(&from, &to);
            } else {
                std::fs::copy(&from, &to).unwrap();
            }
        }
    }
    let copy_of = tempfile::tempdir().unwrap();
    copy(folder, copy_of.path());
    copy_of
}

/// The first line of an excerpt that an output lacks. Lines between two `…` follow each other, and the parts are in order.
fn lacking<'a>(output: &str, excerpt: &'a str) -> Option<&'a str> {
    let lines: Vec<&str> = output.lines().map(str::trim_end).collect();
    let excerpt: Vec<&str> = excerpt.lines().map(str::trim_end).collect();
    let mut from = 0;
    for part in excerpt.split(|line| *line == "…").filter(|part| !part.is_empty()) {
        let Some(at) = lines.get(from..)?.windows(part.len()).position(|window| window == part) else {
            let missing = part.iter().find(|line| !lines.contains(line));
            return missing.or(part.first()).copied();
        };
        from += at + part.len();
    }
    None
}

#[test]
fn pages_of_examples_show_what_the_program_prints() {
    let names = examples();
    assert!(names.len() >= 4, "{names:?}");
    for name in names {
        let page = std::fs::read_to_string(root().join(&name).join("README.md")).unwrap();
        let folder = copied(&root().join(&name));
        let blocks = blocks(&page);
        let mut shown = 0;
        // A block of commands without an output behind it needs another program, such as a robot.
        for pair in blocks.windows(2) {
            let [("sh", commands), ("text", excerpt)] = pair else { continue };
            let run = |line: &str| all_said(&printed(folder.path(), line));
            let output: String = commands.lines().filter(|line| line.starts_with("teachtree ")).map(run).collect();
            if let Some(line) = lacking(&output, excerpt) {
                panic!("examples/{name}/README.md: `{line}` is not in the output of\n{commands}\n{output}");
            }
            shown += 1;
        }
        assert!(shown > 0, "examples/{name}/README.md shows no output");
    }
}

/// Runs the commands of the tutorial in their order, in a folder with the files that it shows.
#[test]
fn the_tutorial_shows_what_the_program_prints() {
    let page = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/tutorial.md")).unwrap();
    let folder = copied(&root().join("plug_into_socket"));
    std::fs::remove_file(folder.path().join("plug.binding.yaml")).unwrap();
    let (mut output, mut commands) = (String::new(), 0);
    for (kind, text) in blocks(&page) {
        match kind {
            "sh" => {
                output.clear();
                for line in text.lines().filter(|line| line.starts_with("teachtree ")) {
                    let run = printed(folder.path(), line);
                    output += &all_said(&run);
                    assert!(run.status.success(), "{line}\n{output}");
                    commands += 1;
                }
            }
            "text" => {
                if let Some(line) = lacking(&output, text) {
                    panic!("docs/tutorial.md: `{line}` is not in the output\n{output}");
                }
            }
            _ => {
                let name = text.lines().next().unwrap().trim_start_matches(['#', '/', ' ']);
                std::fs::write(folder.path().join(name), text).unwrap();
            }
        }
    }
    assert!(commands >= 12, "only {commands} commands");
}

/// A page may leave out keys of its binding, and may not have others.
#[test]
fn bindings_on_pages_of_examples_are_those_of_the_files() {
    let mut found = 0;
    for name in examples() {
        let folder = root().join(&name);
        let page = std::fs::read_to_string(folder.join("README.md")).unwrap();
        let files = std::fs::read_dir(&folder)
            .unwrap()
            .flatten()
            .filter(|file| file.file_name().to_string_lossy().ends_with(".yaml"));
        let bindings: String = files.map(|file| std::fs::read_to_string(file.path()).unwrap()).collect();
        for (_, block) in blocks(&page).iter().filter(|(language, _)| *language == "yaml") {
            for line in block.lines().filter(|line| !line.trim_start().starts_with('#')) {
                assert!(
                    bindings.lines().any(|own| own == line),
                    "examples/{name}/README.md: `{line}` is in no binding"
                );
                found += 1;
            }
        }
    }
    assert!(found > 20, "only {found} lines: the search for them has gone wrong");
}

#[test]
fn examples_are_small_and_in_the_index() {
    let index = std::fs::read_to_string(root().join("README.md")).unwrap();
    for name in examples() {
        assert!(index.contains(&format!("| [`{name}`]({name}/README.md) |")), "{name} is not in examples/README.md");
        let page = std::fs::read_to_string(root().join(&name).join("README.md")).unwrap();
        assert!(page.lines().count() <= PAGE, "examples/{name}/README.md: {} lines", page.lines().count());
        let mut folders = vec![root().join(&name)];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).unwrap().flatten() {
                let size = entry.metadata().unwrap().len();
                assert!(size <= LOG, "{}: {size} bytes", entry.path().display());
                folders.extend(entry.path().is_dir().then(|| entry.path()));
            }
        }
    }
}
