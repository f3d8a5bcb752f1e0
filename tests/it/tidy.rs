//! The house rules: which floor may name which, and what stays in one place.

use std::path::{Path, PathBuf};

/// Each floor with the floors that it may name; `base` is named by all. What is not listed must not be.
const FLOORS: &[(&str, &[&str])] = &[
    ("base", &[]),
    ("language", &[]),
    ("graph", &["language"]),
    ("world", &[]),
    ("stream", &[]),
    ("command", &["analysis", "stream"]),
    ("robot", &["command", "world"]),
    ("engine", &["language", "graph", "stream"]),
    ("analysis", &["language", "stream", "engine"]),
    ("report", &["language", "graph", "stream", "engine", "analysis", "command", "robot"]),
    ("lsp", &["language", "graph", "stream", "engine", "analysis"]),
    ("cli", &["language", "graph", "world", "stream", "engine", "analysis", "command", "robot", "report", "lsp"]),
];

/// Names of libraries with the only places that may use them.
const ONE_PLACE: &[(&str, &[&str])] = &[
    ("pest", &["src/language/"]),
    ("serde_yaml", &["src/base/yaml.rs"]),
    ("rapier3d", &["src/world/"]),
    ("parry3d", &["src/world/", "src/robot/grasp/clearance.rs"]),
    ("roxmltree", &["src/robot/urdf.rs"]),
    ("rand", &["src/world/"]),
    ("parquet", &["src/stream/formats/"]),
    ("clap", &["src/cli/"]),
    ("indicatif", &["src/cli/"]),
    ("rayon", &["src/cli/"]),
    ("similar", &["src/cli/fit/"]),
    ("lsp_server", &["src/lsp/"]),
    ("lsp_types", &["src/lsp/"]),
    ("annotate_snippets", &["src/base/diagnostic/render.rs"]),
];

/// Where the project's texts are.
const TEXTS: &[&str] =
    &[".ci", "benches", "demos", "docs", "editors", "examples", "grammar", "robots", "rules", "scenes", "src", "tests"];

/// Notes that readers do not get: docs/sources.md says what is in them. (In halves, so that this is no mention.)
const NOT_HERE: &[[&str; 2]] =
    &[["PAPER", ".md"], ["PAPER ", "A"], ["REAL_", "LOGS"], ["LANGUAGE", ".md"], ["DESIGN", ".md"]];

/// Floors that open files.
const OPENS_FILES: &[&str] = &["src/cli/", "src/lsp/", "src/stream/", "src/language/"];

/// All files of a folder and those in it.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn with_extension(folder: &Path, extension: &str) -> Vec<PathBuf> {
    files(folder).into_iter().filter(|path| path.extension().is_some_and(|its| its == extension)).collect()
}

/// The lines of all sources: place, text without comments.
fn lines() -> Vec<(String, String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut lines = Vec::new();
    for path in with_extension(&root.join("src"), "rs") {
        let file = path.strip_prefix(root).unwrap().to_str().unwrap().replace('\\', "/");
        for (line, at) in std::fs::read_to_string(&path).unwrap().lines().zip(1..) {
            let code = line.split("//").next().unwrap_or("").to_string();
            lines.push((file.clone(), format!("{file}:{at}"), code));
        }
    }
    lines
}

#[test]
fn no_floor_names_one_above_it() {
    let mut wrong = Vec::new();
    for (file, place, code) in lines() {
        let Some(floor) = file.split('/').nth(1).filter(|_| file.matches('/').count() > 1) else { continue };
        let (_, below) =
            FLOORS.iter().find(|(name, _)| *name == floor).unwrap_or_else(|| panic!("{file}: no such floor"));
        for named in code
            .split("crate::")
            .skip(1)
            .filter_map(|rest| rest.split(|c: char| !c.is_alphanumeric() && c != '_').next())
        {
            let known = FLOORS.iter().any(|(name, _)| *name == named);
            if known && named != "base" && named != floor && !below.contains(&named) {
                wrong.push(format!("{place}: `{floor}` must not name `{named}`"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn libraries_stay_in_their_places() {
    let mut wrong = Vec::new();
    for (file, place, code) in lines() {
        for (library, places) in ONE_PLACE {
            let names = code.split(|c: char| !c.is_alphanumeric() && c != '_').any(|word| word == *library);
            let used = names && (code.contains(&format!("{library}::")) || code.contains(&format!("use {library}")));
            if used
                && !code.contains(&format!("crate::{library}"))
                && !code.contains(&format!("::{library}::"))
                && !places.iter().any(|place| file.starts_with(place))
            {
                wrong.push(format!("{place}: {library} belongs in {}", places.join(", ")));
            }
        }
        let opens = ["std::fs", "File::open", "File::create"].iter().any(|word| code.contains(word));
        if opens && !OPENS_FILES.iter().any(|place| file.starts_with(place)) {
            wrong.push(format!("{place}: files are opened in {}", OPENS_FILES.join(", ")));
        }
        if ["Instant::now", "SystemTime::now"].iter().any(|word| code.contains(word)) {
            wrong.push(format!("{place}: no floor reads a clock"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_file_is_one_idea() {
    let mut counts = std::collections::BTreeMap::new();
    for (file, _, _) in lines() {
        *counts.entry(file).or_insert(0) += 1;
    }
    let long: Vec<_> = counts.into_iter().filter(|(_, lines)| *lines > 600).collect();
    assert!(long.is_empty(), "over 600 lines: {long:?}");
}

/// The ids of docs/sources.md that a comment cites: C7, B-A3, L10.
fn cited(comment: &str) -> Vec<&str> {
    let is_id = |word: &&str| {
        let word = word.strip_prefix("B-").unwrap_or(word);
        let mut letters = word.chars();
        letters.next().is_some_and(|first| "CADRXL".contains(first))
            && (1..=2).contains(&letters.as_str().len())
            && letters.all(|digit| digit.is_ascii_digit())
    };
    comment.split(|c: char| !c.is_alphanumeric() && c != '-').filter(is_id).collect()
}

#[test]
fn what_rules_cite_has_its_row_in_the_sources() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = std::fs::read_to_string(root.join("docs/sources.md")).unwrap();
    let rows: Vec<&str> = page.lines().filter_map(|line| line.strip_prefix("| ")?.split(" |").next()).collect();
    let (mut wrong, mut found) = (Vec::new(), 0);
    for path in with_extension(&root.join("rules"), "rules") {
        for (line, at) in std::fs::read_to_string(&path).unwrap().lines().zip(1..) {
            let Some((_, comment)) = line.split_once("//") else { continue };
            for id in cited(comment) {
                found += 1;
                if rows.iter().filter(|row| **row == id).count() != 1 {
                    wrong.push(format!("{}:{at}: {id} has no row of its own in docs/sources.md", path.display()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(found > 50, "only {found} ids are cited: how they are looked for has gone wrong");
}

#[test]
fn nothing_names_notes_that_readers_do_not_get() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut texts: Vec<PathBuf> = TEXTS.iter().flat_map(|folder| files(&root.join(folder))).collect();
    texts.extend(["README.md", "ARCHITECTURE.md", "CHANGELOG.md", "Cargo.toml"].map(|file| root.join(file)));
    let mut wrong = Vec::new();
    for path in texts {
        // Recordings that are no text name nothing.
        let Ok(text) = std::fs::read_to_string(&path) else { continue };
        for (line, at) in text.lines().zip(1..) {
            for named in NOT_HERE.iter().map(|halves| halves.concat()).filter(|name| line.contains(name)) {
                wrong.push(format!("{}:{at}: `{named}`: docs/sources.md is what readers get", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
