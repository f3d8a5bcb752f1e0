//! The layering rules: the modules that a module may use, and the places of libraries.

mod circles;

use std::path::{Path, PathBuf};

/// Each module with the modules that it may use; all may use `base`. Other uses are errors.
const LAYERS: &[(&str, &[&str])] = &[
    ("base", &[]),
    ("serve", &[]),
    ("language", &[]),
    ("graph", &["language"]),
    ("description", &[]),
    ("world", &[]),
    ("stream", &["description"]),
    ("command", &["description", "analysis", "stream"]),
    ("robot", &["command", "description", "world"]),
    ("engine", &["language", "graph", "stream"]),
    ("analysis", &["language", "stream", "engine"]),
    ("report", &["language", "graph", "stream", "engine", "analysis", "command", "robot"]),
    ("session", &["language", "graph", "stream", "engine", "analysis", "report"]),
    ("lsp", &["language", "graph", "stream", "engine", "analysis", "session"]),
    ("teaching", &["serve", "world", "stream", "report", "session"]),
    ("studio", &["serve", "language", "graph", "stream", "engine", "analysis", "report", "session", "lsp"]),
    (
        "cli",
        &[
            "language", "graph", "world", "stream", "engine", "analysis", "command", "robot", "report", "session",
            "lsp", "serve", "studio", "teaching",
        ],
    ),
];

/// Libraries with the only places that may use them.
const ONE_PLACE: &[(&str, &[&str])] = &[
    ("pest", &["src/language/"]),
    ("serde_yaml", &["src/base/yaml.rs"]),
    ("rapier3d", &["src/world/"]),
    ("parry3d", &["src/world/", "src/robot/grasp/clearance.rs", "src/robot/model/mesh/pieces.rs"]),
    ("mesh_loader", &["src/robot/model/mesh/formats.rs"]),
    (
        "roxmltree",
        &[
            "src/description/urdf.rs",
            "src/robot/model/mesh/collada.rs",
            "src/stream/read/formats/hdf5/mujoco.rs",
            "src/stream/read/labels/eaf.rs",
        ],
    ),
    ("rand", &["src/world/"]),
    ("parquet", &["src/stream/read/formats/"]),
    ("npyz", &["src/stream/read/formats/"]),
    ("zip", &["src/stream/read/formats/"]),
    ("arrow_ipc", &["src/stream/read/formats/parquet/"]),
    ("arrow_schema", &["src/stream/read/formats/parquet/"]),
    ("base64", &["src/stream/read/formats/parquet/"]),
    ("hdf5_pure", &["src/stream/read/formats/hdf5.rs", "src/stream/read/formats/hdf5/"]),
    ("clap", &["src/cli/"]),
    ("ctrlc", &["src/cli/"]),
    ("signal_hook", &["src/cli/mod.rs"]),
    ("libc", &["src/stream/read/file.rs"]),
    ("tungstenite", &["src/cli/live/", "src/teaching/socket.rs"]),
    ("zenoh", &["src/cli/live/pubsub.rs"]),
    ("indicatif", &["src/cli/"]),
    ("rayon", &["src/cli/", "src/session/fitting.rs"]),
    ("similar", &["src/session/patch.rs"]),
    ("lsp_server", &["src/lsp/"]),
    ("lsp_types", &["src/lsp/"]),
    ("httparse", &["src/serve/http.rs"]),
    ("getrandom", &["src/serve/server.rs"]),
    ("rustls", &["src/base/duplex.rs", "src/base/duplex/", "src/serve/certificate.rs"]),
    ("rcgen", &["src/serve/certificate.rs"]),
    ("ring", &["src/serve/certificate.rs"]),
    ("annotate_snippets", &["src/base/diagnostic/render.rs"]),
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
    "grammar",
];

/// Modules that open files.
const OPENS_FILES: &[&str] = &[
    "src/cli/",
    "src/lsp/",
    "src/session/files.rs",
    "src/stream/",
    "src/studio/",
    "src/serve/",
    "src/language/",
    "src/teaching/camera.rs",
];

/// The servo of a person's hands runs in real time, and a certificate is good from one day until another one.
const READS_A_CLOCK: &[&str] = &["src/teaching/servo.rs", "src/serve/certificate.rs"];

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

/// Returns the lines of all sources: file, place, text without comments.
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
fn modules_use_only_modules_below() {
    let mut wrong = Vec::new();
    for (file, place, code) in lines() {
        let Some(module) = file.split('/').nth(1).filter(|_| file.matches('/').count() > 1) else { continue };
        let (_, below) =
            LAYERS.iter().find(|(name, _)| *name == module).unwrap_or_else(|| panic!("{file}: no such module"));
        for named in code
            .split("crate::")
            .skip(1)
            .filter_map(|rest| rest.split(|c: char| !c.is_alphanumeric() && c != '_').next())
        {
            let known = LAYERS.iter().any(|(name, _)| *name == named);
            if known && named != "base" && named != module && !below.contains(&named) {
                wrong.push(format!("{place}: `{module}` must not use `{named}`"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Rule files name primitives, and say what a hand does in them; the program goes by that. Only the ground truth of the simulated operators, which
/// shares nothing with the rules, has names of its own.
#[test]
fn only_the_ground_truth_names_primitives() {
    let loaded = teachtree::language::load_text("all.rules", "use \"bimanual.rules\"");
    let names: Vec<String> = loaded.rules.unwrap().primitives.into_iter().map(|primitive| primitive.name).collect();
    assert!(names.len() >= 18, "{names:?}");
    let named = |code: &str| {
        names.iter().any(|name| code.contains(&format!("\"{name}\"")) || code.contains(&format!("\"{name}(")))
    };
    let (truth, wrong): (Vec<_>, Vec<_>) = lines()
        .into_iter()
        .filter(|(.., code)| named(code))
        .partition(|(file, ..)| file.starts_with("src/world/truth/"));
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
