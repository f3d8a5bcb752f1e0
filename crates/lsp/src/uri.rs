//! Paths and URIs. A text without a file, such as one that was never saved, gets a path that no file has: its URI.

use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The path that a URI means; canonical as far as it exists.
pub fn path_of(uri: &str) -> PathBuf {
    let Some(rest) = uri.strip_prefix("file://") else { return PathBuf::from(uri) };
    // `file:///a` and `file://localhost/a` mean the same.
    let path = decoded(rest.find('/').map_or("", |slash| rest.split_at(slash).1));
    // `/c:/a` is `c:/a` where there are drives.
    let drive = path.as_bytes().get(2) == Some(&b':') && cfg!(windows);
    real(Path::new(if drive { path.trim_start_matches('/') } else { &path }))
}

/// A path as the file system knows it; of a file that does not exist yet, at least its folder.
pub fn real(path: &Path) -> PathBuf {
    let in_folder = || Some(std::fs::canonicalize(path.parent()?).ok()?.join(path.file_name()?));
    std::fs::canonicalize(path).ok().or_else(in_folder).unwrap_or_else(|| path.to_path_buf())
}

/// The URI of a path.
pub fn uri_of(path: &Path) -> String {
    if !path.is_absolute() {
        return path.display().to_string();
    }
    let text = path.display().to_string().replace('\\', "/");
    let text = text.strip_prefix("//?/").unwrap_or(&text);
    let mut uri = String::from(if text.starts_with('/') { "file://" } else { "file:///" });
    for byte in text.bytes() {
        if byte.is_ascii_alphanumeric() || b"/-_.~".contains(&byte) {
            uri.push(char::from(byte));
        } else {
            let _ = write!(uri, "%{byte:02X}");
        }
    }
    uri
}

/// `%20` and the like as the bytes that they are; other text stays.
fn decoded(text: &str) -> String {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text;
    while let Some((head, tail)) = rest.split_once('%') {
        bytes.extend(head.bytes());
        let code = tail.get(..2).and_then(|digits| u8::from_str_radix(digits, 16).ok());
        match code {
            Some(byte) => bytes.push(byte),
            None => bytes.push(b'%'),
        }
        rest = code.and_then(|_| tail.get(2..)).unwrap_or(tail);
    }
    bytes.extend(rest.bytes());
    String::from_utf8_lossy(&bytes).into_owned()
}
