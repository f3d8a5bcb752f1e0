//! Messages from bytes. A malformed message is answered and skipped, so that a client's mistake does not end the server. A claimed length takes
//! no memory.

use lsp_server::Message;
use std::io::{self, BufRead, Read};

/// The longest message: far beyond the largest rule file.
const MAX_MESSAGE: u64 = 64 << 20;
/// The longest line of a header.
const MAX_HEADER: u64 = 4096;

/// A message from the input.
pub enum WireMessage {
    /// A message.
    Message(Message),
    /// Something else, and what is wrong with it.
    Malformed(String),
}

/// Reads the next message; `None` when the input has ended.
///
/// # Errors
/// When the input cannot be read.
pub fn read(input: &mut impl BufRead) -> io::Result<Option<WireMessage>> {
    let mut length = None;
    loop {
        let mut line = Vec::new();
        if input.by_ref().take(MAX_HEADER).read_until(b'\n', &mut line)? == 0 {
            return Ok(None);
        }
        let line = String::from_utf8_lossy(&line);
        let line = line.trim_end();
        if line.is_empty() {
            break;
        }
        if let Some((name, value)) = line.split_once(':')
            && name.trim().eq_ignore_ascii_case("content-length")
        {
            length = Some(value.trim().parse::<u64>());
        }
    }
    let length = match length {
        Some(Ok(length)) => length,
        Some(Err(_)) => return Ok(Some(WireMessage::Malformed("`Content-Length` is not a number of bytes".into()))),
        None => return Ok(Some(WireMessage::Malformed("a message begins with `Content-Length`".into()))),
    };
    if length > MAX_MESSAGE {
        io::copy(&mut input.take(length), &mut io::sink())?;
        return Ok(Some(WireMessage::Malformed(format!("a message has at most {MAX_MESSAGE} bytes, found {length}"))));
    }
    let mut body = Vec::new();
    if (input.take(length).read_to_end(&mut body)? as u64) < length {
        return Ok(None);
    }
    Ok(Some(match serde_json::from_slice(&body) {
        Ok(message) => WireMessage::Message(message),
        Err(error) => WireMessage::Malformed(format!("this is not a message: {error}")),
    }))
}
