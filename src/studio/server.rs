//! The server: a listener on loopback, and who may ask.
//!
//! Every path begins with a token that only the address has that was printed. The host must be this machine by its name or number and the port, so that no
//! name of another page can lead here; a request of another page says so in `Origin`, and is refused. Bodies are JSON, which no form can send.

use super::http::{Connection, NoRequest, Request, Response};
use super::{Studio, routes};
use crate::base::error::InputError;
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The most connections at a time.
const MAX_CONNECTIONS: usize = 64;

/// A server that listens, and answers once it is [`run`](Self::run).
pub struct Server {
    listener: TcpListener,
    port: u16,
    token: String,
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
        Ok(Self { listener, port, token })
    }

    /// The address of the page.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/{}/", self.port, self.token)
    }

    /// Answers until the program ends.
    pub fn run(self, studio: &Arc<Studio>) {
        let gate = Arc::new(Gate { port: self.port, token: self.token });
        let open = Arc::new(AtomicUsize::new(0));
        for stream in self.listener.incoming() {
            let Ok(stream) = stream else { continue };
            let (gate, studio, open) = (Arc::clone(&gate), Arc::clone(studio), Arc::clone(&open));
            let is_too_many = open.fetch_add(1, Ordering::SeqCst) >= MAX_CONNECTIONS;
            std::thread::spawn(move || {
                if !is_too_many {
                    // The other side may hang up at any time.
                    let _ = converse(stream, &gate, &studio);
                }
                open.fetch_sub(1, Ordering::SeqCst);
            });
        }
    }
}

fn converse(stream: TcpStream, gate: &Gate, studio: &Studio) -> std::io::Result<()> {
    let mut connection = Connection::new(stream)?;
    loop {
        match connection.next() {
            Ok(request) => {
                // A panic is a bug, but not one for which a user should lose the page.
                let answer = catch_unwind(AssertUnwindSafe(|| gate.answer(&request, studio)));
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
}

impl Gate {
    fn answer(&self, request: &Request, studio: &Studio) -> Response {
        let hosts = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{}", self.port));
        if !hosts.contains(&request.host) {
            return Response::refused(403, "the host of the request is not this server");
        }
        let is_own =
            |origin: &String| origin.strip_prefix("http://").is_some_and(|host| hosts.iter().any(|own| own == host));
        if !request.origin.as_ref().is_none_or(is_own) {
            return Response::refused(403, "the request comes from another page");
        }
        let mut parts = request.path.trim_start_matches('/').splitn(2, '/');
        let (token, path) = (parts.next().unwrap_or_default(), parts.next());
        if !self.is_token(token) {
            return Response::refused(403, "the address lacks the token that `teachtree studio` printed");
        }
        let Some(path) = path else { return Response::refused(404, "the address ends with a `/`") };
        let changes = match request.method.as_str() {
            "GET" | "HEAD" => false,
            "POST" | "PUT" => true,
            _ => return Response::refused(405, "the method is not GET, HEAD, POST or PUT"),
        };
        if changes && !request.content_type.starts_with("application/json") {
            return Response::refused(415, "the body is not application/json");
        }
        routes::answer(request, path, changes, studio)
    }

    /// Compares in a time that does not depend on where the texts differ.
    fn is_token(&self, text: &str) -> bool {
        text.len() == self.token.len() && text.bytes().zip(self.token.bytes()).fold(0, |all, (a, b)| all | (a ^ b)) == 0
    }
}
