//! Every mistake is reported at its own place, in the author's words. A fixture is one mistake; adding a case is adding a file.

use super::report;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;
use teachtree_base::diagnostic::Severity;
use teachtree_language::{self as language, LoadedRules, Request, codes};

fn load(path: &Path) -> LoadedRules {
    language::load(&Request { files: vec![path.to_path_buf()], ..Request::default() })
}

/// Every fixture, in the order of names.
fn fixtures() -> Vec<std::path::PathBuf> {
    let folder = Path::new(crate::ROOT).join("tests/fixtures/diagnostics");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = files.filter(|path| path.extension().is_some_and(|end| end == "rules")).collect();
    files.sort();
    files
}

#[test]
fn each_fixture_is_reported() {
    for path in fixtures() {
        let name = path.file_stem().unwrap().to_str().unwrap().to_string();
        let loaded = load(&path);
        insta::with_settings!({ snapshot_suffix => name, prepend_module_to_snapshot => true, omit_expression => true }, {
            insta::assert_snapshot!("fixture", report(&loaded));
        });
    }
}

#[test]
fn a_name_whose_declaration_cannot_be_read_is_suggested() {
    let text = "use \"contact.rules\"\nparam hold_tim = 300 mss\nsignal x = 1 s < hold_time\n";
    let found = language::load_text("a.rules", text).diagnostics;
    let unknown = found.iter().find(|finding| finding.code == codes::UNKNOWN_NAME).unwrap();
    assert_eq!(unknown.fix.as_ref().unwrap().replacement, "hold_tim", "{unknown:?}");
}

#[test]
fn each_fixture_says_which_code_it_is_for() {
    for path in fixtures() {
        let text = std::fs::read_to_string(&path).unwrap();
        let found: BTreeSet<&str> = load(&path).diagnostics.iter().map(|finding| finding.code).collect();
        match text.strip_prefix("// ").and_then(|head| head.split_once(':')) {
            Some((code, _)) if code.len() == 4 => assert_eq!(found, BTreeSet::from([code]), "{}", path.display()),
            _ => assert!(text.starts_with("// Twenty"), "{} does not say why it exists", path.display()),
        }
    }
}

#[test]
fn each_code_has_a_case() {
    let mut found: BTreeSet<&str> = BTreeSet::new();
    for path in fixtures() {
        found.extend(load(&path).diagnostics.iter().map(|finding| finding.code));
    }
    // These need a generated file or an override; their tests are here and in `shipped`.
    found.extend([
        codes::TOO_LONG,
        codes::TOO_LARGE,
        codes::TOO_MANY_FILES,
        codes::TOO_MANY_ERRORS,
        codes::TOO_MANY_WARNINGS,
        codes::TOO_MANY_KINDS,
        codes::BAD_OVERRIDE,
        codes::TREE_NEEDED,
    ]);
    let all: BTreeSet<&str> = codes::ALL.iter().map(|(code, _)| *code).collect();
    assert_eq!(found, all);
}

#[test]
fn twenty_mistakes_are_twenty_reports() {
    each_on_its_own_line("twenty_mistakes");
}

/// The same for what runs but is hardly meant.
#[test]
fn twenty_doubts_are_twenty_reports() {
    each_on_its_own_line("twenty_doubts");
}

fn each_on_its_own_line(fixture: &str) {
    let loaded = load(&Path::new(crate::ROOT).join("tests/fixtures/diagnostics").join(fixture).with_extension("rules"));
    let lines: Vec<u32> = loaded
        .diagnostics
        .iter()
        .map(|finding| {
            let place = finding.place().unwrap();
            assert_eq!(place.file, 0, "{}", finding.message);
            loaded.sources.place(place).split(':').nth(1).unwrap().parse().unwrap()
        })
        .collect();
    assert_eq!(lines.len(), 20, "{}", report(&loaded));
    let distinct: BTreeSet<u32> = lines.iter().copied().collect();
    assert_eq!(distinct.len(), lines.len(), "one report a line:\n{}", report(&loaded));
}

#[test]
fn limits_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let mut seen = Vec::new();
    let mut first_code = |text: String| {
        let path = at("mine.rules");
        std::fs::write(&path, text).unwrap();
        let loaded = load(&path);
        assert_eq!(loaded.diagnostics.len(), 1, "{}", report(&loaded));
        seen.push(loaded.diagnostics[0].code);
    };
    first_code(format!("signal a = true{}\n", " or true".repeat(3000)));
    first_code(format!("// {}\n", "x".repeat(1 << 20)));
    first_code("relabel {} ".repeat(20_000));
    for file in 0..20 {
        std::fs::write(at(&format!("f{file}.rules")), format!("use \"f{}.rules\"\n", file + 1)).unwrap();
    }
    first_code("use \"f0.rules\"\n".to_string());
    let mut all = String::new();
    for file in 0..40 {
        std::fs::write(at(&format!("g{file}.rules")), "").unwrap();
        writeln!(all, "use \"g{file}.rules\"").unwrap();
    }
    let path = at("all.rules");
    std::fs::write(&path, all).unwrap();
    assert!(load(&path).diagnostics.iter().all(|finding| finding.code == codes::TOO_MANY_FILES));
    assert_eq!(seen, [codes::TOO_LONG, codes::TOO_LARGE, codes::TOO_LARGE, codes::TOO_MANY_FILES]);

    let loaded = language::load_text("my.rules", &"signal a = b\n".repeat(300));
    assert_eq!(loaded.diagnostics.last().unwrap().code, codes::TOO_MANY_ERRORS);
    assert_eq!(loaded.diagnostics.len(), 201);

    let unused: String = (0..300).map(|at| format!("param p{at} = 1\n")).collect();
    let tree = "primitive A\ntree t for each hand { else => A }\n";
    let loaded = language::load_text("my.rules", &format!("{unused}{tree}"));
    assert_eq!(loaded.diagnostics.last().unwrap().code, codes::TOO_MANY_WARNINGS);
    assert!(loaded.rules.is_some(), "warnings do not keep rules from running");
}

#[test]
fn rules_that_are_to_label_need_a_tree() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.rules");
    std::fs::write(&path, "").unwrap();
    let codes = |needs_tree| {
        let loaded = language::load(&Request { files: vec![path.clone()], needs_tree, ..Request::default() });
        let codes: Vec<&str> = loaded.diagnostics.iter().map(|finding| finding.code).collect();
        (codes, loaded.rules.is_some())
    };
    assert_eq!(codes(false), (vec![codes::NO_TREE], true));
    assert_eq!(codes(true), (vec![codes::TREE_NEEDED], false));
}

#[test]
fn a_file_that_cannot_be_read_is_reported_apart() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("mine.rules"), "use \"nowhere.rules\"\n").unwrap();
    std::fs::write(at("binary.rules"), [0xff, 0xfe, 0]).unwrap();
    assert!(!load(&at("mine.rules")).root_unreadable, "it is the file that is wrong");
    assert!(load(&at("nowhere.rules")).root_unreadable);
    assert!(load(&at("binary.rules")).root_unreadable);
    let with_hand = |hand: &str| Request { hand_file: Some(hand.to_string()), ..Request::default() };
    assert!(!language::load(&with_hand("hand_flags.rules")).root_unreadable);
    assert!(language::load(&with_hand("hand_nowhere.rules")).root_unreadable);
}

#[test]
fn a_file_ends_where_the_first_bound_is_met() {
    let loaded = language::load_text("my.rules", &format!("signal a = {}\n", "(".repeat(60_000)));
    let codes: Vec<&str> = loaded.diagnostics.iter().map(|finding| finding.code).collect();
    assert_eq!(codes, [codes::TOO_DEEP]);
}

#[cfg(unix)]
#[test]
fn a_link_out_of_the_folder_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let inside = folder.path().join("inside");
    std::fs::create_dir(&inside).unwrap();
    std::fs::write(folder.path().join("secret.rules"), "param a = 1\n").unwrap();
    std::fs::write(inside.join("mine.rules"), "use \"link.rules\"\n").unwrap();
    std::os::unix::fs::symlink("../secret.rules", inside.join("link.rules")).unwrap();
    let loaded = load(&inside.join("mine.rules"));
    assert_eq!(loaded.diagnostics[0].code, codes::OUTSIDE_FOLDER);
    assert_eq!(loaded.sources.files.len(), 1);
}

#[test]
fn a_missing_file_is_one_report() {
    let loaded = load(Path::new("nowhere/mine.rules"));
    assert_eq!(loaded.diagnostics.len(), 1);
    assert_eq!(loaded.diagnostics[0].severity, Severity::Error);
    insta::assert_snapshot!(report(&loaded));
}

/// What `check` reports of the example on a page is what the page shows. With `TEACHTREE_WRITE_PAGES` set the pages are written.
#[test]
fn pages_show_what_is_reported() {
    let mut pages = std::fs::read_to_string(Path::new(crate::ROOT).join("docs/reference/codes.md")).unwrap();
    let shown = |page: &str| {
        let (_, rest) = page.split_once("```rules\n")?;
        let (example, rest) = rest.split_once("```\n")?;
        Some((example.to_string(), rest.trim().to_string()))
    };
    for (code, _) in codes::ALL {
        let page = pages.split(&format!("\n## {code}\n")).nth(1).and_then(|rest| rest.split("\n## ").next()).unwrap();
        let Some((example, rest)) = shown(page) else { continue };
        let printed = report(&language::load_text("example.rules", &example));
        let printed: Vec<&str> = printed.lines().map(str::trim_end).collect();
        let wanted = format!("`check` reports\n\n```text\n{}\n```", printed.join("\n").trim());
        if std::env::var_os("TEACHTREE_WRITE_PAGES").is_some() {
            let (kept, _) = page.split_once("```rules\n").unwrap();
            let new = format!("{kept}```rules\n{example}```\n\n{wanted}\n");
            pages = pages.replacen(page, &new, 1);
        } else {
            assert_eq!(rest, wanted, "{code}; TEACHTREE_WRITE_PAGES=1 writes what is reported");
        }
    }
    if std::env::var_os("TEACHTREE_WRITE_PAGES").is_some() {
        std::fs::write(Path::new(crate::ROOT).join("docs/reference/codes.md"), pages).unwrap();
    }
}

/// Every code has its page, and the examples on the pages are what they say.
#[test]
fn each_code_has_a_page_whose_example_shows_it() {
    let mut examples = 0;
    for (code, _) in codes::ALL {
        let page = codes::page(code).unwrap_or_else(|| panic!("{code} has no page in docs/reference/codes.md"));
        assert!(!page.is_empty() && !page.contains("## "), "{code}");
        let Some(example) = page.split("```rules\n").nth(1).and_then(|rest| rest.split("\n```").next()) else {
            continue;
        };
        examples += 1;
        let found: BTreeSet<&str> =
            language::load_text("example.rules", example).diagnostics.iter().map(|finding| finding.code).collect();
        assert_eq!(found, BTreeSet::from([*code]), "{example}");
    }
    assert!(examples >= 40, "only {examples} pages have an example that is loaded");
    assert_eq!(codes::page("E999"), None);
}
