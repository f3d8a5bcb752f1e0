//! Writing: files whole or not at all, color and width only for a terminal.

use super::color::colored;
use super::print_args::{ColorMode, color_mode, is_quiet};
use super::progress;
use std::borrow::Cow;
use std::fmt::Write as _;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;
use teachtree_logs::atomic_write::Files;
use teachtree_logs::read::csv::beside;
use teachtree_logs::read::formats;

/// The width of a line where no terminal says one, in characters.
const USUAL_WIDTH: usize = 100;

/// Writes a file whole or not at all; never over a file that the command reads.
///
/// # Errors
/// When the place cannot be written, or is one of `inputs` or beside one of them.
pub fn write(path: &Path, text: &str, inputs: &[PathBuf]) -> Result<(), InputError> {
    let mut files = Files::default();
    add(&mut files, path, text, inputs)?;
    files.commit()
}

/// Adds a file to others that belong to it: all of them are written or none.
///
/// # Errors
/// As [`write`].
pub fn add(files: &mut Files, path: &Path, text: &str, inputs: &[PathBuf]) -> Result<(), InputError> {
    refuse_inputs(path, inputs)?;
    files.add(path, |out| out.write_all(text.as_bytes()))
}

/// Refuses a place for a recording where it, or what stands beside it, would replace a file that the command reads: a scene, commands, a robot, no log.
/// Asked before the work is done.
///
/// # Errors
/// When it would.
pub fn may_record(path: &Path, inputs: &[PathBuf]) -> Result<(), InputError> {
    formats::check_name(path)?;
    if path.is_dir() {
        return Err(InputError::new(path.display().to_string(), "is a folder, expected the name of a log"));
    }
    of_recording(path).iter().try_for_each(|file| refuse(file, inputs, &is_at))
}

/// The files that a recording at this place consists of.
pub fn of_recording(path: &Path) -> [PathBuf; 3] {
    let [scene, events] = BESIDE.map(|ending| path.with_extension(ending));
    [path.to_path_buf(), scene, events]
}

/// Refuses one file for two things that a command writes. Asked before the work is done.
///
/// # Errors
/// When two of them are one.
pub fn refuse_one_for_two(places: &[&Path]) -> Result<(), InputError> {
    // A file that does not exist yet is identified by its folder and its name.
    let known = |path: &Path| -> PathBuf {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let folder = std::fs::canonicalize(folder).unwrap_or_else(|_| folder.to_path_buf());
        std::fs::canonicalize(path).unwrap_or_else(|_| folder.join(path.file_name().unwrap_or_default()))
    };
    for (at, place) in places.iter().enumerate() {
        if !place.starts_with("/dev") && places[..at].iter().any(|other| known(other) == known(place)) {
            let message = "is the file of two outputs, and one would overwrite the other";
            return Err(InputError::new(place.display().to_string(), message).help("write to two files"));
        }
    }
    Ok(())
}

/// The files beside a log that are read with it.
const BESIDE: [&str; 2] = ["scene.yaml", "events.csv"];

/// Refuses a place that is one of the inputs, stands beside one, or is a file in a folder that is one.
///
/// # Errors
/// When it is.
pub fn refuse_inputs(path: &Path, inputs: &[PathBuf]) -> Result<(), InputError> {
    let is_beside = |input: &Path, place: &Path| {
        let log = formats::without_episode(input);
        let in_folder = log.is_dir() && std::fs::canonicalize(&log).is_ok_and(|folder| place.starts_with(folder));
        let files = || BESIDE.iter().flat_map(|ending| beside(input, ending));
        in_folder || is_at(input, place) || is_at(&log, place) || files().any(|file| is_at(&file, place))
    };
    refuse(path, inputs, &is_beside)
}

/// Whether a file is the one at a canonical place.
fn is_at(file: &Path, place: &Path) -> bool {
    std::fs::canonicalize(file).is_ok_and(|file| file == place)
}

fn refuse(path: &Path, inputs: &[PathBuf], would_be_lost: &dyn Fn(&Path, &Path) -> bool) -> Result<(), InputError> {
    let Ok(place) = std::fs::canonicalize(path) else { return Ok(()) };
    if inputs.iter().any(|input| would_be_lost(input, &place)) {
        let message = "is an input of this command and would be lost";
        return Err(InputError::new(path.display().to_string(), message).help("write to another file"));
    }
    Ok(())
}

/// Refuses the name of a new copy where something is.
///
/// # Errors
/// When something is there.
pub fn refuse_existing(copy: &Path) -> Result<(), InputError> {
    if copy.symlink_metadata().is_err() {
        return Ok(());
    }
    let error = InputError::new(copy.display().to_string(), "exists already, expected the name of a new copy");
    Err(error.help("name another one, or delete it first"))
}

/// Makes a folder with all above it.
///
/// # Errors
/// When it cannot be made.
pub fn make_folder(path: &Path) -> Result<(), InputError> {
    std::fs::create_dir_all(path)
        .map_err(|error| InputError::new(path.display().to_string(), format!("the folder cannot be made: {error}")))
}

/// Whether a letter would steer a terminal, or reorder text.
fn steers(letter: char) -> bool {
    letter.is_control() && !matches!(letter, '\n' | '\t') || REORDERS.contains(&letter)
}

/// A text that may quote anything, for a terminal: control characters and marks that reorder text are shown as escapes. Colors pass where there are any.
pub fn printable(text: &str, color: bool) -> Cow<'_, str> {
    if !text.contains(steers) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(letter) = rest.chars().next() {
        let taken = if color { color_code(rest) } else { 0 };
        let (head, tail) = rest.split_at(taken.max(letter.len_utf8()));
        if taken == 0 && steers(letter) {
            shown.extend(letter.escape_default());
        } else {
            shown.push_str(head);
        }
        rest = tail;
    }
    Cow::Owned(shown)
}

/// The marks of Unicode that change in which direction text runs.
const REORDERS: [char; 12] = [
    '\u{61c}', '\u{200e}', '\u{200f}', '\u{202a}', '\u{202b}', '\u{202c}', '\u{202d}', '\u{202e}', '\u{2066}',
    '\u{2067}', '\u{2068}', '\u{2069}',
];

/// How many bytes of a text are a code that sets a color, `ESC [ 1 ; 3 m`; 0 when it does not begin with one.
fn color_code(text: &str) -> usize {
    let Some(code) = text.strip_prefix("\u{1b}[") else { return 0 };
    let digits = code.bytes().take_while(|byte| byte.is_ascii_digit() || *byte == b';').count();
    if code.as_bytes().get(digits) == Some(&b'm') { digits + 3 } else { 0 }
}

/// Prints text on standard output without terminal control sequences. A reader that closes early is not an error.
///
/// # Errors
/// When it cannot be written, as on a full disk.
pub fn print(text: &str) -> Result<(), InputError> {
    put(&shown(text, color()))
}

/// A text as it is printed: without what would steer a terminal, shortened, and in color if that is wanted.
fn shown(text: &str, color: bool) -> String {
    let printable = printable(text, color);
    let short = shortened(&printable);
    if color { colored(&short).into_owned() } else { short.into_owned() }
}

/// Prints a part of a growing text, like [`print`]. Returns whether the output still has a reader.
///
/// # Errors
/// As [`print`].
pub fn print_more(text: &str) -> Result<bool, InputError> {
    put_more(&shown(text, color()))
}

/// Prints a text on standard error, without what would steer a terminal. A failure to print it is ignored.
pub fn complain(text: &str) {
    let text = shown(text, color_on_stderr());
    let _ = progress::aside(|| writeln!(std::io::stderr(), "{text}"));
}

/// Prints a note on standard error, unless the command is quiet.
pub fn note(text: &str) {
    if !is_quiet() {
        complain(text);
    }
}

/// Prints a warning on standard error, unless the command is quiet.
pub fn warn(warning: &str) {
    note(&format!("warning: {warning}"));
}

/// Prints what other programs read: tables, patches, scripts. Byte for byte, but on a terminal as [`print`].
///
/// # Errors
/// As [`print`].
pub fn print_data(text: &str) -> Result<(), InputError> {
    if std::io::stdout().is_terminal() { put(&printable(text, false)) } else { put(text) }
}

/// Prints JSON. What would steer a terminal stands in strings only, and is written by its number there, which is the same JSON.
///
/// # Errors
/// As [`print`].
pub fn print_json(text: &str) -> Result<(), InputError> {
    print_json_more(text).map(|_| ())
}

/// Prints a part of growing JSON, like [`print_json`]. Returns whether the output still has a reader.
///
/// # Errors
/// As [`print`].
pub fn print_json_more(text: &str) -> Result<bool, InputError> {
    if !text.contains(steers) {
        return put_more(text);
    }
    let mut safe = String::with_capacity(text.len());
    for letter in text.chars() {
        if steers(letter) {
            // All of them have one number of 16 bits.
            let _ = write!(safe, "\\u{:04x}", u32::from(letter));
        } else {
            safe.push(letter);
        }
    }
    put_more(&safe)
}

/// Characters of a line that are printed; of a longer one its beginning and its end.
const LONGEST: usize = 2000;
/// Characters of its end.
const END: usize = 400;

/// Lines as long as people read; a log may have a name of half a megabyte.
fn shortened(text: &str) -> Cow<'_, str> {
    if text.len() <= LONGEST || text.lines().all(|line| line.len() <= LONGEST) {
        return Cow::Borrowed(text);
    }
    let short = |line: &str| {
        let count = line.chars().count();
        if count <= LONGEST {
            return line.to_string();
        }
        let head: String = line.chars().take(LONGEST - END).collect();
        let tail: String = line.chars().skip(count - END).collect();
        format!("{head} … {} characters … {tail}", count - LONGEST)
    };
    Cow::Owned(text.split('\n').map(short).collect::<Vec<_>>().join("\n"))
}

fn put(text: &str) -> Result<(), InputError> {
    put_more(text).map(|_| ())
}

/// Whether anyone reads it.
fn put_more(text: &str) -> Result<bool, InputError> {
    let write = || {
        let mut out = std::io::stdout().lock();
        out.write_all(text.as_bytes()).and_then(|()| out.flush())
    };
    match progress::aside(write) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(InputError::new("standard output", format!("cannot be written: {error}"))),
    }
}

/// Whether standard output is printed in color.
pub fn color() -> bool {
    is_colored(std::io::stdout().is_terminal())
}

/// Whether standard error is printed in color.
pub fn color_on_stderr() -> bool {
    is_colored(std::io::stderr().is_terminal())
}

fn is_colored(is_terminal: bool) -> bool {
    let wanted =
        || std::env::var_os("NO_COLOR").is_none() && std::env::var_os("TERM").is_none_or(|term| term != "dumb");
    match color_mode() {
        ColorMode::Auto => is_terminal && wanted(),
        ColorMode::Always => true,
        ColorMode::Never => false,
    }
}

/// Maximum number of characters of a line.
pub fn width() -> usize {
    let asked = std::env::var("COLUMNS").ok().and_then(|columns| columns.parse().ok());
    let terminal = || terminal_size::terminal_size().map(|(width, _)| usize::from(width.0));
    asked.or_else(terminal).unwrap_or(USUAL_WIDTH).clamp(40, 200)
}
