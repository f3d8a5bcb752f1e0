//! Writing files whole or not at all.

use crate::base::error::InputError;
use std::io::{BufWriter, Error, Result, Write};
use std::path::Path;

/// Fills a file: beside its place first, then renamed, so that it is there whole or not at all. A link is followed; what is no file,
/// such as a pipe or a device, is written into.
///
/// # Errors
/// When the place cannot be written.
pub fn write(
    path: &Path,
    fill: impl FnOnce(&mut (dyn Write + Send)) -> Result<()>,
) -> std::result::Result<(), InputError> {
    put(path, fill).map_err(|error| {
        let why = match error.kind() {
            std::io::ErrorKind::NotFound => "there is no such folder".into(),
            std::io::ErrorKind::PermissionDenied => "the folder cannot be written".into(),
            _ => error.to_string(),
        };
        InputError::new(path.display().to_string(), format!("cannot be written: {why}"))
    })
}

fn put(path: &Path, fill: impl FnOnce(&mut (dyn Write + Send)) -> Result<()>) -> Result<()> {
    let target = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    if target.is_dir() {
        return Err(Error::other("it is a folder"));
    }
    if target.exists() && !target.is_file() {
        let mut out = BufWriter::new(std::fs::OpenOptions::new().write(true).open(&target)?);
        fill(&mut out)?;
        return out.flush();
    }
    let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut file = temporary().tempfile_in(folder)?;
    let mut out = BufWriter::new(&mut file);
    fill(&mut out)?;
    out.flush()?;
    drop(out);
    file.persist(&target).map_err(|error| error.error)?;
    Ok(())
}

/// Temporary files are private; what is written is an ordinary file, as the umask has it.
fn temporary() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".teachtree-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder
}
