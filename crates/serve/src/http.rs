//! HTTP/1.1 as far as a page on this machine needs it: a request in, a response out, both bounded.
//!
//! A head has at most 16 KiB and 64 fields. A body has its `Content-Length` and at most 8 MiB; chunked bodies are refused. A connection that sends nothing for
//! half a minute is closed.

use crate::duplex_stream::DuplexStream;
use std::fs::File;
use std::io::{ErrorKind, Read, Result, Seek, SeekFrom, Write};
use std::time::Duration;

/// The longest head, bytes.
const MAX_HEAD: usize = 16 << 10;
/// The most fields of a head.
const MAX_FIELDS: usize = 64;
/// Header fields that affect access or parsing and must have exactly one value.
const ONCE: [&str; 6] = ["Host", "Origin", "Content-Type", "Content-Length", "Range", "Sec-WebSocket-Key"];
/// The longest body, bytes.
pub const MAX_BODY: usize = 8 << 20;
/// Maximum number of bytes that are read from a refused request so that the client can read the response.
const MAX_LEFT: u64 = 1 << 30;
/// How long a connection may be silent.
const SILENCE: Duration = Duration::from_secs(30);
/// The maximum silence of a client whose request was refused.
const LAST_SILENCE: Duration = Duration::from_secs(2);
/// Nothing but what this server has: no script in the page itself, no frame around it, nothing from elsewhere. Colors of bars are attributes.
const POLICY: &str = "default-src 'none'; style-src 'self'; style-src-attr 'unsafe-inline'; img-src 'self' data:; \
     media-src 'self'; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// What was asked.
#[derive(Debug, Default)]
pub struct Request {
    /// `GET`, `HEAD`, `POST` or `PUT`.
    pub method: String,
    /// The path, decoded, without what is after `?`.
    pub path: String,
    /// What is after `?`, decoded.
    pub query: Vec<(String, String)>,
    /// The field `Host`.
    pub host: String,
    /// The field `Origin`.
    pub origin: Option<String>,
    /// The media type of the field `Content-Type` in lower case, without parameters.
    pub content_type: String,
    /// The first and the last byte that are asked for, of a file.
    pub range: Option<Range>,
    /// The body.
    pub body: Vec<u8>,
    /// Whether the connection ends with this request.
    pub closes: bool,
    /// The key of a request to go on as a WebSocket.
    pub socket_key: Option<String>,
}

/// A part of a file: from a byte to another one or the end, or its last bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Range {
    /// From this byte to that one, or the end.
    From(u64, Option<u64>),
    /// The last bytes, by their number.
    Last(u64),
}

impl Request {
    /// The value of a key after `?`.
    pub fn query_value(&self, key: &str) -> Option<&str> {
        self.query.iter().find(|(known, _)| known == key).map(|(_, value)| value.as_str())
    }
}

/// What is answered.
pub struct Response {
    /// The status, such as 200.
    pub status: u16,
    /// The media type.
    pub kind: &'static str,
    /// What is sent.
    pub content: Content,
}

/// The body of a response.
pub enum Content {
    /// Bytes that are known.
    Bytes(Vec<u8>),
    /// A file, of which a part may be asked for.
    File(File),
}

impl Response {
    /// A text in JSON.
    pub fn json(value: &serde_json::Value) -> Self {
        Self { status: 200, kind: "application/json", content: Content::Bytes(value.to_string().into_bytes()) }
    }

    /// A refusal with a sentence for the user.
    pub fn refused(status: u16, message: &str) -> Self {
        Self { status, ..Self::json(&serde_json::json!({ "error": message })) }
    }
}

/// A connection.
pub struct Connection {
    stream: DuplexStream,
    /// What was read and not used yet.
    buffer: Vec<u8>,
    /// Where scripts of its pages may come from.
    scripts: &'static str,
}

/// The reason why a connection yields no request.
pub enum RequestFailure {
    /// The other side is gone, or silent.
    Closed,
    /// It sent something other than a supported request.
    Refused(Response),
}

impl Connection {
    /// A connection that was accepted; whether scripts of its pages compile WebAssembly.
    pub fn new(stream: DuplexStream, compiles: bool) -> Result<Self> {
        stream.tcp().set_read_timeout(Some(SILENCE))?;
        stream.tcp().set_write_timeout(Some(SILENCE))?;
        stream.tcp().set_nodelay(true)?;
        let scripts = if compiles { "'self' 'wasm-unsafe-eval'" } else { "'self'" };
        Ok(Self { stream, buffer: Vec::new(), scripts })
    }

    fn fill(&mut self) -> std::result::Result<(), RequestFailure> {
        let mut part = [0; 16 << 10];
        loop {
            match self.stream.read(&mut part) {
                Ok(0) => return Err(RequestFailure::Closed),
                Ok(length) => {
                    self.buffer.extend_from_slice(part.get(..length).unwrap_or_default());
                    return Ok(());
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => return Err(RequestFailure::Closed),
            }
        }
    }

    /// The next request.
    pub fn next(&mut self) -> std::result::Result<Request, RequestFailure> {
        let refused = |status, message: &str| RequestFailure::Refused(Response::refused(status, message));
        let (mut request, head, length) = loop {
            if let Some(found) = parsed(&self.buffer)? {
                break found;
            }
            if self.buffer.len() > MAX_HEAD {
                return Err(refused(431, "the head of the request is too long"));
            }
            self.fill()?;
        };
        if head > MAX_HEAD {
            return Err(refused(431, "the head of the request is too long"));
        }
        if length > MAX_BODY {
            return Err(refused(413, &format!("the body has {length} bytes, at most {MAX_BODY} are taken")));
        }
        while self.buffer.len() < head + length {
            self.fill()?;
        }
        let rest = self.buffer.split_off(head + length);
        request.body = self.buffer.split_off(head);
        self.buffer = rest;
        Ok(request)
    }

    /// Reads and discards the rest of a refused request. Unread bytes would reset the connection on close, and the client would lose the response.
    pub fn finish(&self) -> Result<()> {
        self.stream.close_writing();
        self.stream.tcp().set_read_timeout(Some(LAST_SILENCE))?;
        std::io::copy(&mut self.stream.tcp().take(MAX_LEFT), &mut std::io::sink()).map(|_| ())
    }

    /// Upgrades to a WebSocket, with the answer to its key. Returns the stream and the bytes read so far.
    pub fn upgrade(mut self, accept: &str) -> Result<(DuplexStream, Vec<u8>)> {
        let head = format!(
            "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {accept}\r\n\r\n"
        );
        self.stream.write_all(head.as_bytes())?;
        Ok((self.stream, self.buffer))
    }

    /// Sends a response.
    pub fn send(&mut self, request: Option<&Request>, response: Response) -> Result<()> {
        let Response { mut status, kind, content } = response;
        let (mut file, bytes) = match content {
            Content::Bytes(bytes) => (None, bytes),
            Content::File(file) => (Some(file), Vec::new()),
        };
        let whole = match &file {
            Some(file) => file.metadata()?.len(),
            None => bytes.len() as u64,
        };
        let mut part = (0, whole);
        let mut more = String::new();
        if let Some(file) = &mut file {
            more.push_str("Accept-Ranges: bytes\r\n");
            match request.and_then(|request| request.range).map(|range| part_of(range, whole)) {
                Some(Some((start, end))) => {
                    status = 206;
                    part = (start, end);
                    more.push_str(&format!("Content-Range: bytes {start}-{}/{whole}\r\n", end - 1));
                    file.seek(SeekFrom::Start(start))?;
                }
                Some(None) => {
                    status = 416;
                    part = (0, 0);
                    more.push_str(&format!("Content-Range: bytes */{whole}\r\n"));
                }
                None => {}
            }
        }
        let length = part.1 - part.0;
        let closes = request.is_none_or(|request| request.closes);
        let head = format!(
            "HTTP/1.1 {status} {}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\n{more}Content-Security-Policy: script-src {}; {POLICY}\r\n\
             X-Content-Type-Options: nosniff\r\nX-Frame-Options: DENY\r\nReferrer-Policy: no-referrer\r\nCache-Control: no-store\r\n\
             Cross-Origin-Opener-Policy: same-origin\r\nCross-Origin-Resource-Policy: same-origin\r\nConnection: {}\r\n\r\n",
            reason(status),
            self.scripts,
            if closes { "close" } else { "keep-alive" },
        );
        self.stream.write_all(head.as_bytes())?;
        if request.is_some_and(|request| request.method == "HEAD") {
            return Ok(());
        }
        match file {
            Some(file) => std::io::copy(&mut file.take(length), &mut self.stream).map(|_| ()),
            None => self.stream.write_all(&bytes),
        }
    }
}

/// Returns the part of a file of `whole` bytes, `[start, end)`; `None` if the range is empty.
fn part_of(range: Range, whole: u64) -> Option<(u64, u64)> {
    let (start, end) = match range {
        Range::From(start, last) => (start, last.map_or(whole, |last| last.saturating_add(1).min(whole))),
        Range::Last(count) => (whole.saturating_sub(count), whole),
    };
    (start < end).then_some((start, end))
}

/// A head that is there as a whole: the request without its body, the length of the head, and that of the body.
fn parsed(bytes: &[u8]) -> std::result::Result<Option<(Request, usize, usize)>, RequestFailure> {
    let refused = |status, message: &str| Err(RequestFailure::Refused(Response::refused(status, message)));
    let mut fields = [httparse::EMPTY_HEADER; MAX_FIELDS];
    let mut head = httparse::Request::new(&mut fields);
    let length = match head.parse(bytes) {
        Ok(httparse::Status::Complete(length)) => length,
        Ok(httparse::Status::Partial) => return Ok(None),
        Err(error) => return refused(400, &format!("no HTTP request: {error}")),
    };
    let fields = |name: &'static str| head.headers.iter().filter(move |field| field.name.eq_ignore_ascii_case(name));
    // A proxy may have checked the other one of two values.
    if let Some(name) = ONCE.into_iter().find(|name| fields(name).count() > 1) {
        return refused(400, &format!("the request has the header field `{name}` twice"));
    }
    let field = |name| fields(name).next().map(|field| String::from_utf8_lossy(field.value).trim().to_string());
    if field("Transfer-Encoding").is_some() {
        return refused(411, "a chunked body is not supported, expected `Content-Length`");
    }
    let body = field("Content-Length").map_or(Ok(0), |text| text.parse::<usize>());
    let Ok(body) = body else { return refused(400, "`Content-Length` is not a number") };
    let target = head.path.unwrap_or("/");
    let (path, query) = target.split_once('?').unwrap_or((target, ""));
    let Some(path) = decoded(path, false) else { return refused(400, "the path is not valid UTF-8") };
    let pairs = query.split('&').filter(|pair| !pair.is_empty()).map(|pair| {
        let (key, value) = pair.split_once('=').unwrap_or((pair, ""));
        Some((decoded(key, true)?, decoded(value, true)?))
    });
    let Some(query) = pairs.collect() else { return refused(400, "the query is not valid UTF-8") };
    let is_old = head.version == Some(0);
    let closes = is_old || field("Connection").is_some_and(|how| how.eq_ignore_ascii_case("close"));
    let is_socket = field("Upgrade").is_some_and(|how| how.eq_ignore_ascii_case("websocket"));
    let socket_key = field("Sec-WebSocket-Key").filter(|_| is_socket);
    let request = Request {
        method: head.method.unwrap_or_default().into(),
        path,
        query,
        host: field("Host").unwrap_or_default(),
        origin: field("Origin"),
        content_type: field("Content-Type").map(|text| media_type(&text)).unwrap_or_default(),
        range: field("Range").as_deref().and_then(range),
        body: Vec::new(),
        closes,
        socket_key,
    };
    Ok(Some((request, length, body)))
}

/// Returns the media type in lower case without parameters, such as `application/json` for `application/json; charset=utf-8`.
fn media_type(text: &str) -> String {
    text.split(';').next().unwrap_or_default().trim().to_ascii_lowercase()
}

/// The only part of a file that is asked for; several parts are answered with the whole.
fn range(text: &str) -> Option<Range> {
    let (first, last) = text.strip_prefix("bytes=")?.split_once('-')?;
    match (first.trim(), last.trim()) {
        ("", count) => Some(Range::Last(count.parse().ok()?)),
        (first, "") => Some(Range::From(first.parse().ok()?, None)),
        (first, last) => Some(Range::From(first.parse().ok()?, Some(last.parse().ok()?))),
    }
}

/// A text with `%20` and, in a query, `+` in it; `None` where it is not UTF-8.
fn decoded(text: &str, in_query: bool) -> Option<String> {
    let digit = |byte: u8| char::from(byte).to_digit(16);
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        match byte {
            b'%' => {
                let (high, low) = (digit(rest.next()?)?, digit(rest.next()?)?);
                bytes.push(u8::try_from(high * 16 + low).ok()?);
            }
            b'+' if in_query => bytes.push(b' '),
            byte => bytes.push(byte),
        }
    }
    String::from_utf8(bytes).ok()
}

fn reason(status: u16) -> &'static str {
    match status {
        200 => "OK",
        206 => "Partial Content",
        400 => "Bad Request",
        403 => "Forbidden",
        404 => "Not Found",
        405 => "Method Not Allowed",
        409 => "Conflict",
        411 => "Length Required",
        413 => "Content Too Large",
        415 => "Unsupported Media Type",
        416 => "Range Not Satisfiable",
        422 => "Unprocessable Content",
        431 => "Request Header Fields Too Large",
        503 => "Service Unavailable",
        _ => "Internal Server Error",
    }
}
