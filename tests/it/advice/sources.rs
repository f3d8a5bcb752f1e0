//! Each piece of advice in the sources is executed by a case, or listed here with the reason.

use crate::ROOT;
use std::fs;
use std::path::{Path, PathBuf};

/// Crates whose advice has tests of its own: that about rules in the pages of its codes, that of pages in their tests.
const OTHER_TESTS: [&str; 5] =
    ["crates/language/", "crates/lsp/", "crates/serve/", "crates/studio/", "crates/teaching/"];

const FAULT: &str = "a fault of the program";
const FEATURE: &str = "another build of the program";
const OTHER_PROGRAM: &str = "another program does it";
const TOO_LARGE: &str = "needs gigabytes";
const LIST: &str = "lists what is known";
const OTHER_TEST: &str = "a test of its own executes it: it needs a server, a link, a large file or several commands";

/// How pieces of advice begin that no case executes, and why.
const ELSEWHERE: [(&str, &str); 45] = [
    ("take `#` from `robots` there", OTHER_TEST),
    ("use at least `resample: ", OTHER_TEST),
    ("please report this with the rules", FAULT),
    ("this is a bug of teachtree", FAULT),
    ("this build cannot ", FEATURE),
    ("build it with `cargo install", FEATURE),
    ("an endpoint is named with `--zenoh-connect", FEATURE),
    ("where nothing writes it any more, `h5clear", OTHER_PROGRAM),
    ("convert it first: `mcap convert", OTHER_PROGRAM),
    ("convert it first with `ros2 bag convert`", OTHER_PROGRAM),
    ("convert the bag with `ros2 bag convert`", OTHER_PROGRAM),
    ("convert an older bag with `rosbag fix`", OTHER_PROGRAM),
    ("save it as NPZ with SciPy", OTHER_PROGRAM),
    ("`git lfs pull` fetches", OTHER_PROGRAM),
    ("download the file again", OTHER_PROGRAM),
    ("on the robot, start `ros2 launch", OTHER_PROGRAM),
    ("make room there, or set TMPDIR", TOO_LARGE),
    ("cut the log into parts", TOO_LARGE),
    ("leave recordings out, or bind them at a lower rate", TOO_LARGE),
    ("map labels to fewer names", "needs labels of which no file has 40 lines or fewer"),
    ("`meshes: none` in the robot file", TOO_LARGE),
    ("expected a table of text", LIST),
    ("the scene has no bodies", LIST),
    ("its tracks are", LIST),
    ("`{name}` {reason}", LIST),
    ("the first one is left out: ", LIST),
    ("calibrate with a recording in the same scene", OTHER_TEST),
    ("delete it, or put a file in its place", OTHER_TEST),
    ("put a copy of the file in the place of the link", OTHER_TEST),
    ("delete the link", OTHER_TEST),
    ("delete the column and its feature", OTHER_TEST),
    ("add `hands: {right:", OTHER_TEST),
    ("name it: `of OBJECT`", OTHER_TEST),
    ("it has {names}; name one", OTHER_TEST),
    ("name a file that ends in `.yaml`, for AutoData", OTHER_TEST),
    ("choose one of them with `--camera TOPIC`", OTHER_TEST),
    ("`--cut whole` makes one episode", OTHER_TEST),
    ("`param NAME = VALUE in LOW .. HIGH` declares one", OTHER_TEST),
    ("columns of topics are called", OTHER_TEST),
    ("`teachtree init LOG` writes one, `teachtree config LOG`", OTHER_TEST),
    ("one of them is held out while the others", OTHER_TEST),
    ("commands are the JSON file that", OTHER_TEST),
    ("{one} and {two} are swapped", OTHER_TEST),
    ("--robot and --scene are swapped", OTHER_TEST),
    ("`udp://127.0.0.1:9000` takes rows of this machine", "it waits for datagrams"),
];

/// The sources of the program.
fn sources() -> Vec<PathBuf> {
    let (mut open, mut found) = (vec![Path::new(ROOT).join("crates"), Path::new(ROOT).join("src")], vec![]);
    while let Some(path) = open.pop() {
        if path.is_dir() {
            let entries = fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path());
            open.extend(entries.filter(|entry| !entry.ends_with("tests") && !entry.ends_with("target")));
        } else if path.extension().is_some_and(|it| it == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// The text of a literal behind its first quote, and what follows it.
fn literal(code: &str) -> (String, &str) {
    let (mut text, mut signs) = (String::new(), code.char_indices());
    while let Some((at, sign)) = signs.next() {
        match sign {
            '"' => return (text, &code[at + 1..]),
            '\\' => match signs.next().unwrap().1 {
                // The literal continues in the next line.
                '\n' => {
                    let rest = code[at + 2..].trim_start();
                    let (more, rest) = literal(rest);
                    return (text + &more, rest);
                }
                'n' => text.push('\n'),
                other => text.push(other),
            },
            other => text.push(other),
        }
    }
    panic!("a literal without an end");
}

/// The literals in the arguments of each call of `help`.
fn advice(code: &str) -> Vec<String> {
    let mut found = vec![];
    for (at, call) in code.match_indices(".help(") {
        let (mut rest, mut depth) = (&code[at + call.len()..], 1);
        while depth > 0 {
            let next = rest.find(['"', '(', ')']).unwrap();
            let sign = rest.as_bytes()[next];
            rest = &rest[next + 1..];
            match sign {
                b'"' => {
                    let (text, behind) = literal(rest);
                    found.push(text);
                    rest = behind;
                }
                b'(' => depth += 1,
                _ => depth -= 1,
            }
        }
    }
    found
}

/// The parts of a text between the values that are filled in.
fn parts(text: &str) -> Vec<String> {
    let text = text.replace("{{", "\u{1}").replace("}}", "\u{2}");
    let mut parts = vec![];
    for part in text.split('{') {
        let fixed = if parts.is_empty() { part } else { part.split_once('}').map_or(part, |(_, fixed)| fixed) };
        parts.push(fixed.replace('\u{1}', "{").replace('\u{2}', "}"));
    }
    parts
}

/// Whether a case expects a piece of advice: its fixed parts are in the text of the case as far as they are long, or that text is in it.
fn is_executed(text: &str, cases: &[String]) -> bool {
    let parts: Vec<String> = parts(text).into_iter().filter(|part| part.trim().len() >= 8).collect();
    parts.is_empty()
        || cases
            .iter()
            .any(|case| text.contains(case.as_str()) || parts.iter().any(|part| case.contains(part.as_str())))
}

#[test]
fn each_piece_of_advice_is_executed_or_listed() {
    let files = fs::read_dir(Path::new(ROOT).join("tests/fixtures/advice")).unwrap();
    let texts = files.map(|file| fs::read_to_string(file.unwrap().path()).unwrap());
    let lines = texts.flat_map(|text| text.lines().map(str::to_string).collect::<Vec<_>>());
    let cases: Vec<String> = lines.filter_map(|line| line.strip_prefix("advice ").map(str::to_string)).collect();
    let (mut missing, mut used, mut count) = (vec![], vec![false; ELSEWHERE.len()], 0);
    for path in sources() {
        let name = path.strip_prefix(ROOT).unwrap().display().to_string();
        if OTHER_TESTS.iter().any(|other| name.starts_with(other)) {
            continue;
        }
        for text in advice(&fs::read_to_string(&path).unwrap()) {
            count += 1;
            match ELSEWHERE.iter().position(|(start, _)| text.starts_with(start)) {
                Some(at) => used[at] = true,
                None if is_executed(&text, &cases) => {}
                None => missing.push(format!("{name}: {text}")),
            }
        }
    }
    assert!(count > 150, "{count}");
    assert!(missing.is_empty(), "no case in tests/fixtures/advice executes:\n{}", missing.join("\n"));
    let unused: Vec<&str> =
        ELSEWHERE.iter().zip(&used).filter(|(_, used)| !**used).map(|((start, _), _)| *start).collect();
    assert!(unused.is_empty(), "listed, but in no source: {unused:?}");
}
