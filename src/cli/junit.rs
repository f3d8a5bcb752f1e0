//! Results in the form of JUnit, which most CI systems show. Only elements and attributes of the common schema are written.

use std::fmt::Write;

/// Results that belong together, such as those of a file.
pub struct Suite {
    pub name: String,
    pub cases: Vec<Case>,
}

/// A result.
pub struct Case {
    pub name: String,
    /// The group in which CI systems list it, such as a file.
    pub class: String,
    pub outcome: Outcome,
}

/// The result of a test.
pub enum Outcome {
    /// As expected; with a note, or an empty text.
    Passed(String),
    /// Not as expected: a line, and the details.
    Failed(String, String),
    /// The test could not run: a line, and the details.
    Error(String, String),
}

/// The document of all results.
pub fn xml(name: &str, suites: &[Suite]) -> String {
    let all = || suites.iter().flat_map(|suite| &suite.cases);
    let mut out = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let _ = writeln!(out, "<testsuites name=\"{}\" {}>", escaped(name), counts(all()));
    for suite in suites {
        let _ = writeln!(out, "  <testsuite name=\"{}\" {}>", escaped(&suite.name), counts(suite.cases.iter()));
        for case in &suite.cases {
            write_case(&mut out, case);
        }
        out.push_str("  </testsuite>\n");
    }
    out.push_str("</testsuites>\n");
    out
}

fn counts<'c>(cases: impl Iterator<Item = &'c Case> + Clone) -> String {
    let failures = cases.clone().filter(|case| matches!(case.outcome, Outcome::Failed(..))).count();
    let errors = cases.clone().filter(|case| matches!(case.outcome, Outcome::Error(..))).count();
    format!("tests=\"{}\" failures=\"{failures}\" errors=\"{errors}\"", cases.count())
}

fn write_case(out: &mut String, case: &Case) {
    let _ = write!(out, "    <testcase name=\"{}\" classname=\"{}\"", escaped(&case.name), escaped(&case.class));
    let (element, message, text) = match &case.outcome {
        Outcome::Passed(note) if note.is_empty() => return out.push_str("/>\n"),
        Outcome::Passed(note) => {
            let _ = writeln!(out, ">\n      <system-out>{}</system-out>\n    </testcase>", escaped(note));
            return;
        }
        Outcome::Failed(message, text) => ("failure", message, text),
        Outcome::Error(message, text) => ("error", message, text),
    };
    let _ = writeln!(
        out,
        ">\n      <{element} message=\"{}\">{}</{element}>\n    </testcase>",
        escaped(message),
        escaped(text)
    );
}

/// A text in XML. Characters that XML cannot have are replaced.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\n' | '\t' => out.push(letter),
            '\u{fffe}' | '\u{ffff}' => out.push('\u{fffd}'),
            _ if letter.is_control() => out.push('\u{fffd}'),
            _ => out.push(letter),
        }
    }
    out
}
