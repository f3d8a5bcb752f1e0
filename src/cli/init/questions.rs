//! The questions of `init` in a terminal.

use super::super::{Failure, output};
use std::io::{BufRead, IsTerminal};
use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_frames::inspect::{Inspection, ValueKind, inspect};
use teachtree_frames::propose::{Answers, Proposal, Question, propose, with_places};
use teachtree_logs::read::formats;

/// The highest rate of rows, Hz.
const MAX_HZ: f64 = 1e4;

/// The proposal for a log, with the answers of a person where there is one.
///
/// # Errors
/// A log that cannot be read, or has no number.
pub fn proposed(log: &Path, may_ask: bool) -> Result<Proposal, Failure> {
    let inspected = inspect(formats::open(log)?, None, None)?;
    refuse_texts(&inspected)?;
    let first = propose(&inspected, &Answers::default());
    let is_asked = may_ask && std::io::stdin().is_terminal() && std::io::stderr().is_terminal();
    if !is_asked || first.questions.is_empty() {
        return Ok(with_places(first, &inspected, &Answers::default(), &|| formats::open(log)));
    }
    let mut answers = Answers::default();
    let mut input = std::io::stdin().lock();
    for question in &first.questions {
        match question {
            Question::Rate(rate) => {
                let text = format!("The rows have no stamps. Rows in a second? [{rate}] ");
                let rate = |answer: &str| if answer.is_empty() { Some(*rate) } else { hertz(answer) };
                answers.rate_hz = Some(asked(&text, &mut input, rate)?);
            }
            Question::Closed(side, closed, otherwise) => {
                let text = format!("Is the {side} gripper closed when `{closed}`, and not when `{otherwise}`? [Y/n] ");
                answers.is_reversed.insert(*side, asked(&text, &mut input, is_no)?);
            }
        }
    }
    Ok(with_places(propose(&inspected, &answers), &inspected, &answers, &|| formats::open(log)))
}

/// Refuses a log without any number.
fn refuse_texts(log: &Inspection) -> Result<(), InputError> {
    let columns = || log.sheets.iter().flat_map(|sheet| &sheet.columns);
    if columns().any(|column| column.kind != ValueKind::Text) || columns().next().is_none() {
        return Ok(());
    }
    let names: Vec<String> = columns().take(3).map(|column| format!("`{}`", column.name)).collect();
    let message =
        format!("found only texts ({}), expected columns of numbers, such as positions and forces", names.join(", "));
    Err(InputError::new(log.log.clone(), message)
        .help("name the recording itself; this may be a list of recordings or a log of messages"))
}

/// A rate of rows, Hz.
fn hertz(answer: &str) -> Option<f64> {
    let number = answer.strip_suffix("Hz").unwrap_or(answer).trim();
    number.parse().ok().filter(|rate| *rate > 0.0 && *rate <= MAX_HZ)
}

/// Whether an answer is no; an empty one is yes.
fn is_no(answer: &str) -> Option<bool> {
    match answer.to_lowercase().as_str() {
        "" | "y" | "yes" => Some(false),
        "n" | "no" => Some(true),
        _ => None,
    }
}

/// Asks a person until the answer can be read. At the end of the input it is empty.
fn asked<T>(question: &str, input: &mut impl BufRead, read: impl Fn(&str) -> Option<T>) -> Result<T, InputError> {
    loop {
        output::complain(question);
        let mut line = String::new();
        let bytes = input.read_line(&mut line).map_err(|error| InputError::new("standard input", error.to_string()))?;
        match read(line.trim()) {
            Some(answer) => return Ok(answer),
            None if bytes == 0 => return Err(InputError::new("standard input", "the answer is missing")),
            None => {}
        }
    }
}
