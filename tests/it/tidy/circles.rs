//! Files of a crate that import each other: ARCHITECTURE.md lists them all, and no others. What a file uses of the `mod.rs` or file that contains it
//! is left out.

use super::{files, lines};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// A module by its crate and its path: `logs`, `read`, `csv`; `cli` of the root is a crate here.
type Module = Vec<String>;

/// The code of each module without comments, and its file: `logs/read/csv.rs` for `crates/logs/src/read/csv.rs`, `cli/main.rs` for `src/cli/main.rs`.
fn modules() -> BTreeMap<Module, (String, String)> {
    let mut modules: BTreeMap<Module, (String, String)> = BTreeMap::new();
    for (file, _, code) in lines() {
        let file = short(&file);
        let path = file.trim_end_matches(".rs").trim_end_matches("/mod");
        let module = path.split('/').filter(|part| !["lib", "main"].contains(part)).map(str::to_string).collect();
        let (_, text) = modules.entry(module).or_insert_with(|| (file, String::new()));
        text.push_str(&code);
        text.push('\n');
    }
    modules
}

/// A file without `crates` and `src`.
fn short(file: &str) -> String {
    match file.strip_prefix("crates/").and_then(|file| file.split_once("/src/")) {
        Some((name, file)) => format!("{name}/{file}"),
        None => file.strip_prefix("src/").unwrap().to_string(),
    }
}

/// The place of a file or folder that is named without `crates` and `src`.
fn place(name: &str) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (first, rest) = name.split_once('/').unwrap_or((name, ""));
    let folder = root.join("crates").join(first).join("src");
    if folder.is_dir() { folder.join(rest) } else { root.join("src").join(name) }
}

/// The paths of a tree of imports: `a::{b, c::d}` is `a::b` and `a::c::d`.
fn expanded(tree: &str) -> Vec<String> {
    let tree = tree.trim();
    let Some((head, rest)) = tree.split_once('{') else {
        return vec![tree.split(" as ").next().unwrap().trim().to_string()];
    };
    let body = rest.trim_end().trim_end_matches('}').to_string() + &"}".repeat(rest.matches('{').count());
    let (mut paths, mut depth, mut item) = (vec![], 0, String::new());
    for letter in body.chars().chain([',']) {
        match letter {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                let inner = std::mem::take(&mut item);
                paths.extend(
                    expanded(&inner).into_iter().filter(|path| !path.is_empty()).map(|path| format!("{head}{path}")),
                );
                continue;
            }
            _ => {}
        }
        item.push(letter);
    }
    paths
}

/// What a file imports: paths of imports with whether they are passed on (`pub use`), and paths in its code.
fn imported(code: &str) -> Vec<(String, bool)> {
    let mut paths = vec![];
    let mut rest = String::new();
    // A statement ends at `;`, and an import begins one, behind attributes and braces.
    for statement in code.split(';') {
        let at = ["pub use ", "pub(super) use ", "pub(crate) use ", "use "]
            .iter()
            .filter_map(|word| {
                let at = statement.find(word)?;
                let begins = statement[..at].trim_end().is_empty() || statement[..at].ends_with(['\n', ' ']);
                begins.then_some((at, *word))
            })
            .min();
        match at {
            Some((at, word)) => {
                rest.push_str(&statement[..at]);
                let tree = statement[at + word.len()..].split_whitespace().collect::<Vec<_>>().join(" ");
                let tree = tree.replace(":: ", "::").replace("{ ", "{");
                paths.extend(expanded(&tree).into_iter().map(|path| (path, word.starts_with("pub"))));
            }
            None => rest.push_str(statement),
        }
        rest.push(';');
    }
    let word = |letter: char| letter.is_alphanumeric() || letter == '_' || letter == ':';
    let in_code = rest.split(|letter| !word(letter)).map(|path| path.trim_matches(':'));
    paths.extend(in_code.filter(|path| path.contains("::")).map(|path| (path.to_string(), false)));
    paths
}

/// Which files each file imports, other than those that contain it.
fn imports() -> BTreeMap<String, BTreeSet<String>> {
    let modules = modules();
    let found = |path: &[String]| {
        (1..=path.len())
            .rev()
            .find(|length| modules.contains_key(&path[..*length]))
            .map(|length| (path[..length].to_vec(), path.get(length).cloned().unwrap_or_default()))
    };
    let resolved = |module: &Module, path: &str| {
        let parts: Vec<String> = path.split("::").map(|part| part.trim().to_string()).collect();
        let above = parts.iter().take_while(|part| *part == "super").count();
        let whole = match parts.first().map(String::as_str) {
            // The root has no module beside `cli`.
            Some("crate") if module.first().is_some_and(|own| own == "cli") => parts[1..].to_vec(),
            Some("crate") => [&module[..1], &parts[1..]].concat(),
            Some("self") => [module, &parts[1..]].concat(),
            Some("super") => [&module[..module.len().saturating_sub(above)], &parts[above..]].concat(),
            Some(first) if modules.contains_key(&[&module[..], &[first.to_string()]].concat()) => {
                [&module[..], &parts].concat()
            }
            _ => return None,
        };
        found(&whole)
    };
    // Names of other crates that a module passes on are not its own.
    let (mut uses, mut passed_on, mut of_others) = (vec![], BTreeMap::new(), BTreeSet::new());
    for (module, (_, code)) in &modules {
        for (path, is_passed_on) in imported(code) {
            let Some((target, name)) = resolved(module, &path) else {
                if let Some((_, name)) = path.rsplit_once("::").filter(|_| is_passed_on) {
                    of_others.insert((module.clone(), name.to_string()));
                }
                continue;
            };
            if is_passed_on {
                passed_on.insert((module.clone(), name), target);
            } else if target != *module {
                uses.push((module.clone(), target, name));
            }
        }
    }
    let mut edges: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (module, mut target, name) in uses {
        // A name that is passed on stands where it is declared.
        for _ in 0..5 {
            match passed_on.get(&(target.clone(), name.clone())) {
                Some(next) if !name.is_empty() => target.clone_from(next),
                _ => break,
            }
        }
        if of_others.contains(&(target.clone(), name)) {
            continue;
        }
        let contains = target.len() < module.len() && module.starts_with(&target);
        if target != module && !contains {
            edges.entry(modules[&module].0.clone()).or_default().insert(modules[&target].0.clone());
        }
    }
    edges
}

/// The files that a file reaches.
fn reached(edges: &BTreeMap<String, BTreeSet<String>>, from: &str) -> BTreeSet<String> {
    let (mut seen, mut open) = (BTreeSet::new(), vec![from.to_string()]);
    while let Some(file) = open.pop() {
        for next in edges.get(&file).into_iter().flatten() {
            if seen.insert(next.clone()) {
                open.push(next.clone());
            }
        }
    }
    seen
}

/// A row of ARCHITECTURE.md.
#[derive(Debug)]
struct Row {
    text: String,
    /// What it names: files and folders, without `crates` and `src`.
    names: Vec<String>,
    /// The file that a circle contains, of a row about a file and what belongs to it.
    center: Option<String>,
}

/// The rows of ARCHITECTURE.md.
fn listed() -> Vec<Row> {
    let page = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("ARCHITECTURE.md")).unwrap();
    let section = page.split("\n## Files that import each other\n").nth(1).unwrap().split("\n## ").next().unwrap();
    let rows = section.lines().filter(|line| line.starts_with("| `"));
    let names = |row: &str| {
        let first = row.split('|').nth(1).unwrap().to_string();
        let mut folder = String::new();
        let mut names = vec![];
        let parts: Vec<&str> = first.split('`').collect();
        for (name, behind) in parts.iter().skip(1).step_by(2).zip(parts.iter().skip(2).step_by(2)) {
            let name = name.trim_end_matches("/*");
            if let Some((above, _)) = name.rsplit_once('/').filter(|(above, _)| above.contains('/')) {
                folder = above.to_string();
            }
            let exists = |path: &str| place(path).exists();
            if exists(name) {
                if !name.ends_with(".rs") {
                    folder = name.to_string();
                }
                if let (true, Some((above, _))) = (name.ends_with(".rs"), name.rsplit_once('/')) {
                    folder = above.to_string();
                }
                // `folder`: these files in it.
                if !behind.starts_with(':') {
                    names.push(name.to_string());
                }
            } else {
                // Relative to what was named before, or to the folder above it.
                let above = folder.rsplit_once('/').map_or("", |(above, _)| above);
                let beside = [format!("{folder}/{name}"), format!("{above}/{name}")];
                names.extend(beside.into_iter().find(|path| exists(path)));
                assert!(names.last().is_some_and(|found| found.ends_with(name)), "`{name}` in {first} is not there");
            }
        }
        let center = first.contains("and its").then(|| names.last().cloned()).flatten();
        if center.is_some() {
            names.push(folder);
        }
        Row { text: first, names, center }
    };
    rows.map(names).collect()
}

fn covers(name: &str, file: &str) -> bool {
    file == name || !name.ends_with(".rs") && file.strip_prefix(name).is_some_and(|rest| rest.starts_with('/'))
}

#[test]
fn files_that_import_each_other_are_listed() {
    let edges = imports();
    assert!(edges.len() > 200 && edges.values().map(BTreeSet::len).sum::<usize>() > 700, "imports are found");
    let reach: BTreeMap<&String, BTreeSet<String>> = edges.keys().map(|file| (file, reached(&edges, file))).collect();
    let together = |one: &str, other: &str| {
        let goes = |from: &str, to: &str| reach.get(&from.to_string()).is_some_and(|files| files.contains(to));
        one != other && goes(one, other) && goes(other, one)
    };
    let rows = listed();
    assert!(rows.len() > 8, "{rows:?}");
    let mut wrong = vec![];
    for file in edges.keys() {
        let circle: BTreeSet<&String> = edges.keys().filter(|other| together(file, other)).collect();
        let in_row = |row: &Row| {
            let has = |file: &String| row.names.iter().any(|name| covers(name, file));
            let is_there = |center: &String| center == file || circle.contains(center);
            has(file) && circle.iter().any(|other| has(other)) && row.center.as_ref().is_none_or(is_there)
        };
        if !circle.is_empty() && !rows.iter().any(in_row) {
            wrong.push(format!("{file} and {circle:?} import each other: a row of ARCHITECTURE.md is missing"));
        }
    }
    for Row { text, names, .. } in &rows {
        let covered: Vec<&String> = edges.keys().filter(|file| names.iter().any(|name| covers(name, file))).collect();
        let is_circle = covered.iter().any(|one| covered.iter().any(|other| together(one, other)));
        // Of a folder and a file beside it each may use another file of the other.
        let leads = |from: &String, to: &String| {
            edges.iter().any(|(file, uses)| covers(from, file) && uses.iter().any(|used| covers(to, used)))
        };
        let both_ways =
            names.iter().any(|one| names.iter().any(|other| one != other && leads(one, other) && leads(other, one)));
        if !is_circle && !both_ways {
            wrong.push(format!("{text}: these files do not import each other any more"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The directories of `robot` are layers, each using only those before it.
#[test]
fn layers_of_robot_use_only_those_before() {
    const LAYERS: [&str; 8] =
        ["kinematics", "model", "dynamics", "grasp", "planning", "control", "simulation", "certificate"];
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let sources = place("robot");
    let folders: BTreeSet<String> = files(&sources)
        .iter()
        .filter_map(|path| Some(path.strip_prefix(&sources).ok()?.to_str()?.split_once('/')?.0.to_string()))
        .collect();
    assert_eq!(folders, LAYERS.map(str::to_string).into());
    let page = std::fs::read_to_string(root.join("ARCHITECTURE.md")).unwrap();
    let named = LAYERS.map(|layer| format!("`{layer}`")).join(", ");
    assert!(page.split_whitespace().collect::<Vec<_>>().join(" ").contains(&named), "ARCHITECTURE.md lists {named}");
    let layer = |file: &str| {
        let folder = file.strip_prefix("robot/")?.split_once('/')?.0;
        LAYERS.iter().position(|layer| *layer == folder)
    };
    let mut wrong = vec![];
    for (file, used) in imports() {
        for used in used {
            if let (Some(own), Some(other)) = (layer(&file), layer(&used))
                && other > own
            {
                wrong.push(format!("{file} must not use {used}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
