//! Writing: files whole or not at all, colour and width only for a terminal.

use crate::base::error::InputError;
use std::io::{IsTerminal, Write};
use std::path::Path;

/// The width of a line where no terminal says one, in characters.
const USUAL_WIDTH: usize = 100;

/// Writes a file whole or not at all.
///
/// # Errors
/// When the folder cannot be written.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), InputError> {
    let fail =
        |error: std::io::Error| InputError::new(path.display().to_string(), format!("cannot be written: {error}"));
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or_else(|| Path::new("."));
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(fail)?;
    file.write_all(bytes).map_err(fail)?;
    // A temporary file is private; what is written here is for others to read, as a plain file would be.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        file.as_file().set_permissions(std::fs::Permissions::from_mode(0o644)).map_err(fail)?;
    }
    file.persist(path).map_err(|error| fail(error.error))?;
    Ok(())
}

/// Makes a folder with all above it.
///
/// # Errors
/// When it cannot be made.
pub fn make_folder(path: &Path) -> Result<(), InputError> {
    std::fs::create_dir_all(path)
        .map_err(|error| InputError::new(path.display().to_string(), format!("the folder cannot be made: {error}")))
}

/// Prints a text on standard output. A reader that goes away early is no error.
pub fn print(text: &str) {
    let _ = std::io::stdout().lock().write_all(text.as_bytes());
}

/// Whether standard output wants colour.
pub fn color() -> bool {
    std::io::stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none()
}

/// Whether standard error wants colour.
pub fn color_on_stderr() -> bool {
    std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none()
}

/// How many characters a line may have.
pub fn width() -> usize {
    let asked = std::env::var("COLUMNS").ok().and_then(|columns| columns.parse().ok());
    let terminal = || terminal_size::terminal_size().map(|(width, _)| usize::from(width.0));
    asked.or_else(terminal).unwrap_or(USUAL_WIDTH).clamp(40, 200)
}
