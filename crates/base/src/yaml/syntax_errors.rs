//! Rewrites the errors of the YAML parser: what was found, what was expected, and a fix.

/// An error of the parser in plain words.
pub(super) struct SyntaxError {
    /// Line and column, from 1.
    pub at: (usize, usize),
    pub message: String,
    pub help: Option<String>,
}

impl SyntaxError {
    fn new(at: (usize, usize), message: impl Into<String>) -> Self {
        Self { at, message: message.into(), help: None }
    }

    fn help(self, help: &str) -> Self {
        Self { help: Some(help.into()), ..self }
    }
}

const QUOTE_VALUE: &str = "put the whole value in quotes: `KEY: \"VALUE\"`";

/// Explains a message of the parser about a place of the text; `None` for other messages.
pub(super) fn explain(text: &str, message: &str, at: (usize, usize)) -> Option<SyntaxError> {
    let (problem, context) = message.split_once(", while ").unwrap_or((message, ""));
    let problem = problem.split(" at line ").next().unwrap_or_default();
    // The parser omits the place at which the text begins.
    let opened = place_in(context).unwrap_or((1, 1));
    Some(match problem {
        "did not find expected key" => unexpected_key(text, at, opened),
        "mapping values are not allowed in this context" => unexpected_colon(text, at),
        "could not find expected ':'" => missing_colon(text, opened),
        "did not find expected '-' indicator" => {
            let message = format!("found `{}`, expected `-` as in line {}", found(text, at), opened.0);
            SyntaxError::new(at, message).help("each item of a list begins with `- `, in the same column")
        }
        "block sequence entries are not allowed in this context" => {
            SyntaxError::new(at, "found `- `, which begins an item of a list, expected a value").help(QUOTE_VALUE)
        }
        "found unexpected end of stream" if context.contains("quoted") => {
            SyntaxError::new(opened, "found a quote that is not closed, expected another one at the end of the value")
        }
        "did not find expected ',' or '}'" => unclosed(text, at, opened, '{', '}'),
        "did not find expected ',' or ']'" => unclosed(text, at, opened, '[', ']'),
        "found a tab character that violates indentation" => tab(at),
        "found character that cannot start any token" => match found(text, at).chars().next() {
            None | Some('\t') => tab(at),
            Some(sign) => {
                SyntaxError::new(at, format!("found `{sign}`, which cannot begin a value, expected a value in quotes"))
                    .help(QUOTE_VALUE)
            }
        },
        "unknown anchor" => {
            let message = format!("found `{}`, a reference to nothing, expected a value", found(text, at));
            SyntaxError::new(at, message).help("put a value that begins with `*` in quotes")
        }
        _ => return None,
    })
}

fn tab(at: (usize, usize)) -> SyntaxError {
    SyntaxError::new(at, "found a tab, expected spaces").help("YAML is indented with spaces")
}

/// The place of a `[` before `at` that its line does not close, where a key follows in a line below: the parser takes the key for a part of an item.
pub(super) fn unclosed_list(text: &str, at: (usize, usize)) -> Option<(usize, usize)> {
    let is_before = |place: (usize, usize)| place <= at;
    let mut open: Vec<(char, (usize, usize))> = vec![];
    for (number, line) in (1..).zip(text.lines()).take_while(|(number, _)| is_before((*number, 1))) {
        for (column, sign) in signs(line).filter(|(column, _)| is_before((number, *column))) {
            match sign {
                '[' | '{' => open.push((sign, (number, column))),
                ']' | '}' => drop(open.pop()),
                _ => {}
            }
        }
    }
    let (_, place) = open.pop().filter(|(sign, _)| *sign == '[')?;
    let head = line(text, place.0);
    let closes = signs(head).filter(|(column, sign)| *column > place.1 && *sign == ']').count();
    let opens = signs(head).filter(|(column, sign)| *column >= place.1 && *sign == '[').count();
    let below = text.lines().skip(place.0).find(|line| !line.trim().is_empty() && !line.trim_start().starts_with('#'));
    (closes < opens && below.is_some_and(is_key)).then_some(place)
}

/// Whether a line begins with a key.
fn is_key(line: &str) -> bool {
    let Some((key, rest)) = line.trim_start().split_once(':') else { return false };
    let is_name = !key.is_empty() && key.chars().all(|sign| sign.is_alphanumeric() || "._-<>".contains(sign));
    is_name && (rest.is_empty() || rest.starts_with(' '))
}

/// The characters of a line with their columns, from 1, without those in quotes and in a comment.
fn signs(line: &str) -> impl Iterator<Item = (usize, char)> {
    let (mut quote, mut before) = (None, ' ');
    let mut is_comment = false;
    (1..).zip(line.chars()).filter(move |(_, sign)| {
        is_comment |= quote.is_none() && *sign == '#' && before.is_whitespace();
        let was_quoted = quote.is_some();
        match quote {
            Some(open) if open == *sign => quote = None,
            None if matches!(*sign, '"' | '\'') && !before.is_alphanumeric() => quote = Some(*sign),
            _ => {}
        }
        before = *sign;
        !is_comment && !was_quoted && quote.is_none()
    })
}

/// Returns the text that does not continue the mapping that begins at `opened`: a line in another column, or more text after a value.
fn unexpected_key(text: &str, at: (usize, usize), opened: (usize, usize)) -> SyntaxError {
    let found = found(text, at);
    if found.starts_with("- ") {
        let message = format!("found an item of a list, expected a key as in line {}", opened.0);
        return SyntaxError::new(at, message).help("indent the items of a list below their key");
    }
    match above(text, at.0) {
        Some(above) if indent(line(text, at.0)) + 1 == at.1 => wrong_column(text, at.0, above),
        _ => {
            let message = format!("found `{found}` after a value, expected the end of the line");
            SyntaxError::new(at, message).help(QUOTE_VALUE)
        }
    }
}

fn missing_colon(text: &str, at: (usize, usize)) -> SyntaxError {
    let message = format!("found `{}`, expected a key with `:` and a space after it", found(text, at));
    SyntaxError::new(at, message).help("write `KEY: VALUE`")
}

/// A colon in a value: the line has two keys, the line above has none, or the key is indented more than the complete line above it.
fn unexpected_colon(text: &str, at: (usize, usize)) -> SyntaxError {
    let head: String = line(text, at.0).chars().take(at.1.saturating_sub(1)).collect();
    let is_key = |number: usize| {
        let line = line(text, number);
        line.contains(": ") || line.trim_end().ends_with(':')
    };
    match above(text, at.0).filter(|_| !head.contains(": ")) {
        Some(above) if !is_key(above) => missing_colon(text, (above, indent(line(text, above)) + 1)),
        Some(above) if indent(line(text, at.0)) > indent(line(text, above)) => wrong_column(text, at.0, above),
        _ => SyntaxError::new(at, "found `:` in a value, expected one key with one value").help(QUOTE_VALUE),
    }
}

/// A key that is not in the column of the line above it.
fn wrong_column(text: &str, number: usize, above: usize) -> SyntaxError {
    let [at, expected] = [number, above].map(|number| indent(line(text, number)) + 1);
    let found = found(text, (number, at));
    let message = format!("found `{found}` in column {at}, expected column {expected} as in line {above}");
    SyntaxError::new((number, at), message).help("indent all keys of a mapping by the same number of spaces")
}

/// The number of the nearest line above a line that is neither empty nor a comment.
fn above(text: &str, number: usize) -> Option<usize> {
    (1..number).rev().find(|number| {
        let line = line(text, *number).trim_start();
        !line.is_empty() && !line.starts_with('#')
    })
}

fn indent(line: &str) -> usize {
    line.chars().take_while(|sign| *sign == ' ').count()
}

/// A bracket that is not closed, or an item in it that does not end.
fn unclosed(text: &str, at: (usize, usize), opened: (usize, usize), open: char, close: char) -> SyntaxError {
    if at.0 > opened.0 {
        return SyntaxError::new(opened, format!("found `{open}` that is not closed, expected `,` or `{close}`"));
    }
    SyntaxError::new(at, format!("found `{}`, expected `,` or `{close}`", found(text, at)))
}

/// The place at the end of a context: `parsing a block mapping at line 8 column 3`.
fn place_in(context: &str) -> Option<(usize, usize)> {
    let (line, column) = context.rsplit_once(" at line ")?.1.split_once(" column ")?;
    Some((line.parse().ok()?, column.parse().ok()?))
}

fn line(text: &str, number: usize) -> &str {
    text.lines().nth(number.saturating_sub(1)).unwrap_or_default()
}

/// Characters of a line that a message quotes.
const QUOTED: usize = 40;

/// The rest of the line at a place, without its comment; the beginning of a long one.
fn found(text: &str, at: (usize, usize)) -> String {
    let rest: String = line(text, at.0).chars().skip(at.1.saturating_sub(1)).collect();
    let rest = if rest.starts_with('\t') { "\t" } else { rest.split(" #").next().unwrap_or_default().trim_end() };
    match rest.char_indices().nth(QUOTED) {
        Some((end, _)) => format!("{}…", rest.get(..end).unwrap_or_default()),
        None => rest.into(),
    }
}
