//! The layering rules that manifests do not state: places of libraries in their crates, files that are opened, clocks.

mod circles;
mod dependencies;

use std::path::{Path, PathBuf};

/// Libraries with the only places in their crates that may use them; in which crates they are is in the manifests.
const ONE_PLACE: &[(&str, &[&str])] = &[
    ("serde_yaml", &["crates/base/src/yaml.rs"]),
    ("parry3d", &["crates/world/src/", "crates/robot/src/grasp/clearance.rs", "crates/robot/src/model/mesh/pieces.rs"]),
    ("mesh_loader", &["crates/robot/src/model/mesh/formats.rs"]),
    (
        "roxmltree",
        &[
            "crates/description/src/urdf",
            "crates/robot/src/model/mesh/collada.rs",
            "crates/logs/src/read/formats/hdf5/mujoco.rs",
            "crates/logs/src/read/labels/eaf.rs",
        ],
    ),
    ("parquet", &["crates/logs/src/read/formats/"]),
    ("rusqlite", &["crates/logs/src/read/formats/db3.rs"]),
    ("prost_reflect", &["crates/logs/src/read/formats/protobuf.rs"]),
    ("npyz", &["crates/logs/src/read/formats/"]),
    ("zip", &["crates/logs/src/read/formats/"]),
    ("arrow_ipc", &["crates/logs/src/read/formats/parquet/"]),
    ("arrow_schema", &["crates/logs/src/read/formats/parquet/"]),
    ("base64", &["crates/logs/src/read/formats/parquet/", "crates/logs/src/foxglove.rs"]),
    ("hdf5_pure", &["crates/logs/src/read/formats/hdf5.rs", "crates/logs/src/read/formats/hdf5/"]),
    ("signal_hook", &["src/cli/mod.rs"]),
    ("libc", &["crates/logs/src/read/file.rs"]),
    ("tungstenite", &["src/cli/live/", "crates/teaching/src/socket.rs"]),
    ("zenoh", &["src/cli/live/pubsub.rs"]),
    (
        "rayon",
        &[
            "src/cli/",
            "crates/session/src/fitting.rs",
            "crates/session/src/edited_rules.rs",
            "crates/learn/src/bank.rs",
            "crates/learn/src/extension/",
            "crates/learn/src/relearning/search.rs",
            "crates/learn/src/validation.rs",
            "crates/new_primitive/src/demonstrations.rs",
        ],
    ),
    ("regex_lite", &["src/cli/groups.rs"]),
    ("glob", &["crates/session/src/project_file/"]),
    ("statrs", &["crates/robot/src/certificate/binomial.rs"]),
    ("similar", &["crates/session/src/patch.rs"]),
    ("httparse", &["crates/serve/src/http.rs"]),
    ("getrandom", &["crates/serve/src/server.rs"]),
    ("rustls", &["crates/serve/src/tls.rs", "crates/serve/src/certificate.rs"]),
    ("rcgen", &["crates/serve/src/certificate.rs"]),
    ("ring", &["crates/serve/src/certificate.rs"]),
    ("sha2", &["crates/base/src/digest.rs"]),
    ("annotate_snippets", &["crates/base/src/diagnostic/render.rs"]),
];

/// Folders and files with pages.
const PAGES: &[&str] = &[
    "README.md",
    "ARCHITECTURE.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "SECURITY.md",
    "demos",
    "docs",
    "editors",
    "examples",
    "grammar",
];

/// Modules that open files.
const OPENS_FILES: &[&str] = &[
    "src/cli/",
    "crates/lsp/src/",
    "crates/session/src/files.rs",
    "crates/frames/src/",
    "crates/logs/src/",
    "crates/studio/src/",
    "crates/serve/src/",
    "crates/language/src/",
    "crates/teaching/src/camera.rs",
];

/// The servo of a person's hands runs in real time, and a certificate is good from one day until another one.
const READS_A_CLOCK: &[&str] = &["crates/teaching/src/servo.rs", "crates/serve/src/certificate.rs"];

/// Returns all files in a folder and its subfolders.
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

/// Returns all sources: of the root and of the crates.
fn sources() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let crates = std::fs::read_dir(root.join("crates")).unwrap().map(|entry| entry.unwrap().path().join("src"));
    let mut found: Vec<PathBuf> =
        crates.chain([root.join("src")]).flat_map(|folder| with_extension(&folder, "rs")).collect();
    found.sort();
    found
}

/// Returns the lines of all sources: file, place, text without comments.
fn lines() -> Vec<(String, String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut lines = Vec::new();
    for path in sources() {
        let file = path.strip_prefix(root).unwrap().to_str().unwrap().replace('\\', "/");
        for (line, at) in std::fs::read_to_string(&path).unwrap().lines().zip(1..) {
            let code = line.split("//").next().unwrap_or("").to_string();
            lines.push((file.clone(), format!("{file}:{at}"), code));
        }
    }
    lines
}

/// Rule files name primitives, and declare the action of a hand in them; the program uses the actions. Only the ground truth of the simulated operators, which
/// shares nothing with the rules, has names of its own.
#[test]
fn only_the_ground_truth_names_primitives() {
    let loaded = teachtree_language::load_text("all.rules", "use \"bimanual.rules\"");
    let names: Vec<String> = loaded.rules.unwrap().primitives.into_iter().map(|primitive| primitive.name).collect();
    assert!(names.len() >= 18, "{names:?}");
    let named = |code: &str| {
        names.iter().any(|name| code.contains(&format!("\"{name}\"")) || code.contains(&format!("\"{name}(")))
    };
    let (truth, wrong): (Vec<_>, Vec<_>) = lines()
        .into_iter()
        .filter(|(.., code)| named(code))
        .partition(|(file, ..)| file.starts_with("crates/world/src/truth/"));
    assert!(truth.len() > 50, "the search finds them where they are");
    let places: Vec<&str> = wrong.iter().map(|(_, place, _)| place.as_str()).collect();
    assert!(places.is_empty(), "ask what a hand does (`Meaning`) instead of naming primitives: {}", places.join(", "));
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
        if ["Instant::now", "SystemTime::now"].iter().any(|word| code.contains(word))
            && !READS_A_CLOCK.contains(&file.as_str())
        {
            wrong.push(format!("{place}: no module reads a clock but {}", READS_A_CLOCK.join(", ")));
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

/// Returns the ids of docs/sources.md that a comment cites: C7, B-A3, L10.
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
fn ids_in_rules_have_a_row_in_the_sources() {
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
    assert!(found > 50, "only {found} ids are cited: the search for them has gone wrong");
}

/// The relative links of a page: line and target. Blocks of code have none.
fn links(page: &str) -> Vec<(usize, &str)> {
    let mut in_block = false;
    let mut found = Vec::new();
    for (line, at) in page.lines().zip(1..) {
        in_block ^= line.trim_start().starts_with("```");
        if !in_block {
            let targets = line.split("](").skip(1).filter_map(|rest| rest.split(')').next());
            found.extend(targets.filter(|target| !target.contains("://")).map(|target| (at, target)));
        }
    }
    found
}

/// The anchor of a heading, as hosting sites make it.
fn anchor(heading: &str) -> String {
    let kept = heading.trim().to_lowercase();
    let kept = kept.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

fn pages() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (folders, mut pages): (Vec<PathBuf>, Vec<PathBuf>) =
        PAGES.iter().map(|name| root.join(name)).partition(|path| path.is_dir());
    pages.extend(folders.iter().flat_map(|folder| with_extension(folder, "md")));
    pages
}

#[test]
fn links_of_pages_lead_to_files_and_headings() {
    let (mut wrong, mut found) = (Vec::new(), 0);
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        for (line, link) in links(&text) {
            found += 1;
            let (file, heading) = link.split_once('#').unwrap_or((link, ""));
            let target = if file.is_empty() { page.clone() } else { page.parent().unwrap().join(file) };
            let headings = || std::fs::read_to_string(&target).unwrap_or_default();
            let leads = target.exists()
                && (heading.is_empty()
                    || headings()
                        .lines()
                        .any(|line| line.starts_with('#') && anchor(line.trim_start_matches('#')) == heading));
            if !leads {
                wrong.push(format!("{}:{line}: `{link}` leads nowhere", page.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(found > 100, "only {found} links: the search for them has gone wrong");
}

/// Programs do not run the evaluator of single frames, so users cannot measure its speed.
#[test]
fn pages_contain_no_speed_of_code_for_tests() {
    let words = ["live frame", "live evaluator", "evaluate_in"];
    let mut wrong = Vec::new();
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        for (line, at) in text.lines().zip(1..) {
            let named = words.iter().filter(|word| line.contains(**word));
            wrong.extend(named.map(|word| format!("{}:{at}: `{word}`", page.display())));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
