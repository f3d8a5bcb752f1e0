//! The server: a listener, and the policy that admits requests.
//!
//! Every path begins with a token that only the address has that was printed. The host must be the one of that address, so that no name of another page can
//! lead here; a request of another page says so in `Origin`, and is refused. Bodies are JSON, which no form can send.

use super::connections::OpenConnections;
use super::host::Host;
use super::http::{Connection, Request, RequestFailure, Response};
use crate::duplex_stream::DuplexStream;
use std::io::ErrorKind;
use std::net::{IpAddr, Ipv4Addr, TcpListener, TcpStream};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use teachtree_base::error::InputError;

/// The first byte of a handshake in TLS.
const HANDSHAKE: u8 = 22;

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
    fn socket(&self, _stream: DuplexStream, _read: Vec<u8>) {}
}

/// Encrypts a connection.
pub type Encryptor = Box<dyn Fn(TcpStream) -> std::io::Result<DuplexStream> + Send + Sync>;

/// A server that listens, and answers once it is [`run`](Self::run).
pub struct Server {
    listener: TcpListener,
    /// `None` where pages are not encrypted.
    encrypt: Option<Encryptor>,
    policy: AccessPolicy,
}

impl Server {
    /// Listens on loopback; port 0 is any that is free.
    ///
    /// # Errors
    /// When the port is taken, or the system gives no random numbers for the token.
    pub fn new(port: u16) -> Result<Self, InputError> {
        let (listener, port) = listen(Ipv4Addr::LOCALHOST.into(), port)?;
        let origins = ["127.0.0.1", "localhost"].map(|host| format!("http://{host}:{port}"));
        Ok(Self { listener, encrypt: None, policy: AccessPolicy::new(origins.into())? })
    }

    /// Listens for other machines, which reach this one by a host; `encrypt` encrypts their connections.
    ///
    /// # Errors
    /// When the port is taken, the host is not an address of this machine, or the system gives no random numbers for the token.
    pub fn encrypted(host: &Host, port: u16, encrypt: Encryptor) -> Result<Self, InputError> {
        let (listener, port) = listen(host.listens_on(), port)?;
        Ok(Self { listener, encrypt: Some(encrypt), policy: AccessPolicy::new(vec![host.origin(port)])? })
    }

    /// Lets a proxy on this machine show the page to others, under this origin: `https://teach.example.org`.
    #[must_use]
    pub fn behind(mut self, proxy: Option<String>) -> Self {
        self.policy.origins.extend(proxy);
        self
    }

    /// The address of the page.
    pub fn address(&self) -> String {
        format!("{}/{}/", self.policy.origins.first().map_or("", String::as_str), self.policy.token)
    }

    /// Answers until the program ends.
    pub fn run<P: Page>(self, page: &Arc<P>) {
        let policy = Arc::new(self.policy);
        let connections = Arc::new(OpenConnections::default());
        let is_encrypted = self.encrypt.is_some();
        for stream in self.listener.incoming() {
            let Ok(stream) = stream else { continue };
            let stream = match &self.encrypt {
                Some(encrypt) => encrypt(stream),
                None => Ok(DuplexStream::new(stream)),
            };
            let Ok(stream) = stream else { continue };
            let (policy, page, connections) = (Arc::clone(&policy), Arc::clone(page), Arc::clone(&connections));
            connections.enter(&stream);
            std::thread::spawn(move || {
                let mut client = ClientConnection { stream, is_authenticated: false, connections: &connections };
                // The other side may hang up at any time.
                let _ = client.converse(is_encrypted, &policy, &*page);
                connections.leave(&client.stream, client.is_authenticated);
                client.stream.close();
            });
        }
    }
}

fn listen(address: IpAddr, port: u16) -> Result<(TcpListener, u16), InputError> {
    let listen = || {
        let listener = TcpListener::bind((address, port))?;
        let port = listener.local_addr()?.port();
        Ok::<_, std::io::Error>((listener, port))
    };
    listen().map_err(|error| {
        let (place, help) = match error.kind() {
            ErrorKind::AddrNotAvailable => {
                (address.to_string(), "choose an address of this machine, or a name that leads to it")
            }
            _ => (format!("port {port}"), "choose another one with --port, or leave it out"),
        };
        InputError::new(place, format!("cannot be listened on: {error}")).help(help)
    })
}

/// A connection, and whether it has shown the token.
struct ClientConnection<'a> {
    stream: DuplexStream,
    is_authenticated: bool,
    connections: &'a OpenConnections,
}

impl ClientConnection<'_> {
    fn converse<P: Page>(&mut self, is_encrypted: bool, policy: &AccessPolicy, page: &P) -> std::io::Result<()> {
        let mut connection = Connection::new(self.stream.clone(), page.compiles())?;
        let mut first = [0];
        if is_encrypted && self.stream.tcp().peek(&mut first)? == 1 && first != [HANDSHAKE] {
            return self.refuse_plain();
        }
        loop {
            match connection.next() {
                Ok(request) => {
                    let admitted = policy.admit(&request, P::COMMAND);
                    if admitted.is_ok() && !self.is_authenticated {
                        self.is_authenticated = true;
                        if !self.connections.admit(&self.stream) {
                            return connection.send(None, Response::refused(503, "too many connections are open"));
                        }
                    }
                    if let Some(key) = &request.socket_key
                        && let Ok((path, false)) = admitted
                        && let Some(accept) = page.socket_accept(path, key)
                    {
                        let (stream, read) = connection.upgrade(&accept)?;
                        page.socket(stream, read);
                        return Ok(());
                    }
                    // A panic is a bug, but not one for which a user should lose the page.
                    let answer = catch_unwind(AssertUnwindSafe(|| match admitted {
                        Ok((path, changes)) => page.answer(&request, path, changes),
                        Err(refused) => refused,
                    }));
                    let answer = answer.unwrap_or_else(|_| Response::refused(500, "the request failed: this is a bug"));
                    connection.send(Some(&request), answer)?;
                    if request.closes {
                        return Ok(());
                    }
                }
                Err(RequestFailure::Closed) => return Ok(()),
                Err(RequestFailure::Refused(response)) => {
                    connection.send(None, response)?;
                    return connection.finish();
                }
            }
        }
    }

    /// Answers who asks without TLS, in words.
    fn refuse_plain(&self) -> std::io::Result<()> {
        let mut connection = Connection::new(DuplexStream::new(self.stream.tcp().try_clone()?), false)?;
        connection.send(None, Response::refused(400, "the address begins with https://"))?;
        let finished = connection.finish();
        self.stream.hang_up();
        finished
    }
}

/// The rules that admit a request: its origin and its token.
struct AccessPolicy {
    /// The origins of the page, that of its address first.
    origins: Vec<String>,
    token: String,
}

impl AccessPolicy {
    /// With a token that cannot be guessed.
    fn new(origins: Vec<String>) -> Result<Self, InputError> {
        let mut random = [0; 16];
        getrandom::fill(&mut random)
            .map_err(|error| InputError::new("the token", format!("the system gives no random numbers: {error}")))?;
        let token = random.iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(Self { origins, token })
    }

    /// The path below the token of a request that may be made, and whether it may change something.
    fn admit<'a>(&self, request: &'a Request, command: &str) -> Result<(&'a str, bool), Response> {
        let refused = |status, message: &str| Err(Response::refused(status, message));
        if !self.origins.iter().any(|origin| origin.split("://").nth(1) == Some(&request.host)) {
            return refused(403, "the host of the request is not this server");
        }
        if !request.origin.as_ref().is_none_or(|origin| self.origins.contains(origin)) {
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
        if changes && request.content_type != "application/json" {
            return refused(415, "the body is not application/json");
        }
        Ok((path, changes))
    }

    /// Compares in a time that does not depend on where the texts differ.
    fn is_token(&self, text: &str) -> bool {
        text.len() == self.token.len() && text.bytes().zip(self.token.bytes()).fold(0, |all, (a, b)| all | (a ^ b)) == 0
    }
}
