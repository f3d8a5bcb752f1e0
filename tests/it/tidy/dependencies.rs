//! docs/measurements/dependencies.md lists the packages that the manifests name, each with its crates.

use std::collections::BTreeMap;
use std::path::Path;

/// The keys of the tables of a manifest whose names end in `dependencies`, each with the table.
fn dependencies(manifest: &str) -> Vec<(&str, &str)> {
    let mut table = "";
    let mut found = Vec::new();
    for line in manifest.lines() {
        if let Some(header) = line.strip_prefix('[') {
            table = header.split(']').next().unwrap();
        } else if table.ends_with("dependencies")
            && let Some((key, _)) = line.split_once('=').filter(|_| line.starts_with(char::is_alphabetic))
        {
            found.push((table, key.trim().split('.').next().unwrap()));
        }
    }
    found
}

#[test]
fn the_page_lists_each_package_that_a_manifest_names() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let program = std::fs::read_to_string(root.join("Cargo.toml")).unwrap();
    let package = |name: &str| {
        let line = program.lines().find(|line| line.starts_with(&format!("{name} = "))).unwrap_or_default();
        let renamed = line.split_once("package = \"").map(|(_, rest)| rest.split('"').next().unwrap());
        renamed.unwrap_or(name).to_string()
    };
    let mut manifests = vec![("the program".to_string(), program.clone())];
    let mut crates: Vec<_> =
        std::fs::read_dir(root.join("crates")).unwrap().map(|entry| entry.unwrap().path()).collect();
    crates.sort();
    for folder in crates {
        let name = folder.file_name().unwrap().to_str().unwrap().to_string();
        manifests.push((name, std::fs::read_to_string(folder.join("Cargo.toml")).unwrap()));
    }
    let mut expected: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (user, manifest) in &manifests {
        let mut used: BTreeMap<String, bool> = BTreeMap::new();
        for (table, name) in dependencies(manifest) {
            if table != "workspace.dependencies" && !name.starts_with("teachtree") {
                let in_tests = used.entry(package(name)).or_insert(true);
                *in_tests &= table.ends_with("dev-dependencies");
            }
        }
        for (package, in_tests) in used {
            let user = if in_tests { format!("({user})") } else { user.clone() };
            expected.entry(package).or_default().push(user);
        }
    }
    let page = std::fs::read_to_string(root.join("docs/measurements/dependencies.md")).unwrap();
    let table = page.split("\n## ").find(|section| section.starts_with("Packages that the crates name")).unwrap();
    let rows = table.lines().filter(|line| line.starts_with("| ")).skip(1).map(|line| {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        assert_eq!(cells.len(), 3, "{line}");
        assert!(!cells[1].is_empty(), "{line}");
        (cells[0].to_string(), cells[2].split(", ").map(str::to_string).collect::<Vec<_>>())
    });
    assert_eq!(rows.collect::<BTreeMap<_, _>>(), expected);
    assert!(expected.len() > 50, "{expected:?}");
}
