//! The server: a listener on loopback, and who may ask.
//!
//! Every path begins with a token that only the address has that was printed. The host must be this machine by its name or number and the port, so that no
//! name of another page can lead here; a request of another page says so in `Origin`, and is refused. Bodies are JSON, which no form can send.

use super::http::{Connection, NoRequest, Request, Response};
use crate::base::error::InputError;
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The most connections at a time.
const MAX_CONNECTIONS: usize = 64;

/// What is served: it answers requests that may be made.
pub trait Page: Send + Sync + 'static {
    /// The command that prints the address.
    const COMMAND: &'static str;

    /// Whether scripts of the page compile WebAssembly.
    fn compiles(&self) -> bool {
        false
    }

    /// Answers a request for a path below the token; whether it may change something.
    fn answer(&self, request: &Request, path: &str, changes: bool) -> Response;

    /// The answer to the key of a WebSocket, where there is one at this path.
    fn socket_accept(&self, _path: &str, _key: &str) -> Option<String> {
        None
    }

    /// Speaks on a WebSocket until it ends; `read` was read of it already.
    fn socket(&self, _stream: TcpStream, _read: Vec<u8>) {}
}

/// A server that listens, and answers once it is [`run`](Self::run).
pub struct Server {
    listener: TcpListener,
    port: u16,
    token: String,
    /// Where a proxy shows the page to others: `https://teach.example.org`.
    proxy: Option<String>,
}

impl Server {
    /// Listens on loopback; port 0 is any that is free.
    ///
    /// # Errors
    /// When the port is taken, or the system gives no random numbers for the token.
    pub fn new(port: u16) -> Result<Self, InputError> {
        let listen = || {
            let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
            let port = listener.local_addr()?.port();
            Ok::<_, std::io::Error>((listener, port))
        };
        let (listener, port) = listen().map_err(|error| {
            InputError::new(format!("port {port}"), format!("cannot be listened on: {error}"))
                .help("choose another one with --port, or leave it out")
        })?;
        let mut random = [0; 16];
        getrandom::fill(&mut random)
            .map_err(|error| InputError::new("the token", format!("the system gives no random numbers: {error}")))?;
        let token = random.iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(Self { listener, port, token, proxy: None })
    }

    /// Lets a proxy on this machine show the page to others, under this origin: `https://teach.example.org`.
    #[must_use]
    pub fn behind(mut self, proxy: Option<String>) -> Self {
        self.proxy = proxy;
        self
    }

    /// The address of the page.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/{}/", self.port, self.token)
    }

    /// Answers until the program ends.
    pub fn run<P: Page>(self, page: &Arc<P>) {
        let gate = Arc::new(Gate { port: self.port, token: self.token, proxy: self.proxy });
        let open = Arc::new(AtomicUsize::new(0));
        for stream in self.listener.incoming() {
            let Ok(stream) = stream else { continue };
            let (gate, page, open) = (Arc::clone(&gate), Arc::clone(page), Arc::clone(&open));
            let is_too_many = open.fetch_add(1, Ordering::SeqCst) >= MAX_CONNECTIONS;
            std::thread::spawn(move || {
                if !is_too_many {
                    // The other side may hang up at any time.
                    let _ = converse(stream, &gate, &*page);
                }
                open.fetch_sub(1, Ordering::SeqCst);
            });
        }
    }
}

fn converse<P: Page>(stream: TcpStream, gate: &Gate, page: &P) -> std::io::Result<()> {
    let mut connection = Connection::new(stream, page.compiles())?;
    loop {
        match connection.next() {
            Ok(request) => {
                if let Some(key) = &request.socket_key
                    && let Ok((path, false)) = gate.admit(&request, P::COMMAND)
                    && let Some(accept) = page.socket_accept(path, key)
                {
                    let (stream, read) = connection.upgrade(&accept)?;
                    page.socket(stream, read);
                    return Ok(());
                }
                // A panic is a bug, but not one for which a user should lose the page.
                let answer = catch_unwind(AssertUnwindSafe(|| match gate.admit(&request, P::COMMAND) {
                    Ok((path, changes)) => page.answer(&request, path, changes),
                    Err(refused) => refused,
                }));
                let answer = answer.unwrap_or_else(|_| Response::refused(500, "the request failed: this is a bug"));
                connection.send(Some(&request), answer)?;
                if request.closes {
                    return Ok(());
                }
            }
            Err(NoRequest::Gone) => return Ok(()),
            Err(NoRequest::Refused(response)) => return connection.send(None, response),
        }
    }
}

/// Who may ask.
struct Gate {
    port: u16,
    token: String,
    proxy: Option<String>,
}

impl Gate {
    /// The path below the token of a request that may be made, and whether it may change something.
    fn admit<'a>(&self, request: &'a Request, command: &str) -> Result<(&'a str, bool), Response> {
        let refused = |status, message: &str| Err(Response::refused(status, message));
        let hosts = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{}", self.port));
        let proxy = self.proxy.as_deref().unwrap_or_default();
        let is_proxy = |host: &str| !host.is_empty() && proxy.split("://").nth(1) == Some(host);
        if !hosts.contains(&request.host) && !is_proxy(&request.host) {
            return refused(403, "the host of the request is not this server");
        }
        let is_own = |origin: &String| {
            *origin == proxy || origin.strip_prefix("http://").is_some_and(|host| hosts.iter().any(|own| own == host))
        };
        if !request.origin.as_ref().is_none_or(is_own) {
            return refused(403, "the request comes from another page");
        }
        let mut parts = request.path.trim_start_matches('/').splitn(2, '/');
        let (token, path) = (parts.next().unwrap_or_default(), parts.next());
        if !self.is_token(token) {
            return refused(403, &format!("the address lacks the token that `teachtree {command}` printed"));
        }
        let Some(path) = path else { return refused(404, "the address ends with a `/`") };
        let changes = match request.method.as_str() {
            "GET" | "HEAD" => false,
            "POST" | "PUT" => true,
            _ => return refused(405, "the method is not GET, HEAD, POST or PUT"),
        };
        if changes && !request.content_type.starts_with("application/json") {
            return refused(415, "the body is not application/json");
        }
        Ok((path, changes))
    }

    /// Compares in a time that does not depend on where the texts differ.
    fn is_token(&self, text: &str) -> bool {
        text.len() == self.token.len() && text.bytes().zip(self.token.bytes()).fold(0, |all, (a, b)| all | (a ^ b)) == 0
    }
}
