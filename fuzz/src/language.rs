//! Rule files, and what is about them: proofs, the language server, expectations.

use crate::repository;
use std::io::Cursor;
use std::sync::LazyLock;
use teachtree_analysis::expect::{Expectation, Line, compare, pending};
use teachtree_language::graph::compare::{prove_extension, declarations, differences};
use teachtree_language::graph::{lower, text};
use teachtree_language::{self as language, load_text};
use teachtree_lsp::{Settings, serve};
use teachtree_logs::read::csv::parse_scene;
use teachtree::{Log, Question, Rules, Style};

/// What stands between two texts of an input.
const BETWEEN: &str = "\n=====\n";

/// A short recording, against which rules run.
static LOG: LazyLock<Log> = LazyLock::new(|| {
    let demos = repository().join("demos/robosuite");
    let log = Log::options().binding(demos.join("panda_lift.binding.yaml"));
    log.open(demos.join("lift_demo_1.csv")).expect("a recording")
});

/// A text of rules: checked, formatted, and run on a recording.
pub fn rules(data: &[u8]) {
    let Ok(written) = std::str::from_utf8(data) else { return };
    Rules::options().text("fuzz.rules", written).check();
    if let Ok(once) = language::format::format(written) {
        assert_eq!(language::format::format(&once).ok().as_ref(), Some(&once), "what is formatted stays");
    }
    let Ok(rules) = Rules::options().text("fuzz.rules", written).for_log(&LOG) else { return };
    rules.svg();
    if let Some(rules) = load_text("fuzz.rules", written).rules {
        text(&lower(&rules));
    }
    let Ok(analysis) = rules.analyze(&LOG) else { return };
    analysis.json();
    analysis.eaf();
    analysis.text(Style::default());
    analysis.csv().expect("a table");
    let middle = f64::midpoint(analysis.start_s(), analysis.end_s());
    let explained = analysis.explain(&Question::at(middle));
    explained.iter().for_each(|explained| drop(explained.json()));
}

/// Two texts of rules, held against each other.
pub fn pairs(data: &[u8]) {
    let Some((one, other)) = std::str::from_utf8(data).ok().and_then(|data| data.split_once(BETWEEN)) else { return };
    let (Some(one), Some(other)) = (load_text("one.rules", one).rules, load_text("other.rules", other).rules) else {
        return;
    };
    prove_extension(&one, &other).is_proved();
    differences(&one, &other);
    declarations(&one, &other);
    // Rules add nothing to themselves.
    let same = prove_extension(&one, &one);
    assert!(same.new.is_empty() && same.findings.is_empty(), "{same:?}");
}

/// Messages of an editor: one a line, or bytes as they come.
pub fn lsp(data: &[u8]) {
    let mut input = Vec::new();
    if data.starts_with(b"{") {
        for line in data.split(|byte| *byte == b'\n') {
            input.extend(format!("Content-Length: {}\r\n\r\n", line.len()).bytes());
            input.extend(line);
        }
    } else {
        input.extend(data);
    }
    let mut output = Vec::new();
    let wrong = |path: &std::path::Path, text: &str| parse_scene(text, &path.display().to_string()).err();
    serve(Cursor::new(input), &mut output, Settings::default(), wrong).expect("the output takes everything");
}

/// A file of expectations: held against rules and against nothing, and updated.
pub fn expectations(data: &[u8]) {
    static RULES: LazyLock<language::Rules> = LazyLock::new(|| {
        language::load(&language::Request { needs_tree: true, ..language::Request::default() }).rules.expect("rules")
    });
    let Ok(written) = std::str::from_utf8(data) else { return };
    let Ok(read) = Expectation::read(written, "fuzz.expect") else { return };
    let _ = read.check(&RULES, "fuzz.expect");
    assert!(compare(&read.lines, &read.lines, read.tolerance_s).is_empty(), "lines are as they are expected");
    compare(&read.lines, &[], read.tolerance_s);
    let found: Vec<Line> = read.lines.iter().rev().cloned().collect();
    for updated in [read.updated(&found, false), read.updated(&found, true), pending(&read, &found)] {
        Expectation::read(&updated, "updated.expect").expect("what was updated can be read");
    }
}
