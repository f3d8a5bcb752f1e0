//! The side of a server in TLS, which a reader and a writer share.
//!
//! The state of TLS is locked for computations only, never while the system waits: a reader waits for bytes by looking at them (`peek`), a writer sends what
//! was encrypted after it has let go of the state. Records leave in the order in which they were encrypted, since only the writer whose turn it is encrypts.

use super::certificate::Certificate;
use super::duplex_stream::{Cipher, DuplexStream};
use super::host::Host;
use super::server::Server;
use rustls::{ServerConfig, ServerConnection};
use std::io::{self, Error, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use teachtree_base::error::InputError;

impl Server {
    /// Listens for other machines, which reach this one by a host, and know it by a certificate.
    ///
    /// # Errors
    /// When the port is taken, the host is not an address of this machine, or the system gives no random numbers for the token.
    pub fn for_others(host: &Host, port: u16, certificate: &Certificate) -> Result<Self, InputError> {
        let config = Arc::clone(certificate.config());
        let encrypt = move |tcp| DuplexStream::with_tls(tcp, Arc::clone(&config));
        Self::encrypted(host, port, Box::new(encrypt))
    }
}

impl DuplexStream {
    /// Takes over the connection of a client, with TLS.
    ///
    /// # Errors
    /// When the configuration cannot start a session.
    pub fn with_tls(tcp: TcpStream, config: Arc<ServerConfig>) -> io::Result<Self> {
        Ok(Self::encrypted(tcp, Box::new(Tls::new(config)?)))
    }
}

struct Tls(Mutex<ServerConnection>);

impl Tls {
    fn new(config: Arc<ServerConfig>) -> io::Result<Self> {
        Ok(Self(Mutex::new(ServerConnection::new(config).map_err(Error::other)?)))
    }

    fn state(&self) -> MutexGuard<'_, ServerConnection> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sends what is encrypted, by who has the turn. What a writer encrypts is taken out before it lets go of the state: a reader would take it for an answer
    /// that it has to send, and wait for its turn while the writer waits for the other side.
    fn send(&self, mut tcp: &TcpStream, mut state: MutexGuard<'_, ServerConnection>) -> io::Result<()> {
        let mut records = Vec::new();
        while state.wants_write() {
            state.write_tls(&mut records)?;
        }
        drop(state);
        tcp.write_all(&records)
    }
}

impl Cipher for Tls {
    fn read<'a>(
        &self,
        mut tcp: &TcpStream,
        buffer: &mut [u8],
        turn: &dyn Fn() -> MutexGuard<'a, ()>,
    ) -> io::Result<usize> {
        loop {
            let decrypted = self.state().reader().read(buffer);
            match decrypted {
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                done => return done,
            }
            // Its end counts as something that has come.
            tcp.peek(&mut [0])?;
            let mut state = self.state();
            state.read_tls(&mut tcp)?;
            let taken = state.process_new_packets();
            let answers = state.wants_write();
            drop(state);
            if answers {
                let _turn = turn();
                self.send(tcp, self.state())?;
            }
            taken.map_err(|error| Error::new(ErrorKind::InvalidData, error))?;
        }
    }

    fn write(&self, tcp: &TcpStream, bytes: &[u8]) -> io::Result<usize> {
        let mut rest = bytes;
        while !rest.is_empty() {
            let mut state = self.state();
            let taken = state.writer().write(rest)?;
            self.send(tcp, state)?;
            rest = rest.get(taken..).filter(|_| taken > 0).ok_or(ErrorKind::WriteZero)?;
        }
        Ok(bytes.len())
    }

    fn close(&self, tcp: &TcpStream) {
        let mut state = self.state();
        state.send_close_notify();
        // The other side may be gone already.
        let _ = self.send(tcp, state);
    }
}
